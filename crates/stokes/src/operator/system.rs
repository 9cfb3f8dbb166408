//! The discrete Stokes problem on one mesh.
//!
//! For `-div(2 eta eps(u)) + grad p = f`, `div u = 0` the matrix is `[A, -B^T; -B, 0]` in the reduced
//! unknowns of [`VelocitySpace`] and the pressure nodes. Cells that move as one body are left out: they have
//! no strain. Pressure nodes that see no cell with a free node are dropped.

use std::sync::Arc;

use gluey_fem::Evaluator;
use gluey_fem::cells::{CellOperator, Workspace};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::Ball;
use gluey_linalg::{DirectError, LinOp, Scalar, vector};

use super::cells::{AddedViscosity, cell_operator};
use crate::film::{Film, FilmCorrection, FilmCoupling, FilmNetwork, FilmRow, Heights};
use crate::space::{
    ActiveCell, Discretisation, PressureSpace, VelocitySpace, active_cells, all_cells, own_cells,
};
use crate::surface::{CellState, SurfaceCoupling, SurfaceWorkspace, flows_through_films};

/// Operator of the Stokes problem on a mesh, matrix-free.
#[derive(Clone, Debug)]
pub struct StokesSystem<const D: usize> {
    /// Reduced velocities, which know mesh and nodes.
    pub space: VelocitySpace<D>,
    /// Reduced pressures.
    pub pressure: PressureSpace<D>,
    /// Cells that are not rigid, with the scales of their matrices.
    pub(crate) cells: Vec<ActiveCell>,
    /// What comes to the viscosity of the fluid in these cells.
    pub(crate) added: Option<Arc<dyn AddedViscosity<D>>>,
    /// The cells that surfaces cut, where the mesh does not fit the bodies.
    pub(crate) surfaces: Option<Arc<SurfaceCoupling<D>>>,
    /// The films between bodies that are too thin for the mesh.
    pub(crate) films: Option<Arc<FilmCoupling<D>>>,
    viscosity: f64,
    operator: CellOperator<f64, D>,
}

impl<const D: usize> StokesSystem<D>
where
    Dim<D>: Space<D>,
{
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
        Self { pressure, operator, space, cells, added, surfaces: None, films: None, viscosity }
    }

    /// The system in `fluid` cells that nothing cuts and in those that `surfaces` cut.
    pub(crate) fn around_surfaces(
        space: VelocitySpace<D>,
        pressure: PressureSpace<D>,
        viscosity: f64,
        surfaces: SurfaceCoupling<D>,
    ) -> Self {
        let is_fluid = |cell: &ActiveCell| surfaces.cut.states[cell.cell as usize] == CellState::Fluid;
        let mut cells = all_cells(space.discretisation(), viscosity);
        cells.retain(is_fluid);
        Self {
            pressure,
            operator: cell_operator(&space, &own_cells(space.discretisation(), &cells), None),
            space,
            cells,
            added: None,
            surfaces: Some(Arc::new(surfaces)),
            films: None,
            viscosity,
        }
    }

    /// The same with the forces of `films` between these bodies that are widened to these heights.
    pub(crate) fn with_films(self, bodies: &[Ball<D>], films: Vec<Film<D>>, heights: &Heights) -> Self {
        let cut = self.surfaces.as_ref().map(|surfaces| &surfaces.cut);
        let flows = cut.map_or_else(
            || vec![Vec::new(); films.len()],
            |cut| flows_through_films((&self.space, &self.pressure), cut, (bodies, &films, heights)),
        );
        let films = FilmCoupling::new(&self.space, films, flows, heights, self.viscosity);
        Self { films: Some(Arc::new(films)), ..self }
    }

    /// Mesh and nodes.
    pub fn discretisation(&self) -> &Discretisation<D> {
        self.space.discretisation()
    }

    /// Viscosity of the fluid.
    pub fn viscosity(&self) -> f64 {
        self.viscosity
    }

    /// Length of a vector: reduced velocities, then all pressure nodes, then the forces of films.
    pub fn dim(&self) -> usize {
        self.velocity_dim() + self.pressure.dim() + self.film_dim()
    }

    /// Norm of the fluid's part of a right-hand side, loads on bodies included: what residuals are small
    /// beside. Rows of films are left out, whose scale grows as they close.
    pub fn fluid_norm(&self, b: &[f64]) -> f64 {
        vector::norm(&b[..b.len() - self.film_dim()])
    }

    /// The own surfaces' block for the twist of each body, row by row.
    pub fn twist_blocks(&self) -> Vec<f64> {
        let rigid = Dim::<D>::RIGID;
        let mut blocks = vec![0.0; self.space.body_count() * rigid * rigid];
        if let Some(surfaces) = &self.surfaces {
            let own =
                surfaces.pieces().enumerate().filter(|(_, (cell, _))| self.discretisation().is_own(*cell));
            for (piece, (_, body)) in own {
                surfaces.add_twist_block(piece, &mut blocks[body * rigid * rigid..][..rigid * rigid]);
            }
        }
        blocks
    }

    /// The rows of the films' motions, on the twists of the bodies.
    pub fn rows_of_motion(&self) -> Vec<FilmRow> {
        self.films.as_ref().map_or_else(Vec::new, |films| films.rows_of_motion(self.space.full_dim()))
    }

    /// The network of its films; `None` without films.
    ///
    /// # Errors
    /// Those of [`FilmNetwork::new`].
    pub fn film_network(&self) -> Result<Option<FilmNetwork>, DirectError> {
        let rows = self.rows_of_motion();
        let blocks = if rows.is_empty() { Vec::new() } else { self.twist_blocks() };
        FilmNetwork::new::<D>(&blocks, self.space.held(), &rows, rows.clone())
    }

    /// Length of the films' part of a vector.
    pub fn film_dim(&self) -> usize {
        self.films.as_ref().map_or(0, |films| films.dim())
    }

    /// The parts of a vector: velocities, pressures, forces of films.
    pub fn parts<'x, T>(&self, x: &'x [T]) -> [&'x [T]; 3] {
        let (u, rest) = x.split_at(self.velocity_dim());
        let (p, f) = rest.split_at(self.pressure.dim());
        [u, p, f]
    }

    /// The parts of a vector: velocities, pressures, forces of films.
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
    /// carry boundary values), with the result in reduced form. Pressures may be followed by forces of films,
    /// which are zero if not.
    pub fn residual(&self, u: &[f64], p: &[f64], b: &mut [f64]) {
        let mut y = vec![0.0; self.dim()];
        let [yu, yp, yf] = self.parts_mut(&mut y);
        let (p, f) = p.split_at(self.pressure.dim());
        self.operator.stokes_of_field(u, p, yu, yp, &mut Workspace::default());
        if let Some(surfaces) = &self.surfaces {
            surfaces.add([u, p], [&mut *yu, &mut *yp], &mut SurfaceWorkspace::default());
        }
        if let Some(films) = &self.films {
            let at_rest = vec![0.0; films.dim()];
            let f = if f.is_empty() { &at_rest } else { f };
            films.add([u, f], [&mut *yu, &mut *yf]);
            let at_wall = |film: &Film<D>| film.partner.is_wall().then(|| self.wall_velocity(film, u));
            films.subtract_partners(at_wall, yf);
            films.add_boundary(u, yf);
        }
        self.reduce_pressures(yp);
        vector::axpy(-1.0, &y, b);
    }

    /// The velocity of the wall at a film.
    fn wall_velocity(&self, film: &Film<D>, u: &[f64]) -> Vector<D> {
        let mesh = &self.discretisation().mesh;
        Evaluator::new(mesh).motion_at(self.space.nodes(), u, &film.far_point()).velocity
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

    /// In a part the mean is one over all parts, and not known here.
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
pub struct SystemOperator<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'a StokesSystem<D>,
    wide: Work<f64>,
    narrow: Work<f32>,
    applications: usize,
    /// What makes the films' rows of iterates hold.
    films: Option<FilmCorrection<'a>>,
}

