//! The finite-element flow as [`Hydrodynamics`]: particles in, velocities out.
//!
//! Each prediction builds a mesh that is fine at the surfaces , solves
//! the Stokes problem of `gluey-stokes` in the undisturbed shear `gamma_dot (y - y_mid) e_x` and under the
//! forces and torques of the case, and reads off the twists.

mod error;
mod estimate;
mod fields;
mod given;
mod given_stress;
mod params;
mod prepared;
mod stress_control;

use std::time::Instant;

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Dim, Lattice, Matrix, Particle, Space, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{
    Configuration, Fields, Film, FlowStatistics, Hydrodynamics, MeanStress, Prediction, ResumeError,
};
use gluey_stokes::{
    Conditions, Flow, FlowParams, FlowSolver, NodalFields, PhaseTimes, RaisedPenalties, Refinement,
};
use serde::{Deserialize, Serialize};

use crate::case::{Case, Lubrication};

use stress_control::StressControl;

#[cfg(feature = "ranks")]
pub(crate) use params::lubrication;
pub(crate) use params::{flow_params, refinement, tree};

pub use error::FlowError;
pub use estimate::{MeshEstimate, MeshSize};
pub use prepared::prepared_flow;

/// Flows that the next prediction starts from, for checkpoints.
#[derive(Serialize, Deserialize)]
struct WarmStart<const D: usize> {
    centers: Vec<Vector<D>>,
    strain: f64,
    last: SavedFields,
    before: Option<SavedFields>,
}

/// [`NodalFields`] as they are stored.
#[derive(Serialize, Deserialize)]
struct SavedFields {
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    bodies: Vec<f64>,
    films: Vec<f64>,
}

impl From<NodalFields> for SavedFields {
    fn from(NodalFields { velocity, pressure, bodies, films }: NodalFields) -> Self {
        Self { velocity, pressure, bodies, films }
    }
}

impl From<SavedFields> for NodalFields {
    fn from(SavedFields { velocity, pressure, bodies, films }: SavedFields) -> Self {
        Self { velocity, pressure, bodies, films }
    }
}

/// Finite-element flow around the particles of a case.
pub struct StokesFlow<const D: usize>
where
    Dim<D>: Space<D>,
{
    solver: FlowSolver<D>,
    params: FlowParams,
    refinement: Refinement,
    domain: Aabb<D>,
    roots: [u32; D],
    periods: [Option<f64>; D],
    shear_rate: f64,
    shear_factor: f64,
    /// In a box that is sheared for ever.
    sheared: Option<Sheared>,
    /// Whether lubrication keeps particles apart.
    keeps_films_open: bool,
    radii: Vec<f64>,
    /// Forces and torques that the case has on the particles, and these with those set since; empty if there
    /// are none.
    wrenches: Vec<Wrench<D>>,
    acting: Vec<Wrench<D>>,
    /// Motions of the particles that are held or driven while the shear is not reversed; empty if all are
    /// free.
    given: Vec<Option<Twist<D>>>,
    /// Force per unit of volume on fluid and particles; where particles are held in a box without walls and
    /// it is not given, it is what stops the mean flow.
    force_density: Option<Vector<D>>,
    /// Where the stress is given instead of the rate.
    control: Option<StressControl<D>>,
    last: Option<Flow<D>>,
    last_raised: RaisedPenalties,
    last_balls: Vec<Ball<D>>,
    last_positions: Vec<Vector<D>>,
    last_strain: f64,
}

/// A box that is sheared for ever.
#[derive(Clone, Copy, Debug, Default)]
struct Sheared {
    strain: f64,
    /// Whether the next prediction is to have a stress.
    with_stress: bool,
}

