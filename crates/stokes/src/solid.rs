//! The viscous stress of the penalised solid, `K(I eta_s)`.
//!
//! The mixing law `eta = I eta_s + (1 - I) eta_f` makes the viscous operator of the mixture the sum
//! `K(eta) = K(eta_f) + (1 - 1/r) K(I eta_s)`, so one solid operator serves the penalty and, as in eq. 9 of Verdon et
//! al. 2010, the multiplier. Cells wholly inside (`I = 1`) are scaled cubes; cells with a ramp keep their own matrices,
//! integrated with enough Gauss points to see the surface.

use gluey_fem::element::{gauss_cube, node_count, value};
use gluey_fem::kernel::{CellBatches, CellData, CubeKernel, multiply_symmetric};
use gluey_fem::{NodeMap, Reference};
use gluey_geom::{Dim, Matrix, Space, Spin, Twist, Vector};
use gluey_levelset::{Ball, Body, Ramp, nearest};
use gluey_linalg::Scalar;

use crate::discretisation::Discretisation;

/// Element matrices of every quadrature point, for cells with a viscosity that varies inside.
#[derive(Clone, Debug)]
pub struct PointMatrices<const D: usize> {
    points: Vec<([f64; D], f64)>,
    /// One matrix a point, the weight included.
    viscous: Vec<Vec<f64>>,
    /// Values of the velocity shape functions at each point.
    shapes: Vec<Vec<f64>>,
}

impl<const D: usize> PointMatrices<D> {
    /// Prepares the tensor-product Gauss rule with `points` points a direction.
    pub fn new(points: usize) -> Self {
        let points = gauss_cube::<D>(points);
        let n = Reference::<D>::VELOCITY;
        let matrix = |(x, weight): &([f64; D], f64)| {
            let mut matrix = vec![0.0; n * n];
            gluey_fem::add_viscous(x, *weight, &mut matrix);
            matrix
        };
        let shape = |(x, _): &([f64; D], f64)| (0..n / D).map(|i| value::<D>(2, i, x)).collect();
        Self {
            viscous: points.iter().map(matrix).collect(),
            shapes: points.iter().map(shape).collect(),
            points,
        }
    }
}

/// A cell that the surface or its ramp crosses.
#[derive(Clone, Debug)]
struct CutCell<T> {
    cell: u32,
    matrix: Vec<T>,
}

/// Solid fraction `I` at the quadrature points of a cell, and the body it belongs to.
#[derive(Clone, Debug)]
struct SolidCell {
    cell: u32,
    body: u32,
    fraction: Vec<f64>,
}

/// The operator `K(I eta_s)` on the velocity nodes of a mesh.
#[derive(Clone, Debug)]
pub struct SolidStress<T, const D: usize> {
    interior: Vec<u32>,
    interior_scale: Vec<f64>,
    interior_batches: CellBatches<T>,
    cut: Vec<CutCell<T>>,
    kernel: CubeKernel<T, D>,
}

/// Where the solid is on a mesh.
#[derive(Clone, Debug)]
pub struct SolidRegion<const D: usize> {
    cells: Vec<SolidCell>,
}

