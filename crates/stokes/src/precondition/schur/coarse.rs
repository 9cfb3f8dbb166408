//! The Schur complement of the box, from its coarsest mesh.
//!
//! Of the pressures whose Schur complement is far below their mass some are as large as the box: the flow
//! that they would drive does not fit between its walls. A mesh of a few cells resolves them. With the Schur
//! complement `S_0` of such a mesh, which is dense and small, the weighted mass `T_0` that approximates it
//! (see [`super`]), and the interpolation `P` from its pressures,
//!
//! `z = T^-1 r + P (S_0^-1 - T_0^-1) P^T r`
//!
//! leaves all other pressures as they were. The bodies are left out: they change little on this scale, and
//! without them the matrix stays the same from step to step. In a box that is sheared it is that of a box
//! with nearly the same shear, one of few.

use std::sync::Arc;

use gluey_fem::{Interpolation, TreeMesh};
use gluey_linalg::{DirectError, LinOp, Ordering, Preconditioner, Subset, vector};
use gluey_parallel::Halo;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::mass::pressure_matrix;
use super::weights::without_bodies;
use crate::error::{SmallMatrix, StokesError};
use crate::operator::{Elements, StokesSystem, SystemOperator, assemble_viscous, factorised};
use crate::space::Discretisation;

/// Largest dense matrix.
const MOST_PRESSURES: usize = 1000;
/// Columns of `S_0` that a thread finds at a time.
const COLUMNS: usize = 16;
/// The matrix is that of a box whose shear is a multiple of this.
const SHEARS: f64 = 0.125;
/// Share of the mass that is added to `S_0`, for meshes so coarse that some pressure acts on no velocity.
const SHARE_OF_MASS: f64 = 1e-3;

/// `P (S_0^-1 - T_0^-1) P^T`.
pub struct CoarseSchur<const D: usize> {
    /// The meshes, coarsest first, and of those of all ranks the first.
    meshes: Vec<Discretisation<D>>,
    first_shared: usize,
    /// On the rank that holds all of the coarsest mesh.
    whole: Option<CoarsestSchur<D>>,
    /// `transfers[l]` joins the pressures of mesh `l` to those of mesh `l + 1`.
    transfers: Vec<Interpolation<D>>,
    /// Pressures on each mesh, and their halos.
    pressures: Vec<Vec<f32>>,
    halos: Vec<Halo>,
}

/// The correction on the coarsest mesh.
struct CoarsestSchur<const D: usize> {
    viscosity: f64,
    system: StokesSystem<D>,
    /// `S_0^-1 - T_0^-1` for the unknown pressures in `unknowns`.
    correction: DMatrix<f32>,
    unknowns: Subset,
    /// Load and correction at the unknown pressures.
    load: DVector<f32>,
    corrected: DVector<f32>,
}

impl<const D: usize> CoarseSchur<D> {
    /// The correction from the coarsest of `meshes` (coarsest first), or, where that is too fine, from its
    /// coarsening; `None` where even the cells from which the mesh was refined are too many. What stayed the
    /// same is taken from `before`. All ranks call this, with the halo of the pressures.
    pub fn new(
        meshes: &[Discretisation<D>],
        viscosity: f64,
        before: Option<Self>,
        halo: &Halo,
    ) -> Result<Option<Self>, StokesError> {
        let holds_all = meshes[0].partition().is_none_or(|part| part.is_whole);
        let with_coarsest = match holds_all {
            true => with_small_coarsest(meshes, before.as_ref()),
            false => Some(meshes.to_vec()),
        };
        let mut missing = [if with_coarsest.is_none() { 1.0 } else { 0.0 }];
        halo.sum_over_ranks(&mut missing);
        let Some(all) = with_coarsest.filter(|_| missing[0] == 0.0) else { return Ok(None) };
        let whole = || {
            let mesh = TreeMesh::clone(&all[0].mesh);
            let shear = (mesh.shear() / SHEARS).round() * SHEARS;
            let mesh = mesh.sheared(shear);
            let is_it = |old: &CoarsestSchur<D>| {
                old.viscosity == viscosity && *old.system.discretisation().mesh == mesh
            };
            let old = before.and_then(|old| old.whole).filter(is_it);
            let mut sheared = all[0].alone();
            sheared.mesh = Arc::new(mesh);
            old.map_or_else(|| CoarsestSchur::new(&sheared, viscosity), Ok)
        };
        let whole = meshes[0].agreed(holds_all.then(whole).transpose())?;
        let transfers = all.windows(2).map(|pair| pair[0].interpolation(&pair[1], |mesh| &mesh.pressure));
        let halo = |mesh: &Discretisation<D>| {
            mesh.partition().map_or_else(Halo::default, |part| part.pressures.clone())
        };
        Ok(Some(Self {
            first_shared: all.len() - meshes.len(),
            transfers: transfers.collect(),
            pressures: all.iter().map(|mesh| vec![0.0; mesh.pressure.node_count()]).collect(),
            halos: all.iter().map(halo).collect(),
            whole,
            meshes: all,
        }))
    }

