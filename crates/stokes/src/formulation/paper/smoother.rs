//! The smoother of the finest mesh where the solid is penalised.
//!
//! One sweep of Chebyshev's method on the whole operator, after all corrections: in the fluid by its
//! diagonal, in the solid by [`SchwarzPatches`] on its
//! cells. In single precision: what it is given are residuals, and what it
//! adds holds no rigid motion of a body, whose rounding the solid's viscosity would multiply.
//!
//! Where the cells of two bodies meet, coarser meshes have fluid between them and are softer, and the forces
//! there are rough: so a sweep on the nodes of such a *film* and of the cells around it goes before the
//! corrections ([`FilmSmoother`]).

use gluey_linalg::{
    Chebyshev, ChebyshevParams, Guess, LinOp, Preconditioner, SchwarzPatches, SymmetricBlockMatrix, vector,
};

use crate::error::StokesError;
use crate::operator::{
    CountedOperator, Elements, Restricted, StokesSystem, acting, add_at, gather, nodal_diagonal,
};
use crate::precondition::assembly::assemble_on_nodes;
use crate::precondition::numbered::NumberedNodes;
use crate::space::{Discretisation, nodes_of_cells_with};

/// A sweep with diagonal and patches as preconditioner.
const SWEEP: ChebyshevParams = ChebyshevParams { degree: 4, ratio: 5.0, safety: 1.1, lanczos_steps: 8 };

/// The smoother of all nodes around the finest cells.
pub struct PenalisedSmoother<const D: usize> {
    sweep: SolidSweep<CountedOperator<f32, D>, D>,
}

impl<const D: usize> PenalisedSmoother<D> {
    /// The smoother on the nodes in `smoothed`, among them those of `solid`, which are all that the solid
    /// touches and on which the operator is `matrix`.
    pub fn new(
        system: &StokesSystem<D>,
        smoothed: &[bool],
        solid: &NumberedNodes<'_, D>,
        matrix: &SymmetricBlockMatrix<D>,
    ) -> Result<Self, StokesError> {
        let discretisation = system.discretisation();
        let acting = acting(discretisation, &system.cells, smoothed);
        let fluid = nodal_diagonal(&system.space, &acting, smoothed);
        let diagonal = fluid.map_err(StokesError::AroundSolid)?;
        let operator = CountedOperator::within(system, &acting);
        let preconditioner = DiagonalAndPatches::new(diagonal, solid, solid.positions(), matrix)?;
        let mut sweep = SolidSweep::new(operator, preconditioner)?;
        sweep.operator.take_applications();
        Ok(Self { sweep })
    }

    /// `z += G r`.
    pub fn add_to(&mut self, r: &[f64], z: &mut [f64]) {
        let norm = vector::norm(r);
        if norm == 0.0 {
            return;
        }
        vector::convert(1.0 / norm, r, &mut self.sweep.b);
        self.sweep.run();
        vector::axpy(norm, &self.sweep.x, z);
    }

    /// Applications since the last call, each as its share of the mesh. Products with patches do not count.
    pub fn take_applications(&mut self) -> f64 {
        self.sweep.operator.take_applications()
    }
}

/// The smoother of the nodes around the films between bodies.
pub struct FilmSmoother<const D: usize> {
    sweep: SolidSweep<Restricted<f32, D>, D>,
    /// `A` on velocities of the sweep.
    operator: CountedOperator<f64, D>,
    /// Loads and velocities of the sweep.
    r: Vec<f64>,
    x: Vec<f64>,
}

impl<const D: usize> FilmSmoother<D> {
    /// The smoother on the nodes in `film`; those in `touched` the solid touches.
    pub fn new(elements: &Elements<'_, D>, film: &[bool], touched: &[bool]) -> Result<Self, StokesError> {
        let system = elements.system();
        let discretisation = system.discretisation();
        let space = &system.space;
        let is_free = |node: usize| film[node] && space.is_free(node);
        let positions = NumberedNodes::new(discretisation, is_free).positions();
        let solid = NumberedNodes::new(discretisation, |node| is_free(node) && touched[node]);
        let matrix = assemble_on_nodes(&solid, elements)?;
        let acting = acting(discretisation, &system.cells, film);
        let fluid = nodal_diagonal(space, &acting, film).map_err(StokesError::AroundSolid)?;
        let mut diagonal = vec![0.0; positions.len()];
        gather(&positions, &fluid, &mut diagonal);
        let place = |k: &u32| positions.binary_search(k).expect("the film has its solid") as u32;
        let places = solid.positions().iter().map(place).collect();
        let preconditioner = DiagonalAndPatches::new(diagonal, &solid, places, &matrix)?;
        let [r, x] = [(); 2].map(|()| vec![0.0; positions.len()]);
        let operator = CountedOperator::within(system, &acting);
        let restricted = Restricted::new(CountedOperator::within(system, &acting), positions);
        let mut sweep = SolidSweep::new(restricted, preconditioner)?;
        sweep.operator.take_applications();
        Ok(Self { sweep, operator, r, x })
    }

