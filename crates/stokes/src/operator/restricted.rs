//! The viscous operator of some of the cells, and that on some of the velocities, with all others at rest:
//! `E^T A E`.

use gluey_fem::cells::{CellOperator, CellScalar, Workspace};
use gluey_linalg::{LinOp, Scalar};
use gluey_parallel::{Halo, Number};
use rayon::prelude::*;

use super::cells::{AddedViscosity, cell_operator};
use super::system::StokesSystem;
use crate::space::{ActiveCell, Discretisation, VelocitySpace, cells_touching};

/// Entries that a thread takes at a time.
const PIECE: usize = 8192;

/// The viscous operator of some cells, which counts its applications.
#[derive(Clone, Debug)]
pub struct CountedOperator<T, const D: usize> {
    operator: CellOperator<T, D>,
    work: Workspace<T>,
    /// Reduced velocities.
    dim: usize,
    /// Of these.
    halo: Halo,
    /// Fraction of all cells.
    share: f64,
    applications: usize,
}

impl<T: CellScalar, const D: usize> CountedOperator<T, D> {
    /// The fluid's operator in these cells, of `cell_count` in all, on the velocities of `space`.
    pub fn new(space: &VelocitySpace<D>, cells: &[ActiveCell], cell_count: usize) -> Self {
        Self::with_viscosity(space, cells, cell_count, None)
    }

    /// The operator of a system in some of its cells.
    pub fn within(system: &StokesSystem<D>, cells: &[ActiveCell]) -> Self {
        Self::with_viscosity(&system.space, cells, system.cells.len(), system.added.as_deref())
    }

    fn with_viscosity(
        space: &VelocitySpace<D>,
        cells: &[ActiveCell],
        cell_count: usize,
        added: Option<&dyn AddedViscosity<D>>,
    ) -> Self {
        Self {
            operator: cell_operator(space, cells, added),
            work: Workspace::default(),
            dim: space.dim(),
            halo: space.halo().clone(),
            share: cells.len() as f64 / cell_count.max(1) as f64,
            applications: 0,
        }
    }

    /// The reduced loads of nodal velocities that fulfil the constraints.
    pub fn apply_to_field(&mut self, x: &[T], y: &mut [T]) {
        self.applications += 1;
        self.operator.viscous_of_field(x, y, &mut self.work);
    }

    /// Fraction of all cells.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Applications since the last call, each as its share of the cells.
    pub fn take_applications(&mut self) -> f64 {
        std::mem::take(&mut self.applications) as f64 * self.share
    }
}

/// On vectors that hold the same at ghosts as at their owners.
impl<T: CellScalar + Number, const D: usize> LinOp<T> for CountedOperator<T, D> {
    fn dim(&self) -> usize {
        self.dim
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        self.applications += 1;
        self.operator.viscous(x, y, &mut self.work);
        self.halo.sum(y);
    }
}

/// `E^T A E` from the cells that act on its unknowns.
#[derive(Clone, Debug)]
pub struct Restricted<T, const D: usize> {
    /// The unknowns among the reduced velocities.
    positions: Vec<u32>,
    operator: CountedOperator<T, D>,
    /// Reduced velocities, zero away from the unknowns, and their loads.
    velocity: Vec<T>,
    load: Vec<T>,
}

/// The cells whose stress acts on marked nodes.
pub fn acting<const D: usize>(
    discretisation: &Discretisation<D>,
    cells: &[ActiveCell],
    marked: &[bool],
) -> Vec<ActiveCell> {
    let acts = cells_touching(&discretisation.velocity, marked);
    cells.iter().filter(|c| acts[c.cell as usize]).copied().collect()
}

impl<T: CellScalar + Number, const D: usize> Restricted<T, D> {
    /// The operator on the velocities at `positions`, from one of the cells that act on these.
    pub fn new(operator: CountedOperator<T, D>, positions: Vec<u32>) -> Self {
        let [velocity, load] = [(); 2].map(|()| vec![T::ZERO; operator.dim]);
        Self { positions, operator, velocity, load }
    }

    /// The unknowns among the reduced velocities.
    pub fn positions(&self) -> &[u32] {
        &self.positions
    }

    /// `r = E^T (b - A x)` for reduced velocities `x`.
    pub fn residual(&mut self, b: &[T], x: &[T], r: &mut [T]) {
        self.operator.apply(x, &mut self.load);
        for (r, &k) in r.iter_mut().zip(&self.positions) {
            *r = b[k as usize] - self.load[k as usize];
        }
    }

    /// Applications since the last call, each as its share of the cells.
    pub fn take_applications(&mut self) -> f64 {
        self.operator.take_applications()
    }
}

impl<T: CellScalar + Number, const D: usize> LinOp<T> for Restricted<T, D> {
    fn dim(&self) -> usize {
        self.positions.len()
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        for (&k, &x) in self.positions.iter().zip(x) {
            self.velocity[k as usize] = x;
        }
        self.operator.apply(&self.velocity, &mut self.load);
        gather(&self.positions, &self.load, y);
    }
}

/// `to = E^T from`.
pub fn gather<T: Scalar>(positions: &[u32], from: &[T], to: &mut [T]) {
    let pieces = to.par_chunks_mut(PIECE).zip(positions.par_chunks(PIECE));
    pieces.for_each(|(to, positions)| {
        to.iter_mut().zip(positions).for_each(|(value, &k)| *value = from[k as usize]);
    });
}

/// `to += E from`, for ascending positions.
pub fn add_at<T: Scalar>(positions: &[u32], from: &[T], to: &mut [T]) {
    debug_assert!(positions.is_sorted(), "positions ascend");
    add_behind(0, positions, from, to);
}

/// The same for a `to` that begins at position `first`.
fn add_behind<T: Scalar>(first: usize, positions: &[u32], from: &[T], to: &mut [T]) {
    if positions.len() <= PIECE {
        positions.iter().zip(from).for_each(|(&k, &value)| to[k as usize - first] += value);
        return;
    }
    let middle = positions.len() / 2;
    let (positions, from) = (positions.split_at(middle), from.split_at(middle));
    let start = positions.1[0] as usize;
    let to = to.split_at_mut(start - first);
    rayon::join(
        || add_behind(first, positions.0, from.0, to.0),
        || add_behind(start, positions.1, from.1, to.1),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_gathered_and_added_where_they_belong() {
        let positions: Vec<u32> = (0..5 * PIECE as u32 / 2).map(|k| 3 * k + k % 2).collect();
        let from: Vec<f64> = (0..positions.len()).map(|k| (0.3 * k as f64).cos()).collect();
        let mut whole: Vec<f64> = (0..3 * positions.len()).map(|k| k as f64).collect();
        let mut want = whole.clone();
        positions.iter().zip(&from).for_each(|(&k, from)| want[k as usize] += from);
        add_at(&positions, &from, &mut whole);
        assert_eq!(whole, want);
        let mut gathered = vec![f64::NAN; positions.len()];
        gather(&positions, &whole, &mut gathered);
        assert!(gathered.iter().zip(&positions).all(|(x, &k)| *x == want[k as usize]));
    }
}
