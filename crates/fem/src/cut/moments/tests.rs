//! Exact integrals, and the divergence theorem in every cell.

use super::*;

use gluey_geom::Vector;

use super::super::polynomials::{Polynomials, integrals};
use crate::element::gauss;
use gluey_linalg::vector::fill_pseudo_random;
use std::f64::consts::PI;

mod flats;
mod shear;

/// A polynomial of degree 4 in each coordinate, and its derivatives.
struct Polynomial<const D: usize> {
    factors: [[f64; 5]; D],
}

impl<const D: usize> Polynomial<D> {
    fn random(seed: u64) -> Self {
        let mut values = vec![0.0; 5 * D];
        fill_pseudo_random(seed, &mut values);
        Self { factors: std::array::from_fn(|d| std::array::from_fn(|k| values[5 * d + k])) }
    }

    fn value(&self, x: &[f64; D]) -> f64 {
        (0..D).map(|d| self.factor(d, x[d])).product()
    }

    fn derivative(&self, axis: usize, x: &[f64; D]) -> f64 {
        let slope =
            |d: usize| (1..5).map(|k| k as f64 * self.factors[d][k] * x[d].powi(k as i32 - 1)).sum::<f64>();
        (0..D).map(|d| if d == axis { slope(d) } else { self.factor(d, x[d]) }).product()
    }

    fn factor(&self, d: usize, x: f64) -> f64 {
        self.factors[d].iter().rev().fold(0.0, |sum, c| sum * x + c)
    }
}

fn sum<const D: usize>(weights: &[f64], f: impl Fn(&[f64; D]) -> f64) -> f64 {
    gauss_cube::<D>(POINTS).iter().zip(weights).map(|((x, _), w)| w * f(x)).sum()
}

/// Random balls, among them some that just miss, touch or hardly enter faces, edges and corners.
fn balls<const D: usize>(count: u64) -> Vec<BallInCell<D>> {
    let ball = |seed: u64| {
        let mut r = vec![0.0; D + 1];
        fill_pseudo_random(seed + 1, &mut r);
        let center: [f64; D] = std::array::from_fn(|d| 0.5 + 2.0 * r[d]);
        let free = 0.05 + 2.5 * r[D].abs();
        let corner =
            (0..D).map(|d| (center[d] - f64::from((seed >> d & 1) as u32)).powi(2)).sum::<f64>().sqrt();
        let slight = [1e-3, 1e-7, 0.0, -1e-9][(seed / 8 % 4) as usize];
        let face = (center[0] - 1.0).abs();
        let radius = match seed % 4 {
            0 | 1 => free,
            2 => corner + slight,
            _ => face + slight,
        };
        BallInCell { center, radius: radius.max(0.05) }
    };
    (0..count).map(ball).collect()
}

/// Largest error of `int_{K cap B} d_k f = int_{K cap dB} n_k f + int_{F_k1 cap B} f - int_{F_k0 cap B} f` in
/// a square, for a random polynomial.
fn error_in_a_square(seed: u64, ball: &BallInCell<2>, flats: &[FlatInCell<2>]) -> f64 {
    let (rules, polynomials) = (CutRules::<2>::new(0.0), Polynomials::new());
    let f = Polynomial::<2>::random(seed + 77);
    let inside = rules.inside(ball, flats);
    let error = |k: usize| {
        let normal: Vec<f64> = inside.normal.iter().map(|n| n[k]).collect();
        let mut boundary = sum::<2>(&normal, |x| f.value(x));
        for (face, sign) in [(0.0f64, -1.0), (1.0, 1.0)] {
            let [from, to] = chord_of_edge(ball, flats, k, face).map(integrals);
            let mut chord: [f64; POINTS] = std::array::from_fn(|k| to[k] - from[k]);
            polynomials.convert(&mut chord, 1);
            for ((x, _), weight) in gauss(POINTS).into_iter().zip(chord) {
                let at = if k == 0 { [face, x] } else { [x, face] };
                boundary += sign * weight * f.value(&at);
            }
        }
        (sum::<2>(&inside.volume, |x| f.derivative(k, x)) - boundary).abs()
    };
    error(0).max(error(1))
}

/// The part of an edge of the square inside a body.
fn chord_of_edge(ball: &BallInCell<2>, flats: &[FlatInCell<2>], axis: usize, face: f64) -> [f64; 2] {
    let half = (ball.radius.powi(2) - (face - ball.center[axis]).powi(2)).max(0.0).sqrt();
    let c = ball.center[1 - axis];
    let mut chord = [(c - half).max(0.0), (c + half).min(1.0)];
    for flat in flats {
        let (n, rest) = (flat.normal()[1 - axis], flat.offset() - flat.normal()[axis] * face);
        match n {
            n if n > 0.0 => chord[1] = chord[1].min(rest / n),
            n if n < 0.0 => chord[0] = chord[0].max(rest / n),
            _ if rest < 0.0 => chord[1] = chord[0],
            _ => {}
        }
    }
    [chord[0], chord[1].max(chord[0])].map(|x| x.clamp(0.0, 1.0))
}

