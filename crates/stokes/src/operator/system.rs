//! The discrete Stokes problem on one mesh.
//!
//! For `-div(2 eta eps(u)) + grad p = f`, `div u = 0` the matrix is `[A, -B^T; -B, 0]` in the reduced
//! unknowns of [`VelocitySpace`] and the pressure nodes. Cells that move as one body are left out: they have
//! no strain. Pressure nodes that see no cell with a free node are dropped.

use std::any::Any;
use std::sync::Arc;

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_geom::Dim;
use gluey_linalg::{DirectError, LinOp, Scalar, vector};
use gluey_parallel::{Communicator, Halo, Number};

use super::cells::{AddedViscosity, cell_operator};
use super::halos::SystemHalos;
use crate::film::{FilmCorrection, FilmCoupling, FilmNetwork, FilmRow, SharedTwists};
use crate::space::{
    ActiveCell, Discretisation, PressureSpace, VelocitySpace, active_cells, all_cells, own_cells,
};
use crate::surface::SurfaceCoupling;
use crate::term::{Product, Scratch, Term, Terms, add_terms};

/// Resistance of a body, which takes the fluid along, over the surfaces' own block of its twist, which is
/// that of fluid at rest: by the iterations of crowds, see `docs/design/preconditioner.md`.
const OF_MOVING_FLUID: f64 = 0.2;

/// Operator of the Stokes problem on a mesh, matrix-free.
#[derive(Clone, Debug)]
pub struct StokesSystem<const D: usize> {
    /// Reduced velocities, which know mesh and nodes.
    pub space: VelocitySpace<D>,
    /// Reduced pressures.
    pub pressure: PressureSpace<D>,
    /// Cells that are not rigid and that no term covers, with the scales of their matrices.
    pub(crate) cells: Vec<ActiveCell>,
    /// What comes to the viscosity of the fluid in these cells.
    pub(crate) added: Option<Arc<dyn AddedViscosity<D>>>,
    /// What there is beside these cells.
    pub(crate) terms: Terms<D>,
    viscosity: f64,
    operator: CellOperator<f64, D>,
    /// Of vectors, where ranks share them.
    halos: SystemHalos,
}

impl<const D: usize> StokesSystem<D> {
    /// The system with fluid viscosity `viscosity` on the velocities of `space`.
    pub fn new(space: VelocitySpace<D>, viscosity: f64) -> Self {
        Self::with_viscosity(space, viscosity, None)
    }

    /// The same with what comes to the viscosity of the fluid.
    pub(crate) fn with_viscosity(
        space: VelocitySpace<D>,
        viscosity: f64,
        added: Option<Arc<dyn AddedViscosity<D>>>,
    ) -> Self {
        let cells = active_cells(&space, viscosity);
        let (pressure, operator) = rayon::join(
            || PressureSpace::new(&space, &cells),
            || cell_operator(&space, &cells, added.as_deref()),
        );
        let halos = Default::default();
        Self { pressure, operator, space, cells, added, terms: Vec::new(), viscosity, halos }
    }

    /// The system of a term and of the cells that it does not cover.
    pub(crate) fn beside(
        term: Arc<dyn Term<D>>,
        space: VelocitySpace<D>,
        pressure: PressureSpace<D>,
        viscosity: f64,
    ) -> Self {
        let mut cells = all_cells(space.discretisation(), viscosity);
        cells.retain(|cell| !term.covers(cell.cell as usize));
        let operator = cell_operator(&space, &own_cells(space.discretisation(), &cells), None);
        let halos = Default::default();
        Self { pressure, operator, space, cells, added: None, terms: vec![term], viscosity, halos }
    }

    /// The term of a type, for those who know it as more than a term.
    fn term<T: Term<D>>(&self) -> Option<&T> {
        self.terms.iter().find_map(|term| (&**term as &dyn Any).downcast_ref())
    }

    /// The cells that surfaces cut, where the mesh does not fit the bodies.
    pub(crate) fn surfaces(&self) -> Option<&SurfaceCoupling<D>> {
        self.term()
    }

    /// The films between bodies that are too thin for the mesh.
    pub(crate) fn films(&self) -> Option<&FilmCoupling<D>> {
        self.term()
    }

    /// Makes the system of the part of a mesh that of all ranks; nothing where the mesh is whole. Vectors are
    /// zero at ghosts. All ranks call this.
    pub fn share(&mut self) {
        let Some(partition) = self.discretisation().partition() else { return };
        let (halos, pressures) = SystemHalos::new(&self.space, &self.pressure, &self.terms, partition);
        self.halos = halos;
        self.pressure.share(pressures);
    }

