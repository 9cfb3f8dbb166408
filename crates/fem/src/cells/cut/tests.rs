use gluey_linalg::vector::fill_pseudo_random;

use super::super::simd::Portable;
use super::kernel::{slots, twist_len};
use super::*;
use crate::cut::{BallInCell, CutMoments, POINTS, ViscousMatrices};
use crate::element::{gauss_cube, gradient, node_count, value};

/// Arms, edge, viscosity and `h / eta` of the piece below.
const EDGE: f64 = 0.31;
const VISCOUS: f64 = 1.7;
const PRESSURE: f64 = 0.4;
/// Shears of the cells.
const SHEARS: [f64; 2] = [0.0, 0.43];

fn origin<const D: usize>() -> [f64; D] {
    std::array::from_fn(|d| -0.9 + 0.2 * d as f64)
}

/// The moments of a cell and a ball that matches origin and edge, with a penalty of 20.
fn moments<const D: usize>(shear: f64) -> (CutMoments<D>, Vec<f64>) {
    let mut center = origin::<D>().map(|x| -x / EDGE);
    center[0] -= shear * center[1];
    let ball = BallInCell { center, radius: 1.0 / EDGE };
    let moments = CutMoments::sheared(shear, [(&ball, &[][..])].into_iter());
    let penalty = moments.surfaces[0].area.iter().map(|area| 20.0 * area).collect();
    (moments, penalty)
}

/// An operator with `count` equal pieces on nodes of their own.
fn operator<T: crate::cells::CellScalar, const D: usize>(shear: f64, count: usize) -> CutOperator<T, D> {
    let (n, m) = (node_count::<D>(2), node_count::<D>(1));
    let nodes: Vec<u32> = (0..(count * n) as u32).collect();
    let (moments, penalty) = moments::<D>(shear);
    let piece = |k: usize| CutPiece {
        nodes: &nodes[k * n..][..n],
        pressures: &nodes[k * m..][..m],
        body: k as u32,
        origin: origin(),
        edge: EDGE,
        viscous: VISCOUS,
        pressure: PRESSURE,
        volume: &moments.volume,
        normal: &moments.surfaces[0].normal,
        penalty: &penalty,
    };
    let pieces: Vec<CutPiece<'_, D>> = (0..count).map(piece).collect();
    CutOperator::new(pieces.into_iter(), [count * n, count * m, count]).sheared(shear)
}

/// The velocity, twice the strain, the motion of the ball and the pressure at a point.
struct Fields<const D: usize> {
    jump: [f64; D],
    strain: [[f64; D]; D],
    p: f64,
}

fn fields<const D: usize>(shear: f64, x: &[f64], at: &[f64; D]) -> Fields<D> {
    let (n, m) = (node_count::<D>(2), node_count::<D>(1));
    let mut fields = Fields { jump: [0.0; D], strain: [[0.0; D]; D], p: 0.0 };
    for i in 0..n {
        let (shape, mut slope) = (value::<D>(2, i, at), gradient::<D>(2, i, at));
        slope[1] -= shear * slope[0];
        for c in 0..D {
            fields.jump[c] += shape * x[i * D + c];
            for d in 0..D {
                fields.strain[c][d] += slope[d] * x[i * D + c];
                fields.strain[d][c] += slope[d] * x[i * D + c];
            }
        }
    }
    let mut r: [f64; D] = std::array::from_fn(|d| origin::<D>()[d] + EDGE * at[d]);
    r[0] += EDGE * shear * at[1];
    let twist = &x[n * D + m..];
    for c in 0..D {
        let (i, j) = ((c + 1) % 3, (c + 2) % 3);
        let rotation = match D {
            2 => [-twist[2] * r[1], twist[2] * r[0]][c],
            _ => twist[D + i] * r[j] - twist[D + j] * r[i],
        };
        fields.jump[c] -= twist[c] + rotation;
    }
    fields.p = (0..m).map(|i| value::<D>(1, i, at) * x[n * D + i]).sum();
    fields
}

/// `(v, q)^T K (u, p)` by the forms as they are written.
fn form<const D: usize>(shear: f64, u: &[f64], v: &[f64]) -> f64 {
    let (moments, penalty) = moments::<D>(shear);
    let mut sum = 0.0;
    for (q, (at, _)) in gauss_cube::<D>(POINTS).iter().enumerate() {
        let (u, v) = (fields::<D>(shear, u, at), fields::<D>(shear, v, at));
        let (volume, normal) = (moments.volume[q], moments.surfaces[0].normal[q]);
        let [mut viscous, mut coupling] = [0.0; 2];
        for c in 0..D {
            viscous += penalty[q] * u.jump[c] * v.jump[c];
            coupling += normal[c] * (u.p * v.jump[c] + v.p * u.jump[c]);
            coupling -= 0.5 * volume * (u.p * v.strain[c][c] + v.p * u.strain[c][c]);
            for d in 0..D {
                viscous += 0.5 * volume * u.strain[c][d] * v.strain[c][d];
                viscous -= normal[d] * (u.strain[c][d] * v.jump[c] + v.strain[c][d] * u.jump[c]);
            }
        }
        sum += VISCOUS * (viscous + PRESSURE * coupling);
    }
    sum
}

