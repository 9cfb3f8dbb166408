//! Sheared cells see the balls that cubes see.

use super::*;

/// Half-spaces about a centre: unit normals and distances.
type Planes<const D: usize> = Vec<([f64; D], f64)>;

/// A polynomial of degree 4 in all coordinates together.
fn quartic<const D: usize>(x: &[f64; D]) -> f64 {
    let linear = |a: f64| x.iter().zip(0u8..).map(|(x, k)| x * (a * f64::from(k + 1)).sin()).sum::<f64>();
    (0.3 + linear(1.3)) * (0.7 + linear(2.1)) * (linear(3.7) - 0.2) * (1.0 + linear(5.9))
}

/// Integrals of the polynomial over a ball cut flat, over its surface and over that times the normal, by the
/// cells of a lattice of edge `h` with this shear.
fn integrals<const D: usize>(shear: f64, center: [f64; D], radius: f64, planes: &Planes<D>) -> Vec<f64> {
    let (h, count) = (0.25, 14usize);
    let place = |xi: [f64; D]| -> [f64; D] {
        std::array::from_fn(|d| h * if d == 0 { xi[0] + shear * xi[1] } else { xi[d] })
    };
    let mut sums = vec![0.0; 2 + D];
    let rule = gauss_cube::<D>(POINTS);
    for cell in 0..count.pow(D as u32) {
        let lower: [f64; D] =
            std::array::from_fn(|d| (cell / count.pow(d as u32) % count) as f64 - 0.5 * count as f64);
        let mut at: [f64; D] = std::array::from_fn(|d| center[d] / h);
        at[0] -= shear * at[1];
        let ball = BallInCell { center: std::array::from_fn(|d| at[d] - lower[d]), radius: radius / h };
        let flat = |(normal, distance): &([f64; D], f64)| {
            let mut m = *normal;
            m[1] += shear * m[0];
            let offset = distance / h + m.iter().zip(&ball.center).map(|(m, c)| m * c).sum::<f64>();
            FlatInCell::new(m, offset)
        };
        let flats: Vec<FlatInCell<D>> = planes.iter().map(flat).collect();
        let cut = CutMoments::sheared(shear, [(&ball, &flats[..])].into_iter());
        for (q, (xi, weight)) in rule.iter().enumerate() {
            let f = quartic(&place(std::array::from_fn(|d| lower[d] + xi[d])));
            sums[0] += (weight - cut.volume[q]) * f * h.powi(D as i32);
            sums[1] += cut.surfaces[0].area[q] * f * h.powi(D as i32 - 1);
            (0..D).for_each(|d| sums[2 + d] += cut.surfaces[0].normal[q][d] * f * h.powi(D as i32 - 1));
        }
    }
    sums
}

fn shear_changes_nothing<const D: usize>(tolerance: f64) {
    let unit = |seed: u64| {
        let mut r = vec![0.0; D];
        fill_pseudo_random(seed, &mut r);
        let length = r.iter().map(|x| x * x).sum::<f64>().sqrt();
        std::array::from_fn(|d| r[d] / length)
    };
    for seed in 0..6 {
        let mut r = vec![0.0; D + 1];
        fill_pseudo_random(seed + 31, &mut r);
        let (center, radius) = (std::array::from_fn(|d| 0.3 * r[d]), 0.5 + 0.2 * r[D]);
        let planes: Planes<D> = match seed % 3 {
            0 => Vec::new(),
            1 => vec![(unit(seed), 0.8 * radius)],
            _ => vec![(unit(seed), 0.9 * radius), (unit(seed + 9), 0.7 * radius)],
        };
        let straight = integrals(0.0, center, radius, &planes);
        for shear in [0.5, -0.31, 0.07] {
            let found = integrals(shear, center, radius, &planes);
            for (found, expected) in found.iter().zip(&straight) {
                assert!((found - expected).abs() < tolerance, "{seed} {shear}: {found} {expected}");
            }
        }
    }
}

#[test]
fn integrals_over_balls_do_not_depend_on_the_shear_of_cells() {
    shear_changes_nothing::<2>(1e-12);
    shear_changes_nothing::<3>(1e-8);
}

/// A half-space that ends on faces of sheared cells takes nothing from those on its inner side, and its
/// border belongs to the others.
#[test]
fn flats_on_faces_of_sheared_cells_are_counted_once() {
    let shear = 0.4;
    let m = [1.0 / f64::hypot(1.0, shear), 0.0];
    let ball = |x: f64| BallInCell { center: [x, 0.5], radius: 3.0 };
    let area = |x: f64| {
        let ball = ball(x);
        let flat = FlatInCell::new(m, m[0] * (x + 1.0));
        let cut = CutMoments::sheared(shear, [(&ball, &[flat][..])].into_iter());
        cut.surfaces[0].area.iter().sum::<f64>()
    };
    // The border is the lower face of the one cell, the upper face of the other.
    assert!((area(-1.0) - f64::hypot(1.0, shear)).abs() < 1e-13 && area(0.0).abs() < 1e-13);
}
