//! The network of films of all ranks: each has it whole, and the forces of its own films.

use gluey_geom::{Dim, Space};
use gluey_parallel::Communicator;
use gluey_stokes::part::{FilmNetwork, FilmRow, SharedTwists};
use gluey_stokes::{StokesError, StokesSystem};

use crate::agreement::gathered;
use crate::bodies::{NearBodies, Shared, rigid};

/// The network of films around all bodies. All ranks call this.
///
/// # Errors
/// If the block of a body is not positive definite, on all ranks.
pub fn network<const D: usize>(
    system: &StokesSystem<D>,
    near: &NearBodies<D>,
    shared: &Shared<'_, '_, D>,
) -> Result<Option<FilmNetwork>, StokesError>
where
    Dim<D>: Space<D>,
{
    let Shared { ranks, bodies, held, .. } = *shared;
    let renumbered = |row: FilmRow| row.renumbered(|body| near.ids[body as usize]);
    let own: Vec<FilmRow> = system.rows_of_motion().into_iter().map(renumbered).collect();
    let numbers: Vec<_> = own.iter().map(FilmRow::to_numbers).collect();
    let all: Vec<FilmRow> = gathered(ranks, &numbers).iter().map(FilmRow::from_numbers).collect();
    let size = rigid::<D>() * rigid::<D>();
    let mut blocks = vec![0.0; bodies.balls().len() * size];
    for (block, &body) in system.twist_blocks().chunks_exact(size).zip(&near.ids) {
        blocks[body as usize * size..][..size].copy_from_slice(block);
    }
    ranks.sum(&mut blocks);
    let twists = SharedTwists {
        halo: system.halo().clone(),
        bodies: near.ids.clone(),
        is_own: near.owners.iter().map(|&owner| owner == ranks.rank()).collect(),
    };
    Ok(FilmNetwork::new::<D>(&blocks, held, &all, own)?.map(|network| network.with_shared(twists)))
}
