//! The Stokes operator on cubic cells, by parity.
//!
//! The reflections of a cube commute with the element matrix. In the basis of functions that are even or odd in
//! each direction, with `e = u_0 + u_2` and `o = u_0 - u_2` on the three nodes of a line, the matrix falls apart into
//! `2^D` blocks: the component `u_c` of parity `pi` belongs to the block `pi xor e_c`, and the pressure of parity
//! `pi` to the block `pi`. In 3D that is 855 multiplications a cell in place of 6561. Cells are taken [`LANES`] at a
//! time, one a vector lane.

use gluey_linalg::Scalar;

use crate::element::{node_count, split};
use crate::reference::Reference;

/// Cells handled together.
pub const LANES: usize = 8;
/// Rows of a block handled together.
const ROWS: usize = 4;

type Lanes<T> = [T; LANES];

/// One parity block of the element matrices.
#[derive(Clone, Debug)]
struct Block<T> {
    /// Local velocity unknowns (`node * D + component`) of this block.
    unknowns: Vec<usize>,
    /// Groups of [`ROWS`] rows, column by column.
    rows: Vec<[T; ROWS]>,
    /// Divergence seen by the pressure of this block's parity.
    divergence: Vec<T>,
    /// Local pressure unknown of this block.
    pressure: usize,
}

/// The element matrices of the unit cube in the parity basis.
#[derive(Clone, Debug)]
pub struct CubeKernel<T, const D: usize> {
    blocks: Vec<Block<T>>,
}

/// Groups of [`LANES`] cells with their nodes and scales, padded by cells of scale zero.
#[derive(Clone, Debug, Default)]
pub struct CellBatches<T> {
    velocity: Vec<[u32; LANES]>,
    pressure: Vec<[u32; LANES]>,
    viscous_scale: Vec<Lanes<T>>,
    divergence_scale: Vec<Lanes<T>>,
}

/// Nodes and scales of one cell: `K_c = viscous * K`, `B_c = divergence * B`.
#[derive(Clone, Copy, Debug)]
pub struct CellData<'a> {
    /// Velocity nodes, x fastest.
    pub velocity: &'a [u32],
    /// Pressure nodes, x fastest.
    pub pressure: &'a [u32],
    /// `eta h^(D-2)`.
    pub viscous: f64,
    /// `h^(D-1)`, or zero where the cell takes no part in the divergence.
    pub divergence: f64,
}

impl<T: Scalar> CellBatches<T> {
    /// Packs cells in the given order.
    pub fn new<'a>(cells: impl Iterator<Item = CellData<'a>>) -> Self {
        let cells: Vec<CellData> = cells.collect();
        let mut new = Self {
            velocity: Vec::new(),
            pressure: Vec::new(),
            viscous_scale: Vec::new(),
            divergence_scale: Vec::new(),
        };
        for group in cells.chunks(LANES) {
            let cell = |lane: usize| &group[lane.min(group.len() - 1)];
            let scale = |lane: usize, s: f64| T::from_f64(if lane < group.len() { s } else { 0.0 });
            let lanes = |f: &dyn Fn(usize) -> u32| std::array::from_fn(f);
            new.velocity.extend((0..group[0].velocity.len()).map(|i| lanes(&|l| cell(l).velocity[i])));
            new.pressure.extend((0..group[0].pressure.len()).map(|i| lanes(&|l| cell(l).pressure[i])));
            new.viscous_scale.push(std::array::from_fn(|l| scale(l, cell(l).viscous)));
            new.divergence_scale.push(std::array::from_fn(|l| scale(l, cell(l).divergence)));
        }
        new
    }

    /// The same cells with scales in another precision.
    pub fn convert<S: Scalar>(&self) -> CellBatches<S> {
        let cast = |scales: &[Lanes<T>]| scales.iter().map(|s| s.map(|x| S::from_f64(x.to_f64()))).collect();
        CellBatches {
            velocity: self.velocity.clone(),
            pressure: self.pressure.clone(),
            viscous_scale: cast(&self.viscous_scale),
            divergence_scale: cast(&self.divergence_scale),
        }
    }

    fn count(&self) -> usize {
        self.viscous_scale.len()
    }
}

