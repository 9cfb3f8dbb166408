use super::*;
use crate::element::{ReferenceMatrices, add_viscous, gauss_cube};
use crate::mesh::TreeMesh;
use gluey_geom::{Aabb, Vector};

/// Gauss points per direction where the viscosity varies; also an odd number.
const QUADRATURE: [usize; 3] = [3, 4, 5];

/// A mesh of several chunks with hanging nodes, some cells left out, some scaled, some with a viscosity that
/// varies, and some nodes that move with two bodies.
struct Case<const D: usize> {
    velocity: NodeMap<D>,
    pressure: NodeMap<D>,
    chunks: Arc<Chunks<D>>,
    scales: Vec<(usize, f64, f64)>,
    eta: Vec<Vec<f64>>,
    rigid_nodes: Vec<RigidNode<f64, D>>,
    quadrature: usize,
    shear: f64,
}

impl<const D: usize> Case<D> {
    /// In sheared cells, where no viscosity varies.
    fn sheared(shear: f64) -> Self {
        let case = Self::new(3);
        Self { eta: vec![Vec::new(); case.scales.len()], shear, ..case }
    }

    fn new(quadrature: usize) -> Self {
        let finest = if D == 2 { 6 } else { 4 };
        let center = Vector::<D>::repeat(0.42);
        let mesh = TreeMesh::refine(Aabb::unit(), [1; D], [false; D], finest, |lower, h, level| {
            level < 3 || (lower + Vector::repeat(0.5 * h) - center).norm() < 0.3
        })
        .expect("the unit box is a cube");
        let (velocity, pressure) = (NodeMap::new(&mesh, 2), NodeMap::new(&mesh, 1));
        let cells = (0..mesh.cell_count()).filter(|c| c % 7 != 3 && !(600..1200).contains(c));
        let scales: Vec<(usize, f64, f64)> =
            cells.map(|c| (c, 1.0 + (c % 5) as f64, 2.0 - 0.1 * (c % 3) as f64)).collect();
        let points = quadrature.pow(D as u32);
        let varying = |c: usize| if c % 11 == 1 { points } else { 0 };
        let eta =
            scales.iter().map(|s| (0..varying(s.0)).map(|q| (1.0 + (s.0 + q) as f64).sin() + 2.0).collect());
        let rigid = |n: &usize| n % 13 == 5 && !velocity.is_hanging(*n) && !velocity.is_on_boundary(*n);
        let rigid_nodes = (0..velocity.node_count()).filter(rigid).map(|n| RigidNode {
            node: n as u32,
            body: 2 * (n % 2) as u32,
            arm: std::array::from_fn(|d| velocity.point(n)[d] - 0.5),
        });
        Self {
            chunks: Arc::new(Chunks::new(&velocity, &pressure)),
            eta: eta.collect(),
            rigid_nodes: rigid_nodes.collect(),
            scales,
            velocity,
            pressure,
            quadrature,
            shear: 0.0,
        }
    }

    fn operator<T: CellScalar>(&self) -> CellOperator<T, D> {
        let cells = self
            .scales
            .iter()
            .zip(&self.eta)
            .map(|(&(cell, viscous, divergence), points)| CellData { cell, viscous, divergence, points });
        CellOperator::new(&self.chunks, &self.velocity, cells, self.quadrature, &self.rigid_nodes, 3)
            .sheared(self.shear)
    }

    /// `(y, q)` by dense element matrices, with all maps written out.
    fn dense(&self, x: &[f64], p: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let reference = ReferenceMatrices::<D>::sheared(self.shear);
        let (n, m) = (ReferenceMatrices::<D>::VELOCITY, ReferenceMatrices::<D>::PRESSURE);
        let nodal = self.velocity.node_count() * D;
        let twist = CellOperator::<f64, D>::TWIST;
        let mut u = x[..nodal].to_vec();
        for rigid in &self.rigid_nodes {
            let from = &x[nodal + rigid.body as usize * twist..];
            (0..D).for_each(|c| {
                u[rigid.node as usize * D + c] = row(rigid, c).iter().zip(from).map(|(a, b)| a * b).sum()
            });
        }
        self.velocity.distribute(D, |w| w, &mut u);
        let (mut y, mut q) = (vec![0.0; x.len()], vec![0.0; p.len()]);
        for (&(cell, viscous, divergence), eta) in self.scales.iter().zip(&self.eta) {
            let mut matrix: Vec<f64> = reference.viscous.iter().map(|k| viscous * k).collect();
            for (eta, (x, weight)) in eta.iter().zip(gauss_cube::<D>(self.quadrature)) {
                add_viscous(&x, weight * eta, &mut matrix);
            }
            let dof = |k: usize| self.velocity.cell(cell)[k / D] as usize * D + k % D;
            let corners = self.pressure.cell(cell);
            for i in 0..n {
                y[dof(i)] += (0..n).map(|j| matrix[i * n + j] * u[dof(j)]).sum::<f64>();
                for r in 0..m {
                    let b = divergence * reference.divergence[r * n + i];
                    y[dof(i)] -= b * p[corners[r] as usize];
                    q[corners[r] as usize] -= b * u[dof(i)];
                }
            }
        }
        let (nodes, loads) = y.split_at_mut(nodal);
        self.velocity.condense(D, |w| w, nodes);
        for rigid in &self.rigid_nodes {
            for c in 0..D {
                let force = std::mem::take(&mut nodes[rigid.node as usize * D + c]);
                let load = &mut loads[rigid.body as usize * twist..];
                row(rigid, c).iter().zip(load).for_each(|(a, l)| *l += a * force);
            }
        }
        for node in (0..self.velocity.node_count()).filter(|&n| self.velocity.is_on_boundary(n)) {
            nodes[node * D..][..D].fill(0.0);
        }
        (y, q)
    }
}

