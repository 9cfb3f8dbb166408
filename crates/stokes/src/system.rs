//! The discrete Stokes problem on one mesh.
//!
//! For `-div(2 eta eps(u)) + grad p = f`, `div u = 0` the matrix is `[A, -B^T; -B, 0]` in the reduced unknowns of
//! [`VelocitySpace`] and the pressure nodes. Cells that move as one body are left out: they have no strain. Pressure
//! nodes that see no cell with a free node are dropped.

use std::sync::Arc;

use gluey_fem::ReferenceMatrices;
use gluey_fem::cells::{CellData, CellOperator, CellScalar, Workspace};
use gluey_geom::{Dim, Space};
use gluey_linalg::{LinOp, Pattern, Scalar, SparseMatrix, vector};

use crate::cell_schur::PressureMatrices;
use crate::discretisation::{CellKind, Discretisation, cell_kind};
use crate::error::StokesError;
use crate::pressure::{PressureSpace, WeakPressures};
use crate::solid::SolidStress;
use crate::space::VelocitySpace;

/// The viscous stress of the penalised solid and the factor it enters the operator with.
#[derive(Clone, Debug)]
pub struct Penalty<const D: usize> {
    /// `1 - 1/r`.
    pub factor: f64,
    /// `K(I eta_s)`.
    pub stress: SolidStress<D>,
}

impl<const D: usize> Penalty<D> {
    /// The ratio `r` of the viscosities of solid and fluid.
    pub fn contrast(&self) -> f64 {
        1.0 / (1.0 - self.factor)
    }
}

/// Operator of the Stokes problem on a mesh, matrix-free.
#[derive(Clone, Debug)]
pub struct StokesSystem<const D: usize> {
    /// Reduced velocities.
    pub space: VelocitySpace<D>,
    /// Reduced pressures.
    pub pressure: PressureSpace<D>,
    /// Cells that are not rigid, with the scales of their matrices.
    pub cells: Vec<ActiveCell>,
    /// The penalised solid, in that formulation.
    pub penalty: Option<Penalty<D>>,
    operator: CellOperator<f64, D>,
}

/// A cell that is not rigid.
#[derive(Clone, Copy, Debug)]
pub struct ActiveCell {
    /// Index in the mesh.
    pub cell: u32,
    /// `eta_f h^(D-2)`.
    pub viscous: f64,
    /// `h^(D-1)`.
    pub divergence: f64,
    /// `h^D`.
    pub volume: f64,
}

/// The cells that are not rigid.
pub fn active_cells<const D: usize>(
    discretisation: &Discretisation<D>,
    space: &VelocitySpace<D>,
    viscosity: f64,
) -> Vec<ActiveCell>
where
    Dim<D>: Space<D>,
{
    let kind = |cell: usize| {
        cell_kind(discretisation.velocity.cell(cell).iter().map(|&n| space.body_of(n as usize)))
    };
    let active = |cell: usize| {
        let h = discretisation.cell_size(cell);
        ActiveCell {
            cell: cell as u32,
            viscous: viscosity * h.powi(D as i32 - 2),
            divergence: h.powi(D as i32 - 1),
            volume: h.powi(D as i32),
        }
    };
    (0..discretisation.mesh.cell_count()).filter(|&c| kind(c) != CellKind::Rigid).map(active).collect()
}

/// The diagonal of `A` in nodal velocities, as cells add it up: each with the multiple of the viscous reference matrix and the
/// matrix of its own that it has. Boundary, bodies and hanging nodes are nodes like all others.
pub fn viscous_diagonal<'a, const D: usize>(
    discretisation: &Discretisation<D>,
    cells: impl Iterator<Item = (&'a ActiveCell, f64, Option<&'a [f64]>)>,
) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    let nodes = &discretisation.velocity;
    let viscous = ReferenceMatrices::<D>::new().viscous;
    let n = ReferenceMatrices::<D>::VELOCITY;
    let mut nodal = vec![0.0; nodes.node_count() * D];
    for (cell, scale, own) in cells {
        for (i, &node) in nodes.cell(cell.cell as usize).iter().enumerate() {
            for c in 0..D {
                let k = (i * D + c) * (n + 1);
                nodal[node as usize * D + c] += scale * viscous[k] + own.map_or(0.0, |own| own[k]);
            }
        }
    }
    nodal
}

