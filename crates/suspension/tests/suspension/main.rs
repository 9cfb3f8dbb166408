//! Arrangements of particles: exact fractions and gaps, and the structure of fluids in equilibrium.

mod fluid;
mod packings;