    /// `z += G r`.
    pub fn add_to(&mut self, r: &[f64], z: &mut [f64]) {
        let Self { sweep, r: load, x, .. } = self;
        gather(sweep.operator.positions(), r, load);
        let norm = vector::norm(load);
        if norm == 0.0 {
            return;
        }
        vector::convert(1.0 / norm, load, &mut sweep.b);
        sweep.run();
        vector::convert(norm, &sweep.x, x);
        add_at(sweep.operator.positions(), x, z);
    }

    /// The loads `A x` of velocities that are zero but on the nodes of the sweep.
    pub fn loads(&mut self, x: &[f64], loads: &mut [f64]) {
        self.operator.apply(x, loads);
    }

    /// Applications since the last call, each as its share of the mesh. Products with patches do not count.
    pub fn take_applications(&mut self) -> f64 {
        self.sweep.operator.take_applications() + self.operator.take_applications()
    }
}

/// The nodes of all cells next to those with nodes that two bodies touch; `None` without such cells.
pub fn around_films<const D: usize>(
    discretisation: &Discretisation<D>,
    touched: &[Option<u32>],
) -> Option<Vec<bool>> {
    let nodes = &discretisation.velocity;
    let mut film = vec![false; nodes.node_count()];
    for cell in (0..nodes.cell_count()).map(|cell| nodes.cell(cell)) {
        let mut bodies = cell.iter().filter_map(|&n| touched[n as usize]);
        let first = bodies.next();
        if bodies.any(|body| Some(body) != first) {
            cell.iter().for_each(|&n| film[n as usize] = true);
        }
    }
    film.contains(&true).then(|| nodes_of_cells_with(nodes, &film))
}

/// Chebyshev's method from zero: the operator, its preconditioner, load and velocity.
struct SolidSweep<A, const D: usize> {
    operator: A,
    preconditioner: DiagonalAndPatches<D>,
    chebyshev: Chebyshev<f32>,
    b: Vec<f32>,
    x: Vec<f32>,
}

impl<A: LinOp<f32>, const D: usize> SolidSweep<A, D> {
    fn new(mut operator: A, mut preconditioner: DiagonalAndPatches<D>) -> Result<Self, StokesError> {
        let chebyshev = Chebyshev::for_operator(&mut operator, &mut preconditioner, &SWEEP)?;
        let dim = operator.dim();
        Ok(Self { operator, preconditioner, chebyshev, b: vec![0.0; dim], x: vec![0.0; dim] })
    }

    fn run(&mut self) {
        let Self { operator, preconditioner, chebyshev, b, x } = self;
        chebyshev.smooth(operator, preconditioner, b, x, Guess::Zero);
    }
}

/// The inverse diagonal in the fluid and the patches in the solid.
struct DiagonalAndPatches<const D: usize> {
    /// Inverse diagonal in the fluid, zero elsewhere.
    diagonal: Vec<f32>,
    patches: SchwarzPatches<f32, D>,
    /// The unknowns of the patches among those of the sweep.
    positions: Vec<u32>,
    /// Residual and correction at these.
    r: Vec<f32>,
    z: Vec<f32>,
}

impl<const D: usize> DiagonalAndPatches<D> {
    fn new(
        mut diagonal: Vec<f32>,
        solid: &NumberedNodes<'_, D>,
        positions: Vec<u32>,
        matrix: &SymmetricBlockMatrix<D>,
    ) -> Result<Self, StokesError> {
        let patches = SchwarzPatches::new(matrix, solid.cells(), vec![0.0; positions.len()]);
        positions.iter().for_each(|&k| diagonal[k as usize] = 0.0);
        let [r, z] = [(); 2].map(|()| vec![0.0; positions.len()]);
        Ok(Self { diagonal, patches: patches.map_err(StokesError::SolidPatch)?, positions, r, z })
    }
}

