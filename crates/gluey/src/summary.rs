//! What a case is, in a few numbers.

use gluey_geom::ball_volume;
use serde::Serialize;

use crate::case::Case;
use crate::number_text::{shown, shown_to};

/// A case in a few numbers.
#[derive(Clone, Debug, Serialize)]
pub struct CaseSummary {
    /// Name of the case.
    pub name: String,
    /// Dimension of space.
    pub dimension: usize,
    /// Number of particles.
    pub particles: usize,
    /// Part of the volume of the box (in 2D: of its area) that is in particles.
    pub volume_fraction: f64,
    /// Contact strategy.
    pub strategy: String,
    /// How rigidity enters the flow, or the name of the model that replaces the flow.
    pub formulation: String,
    /// Cells per radius of the smallest particle at the surfaces, as asked for and as the mesh has them;
    /// absent where the flow has none.
    pub cells_per_radius: Option<[f64; 2]>,
    /// Time step.
    pub time_step: f64,
    /// Time at the end of the run; absent in checkpoints, whose runs may end at any time.
    pub end: Option<f64>,
    /// Steps of the run; absent as `end` is.
    pub steps: Option<usize>,
}

impl CaseSummary {
    /// Of a case with its end.
    pub fn of(case: &Case) -> Self {
        let steps = case.step_count();
        let end = Some(steps as f64 * case.time.step);
        Self { end, steps: Some(steps), ..Self::without_end(case) }
    }

    /// Of a case whose end is not known.
    pub fn without_end(case: &Case) -> Self {
        Self {
            name: case.name.clone(),
            dimension: case.dimension,
            particles: case.particles.len(),
            volume_fraction: volume_fraction(case),
            strategy: case.contact.strategy.to_string(),
            formulation: case.flow_name().to_owned(),
            cells_per_radius: case.cells_per_radius_as_built().map(|built| [case.cells_per_radius(), built]),
            time_step: case.time.step,
            end: None,
            steps: None,
        }
    }

    /// For people.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let of_what = if self.dimension == 2 { "discs" } else { "spheres" };
        let mut lines = vec![
            ("case", format!("{}, {}D", self.name, self.dimension)),
            (
                "particles",
                format!("{} {of_what}, volume fraction {:.4}", self.particles, self.volume_fraction),
            ),
            ("model", format!("{}, contact {}", self.formulation, self.strategy)),
        ];
        if let Some([asked, built]) = self.cells_per_radius {
            let cells = format!("{} as built, at least {} asked for", shown_to(built, 4), shown(asked));
            lines.push(("cells per radius", cells));
        }
        if let (Some(steps), Some(end)) = (self.steps, self.end) {
            lines.push(("run", format!("{steps} steps of {} to t = {}", shown(self.time_step), shown(end))));
        }
        lines
    }
}

fn volume_fraction(case: &Case) -> f64 {
    let volume = if case.dimension == 2 { ball_volume::<2> } else { ball_volume::<3> };
    let solid: f64 = case.particles.iter().map(|particle| volume(particle.radius)).sum();
    let edges = case.upper().into_iter().zip(case.lower()).map(|(upper, lower)| upper - lower);
    solid / edges.product::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fraction_is_that_of_the_case() {
        for (text, fraction) in [
            (include_str!("../../../data/cases/suspension-2d.toml"), 0.3),
            (include_str!("../../../data/cases/suspension-3d.toml"), 0.2),
        ] {
            let case = Case::parse(text, "case.toml").unwrap_or_else(|error| panic!("{error}"));
            let found = CaseSummary::of(&case).volume_fraction;
            assert!((found - fraction).abs() < 1e-12, "{found}");
        }
    }
}
