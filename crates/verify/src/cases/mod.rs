//! The chapters of the book.

mod cells;
mod cost;
mod crystals;
mod disc;
mod discs;
mod doublet;
mod equilibrium;
mod exact_flows;
mod inclusion;
mod integrator;
mod lattices;
mod linear_flow;
mod manufactured;
mod pair_stresslets;
mod random_pairs;
mod rough_pairs;
mod rough_paths;
mod sheared;
mod spheres;
mod symmetry;
mod unequal_pairs;
mod wall;

use crate::case::VerificationCase;

/// All of them, in the order of the book.
pub const CASES: &[VerificationCase] = &[
    manufactured::CASE,
    exact_flows::CASE,
    disc::CASE,
    discs::CASE,
    linear_flow::DISC,
    linear_flow::SPHERE,
    inclusion::CASE,
    spheres::CASE,
    pair_stresslets::CASE,
    unequal_pairs::CASE,
    rough_pairs::CASE,
    rough_paths::CASE,
    wall::DISC,
    wall::SPHERE,
    lattices::CASE,
    crystals::CASE,
    sheared::CASE,
    cells::CASE,
    random_pairs::CASE,
    equilibrium::CASE,
    integrator::CASE,
    doublet::CASE,
    symmetry::CASE,
    cost::CASE,
];
