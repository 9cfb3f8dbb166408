//! The smoother of the finest mesh where the solid is penalised.
//!
//! One sweep of Chebyshev's method on the whole operator, after all corrections: in the fluid by its diagonal, in the solid by
//! [`Patches`]. In single precision: what it is given are residuals, and what it adds holds no rigid motion of a body, whose
//! rounding the solid's viscosity would multiply.

use gluey_geom::{Dim, Space};
use gluey_linalg::{Chebyshev, Guess, Preconditioner, SpectralInterval, estimate_lambda_max, vector};

use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::level::block_diagonal;
use crate::node_matrix::NodeMatrix;
use crate::patches::Patches;
use crate::restricted::{CountedOperator, acting, add_at, gather};
use crate::solid_cycle::{Numbered, failed};
use crate::system::StokesSystem;

/// Applications of diagonal and patches in a sweep.
const DEGREE: usize = 4;
/// Largest over smallest eigenvalue that a sweep damps.
const RATIO: f64 = 5.0;
/// Lanczos steps for the largest eigenvalue.
const LANCZOS_STEPS: usize = 8;
/// Factor by which that estimate is raised.
const SAFETY: f64 = 1.1;

/// Operator, patches and diagonal.
pub struct PenalisedSmoother<const D: usize> {
    operator: CountedOperator<f32, D>,
    parts: Parts<D>,
    chebyshev: Chebyshev<f32>,
    b: Vec<f32>,
    x: Vec<f32>,
}

/// What the residual is multiplied by.
struct Parts<const D: usize> {
    /// In the fluid; zero elsewhere.
    diagonal: Vec<f32>,
    patches: Patches<f32, D>,
    /// The unknowns of the patches among the reduced velocities.
    positions: Vec<u32>,
}

