//! The pressures as large as the box, from its coarsest mesh without the bodies:
//! `z += P (S_0^-1 - T_0^-1) P^T r`, as in the serial solver.
//!
//! That mesh has some hundred pressures: all ranks know all of it, and one sum over all of them is the only
//! message.

use gluey_fem::{ImplicitTree, NodeMap, Part, TreeMesh};
use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::part::{MOST_PRESSURES, coarsest_level};
use gluey_stokes::{BoxCorrection, StokesError};
use nalgebra::{DMatrix, DVector};

use crate::pressures::SharedPressures;
use crate::space::LevelSpace;

/// Stands for no cell.
const NOWHERE: u32 = u32::MAX;

pub struct WholeBox<const D: usize> {
    map: NodeMap<D>,
    unknowns: Vec<u32>,
    correction: DMatrix<f32>,
    /// Coarse cell of each owned pressure and its place in it.
    places: Vec<(u32, [f32; D])>,
    load: DVector<f32>,
    corrected: DVector<f32>,
    sums: Vec<f64>,
}

impl<const D: usize> WholeBox<D>
where
    Dim<D>: Space<D>,
{
    /// `None` where the mesh is too large. Rank zero computes the matrix. All ranks call this.
    pub fn new(
        tree: &ImplicitTree<'_, D>,
        ranks: &Ranks,
        space: &LevelSpace<D>,
        pressures: &SharedPressures,
        viscosity: f64,
    ) -> Result<Option<Self>, StokesError> {
        let Some((mesh, map)) = small_mesh(tree) else { return Ok(None) };
        let computed = match ranks.rank() {
            0 => BoxCorrection::new(mesh.clone(), viscosity),
            _ => Ok(None),
        };
        // A failure ends all, later.
        let mut numbers = vec![0.0; 1 + map.node_count() * (map.node_count() + 1)];
        if let Ok(Some(BoxCorrection { unknowns, matrix })) = &computed {
            numbers[0] = unknowns.len() as f64;
            let values = unknowns.iter().map(|&q| f64::from(q));
            let values = values.chain(matrix.iter().map(|&entry| f64::from(entry)));
            numbers[1..].iter_mut().zip(values).for_each(|(number, value)| *number = value);
        }
        ranks.share(&mut numbers);
        computed?;
        let count = numbers[0] as usize;
        let unknowns = numbers[1..=count].iter().map(|&q| q as u32).collect();
        let correction = numbers[1 + count..][..count * count].iter().map(|&entry| entry as f32);
        let [load, corrected] = [(); 2].map(|()| DVector::zeros(count));
        let sums = vec![0.0; map.node_count()];
        Ok(Some(Self {
            places: places(&mesh, space, pressures),
            correction: DMatrix::from_iterator(count, count, correction),
            unknowns,
            map,
            load,
            corrected,
            sums,
        }))
    }

    /// Adds the correction at the owned unknowns.
    pub fn add(&mut self, ranks: &Ranks, r: &[f32], z: &mut [f32]) {
        let Self { map, unknowns, correction, places, load, corrected, sums } = self;
        sums.fill(0.0);
        for (&(cell, place), &r) in places.iter().zip(r).filter(|entry| entry.0.0 != NOWHERE) {
            for (corner, &node) in map.cell(cell as usize).iter().enumerate() {
                sums[node as usize] += f64::from(weight(corner, &place) * r);
            }
        }
        ranks.sum(sums);
        map.condense(1, |w| w, sums);
        load.iter_mut().zip(&*unknowns).for_each(|(load, &q)| *load = sums[q as usize] as f32);
        correction.mul_to(load, corrected);
        sums.fill(0.0);
        corrected.iter().zip(&*unknowns).for_each(|(z, &q)| sums[q as usize] = f64::from(*z));
        map.distribute(1, |w| w, sums);
        for (&(cell, place), z) in places.iter().zip(z).filter(|entry| entry.0.0 != NOWHERE) {
            let nodes = map.cell(cell as usize).iter().enumerate();
            *z += nodes.map(|(corner, &q)| weight(corner, &place) * sums[q as usize] as f32).sum::<f32>();
        }
    }
}

/// The coarsest mesh of the multigrid, or a coarser one that is small enough.
fn small_mesh<const D: usize>(tree: &ImplicitTree<'_, D>) -> Option<(TreeMesh<D>, NodeMap<D>)> {
    let coarsest = coarsest_level(tree.frame().roots()).min(tree.max_level());
    (0..=coarsest).rev().find_map(|depth| {
        let all = 0..tree.end();
        let mut asked = tree.forgotten();
        if roots(tree) << (usize::from(depth.saturating_sub(1)) * D) > MOST_PRESSURES {
            return None;
        }
        let mesh = (*Part::new(&mut asked, depth, &all, &all).mesh).clone();
        let map = NodeMap::new(&mesh, 1);
        (map.node_count() <= MOST_PRESSURES).then_some((mesh, map))
    })
}

fn roots<const D: usize>(tree: &ImplicitTree<'_, D>) -> usize {
    tree.frame().roots().iter().map(|&count| count as usize).product()
}

/// Where the owned unknowns lie in the coarse cells.
fn places<const D: usize>(
    coarse: &TreeMesh<D>,
    space: &LevelSpace<D>,
    pressures: &SharedPressures,
) -> Vec<(u32, [f32; D])> {
    let owned = &space.pressure.owned;
    let mut places = vec![(NOWHERE, [0.0; D]); owned.len()];
    let mesh = &space.part.mesh;
    for cell in space.part.own() {
        let own = &mesh.cells()[cell];
        let Some(covering) = coarse.find_covering(own) else { continue };
        let above = &coarse.cells()[covering];
        let scale = 1.0 / f64::from(1u32 << (own.level - above.level));
        for (corner, &node) in space.pressure.map.cell(cell).iter().enumerate() {
            let Some(k) = (node as usize).checked_sub(owned.start).filter(|&k| k < owned.len()) else {
                continue;
            };
            if pressures.is_free[k] {
                let along = |d: usize| {
                    let fine = f64::from(own.coords[d]) + (corner >> d & 1) as f64;
                    (fine * scale - f64::from(above.coords[d])) as f32
                };
                places[k] = (covering as u32, std::array::from_fn(along));
            }
        }
    }
    places
}

/// Of the value at a corner of a cell, at a place in it.
fn weight<const D: usize>(corner: usize, place: &[f32; D]) -> f32 {
    (0..D).map(|d| if corner >> d & 1 == 0 { 1.0 - place[d] } else { place[d] }).product()
}