    /// The halo of vectors: nothing on one rank.
    pub fn halo(&self) -> &Halo {
        &self.halos.all
    }

    /// The halos of vectors.
    pub fn halos(&self) -> &SystemHalos {
        &self.halos
    }

    /// Makes a solution, whose pressures lose their mean, right at all cells around own ones that are cut;
    /// nothing on one rank. All ranks call this.
    pub fn update(&self, x: &mut [f64]) {
        if !self.discretisation().is_part() {
            return;
        }
        self.pressure.remove_mean(self.parts_mut(x)[1]);
        self.halos.all.clone().update(x);
        self.halos.around.clone().update(x);
    }

    /// From sums over own cells to a right-hand side, of all ranks; nothing on one rank.
    pub fn complete(&self, b: &mut [f64]) {
        if !self.discretisation().is_part() {
            return;
        }
        self.halo().clone().accumulate(b);
        let [_, p, _] = self.parts_mut(b);
        self.pressure.remove_mean(p);
    }

    /// Mesh and nodes.
    pub fn discretisation(&self) -> &Discretisation<D> {
        self.space.discretisation()
    }

    /// Viscosity of the fluid.
    pub fn viscosity(&self) -> f64 {
        self.viscosity
    }

    /// Length of a vector: reduced velocities, then all pressure nodes, then the forces of terms.
    pub fn dim(&self) -> usize {
        self.velocity_dim() + self.pressure.dim() + self.row_count()
    }

    /// Norm of the fluid's part of a right-hand side, loads on bodies included: what residuals are small
    /// beside. Rows of terms are left out: the scale of films grows as they close.
    pub fn fluid_norm(&self, b: &[f64]) -> f64 {
        let fluid = &b[..b.len() - self.row_count()];
        let mut square = [vector::dot(fluid, fluid)];
        self.halo().sum_over_ranks(&mut square);
        square[0].sqrt()
    }

    /// The own pieces' block for the twist of each body, row by row.
    pub fn twist_blocks(&self) -> Vec<f64> {
        let mut blocks = vec![0.0; self.space.body_count() * Dim::<D>::RIGID.pow(2)];
        self.terms.iter().for_each(|term| term.add_twist_blocks(&mut blocks));
        blocks
    }

    /// The network of the films of all ranks, of which each has it whole, and the forces of its own films;
    /// `None` without films. All ranks call this.
    ///
    /// # Errors
    /// If the block of a body is not positive definite, on all ranks.
    pub fn film_network(&self) -> Result<Option<FilmNetwork>, DirectError> {
        let own = self.films().map_or_else(Vec::new, |films| films.rows_of_motion(self.space.full_dim()));
        let Some(partition) = self.discretisation().partition() else {
            let blocks = if own.is_empty() { Vec::new() } else { resistances(self.twist_blocks()) };
            return FilmNetwork::new::<D>(&blocks, self.space.held(), &own, own.clone());
        };
        let (ranks, bodies) = (&partition.ranks, partition.bodies.ids.clone());
        let own: Vec<_> = own.into_iter().map(|row| row.renumbered(|body| bodies[body as usize])).collect();
        let numbers: Vec<_> = own.iter().copied().map(FilmRow::to_numbers).collect();
        let all: Vec<_> = ranks.gathered(&numbers).iter().map(FilmRow::from_numbers).collect();
        let blocks = partition.sums_of_bodies(&self.twist_blocks(), Dim::<D>::RIGID.pow(2));
        let blocks = resistances(blocks);
        let is_own = partition.bodies.owners.iter().map(|&owner| owner == ranks.rank()).collect();
        let twists = SharedTwists { halo: self.halo().clone(), bodies, is_own };
        let network = FilmNetwork::new::<D>(&blocks, self.space.held_of_all(), &all, own)?;
        Ok(network.map(|network| network.with_shared(twists)))
    }

    /// Length of the terms' part of a vector.
    pub fn row_count(&self) -> usize {
        self.terms.iter().map(|term| term.row_count()).sum()
    }

    /// Entries of the terms' rows in reduced velocities; that of the force of a row is -1.
    pub fn rows(&self) -> impl Iterator<Item = &[(u32, f64)]> {
        self.terms.iter().flat_map(|term| (0..term.row_count()).map(|row| term.row(row)))
    }

    /// The inverses of about the Schur complement of the terms' forces.
    pub fn row_inverses(&self) -> impl Iterator<Item = &f64> {
        self.terms.iter().flat_map(|term| term.row_inverses())
    }