/// Workspace of the operator for vectors of `X`.
#[derive(Debug)]
struct Work<X> {
    /// Pressures at all nodes.
    pressure: Vec<X>,
    cells: Workspace<f64, X>,
    surfaces: SurfaceWorkspace<f64>,
}

impl<'a, const D: usize> SystemOperator<'a, D>
where
    Dim<D>: Space<D>,
{
    /// The operator of `system`.
    pub fn new(system: &'a StokesSystem<D>) -> Self {
        Self { system, wide: Work::new(), narrow: Work::new(), applications: 0, films: None }
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

impl<X: Scalar> Work<X> {
    fn new() -> Self {
        Self { pressure: Vec::new(), cells: Workspace::default(), surfaces: SurfaceWorkspace::default() }
    }

    fn apply<const D: usize>(&mut self, system: &StokesSystem<D>, x: &[X], y: &mut [X])
    where
        Dim<D>: Space<D>,
    {
        let Self { pressure, cells, surfaces: work } = self;
        let [u, p, f] = system.parts(x);
        let [yu, yp, yf] = system.parts_mut(y);
        pressure.resize(p.len(), X::ZERO);
        vector::copy(p, pressure);
        system.pressure.expand(pressure);
        system.operator.stokes(u, pressure, yu, yp, cells);
        if let Some(surfaces) = &system.surfaces {
            surfaces.add([u, pressure], [&mut *yu, &mut *yp], work);
        }
        if let Some(films) = &system.films {
            yf.fill(X::ZERO);
            films.add([u, f], [&mut *yu, &mut *yf]);
        }
        system.space.clear_held(yu);
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

    fn settle(&mut self, b: &[f64], x: &mut [f64]) {
        if let Some(films) = &mut self.films {
            let [_, _, bf] = self.system.parts(b);
            let [u, _, g] = self.system.parts_mut(x);
            films.apply(bf, &mut u[self.system.space.full_dim()..], g, |_| ());
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::solid_nodes;
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};

    /// Constant pressures do no work on any admissible velocity.
    fn constants_are_in_the_kernel<const D: usize>()
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