impl<const D: usize> SolidRegion<D>
where
    Dim<D>: Space<D>,
{
    /// Evaluates the solid fraction at the quadrature points of all cells near the bodies.
    pub fn new(
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        ramp: Ramp,
        matrices: &PointMatrices<D>,
    ) -> Self {
        let mut cells = Vec::new();
        for (cell, c) in discretisation.mesh.cells().iter().enumerate() {
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let center = lower + Vector::repeat(0.5 * h);
            let reach = 0.5 * h * (D as f64).sqrt();
            let Some((body, alpha)) = nearest(bodies, &center) else { continue };
            if alpha < -reach {
                continue;
            }
            let at = |x: &[f64; D]| {
                let x = lower + Vector::from_fn(|d, _| h * x[d]);
                nearest(bodies, &x).map_or(0.0, |b| ramp.fraction(b.1))
            };
            let fraction: Vec<f64> = matrices.points.iter().map(|p| at(&p.0)).collect();
            if fraction.iter().any(|&f| f > 0.0) {
                cells.push(SolidCell { cell: cell as u32, body: body as u32, fraction });
            }
        }
        Self { cells }
    }

    /// Whether a body has any cell.
    pub fn holds(&self, body: usize) -> bool {
        self.cells.iter().any(|c| c.body as usize == body)
    }

    /// The nodes of all cells with any solid in them, each with the body nearest to it.
    pub fn touched_nodes(&self, nodes: &NodeMap<D>, bodies: &[Ball<D>]) -> Vec<Option<u32>> {
        let mut touched = vec![None; nodes.node_count()];
        for solid in &self.cells {
            for &node in nodes.cell(solid.cell as usize) {
                let body = nearest(bodies, &nodes.point(node as usize)).map(|b| b.0 as u32);
                touched[node as usize] = body;
            }
        }
        touched
    }

    /// The rigid motions closest to a velocity field in the `I`-weighted mean: `U = int I u / int I` and the spin from
    /// the angular momentum, `int I r x u = J w` with `J` the `I`-weighted inertia.
    pub fn twists(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        matrices: &PointMatrices<D>,
        velocity: &[f64],
    ) -> Vec<Twist<D>> {
        let mut moments = vec![Moments::<D>::new(); bodies.len()];
        for solid in &self.cells {
            let cell = solid.cell as usize;
            let c = &discretisation.mesh.cells()[cell];
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let nodes = discretisation.velocity.cell(cell);
            for (q, (x, weight)) in matrices.points.iter().enumerate() {
                let mut u = Vector::<D>::zeros();
                for (&node, &shape) in nodes.iter().zip(&matrices.shapes[q]) {
                    for d in 0..D {
                        u[d] += shape * velocity[node as usize * D + d];
                    }
                }
                let position = lower + Vector::from_fn(|d, _| h * x[d]);
                let Some((body, _)) = nearest(bodies, &position) else { continue };
                let weight = weight * h.powi(D as i32) * solid.fraction[q];
                moments[body].add(weight, &bodies[body].arm(&position), &u);
            }
        }
        moments.iter().map(Moments::twist).collect()
    }
}

/// Weighted sums over a body.
#[derive(Clone, Debug)]
struct Moments<const D: usize>
where
    Dim<D>: Space<D>,
{
    mass: f64,
    momentum: Vector<D>,
    first: Vector<D>,
    second: Matrix<D>,
    angular: Spin<D>,
}

impl<const D: usize> Moments<D>
where
    Dim<D>: Space<D>,
{
    fn new() -> Self {
        Self {
            mass: 0.0,
            momentum: Vector::zeros(),
            first: Vector::zeros(),
            second: Matrix::zeros(),
            angular: Dim::<D>::zero_spin(),
        }
    }

    fn add(&mut self, weight: f64, arm: &Vector<D>, u: &Vector<D>) {
        self.mass += weight;
        self.momentum += u * weight;
        self.first += arm * weight;
        self.second += arm * arm.transpose() * weight;
        self.angular += Dim::<D>::moment(arm, u) * weight;
    }

    /// Velocity and spin about the centroid of the weights, the velocity then moved to the reference point.
    fn twist(&self) -> Twist<D> {
        if self.mass <= 0.0 {
            return Twist::default();
        }
        let (mean, centroid) = (self.momentum / self.mass, self.first / self.mass);
        let second = self.second - centroid * centroid.transpose() * self.mass;
        let mut angular = self.angular;
        angular += -(Dim::<D>::moment(&centroid, &mean) * self.mass);
        let spin = solve_inertia::<D>(&second, &angular);
        Twist { velocity: mean - Dim::<D>::cross_spin(&spin, &centroid), spin }
    }
}

/// Solves `J w = l` with `J = tr(S) 1 - S`.
fn solve_inertia<const D: usize>(second: &Matrix<D>, angular: &Spin<D>) -> Spin<D>
where
    Dim<D>: Space<D>,
{
    let rot = Dim::<D>::ROT;
    let inertia = nalgebra::DMatrix::from_fn(rot, rot, |i, j| {
        let diagonal = if i == j { second.trace() } else { 0.0 };
        diagonal - if rot == 1 { 0.0 } else { second[(i, j)] }
    });
    let load = nalgebra::DVector::from_fn(rot, |i, _| angular[i]);
    let mut spin = Dim::<D>::zero_spin();
    if let Some(solution) = inertia.cholesky().map(|c| c.solve(&load)) {
        for k in 0..rot {
            spin[k] = solution[k];
        }
    }
    spin
}

