//! The linear system of a flow around rigid bodies, for those who call the linear solvers themselves.
//!
//! The velocity is `lift + T x`: the lift carries the boundary values, and `x` solves `[A, -B^T; -B, 0] x = b` with the
//! residual `b` of the lift.

use std::sync::Arc;

use gluey_fem::TreeMesh;
use gluey_fem::element::{gauss_cube, value};
use gluey_geom::{Dim, Space, Twist, Vector};
use gluey_levelset::{Ball, Body, Ramp};
use gluey_linalg::vector;

use crate::discretisation::{Discretisation, solid_nodes};
use crate::error::StokesError;
use crate::formulation::{Formulation, PaperParams, ParticleVelocity};
use crate::point_matrices::PointMatrices;
use crate::pressure::WeakPressures;
use crate::solid::{SolidRegion, SolidStress};
use crate::solver::{Preparation, SaddleSolver};
use crate::space::{SolidNodes, VelocitySpace};
use crate::system::{Penalty, StokesSystem};
use crate::transfer::Evaluator;

/// Gauss points a direction for the body force: exact for forces of degree 5, and one order beyond what the elements
/// resolve for others.
const FORCE_POINTS: usize = 4;

/// A flow around bodies on one mesh, ready to be solved.
#[derive(Clone, Debug)]
pub struct Problem<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Mesh and nodes.
    pub discretisation: Discretisation<D>,
    /// The matrix.
    pub system: StokesSystem<D>,
    bodies: Vec<Ball<D>>,
    viscosity: f64,
    offset: f64,
    solid: Option<Solid<D>>,
}

/// The solid of the penalised formulation.
#[derive(Clone, Debug)]
struct Solid<const D: usize> {
    region: SolidRegion<D>,
    touched: SolidNodes,
    matrices: Arc<PointMatrices<D>>,
    particle_velocity: ParticleVelocity,
}

impl<const D: usize> Problem<D>
where
    Dim<D>: Space<D>,
{
    /// The problem on `mesh` around `bodies` in a fluid of the given viscosity. `matrices` belong to
    /// [`Formulation::quadrature`] points.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for values out of range, [`StokesError::Unresolved`] for a body smaller than a cell.
    pub fn new(
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        formulation: Formulation,
        matrices: &Arc<PointMatrices<D>>,
    ) -> Result<Self, StokesError> {
        Self::on(Discretisation::new(mesh), bodies, viscosity, formulation, matrices)
    }

    /// The same on a mesh whose nodes are known.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn on(
        discretisation: Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        formulation: Formulation,
        matrices: &Arc<PointMatrices<D>>,
    ) -> Result<Self, StokesError> {
        check_viscosity(viscosity)?;
        formulation.check()?;
        match formulation {
            Formulation::RigidDofs { offset, weak_pressures } => {
                Self::eliminated(discretisation, bodies, viscosity, offset, weak_pressures)
            }
            Formulation::Paper(paper) => Self::penalised(discretisation, bodies, viscosity, paper, matrices),
        }
    }

    fn eliminated(
        discretisation: Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        offset: f64,
        weak_pressures: WeakPressures,
    ) -> Result<Self, StokesError> {
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, bodies, offset);
        let space = VelocitySpace::new(discretisation.velocity.clone(), bodies, &solid);
        check_resolved(&discretisation, bodies, |body| space.is_active(body))?;
        let system = StokesSystem::new(&discretisation, space, viscosity, weak_pressures, None);
        Ok(Self { discretisation, system, bodies: bodies.to_vec(), viscosity, offset, solid: None })
    }

    fn penalised(
        discretisation: Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        paper: PaperParams,
        matrices: &Arc<PointMatrices<D>>,
    ) -> Result<Self, StokesError> {
        let ramp = Ramp::new(paper.ramp * finest_cell_size(&discretisation));
        let region = SolidRegion::new(&discretisation, bodies, ramp, matrices);
        let held = region.held(bodies.len());
        check_resolved(&discretisation, bodies, |body| held[body])?;
        let stress = SolidStress::new(&discretisation, &region, matrices, viscosity * paper.viscosity_ratio);
        let touched = region.touched_nodes(&discretisation.velocity, bodies);
        let nowhere = vec![None; discretisation.velocity.node_count()];
        let space = VelocitySpace::new::<Ball<D>>(discretisation.velocity.clone(), &[], &nowhere);
        let penalty = Penalty { factor: 1.0 - 1.0 / paper.viscosity_ratio, stress };
        let system = StokesSystem::new(&discretisation, space, viscosity, WeakPressures::Keep, Some(penalty));
        let particle_velocity = paper.particle_velocity;
        let solid = Solid { region, touched, matrices: matrices.clone(), particle_velocity };
        let bodies = bodies.to_vec();
        Ok(Self { discretisation, system, bodies, viscosity, offset: 0.0, solid: Some(solid) })
    }

    /// Builds what `solver` keeps for this problem.
    pub fn prepare(&self, solver: &mut (impl SaddleSolver<D> + ?Sized)) -> Result<(), StokesError> {
        solver.prepare(&self.discretisation, &self.system, &self.preparation())
    }

    /// What a solver is told beside the system.
    pub fn preparation(&self) -> Preparation<'_, D> {
        Preparation {
            bodies: &self.bodies,
            offset: self.offset,
            viscosity: self.viscosity,
            touched: self.solid.as_ref().map(|s| s.touched.as_slice()),
        }
    }

    /// The field closest to `flow` that fulfils all constraints and has its values on the outer boundary: nodal
    /// velocities, then the twists of eliminated bodies.
    pub fn lift(&self, flow: &dyn Fn(&Vector<D>) -> Vector<D>) -> Vec<f64> {
        let (space, nodes) = (&self.system.space, &self.discretisation.velocity);
        let mut lift: Vec<f64> =
            (0..nodes.node_count()).flat_map(|n| flow(&nodes.point(n)).data.0[0]).collect();
        let mut projected = lift.clone();
        projected.resize(space.dim(), 0.0);
        space.project(&mut projected);
        lift.extend_from_slice(&projected[space.full_dim()..]);
        space.expand(&mut lift);
        lift
    }

    /// The load of the force `f(x)` a unit of volume, less what the lift makes of it.
    pub fn right_hand_side(&self, lift: &[f64], force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>) -> Vec<f64> {
        let mut b = vec![0.0; self.system.dim()];
        if let Some(force) = force {
            add_load(&self.discretisation, force, &mut b);
            self.system.reduce(&mut b);
        }
        self.system.residual(lift, &vec![0.0; self.system.pressure.dim()], &mut b);
        b
    }

    /// The velocity `lift + T x`: nodal values, then the twists of eliminated bodies.
    pub fn velocity(&self, lift: &[f64], x: &[f64]) -> Vec<f64> {
        let mut velocity = x[..self.system.velocity_dim()].to_vec();
        self.system.space.expand(&mut velocity);
        vector::axpy(1.0, lift, &mut velocity);
        velocity
    }

    /// The pressure at its nodes.
    pub fn pressure(&self, x: &[f64]) -> Vec<f64> {
        let mut pressure = x[self.system.velocity_dim()..].to_vec();
        self.system.pressure.expand(&mut pressure);
        pressure
    }

    /// Velocity and spin of each body in a field that [`Problem::velocity`] gave.
    ///
    /// # Errors
    /// [`StokesError::NoSolid`] for a penalised body that others cover.
    pub fn twists(&self, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError> {
        let Some(solid) = &self.solid else {
            return Ok((0..self.bodies.len()).map(|body| self.system.space.twist(velocity, body)).collect());
        };
        match solid.particle_velocity {
            ParticleVelocity::WeightedMean => {
                solid.region.twists(&self.discretisation, &self.bodies, &solid.matrices, velocity)
            }
            ParticleVelocity::Center => {
                let evaluator = Evaluator::new(&self.discretisation.mesh);
                let at = |body: &Ball<D>| {
                    evaluator.motion_at(&self.discretisation.velocity, velocity, body.center())
                };
                Ok(self.bodies.iter().map(at).collect())
            }
        }
    }
}

