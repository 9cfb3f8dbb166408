//! Several flows around the same bodies: mobility and resistance.
//!
//! In a box at rest the twists `V = (U_1, w_1, U_2, ...)` of the bodies are linear in the forces and torques
//! `W = (F_1, T_1, F_2, ...)` on them: `V = M W` with the mobility matrix `M`, `W = R V` with the resistance
//! matrix `R = M^-1`. Both are symmetric by the reciprocal theorem and positive definite, since the power
//! `W.V` is dissipated (S. Kim and S. J. Karrila, Microhydrodynamics, 1991, chapter 5). In the discrete
//! system `M` is the block of the inverse matrix that belongs to the twists, so both hold but for the
//! tolerance of the solves.

use std::sync::Arc;

use gluey_fem::TreeMesh;
use gluey_geom::{Dim, Matrix, Spin, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use nalgebra::DMatrix;

use super::adaptive_penalty::FlowWithAdaptedPenalty;
use super::conditions::Conditions;
use super::stress::film_moments;
use super::{Flow, FlowSolver};
use crate::error::StokesError;
use crate::formulation::{Method, Problem, symmetric_and_traceless};

/// Bodies on a mesh with the linear solvers for them: as many flows as wanted, each from a guess of zero and
/// none dependent on those before.
pub struct Prepared<'s, const D: usize> {
    solver: Lent<'s, D>,
    problem: Problem<D>,
    /// The formulation, with penalties as the flows so far want them.
    method: Arc<dyn Method<D>>,
    /// The bodies that are held in the flows that the solvers for free and for held bodies are prepared for.
    ready: [Option<Vec<bool>>; 2],
}

/// The solver of prepared flows: that of somebody else, or their own.
enum Lent<'s, const D: usize> {
    Borrowed(&'s mut FlowSolver<D>),
    Owned(Box<FlowSolver<D>>),
}

impl<const D: usize> Lent<'_, D> {
    fn get(&mut self) -> &mut FlowSolver<D> {
        match self {
            Self::Borrowed(solver) => solver,
            Self::Owned(solver) => solver,
        }
    }
}

impl<const D: usize> FlowSolver<D> {
    /// Sets up several flows around `bodies` on `mesh`. The linear solver is prepared when it is first
    /// needed: once for free bodies and once for each choice of held ones.
    ///
    /// ```
    /// use gluey_stokes::geom::{Aabb, Spin, Vector, Wrench};
    /// use gluey_stokes::levelset::Ball;
    /// use gluey_stokes::{Conditions, FlowParams, FlowSolver, Refinement};
    ///
    /// let disc = Ball::new(Vector::<2>::new(0.5, 0.5), 0.1);
    /// let mesh = Refinement::to_level(6).mesh(Aabb::unit(), [1, 1], [false; 2], &[disc])?;
    /// let mut solver = FlowSolver::<2>::new(FlowParams::for_dimension(2))?;
    /// let mut prepared = solver.prepared(mesh, &[disc])?;
    /// let weight = Wrench { force: Vector::<2>::new(0.0, -1.0), torque: Spin::<2>::new(0.0) };
    /// let falling = prepared.solve(&Conditions::at_rest().with_wrenches(&[weight]))?;
    /// // Held at the velocity at which it falls, it needs its weight.
    /// let held = prepared.solve(&Conditions::at_rest().with_twists(&falling.twists))?;
    /// assert!((held.wrenches[0] - weight).force.norm() < 1e-4);
    /// # Ok::<(), gluey_stokes::StokesError>(())
    /// ```
    ///
    /// # Errors
    /// [`StokesError::Unresolved`] for a body smaller than a cell.
    pub fn prepared(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
    ) -> Result<Prepared<'_, D>, StokesError> {
        let discretisation = self.discretised(mesh);
        let problem = self.problem(&discretisation, bodies)?;
        let method = self.method.clone();
        Ok(Prepared { solver: Lent::Borrowed(self), problem, method, ready: [None, None] })
    }

    /// The same for flows that are kept for longer than anything could be borrowed.
    ///
    /// # Errors
    /// Those of [`FlowSolver::prepared`].
    pub fn into_prepared(
        mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
    ) -> Result<Prepared<'static, D>, StokesError> {
        let discretisation = self.discretised(mesh);
        let problem = self.problem(&discretisation, bodies)?;
        let method = self.method.clone();
        Ok(Prepared { solver: Lent::Owned(Box::new(self)), problem, method, ready: [None, None] })
    }
}