impl<T: Scalar, const D: usize> SolidStress<T, D> {
    /// Integrates `K(I eta_s)` for `eta_s = solid_viscosity`.
    pub fn new(
        discretisation: &Discretisation<D>,
        region: &SolidRegion<D>,
        matrices: &PointMatrices<D>,
        solid_viscosity: f64,
    ) -> Self {
        let scale = |cell: u32| solid_viscosity * discretisation.cell_size(cell as usize).powi(D as i32 - 2);
        let (inside, cut): (Vec<&SolidCell>, Vec<&SolidCell>) =
            region.cells.iter().partition(|c| c.fraction.iter().all(|&f| f == 1.0));
        let interior: Vec<u32> = inside.iter().map(|c| c.cell).collect();
        let interior_scale: Vec<f64> = interior.iter().map(|&c| scale(c)).collect();
        let data = interior.iter().zip(&interior_scale).map(|(&c, &viscous)| CellData {
            velocity: discretisation.velocity.cell(c as usize),
            pressure: discretisation.pressure.cell(c as usize),
            viscous,
            divergence: 0.0,
        });
        let interior_batches = CellBatches::new(data);
        let cut = cut.iter().map(|c| cut_cell(c, scale(c.cell), matrices)).collect();
        Self { interior, interior_scale, interior_batches, cut, kernel: CubeKernel::default() }
    }

    /// `y += K(I eta_s) x` for nodal velocities.
    pub fn apply(&self, nodes: &NodeMap<D>, x: &[T], y: &mut [T]) {
        self.kernel.viscous(&self.interior_batches, x, y);
        let n = Reference::<D>::VELOCITY;
        let (mut local, mut image) = ([T::ZERO; 81], [T::ZERO; 81]);
        for cut in &self.cut {
            let nodes = nodes.cell(cut.cell as usize);
            for (i, &node) in nodes.iter().enumerate() {
                local[i * D..][..D].copy_from_slice(&x[node as usize * D..][..D]);
            }
            multiply_symmetric(&cut.matrix, &local[..n], &mut image[..n]);
            for (i, &node) in nodes.iter().enumerate() {
                for c in 0..D {
                    y[node as usize * D + c] += image[i * D + c];
                }
            }
        }
    }

    /// Adds the diagonal of `K(I eta_s)` to nodal values.
    pub fn add_diagonal(&self, nodes: &NodeMap<D>, reference: &Reference<D>, diagonal: &mut [T]) {
        let n = Reference::<D>::VELOCITY;
        for (cell, scale) in self.interior.iter().zip(&self.interior_scale) {
            for (i, &node) in nodes.cell(*cell as usize).iter().enumerate() {
                for c in 0..D {
                    let k = (i * D + c) * (n + 1);
                    diagonal[node as usize * D + c] += T::from_f64(scale * reference.viscous[k]);
                }
            }
        }
        for cut in &self.cut {
            for (i, &node) in nodes.cell(cut.cell as usize).iter().enumerate() {
                for c in 0..D {
                    diagonal[node as usize * D + c] += cut.matrix[(i * D + c) * (n + 1)];
                }
            }
        }
    }

    /// The same operator in another precision.
    pub fn convert<S: Scalar>(&self) -> SolidStress<S, D> {
        let cast = |cut: &CutCell<T>| CutCell {
            cell: cut.cell,
            matrix: cut.matrix.iter().map(|k| S::from_f64(k.to_f64())).collect(),
        };
        SolidStress {
            interior: self.interior.clone(),
            interior_scale: self.interior_scale.clone(),
            interior_batches: self.interior_batches.convert(),
            cut: self.cut.iter().map(cast).collect(),
            kernel: CubeKernel::default(),
        }
    }

    /// Calls `visit(cell, scale, matrix)` for every solid cell: interior ones have the matrix `scale * K`, cut ones
    /// their own.
    pub fn for_each_cell(&self, mut visit: impl FnMut(u32, f64, Option<&[T]>)) {
        for (cell, scale) in self.interior.iter().zip(&self.interior_scale) {
            visit(*cell, *scale, None);
        }
        for cut in &self.cut {
            visit(cut.cell, 1.0, Some(&cut.matrix));
        }
    }
}

fn cut_cell<T: Scalar, const D: usize>(
    solid: &SolidCell,
    scale: f64,
    matrices: &PointMatrices<D>,
) -> CutCell<T> {
    let mut sum = vec![0.0; (D * node_count::<D>(2)).pow(2)];
    for (&fraction, matrix) in solid.fraction.iter().zip(&matrices.viscous) {
        if fraction > 0.0 {
            gluey_linalg::vector::axpy(scale * fraction, matrix, &mut sum);
        }
    }
    CutCell { cell: solid.cell, matrix: sum.iter().map(|&k| T::from_f64(k)).collect() }
}
