//! What a flow is computed with.

use gluey_fem::{Cuts, ImplicitTree};
use gluey_geom::{Dim, Space};
use gluey_levelset::Ball;
use gluey_parallel::{Ranks, Traffic};
use gluey_stokes::{Conditions, Discretisation, GivenOf, Lubrication, StokesError};

use crate::bodies::{NearBodies, Shared};
use crate::flow::{BoxFlow, LevelSizes};
use crate::space::LevelSpace;

/// Bodies whose surfaces cut the mesh where they are, all of which every rank knows.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceBodies<'a, const D: usize> {
    /// The bodies.
    pub balls: &'a [Ball<D>],
    /// Treatment of films that are too thin for the mesh.
    pub lubrication: Lubrication,
}

/// A tree and the ranks that share its leaves.
pub struct SharedTree<'s, 't, const D: usize> {
    pub tree: &'s mut ImplicitTree<'t, D>,
    pub cuts: &'s Cuts,
    pub ranks: &'s Ranks,
}

/// What a flow is computed with.
pub struct SolveContext<'f, 'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    pub flow: &'f BoxFlow,
    pub shared: Shared<'a, 'f, D>,
    pub bodies: NearBodies<D>,
    pub discretisation: Discretisation<D>,
    pub level: LevelSpace<D>,
    pub sizes: Vec<LevelSizes>,
    pub conditions: &'f Conditions<'f, D>,
    /// What is known of the bodies near the part; wrenches of those alone that this rank owns.
    pub given: Vec<GivenOf<D>>,
    /// Whether the flow is kept for the next one.
    pub keeps: bool,
    /// What was sent before.
    pub start: Traffic,
}

impl<const D: usize> SolveContext<'_, '_, D>
where
    Dim<D>: Space<D>,
{
    /// With the numbers of bodies among all.
    pub fn named<T>(&self, outcome: Result<T, StokesError>) -> Result<T, StokesError> {
        outcome.map_err(|error| error.with_bodies(|place| self.bodies.ids[place] as usize))
    }
}
