//! The linear system of a flow around rigid bodies, for those who call the linear solvers themselves, and
//! the traits that a formulation of rigidity implements: [`Method`], [`Rigidity`].
//!
//! The velocity is `lift + T x`: the lift carries the boundary values, and `x` solves
//! `[A, -B^T; -B, 0] x = b` with the residual `b` of the lift.

use std::fmt::Debug;
use std::sync::Arc;

use gluey_geom::{Dim, Matrix, Twist, Vector, Wrench};
use gluey_levelset::{Ball, Body};
use gluey_linalg::{parallel, vector};

use super::load::add_load;
use crate::error::StokesError;
use crate::film::FilmForce;
use crate::operator::{Elements, StokesSystem};
use crate::precondition::velocity::Smoothing;
use crate::precondition::{Correction, CycleLevels};
use crate::space::{Discretisation, VelocitySpace};
use crate::surface::WeakCell;
use crate::term::Load;

/// A formulation with what it keeps from mesh to mesh.
pub trait Method<const D: usize>: Send + Sync {
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

    /// The same with penalties twice as large, where it has any and they may grow.
    fn stiffened(&self) -> Option<Arc<dyn Method<D>>> {
        None
    }

    /// The same with larger penalties in some cells, where it has any.
    fn raised(&self, _cells: &[WeakCell]) -> Option<Arc<dyn Method<D>>> {
        None
    }
}

