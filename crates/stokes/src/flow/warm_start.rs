//! Initial guesses of iterative solves: the last two flows, extrapolated in time.
//!
//! The deviation `d` from the undisturbed flow at the next step is guessed as `2 d^n - d^(n-1)`, both moved
//! to the new mesh. `d^(n-1)` was already moved to the mesh of `d^n` one step before, so both live on one
//! mesh. The extrapolation assumes equal steps; others only make it a worse guess.
//!
//! In `rigid-dofs` the guess is `d^n`: nodes enter and leave the bodies one by one, and extrapolation doubles
//! the jumps this makes. Iterations from these and from other guesses are in
//! `docs/experiments/0010-krylov-vectors.md`.

use gluey_fem::Evaluator;
use gluey_fem::{NodeMap, TreeMesh};
use gluey_geom::{Dim, Space};
use gluey_linalg::vector;

use crate::operator::StokesSystem;
use crate::space::Discretisation;

/// Velocity at the velocity nodes (`D` interleaved components) and pressure at the pressure nodes of one
/// mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NodalFields {
    /// Velocities.
    pub velocity: Vec<f64>,
    /// Pressures.
    pub pressure: Vec<f64>,
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
pub(crate) struct WarmStart<const D: usize>
where
    Dim<D>: Space<D>,
{
    discretisation: Discretisation<D>,
    last: NodalFields,
    before: Option<NodalFields>,
}

impl<const D: usize> WarmStart<D>
where
    Dim<D>: Space<D>,
{
    /// From the deviation `last` on a mesh, and the one before it on the same mesh, if known.
    pub fn new(discretisation: Discretisation<D>, last: NodalFields, before: Option<NodalFields>) -> Self {
        Self { discretisation, last, before }
    }

    /// As [`WarmStart::new`] for stored fields.
    ///
    /// # Errors
    /// If their lengths do not fit the mesh.
    pub fn restore(
        mesh: TreeMesh<D>,
        last: NodalFields,
        before: Option<NodalFields>,
    ) -> Result<Self, WarmStartError> {
        let discretisation = Discretisation::new(mesh);
        let velocity_count = discretisation.velocity.node_count() * D;
        let pressure_count = discretisation.pressure.node_count();
        for NodalFields { velocity, pressure } in std::iter::once(&last).chain(&before) {
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
        let before = NodalFields { velocity: velocity_before, pressure: pressure_before };
        Self {
            discretisation: to.clone(),
            last: NodalFields { velocity, pressure },
            before: self.before.is_some().then_some(before),
        }
    }

    /// The reduced vector a solve on its mesh starts from, and the last flow.
    pub fn into_guess(self, system: &StokesSystem<D>) -> (Vec<f64>, NodalFields) {
        let mut guess = self.last.clone();
        if let Some(before) = &self.before {
            extrapolate(&before.velocity, &mut guess.velocity);
            extrapolate(&before.pressure, &mut guess.pressure);
        }
        let mut x = guess.velocity;
        x.resize(system.velocity_dim(), 0.0);
        system.space.project(&mut x);
        system.pressure.clear_fixed(&mut guess.pressure);
        x.append(&mut guess.pressure);
        x.resize(system.dim(), 0.0);
        (x, self.last)
    }
}

/// `last = 2 last - before`.
fn extrapolate(before: &[f64], last: &mut [f64]) {
    vector::scale(2.0, last);
    vector::axpy(-1.0, before, last);
}