impl<T: Scalar, const D: usize> Default for CubeKernel<T, D> {
    fn default() -> Self {
        Self::new(&Reference::new())
    }
}

impl<T: Scalar, const D: usize> CubeKernel<T, D> {
    /// Transforms the element matrices to the parity basis.
    pub fn new(reference: &Reference<D>) -> Self {
        let n = Reference::<D>::VELOCITY;
        let mut viscous = reference.viscous.clone();
        transform_rows::<D>(2, D, n, &mut viscous);
        transpose(n, &mut viscous);
        transform_rows::<D>(2, D, n, &mut viscous);
        let mut divergence = reference.divergence.clone();
        transform_rows::<D>(1, 1, n, &mut divergence);
        let mut divergence = transposed(Reference::<D>::PRESSURE, n, &divergence);
        transform_rows::<D>(2, D, Reference::<D>::PRESSURE, &mut divergence);
        let blocks = (0..1usize << D).map(|parity| block::<T, D>(parity, &viscous, &divergence)).collect();
        Self { blocks }
    }

    /// `y += K x` over all cells, for nodal velocities with `D` interleaved components.
    pub fn viscous(&self, cells: &CellBatches<T>, x: &[T], y: &mut [T]) {
        dispatch(self, cells, Task::Viscous { x, y });
    }

    /// `(y, q) += (K x - B^T p, -B x)` over all cells.
    pub fn stokes(&self, cells: &CellBatches<T>, x: &[T], p: &[T], y: &mut [T], q: &mut [T]) {
        dispatch(self, cells, Task::Stokes { x, p, y, q });
    }

    /// `y -= B^T p` over all cells.
    pub fn gradient(&self, cells: &CellBatches<T>, p: &[T], y: &mut [T]) {
        dispatch(self, cells, Task::Gradient { p, y });
    }

    #[inline(always)]
    fn run<const FMA: bool>(&self, cells: &CellBatches<T>, mut task: Task<'_, T>) {
        let nodes = node_count::<D>(2);
        let corners = node_count::<D>(1);
        let mut u = [[T::ZERO; LANES]; 81];
        let mut r = [[T::ZERO; LANES]; 84];
        let mut p = [[T::ZERO; LANES]; 8];
        let mut d = [[T::ZERO; LANES]; 8];
        for batch in 0..cells.count() {
            let velocity = &cells.velocity[batch * nodes..][..nodes];
            let pressure = &cells.pressure[batch * corners..][..corners];
            let scale = (&cells.viscous_scale[batch], &cells.divergence_scale[batch]);
            match &mut task {
                Task::Viscous { x, y } => {
                    gather::<T, D>(velocity, x, &mut u);
                    butterfly::<T, D, 2>(&mut u, D);
                    for block in &self.blocks {
                        block.viscous::<FMA>(&u, &mut r, scale.0);
                    }
                    butterfly::<T, D, 2>(&mut r, D);
                    scatter::<T, D>(velocity, &r, y);
                }
                Task::Gradient { p: x, y } => {
                    gather::<T, 1>(pressure, x, &mut p);
                    butterfly::<T, D, 1>(&mut p, 1);
                    for block in &self.blocks {
                        block.gradient::<FMA, false>(&p, &mut r, scale.1);
                    }
                    butterfly::<T, D, 2>(&mut r, D);
                    scatter::<T, D>(velocity, &r, y);
                }
                Task::Stokes { x, p: pressures, y, q } => {
                    gather::<T, D>(velocity, x, &mut u);
                    gather::<T, 1>(pressure, pressures, &mut p);
                    butterfly::<T, D, 2>(&mut u, D);
                    butterfly::<T, D, 1>(&mut p, 1);
                    for block in &self.blocks {
                        block.viscous::<FMA>(&u, &mut r, scale.0);
                        block.gradient::<FMA, true>(&p, &mut r, scale.1);
                        block.divergence::<FMA>(&u, &mut d, scale.1);
                    }
                    butterfly::<T, D, 2>(&mut r, D);
                    butterfly::<T, D, 1>(&mut d, 1);
                    scatter::<T, D>(velocity, &r, y);
                    scatter::<T, 1>(pressure, &d, q);
                }
            }
        }
    }
}