    /// `z += P (S_0^-1 - T_0^-1) P^T r` on all pressure nodes of the finest mesh. `r` is zero but at
    /// unknowns, where its sum vanishes.
    pub fn add(&mut self, r: &[f32], z: &mut [f32]) {
        let Self { meshes, first_shared, whole, transfers, pressures, halos } = self;
        let top = meshes.len() - 1;
        pressures[top].copy_from_slice(r);
        for level in (0..top).rev() {
            let (below, above) = pressures.split_at_mut(level + 1);
            let first = meshes[level + 1].own_pressure_nodes().start;
            transfers[level].restrict::<1>(&above[0][first..], &mut below[level]);
            meshes[level].pressure.condense(1, |w| w as f32, &mut below[level]);
            halos[level].sum(&mut below[level]);
        }
        match whole {
            Some(whole) => whole.apply(&mut pressures[0]),
            None => pressures[0].fill(0.0),
        }
        for level in 0..=top {
            let (below, above) = pressures.split_at_mut(level + 1);
            if level == *first_shared {
                halos[level].sum(&mut below[level]);
            }
            let Some(above) = above.first_mut() else { break };
            meshes[level].pressure.distribute(1, |w| w as f32, &mut below[level]);
            let first = meshes[level + 1].own_pressure_nodes().start;
            transfers[level].prolong::<1>(&below[level], &mut above[first..]);
            halos[level + 1].update(above);
        }
        vector::axpy(1.0, &pressures[top], z);
    }
}

impl<const D: usize> CoarsestSchur<D> {
    fn new(coarsest: &Discretisation<D>, viscosity: f64) -> Result<Self, StokesError> {
        let system = without_bodies(coarsest, viscosity);
        let unknowns = Subset::new(system.pressure.dim(), |q| system.pressure.is_free(q));
        let correction = correction(&system, viscosity, unknowns.positions())?;
        let [load, corrected] = [(); 2].map(|()| DVector::zeros(unknowns.len()));
        Ok(Self { viscosity, system, correction, unknowns, load, corrected })
    }

    /// From loads on the pressures of the mesh to their correction.
    fn apply(&mut self, pressures: &mut [f32]) {
        let Self { system, correction, unknowns, load, corrected, .. } = self;
        system.pressure.reduce(pressures);
        unknowns.gather(pressures, load.as_mut_slice());
        correction.mul_to(load, corrected);
        unknowns.scatter(corrected.as_slice(), pressures);
    }
}

/// The meshes, with coarser ones put before them until the first has few enough pressures.
fn with_small_coarsest<const D: usize>(
    meshes: &[Discretisation<D>],
    before: Option<&CoarseSchur<D>>,
) -> Option<Vec<Discretisation<D>>> {
    let mut all = meshes.to_vec();
    while all[0].pressure.node_count() > MOST_PRESSURES {
        let level = all[0].mesh.max_level().checked_sub(1)?;
        let is_it = |old: &&Discretisation<D>| {
            old.mesh.max_level() == level && old.mesh.is_coarsening_of(&all[0].mesh)
        };
        let kept = before.and_then(|before| before.meshes.iter().find(is_it).cloned());
        all.insert(0, kept.unwrap_or_else(|| Discretisation::new(all[0].mesh.coarsened(level))));
    }
    Some(all)
}

/// `S_0^-1 - T_0^-1`, up to constants, which do not matter for loads without a mean.
fn correction<const D: usize>(
    system: &StokesSystem<D>,
    viscosity: f64,
    unknowns: &[u32],
) -> Result<DMatrix<f32>, StokesError> {
    let discretisation = system.discretisation();
    let failed = |matrix| StokesError::BoxPressures {
        matrix,
        pressures: unknowns.len(),
        cells: discretisation.mesh.cell_count(),
    };
    let elements = Elements::new(system, gluey_fem::ReferenceMatrices::<D>::VELOCITY);
    let mass = pressure_matrix(&elements, viscosity)?;
    let count = unknowns.len();
    let mass = DMatrix::from_fn(count, count, |i, j| mass.get(unknowns[i] as usize, unknowns[j] as usize));
    let mut schur = dense_schur(system, unknowns)? + SHARE_OF_MASS * &mass;
    // Constants, which act on no velocity, get a stiffness like that of the rest.
    schur.add_scalar_mut(schur.trace() / (count * count) as f64);
    let schur = schur.cholesky().ok_or_else(|| failed(SmallMatrix::Schur))?;
    let mass = mass.cholesky().ok_or_else(|| failed(SmallMatrix::Mass))?;
    Ok((schur.inverse() - mass.inverse()).cast())
}

