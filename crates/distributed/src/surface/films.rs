//! The network of films of all ranks: each has it whole, and the forces of its own films.

use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::part::{FilmCorrection, FilmNetwork, FilmRow};
use gluey_stokes::{StokesError, StokesSystem};

use super::space::SurfaceSpace;
use crate::agreement::{agreed, gathered};
use crate::bodies::{NearBodies, rigid};
use crate::flow::FlowError;

/// The network of films around all bodies, of which some may be `held`. All ranks call this.
///
/// # Errors
/// If the block of a body is not positive definite, on all ranks.
pub fn network<const D: usize>(
    ranks: &Ranks,
    system: &StokesSystem<D>,
    near: &NearBodies<D>,
    (body_count, held): (usize, &[bool]),
) -> Result<Option<FilmNetwork>, StokesError>
where
    Dim<D>: Space<D>,
{
    let renumbered = |row: FilmRow| row.renumbered(|body| near.ids[body as usize]);
    let own: Vec<FilmRow> = system.rows_of_motion().into_iter().map(renumbered).collect();
    let numbers: Vec<_> = own.iter().map(FilmRow::to_numbers).collect();
    let all: Vec<FilmRow> = gathered(ranks, &numbers).iter().map(FilmRow::from_numbers).collect();
    let size = rigid::<D>() * rigid::<D>();
    let mut blocks = vec![0.0; body_count * size];
    for (block, &body) in system.twist_blocks().chunks_exact(size).zip(&near.ids) {
        blocks[body as usize * size..][..size].copy_from_slice(block);
    }
    ranks.sum(&mut blocks);
    Ok(FilmNetwork::new::<D>(&blocks, held, &all, own)?)
}

/// What makes the films' rows hold, on owned vectors.
pub struct SharedFilms<'n> {
    correction: FilmCorrection<'n>,
    /// Numbers among all of the bodies whose twists are owned.
    own: Vec<u32>,
    /// Of all bodies.
    twists: Vec<f64>,
}

/// Those of iterates and of steps, on all ranks or none.
///
/// # Errors
/// If there is no memory on some rank.
pub fn corrections<'n, const D: usize>(
    network: Option<&'n FilmNetwork>,
    space: &SurfaceSpace<'_, D>,
    (near, body_count): (&NearBodies<D>, usize),
) -> Result<[Option<SharedFilms<'n>>; 2], FlowError>
where
    Dim<D>: Space<D>,
{
    let one = || {
        let films = network.map(|network| SharedFilms::new(network, space, (near, body_count)));
        agreed(space.ranks, films.transpose())
    };
    Ok([one()?, one()?])
}

impl<'n> SharedFilms<'n> {
    /// For vectors of a space.
    ///
    /// # Errors
    /// If there is no memory.
    fn new<const D: usize>(
        network: &'n FilmNetwork,
        space: &SurfaceSpace<'_, D>,
        (near, body_count): (&NearBodies<D>, usize),
    ) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        Ok(Self {
            correction: network.correction()?,
            own: space.own_bodies.iter().map(|&place| near.ids[place as usize]).collect(),
            twists: vec![0.0; body_count * rigid::<D>()],
        })
    }

    /// Changes owned velocities, twists behind nodes, and forces of own films so that the rows hold for the
    /// films' part of a right-hand side. All ranks call this.
    pub fn apply<const D: usize>(&mut self, space: &SurfaceSpace<'_, D>, b: &[f64], x: &mut [f64])
    where
        Dim<D>: Space<D>,
    {
        let Self { correction, own, twists } = self;
        let (ranks, n) = (space.ranks, rigid::<D>());
        let [u, _, g] = space.parts_mut(x);
        let own_twists = &mut u[space.level.owned_nodal_dim()..];
        twists.fill(0.0);
        for (twist, &body) in own_twists.chunks_exact(n).zip(&*own) {
            twists[body as usize * n..][..n].copy_from_slice(twist);
        }
        ranks.sum(twists);
        correction.apply(b, twists, g, |load| ranks.sum(load));
        for (twist, &body) in own_twists.chunks_exact_mut(n).zip(&*own) {
            twist.copy_from_slice(&twists[body as usize * n..][..n]);
        }
    }
}