/// The same in a cube.
fn error_in_a_cube(seed: u64, ball: &BallInCell<3>, flats: &[FlatInCell<3>]) -> f64 {
    let (rules, in_plane) = (CutRules::<3>::new(0.0), CutRules::<2>::new(0.0));
    let f = Polynomial::<3>::random(seed + 77);
    let inside = rules.inside(ball, flats);
    let error = |k: usize| {
        let normal: Vec<f64> = inside.normal.iter().map(|n| n[k]).collect();
        let mut boundary = sum::<3>(&normal, |x| f.value(x));
        let [e, g] = [(k + 1) % 3, (k + 2) % 3];
        for (face, sign) in [(0.0f64, -1.0), (1.0, 1.0)] {
            let Some((disc, lines)) = section(ball, flats, k, face) else { continue };
            let disc = in_plane.inside(&disc, &lines);
            boundary += sign
                * sum::<2>(&disc.volume, |y| {
                    let mut x = [face; 3];
                    (x[e], x[g]) = (y[0], y[1]);
                    f.value(&x)
                });
        }
        (sum::<3>(&inside.volume, |x| f.derivative(k, x)) - boundary).abs()
    };
    (0..3).map(error).fold(0.0, f64::max)
}

/// The part of a face of the cube inside a body.
fn section(
    ball: &BallInCell<3>,
    flats: &[FlatInCell<3>],
    axis: usize,
    face: f64,
) -> Option<(BallInCell<2>, Vec<FlatInCell<2>>)> {
    let axes = [(axis + 1) % 3, (axis + 2) % 3];
    let radius = (ball.radius.powi(2) - (face - ball.center[axis]).powi(2)).max(0.0).sqrt();
    let disc = BallInCell { center: axes.map(|d| ball.center[d]), radius };
    let mut lines = Vec::new();
    for flat in flats {
        let normal = axes.map(|d| flat.normal()[d]);
        let (length, offset) = (normal[0].hypot(normal[1]), flat.offset() - flat.normal()[axis] * face);
        if length > 0.0 {
            lines.push(FlatInCell::new(normal.map(|n| n / length), offset / length));
        } else if offset < 0.0 {
            return None;
        }
    }
    (radius > 0.0).then_some((disc, lines))
}

#[test]
fn the_divergence_theorem_holds_in_a_square() {
    for (seed, ball) in balls::<2>(400).into_iter().enumerate() {
        let error = error_in_a_square(seed as u64, &ball, &[]);
        assert!(error < 1e-11, "{ball:?}: {error:e}");
    }
}

/// The same in a cube, whose faces the ball cuts in discs.
#[test]
fn the_divergence_theorem_holds_in_a_cube() {
    for (seed, ball) in balls::<3>(400).into_iter().enumerate() {
        let error = error_in_a_cube(seed as u64, &ball, &[]);
        assert!(error < 6e-9, "{seed} {ball:?}: {error:e}");
    }
}

/// Volume and surface of a ball from all cells of a lattice, whatever its place.
fn a_ball_is_the_sum_of_its_cells<const D: usize>(exact: impl Fn(f64) -> [f64; 2], tolerance: f64) {
    for seed in 0..20 {
        let mut r = vec![0.0; D + 1];
        fill_pseudo_random(seed + 5, &mut r);
        let center: [f64; D] = std::array::from_fn(|d| if seed < 3 { 4.0 } else { 4.0 + r[d] });
        let radius = if seed < 3 { 1.0 + seed as f64 } else { 0.3 + 2.0 * r[D].abs() };
        let (mut volume, mut area) = (0.0, 0.0);
        for cell in 0..8usize.pow(D as u32) {
            let lower: [f64; D] = std::array::from_fn(|d| (cell / 8usize.pow(d as u32) % 8) as f64);
            let local: [f64; D] = std::array::from_fn(|d| center[d] - lower[d]);
            let cut = CutMoments::new(&[BallInCell { center: local, radius }]);
            volume += 1.0 - cut.fraction();
            area += cut.surfaces[0].area.iter().sum::<f64>();
        }
        let [v, a] = exact(radius);
        let errors = [volume / v - 1.0, area / a - 1.0];
        assert!(errors.iter().all(|e| e.abs() < tolerance), "radius {radius}: {errors:?}");
    }
}

#[test]
fn discs_and_spheres_have_their_volume_and_surface() {
    a_ball_is_the_sum_of_its_cells::<2>(|a| [PI * a * a, 2.0 * PI * a], 9e-14);
    a_ball_is_the_sum_of_its_cells::<3>(|a| [4.0 / 3.0 * PI * a.powi(3), 4.0 * PI * a * a], 4e-12);
}

/// Balls far away leave a cell as it is, a ball around it leaves nothing.
#[test]
fn cells_outside_and_inside_are_whole_and_empty() {
    let moments = |radius| CutMoments::new(&[BallInCell { center: [3.0, 0.5, 0.5], radius }]);
    let (outside, inside) = (moments(1.9), moments(4.0));
    assert!((outside.fraction() - 1.0).abs() < 1e-14 && inside.fraction().abs() < 1e-13);
    assert!(inside.volume.iter().all(|w| w.abs() < 1e-14));
    assert!([outside, inside].iter().all(|cut| cut.surfaces[0].area.iter().all(|&r| r.abs() < 1e-14)));
}
