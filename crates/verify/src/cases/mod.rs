//! The chapters of the book.

mod cost;
mod disc;
mod discs;
mod doublet;
mod equilibrium;
mod exact_flows;
mod integrator;
mod lattices;
mod linear_flow;
mod manufactured;
mod sheared;
mod spheres;
mod symmetry;
mod wall;

use crate::case::Case;

/// All of them, in the order of the book.
pub const CASES: &[Case] = &[
    manufactured::CASE,
    exact_flows::CASE,
    disc::CASE,
    discs::CASE,
    linear_flow::DISC,
    linear_flow::SPHERE,
    spheres::CASE,
    wall::CASE,
    lattices::CASE,
    sheared::CASE,
    equilibrium::CASE,
    integrator::CASE,
    doublet::CASE,
    symmetry::CASE,
    cost::CASE,
];