/// Sets up the finite-element flow of a checked case.
///
/// # Errors
/// [`FlowError`] if the box cannot be meshed or a parameter is out of range.
pub fn stokes_flow<const D: usize>(case: &Case) -> Result<StokesFlow<D>, FlowError>
where
    Dim<D>: Space<D>,
{
    let corner = |x: Vec<f64>| Vector::<D>::from_fn(|d, _| x[d]);
    let domain = Aabb { lower: corner(case.lower()), upper: corner(case.upper()) };
    let (roots, level) = tree(case, &domain)?;
    let radii: Vec<f64> = case.particles.iter().map(|p| p.radius).collect();
    let params = flow_params::<D>(case);
    Ok(StokesFlow {
        solver: FlowSolver::new(params)?,
        params,
        refinement: refinement(case, level),
        domain,
        roots,
        periods: std::array::from_fn(|axis| case.period(axis)),
        shear_rate: case.shear_rate,
        shear_factor: 1.0,
        sheared: case.is_sheared().then(Sheared::default),
        keeps_films_open: case.lubrication() == Lubrication::Deficit,
        radii,
        wrenches: case.wrenches(),
        acting: case.wrenches(),
        given: case.given_twists(),
        force_density: case.force_density(),
        control: case.shear_stress.map(StressControl::new),
        last: None,
        last_raised: RaisedPenalties::default(),
        last_balls: Vec::new(),
        last_positions: Vec::new(),
        last_strain: 0.0,
    })
}