impl<const D: usize> Prepared<'_, D> {
    /// The flow under some conditions, after a preparation of the linear solver at the first one with free
    /// and the first one with held bodies.
    ///
    /// # Errors
    /// [`StokesError::Count`] unless there is one entry per body, [`StokesError::Unsupported`] for twists in
    /// a formulation that has no unknowns for them, and the errors of the linear solver.
    pub fn solve(&mut self, conditions: &Conditions<'_, D>) -> Result<Flow<D>, StokesError> {
        self.make_ready(conditions)?;
        let guess = vec![0.0; self.problem.system.dim()];
        let Self { solver, problem, method, ready } = self;
        let FlowWithAdaptedPenalty { mut flow, mut is_raised, .. } =
            solver.get().solve_with_adaptive_penalty(problem, method, conditions, &guess)?;
        if conditions.without_mean {
            let raised;
            (flow, raised) = solver.get().balanced(problem, method, conditions, flow)?;
            is_raised |= raised;
        }
        if is_raised {
            let space = &problem.system.space;
            *ready = [None, None];
            ready[usize::from(space.holds_any())] = Some(space.held().to_vec());
        }
        Ok(flow)
    }

    /// Holds or frees the bodies and prepares the solver for that, unless it is.
    fn make_ready(&mut self, conditions: &Conditions<'_, D>) -> Result<(), StokesError> {
        let Self { solver, problem, method, ready } = self;
        problem.system.space.hold(&conditions.held(problem.bodies.len()));
        let held = problem.system.space.held().to_vec();
        let place = usize::from(problem.system.space.holds_any());
        if ready[place].as_ref() != Some(&held) {
            if solver.get().prepare(problem, method)? {
                *ready = [None, None];
            }
            ready[place] = Some(held);
        }
        Ok(())
    }

    /// The stresslet of each body in a flow around them: the symmetric, traceless first moment of the force
    /// that the *fluid exerts on the body*, `S = sym int (sigma.n) r dA`, with `r` from its centre (Batchelor
    /// 1970, 10.1017/S0022112070000745). A sphere in the strain `E` has `S = (20/3) pi eta a^3 E`. The force
    /// dipole that the body exerts on the fluid is `-S`.
    ///
    /// What films too thin for the mesh add is not in it: see [`Prepared::film_stresslets`].
    ///
    /// A force per unit of volume on the fluid next to the body counts as an error of first order in the size
    /// of the cells there.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] in a formulation without rigid nodes.
    pub fn stresslets(&self, flow: &Flow<D>) -> Result<Vec<Matrix<D>>, StokesError> {
        let moments = self.first_moments(flow)?;
        Ok(moments.iter().map(symmetric_and_traceless).collect())
    }

    fn first_moments(&self, flow: &Flow<D>) -> Result<Vec<Matrix<D>>, StokesError> {
        let space = &self.problem.system.space;
        let mut velocity = flow.velocity.clone();
        velocity.resize(space.dim(), 0.0);
        let twists = flow.twists.iter().take(space.body_count());
        twists.enumerate().for_each(|(body, twist)| space.set_twist(&mut velocity, body, twist));
        self.problem.rigidity.first_moments(&self.problem, [&velocity, &flow.pressure], &flow.strain)
    }

    /// The share of films that are too thin for the mesh in the stresslet of each body, from
    /// [`Flow::films`].
    pub fn film_stresslets(&self, flow: &Flow<D>) -> Vec<Matrix<D>> {
        let moments = film_moments(&flow.films, self.problem.bodies.len());
        moments.iter().map(symmetric_and_traceless).collect()
    }

    /// The mobility matrix: velocities and spins (rows) by forces and torques (columns), `D` numbers and the
    /// spin's for each body in turn. As many solves as it has columns.
    ///
    /// # Errors
    /// Those of [`Prepared::solve`].
    pub fn mobility(&mut self) -> Result<DMatrix<f64>, StokesError> {
        self.columns(|prepared, units| {
            let wrenches: Vec<_> = units.iter().map(|&(force, torque)| Wrench { force, torque }).collect();
            let flow = prepared.solve(&Conditions::at_rest().with_wrenches(&wrenches))?;
            Ok(flow.twists.iter().map(|twist| (twist.velocity, twist.spin)).collect())
        })
    }

    /// The resistance matrix: forces and torques (rows) by velocities and spins (columns), ordered as in
    /// [`Prepared::mobility`]. As many solves as it has columns; for one motion of many bodies
    /// [`Prepared::solve`] with its twists is a single one.
    ///
    /// # Errors
    /// Those of [`Prepared::solve`].
    pub fn resistance(&mut self) -> Result<DMatrix<f64>, StokesError> {
        self.columns(|prepared, units| {
            let twists: Vec<_> = units.iter().map(|&(velocity, spin)| Twist { velocity, spin }).collect();
            let flow = prepared.solve(&Conditions::at_rest().with_twists(&twists))?;
            Ok(flow.wrenches.iter().map(|wrench| (wrench.force, wrench.torque)).collect())
        })
    }

    /// The matrix whose columns are the responses to unit vectors.
    fn columns(
        &mut self,
        respond: impl Fn(&mut Self, &[Screw<D>]) -> Result<Vec<Screw<D>>, StokesError>,
    ) -> Result<DMatrix<f64>, StokesError> {
        let (bodies, rigid) = (self.problem.bodies.len(), Dim::<D>::RIGID);
        let mut matrix = DMatrix::zeros(bodies * rigid, bodies * rigid);
        for (column, mut entries) in matrix.column_iter_mut().enumerate() {
            let mut units = vec![(Vector::zeros(), Dim::<D>::zero_spin()); bodies];
            set_unit(&mut units[column / rigid], column % rigid);
            let response = respond(self, &units)?;
            let numbers = response.iter().flat_map(|(vector, spin)| vector.iter().chain(spin_of(spin)));
            entries.iter_mut().zip(numbers).for_each(|(entry, number)| *entry = *number);
        }
        Ok(matrix)
    }
}

/// A velocity and a spin, or a force and a torque.
type Screw<const D: usize> = (Vector<D>, Spin<D>);

/// Sets number `k` of a screw of zeros to one.
fn set_unit<const D: usize>(screw: &mut Screw<D>, k: usize) {
    match k.checked_sub(D) {
        Some(k) => screw.1[k] = 1.0,
        None => screw.0[k] = 1.0,
    }
}

fn spin_of<const D: usize>(spin: &Spin<D>) -> &[f64] {
    Dim::<D>::spin_slice(spin)
}
