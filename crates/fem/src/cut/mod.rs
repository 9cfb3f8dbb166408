//! Integrals over cells that balls cut.
//!
//! What an unfitted method integrates on a cell, products of two functions of degree 2 or of their gradients,
//! are polynomials `f` of degree at most 4 in each coordinate: they are known by their values at the `5^D`
//! Gauss points `x_q` of the cell. With the Lagrange polynomials `l_q` of these points
//!
//! `int_{K \ B} f = sum_q w_q f(x_q)`, `int_{K cap dB} n_k f = sum_q s_qk f(x_q)`,
//! `int_{K cap dB} f = sum_q r_q f(x_q)`
//!
//! hold exactly, where `w_q`, `s_qk`, `r_q` are the integrals of `l_q`, `n_k l_q` and `l_q`. So a cut cell
//! costs what a cell with a viscosity of its own at each point costs, and the divergence theorem holds
//! between its volume and its surfaces to rounding, which Nitsche's method needs.
//!
//! The integrals of `l_q` over the part of the ball in the cell and over its sections with faces are taken
//! along rays (`rays`, `sections`); the divergence theorem gives those over the surface (`moments`). Rays are
//! parametrised by angles, in
//! which chords have no square roots, and cut where they begin to miss faces and edges of the cell
//! (`intervals`). Planes may cut a ball flat: what they leave is convex, and a ray still enters and leaves it
//! once (`slice`, `corners`). Compare Saye (2015, 10.1137/140966290), whose height functions these are for a
//! ball.

mod ball;
mod corners;
mod disc;
mod flat;
mod frame;
mod intervals;
mod moments;
mod polynomials;
mod products;
mod rays;
mod sections;
mod slice;
mod viscous;

pub use ball::BallInCell;
pub use flat::FlatInCell;
pub use moments::{CutMoments, CutRules, SurfaceMoments};
pub use polynomials::POINTS;
pub use products::{PairLines, Products};
pub use viscous::ViscousMatrices;
