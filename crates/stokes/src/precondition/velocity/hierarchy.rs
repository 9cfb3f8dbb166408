//! The meshes of the levels: level `l` is the finest mesh cut at depth `l`.

use std::sync::Arc;

use gluey_fem::Interpolation;

use crate::space::Discretisation;

/// Cells of the coarsest mesh along the shortest edge of the box, at most, unless it has more roots.
const COARSEST_CELLS: u32 = 4;

/// The meshes of the levels, coarsest first.
pub struct Hierarchy<const D: usize> {
    /// The meshes, coarsest first.
    pub meshes: Vec<Discretisation<D>>,
    /// `transfers[l]` joins mesh `l` to mesh `l + 1`.
    pub transfers: Vec<Interpolation<D>>,
}

impl<const D: usize> Default for Hierarchy<D> {
    fn default() -> Self {
        Self { meshes: Vec::new(), transfers: Vec::new() }
    }
}

impl<const D: usize> Hierarchy<D> {
    /// The parts of a rank of these meshes, coarsest first.
    pub fn of_parts(meshes: Vec<Discretisation<D>>) -> Self {
        let transfers = meshes.windows(2).map(|pair| pair[0].interpolation(&pair[1], |mesh| &mesh.velocity));
        Self { transfers: transfers.collect(), meshes }
    }

    /// The meshes below `finest`. What was the same in the hierarchy `before` is taken from there.
    pub fn new(finest: &Discretisation<D>, before: Self) -> Self {
        let depth = finest.mesh.max_level();
        let mut meshes: Vec<Discretisation<D>> = (coarsest_level(finest.mesh.roots()).min(depth)..depth)
            .map(|level| {
                let is_kept = |mesh: &&Discretisation<D>| {
                    mesh.mesh.max_level() == level && mesh.mesh.is_coarsening_of(&finest.mesh)
                };
                let kept = before.meshes.iter().find(is_kept).cloned();
                kept.unwrap_or_else(|| Discretisation::new(finest.mesh.coarsened(level)))
            })
            .collect();
        meshes.push(finest.clone());
        let mut kept: Vec<_> = before.meshes.windows(2).zip(before.transfers).collect();
        let transfers = meshes.windows(2).map(|pair| {
            let is_same =
                |old: &[Discretisation<D>]| (0..2).all(|k| Arc::ptr_eq(&old[k].mesh, &pair[k].mesh));
            if let Some(place) = kept.iter().position(|old| is_same(old.0)) {
                return kept.swap_remove(place).1;
            }
            pair[0].interpolation(&pair[1], |mesh| &mesh.velocity)
        });
        Self { transfers: transfers.collect(), meshes }
    }
}

/// Depth of the coarsest mesh of a box with so many roots along its edges.
pub fn coarsest_level<const D: usize>(roots: [u32; D]) -> u8 {
    let roots = roots.into_iter().min().unwrap_or(1);
    (COARSEST_CELLS / roots).max(1).ilog2() as u8
}