    /// Calls `visit` with each term and its part of `rows`.
    pub(crate) fn for_each_term(
        &self,
        mut rows: &mut [f64],
        mut visit: impl FnMut(&dyn Term<D>, &mut [f64]),
    ) {
        for term in &self.terms {
            let own;
            (own, rows) = rows.split_at_mut(term.row_count());
            visit(term.as_ref(), own);
        }
    }

    /// The parts of a vector: velocities, pressures, forces of terms.
    pub fn parts<'x, T>(&self, x: &'x [T]) -> [&'x [T]; 3] {
        let (u, rest) = x.split_at(self.velocity_dim());
        let (p, f) = rest.split_at(self.pressure.dim());
        [u, p, f]
    }

    /// The parts of a vector: velocities, pressures, forces of terms.
    pub fn parts_mut<'x, T>(&self, x: &'x mut [T]) -> [&'x mut [T]; 3] {
        let (u, rest) = x.split_at_mut(self.velocity_dim());
        let (p, f) = rest.split_at_mut(self.pressure.dim());
        [u, p, f]
    }

    /// Length of the velocity part of a vector.
    pub fn velocity_dim(&self) -> usize {
        self.space.dim()
    }

    /// `b -= [A, -B^T; -B, 0] (u, p)` for a nodal velocity field that already fulfils all constraints (it may
    /// carry boundary values), with the result in reduced form. Pressures may be followed by forces of terms,
    /// which are zero if not.
    pub fn residual(&self, u: &[f64], p: &[f64], b: &mut [f64]) {
        let mut y = vec![0.0; self.dim()];
        let [yu, yp, yf] = self.parts_mut(&mut y);
        let (p, f) = p.split_at(self.pressure.dim());
        self.operator.stokes_of_field(u, p, yu, yp, &mut Workspace::default());
        let none = vec![0.0; yf.len()];
        let f = if f.is_empty() { &none } else { f };
        add_terms::<f64, f64, D>(&self.terms, [u, p, f], [yu, &mut *yp, &mut *yf], &mut Scratch::default());
        self.for_each_term(yf, |term, rows| term.add_data(&self.space, u, rows));
        self.reduce_pressures(yp);
        vector::axpy(-1.0, &y, b);
    }

    /// From nodal loads and unconstrained divergences to the reduced vector, in place. Divergences are made
    /// to sum to zero: where two bodies share cells without a free node the flow between them is not
    /// constrained, and constants would not quite be in the kernel.
    pub fn reduce(&self, y: &mut [f64]) {
        let [yu, yp, _] = self.parts_mut(y);
        self.space.reduce(yu);
        self.reduce_pressures(yp);
    }

    /// The operator of the fluid alone in single precision.
    pub fn in_single_precision(&self) -> CellOperator<f32, D> {
        cell_operator(&self.space, &own_cells(self.discretisation(), &self.cells), None)
    }

    /// In a part the mean is one over all parts, see [`StokesSystem::complete`].
    fn reduce_pressures<T: Scalar>(&self, q: &mut [T]) {
        self.pressure.reduce(q);
        if !self.discretisation().is_part() {
            self.pressure.remove_mean(q);
        }
    }
}

/// The matrix of a [`StokesSystem`] with the workspace to apply it, to vectors in either precision.
///
/// Stresses of cells are always computed in double precision: they are small differences of velocities, and
/// their rounding errors cost iterations (`docs/archive/experiments/0010-krylov-vectors.md`).
#[derive(Debug)]
pub struct SystemOperator<'a, const D: usize> {
    system: &'a StokesSystem<D>,
    halo: Halo,
    wide: OperatorWork<f64>,
    narrow: OperatorWork<f32>,
    applications: usize,
    /// What makes the films' rows of iterates hold.
    films: Option<FilmCorrection<'a>>,
}

/// Workspace of the operator for vectors of `X`.
#[derive(Debug)]
struct OperatorWork<X> {
    /// The vector with its ghosts.
    x: Vec<X>,
    /// Pressures at all nodes.
    pressure: Vec<X>,
    cells: Workspace<f64, X>,
    scratch: Scratch<f64>,
}

/// Bound on the rounding error of `b - row u + g`: of a sum of `n` terms, `n u` times that of their
/// magnitudes with `u` the unit of rounding (Higham 2002, Accuracy and stability of numerical algorithms,
/// section 4.2).
fn rounding_of_row(row: &[(u32, f64)], u: &[f64], g: f64, b: f64) -> f64 {
    let terms: f64 = row.iter().map(|&(k, weight)| (weight * u[k as usize]).abs()).sum();
    0.5 * f64::EPSILON * (row.len() + 2) as f64 * (terms + g.abs() + b.abs())
}

