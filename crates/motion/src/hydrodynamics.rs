//! The trait that stands between the flow and the particles.

use gluey_geom::{Matrix, Particle, Twist, Vector, Wrench};

use gluey_contact::{Film, TwistMobility};

/// A state that velocities are predicted from.
///
/// ```
/// use gluey_geom::{Particle, Vector};
/// use gluey_motion::{BackgroundFlow, Configuration, Hydrodynamics, LinearFlow};
///
/// let particles = [Particle::new(Vector::<2>::new(0.0, 2.0), 1.0)];
/// let reversed = Configuration { shear_factor: -1.0, ..Configuration::at(0.0, &particles) };
/// let twists = BackgroundFlow::new(LinearFlow::shear(1.0, 0.0)).predict(&reversed)?.twists;
/// assert_eq!(twists[0].velocity.x, -2.0);
/// # Ok::<(), gluey_motion::NoForces>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration<'a, const D: usize> {
    /// The time.
    pub time: f64,
    /// Where the particles are.
    pub particles: &'a [Particle<D>],
    /// Factor of the imposed shear rate: 1 as configured, -1 reversed.
    pub shear_factor: f64,
    /// Shear strain of the periodic images, where these slide along each other: the image one period `H` up
    /// in `y` is `strain H` further along `x`. It grows without bound.
    pub strain: f64,
    /// Whether a stress is wanted.
    pub with_stress: bool,
    /// Forces and torques on the particles, beside those that the model has from elsewhere; empty for none.
    pub wrenches: &'a [Wrench<D>],
    /// Stress of the forces between particles that are among these: minus the mean product of forces and
    /// lines between centres.
    pub pair_stress: Matrix<D>,
    /// Forces of contacts between particles, and of particles with walls, beside all others: they grow with
    /// the flow, as forces at a given rate do.
    pub contacts: Option<&'a ContactLoads<D>>,
}

/// Loads by contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactLoads<const D: usize> {
    /// Forces and torques on the particles.
    pub wrenches: Vec<Wrench<D>>,
    /// Minus the mean product of the forces and the lines between centres, its symmetric part.
    pub stress: Matrix<D>,
    /// The share of tangential forces in that.
    pub stress_of_friction: Matrix<D>,
    /// How many times less accurate than wanted the flow may be, for loads that are not the last ones.
    pub looseness: f64,
}

impl<'a, const D: usize> Configuration<'a, D> {
    /// Particles without forces at a time, in a shear as configured and images above each other.
    pub fn at(time: f64, particles: &'a [Particle<D>]) -> Self {
        Self {
            time,
            particles,
            shear_factor: 1.0,
            strain: 0.0,
            with_stress: false,
            wrenches: &[],
            pair_stress: Matrix::zeros(),
            contacts: None,
        }
    }
}

/// Answer of a model to a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction<const D: usize> {
    /// Velocity and spin of each particle, in their order.
    pub twists: Vec<Twist<D>>,
    /// Shear rate over that by which velocities count, where the stress is given and the rate follows; one
    /// elsewhere.
    pub rate: f64,
    /// The mean stress, where it was wanted and the model has one.
    pub stress: Option<MeanStress<D>>,
    /// What holds the particles that move as they are told; `None` where all are free.
    pub holding: Option<Holding<D>>,
    /// Size and effort.
    pub statistics: FlowStatistics,
}

impl<const D: usize> Prediction<D> {
    /// Free particles with these velocities, and nothing else.
    pub fn of(twists: Vec<Twist<D>>) -> Self {
        Self { twists, rate: 1.0, stress: None, holding: None, statistics: FlowStatistics::default() }
    }
}

/// Tells the loads of contacts for another prediction, if there is to be one.
pub type NextLoads<'a, const D: usize> = dyn FnMut(&Prediction<D>) -> Option<ContactLoads<D>> + 'a;

/// Predicts the velocities of particles from their positions, without contact.
pub trait Hydrodynamics<const D: usize> {
    /// Why a prediction failed.
    type Error: std::error::Error + Send + Sync + 'static;

    /// The velocities of a configuration, and what else the model knows of it.
    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, Self::Error>;

    /// The same with contacts: after each prediction `next` tells the loads of contacts for another one,
    /// until it tells none. The last prediction is that of the step.
    fn predict_with_contacts(
        &mut self,
        configuration: &Configuration<'_, D>,
        next: &mut NextLoads<'_, D>,
    ) -> Result<Prediction<D>, Self::Error> {
        let mut prediction = self.predict(configuration)?;
        while let Some(loads) = next(&prediction) {
            prediction = self.predict(&Configuration { contacts: Some(&loads), ..*configuration })?;
        }
        Ok(prediction)
    }