impl<const D: usize> StokesFlow<D>
where
    Dim<D>: Space<D>,
{
    fn balls(&self, centers: impl Iterator<Item = Vector<D>>) -> Vec<Ball<D>> {
        let lattice = Lattice::new(self.periods);
        let height = self.periods[1].unwrap_or(0.0);
        let lattice = lattice.tilted(self.sheared.map_or(0.0, |sheared| sheared.strain * height));
        let origin = self.domain.lower[1];
        let ball = |(center, &radius)| Ball::in_space(&center, radius, &lattice, origin);
        centers.zip(&self.radii).map(ball).collect()
    }

    /// The undisturbed velocity.
    fn undisturbed(&self) -> impl Fn(&Vector<D>) -> Vector<D> + use<D> {
        let middle = self.domain.center()[1];
        let rate = self.rate();
        move |x: &Vector<D>| {
            let mut u = Vector::zeros();
            u[0] = rate * (x[1] - middle);
            u
        }
    }

    /// The motion with the undisturbed velocity at a point and its spin.
    fn undisturbed_twist(&self) -> impl Fn(&Vector<D>) -> Twist<D> + use<D> {
        let (velocity, rate) = (self.undisturbed(), self.rate());
        move |x: &Vector<D>| {
            let mut twist = Twist { velocity: velocity(x), ..Twist::default() };
            // About z, the only axis in 2D and the last one in 3D.
            twist.spin[Dim::<D>::ROT - 1] = -0.5 * rate;
            twist
        }
    }

    /// The shear rate now.
    fn rate(&self) -> f64 {
        self.shear_rate * self.shear_factor
    }

    /// The flow in a box with walls or Couette flow around.
    fn solve(
        &mut self,
        mesh: TreeMesh<D>,
        balls: &[Ball<D>],
        at: &[Particle<D>],
    ) -> Result<Flow<D>, FlowError> {
        let shear = self.undisturbed();
        let given = self.given_bodies(at, |_| Twist::default());
        let density = self.force_density.unwrap_or_else(Vector::zeros);
        let uniform = move |_: &Vector<D>| density;
        let conditions = Conditions::boundary(&shear);
        let conditions =
            if density.norm() > 0.0 { conditions.with_force(Some(&uniform)) } else { conditions };
        let conditions = match given[..] {
            [] => conditions.with_wrenches(&self.acting),
            _ => conditions.with_bodies(&given),
        };
        Ok(self.solver.solve_under(mesh, balls, &conditions)?)
    }

    /// The flow in a box that is sheared for ever, relative to the undisturbed one. Where all particles are
    /// free, forces of the case on them are balanced by a uniform one on all of the box, which is a mean
    /// gradient of the pressure; those set since are between particles, and their sum is zero. Where some are
    /// held, these carry all of it; the mean gradient is that of the case, or stops the mean flow.
    fn solve_sheared(
        &mut self,
        mesh: TreeMesh<D>,
        balls: &[Ball<D>],
        at: &[Particle<D>],
        with_stress: bool,
    ) -> Result<Flow<D>, FlowError> {
        let mut gradient = Matrix::<D>::zeros();
        gradient[(0, 1)] = self.rate();
        let given = self.given_bodies(at, self.undisturbed_twist());
        let total: Vector<D> = self.wrenches.iter().map(|wrench| wrench.force).sum();
        let back = match given[..] {
            [] => -total / self.domain.extent().product(),
            _ => self.force_density.unwrap_or_else(Vector::zeros),
        };
        let uniform = move |_: &Vector<D>| back;
        let conditions = Conditions::in_linear_flow(&gradient);
        let conditions = match given[..] {
            [] => conditions.with_wrenches(&self.acting),
            _ if self.force_density.is_none() => conditions.with_bodies(&given).without_mean_flow(),
            _ => conditions.with_bodies(&given),
        };
        let conditions = if back.norm() > 0.0 { conditions.with_force(Some(&uniform)) } else { conditions };
        let has_stress = with_stress && given.is_empty();
        let conditions = if has_stress { conditions.with_stress() } else { conditions };
        Ok(self.solver.solve_under(mesh, balls, &conditions)?)
    }

    /// Power of the forces and torques of the case in the last flow, beside the shear.
    fn work_of_forces(&self) -> f64 {
        let twists = self.last.iter().flat_map(|flow| &flow.twists);
        self.wrenches.iter().zip(twists).map(|(wrench, twist)| wrench.power(twist)).sum()
    }

    /// Velocity of the image at a film beyond that of its particle.
    fn slide(&self, film: &gluey_stokes::Film<D>) -> Vector<D> {
        let mut slide = Vector::zeros();
        if let (Some(_), Some(second)) = (self.sheared, film.side(1)) {
            let direct = self.last_positions[second][1] - self.last_positions[film.body as usize][1];
            slide[0] = self.rate() * (film.branch()[1] - direct);
        }
        slide
    }

    /// Takes over what the next flow depends on beside the particles.
    fn take(&mut self, configuration: &Configuration<'_, D>) {
        self.shear_factor = configuration.shear_factor;
        if let Some(sheared) = &mut self.sheared {
            (sheared.strain, sheared.with_stress) = (configuration.strain, configuration.with_stress);
        }
        self.acting.clone_from(&self.wrenches);
        if self.acting.is_empty() {
            self.acting.extend_from_slice(configuration.wrenches);
        } else {
            let sums = self.acting.iter_mut().zip(configuration.wrenches);
            sums.for_each(|(sum, wrench)| *sum = *sum + *wrench);
        }
        self.control.iter_mut().for_each(|control| control.pair_stress = configuration.pair_stress);
    }

    /// The mean stress of the last flow, if it is wanted.
    fn stress(&self, of_repulsion: Matrix<D>) -> Option<MeanStress<D>> {
        let stress = self.last.as_ref()?.stress.as_ref()?;
        if !self.sheared?.with_stress {
            return None;
        }
        let volume = self.domain.extent().product();
        Some(MeanStress {
            rate: self.rate(),
            viscosity: self.params.viscosity,
            of_bodies: stress.of_bodies(volume),
            of_films: stress.of_films.iter().sum::<Matrix<D>>() / volume,
            of_contacts: None,
            of_repulsion,
            dissipation: stress.dissipation / volume,
            work_of_forces: self.work_of_forces() / volume,
        })
    }

    fn statistics(&self) -> FlowStatistics {
        let Some(flow) = &self.last else { return FlowStatistics::default() };
        let PhaseTimes { assembly, preparation, solve } = flow.times;
        let RaisedPenalties { doubled, cells, solved_again } = self.last_raised;
        FlowStatistics {
            cell_count: flow.discretisation.mesh.cell_count(),
            dof_count: flow.discretisation.dof_count(),
            solve_count: flow.solve_count,
            iteration_count: flow.iteration_count,
            residual: flow.residual,
            penalties_doubled: doubled,
            cells_raised: cells,
            solved_again,
            phases: vec![("mesh and assembly", assembly), ("solver set-up", preparation), ("solve", solve)],
        }
    }

    fn mesh(&self, balls: &[Ball<D>]) -> Result<TreeMesh<D>, FlowError> {
        let periodic = self.periods.map(|period| period.is_some());
        Ok(self.refinement.mesh(self.domain, self.roots, periodic, balls)?)
    }
}

