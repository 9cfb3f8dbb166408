//! `rigid-dofs`: every velocity node with `alpha >= offset h` gets the rigid motion of its body; viscosity is
//! constant, force and torque on a free body vanish because they are the residual of its own unknowns.

use std::sync::Arc;

use gluey_geom::{Dim, Matrix, Space, Twist, Vector};
use gluey_levelset::{Ball, Body};

use super::problem::{Data, LinearSolve, Method, Multiplier, Problem, Rigidity, check_resolved};
use crate::error::StokesError;
use crate::operator::{Elements, StokesSystem};
use crate::precondition::velocity::Smoothing;
use crate::precondition::{Correction, CycleLevels};
use crate::space::{CutCellPressures, Discretisation, VelocitySpace, solid_nodes};

/// Offset of the rigid nodes in cells that suits a dimension. In 3D, where films are not resolved, a larger
/// one makes up for the resistance of the film.
pub fn default_offset(dimension: usize) -> f64 {
    if dimension == 2 { -0.1 } else { -0.2 }
}

/// # Errors
/// [`StokesError::Parameter`] for an offset out of range.
pub fn check(offset: f64) -> Result<(), StokesError> {
    match (-1.0..=1.0).contains(&offset) {
        true => Ok(()),
        false => Err(StokesError::Parameter {
            name: "offset",
            value: offset,
            wanted: "must lie between -1 and 1 cells",
        }),
    }
}

/// Elimination of the solid degrees of freedom.
#[derive(Clone, Copy, Debug)]
pub struct RigidDofs {
    /// Nodes with `alpha >= offset h` are rigid.
    pub offset: f64,
    /// Treatment of the pressures in cut cells.
    pub cut_cell_pressures: CutCellPressures,
}

impl<const D: usize> Method<D> for RigidDofs
where
    Dim<D>: Space<D>,
{
    fn discretised(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
    ) -> Result<(StokesSystem<D>, Arc<dyn Rigidity<D>>), StokesError> {
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, bodies, self.offset);
        let space = VelocitySpace::new(discretisation, bodies, &solid);
        check_resolved(discretisation, bodies, |body| space.is_active(body))?;
        Ok((StokesSystem::new(space, viscosity, self.cut_cell_pressures), Arc::new(*self)))
    }
}

impl<const D: usize> Rigidity<D> for RigidDofs
where
    Dim<D>: Space<D>,
{
    fn twists(&self, problem: &Problem<D>, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError> {
        let space = &problem.system.space;
        Ok((0..space.body_count()).map(|body| space.twist(velocity, body)).collect())
    }

    fn solve(
        &self,
        _problem: &Problem<D>,
        data: &Data<'_>,
        x: &mut [f64],
        solve: &mut LinearSolve<'_>,
    ) -> Result<Multiplier, StokesError> {
        solve(data.b, x, 1.0)?;
        Ok(Multiplier::new())
    }

    /// By virtual work: the forces of the fluid on the rigid nodes, `S = sum_n f_n r_n`.
    fn first_moments(
        &self,
        problem: &Problem<D>,
        [velocity, pressure]: [&[f64]; 2],
        _: &Matrix<D>,
    ) -> Result<Vec<Matrix<D>>, StokesError> {
        let Problem { system, bodies, .. } = problem;
        let (space, nodes) = (&system.space, system.space.nodes());
        let forces = system.nodal_forces(velocity, pressure);
        let mut moments = vec![Matrix::<D>::zeros(); bodies.len()];
        for (node, force) in forces.chunks_exact(D).enumerate() {
            if let Some(body) = space.body_of(node).map(|body| body as usize) {
                let arm = bodies[body].arm(&nodes.point(node));
                moments[body] += Vector::<D>::from_column_slice(force) * arm.transpose();
            }
        }
        Ok(moments)
    }

    /// Nodes change sides from step to step.
    fn is_smooth_in_time(&self) -> bool {
        false
    }

    fn coarse_offset(&self) -> f64 {
        self.offset
    }

    fn finest_level(&self, problem: &Problem<D>) -> VelocitySpace<D> {
        problem.system.space.clone()
    }

    fn smoothing(&self, _: CycleLevels<'_, D>, is_finest: bool) -> Option<Smoothing> {
        Some(Smoothing::of_eliminated(is_finest))
    }

    fn correction(
        &self,
        _: &Elements<'_, D>,
        _: &VelocitySpace<D>,
        _: CycleLevels<'_, D>,
    ) -> Result<Option<Box<dyn Correction>>, StokesError> {
        Ok(None)
    }
}
