//! The constraints of a step: one a pair, linear in the velocities, re-linearised where the particles end up.

use gluey_geom::Vector;

use crate::graph::could_close;
use crate::solver::GapOperator;
use crate::{ContactError, Mobility, PairKey, StepGeometry};

/// One pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constraint<const D: usize> {
    pub pair: PairKey,
    /// Particles in the order of space; the normal points from `tail` to `head`.
    pub tail: usize,
    pub head: usize,
    pub normal: Vector<D>,
    /// Sum of the radii.
    pub rest: f64,
}

impl<const D: usize> Constraint<D> {
    /// The constraint of a pair, its normal not yet known.
    pub(crate) fn new(pair: PairKey, ranks: &[u32], radii: &[f64]) -> Self {
        let (i, j) = pair.indices();
        let (tail, head) = if ranks[i] < ranks[j] { (i, j) } else { (j, i) };
        Self { pair, tail, head, normal: Vector::zeros(), rest: radii[i] + radii[j] }
    }

    /// `value_head - value_tail`.
    pub(crate) fn difference(&self, values: &[Vector<D>]) -> Vector<D> {
        values[self.head] - values[self.tail]
    }

    /// Vector between the centres when the particles have moved by `displacements`.
    pub(crate) fn separation(&self, positions: &[Vector<D>], displacements: &[Vector<D>]) -> Vector<D> {
        // As the integrator does it: first each end position, rounded, then their difference.
        (positions[self.head] + displacements[self.head]) - (positions[self.tail] + displacements[self.tail])
    }

    /// Gap when the particles have moved by `displacements`.
    pub(crate) fn gap(&self, positions: &[Vector<D>], displacements: &[Vector<D>]) -> f64 {
        self.separation(positions, displacements).norm() - self.rest
    }

    /// Whether the pair's gap could close under `displacements`.
    pub(crate) fn could_close(
        &self,
        positions: &[Vector<D>],
        displacements: &[Vector<D>],
        margin: f64,
    ) -> bool {
        let gap = self.difference(positions).norm() - self.rest;
        could_close(gap, &self.difference(displacements), self.rest, margin)
    }

    /// Takes the normal from a separation.
    pub(crate) fn point_along(&mut self, separation: &Vector<D>) -> Result<(), ContactError> {
        let distance = separation.norm();
        // Below this the direction is rounding noise.
        if distance <= 1e-12 * self.rest {
            return Err(ContactError::Coincident { pair: self.pair });
        }
        self.normal = separation / distance;
        Ok(())
    }
}

/// `B^T forces`, accumulated per particle in the order of the constraints.
pub(crate) fn spread<const D: usize>(
    constraints: &[Constraint<D>],
    forces: &[f64],
    on_particles: &mut [Vector<D>],
) {
    on_particles.fill(Vector::zeros());
    for (constraint, force) in constraints.iter().zip(forces) {
        let push = constraint.normal * *force;
        on_particles[constraint.head] += push;
        on_particles[constraint.tail] -= push;
    }
}

/// `A = c B M^-1 B^T`.
pub(crate) struct ContactOperator<'a, const D: usize, M> {
    pub constraints: &'a [Constraint<D>],
    pub step: &'a StepGeometry<'a, D>,
    pub mobility: &'a M,
    pub workspace: &'a mut Workspace<D>,
}

/// Vectors of all particles.
#[derive(Clone, Debug)]
pub(crate) struct Workspace<const D: usize> {
    pub forces: Vec<Vector<D>>,
    pub velocities: Vec<Vector<D>>,
}

impl<const D: usize> Default for Workspace<D> {
    fn default() -> Self {
        Self { forces: Vec::new(), velocities: Vec::new() }
    }
}

impl<const D: usize> Workspace<D> {
    pub(crate) fn resize(&mut self, count: usize) {
        self.forces.resize(count, Vector::zeros());
        self.velocities.resize(count, Vector::zeros());
    }
}

impl<const D: usize, M: Mobility<D>> ContactOperator<'_, D, M> {
    /// The change of velocity `M^-1 B^T forces`.
    pub(crate) fn velocities(&mut self, forces: &[f64]) -> &[Vector<D>] {
        let workspace = &mut *self.workspace;
        spread(self.constraints, forces, &mut workspace.forces);
        self.mobility.apply(self.step.radii, &workspace.forces, &mut workspace.velocities);
        &workspace.velocities
    }
}

impl<const D: usize, M: Mobility<D>> GapOperator for ContactOperator<'_, D, M> {
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]) {
        let (constraints, rate) = (self.constraints, self.step.rate);
        let velocities = self.velocities(forces);
        for (gap, constraint) in gaps.iter_mut().zip(constraints) {
            *gap = rate * constraint.normal.dot(&constraint.difference(velocities));
        }
    }
}
