//! Initial guesses of iterative solves: the last two flows, extrapolated in time.
//!
//! The deviation `d` from the undisturbed flow at the next step is guessed as `2 d^n - d^(n-1)`, both moved
//! to the new mesh. `d^(n-1)` was already moved to the mesh of `d^n` one step before, so both live on one
//! mesh. The extrapolation assumes equal steps; others only make it a worse guess. Motions of bodies and
//! forces of films are guessed alike: in `unfitted` no node has them. A film that was not there before has
//! the force that belongs to the motions. Iterations from these and from other guesses are in
//! `docs/archive/experiments/0010-krylov-vectors.md`.

use gluey_fem::Evaluator;
use gluey_fem::NodeMap;
use gluey_linalg::vector;

use crate::operator::StokesSystem;
use crate::space::Discretisation;

/// Velocity at the velocity nodes (`D` interleaved components) and pressure at the pressure nodes of one
/// mesh, and what belongs to none.
#[derive(Clone, Debug, PartialEq)]
pub struct NodalFields {
    /// Velocities.
    pub velocity: Vec<f64>,
    /// Pressures.
    pub pressure: Vec<f64>,
    /// Motions of the bodies: velocity, and spin times radius, of one after another.
    pub bodies: Vec<f64>,
    /// Forces of films, of one after another, with bodies, partners and normals.
    pub films: Vec<f64>,
}

impl NodalFields {
    /// Those of a reduced vector, with the pressures at their nodes.
    pub(crate) fn of<const D: usize>(system: &StokesSystem<D>, x: &[f64], pressure: Vec<f64>) -> Self {
        let space = &system.space;
        let mut velocity = x[..space.dim()].to_vec();
        space.expand(&mut velocity);
        let bodies = velocity.split_off(space.full_dim());
        let films = system.films();
        let films = films.map_or_else(Vec::new, |films| films.kept(system.parts(x)[2]));
        Self { velocity, pressure, bodies, films }
    }
}

/// Stored fields that do not belong to a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{velocities} velocities and {pressures} pressures were kept, but the mesh has {velocity_count} and \
     {pressure_count}"
)]
pub struct WarmStartError {
    /// Numbers kept for velocities.
    pub velocities: usize,
    /// Numbers kept for pressures.
    pub pressures: usize,
    /// Velocity components of the mesh.
    pub velocity_count: usize,
    /// Pressures of the mesh.
    pub pressure_count: usize,
}

/// The last flow's deviation from the undisturbed one, and the one before.
#[derive(Clone, Debug)]
pub(crate) struct WarmStart<const D: usize> {
    discretisation: Discretisation<D>,
    last: NodalFields,
    before: Option<NodalFields>,
}

impl<const D: usize> WarmStart<D> {
    /// From the deviation `last` on a mesh, and the one before it on the same mesh, if known.
    pub fn new(discretisation: Discretisation<D>, last: NodalFields, before: Option<NodalFields>) -> Self {
        Self { discretisation, last, before }
    }

    /// As [`WarmStart::new`] for stored fields.
    ///
    /// # Errors
    /// If their lengths do not fit the mesh.
    pub fn restore(
        discretisation: Discretisation<D>,
        last: NodalFields,
        before: Option<NodalFields>,
    ) -> Result<Self, WarmStartError> {
        let velocity_count = discretisation.velocity.node_count() * D;
        let pressure_count = discretisation.pressure.node_count();
        for NodalFields { velocity, pressure, .. } in std::iter::once(&last).chain(&before) {
            let (velocities, pressures) = (velocity.len(), pressure.len());
            if (velocities, pressures) != (velocity_count, pressure_count) {
                return Err(WarmStartError { velocities, pressures, velocity_count, pressure_count });
            }
        }
        Ok(Self { discretisation, last, before })
    }

    /// The last flow, and the one before on the same mesh.
    pub fn fields(&self) -> (&NodalFields, Option<&NodalFields>) {
        (&self.last, self.before.as_ref())
    }

    /// The one before.
    pub fn into_before(self) -> Option<NodalFields> {
        self.before
    }

