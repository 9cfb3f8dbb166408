//! The coarsest level: gathered to rank zero, solved there, and sent back.

use gluey_geom::{Dim, Space};
use gluey_stokes::part::CoarseSolver;
use gluey_stokes::{Discretisation, StokesError, VelocitySpace, solid_nodes};

use crate::bodies::{Shared, rigid};
use crate::space::LevelSpace;

/// The solver of a level that lies whole in this rank.
pub struct WholeLevel {
    solver: CoarseSolver,
    /// Numbers of the bodies of the level among all, in the order of its twists.
    ids: Vec<u32>,
    /// Velocities at all nodes, then the twists of all bodies.
    b: Vec<f32>,
    x: Vec<f32>,
}

impl WholeLevel {
    /// For the level of a rank that holds all cells.
    ///
    /// # Errors
    /// If the viscous matrix has no factor.
    pub fn new<const D: usize>(
        space: &LevelSpace<D>,
        shared: &Shared<'_, '_, D>,
        viscosity: f64,
    ) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        let whole = Discretisation::new((*space.part.mesh).clone());
        let bodies = shared.bodies.balls();
        let solid = solid_nodes(&whole.mesh, &whole.velocity, bodies, shared.offset);
        let mut velocities = VelocitySpace::new(&whole, bodies, &solid);
        velocities.hold(shared.held);
        let [b, x] = [(); 2].map(|()| vec![0.0; velocities.dim()]);
        Ok(Self { solver: CoarseSolver::new(velocities, viscosity)?, ids: space.bodies.ids.clone(), b, x })
    }

    /// `x = A^-1 b` at all nodes and for the twists of the level.
    pub fn solve<const D: usize>(&mut self, space: &LevelSpace<D>, b: &[f32], x: &mut [f32]) {
        let (nodal, n) = (space.nodal_dim(), rigid::<D>());
        self.b[..nodal].copy_from_slice(&b[..nodal]);
        self.b[nodal..].fill(0.0);
        let at = |id: u32| nodal + id as usize * n..nodal + (id as usize + 1) * n;
        for (&id, twist) in self.ids.iter().zip(b[nodal..].chunks_exact(n)) {
            self.b[at(id)].copy_from_slice(twist);
        }
        self.solver.solve(&self.b, &mut self.x);
        x[..nodal].copy_from_slice(&self.x[..nodal]);
        for (&id, twist) in self.ids.iter().zip(x[nodal..].chunks_exact_mut(n)) {
            twist.copy_from_slice(&self.x[at(id)]);
        }
    }
}