impl<const D: usize> Preconditioner<f32> for DiagonalAndPatches<D> {
    fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        vector::multiply(&self.diagonal, r, z);
        gather(&self.positions, r, &mut self.r);
        self.patches.apply(&self.r, &mut self.z);
        add_at(&self.positions, &self.z, z);
    }

    fn diagonal(&self) -> &[f32] {
        &self.diagonal
    }

    fn scattered(&self) -> &[u32] {
        &self.positions
    }

    fn apply_scattered(&mut self, r: &[f32], z: &mut [f32]) {
        self.patches.apply(r, z);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::error::DiagonalError;
    use crate::formulation::paper::stress::{Penalty, SolidStress};
    use crate::formulation::{Formulation, PaperParams, PointMatrices, Problem, SolidRegion};
    use crate::space::VelocitySpace;
    use gluey_fem::{ReferenceMatrices, TreeMesh};
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::{Ball, Ramp};
    use gluey_linalg::LinOp;

    /// `|x . A y - y . A x|` over `|x| |A y|` for random velocities.
    fn asymmetry(operator: &mut CountedOperator<f32, 3>, space: &VelocitySpace<3>) -> f64 {
        let [x, y] = [1, 2].map(|seed| {
            let mut x = vec![0.0; space.dim()];
            vector::fill_pseudo_random(seed, &mut x);
            space.reduce(&mut x);
            x
        });
        let (mut ax, mut ay) = (x.clone(), y.clone());
        operator.apply(&x, &mut ax);
        operator.apply(&y, &mut ay);
        (vector::dot(&x, &ay) - vector::dot(&y, &ax)).abs() / (vector::norm(&x) * vector::norm(&ay))
    }

    /// A penalised problem on the uniform mesh of a level, and the nodes the solid touches.
    fn problem(level: u8, viscosity_ratio: f64, balls: &[Ball<3>]) -> (Problem<3>, Vec<Option<u32>>) {
        let formulation = Formulation::Paper(PaperParams { viscosity_ratio, ..PaperParams::default() });
        let mesh = TreeMesh::refine(Aabb::unit(), [1; 3], [false; 3], level, |_, _, _| true).unwrap();
        let problem = Problem::new(mesh, balls, 1.0, formulation).unwrap();
        let touched = region(&problem).0.touched_nodes(&problem.discretisation().velocity, balls);
        (problem, touched)
    }

    /// Where its solid is, by these matrices.
    fn region(problem: &Problem<3>) -> (SolidRegion<3>, Arc<PointMatrices<3>>) {
        let (discretisation, params) = (problem.discretisation(), PaperParams::default());
        let ramp = Ramp::new(params.ramp * discretisation.finest_cell_size());
        let matrices = Arc::new(PointMatrices::new(params.quadrature));
        (SolidRegion::new(discretisation, &problem.bodies, ramp, &matrices), matrices)
    }

    /// Energies `e^T A e` of a random error on the marked nodes, before and after `sweep` corrects
    /// it from its load.
    fn energies(problem: &Problem<3>, marked: &[bool], sweep: impl FnOnce(&[f64], &mut [f64])) -> [f64; 2] {
        let system = &problem.system;
        let mut a = CountedOperator::within(system, &system.cells);
        let mut energy = |e: &[f64], load: &mut [f64]| {
            a.apply(e, load);
            vector::dot(e, load)
        };
        let mut error = vec![0.0; system.space.dim()];
        vector::fill_pseudo_random(1, &mut error);
        error.iter_mut().enumerate().filter(|(k, _)| !marked[k / 3]).for_each(|(_, e)| *e = 0.0);
        system.space.reduce(&mut error);
        let (mut load, mut answer) = (error.clone(), vec![0.0; error.len()]);
        let before = energy(&error, &mut load);
        sweep(&load, &mut answer);
        vector::axpy(-1.0, &answer, &mut error);
        [before, energy(&error, &mut load)]
    }

    #[test]
    fn a_sweep_damps_rough_errors_whatever_the_contrast() {
        for viscosity_ratio in [10.0, 1e3, 1e5] {
            let balls = [Ball::new(Vector::<3>::repeat(0.47), 0.3)];
            let (problem, touched) = problem(3, viscosity_ratio, &balls);
            let (discretisation, system) = (problem.discretisation(), &problem.system);
            let elements = Elements::new(system, ReferenceMatrices::<3>::VELOCITY);
            let solid =
                NumberedNodes::new(discretisation, |n| touched[n].is_some() && system.space.is_free(n));
            let matrix = assemble_on_nodes(&solid, &elements).unwrap();
            let all = vec![true; touched.len()];
            let mut smoother = PenalisedSmoother::new(system, &all, &solid, &matrix).unwrap();

            let asymmetry = asymmetry(&mut smoother.sweep.operator, &system.space);
            assert!(asymmetry < 1e-6, "{viscosity_ratio:e}: {asymmetry:e}");
            smoother.take_applications();
            let [before, after] = energies(&problem, &all, |r, z| smoother.add_to(r, z));
            assert!(smoother.take_applications() == (SWEEP.degree - 1) as f64);
            assert!(after > 0.0 && after < 0.01 * before, "{viscosity_ratio:e}: {before:e} -> {after:e}");
        }
    }

    /// The smoother of a mesh where everything is solid, for viscosities of any sign.
    fn smoother_of(viscosity: f64, factor: f64) -> Result<PenalisedSmoother<3>, StokesError> {
        let (problem, _) = problem(2, 1e2, &[Ball::new(Vector::repeat(0.47), 0.3)]);
        let (region, matrices) = region(&problem);
        let stress = SolidStress::new(problem.discretisation(), &region, &matrices, 1e2);
        let space = problem.system.space.clone();
        let penalty = Arc::new(Penalty { factor, stress });
        let system = StokesSystem::with_viscosity(space, viscosity, Some(penalty));
        let elements = Elements::new(&system, ReferenceMatrices::<3>::VELOCITY);
        let solid = NumberedNodes::new(system.discretisation(), |n| system.space.is_free(n));
        let matrix = assemble_on_nodes(&solid, &elements).unwrap();
        let all = vec![true; solid.nodes.whole()];
        PenalisedSmoother::new(&system, &all, &solid, &matrix)
    }

    #[test]
    fn a_fluid_or_solid_of_negative_viscosity_is_named() {
        let refused = smoother_of(-1.0, 0.99).err().unwrap();
        assert!(matches!(refused, StokesError::AroundSolid(DiagonalError::Node { .. })), "{refused:?}");
        let text = refused.to_string();
        assert!(
            text.starts_with("the fluid around the solid cannot be smoothed: the diagonal entry"),
            "{text}"
        );
        let refused = smoother_of(1.0, -10.0).err().unwrap();
        assert!(matches!(refused, StokesError::SolidPatch(_)), "{refused:?}");
        let text = refused.to_string();
        assert!(
            text.starts_with("the solid cannot be smoothed cell by cell:") && text.contains("pivot"),
            "{text}"
        );
        assert!(smoother_of(1.0, 0.99).is_ok());
    }

    /// Two balls of radius 0.15 with this gap.
    fn two_balls(gap: f64) -> [Ball<3>; 2] {
        [-1.0, 1.0]
            .map(|side| Ball::new(Vector::<3>::new(0.49 + side * (0.15 + 0.5 * gap), 0.51, 0.48), 0.15))
    }

    #[test]
    fn a_film_is_where_the_cells_of_two_bodies_meet() {
        let (far, touched) = problem(4, 1e3, &two_balls(0.3));
        assert!(around_films(far.discretisation(), &touched).is_none());
        let (near, touched) = problem(4, 1e3, &two_balls(0.025));
        let film = around_films(near.discretisation(), &touched).unwrap();
        let nodes = &near.discretisation().velocity;
        let from_the_middle = |n: usize| (nodes.point(n) - Vector::<3>::new(0.49, 0.51, 0.48)).amax();
        let farthest = |is_in: bool| {
            let distances = (0..film.len()).filter(|&n| film[n] == is_in).map(from_the_middle);
            distances.fold((f64::MAX, 0.0f64), |(least, most), d| (least.min(d), most.max(d)))
        };
        assert!(farthest(true).1 < 0.4 && farthest(false).0 > 0.1);
    }

    #[test]
    fn a_sweep_around_a_film_damps_rough_errors_there_and_changes_nothing_else() {
        let (problem, touched) = problem(4, 1e3, &two_balls(0.025));
        let (discretisation, system) = (problem.discretisation(), &problem.system);
        let elements = Elements::new(system, ReferenceMatrices::<3>::VELOCITY);
        let film = around_films(discretisation, &touched).unwrap();
        let touched: Vec<bool> = touched.iter().map(Option::is_some).collect();
        let mut smoother = FilmSmoother::new(&elements, &film, &touched).unwrap();
        let [before, after] = energies(&problem, &film, |r, z| {
            smoother.add_to(r, z);
            assert!(z.iter().enumerate().all(|(k, &z)| film[k / 3] || z == 0.0));
        });
        let share = smoother.take_applications() / (SWEEP.degree - 1) as f64;
        assert!(share > 0.0 && share < 1.0, "{share}");
        assert!(after > 0.0 && after < 0.01 * before, "{before:e} -> {after:e}");
    }
}
