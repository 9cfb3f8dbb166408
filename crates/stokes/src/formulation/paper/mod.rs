//! `paper` (Verdon et al. 2010): viscosity `eta = I eta_s + (1-I) eta_f` (eq. 5) and the augmented Lagrangian
//! of eqs. 9 and 10, see [`uzawa`].

mod correction;
mod moments;
mod multigrid;
mod params;
mod pressures;
mod quadrature;
mod region;
mod smoother;
mod stress;
mod uzawa;

use gluey_fem::Evaluator;
use std::sync::Arc;

use gluey_geom::{Twist, Wrench};
use gluey_levelset::{Ball, Ramp, ViscosityLaw};
use gluey_linalg::{ChebyshevParams, vector};

use super::problem::{FlowData, LinearSolve, Method, Multiplier, Problem, Rigidity, check_resolved};
use crate::error::StokesError;
use crate::operator::{Elements, StokesSystem};
use crate::precondition::velocity::{LEVEL_SWEEP, Smoothing};
use crate::precondition::{Correction, CycleLevels};
use crate::space::{Discretisation, SolidNodes, VelocitySpace};

use correction::PenalisedCorrection;
use stress::{Penalty, SolidStress};

pub use params::{PaperParams, ParticleVelocity};
pub use quadrature::PointMatrices;
pub use region::SolidRegion;

/// The parameters, and the matrices of quadrature points, which are the same on all meshes.
pub struct Paper<const D: usize> {
    params: PaperParams,
    matrices: Arc<PointMatrices<D>>,
}

impl<const D: usize> Paper<D> {
    /// The formulation with these parameters.
    pub fn new(params: PaperParams) -> Self {
        Self { params, matrices: Arc::new(PointMatrices::new(params.quadrature)) }
    }
}

impl<const D: usize> Method<D> for Paper<D> {
    fn discretised(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
    ) -> Result<(StokesSystem<D>, Arc<dyn Rigidity<D>>), StokesError> {
        let Self { params, matrices } = self;
        let law = ViscosityLaw { fluid: viscosity, ratio: params.viscosity_ratio };
        let ramp = Ramp::new(params.ramp * discretisation.finest_cell_size());
        let region = SolidRegion::new(discretisation, bodies, ramp, matrices);
        let held = region.held(bodies.len());
        check_resolved(discretisation, bodies, |body| held[body])?;
        let stress = SolidStress::new(discretisation, &region, matrices, law.solid());
        let touched = region.touched_nodes(&discretisation.velocity, bodies);
        let nowhere = vec![None; discretisation.velocity.node_count()];
        let space = VelocitySpace::new::<Ball<D>>(discretisation, &[], &nowhere);
        let penalty = Penalty { factor: law.excess(), stress: stress.clone() };
        let system = StokesSystem::with_viscosity(space, viscosity, Some(Arc::new(penalty)));
        let solid = PenalisedSolid { params: *params, region, stress, touched, matrices: matrices.clone() };
        Ok((system, Arc::new(solid)))
    }
}

/// The penalised solid on one mesh.
#[derive(Debug)]
struct PenalisedSolid<const D: usize> {
    params: PaperParams,
    region: SolidRegion<D>,
    stress: SolidStress<D>,
    /// Nodes of the cells with any solid, each with the body nearest to it.
    touched: SolidNodes,
    matrices: Arc<PointMatrices<D>>,
}

impl<const D: usize> Rigidity<D> for PenalisedSolid<D> {
    fn twists(&self, problem: &Problem<D>, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError> {
        let (discretisation, bodies) = (problem.discretisation(), &problem.bodies);
        match self.params.particle_velocity {
            ParticleVelocity::WeightedMean => {
                self.region.twists(discretisation, bodies, &self.matrices, velocity)
            }
            ParticleVelocity::Center => {
                let evaluator = Evaluator::new(&discretisation.mesh);
                let at =
                    |body: &Ball<D>| evaluator.motion_at(&discretisation.velocity, velocity, body.center());
                Ok(bodies.iter().map(at).collect())
            }
        }
    }

    fn solve(
        &self,
        problem: &Problem<D>,
        data: &FlowData<'_>,
        x: &mut [f64],
        solve: &mut LinearSolve<'_>,
    ) -> Result<Multiplier, StokesError> {
        uzawa::solve(&self.params, &self.stress, problem, data, x, solve)
    }

    /// As forces per unit of volume, spread over the solid.
    fn add_wrenches(
        &self,
        problem: &Problem<D>,
        wrenches: &[Wrench<D>],
        b: &mut [f64],
    ) -> Result<(), StokesError> {
        let (discretisation, space) = (problem.discretisation(), &problem.system.space);
        let mut loads = self.region.loads(discretisation, &problem.bodies, &self.matrices, wrenches)?;
        space.reduce(&mut loads);
        vector::axpy(1.0, &loads, &mut b[..space.dim()]);
        Ok(())
    }

    fn coarse_offset(&self) -> f64 {
        0.0
    }

    /// Every node the solid touches is rigid: what the penalty makes stiff is invisible to all levels.
    fn finest_level(&self, problem: &Problem<D>) -> VelocitySpace<D> {
        VelocitySpace::new(problem.discretisation(), &problem.bodies, &self.touched)
    }

    fn smoothing(&self, levels: CycleLevels<'_, D>, is_finest: bool) -> Option<Smoothing> {
        match levels.are_factorised() {
            true => Some(smoothing(is_finest)),
            // The smoother of the finest mesh is that of the solid.
            false => (!is_finest).then(Smoothing::of_eliminated),
        }
    }

    fn correction(
        &self,
        elements: &Elements<'_, D>,
        finest: &VelocitySpace<D>,
        levels: CycleLevels<'_, D>,
    ) -> Result<Option<Box<dyn Correction>>, StokesError> {
        Ok(Some(Box::new(PenalisedCorrection::new(elements, &self.touched, finest, levels)?)))
    }
}

/// Below a penalised solid one sweep after the correction loses robustness at high contrast, see
/// `docs/archive/decisions/0012-passes-over-memory.md`.
fn smoothing(is_finest: bool) -> Smoothing {
    let degree = if is_finest { 2 } else { 3 };
    Smoothing { sweep: ChebyshevParams { degree, ratio: 4.0, ..LEVEL_SWEEP }, before: true }
}