/// # Errors
/// [`StokesError::Parameter`] unless the viscosity is positive and finite.
pub fn check_viscosity(viscosity: f64) -> Result<(), StokesError> {
    if viscosity > 0.0 && viscosity.is_finite() {
        return Ok(());
    }
    Err(StokesError::Parameter { name: "viscosity", value: viscosity, wanted: "must be positive and finite" })
}

fn finest_cell_size<const D: usize>(discretisation: &Discretisation<D>) -> f64 {
    discretisation.mesh.size(discretisation.mesh.max_level())
}

fn check_resolved<const D: usize>(
    discretisation: &Discretisation<D>,
    bodies: &[Ball<D>],
    is_held: impl Fn(usize) -> bool,
) -> Result<(), StokesError> {
    let cell_size = finest_cell_size(discretisation);
    match (0..bodies.len()).find(|&b| !is_held(b) || bodies[b].bounding_radius() < cell_size) {
        Some(body) => {
            Err(StokesError::Unresolved { body, radius: bodies[body].bounding_radius(), cell_size })
        }
        None => Ok(()),
    }
}

/// `b += int f . v` for the nodal velocities `v`.
fn add_load<const D: usize>(
    discretisation: &Discretisation<D>,
    force: &dyn Fn(&Vector<D>) -> Vector<D>,
    b: &mut [f64],
) {
    let rule = gauss_cube::<D>(FORCE_POINTS);
    let nodes_per_cell = discretisation.velocity.nodes_per_cell();
    let shapes: Vec<Vec<f64>> =
        rule.iter().map(|(x, _)| (0..nodes_per_cell).map(|i| value::<D>(2, i, x)).collect()).collect();
    for (index, cell) in discretisation.mesh.cells().iter().enumerate() {
        let (lower, h) = (discretisation.mesh.lower_corner(cell), discretisation.cell_size(index));
        for ((at, weight), shapes) in rule.iter().zip(&shapes) {
            let load = force(&(lower + Vector::from_fn(|d, _| h * at[d]))) * (weight * h.powi(D as i32));
            for (&node, shape) in discretisation.velocity.cell(index).iter().zip(shapes) {
                for (b, load) in b[node as usize * D..][..D].iter_mut().zip(load.iter()) {
                    *b += shape * load;
                }
            }
        }
    }
}