/// About the resistances of bodies whose surfaces have these blocks for their twists.
fn resistances(mut blocks: Vec<f64>) -> Vec<f64> {
    blocks.iter_mut().for_each(|entry| *entry *= OF_MOVING_FLUID);
    blocks
}

impl<'a, const D: usize> SystemOperator<'a, D> {
    /// The operator of `system`.
    pub fn new(system: &'a StokesSystem<D>) -> Self {
        Self {
            halo: system.halo().clone(),
            system,
            wide: OperatorWork::new(),
            narrow: OperatorWork::new(),
            applications: 0,
            films: None,
        }
    }

    /// The same whose iterates fulfil the rows of a network of films.
    #[must_use]
    pub fn with_films(self, films: Option<FilmCorrection<'a>>) -> Self {
        Self { films, ..self }
    }

    /// How often it was applied.
    pub fn applications(&self) -> usize {
        self.applications
    }
}

impl<X: Scalar + Number> OperatorWork<X> {
    fn new() -> Self {
        Self { x: Vec::new(), pressure: Vec::new(), cells: Workspace::default(), scratch: Scratch::default() }
    }

    fn apply<const D: usize>(&mut self, system: &StokesSystem<D>, halo: &mut Halo, x: &[X], y: &mut [X])
    where
        dyn Term<D>: Product<X, f64>,
    {
        let Self { x: with_ghosts, pressure, cells, scratch } = self;
        let x = if halo.is_empty() {
            x
        } else {
            with_ghosts.resize(x.len(), X::ZERO);
            with_ghosts.copy_from_slice(x);
            halo.update(with_ghosts);
            with_ghosts
        };
        let [u, p, f] = system.parts(x);
        let [yu, yp, yf] = system.parts_mut(y);
        pressure.resize(p.len(), X::ZERO);
        vector::copy(p, pressure);
        system.pressure.expand(pressure);
        system.operator.stokes(u, pressure, yu, yp, cells);
        yf.fill(X::ZERO);
        add_terms(&system.terms, [u, pressure, f], [&mut *yu, &mut *yp, yf], scratch);
        system.space.clear_held(yu);
        system.pressure.reduce(yp);
        halo.accumulate(y);
        let [_, yp, _] = system.parts_mut(y);
        system.pressure.remove_mean(yp);
    }
}

impl<const D: usize> LinOp<f64> for SystemOperator<'_, D> {
    fn dim(&self) -> usize {
        self.system.dim()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.applications += 1;
        self.wide.apply(self.system, &mut self.halo, x, y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.halo.sum_over_ranks(sums);
    }

    fn settle(&mut self, b: &[f64], x: &mut [f64]) {
        if let Some(films) = &mut self.films {
            let [_, _, bf] = self.system.parts(b);
            let [u, _, g] = self.system.parts_mut(x);
            films.apply(bf, &mut u[self.system.space.full_dim()..], g);
        }
    }

    /// The rows of films. Where a film is closed its scale is 1e11: rounding of the velocities of order one
    /// leaves more in its row than a solve to 1e-8 has left elsewhere.
    fn clear_rounding(&mut self, b: &[f64], x: &[f64], r: &mut [f64]) -> bool {
        let system = self.system;
        let x = if self.halo.is_empty() { x } else { &self.wide.x };
        let ([u, _, g], [_, _, b], [_, _, r]) = (system.parts(x), system.parts(b), system.parts_mut(r));
        let mut is_cleared = false;
        for (((row, g), b), r) in system.rows().zip(g).zip(b).zip(r) {
            if *r != 0.0 && r.abs() <= rounding_of_row(row, u, *g, *b) {
                (*r, is_cleared) = (0.0, true);
            }
        }
        is_cleared
    }
}

impl<const D: usize> LinOp<f32> for SystemOperator<'_, D> {
    fn dim(&self) -> usize {
        self.system.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.applications += 1;
        self.narrow.apply(self.system, &mut self.halo, x, y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.halo.sum_over_ranks(sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::solid_nodes;
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;

    /// Constant pressures do no work on any admissible velocity.
    fn constants_are_in_the_kernel<const D: usize>() {
        let balls = [0.3, 0.62].map(|x| Ball::new(Vector::<D>::repeat(x), 0.14));
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 5, |lower, h, level| {
            level < 3 || (0..D).all(|d| lower[d] < 0.75 && lower[d] + h > 0.125)
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        let solid = solid_nodes(&discretisation, &balls, 0.0);
        let space = VelocitySpace::new(&discretisation, &balls, &solid);
        let system = StokesSystem::new(space, 1.5);
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
        constants_are_in_the_kernel::<2>();
        constants_are_in_the_kernel::<3>();
    }
}
