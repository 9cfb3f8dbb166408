//! The paper's figures, drawn from whatever runs exist.

mod data;
mod gaps;
mod limit;
mod setups;
mod trajectories;

use super::plan::FigureName;
use gluey_pictures::Canvas;

pub use data::{Data, legend};

/// Draws one figure.
pub fn draw(figure: FigureName, data: &Data) -> Canvas {
    match figure {
        FigureName::Fig4 => setups::particles(2),
        FigureName::Fig8 => setups::particles(3),
        FigureName::Limit => limit::limit(),
        FigureName::Fig5 | FigureName::Fig7a => gaps::pair(figure, data),
        FigureName::Fig9 => gaps::trio(data),
        FigureName::Fig6 | FigureName::Fig7b | FigureName::Fig10 | FigureName::Fig11 => {
            trajectories::paths(figure, data)
        }
    }
}