/// `B A^-1 B^T` on the unknown pressures.
fn dense_schur<const D: usize>(
    system: &StokesSystem<D>,
    unknowns: &[u32],
) -> Result<DMatrix<f64>, StokesError> {
    let assembled = assemble_viscous(system)?;
    let factor = factorised(&assembled.matrix, Ordering::Amd)?;
    let velocities = system.velocity_dim();
    let mut schur = DMatrix::zeros(unknowns.len(), unknowns.len());
    let [count, free] = [unknowns.len(), assembled.unknowns.len()].map(|len| len.max(1));
    let blocks = schur.as_mut_slice().par_chunks_mut(COLUMNS * count).zip(unknowns.par_chunks(COLUMNS));
    let failures = blocks.map_init(
        || (factor.substitution(COLUMNS), SystemOperator::new(system)),
        |(factor, operator), (columns, pressures)| {
            let factor = factor.as_mut().map_err(|error| error.clone())?;
            let [mut loads, mut answers] = [(); 2].map(|()| vec![0.0; pressures.len() * free]);
            let [mut x, mut y] = [(); 2].map(|()| vec![0.0f64; system.dim()]);
            for (load, &q) in loads.chunks_exact_mut(free).zip(pressures) {
                x[velocities + q as usize] = 1.0;
                operator.apply(&x, &mut y);
                x[velocities + q as usize] = 0.0;
                assembled.unknowns.gather(&y, load);
            }
            factor.apply(&loads, &mut answers);
            for (column, answer) in columns.chunks_exact_mut(count).zip(answers.chunks_exact(free)) {
                assembled.unknowns.scatter(answer, &mut x);
                operator.apply(&x, &mut y);
                column.iter_mut().zip(unknowns).for_each(|(entry, &p)| *entry = y[velocities + p as usize]);
            }
            Ok(())
        },
    );
    failures.collect::<Result<(), DirectError>>()?;
    Ok(schur)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_geom::{Aabb, Vector};

    /// Meshes of a long box, from level 2 on, the finest with hanging nodes.
    fn long_box(roots: u32) -> Vec<Discretisation<2>> {
        let domain = Aabb { lower: Vector::zeros(), upper: Vector::from([f64::from(roots), 4.0]) };
        let mesh = TreeMesh::refine(domain, [roots, 4], [false; 2], 3, |lower, _, level| {
            level < 2 || lower[0] < 1.0
        });
        let mesh = mesh.unwrap();
        vec![Discretisation::new(mesh.coarsened(2)), Discretisation::new(mesh)]
    }

    /// `y . C x` for the correction `C` between unknowns.
    fn product(correction: &mut CoarseSchur<2>, x: &[f32], y: &[f32]) -> f64 {
        let mut z = vec![0.0; x.len()];
        correction.add(x, &mut z);
        vector::dot(y, &z)
    }

    fn loads(mesh: &Discretisation<2>, seed: u64) -> Vec<f32> {
        let mut load = vec![0.0; mesh.pressure.node_count()];
        vector::fill_pseudo_random(seed, &mut load);
        mesh.pressure.constraints().iter().for_each(|c| load[c.node as usize] = 0.0);
        load
    }

    #[test]
    fn a_box_of_many_roots_is_coarsened_until_its_matrix_is_small() {
        let meshes = long_box(20);
        assert!(meshes[0].pressure.node_count() > MOST_PRESSURES);
        let mut correction = CoarseSchur::new(&meshes, 2.0, None, &Halo::default()).unwrap().unwrap();
        assert_eq!(correction.meshes.len(), 3);
        assert_eq!(correction.whole.as_ref().unwrap().unknowns.len(), 41 * 9);
        let [x, y] = [1, 2].map(|seed| loads(&meshes[1], seed));
        let (xy, yx) = (product(&mut correction, &x, &y), product(&mut correction, &y, &x));
        assert!((xy - yx).abs() < 1e-4 * xy.abs(), "{xy} {yx}");
        assert!(CoarseSchur::new(&long_box(300), 2.0, None, &Halo::default()).unwrap().is_none());
    }

    /// A negative viscosity makes a negative mass.
    #[test]
    fn a_matrix_that_is_not_positive_is_named() {
        let mesh = &long_box(3)[0];
        let system = without_bodies(mesh, 2.0);
        let unknowns: Vec<u32> = (0..system.pressure.dim() as u32).collect();
        let refused = correction(&system, -2.0, &unknowns).err();
        let expected =
            StokesError::BoxPressures { matrix: SmallMatrix::Mass, pressures: 13 * 17, cells: 12 * 16 };
        assert_eq!(refused, Some(expected));
    }

    #[test]
    fn the_matrix_is_kept_while_coarsest_mesh_and_viscosity_stand() {
        let meshes = long_box(3);
        let first = CoarseSchur::new(&meshes, 2.0, None, &Halo::default()).unwrap().unwrap();
        let matrix = first.whole.as_ref().unwrap().correction.clone();
        let again = CoarseSchur::new(&meshes, 2.0, Some(first), &Halo::default()).unwrap().unwrap();
        assert_eq!(again.whole.as_ref().unwrap().correction, matrix);
        let thicker = CoarseSchur::new(&meshes, 4.0, Some(again), &Halo::default()).unwrap().unwrap();
        assert!((thicker.whole.unwrap().correction - matrix.scale(2.0)).amax() < 1e-4 * matrix.amax());
    }
}