enum Task<'a, T> {
    Viscous { x: &'a [T], y: &'a mut [T] },
    Gradient { p: &'a [T], y: &'a mut [T] },
    Stokes { x: &'a [T], p: &'a [T], y: &'a mut [T], q: &'a mut [T] },
}

/// Runs the kernel compiled for the widest vectors this processor has.
fn dispatch<T: Scalar, const D: usize>(kernel: &CubeKernel<T, D>, cells: &CellBatches<T>, task: Task<'_, T>) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
            // SAFETY: the features the function is compiled for were detected just above; its code is the safe
            // generic `run`. The test `vector_and_portable_kernels_agree` compares the two.
            return unsafe { run_avx512(kernel, cells, task) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: as above.
            return unsafe { run_avx2(kernel, cells, task) };
        }
    }
    kernel.run::<false>(cells, task);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<T: Scalar, const D: usize>(kernel: &CubeKernel<T, D>, cells: &CellBatches<T>, task: Task<'_, T>) {
    kernel.run::<true>(cells, task);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
fn run_avx512<T: Scalar, const D: usize>(
    kernel: &CubeKernel<T, D>,
    cells: &CellBatches<T>,
    task: Task<'_, T>,
) {
    kernel.run::<true>(cells, task);
}

/// `y = M x` for a dense symmetric matrix, column by column.
pub fn multiply_symmetric<T: Scalar>(matrix: &[T], x: &[T], y: &mut [T]) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
            // SAFETY: the features were detected just above; the code is the safe generic `columns`. The test
            // `dense_products_agree` compares the two.
            return unsafe { columns_avx512(matrix, x, y) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: as above.
            return unsafe { columns_avx2(matrix, x, y) };
        }
    }
    columns::<T, false>(matrix, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn columns_avx2<T: Scalar>(matrix: &[T], x: &[T], y: &mut [T]) {
    columns::<T, true>(matrix, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
fn columns_avx512<T: Scalar>(matrix: &[T], x: &[T], y: &mut [T]) {
    columns::<T, true>(matrix, x, y);
}

#[inline(always)]
fn columns<T: Scalar, const FMA: bool>(matrix: &[T], x: &[T], y: &mut [T]) {
    y.fill(T::ZERO);
    for (&factor, column) in x.iter().zip(matrix.chunks_exact(y.len())) {
        for (sum, &m) in y.iter_mut().zip(column) {
            *sum = fused::<T, FMA>(factor, m, *sum);
        }
    }
}

impl<T: Scalar> Block<T> {
    /// `r = scale K u` on this block.
    #[inline(always)]
    fn viscous<const FMA: bool>(&self, u: &[Lanes<T>], r: &mut [Lanes<T>], scale: &Lanes<T>) {
        let size = self.unknowns.len();
        for (group, rows) in self.rows.chunks_exact(size).enumerate() {
            let mut sums = [[T::ZERO; LANES]; ROWS];
            for (row, &unknown) in rows.iter().zip(&self.unknowns) {
                let x = &u[unknown];
                for k in 0..ROWS {
                    for l in 0..LANES {
                        sums[k][l] = fused::<T, FMA>(row[k], x[l], sums[k][l]);
                    }
                }
            }
            for (sum, &unknown) in sums.iter().zip(&self.unknowns[group * ROWS..]) {
                for l in 0..LANES {
                    r[unknown][l] = sum[l] * scale[l];
                }
            }
        }
    }

    /// `r -= scale B^T p` on this block, or `r = -scale B^T p`.
    #[inline(always)]
    fn gradient<const FMA: bool, const ADD: bool>(
        &self,
        p: &[Lanes<T>],
        r: &mut [Lanes<T>],
        scale: &Lanes<T>,
    ) {
        let mut q = p[self.pressure];
        for l in 0..LANES {
            q[l] = -(q[l] * scale[l]);
        }
        for (&b, &unknown) in self.divergence.iter().zip(&self.unknowns) {
            for l in 0..LANES {
                let old = if ADD { r[unknown][l] } else { T::ZERO };
                r[unknown][l] = fused::<T, FMA>(b, q[l], old);
            }
        }
    }

    /// `d = -scale B u` on this block.
    #[inline(always)]
    fn divergence<const FMA: bool>(&self, u: &[Lanes<T>], d: &mut [Lanes<T>], scale: &Lanes<T>) {
        let mut sum = [T::ZERO; LANES];
        for (&b, &unknown) in self.divergence.iter().zip(&self.unknowns) {
            for l in 0..LANES {
                sum[l] = fused::<T, FMA>(b, u[unknown][l], sum[l]);
            }
        }
        for l in 0..LANES {
            d[self.pressure][l] = -(sum[l] * scale[l]);
        }
    }
}

/// `a * b + c`, in one rounding where the processor has it.
#[inline(always)]
fn fused<T: Scalar, const FMA: bool>(a: T, b: T, c: T) -> T {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
fn gather<T: Scalar, const C: usize>(nodes: &[[u32; LANES]], x: &[T], u: &mut [Lanes<T>]) {
    for (i, lanes) in nodes.iter().enumerate() {
        for (l, &node) in lanes.iter().enumerate() {
            let from = &x[node as usize * C..][..C];
            for c in 0..C {
                u[i * C + c][l] = from[c];
            }
        }
    }
}

#[inline(always)]
fn scatter<T: Scalar, const C: usize>(nodes: &[[u32; LANES]], r: &[Lanes<T>], y: &mut [T]) {
    for (i, lanes) in nodes.iter().enumerate() {
        for (l, &node) in lanes.iter().enumerate() {
            let to = &mut y[node as usize * C..][..C];
            for c in 0..C {
                to[c] += r[i * C + c][l];
            }
        }
    }
}

/// Replaces the end values of every line of nodes by their sum and difference.
#[inline(always)]
fn butterfly<T: Scalar, const D: usize, const DEGREE: usize>(u: &mut [Lanes<T>], components: usize) {
    let n = DEGREE + 1;
    let mut stride = components;
    for _ in 0..D {
        let size = node_count::<D>(DEGREE) * components;
        let mut start = 0;
        while start < size {
            for i in start..start + stride {
                let j = i + DEGREE * stride;
                for l in 0..LANES {
                    let (a, b) = (u[i][l], u[j][l]);
                    u[i][l] = a + b;
                    u[j][l] = a - b;
                }
            }
            start += n * stride;
        }
        stride *= n;
    }
}

/// Applies the inverse-transposed butterfly, `(a, b) -> ((a+b)/2, (a-b)/2)`, to the node index of every column.
fn transform_rows<const D: usize>(degree: usize, components: usize, columns: usize, matrix: &mut [f64]) {
    let n = degree + 1;
    for d in 0..D {
        let stride = n.pow(d as u32) * components * columns;
        for start in (0..matrix.len()).step_by(n * stride) {
            for i in start..start + stride {
                let j = i + degree * stride;
                let (a, b) = (matrix[i], matrix[j]);
                matrix[i] = 0.5 * (a + b);
                matrix[j] = 0.5 * (a - b);
            }
        }
    }
}

fn transposed(rows: usize, columns: usize, matrix: &[f64]) -> Vec<f64> {
    (0..rows * columns).map(|k| matrix[k % rows * columns + k / rows]).collect()
}

fn transpose(n: usize, matrix: &mut Vec<f64>) {
    *matrix = transposed(n, n, matrix);
}

fn block<T: Scalar, const D: usize>(parity: usize, viscous: &[f64], divergence: &[f64]) -> Block<T> {
    let n = Reference::<D>::VELOCITY;
    let unknowns: Vec<usize> =
        (0..n).filter(|k| node_parity::<D>(k / D, 2) ^ (1 << (k % D)) == parity).collect();
    let mut rows = Vec::new();
    for group in unknowns.chunks(ROWS) {
        for &column in &unknowns {
            let entry = |k: usize| group.get(k).map_or(0.0, |&row| viscous[row * n + column]);
            rows.push(std::array::from_fn(|k| T::from_f64(entry(k))));
        }
    }
    let corners = Reference::<D>::PRESSURE;
    let pressure = (0..corners).find(|&q| node_parity::<D>(q, 1) == parity).unwrap_or(0);
    let divergence = unknowns.iter().map(|&k| T::from_f64(divergence[k * corners + pressure])).collect();
    Block { unknowns, rows, divergence, pressure }
}

/// Bit `d` is set where the transformed node is odd in direction `d`: there its 1D index is the last.
fn node_parity<const D: usize>(node: usize, degree: usize) -> usize {
    let index = split::<D>(node, degree + 1);
    (0..D).filter(|&d| index[d] == degree).map(|d| 1 << d).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, k: f64) -> Vec<f64> {
        (0..n).map(|i| (k * (i as f64 + 1.0)).sin()).collect()
    }

    /// Cells of different scales that share no nodes.
    fn cells<const D: usize>(count: usize) -> (Vec<Vec<u32>>, Vec<Vec<u32>>) {
        let nodes = |n: usize| (0..count).map(|c| (0..n).map(|i| (c * n + i) as u32).collect()).collect();
        (nodes(node_count::<D>(2)), nodes(node_count::<D>(1)))
    }

    fn blocks_equal_the_dense_matrices<const D: usize>() {
        let reference = Reference::<D>::new();
        let kernel = CubeKernel::<f64, D>::new(&reference);
        let (n, m, count) = (Reference::<D>::VELOCITY, Reference::<D>::PRESSURE, 11);
        let (velocity, pressure) = cells::<D>(count);
        let scale = |c: usize| (1.0 + c as f64, 2.0 - 0.1 * c as f64);
        let batches = CellBatches::new((0..count).map(|c| CellData {
            velocity: &velocity[c],
            pressure: &pressure[c],
            viscous: scale(c).0,
            divergence: scale(c).1,
        }));
        let (x, p) = (wave(count * n, 0.9), wave(count * m, 0.4));
        let (mut y, mut q) = (vec![0.0; count * n], vec![0.0; count * m]);
        kernel.stokes(&batches, &x, &p, &mut y, &mut q);
        let (mut y2, mut y3) = (vec![0.0; count * n], vec![0.0; count * n]);
        kernel.viscous(&batches, &x, &mut y2);
        kernel.gradient(&batches, &p, &mut y2);
        kernel.run::<false>(&batches, Task::Viscous { x: &x, y: &mut y3 });
        kernel.run::<false>(&batches, Task::Gradient { p: &p, y: &mut y3 });
        for c in 0..count {
            let (k, b) = scale(c);
            for i in 0..n {
                let viscous: f64 = (0..n).map(|j| reference.viscous[i * n + j] * x[c * n + j]).sum();
                let gradient: f64 = (0..m).map(|r| reference.divergence[r * n + i] * p[c * m + r]).sum();
                let want = k * viscous - b * gradient;
                for got in [y[c * n + i], y2[c * n + i], y3[c * n + i]] {
                    assert!((got - want).abs() < 1e-12, "{got} {want}");
                }
            }
            for r in 0..m {
                let want: f64 = (0..n).map(|j| -b * reference.divergence[r * n + j] * x[c * n + j]).sum();
                assert!((q[c * m + r] - want).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn dense_products_agree() {
        let n = 81;
        let matrix: Vec<f64> = (0..n * n).map(|k| ((k / n + k % n) as f64).sin()).collect();
        let x = wave(n, 0.3);
        let (mut y, mut portable) = (vec![0.0; n], vec![0.0; n]);
        multiply_symmetric(&matrix, &x, &mut y);
        columns::<f64, false>(&matrix, &x, &mut portable);
        for i in 0..n {
            let rows: f64 = (0..n).map(|j| matrix[i * n + j] * x[j]).sum();
            assert!((y[i] - rows).abs() < 1e-12 && (portable[i] - rows).abs() < 1e-12);
        }
    }

    #[test]
    fn vector_and_portable_kernels_agree() {
        blocks_equal_the_dense_matrices::<2>();
        blocks_equal_the_dense_matrices::<3>();
    }
}