/// The operator of these cells, with the penalised solid in one pass with the fluid.
pub fn cell_operator<T: CellScalar, const D: usize>(
    discretisation: &Discretisation<D>,
    space: &VelocitySpace<D>,
    cells: &[ActiveCell],
    penalty: Option<&Penalty<D>>,
) -> CellOperator<T, D>
where
    Dim<D>: Space<D>,
{
    let solid = penalty.map(|p| p.stress.viscosities(p.factor, discretisation.mesh.cell_count()));
    let data = cells.iter().map(|c| {
        let (interior, points) = solid.as_ref().map_or((0.0, &[][..]), |s| s.of(c.cell as usize));
        let viscous = c.viscous + interior;
        CellData { cell: c.cell as usize, viscous, divergence: c.divergence, points }
    });
    let quadrature = penalty.map_or(1, |p| p.stress.quadrature());
    let ties = space.ties();
    CellOperator::new(&discretisation.chunks, space.nodes(), data, quadrature, &ties, space.body_count())
}

impl<const D: usize> StokesSystem<D>
where
    Dim<D>: Space<D>,
{
    /// The system with fluid viscosity `viscosity` on the velocities of `space`.
    pub fn new(
        discretisation: &Discretisation<D>,
        space: VelocitySpace<D>,
        viscosity: f64,
        weak: WeakPressures,
        penalty: Option<Penalty<D>>,
    ) -> Self {
        let cells = active_cells(discretisation, &space, viscosity);
        Self {
            pressure: PressureSpace::new(discretisation, &space, &cells, weak),
            operator: cell_operator(discretisation, &space, &cells, penalty.as_ref()),
            space,
            cells,
            penalty,
        }
    }

    /// Length of a vector: reduced velocities, then all pressure nodes.
    pub fn dim(&self) -> usize {
        self.velocity_dim() + self.pressure.dim()
    }

    /// Length of the velocity part of a vector.
    pub fn velocity_dim(&self) -> usize {
        self.space.dim()
    }

    /// `b -= [A, -B^T; -B, 0] (u, p)` for a nodal velocity field that already fulfils all constraints (it may carry
    /// boundary values), with the result in reduced form.
    pub fn residual(&self, u: &[f64], p: &[f64], b: &mut [f64]) {
        let mut y = vec![0.0; self.dim()];
        let (yu, yp) = y.split_at_mut(self.velocity_dim());
        self.operator.stokes_of_field(u, p, yu, yp, &mut Workspace::default());
        self.reduce_pressures(yp);
        vector::axpy(-1.0, &y, b);
    }

    /// From nodal loads and unconstrained divergences to the reduced vector, in place. Divergences are made to sum to
    /// zero: where two bodies share cells without a free node the flow between them is not constrained, and constants
    /// would not quite be in the kernel.
    pub fn reduce(&self, y: &mut [f64]) {
        let (yu, yp) = y.split_at_mut(self.velocity_dim());
        self.space.reduce(yu);
        self.reduce_pressures(yp);
    }

    /// The operator of the fluid alone in single precision.
    pub fn in_single_precision(&self, discretisation: &Discretisation<D>) -> CellOperator<f32, D> {
        cell_operator(discretisation, &self.space, &self.cells, None)
    }

    fn reduce_pressures<T: Scalar>(&self, q: &mut [T]) {
        self.pressure.reduce(q);
        self.pressure.remove_mean(q);
    }
}

/// The matrix of a [`StokesSystem`] with the workspace to apply it, to vectors in either precision.
///
/// What a cell does is always computed in double precision. A stress is a small difference of velocities: in single precision
/// a box of fluid at N = 256 takes 20 iterations in place of 17.
#[derive(Debug)]
pub struct SystemOperator<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'a StokesSystem<D>,
    wide: Work<f64>,
    narrow: Work<f32>,
    applications: usize,
}

/// What it takes to apply the operator to vectors of `X`.
#[derive(Debug)]
struct Work<X> {
    /// Pressures at all nodes.
    pressure: Vec<X>,
    cells: Workspace<f64, X>,
}

impl<'a, const D: usize> SystemOperator<'a, D>
where
    Dim<D>: Space<D>,
{
    /// The operator of `system`.
    pub fn new(system: &'a StokesSystem<D>) -> Self {
        Self { system, wide: Work::new(), narrow: Work::new(), applications: 0 }
    }

    /// How often it was applied.
    pub fn applications(&self) -> usize {
        self.applications
    }
}