impl<const D: usize> Hydrodynamics<D> for StokesFlow<D>
where
    Dim<D>: Space<D>,
{
    type Error = FlowError;

    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, FlowError> {
        self.take(configuration);
        let particles = configuration.particles;
        let balls = self.balls(particles.iter().map(|p| p.pose.position));
        let start = Instant::now();
        let mesh = self.mesh(&balls)?;
        let meshed = start.elapsed().as_secs_f64();
        let mut flow = match self.sheared {
            None => self.solve(mesh, &balls, particles)?,
            Some(_) if self.control.is_some() => self.solve_at_stress(mesh, &balls)?,
            Some(Sheared { with_stress, .. }) => self.solve_sheared(mesh, &balls, particles, with_stress)?,
        };
        flow.times.assembly += meshed;
        let mut twists = flow.twists.clone();
        if self.sheared.is_some() {
            let undisturbed = self.undisturbed_twist();
            for (twist, particle) in twists.iter_mut().zip(particles) {
                *twist = *twist + undisturbed(&particle.pose.position);
            }
        }
        // Without the rounding of what the flow is relative to.
        for (index, twist) in twists.iter_mut().enumerate() {
            *twist = self.given_twist(index).unwrap_or(*twist);
        }
        self.last_strain = self.sheared.map_or(0.0, |sheared| sheared.strain);
        self.last_positions = particles.iter().map(|particle| particle.pose.position).collect();
        self.last = Some(flow);
        self.last_raised = self.solver.take_raised_penalties();
        self.last_balls = balls;
        let rate = self.control.as_ref().map_or(1.0, |control| control.rate);
        let (stress, statistics) = (self.stress(configuration.pair_stress / rate), self.statistics());
        Ok(Prediction { twists, rate, stress, holding: self.last_holding(), statistics })
    }

    fn answers_to_forces(&self) -> bool {
        true
    }

    fn films(&self, _: &Configuration<'_, D>, reach: f64) -> Vec<Film<D>> {
        if !self.keeps_films_open {
            return Vec::new();
        }
        let mut films = gluey_stokes::films(&self.last_balls, &self.domain, reach);
        films.retain(|film| !film.is_across_flow());
        let film = |film: gluey_stokes::Film<D>| Film {
            first: film.body as usize,
            second: film.side(1),
            branch: film.branch(),
            slide: self.slide(&film),
            is_held: [0, 1].map(|side| film.side(side).is_some_and(|body| self.given_twist(body).is_some())),
            gap: film.gap,
            curvature_radius: film.curvature_radius(),
        };
        films.into_iter().map(film).collect()
    }

    fn fields(&self) -> Option<Fields<D>> {
        let flow = self.last.as_ref()?;
        let mut fields = fields::fields(flow, &self.last_balls, &self.params);
        if self.sheared.is_some() {
            let shear = flow.discretisation.mesh.shear();
            let undisturbed = self.undisturbed();
            for (point, velocity) in fields.points.iter_mut().zip(&mut fields.velocity) {
                point[0] += shear * (point[1] - self.domain.lower[1]);
                *velocity += undisturbed(point);
            }
        }
        Some(fields)
    }

    fn checkpoint(&self) -> Result<Vec<u8>, FlowError> {
        let Some((last, before)) = self.solver.warm_start() else { return Ok(Vec::new()) };
        let (centers, strain) = (self.last_positions.clone(), self.last_strain);
        let state =
            WarmStart { centers, strain, last: last.clone().into(), before: before.cloned().map(Into::into) };
        Ok(postcard::to_allocvec(&state)?)
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), ResumeError<FlowError>> {
        if state.is_empty() {
            return Ok(());
        }
        let WarmStart { centers, strain, last, before } =
            postcard::from_bytes(state).map_err(FlowError::from)?;
        let (saved, present) = (centers.len(), self.radii.len());
        if saved != present {
            return Err(FlowError::Particles { saved, present }.into());
        }
        self.sheared.iter_mut().for_each(|sheared| sheared.strain = strain);
        let balls = self.balls(centers.iter().copied());
        let mesh = self.mesh(&balls)?;
        self.solver.set_warm_start(mesh, last.into(), before.map(Into::into)).map_err(FlowError::from)?;
        (self.last_balls, self.last_positions, self.last_strain) = (balls, centers, strain);
        Ok(())
    }
}