    /// Whether the model answers to [`Configuration::wrenches`]: a time loop that has some refuses with
    /// [`NoForces`] one that does not.
    fn answers_to_forces(&self) -> bool {
        false
    }

    /// The films of a configuration that lubrication keeps open, with gaps up to `reach`, sorted by
    /// particles. None where the model lets gaps close.
    fn films(&self, _configuration: &Configuration<'_, D>, _reach: f64) -> Vec<Film<D>> {
        Vec::new()
    }

    /// A mobility near that of the flow in which contact forces are sought, `None` where the model has none.
    fn near_mobility(
        &self,
        _configuration: &Configuration<'_, D>,
    ) -> Result<Option<Box<dyn TwistMobility<D>>>, Self::Error> {
        Ok(None)
    }

    /// The flow fields of the last prediction, for output; `None` where the model has none.
    fn fields(&self) -> Option<Fields<D>> {
        None
    }

    /// Everything beyond the particles that the next prediction depends on (warm starts), as bytes.
    fn checkpoint(&self) -> Result<Vec<u8>, Self::Error> {
        Ok(Vec::new())
    }

    /// Restores what [`Hydrodynamics::checkpoint`] gave; on an error nothing has changed.
    fn resume(&mut self, state: &[u8]) -> Result<(), ResumeError<Self::Error>> {
        match state.len() {
            0 => Ok(()),
            bytes => Err(ResumeError::Foreign { bytes }),
        }
    }
}

/// Support of particles that move as they are told: what holds or drives them.
#[derive(Clone, Debug, PartialEq)]
pub struct Holding<const D: usize> {
    /// Mean velocity of fluid and particles over the box, in a sheared one less that of the shear.
    pub mean_velocity: Vector<D>,
    /// Uniform force per unit of volume on fluid and particles: minus the mean gradient of the pressure.
    pub force_density: Vector<D>,
    /// Of each of these particles its index, and the force and torque on it by what holds it: beside those of
    /// fluid, films, weight and repulsion. Contacts are not counted.
    pub wrenches: Vec<(usize, Wrench<D>)>,
}

/// A model does not answer to forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("forces act on the particles, but the model of their motion does not answer to forces")]
pub struct NoForces;

/// A model cannot go on from what was kept.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResumeError<E: std::error::Error + 'static> {
    /// The model depends on nothing but the particles.
    #[error("{bytes} bytes were kept for the flow, whose model keeps none: they are of another model")]
    Foreign {
        /// How many.
        bytes: usize,
    },
    /// The model says why.
    #[error(transparent)]
    Model(#[from] E),
}

impl<E: std::error::Error + 'static> ResumeError<E> {
    /// The same for a wider type of flow errors.
    pub fn widen<W: std::error::Error + From<E> + 'static>(self) -> ResumeError<W> {
        match self {
            Self::Foreign { bytes } => ResumeError::Foreign { bytes },
            Self::Model(error) => ResumeError::Model(error.into()),
        }
    }
}

/// Size and effort of one flow prediction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlowStatistics {
    /// Cells of the mesh.
    pub cell_count: usize,
    /// Velocity and pressure unknowns of the mesh.
    pub dof_count: usize,
    /// Linear solves.
    pub solve_count: usize,
    /// Krylov iterations, or refinement sweeps of a direct solver, over all solves.
    pub iteration_count: usize,
    /// Norm of the last solve's residual over that of its right-hand side.
    pub residual: f64,
    /// How often the penalties of all cells at surfaces were doubled, for smoothers that need it.
    pub penalties_doubled: usize,
    /// Cells at surfaces whose penalties were raised, because flows took too little notice of them.
    pub cells_raised: usize,
    /// Flows that were solved again for that.
    pub solved_again: usize,
    /// Seconds spent in each named phase (mesh, assembly, factorisation, ...), in order.
    pub phases: Vec<(&'static str, f64)>,
}

impl FlowStatistics {
    /// The same for this prediction after others of the same step: efforts of all, the largest residual, the
    /// last mesh.
    #[must_use]
    pub fn after(self, others: &Self) -> Self {
        Self {
            solve_count: self.solve_count + others.solve_count,
            iteration_count: self.iteration_count + others.iteration_count,
            residual: self.residual.max(others.residual),
            penalties_doubled: self.penalties_doubled + others.penalties_doubled,
            cells_raised: self.cells_raised + others.cells_raised,
            solved_again: self.solved_again + others.solved_again,
            ..self
        }
    }
}

