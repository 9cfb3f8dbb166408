//! One V-cycle on the velocity block.

use gluey_linalg::{Preconditioner, Scalar, vector};
use gluey_parallel::Halo;

use super::coarse::CoarseSolver;
use super::hierarchy::Hierarchy;
use super::level::{Level, Smoothing};
use crate::error::StokesError;
use crate::precondition::{Correction, Ties};
use crate::space::{VelocitySpace, norm};

/// A level that a cycle is to have.
pub struct LevelPlan<const D: usize> {
    /// Velocities with the bodies' nodes eliminated.
    pub space: VelocitySpace<D>,
    /// Its viscosity.
    pub viscosity: f64,
    /// How it smooths, if it does.
    pub smoothing: Option<Smoothing>,
}

/// A V-cycle on the velocity block.
pub struct VCycle<const D: usize> {
    /// The meshes.
    pub hierarchy: Hierarchy<D>,
    /// Coarsest first.
    pub levels: Vec<Level<D>>,
    /// On the rank that holds all of the coarsest level.
    coarse: Option<CoarseSolver>,
    /// For the errors that the levels do not reduce.
    correction: Option<Box<dyn Correction>>,
    /// Load and velocities of the correction.
    wide: [Vec<f64>; 2],
}

impl<const D: usize> VCycle<D> {
    /// The cycle on the meshes of `hierarchy`, a plan for each. All ranks call this.
    ///
    /// # Errors
    /// If a diagonal or the matrix of the coarsest level has no inverse, on all ranks.
    pub fn new(
        hierarchy: Hierarchy<D>,
        plans: Vec<LevelPlan<D>>,
        correction: Option<Box<dyn Correction>>,
    ) -> Result<Self, StokesError> {
        let level = |(level, plan): (usize, LevelPlan<D>)| {
            let mesh = plan.space.discretisation().clone();
            let made = Level::new(plan.space, plan.viscosity, plan.smoothing);
            mesh.agreed(made.map_err(|source| StokesError::Smoother { level, source }))
        };
        let viscosity = plans[0].viscosity;
        let levels = plans.into_iter().enumerate().map(level).collect::<Result<Vec<_>, _>>()?;
        let coarse = levels[0].space.whole().map(|space| CoarseSolver::new(space, viscosity));
        let coarse = levels[0].space.discretisation().agreed(coarse.transpose())?;
        Ok(Self { hierarchy, levels, coarse, correction, wide: Default::default() })
    }

    /// Applications on the finest mesh since the last call, see
    /// [`crate::SolveReport::fine_operator_applications`].
    pub fn take_fine_applications(&mut self) -> f64 {
        let levels = self.levels.last_mut().map_or(0.0, Level::take_applications);
        levels + self.correction.as_mut().map_or(0.0, |correction| correction.take_applications())
    }

    fn run(&mut self, top: usize) {
        if top == 0 {
            return self.solve_coarsest();
        }
        let (below, above) = self.levels.split_at_mut(top);
        above[0].restrict(&mut self.hierarchy.transfers[top - 1], &mut below[top - 1]);
        self.run(top - 1);
        let (below, above) = self.levels.split_at_mut(top);
        above[0].correct(&self.hierarchy.transfers[top - 1], &mut below[top - 1]);
        above[0].smooth();
    }

    /// One rank solves for all.
    fn solve_coarsest(&mut self) {
        let Level { b, x, halo, .. } = &mut self.levels[0];
        match &mut self.coarse {
            Some(coarse) => coarse.solve(b, x),
            None => x.fill(0.0),
        }
        halo.sum(x);
    }
}

impl<const D: usize> VCycle<D> {
    /// `z = V r` on the reduced vectors of the finest rigid level.
    fn rigid_cycle<T: Scalar>(&mut self, r: &[f64], z: &mut [T]) {
        let norm = norm(&self.levels[self.levels.len() - 1].halo, r);
        if norm == 0.0 {
            z.fill(T::ZERO);
            return;
        }
        let top = self.levels.len() - 1;
        vector::convert(1.0 / norm, r, &mut self.levels[top].b);
        self.run(top);
        vector::convert(norm, &self.levels[top].x, z);
    }

    /// The reduced velocities `u` of one cycle on the finest rigid level for the nodal load `f`, which is
    /// reduced in place.
    fn rigid_velocities(&mut self, f: &mut [f64], u: &mut [f32]) {
        let top = self.levels.len() - 1;
        let Level { space, halo, .. } = &mut self.levels[top];
        halo.clear(f);
        space.reduce(f);
        halo.sum(f);
        self.rigid_cycle(f, u);
    }

    /// `z = V (r - g)` for the gradient `g` that `gradient` writes, in vectors with this halo that are zero
    /// at ghosts. `ties` as in [`Correction::apply`].
    pub fn answer<S: Scalar>(
        &mut self,
        r: &[S],
        gradient: impl FnOnce(&mut [f32]),
        z: &mut [S],
        halo: &mut Halo,
        ties: Option<Ties<'_>>,
    ) {
        let top = self.levels.len() - 1;
        gradient(&mut self.levels[top].b[..r.len()]);
        let Some(mut correction) = self.correction.take() else {
            vector::residual_from_product(r, &mut self.levels[top].b);
            self.run(top);
            return vector::convert(1.0, &self.levels[top].x, z);
        };
        let [mut load, mut answer] = std::mem::take(&mut self.wide);
        [&mut load, &mut answer].into_iter().for_each(|v| v.resize(r.len(), 0.0));
        vector::convert(1.0, &self.levels[top].b[..r.len()], &mut load);
        halo.accumulate(&mut load);
        vector::residual_from_product(r, &mut load);
        halo.update(&mut load);
        correction.apply(&load, &mut answer, &mut |f, u| self.rigid_velocities(f, u), ties);
        halo.clear(&mut answer);
        vector::convert(1.0, &answer, z);
        self.wide = [load, answer];
        self.correction = Some(correction);
    }
}

impl<const D: usize> Preconditioner<f64> for VCycle<D> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Some(mut correction) = self.correction.take() else { return self.rigid_cycle(r, z) };
        correction.apply(r, z, &mut |f, u| self.rigid_velocities(f, u), None);
        self.correction = Some(correction);
    }
}