/// A formulation on one mesh, beside its system.
pub trait Rigidity<const D: usize>: Debug + Send + Sync {
    /// Velocity and spin of each body in a field that [`Problem::velocity`] gave.
    ///
    /// # Errors
    /// For a body that the field does not know.
    fn twists(&self, problem: &Problem<D>, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError>;

    /// Predicts the flow from the residual `b` of the `lift` and the guess `x`, by one solve or several.
    ///
    /// # Errors
    /// The errors of the solves.
    fn solve(
        &self,
        problem: &Problem<D>,
        data: &FlowData<'_>,
        x: &mut [f64],
        solve: &mut LinearSolve<'_>,
    ) -> Result<Multiplier, StokesError>;

    /// Adds the loads of forces and torques on the bodies, one entry each, to a reduced right-hand side: to
    /// the rows of the twists where these are unknowns.
    ///
    /// # Errors
    /// For a body that has nothing to act on.
    fn add_wrenches(
        &self,
        problem: &Problem<D>,
        wrenches: &[Wrench<D>],
        b: &mut [f64],
    ) -> Result<(), StokesError> {
        let space = problem.space_with_twists("forces on bodies")?;
        wrenches.iter().enumerate().for_each(|(body, wrench)| space.add_wrench(b, body, wrench));
        Ok(())
    }

    /// The first moment `int (sigma.n) r dA` of the tractions on each body, in nodal velocities and pressures
    /// relative to a linear flow with the strain `undisturbed`.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] where the formulation has no forces on nodes of bodies.
    fn first_moments(
        &self,
        _problem: &Problem<D>,
        _fields: [&[f64]; 2],
        _undisturbed: &Matrix<D>,
    ) -> Result<Vec<Matrix<D>>, StokesError> {
        Err(StokesError::Unsupported { what: "stresslets" })
    }

    /// The cells whose penalty is too small for a velocity that [`Problem::velocity`] gave, relative to a
    /// linear flow with this strain.
    fn weak_cells(&self, _: &Problem<D>, _velocity: &[f64], _strain: &Matrix<D>) -> Vec<WeakCell> {
        Vec::new()
    }

    /// See [`StokesSystem::residual`]. Here so that who calls it does not compile the operators anew.
    fn residual(&self, system: &StokesSystem<D>, [u, p]: [&[f64]; 2], b: &mut [f64]) {
        system.residual(u, p, b);
    }

    /// Offset in cells of the nodes that are rigid on the coarser levels of the velocity cycle, see
    /// [`crate::solid_nodes`].
    fn coarse_offset(&self) -> f64;

    /// The velocities of the finest level of the velocity cycle, with the bodies' nodes eliminated.
    fn finest_level(&self, problem: &Problem<D>) -> VelocitySpace<D>;

    /// How a level of the velocity cycle smooths; `None` if it only joins the coarser ones to what follows.
    fn smoothing(&self, levels: CycleLevels<'_, D>, is_finest: bool) -> Option<Smoothing>;

    /// A correction around the velocity cycle, for the errors that its levels do not reduce.
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

/// Data of a prediction.
#[derive(Clone, Copy, Debug)]
pub struct FlowData<'a> {
    /// The field that carries the boundary values.
    pub lift: &'a [f64],
    /// Residual of that field, with the loads of forces.
    pub b: &'a [f64],
}

/// A solve of the linear system: right-hand side, guess and solution, and the factor at most one by which the
/// tolerance is tightened.
pub type LinearSolve<'a> = dyn FnMut(&[f64], &mut [f64], f64) -> Result<(), StokesError> + 'a;

/// Multiplier of the rigidity, a nodal velocity field; empty where there is none.
pub type Multiplier = Vec<f64>;

/// A flow around bodies on one mesh, ready to be solved.
#[derive(Clone, Debug)]
pub struct Problem<const D: usize> {
    /// The matrix, which knows mesh and nodes.
    pub system: StokesSystem<D>,
    /// The rigid bodies, on a part of a mesh those near it.
    pub bodies: Vec<Ball<D>>,
    /// All of them.
    pub(crate) all_bodies: Vec<Ball<D>>,
    /// How they are rigid.
    pub(crate) rigidity: Arc<dyn Rigidity<D>>,
}

impl<const D: usize> Problem<D> {
    /// The problem around all `bodies` on a mesh whose nodes are known, with what a formulation keeps from
    /// mesh to mesh. All ranks call this.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for values out of range, [`StokesError::Unresolved`] for a body smaller
    /// than a cell.
    pub(crate) fn on(
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        method: &dyn Method<D>,
    ) -> Result<Self, StokesError> {
        check_viscosity(viscosity)?;
        let (near, all_bodies) = (discretisation.near(bodies), bodies.to_vec());
        let made = method.discretised(discretisation, &near, viscosity);
        let (mut system, rigidity) = discretisation.agreed(made)?;
        system.share();
        Ok(Self { system, bodies: near, all_bodies, rigidity })
    }

    /// Mesh and nodes.
    pub fn discretisation(&self) -> &Discretisation<D> {
        self.system.discretisation()
    }

    /// Radius of the largest body; zero without bodies.
    pub fn largest_radius(&self) -> f64 {
        self.bodies.iter().map(Body::bounding_radius).fold(0.0, f64::max)
    }

    /// The field closest to `flow` that fulfils all constraints and has its values on the outer boundary:
    /// nodal velocities, then the twists of eliminated bodies.
    pub fn lift(&self, flow: &dyn Fn(&Vector<D>) -> Vector<D>) -> Vec<f64> {
        let (space, nodes) = (&self.system.space, &self.discretisation().velocity);
        let mut lift: Vec<f64> =
            (0..nodes.node_count()).flat_map(|n| flow(&nodes.point(n)).data.0[0]).collect();
        let mut projected = lift.clone();
        projected.resize(space.dim(), 0.0);
        space.project(&mut projected);
        lift.extend_from_slice(&projected[space.full_dim()..]);
        if space.is_by_surface() {
            for (index, body) in self.bodies.iter().enumerate() {
                space.set_twist(&mut lift, index, &motion_of(flow, body));
            }
        }
        space.expand(&mut lift);
        lift
    }

    /// The load of the force `f(x)` per unit of volume, less that of the lift.
    pub fn right_hand_side(&self, lift: &[f64], force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>) -> Vec<f64> {
        let mut b = self.loads(force);
        let at_rest = vec![0.0; self.system.pressure.dim()];
        self.rigidity.residual(&self.system, [lift, &at_rest], &mut b);
        b
    }

    /// The load of the force `f(x)` per unit of volume.
    fn loads(&self, force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>) -> Vec<f64> {
        let mut b = parallel::filled(0.0, self.system.dim());
        let Some(force) = force else { return b };
        let (discretisation, terms) = (self.discretisation(), &self.system.terms);
        let is_whole =
            |cell: usize| discretisation.is_own(cell) && !terms.iter().any(|term| term.covers(cell));
        let mut load = self.no_load();
        add_load(discretisation, is_whole, force, &mut load.velocity);
        terms.iter().for_each(|term| term.add_force(force, &mut load));
        self.reduce(&load, &mut b);
        b
    }

    fn no_load(&self) -> Load<D> {
        Load {
            velocity: vec![0.0; self.system.space.full_dim()],
            pressure: vec![0.0; self.system.pressure.dim()],
            wrenches: vec![Wrench::default(); self.bodies.len()],
        }
    }

    /// From a load to a reduced right-hand side that has no more than the rows of terms.
    fn reduce(&self, load: &Load<D>, b: &mut [f64]) {
        let [u, p, _] = self.system.parts_mut(b);
        u[..load.velocity.len()].copy_from_slice(&load.velocity);
        p.copy_from_slice(&load.pressure);
        self.system.reduce(b);
        let wrenches = load.wrenches.iter().enumerate().take(self.system.space.body_count());
        wrenches.for_each(|(body, wrench)| self.system.space.add_wrench(b, body, wrench));
    }

    /// Adds the load of a linear flow with this strain, relative to which velocities are, to a reduced
    /// right-hand side: that of the bodies, which do not strain.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] unless all bodies are coupled to the fluid through their surfaces.
    pub fn add_strain(&self, strain: &Matrix<D>, b: &mut [f64]) -> Result<(), StokesError> {
        if strain.amax() == 0.0 || self.bodies.is_empty() {
            return Ok(());
        }
        if !self.system.space.is_by_surface() {
            return Err(StokesError::Unsupported { what: "a linear flow far away" });
        }
        let (mut load, mut sum) = (self.no_load(), vec![0.0; self.system.dim()]);
        let rows = &mut *self.system.parts_mut(&mut sum)[2];
        self.system.for_each_term(rows, |term, rows| term.add_strain(strain, &mut load, rows));
        self.reduce(&load, &mut sum);
        vector::axpy(1.0, &sum, b);
        Ok(())
    }

    /// Adds the loads of forces and torques on all bodies to a reduced right-hand side, on parts of a mesh of
    /// those whose twists the rank owns; no entries stand for none on any.
    ///
    /// # Errors
    /// [`StokesError::Count`] unless there is one entry per body, and those of the formulation.
    pub fn add_wrenches(&self, wrenches: &[Wrench<D>], b: &mut [f64]) -> Result<(), StokesError> {
        if wrenches.is_empty() {
            return Ok(());
        }
        self.check_count("wrenches", wrenches.len())?;
        let mesh = self.discretisation();
        self.rigidity.add_wrenches(self, &mesh.of_owned(&mesh.near(wrenches)), b)
    }

    /// Makes bodies move with these twists, one entry for each body or `None` for one that is free, in a
    /// field that [`Problem::lift`] gave; for bodies that are held, see [`VelocitySpace::hold`].
    ///
    /// # Errors
    /// [`StokesError::Count`] unless there is one entry per body, [`StokesError::Unsupported`] in a
    /// formulation without unknowns for twists.
    pub fn set_twists(&self, twists: &[Option<Twist<D>>], lift: &mut [f64]) -> Result<(), StokesError> {
        self.check_count("twists", twists.len())?;
        let space = self.space_with_twists("bodies that are held")?;
        let twists = self.discretisation().near(twists);
        let held = twists.iter().enumerate().filter_map(|(body, twist)| Some((body, twist.as_ref()?)));
        held.for_each(|(body, twist)| space.set_twist(lift, body, twist));
        space.expand(lift);
        Ok(())
    }

    /// The forces and torques on the bodies that make this velocity (as [`Problem::velocity`] gives it) and
    /// pressure a solution, by action and reaction: what is missing in the rows of the twists. All ranks call
    /// this.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] in a formulation without unknowns for twists.
    pub fn wrenches(
        &self,
        velocity: &[f64],
        pressure: &[f64],
        force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>,
        strain: &Matrix<D>,
    ) -> Result<Vec<Wrench<D>>, StokesError> {
        let space = self.space_with_twists("forces on bodies that are held")?;
        let mut b = self.loads(force);
        self.add_strain(strain, &mut b)?;
        self.rigidity.residual(&self.system, [velocity, pressure], &mut b);
        let lacking = (0..self.bodies.len()).map(|body| -space.wrench(&b, body)).collect();
        Ok(self.discretisation().sums_of_bodies(lacking))
    }

    fn check_count(&self, what: &'static str, found: usize) -> Result<(), StokesError> {
        let bodies = self.all_bodies.len();
        if found == bodies { Ok(()) } else { Err(StokesError::Count { what, found, bodies }) }
    }

    /// The reduced velocities, if the twists of all bodies are among them.
    fn space_with_twists(&self, what: &'static str) -> Result<&VelocitySpace<D>, StokesError> {
        let space = &self.system.space;
        if space.body_count() == self.bodies.len() {
            Ok(space)
        } else {
            Err(StokesError::Unsupported { what })
        }
    }

    /// The velocity `lift + T x`: nodal values, then the twists of eliminated bodies.
    pub fn velocity(&self, lift: &[f64], x: &[f64]) -> Vec<f64> {
        let mut velocity = x[..self.system.velocity_dim()].to_vec();
        self.system.space.expand(&mut velocity);
        vector::axpy(1.0, lift, &mut velocity);
        velocity
    }

    /// The cells of all ranks whose penalty is too small for a velocity that [`Problem::velocity`] gave,
    /// relative to a linear flow with this strain. All ranks call this.
    pub(crate) fn weak_cells(&self, velocity: &[f64], strain: &Matrix<D>) -> Vec<WeakCell> {
        let weak = self.rigidity.weak_cells(self, velocity, strain);
        let Some(partition) = self.discretisation().partition() else { return weak };
        let mesh = &partition.part.mesh;
        let record = |weak: &WeakCell| {
            let key = weak.place.map_or(u64::MAX, |place| mesh.key(&mesh.cells()[place as usize]));
            let body = self.discretisation().body_number(weak.body);
            [key, u64::from(weak.cell), u64::from(body), weak.share.to_bits()]
        };
        let records: Vec<_> = weak.iter().map(record).collect();
        let of_record = |[key, cell, body, share]: [u64; 4]| {
            let place = mesh.cells().binary_search_by_key(&key, |cell| mesh.key(cell)).ok();
            let [cell, body] = [cell, body].map(|number| number as u32);
            WeakCell { cell, place: place.map(|place| place as u32), body, share: f64::from_bits(share) }
        };
        partition.ranks.gathered(&records).into_iter().map(of_record).collect()
    }

    /// What films exert on bodies and walls, on parts of a mesh own films, with the numbers of bodies here.
    pub(crate) fn film_forces(&self, x: &[f64]) -> Vec<FilmForce<D>> {
        let system = &self.system;
        system.films().map_or(Vec::new(), |films| films.forces(&system.space, system.parts(x)[2]))
    }

    /// The pressure at its nodes, then the forces of films.
    pub(crate) fn pressure_and_films(&self, x: &[f64]) -> Vec<f64> {
        let mut pressure = self.pressure(x);
        pressure.extend_from_slice(self.system.parts(x)[2]);
        pressure
    }

    /// The pressure at its nodes.
    pub fn pressure(&self, x: &[f64]) -> Vec<f64> {
        let mut pressure = self.system.parts(x)[1].to_vec();
        self.system.pressure.expand(&mut pressure);
        pressure
    }

    /// Velocity and spin of each body in a field that [`Problem::velocity`] gave. All ranks call this.
    ///
    /// # Errors
    /// For a body that the field does not know.
    pub fn twists(&self, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError> {
        let (mesh, near) = (self.discretisation(), self.rigidity.twists(self, velocity)?);
        Ok(mesh.sums_of_bodies(mesh.of_owned(&near)))
    }
}

/// The rigid motion of a body that is closest to a flow at the ends of its diameters along the axes.
fn motion_of<const D: usize>(flow: &dyn Fn(&Vector<D>) -> Vector<D>, body: &Ball<D>) -> Twist<D> {
    let mut twist = Twist::default();
    for k in 0..2 * D {
        let mut arm = Vector::<D>::zeros();
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        arm[k / 2] = side * body.bounding_radius();
        let velocity = flow(&(body.center() + arm));
        twist.velocity += velocity / (2 * D) as f64;
        twist.spin += Dim::<D>::moment(&arm, &velocity) * (0.25 / arm.norm_squared());
    }
    twist
}

/// The symmetric part of a first moment of forces.
pub fn symmetric<const D: usize>(moment: &Matrix<D>) -> Matrix<D> {
    (moment + moment.transpose()) * 0.5
}

/// The part of a first moment of forces that is a stresslet.
pub fn symmetric_and_traceless<const D: usize>(moment: &Matrix<D>) -> Matrix<D> {
    let symmetric = symmetric(moment);
    symmetric - Matrix::identity() * (symmetric.trace() / D as f64)
}

/// # Errors
/// [`StokesError::Parameter`] unless the viscosity is positive and finite.
pub fn check_viscosity(viscosity: f64) -> Result<(), StokesError> {
    if viscosity > 0.0 && viscosity.is_finite() {
        return Ok(());
    }
    Err(StokesError::Parameter { name: "viscosity", value: viscosity, wanted: "must be positive and finite" })
}

/// # Errors
/// [`StokesError::Unresolved`] for a body that is not held, or smaller than a cell.
pub fn check_resolved<const D: usize>(
    discretisation: &Discretisation<D>,
    bodies: &[Ball<D>],
    is_held: impl Fn(usize) -> bool,
) -> Result<(), StokesError> {
    let cell_size = discretisation.finest_cell_size();
    match (0..bodies.len()).find(|&b| !is_held(b) || bodies[b].bounding_radius() < cell_size) {
        Some(body) => {
            Err(StokesError::Unresolved { body, radius: bodies[body].bounding_radius(), cell_size })
        }
        None => Ok(()),
    }
}