impl<const D: usize> PenalisedSmoother<D>
where
    Dim<D>: Space<D>,
{
    /// The smoother on the nodes in `smoothed`, among them those of `solid`, which are all that the solid touches and on which
    /// the operator is `matrix`.
    pub fn new(
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        smoothed: &[bool],
        (solid, matrix): (&Numbered<'_, D>, &NodeMatrix<D>),
    ) -> Result<Self, StokesError> {
        let space = &system.space;
        let acting = acting(discretisation, &system.cells, smoothed);
        let fluid = block_diagonal(discretisation, space, &acting, smoothed).map_err(|e| failed(&e))?;
        let mut parts = Parts::new(fluid.into_nodal(), solid, matrix)?;
        let cells = (&acting[..], system.cells.len());
        let mut operator = CountedOperator::new(discretisation, space, cells, system.penalty.as_ref());
        let largest = estimate_lambda_max(&mut operator, &mut parts, LANCZOS_STEPS)?;
        operator.take_applications();
        let interval = SpectralInterval::upper_part(largest, RATIO, SAFETY);
        let zeros = || vec![0.0; space.dim()];
        let chebyshev = Chebyshev::new(space.dim(), DEGREE, interval);
        Ok(Self { operator, parts, chebyshev, b: zeros(), x: zeros() })
    }

    /// `z += G r`.
    pub fn add_to(&mut self, r: &[f64], z: &mut [f64]) {
        let norm = vector::norm(r);
        if norm == 0.0 {
            return;
        }
        vector::convert(1.0 / norm, r, &mut self.b);
        self.chebyshev.smooth(&mut self.operator, &mut self.parts, &self.b, &mut self.x, Guess::Zero);
        vector::axpy(norm, &self.x, z);
    }

    /// Applications since the last call, each as its share of the mesh. Products with patches do not count.
    pub fn take_applications(&mut self) -> f64 {
        self.operator.take_applications()
    }
}

impl<const D: usize> Parts<D>
where
    Dim<D>: Space<D>,
{
    fn new(
        mut diagonal: Vec<f32>,
        solid: &Numbered<'_, D>,
        matrix: &NodeMatrix<D>,
    ) -> Result<Self, StokesError> {
        let positions = solid.positions();
        let patches = Patches::new(matrix, solid.cells(), vec![0.0; positions.len()]);
        positions.iter().for_each(|&k| diagonal[k as usize] = 0.0);
        Ok(Self { diagonal, patches: patches.map_err(|e| failed(&e))?, positions })
    }
}

impl<const D: usize> Preconditioner<f32> for Parts<D> {
    fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        vector::multiply(&self.diagonal, r, z);
        let [mut on_solid, mut answer] = [(); 2].map(|()| vec![0.0; self.positions.len()]);
        gather(&self.positions, r, &mut on_solid);
        self.patches.apply(&on_solid, &mut answer);
        add_at(&self.positions, &answer, z);
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
    use super::*;
    use std::sync::Arc;

    use gluey_fem::{Reference, TreeMesh};
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;
    use gluey_linalg::LinOp;

    use crate::element::Elements;
    use crate::formulation::{Formulation, PaperParams};
    use crate::point_matrices::PointMatrices;
    use crate::problem::Problem;
    use crate::space::VelocitySpace;

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

    /// Energies `e^T A e` of a random error on the solid and the fluid around it, before and after a sweep.
    fn energies(viscosity_ratio: f64) -> [f64; 2] {
        let formulation = Formulation::Paper(PaperParams { viscosity_ratio, ..PaperParams::default() });
        let mesh = TreeMesh::refine(Aabb::unit(), [1; 3], [false; 3], 3, |_, _, _| true).unwrap();
        let matrices = Arc::new(PointMatrices::new(formulation.quadrature()));
        let balls = [Ball::new(Vector::<3>::repeat(0.47), 0.3)];
        let Problem { discretisation, system, .. } =
            Problem::new(mesh, &balls, 1.0, formulation, &matrices).unwrap();
        let nodes = &discretisation.velocity;
        let solid = system.penalty.as_ref().unwrap().stress.viscosities(1.0, nodes.cell_count());
        let mut touched = vec![false; nodes.node_count()];
        for cell in (0..nodes.cell_count()).filter(|&c| solid.of(c).0 > 0.0 || !solid.of(c).1.is_empty()) {
            nodes.cell(cell).iter().for_each(|&n| touched[n as usize] = true);
        }
        let elements = Elements::new(&discretisation, &system, Reference::<3>::VELOCITY);
        let numbered = Numbered::new(&discretisation, |n| touched[n] && system.space.is_free(n));
        let matrix = NodeMatrix::assembled(&numbered, &elements).unwrap();
        let smoothed = vec![true; nodes.node_count()];
        let mut smoother =
            PenalisedSmoother::new(&discretisation, &system, &smoothed, (&numbered, &matrix)).unwrap();

        let asymmetry = asymmetry(&mut smoother.operator, &system.space);
        assert!(asymmetry < 1e-6, "{viscosity_ratio:e}: {asymmetry:e}");
        smoother.take_applications();
        let cells = (&system.cells[..], system.cells.len());
        let mut a = CountedOperator::new(&discretisation, &system.space, cells, system.penalty.as_ref());
        let mut energy = |e: &[f64], load: &mut [f64]| {
            a.apply(e, load);
            vector::dot(e, load)
        };
        let mut error = vec![0.0; system.space.dim()];
        vector::fill_pseudo_random(1, &mut error);
        system.space.reduce(&mut error);
        let (mut load, mut answer) = (error.clone(), vec![0.0; error.len()]);
        let before = energy(&error, &mut load);
        smoother.add_to(&load, &mut answer);
        vector::axpy(-1.0, &answer, &mut error);
        assert!(smoother.take_applications() == (DEGREE - 1) as f64);
        [before, energy(&error, &mut load)]
    }

    #[test]
    fn a_sweep_damps_rough_errors_whatever_the_contrast() {
        for viscosity_ratio in [10.0, 1e3, 1e5] {
            let [before, after] = energies(viscosity_ratio);
            assert!(after > 0.0 && after < 0.01 * before, "{viscosity_ratio:e}: {before:e} -> {after:e}");
        }
    }
}
