//! The velocity block of a system in single precision, all of it or around some of the nodes.

use gluey_linalg::LinOp;

use super::restricted::{CountedOperator, acting};
use super::system::StokesSystem;
use crate::space::own_cells;
use crate::term::{Scratch, Terms, add_terms};

/// `A` on reduced velocities, right at some of the nodes, which counts its applications.
#[derive(Clone, Debug)]
pub struct ViscousOperator<const D: usize> {
    fluid: CountedOperator<f32, D>,
    /// The cells that act on fewer nodes.
    near: CountedOperator<f32, D>,
    terms: Terms<D>,
    scratch: Scratch<f32>,
}

impl<const D: usize> ViscousOperator<D> {
    /// The velocity block of `system`: its loads on marked nodes, and all loads of velocities that vanish but
    /// at the nodes `near`.
    pub fn new(system: &StokesSystem<D>, marked: &[bool], near: &[bool]) -> Self {
        let fluid = |marked: &[bool]| {
            let own = own_cells(system.discretisation(), &system.cells);
            let cells = acting(system.discretisation(), &own, marked);
            CountedOperator::within(system, &cells)
        };
        Self {
            fluid: fluid(marked),
            near: fluid(near),
            terms: system.terms.clone(),
            scratch: Scratch::default(),
        }
    }

    /// `y = A x` for velocities that vanish but near the surfaces.
    pub fn apply_near(&mut self, x: &[f32], y: &mut [f32]) {
        self.near.apply(x, y);
        self.add_terms(x, y);
    }

    /// Applications since the last call.
    pub fn take_applications(&mut self) -> f64 {
        self.fluid.take_applications() + self.near.take_applications()
    }

    fn add_terms(&mut self, x: &[f32], y: &mut [f32]) {
        add_terms(&self.terms, [x, &[], &[]], [y, &mut [], &mut []], &mut self.scratch);
    }
}

impl<const D: usize> LinOp<f32> for ViscousOperator<D> {
    fn dim(&self) -> usize {
        self.fluid.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.fluid.apply(x, y);
        self.add_terms(x, y);
    }
}
