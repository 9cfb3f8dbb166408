//! The discrete Stokes problem on one mesh.
//!
//! For `-div(2 eta eps(u)) + grad p = f`, `div u = 0` the matrix is `[A, -B^T; -B, 0]` in the reduced unknowns of
//! [`VelocitySpace`] and the pressure nodes. Cells that move as one body are left out: they have no strain. Pressure
//! nodes that see no cell with a free node are dropped.

use std::sync::Arc;

use gluey_fem::Reference;
use gluey_fem::kernel::{CellBatches, CellData, CubeKernel};
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
pub struct Penalty<T, const D: usize> {
    /// `1 - 1/r`.
    pub factor: f64,
    /// `K(I eta_s)`.
    pub stress: SolidStress<T, D>,
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
    pub penalty: Option<Penalty<f64, D>>,
    kernel: CubeKernel<f64, D>,
    batches: CellBatches<f64>,
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

/// Packs cells for the kernel.
pub fn batches<T: Scalar, const D: usize>(
    discretisation: &Discretisation<D>,
    cells: &[ActiveCell],
) -> CellBatches<T> {
    CellBatches::new(cells.iter().map(|c| CellData {
        velocity: discretisation.velocity.cell(c.cell as usize),
        pressure: discretisation.pressure.cell(c.cell as usize),
        viscous: c.viscous,
        divergence: c.divergence,
    }))
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
        penalty: Option<Penalty<f64, D>>,
    ) -> Self {
        let cells = active_cells(discretisation, &space, viscosity);
        Self {
            pressure: PressureSpace::new(discretisation, &space, &cells, weak),
            kernel: CubeKernel::default(),
            batches: batches(discretisation, &cells),
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

    /// `y -= B^T p` for nodal loads and pressures.
    pub fn subtract_gradient(&self, p: &[f64], y: &mut [f64]) {
        self.kernel.gradient(&self.batches, p, y);
    }

    /// `b -= [A, -B^T; -B, 0] (u, p)` for a nodal velocity field that already fulfils all constraints (it may carry
    /// boundary values), with the result in reduced form.
    pub fn residual(&self, u: &[f64], p: &[f64], b: &mut [f64]) {
        let (nodal, split) = (self.space.full_dim(), self.velocity_dim());
        let mut y = vec![0.0; self.dim()];
        let mut work = vec![0.0; split];
        let (yu, yp) = y.split_at_mut(split);
        self.kernel.stokes(&self.batches, &u[..nodal], p, &mut yu[..nodal], yp);
        self.add_penalty(&u[..nodal], &mut yu[..nodal], &mut work[..nodal]);
        self.reduce(&mut y);
        vector::axpy(-1.0, &y, b);
    }

    /// From nodal loads and unconstrained divergences to the reduced vector, in place. Divergences are made to sum to
    /// zero: where two bodies share cells without a free node the flow between them is not constrained, and constants
    /// would not quite be in the kernel.
    pub fn reduce(&self, y: &mut [f64]) {
        let (yu, yp) = y.split_at_mut(self.velocity_dim());
        self.space.reduce(yu);
        self.pressure.reduce(yp);
        self.pressure.remove_mean(yp);
    }

    fn add_penalty(&self, x: &[f64], y: &mut [f64], work: &mut [f64]) {
        if let Some(penalty) = &self.penalty {
            work.fill(0.0);
            penalty.stress.apply(self.space.nodes(), x, work);
            vector::axpy(penalty.factor, work, y);
        }
    }
}

/// The matrix of a [`StokesSystem`] with the workspace to apply it.
#[derive(Debug)]
pub struct SystemOperator<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'a StokesSystem<D>,
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    penalty: Vec<f64>,
    applications: usize,
}

impl<'a, const D: usize> SystemOperator<'a, D>
where
    Dim<D>: Space<D>,
{
    /// The operator of `system`.
    pub fn new(system: &'a StokesSystem<D>) -> Self {
        let penalty = if system.penalty.is_some() { system.space.full_dim() } else { 0 };
        Self {
            velocity: vec![0.0; system.velocity_dim()],
            pressure: vec![0.0; system.pressure.dim()],
            penalty: vec![0.0; penalty],
            applications: 0,
            system,
        }
    }

    /// How often it was applied.
    pub fn applications(&self) -> usize {
        self.applications
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
        let Self { system, velocity, pressure, penalty, .. } = self;
        let (nodal, split) = (system.space.full_dim(), system.velocity_dim());
        vector::copy(&x[..split], velocity);
        system.space.expand(velocity);
        vector::copy(&x[split..], pressure);
        system.pressure.expand(pressure);
        vector::clear(y);
        let (yu, yp) = y.split_at_mut(split);
        system.kernel.stokes(&system.batches, &velocity[..nodal], pressure, &mut yu[..nodal], yp);
        system.add_penalty(&velocity[..nodal], &mut yu[..nodal], penalty);
        system.reduce(y);
    }
}

/// The pressure mass matrix of the active cells over their viscosity, on free pressure nodes; other rows hold a one. Where
/// a solid is penalised, twice the Schur complements of the cells take the place of their mass matrices.
pub fn pressure_mass<const D: usize>(
    discretisation: &Discretisation<D>,
    system: &StokesSystem<D>,
    viscosity: f64,
) -> Result<SparseMatrix, StokesError>
where
    Dim<D>: Space<D>,
{
    let m = Reference::<D>::PRESSURE;
    let matrices = PressureMatrices::new(discretisation, system, viscosity)?;
    let expansion = crate::assembly::pressure_expansion(system);
    let unknowns = |c: &ActiveCell| {
        let nodes = discretisation.pressure.cell(c.cell as usize).iter();
        nodes.flat_map(|&q| expansion.of(q as usize)).map(|term| term.0 as usize).collect::<Vec<_>>()
    };
    let groups: Vec<Vec<usize>> = system.cells.iter().map(unknowns).collect();
    let mut mass = SparseMatrix::zeros(Arc::new(Pattern::from_groups(system.pressure.dim(), &groups)?));
    drop(groups);
    for c in &system.cells {
        let nodes = discretisation.pressure.cell(c.cell as usize);
        let (scale, matrix) = matrices.of(c);
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
        let mut x = vec![0.0; system.dim()];
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
