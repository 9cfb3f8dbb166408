//! Suspensions in a shear flow: what drives the flow of a configuration, and what it predicts.

mod drive;
mod mobility;
mod prediction;

use std::borrow::Cow;

use gluey_fem::{MeshError, TreeMesh};
use gluey_geom::{Aabb, Lattice, Particle, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{Configuration, LinearFlow};

use crate::film::Lubrication;
use crate::flow::{Refinement, added};

pub use drive::{Drive, NotDriven};

/// A box with particles in a shear flow, `u = rate (y - middle) e_x` on its walls, or far away where it has
/// none: then its images in `y` slide along each other.
///
/// ```
/// use gluey_stokes::geom::{Aabb, Vector};
/// use gluey_stokes::motion::Configuration;
/// use gluey_stokes::{FlowParams, FlowSolver, Lubrication, Refinement, Suspension};
///
/// let suspension = Suspension {
///     domain: Aabb::unit(),
///     roots: [1; 2],
///     periods: [Some(1.0), None],
///     refinement: Refinement::to_level(5),
///     lubrication: Lubrication::Deficit,
///     radii: vec![0.1],
///     wrenches: vec![],
///     given: vec![],
///     force_density: None,
///     shear_rate: 2.0,
///     shear_stress: None,
/// };
/// let particles = suspension.particles(&[Vector::<2>::new(0.5, 0.7)]);
/// let now = Configuration::at(0.0, &particles);
/// let (balls, mut solver) = (suspension.balls(&now), FlowSolver::new(FlowParams::for_dimension(2))?);
/// let mesh = solver.discretised(suspension.mesh(&balls)?);
/// let solved = solver.predict(&mesh, &suspension, &now, &mut |_| None);
/// let (_, prediction) = solved.map_err(|error: Box<dyn std::error::Error>| error)?;
/// // Here as of a flow between walls that move.
/// let walls = |x: &Vector<2>| Vector::<2>::new(2.0 * (x[1] - 0.5), 0.0);
/// assert_eq!(prediction.twists, solver.solve(suspension.mesh(&balls)?, &balls, &walls)?.twists);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Suspension<const D: usize> {
    /// The box.
    pub domain: Aabb<D>,
    /// Cells along its edges before any is refined.
    pub roots: [u32; D],
    /// Periods along its axes, where it has some. Without walls it is sheared for ever.
    pub periods: [Option<f64>; D],
    /// How the mesh follows the particles.
    pub refinement: Refinement,
    /// Treatment of films that are too thin for the mesh.
    pub lubrication: Lubrication,
    /// Radii of the particles.
    pub radii: Vec<f64>,
    /// Forces and torques on them, or no entries for none on any.
    pub wrenches: Vec<Wrench<D>>,
    /// Motions of the particles that are held or driven while the shear is not reversed, or no entries where
    /// all are free.
    pub given: Vec<Option<Twist<D>>>,
    /// Force per unit of volume on fluid and particles, between walls or where particles are held. Where
    /// particles are held in a box without walls and it is not given, it is what stops the mean flow.
    pub force_density: Option<Vector<D>>,
    /// The shear rate; where the stress is given, one or minus one.
    pub shear_rate: f64,
    /// The shear stress that is given in place of the rate, in a box without walls around free particles.
    pub shear_stress: Option<f64>,
}

impl<const D: usize> Suspension<D> {
    /// Whether the box has no walls.
    pub fn is_sheared(&self) -> bool {
        self.periods.iter().all(Option::is_some)
    }

    /// Which axes are periodic.
    pub fn periodic(&self) -> [bool; D] {
        self.periods.map(|period| period.is_some())
    }

    /// The particles at these places.
    pub fn particles(&self, places: &[Vector<D>]) -> Vec<Particle<D>> {
        places.iter().zip(&self.radii).map(|(place, &radius)| Particle::new(*place, radius)).collect()
    }

    /// The particles of a configuration as the mesh sees them.
    pub fn balls(&self, configuration: &Configuration<'_, D>) -> Vec<Ball<D>> {
        let (lattice, origin) = (self.lattice(configuration), self.domain.lower[1]);
        let places = configuration.particles.iter().map(|particle| particle.pose.position).zip(&self.radii);
        places.map(|(place, &radius)| Ball::in_space(&place, radius, &lattice, origin)).collect()
    }

    /// The lattice of the images of a configuration, whose tilt is not brought back into the period.
    fn lattice(&self, configuration: &Configuration<'_, D>) -> Lattice<D> {
        let tilt = if self.is_sheared() { configuration.strain * self.domain.extent()[1] } else { 0.0 };
        Lattice::new(self.periods).tilted(tilt)
    }

    /// A mesh for them.
    ///
    /// # Errors
    /// [`MeshError`] if the box cannot be meshed.
    pub fn mesh(&self, balls: &[Ball<D>]) -> Result<TreeMesh<D>, MeshError> {
        self.refinement.mesh(self.domain, self.roots, self.periodic(), balls)
    }

    /// The undisturbed flow at this multiple of the shear.
    fn undisturbed(&self, shear_factor: f64) -> LinearFlow<D> {
        LinearFlow::shear(self.shear_rate * shear_factor, self.domain.center()[1])
    }

    /// The motion that is given to a particle at this multiple of the shear; `None` for one that is free.
    fn given_twist(&self, particle: usize, shear_factor: f64) -> Option<Twist<D>> {
        self.given.get(particle).copied().flatten().map(|twist| twist * shear_factor)
    }

    /// All forces and torques on the particles but those of contacts; no entries for none on any.
    fn acting<'a>(&'a self, configuration: &Configuration<'a, D>) -> Cow<'a, [Wrench<D>]> {
        added(&self.wrenches, configuration.wrenches)
    }
}