    /// Both flows on another mesh.
    pub fn moved(&self, to: &Discretisation<D>) -> Self {
        let from = &self.discretisation;
        if from.mesh == to.mesh {
            return self.clone();
        }
        let moved =
            |from_nodes: &NodeMap<D>, to_nodes: &NodeMap<D>, components: usize, fields: [&[f64]; 2]| {
                let mut moved = fields.map(|field| match field {
                    [] => Vec::new(),
                    _ => vec![0.0; to_nodes.node_count() * components],
                });
                let pairs = fields.into_iter().zip(moved.iter_mut().map(Vec::as_mut_slice));
                let mut pairs: Vec<_> = pairs.filter(|pair| !pair.0.is_empty()).collect();
                Evaluator::new(&from.mesh).transfer(from_nodes, components, to_nodes, &mut pairs);
                moved
            };
        let before =
            |field: fn(&NodalFields) -> &Vec<f64>| self.before.as_ref().map_or(&[][..], |b| field(b));
        let velocities = [&self.last.velocity, before(|fields| &fields.velocity)];
        let pressures = [&self.last.pressure, before(|fields| &fields.pressure)];
        let [velocity, velocity_before] = moved(&from.velocity, &to.velocity, D, velocities);
        let [pressure, pressure_before] = moved(&from.pressure, &to.pressure, 1, pressures);
        let parts = |fields: &NodalFields| (fields.bodies.clone(), fields.films.clone());
        let (bodies, films) = self.before.as_ref().map(parts).unwrap_or_default();
        let before = NodalFields { velocity: velocity_before, pressure: pressure_before, bodies, films };
        let (bodies, films) = parts(&self.last);
        Self {
            discretisation: to.clone(),
            last: NodalFields { velocity, pressure, bodies, films },
            before: self.before.is_some().then_some(before),
        }
    }

    /// The reduced vector a solve on its mesh starts from for the right-hand side `b`, and the last flow. All
    /// ranks call this.
    pub fn into_guess(self, system: &StokesSystem<D>, b: &[f64]) -> (Vec<f64>, NodalFields) {
        let mut guess = self.last.clone();
        if let Some(before) = &self.before {
            extrapolate(&before.velocity, &mut guess.velocity);
            extrapolate(&before.pressure, &mut guess.pressure);
            extrapolate(&before.bodies, &mut guess.bodies);
        }
        let space = &system.space;
        let mut x = guess.velocity;
        x.resize(system.velocity_dim(), 0.0);
        space.project(&mut x);
        let bodies = &mut x[space.full_dim()..];
        // No node moves like a body whose surface is where it is.
        if space.is_by_surface() && bodies.len() == guess.bodies.len() {
            bodies.copy_from_slice(&guess.bodies);
        }
        space.clear_held(&mut x);
        system.halos().velocities.clone().update(&mut x);
        if let Some(films) = system.films() {
            guess.films = films.of_motions(&x, system.parts(b)[2]);
            films.restore(&self.last.films, &mut guess.films);
            if let Some(before) = &self.before {
                let mut forces = guess.films.clone();
                films.restore(&before.films, &mut forces);
                extrapolate(&forces, &mut guess.films);
            }
        }
        system.pressure.clear_fixed(&mut guess.pressure);
        x.append(&mut guess.pressure);
        x.append(&mut guess.films);
        x.resize(system.dim(), 0.0);
        system.halo().clear(&mut x);
        (x, self.last)
    }
}

/// `last = 2 last - before`, unless the number of bodies has changed.
fn extrapolate(before: &[f64], last: &mut [f64]) {
    if before.len() != last.len() {
        return;
    }
    vector::scale(2.0, last);
    vector::axpy(-1.0, before, last);
}

#[cfg(test)]
mod tests {
    use gluey_geom::{Aabb, Dim, Vector};
    use gluey_levelset::Ball;

    use crate::{Conditions, FlowParams, FlowSolver, Refinement, SolverKind};

    /// A flow that is asked for again is its own guess: with the motions of the bodies, and the force of the
    /// film between them.
    fn a_flow_is_its_own_guess<const D: usize>(level: u8) {
        let at = |x: [f64; 3]| Ball::new(Vector::<D>::from_fn(|d, _| x[d]), 0.11);
        let bodies = [at([0.39, 0.53, 0.5]), at([0.61, 0.46, 0.51])];
        let params = FlowParams { solver: SolverKind::Multigrid, ..FlowParams::for_dimension(D) };
        let mut solver = FlowSolver::<D>::new(params).unwrap();
        let shear = |x: &Vector<D>| Vector::<D>::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 });
        let mut flow = || {
            let mesh = Refinement::to_level(level).mesh(Aabb::unit(), [1; D], [false; D], &bodies).unwrap();
            solver.solve_under(mesh, &bodies, &Conditions::boundary(&shear)).unwrap()
        };
        let first = flow();
        assert!(first.iteration_count > 5 && first.films.len() == 1, "{}", first.films.len());
        for _ in 0..2 {
            let again = flow();
            assert_eq!(again.iteration_count, 0, "{D}D");
            // The rows of films are made to hold again, which rounds: 3.5e-18 was measured in velocities of
            // 0.01 and spins of 0.3.
            for (again, first) in again.twists.iter().zip(&first.twists) {
                let spin = again.spin - first.spin;
                let spin = Dim::<D>::spin_slice(&spin).iter().fold(0.0f64, |most, spin| most.max(spin.abs()));
                assert!((again.velocity - first.velocity).amax().max(spin) < 1e-17, "{again:?} {first:?}");
            }
        }
    }

    #[test]
    fn flows_are_their_own_guesses() {
        a_flow_is_its_own_guess::<2>(5);
        a_flow_is_its_own_guess::<3>(4);
    }
}