/// The mean stress of a suspension in simple shear `rate y e_x` in a periodic box, beyond that of the fluid
/// alone, `-p + 2 eta E`, and the power dissipated; per unit of volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanStress<const D: usize> {
    /// The shear rate, negative while the flow is reversed.
    pub rate: f64,
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// Mean of the symmetric first moments of the tractions on the bodies, films included.
    pub of_bodies: Matrix<D>,
    /// The share of films that are too thin for the mesh.
    pub of_films: Matrix<D>,
    /// Minus the mean product of the forces of contacts with the lines between the centres that they push
    /// apart. Not in 2D in the metric of Stokes drag: forces of contacts between discs have no unit of force
    /// there.
    pub of_contacts: Option<Matrix<D>>,
    /// The share of friction in that, of contacts whose forces act in the flow.
    pub of_friction: Option<Matrix<D>>,
    /// The same of forces by which particles repel each other.
    pub of_repulsion: Matrix<D>,
    /// Power dissipated by fluid and films.
    pub dissipation: f64,
    /// Power of the forces and torques that act on the particles from outside, such as their weight, on
    /// motions beside the undisturbed ones: what is dissipated without the shear having done it.
    pub work_of_forces: f64,
    /// Power of the forces of contacts that act in the flow on the motions of surfaces against each other:
    /// minus what friction dissipates.
    pub work_of_contacts: f64,
}

impl<const D: usize> MeanStress<D> {
    /// Stress of the particles: of the tractions on them, of their contacts and of their repulsion.
    pub fn of_particles(&self) -> Matrix<D> {
        self.of_bodies + self.of_contacts.unwrap_or_else(Matrix::zeros) + self.of_repulsion
    }

    /// Viscosity of the suspension over that of the fluid.
    pub fn relative_viscosity(&self) -> f64 {
        1.0 + self.over_rate(self.of_particles()[(0, 1)])
    }

    /// The share of contacts in the relative viscosity.
    pub fn viscosity_of_contacts(&self) -> Option<f64> {
        self.of_contacts.map(|stress| self.over_rate(stress[(0, 1)]))
    }

    /// The share of friction in the relative viscosity.
    pub fn viscosity_of_friction(&self) -> Option<f64> {
        self.of_friction.map(|stress| self.over_rate(stress[(0, 1)]))
    }

    /// The share of repulsion in the relative viscosity.
    pub fn viscosity_of_repulsion(&self) -> f64 {
        self.over_rate(self.of_repulsion[(0, 1)])
    }

    /// The share of films in the relative viscosity.
    pub fn viscosity_of_films(&self) -> f64 {
        self.over_rate(self.of_films[(0, 1)])
    }

    /// The relative viscosity from the power of the shear: that which fluid and films dissipate, less that of
    /// forces from outside, as `<sigma>:E = Phi / V - sum (F.U' + T.Omega') / V` with motions beside the
    /// undisturbed ones and no mean velocity, and what friction dissipates.
    ///
    /// `None` where these forces do more than the shear, which is then a small difference of numbers that are
    /// known to the error of the mesh.
    pub fn viscosity_by_dissipation(&self) -> Option<f64> {
        let of_shear = self.dissipation - self.work_of_forces - self.work_of_contacts;
        let has_meaning = self.work_of_forces.abs() <= of_shear;
        has_meaning.then(|| of_shear / (self.viscosity * self.rate * self.rate))
    }

    /// `N_1 = sigma_xx - sigma_yy` and `N_2 = sigma_yy - sigma_zz` over viscosity and size of the shear rate;
    /// no `N_2` in 2D.
    pub fn normal_stress_differences(&self) -> [Option<f64>; 2] {
        let stress = self.of_particles();
        let normal = |d: usize| stress[(d, d)] / (self.viscosity * self.rate.abs());
        [Some(normal(0) - normal(1)), (D == 3).then(|| normal(1) - normal(D - 1))]
    }

    /// Pressure of the particles, `-tr / D`, over viscosity and size of the shear rate.
    pub fn particle_pressure(&self) -> f64 {
        -self.of_particles().trace() / (D as f64 * self.viscosity * self.rate.abs())
    }

    fn over_rate(&self, stress: f64) -> f64 {
        stress / (self.viscosity * self.rate)
    }
}

/// The flow fields on a mesh of quadratic cells, ready to be written.
///
/// The `3^D` nodes of a cell are ordered with x fastest, then y (then z).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields<const D: usize> {
    /// Node positions.
    pub points: Vec<Vector<D>>,
    /// Node indices of all cells, `3^D` per cell.
    pub cells: Vec<u32>,
    /// Velocity at the nodes.
    pub velocity: Vec<Vector<D>>,
    /// Pressure at the nodes.
    pub pressure: Vec<f64>,
    /// Viscosity at the nodes.
    pub viscosity: Vec<f64>,
    /// Level set at the nodes: signed distance, positive inside the particles.
    pub level_set: Vec<f64>,
    /// Rigidity multiplier at the nodes (zero in formulations without one).
    pub multiplier: Vec<Vector<D>>,
}