impl<X: Scalar> Work<X> {
    fn new() -> Self {
        Self { pressure: Vec::new(), cells: Workspace::default() }
    }

    fn apply<const D: usize>(&mut self, system: &StokesSystem<D>, x: &[X], y: &mut [X])
    where
        Dim<D>: Space<D>,
    {
        let Self { pressure, cells } = self;
        let (u, p) = x.split_at(system.velocity_dim());
        let (yu, yp) = y.split_at_mut(system.velocity_dim());
        pressure.resize(p.len(), X::ZERO);
        vector::copy(p, pressure);
        system.pressure.expand(pressure);
        system.operator.stokes(u, pressure, yu, yp, cells);
        system.reduce_pressures(yp);
    }
}

impl<const D: usize> LinOp<f64> for SystemOperator<'_, D>
where
    Dim<D>: Space<D>,
{
    fn dim(&self) -> usize {
        self.system.dim()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        self.wide.apply(self.system, x, y);
    }
}

impl<const D: usize> LinOp<f32> for SystemOperator<'_, D>
where
    Dim<D>: Space<D>,
{
    fn dim(&self) -> usize {
        self.system.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.applications += 1;
        self.narrow.apply(self.system, x, y);
    }
}

/// The sum of the cells' pressure matrices on free pressure nodes; other rows hold a one.
pub fn pressure_mass<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    matrices: &PressureMatrices,
) -> Result<SparseMatrix, StokesError>
where
    Dim<D>: Space<D>,
{
    let m = ReferenceMatrices::<D>::PRESSURE;
    let expansion = crate::assembly::pressure_expansion(system);
    let unknowns = |c: &ActiveCell| {
        let nodes = discretisation.pressure.cell(c.cell as usize).iter();
        nodes.flat_map(|&q| expansion.of(q as usize)).map(|term| term.0 as usize).collect::<Vec<_>>()
    };
    let groups: Vec<Vec<usize>> = system.cells.iter().map(unknowns).collect();
    let mut mass = SparseMatrix::zeros(Arc::new(Pattern::from_groups(system.pressure.dim(), &groups)?));
    drop(groups);
    for (index, c) in system.cells.iter().enumerate() {
        let nodes = discretisation.pressure.cell(c.cell as usize);
        let (scale, matrix) = matrices.of(index);
        for (i, &row) in nodes.iter().enumerate() {
            for (j, &column) in nodes.iter().enumerate() {
                let value = scale * matrix[i * m + j];
                for &(r, wr) in expansion.of(row as usize) {
                    for &(c, wc) in expansion.of(column as usize) {
                        mass.add(r as usize, c as usize, wr * wc * value)?;
                    }
                }
            }
        }
    }
    for q in (0..system.pressure.dim()).filter(|&q| !system.pressure.is_free(q)) {
        mass.add(q, q, 1.0)?;
    }
    Ok(mass)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::solid_nodes;
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;

    /// Constant pressures do no work on any admissible velocity.
    fn constants_are_in_the_kernel<const D: usize>(weak: WeakPressures)
    where
        Dim<D>: Space<D>,
    {
        let balls = [0.3, 0.62].map(|x| Ball::new(Vector::<D>::repeat(x), 0.14));
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 5, |lower, h, level| {
            level < 3 || (0..D).all(|d| lower[d] < 0.75 && lower[d] + h > 0.125)
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        let solid = solid_nodes(&discretisation.mesh, &discretisation.velocity, &balls, 0.0);
        let space = VelocitySpace::new(discretisation.velocity.clone(), &balls, &solid);
        let system = StokesSystem::new(&discretisation, space, 1.5, weak, None);
        let mut x = vec![0.0f64; system.dim()];
        for q in (0..system.pressure.dim()).filter(|&q| system.pressure.is_free(q)) {
            x[system.velocity_dim() + q] = 1.0;
        }
        let mut y = vec![0.0; system.dim()];
        SystemOperator::new(&system).apply(&x, &mut y);
        let worst = (0..y.len()).max_by(|&i, &j| y[i].abs().total_cmp(&y[j].abs())).unwrap();
        assert!(y[worst].abs() < 1e-12, "{} at {worst} of {}", y[worst], system.velocity_dim());
    }

    #[test]
    fn constant_pressures_do_no_work() {
        for weak in [WeakPressures::Keep, WeakPressures::Aggregate] {
            constants_are_in_the_kernel::<2>(weak);
            constants_are_in_the_kernel::<3>(weak);
        }
    }
}