fn random(len: usize, seed: u64) -> Vec<f64> {
    let mut x = vec![0.0; len];
    fill_pseudo_random(seed, &mut x);
    x
}

fn matrix<const D: usize>(operator: &CutOperator<f64, D>, piece: usize) -> Vec<f64> {
    let mut matrix = vec![f64::NAN; slots::<D>().pow(2)];
    operator.matrix(piece, &mut matrix);
    matrix
}

fn the_kernel_takes_the_forms<const D: usize>(shear: f64) {
    let size = slots::<D>();
    let matrix = matrix(&operator::<f64, D>(shear, 3), 2);
    let asymmetry = (0..size * size).map(|k| (matrix[k] - matrix[k % size * size + k / size]).abs());
    assert!(asymmetry.fold(0.0, f64::max) < 1e-12);
    for seed in 0..4 {
        let (u, v) = (random(size, seed), random(size, 10 + seed));
        let product = |row: usize| (0..size).map(|k| matrix[row * size + k] * u[k]).sum::<f64>();
        let found: f64 = (0..size).map(|row| v[row] * product(row)).sum();
        let expected = form::<D>(shear, &u, &v);
        assert!((found - expected).abs() < 1e-11 * expected.abs().max(1.0), "{found} {expected}");
    }
}

/// Products of shape functions give the velocities' part of the matrix.
fn products_give_the_viscous_matrix<const D: usize>(shear: f64) {
    let (moments, _) = moments::<D>(shear);
    let (size, n) = (slots::<D>(), D * node_count::<D>(2));
    let matrix = matrix(&operator::<f64, D>(shear, 1), 0);
    let mut found = vec![f64::NAN; n * n];
    ViscousMatrices::new(shear).fill(&moments, 20.0, VISCOUS, &mut found);
    for (row, found) in found.chunks_exact(n).enumerate() {
        for (found, expected) in found.iter().zip(&matrix[row * size..]) {
            assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{found} {expected}");
        }
    }
}

#[test]
fn viscous_matrices_are_those_of_the_kernel() {
    for shear in SHEARS {
        products_give_the_viscous_matrix::<2>(shear);
        products_give_the_viscous_matrix::<3>(shear);
    }
}

#[test]
fn the_kernel_takes_the_forms_as_they_are_written() {
    for shear in SHEARS {
        the_kernel_takes_the_forms::<2>(shear);
        the_kernel_takes_the_forms::<3>(shear);
    }
}

/// The sweep over more pieces than lanes is the matrix of each.
fn pieces_are_independent<const D: usize>() {
    let (count, n, m, w) = (19, node_count::<D>(2) * D, node_count::<D>(1), twist_len::<D>());
    let operator = operator::<f64, D>(SHEARS[1], count);
    let (x, p) = (random(count * (n + w), 1), random(count * m, 2));
    let (mut y, mut q) = (vec![1.0; x.len()], vec![1.0; p.len()]);
    operator.add([&x, &p], [&mut y, &mut q], &mut Vec::new());
    for piece in [0, 15, 16, 18] {
        let matrix = matrix(&operator, piece);
        let of = |x: &[f64], p: &[f64]| -> Vec<f64> {
            let parts = [&x[piece * n..][..n], &p[piece * m..][..m], &x[count * n + piece * w..][..w]];
            parts.concat()
        };
        let (from, to) = (of(&x, &p), of(&y, &q));
        for (row, to) in matrix.chunks_exact(from.len()).zip(to) {
            let expected = 1.0 + row.iter().zip(&from).map(|(a, x)| a * x).sum::<f64>();
            assert!((to - expected).abs() < 1e-11, "{to} {expected}");
        }
    }
}

#[test]
fn a_sweep_adds_what_the_matrices_give() {
    pieces_are_independent::<2>();
    pieces_are_independent::<3>();
}

fn kernels_agree<T: crate::cells::CellScalar, const D: usize>(tolerance: f64) {
    let operator = operator::<T, D>(SHEARS[1], 16);
    let x: Vec<T> = random(slots::<D>() * 16, 3).into_iter().map(T::from_f64).collect();
    let (mut portable, mut chosen) = (x.clone(), x.clone());
    operator.run::<Portable<T>>(0, &x, &mut portable);
    operator.dispatch(0, &x, &mut chosen);
    for (a, b) in portable.iter().zip(&chosen) {
        assert!((a.to_f64() - b.to_f64()).abs() < tolerance, "{a} {b}");
    }
}

#[test]
fn vector_and_portable_kernels_agree() {
    kernels_agree::<f64, 2>(1e-12);
    kernels_agree::<f64, 3>(1e-12);
    kernels_agree::<f32, 2>(1e-3);
    kernels_agree::<f32, 3>(1e-3);
}
