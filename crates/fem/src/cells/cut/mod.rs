//! The Stokes operator on cells that balls cut, matrix-free, from the moments of [`crate::cut`].
//!
//! With `eps` the strain, `n` the normal out of the fluid, `V = U + w x r` the motion of the ball, the fluid
//! part `F` of a cell and the part `G` of the ball's surface in it, the forms of Nitsche's symmetric method
//! are
//!
//! `a(u, v) = int_F 2 eta eps(u):eps(v) - int_G (2 eta eps(u) n).(v - V_v) - int_G (2 eta eps(v) n).(u - V_u)
//!  + int_G beta (u - V_u).(v - V_v)`,
//! `b(u, q) = int_F q div u - int_G q n.(u - V_u)`
//!
//! (Nitsche 1971; Freund and Stenberg 1995; the rigid motions are unknowns). At the Gauss points, in whose
//! Lagrange polynomials the moments are given, all of them are sums of products of values and gradients:
//! a cut cell is a sum-factorised cell with `D + 2` numbers at every point ([`kernel`]). A cell that several
//! balls cut is one *piece* for each ball; the first has the volume.

mod kernel;
mod operator;
#[cfg(test)]
mod tests;

pub use operator::{CutOperator, CutPiece};