/// Component `c` of `U + w x arm` as a form in the entries of the twist.
fn row<const D: usize>(rigid: &RigidNode<f64, D>, c: usize) -> Vec<f64> {
    let mut row = vec![0.0; CellOperator::<f64, D>::TWIST];
    row[c] = 1.0;
    if D == 2 {
        row[2] = [-rigid.arm[1], rigid.arm[0]][c];
    } else {
        row[D + (c + 1) % D] = rigid.arm[(c + 2) % D];
        row[D + (c + 2) % D] = -rigid.arm[(c + 1) % D];
    }
    row
}

fn wave(n: usize, k: f64) -> Vec<f64> {
    (0..n).map(|i| (k * (i as f64 + 1.0)).sin()).collect()
}

fn cast<T: CellScalar>(x: &[f64]) -> Vec<T> {
    x.iter().map(|&x| T::from_f64(x)).collect()
}

fn distance<T: CellScalar>(a: &[T], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a.to_f64() - b).abs()).fold(0.0, f64::max)
}

fn equals_the_dense_matrices<T: CellScalar, const D: usize>() {
    for case in QUADRATURE.map(Case::<D>::new).into_iter().chain([Case::sheared(-0.37)]) {
        let (quadrature, shear) = (case.quadrature, case.shear);
        let operator = case.operator::<T>();
        assert!(
            case.chunks.count() > 1 && !case.velocity.constraints().is_empty() && case.rigid_nodes.len() > 10
        );
        let (x, p) = (wave(operator.velocity_dim(), 0.9), wave(operator.pressure_dim(), 0.4));
        let (want_y, want_q) = case.dense(&x, &p);
        let (x, p) = (cast::<T>(&x), cast::<T>(&p));
        let (mut y, mut q) = (vec![T::ONE; x.len()], vec![T::ONE; p.len()]);
        let mut work = Workspace::default();
        operator.stokes(&x, &p, &mut y, &mut q, &mut work);
        let scale = want_y.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let tolerance = 50.0 * T::EPSILON * scale;
        assert!(
            distance(&y, &want_y) < tolerance,
            "{D} {quadrature} {shear} {}",
            distance(&y, &want_y) / scale
        );
        assert!(distance(&q, &want_q) < tolerance);
        let mut gradient = vec![T::ONE; x.len()];
        operator.viscous(&x, &mut y, &mut work);
        operator.gradient(&p, &mut gradient, &mut work);
        y.iter_mut().zip(&gradient).for_each(|(y, g)| *y += *g);
        assert!(distance(&y, &want_y) < tolerance);
    }
}

#[test]
fn operators_equal_the_dense_matrices() {
    equals_the_dense_matrices::<f64, 2>();
    equals_the_dense_matrices::<f64, 3>();
    equals_the_dense_matrices::<f32, 2>();
    equals_the_dense_matrices::<f32, 3>();
}

fn same_bits<const D: usize>() {
    let case = Case::<D>::new(4);
    let operator = case.operator::<f64>();
    let (x, p) = (wave(operator.velocity_dim(), 0.9), wave(operator.pressure_dim(), 0.4));
    let run = |threads: usize| {
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads are available");
        let (mut y, mut q) = (vec![0.0; x.len()], vec![0.0; p.len()]);
        pool.install(|| operator.stokes(&x, &p, &mut y, &mut q, &mut Workspace::default()));
        y.extend(q);
        y.iter().map(|y| y.to_bits()).collect::<Vec<u64>>()
    };
    let one = run(1);
    for threads in [2, 3, 4] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

#[test]
fn results_have_the_same_bits_for_any_number_of_threads() {
    same_bits::<2>();
    same_bits::<3>();
}

fn kernels_agree<T: CellScalar, const D: usize>(case: &Case<D>) {
    let operator = case.operator::<T>();
    let (x, p) = (cast(&wave(operator.velocity_dim(), 0.9)), cast(&wave(operator.pressure_dim(), 0.4)));
    let portable = sweep::with(&operator, &x, &p, &|input, output, buffers| {
        operator.run::<simd::Portable<T>, true, true, T>(input, output, buffers);
    });
    let portable: Vec<f64> = portable.iter().map(|x| x.to_f64()).collect();
    let scale = portable.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let check = |found: Vec<T>| assert!(distance(&found, &portable) < 50.0 * T::EPSILON * scale);
    check(sweep::with(&operator, &x, &p, &|input, output, buffers| {
        operator.dispatch::<true, true, T>(input, output, buffers);
    }));
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        check(sweep::with(&operator, &x, &p, &|input, output, buffers| {
            // SAFETY: the instructions were detected.
            unsafe { sweep::run_avx2::<T, D, true, true, T>(&operator, input, output, buffers) };
        }));
    }
}

#[test]
fn vector_and_portable_kernels_agree() {
    for (case_2d, case_3d) in [(Case::new(4), Case::new(4)), (Case::sheared(0.4), Case::sheared(0.4))] {
        kernels_agree::<f32, 2>(&case_2d);
        kernels_agree::<f64, 2>(&case_2d);
        kernels_agree::<f32, 3>(&case_3d);
        kernels_agree::<f64, 3>(&case_3d);
    }
}
