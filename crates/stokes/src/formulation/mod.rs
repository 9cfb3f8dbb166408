//! How rigidity is imposed: [`Formulation`] names the ways, [`Method`] and [`Rigidity`] say what each provides.
//!
//! Another formulation is a file or folder of this room and an arm of [`Formulation::method`].

mod load;
mod paper;
mod problem;
mod rigid_dofs;

use std::fmt::Debug;
use std::sync::Arc;

use gluey_geom::{Dim, Space, Twist};
use gluey_levelset::Ball;

use crate::error::StokesError;
use crate::operator::{Elements, StokesSystem};
use crate::precondition::velocity::Smoothing;
use crate::precondition::{Correction, CycleLevels};
use crate::space::{Discretisation, VelocitySpace, WeakPressures};

pub use paper::{PaperParams, ParticleVelocity};
pub use problem::{Problem, check_viscosity};
pub use rigid_dofs::default_offset;

/// How rigidity is imposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Formulation {
    /// Elimination of the solid degrees of freedom.
    RigidDofs {
        /// Nodes with `alpha >= offset h` are rigid; slightly negative is best, see `docs/theory`.
        offset: f64,
        /// Treatment of the pressures in cut cells.
        weak_pressures: WeakPressures,
    },
    /// Penalty and Uzawa multiplier of the paper.
    Paper(PaperParams),
}

impl Formulation {
    /// What the formulation keeps from mesh to mesh.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for a value out of range.
    pub fn method<const D: usize>(&self) -> Result<Arc<dyn Method<D>>, StokesError>
    where
        Dim<D>: Space<D>,
    {
        self.check()?;
        Ok(match *self {
            Self::RigidDofs { offset, weak_pressures } => {
                Arc::new(rigid_dofs::RigidDofs { offset, weak_pressures })
            }
            Self::Paper(params) => Arc::new(paper::Paper::new(params)),
        })
    }

    /// # Errors
    /// [`StokesError::Parameter`] for a value out of range.
    pub fn check(&self) -> Result<(), StokesError> {
        match self {
            Self::RigidDofs { offset, .. } => rigid_dofs::check(*offset),
            Self::Paper(params) => params.check(),
        }
    }
}

/// A formulation with what it keeps from mesh to mesh.
pub trait Method<const D: usize>: Send + Sync
where
    Dim<D>: Space<D>,
{
    /// The system around `bodies` on a mesh, and what belongs to it.
    ///
    /// # Errors
    /// [`StokesError::Unresolved`] for a body smaller than a cell.
    fn discretised(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
    ) -> Result<(StokesSystem<D>, Arc<dyn Rigidity<D>>), StokesError>;
}

/// What a formulation provides for a flow on one mesh, beside its system.
pub trait Rigidity<const D: usize>: Debug + Send + Sync
where
    Dim<D>: Space<D>,
{
    /// Velocity and spin of each body in a field that [`Problem::velocity`] gave.
    ///
    /// # Errors
    /// [`StokesError::NoSolid`] for a body that the field does not know.
    fn twists(&self, problem: &Problem<D>, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError>;

    /// Predicts the flow from the residual `b` of the `lift` and the guess `x`, by one solve or several.
    ///
    /// # Errors
    /// Those of the solves.
    fn solve(
        &self,
        problem: &Problem<D>,
        data: &Data<'_>,
        x: &mut [f64],
        solve: &mut LinearSolve<'_>,
    ) -> Result<Multiplier, StokesError>;

    /// Whether the deviation from the undisturbed flow is smooth enough in time to be extrapolated.
    fn is_smooth_in_time(&self) -> bool;

    /// Offset in cells of the nodes that are rigid on the coarser levels of the velocity cycle, see [`crate::solid_nodes`].
    fn coarse_offset(&self) -> f64;

    /// The velocities of the finest level of the velocity cycle, with the bodies' nodes eliminated.
    fn finest_level(&self, problem: &Problem<D>) -> VelocitySpace<D>;

    /// How a level of the velocity cycle smooths; `None` if it only joins the coarser ones to what follows.
    fn smoothing(&self, levels: CycleLevels<'_, D>, is_finest: bool) -> Option<Smoothing>;

    /// What the levels cannot see: a correction around the velocity cycle.
    ///
    /// # Errors
    /// If it cannot be set up.
    fn correction(
        &self,
        elements: &Elements<'_, D>,
        finest: &VelocitySpace<D>,
        levels: CycleLevels<'_, D>,
    ) -> Result<Option<Box<dyn Correction>>, StokesError>;
}

/// What a prediction is made from.
#[derive(Clone, Copy, Debug)]
pub struct Data<'a> {
    /// The field that carries the boundary values.
    pub lift: &'a [f64],
    /// Its residual, with the loads of forces.
    pub b: &'a [f64],
}

/// A solve of the linear system: right-hand side, guess and solution, and the factor at most one by which the tolerance is tightened.
pub type LinearSolve<'a> = dyn FnMut(&[f64], &mut [f64], f64) -> Result<(), StokesError> + 'a;

/// Multiplier of the rigidity, a nodal velocity field; empty where there is none.
pub type Multiplier = Vec<f64>;
