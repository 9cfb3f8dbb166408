//! Balls that planes cut flat.

use super::*;

/// The unit normal in a random direction.
fn direction<const D: usize>(seed: u64) -> [f64; D] {
    let mut r = vec![0.0; D];
    fill_pseudo_random(seed, &mut r);
    let length = r.iter().map(|x| x * x).sum::<f64>().sqrt();
    std::array::from_fn(|d| r[d] / length)
}

/// One to three flats through random points of the cell, some of them along axes and on faces.
fn flats<const D: usize>(seed: u64, ball: &BallInCell<D>) -> Vec<FlatInCell<D>> {
    let flat = |k: u64| {
        let mut point = [0.0f64; D];
        fill_pseudo_random(1000 + 10 * seed + k, &mut point);
        let axis = (seed + k) as usize % D;
        let normal = match (seed / 4 + k) % 5 {
            0 => std::array::from_fn(|d| if d == axis { point[0].signum() } else { 0.0 }),
            // Nearly along an axis.
            1 => {
                let tilt = [1e-3, 1e-6, 1e-9, 1e-12][(seed / 20 % 4) as usize];
                std::array::from_fn(|d| {
                    if d == axis { (1.0 - tilt * tilt * (D - 1) as f64).sqrt() } else { tilt }
                })
            }
            _ => direction::<D>(7000 + 10 * seed + k),
        };
        let at: [f64; D] = std::array::from_fn(|d| match seed / 8 % 8 {
            // Through a corner.
            3 => (point[d] > 0.0) as u32 as f64,
            _ => 0.5 + 0.5 * point[d],
        });
        // Mostly with the centre of the ball inside.
        let offset = |normal: &[f64; D]| normal.iter().zip(&at).map(|(n, x)| n * x).sum();
        let flat = FlatInCell::new(normal, offset(&normal));
        match flat.distance(ball) < 0.0 && !seed.is_multiple_of(7) {
            true => FlatInCell::new(normal.map(|n| -n), offset(&normal.map(|n| -n))),
            false => flat,
        }
    };
    (0..1 + seed % 3).map(flat).collect()
}

/// Errors of the divergence theorem in ascending order, of those cells that have a surface.
fn errors<const D: usize>(
    count: u64,
    error: impl Fn(u64, &BallInCell<D>, &[FlatInCell<D>]) -> f64,
) -> Vec<f64> {
    let rules = CutRules::new(0.0);
    let mut errors = Vec::new();
    for (seed, ball) in (0..count).zip(balls::<D>(count)) {
        let flats = flats(seed, &ball);
        if rules.inside(&ball, &flats).area.iter().sum::<f64>() > 0.0 {
            errors.push(error(seed, &ball, &flats));
        }
    }
    assert!(2 * errors.len() > count as usize, "most cells are cut");
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn the_divergence_theorem_holds_for_truncated_balls() {
    let all = [errors(2000, error_in_a_square), errors(600, error_in_a_cube)];
    for (errors, [typical, worst]) in all.iter().zip([[1e-13, 1e-11], [1e-11, 1e-8]]) {
        let found = [errors.len() * 9 / 10, errors.len() - 1].map(|k| errors[k]);
        assert!(found[0] < typical && found[1] < worst, "{found:?}");
    }
}

/// Half-spaces about a centre: unit normals and distances.
type Planes<const D: usize> = Vec<([f64; D], f64)>;

/// Volume and surface of a ball cut flat, from the cells of a lattice.
fn measured<const D: usize>(center: [f64; D], radius: f64, planes: &Planes<D>) -> [f64; 2] {
    let (mut volume, mut area) = (0.0, 0.0);
    for cell in 0..8usize.pow(D as u32) {
        let local: [f64; D] = std::array::from_fn(|d| center[d] - (cell / 8usize.pow(d as u32) % 8) as f64);
        let flat = |(normal, distance): &([f64; D], f64)| {
            let offset = distance + normal.iter().zip(&local).map(|(n, c)| n * c).sum::<f64>();
            FlatInCell::new(*normal, offset)
        };
        let flats: Vec<FlatInCell<D>> = planes.iter().map(flat).collect();
        let cut = CutMoments::truncated([(&BallInCell { center: local, radius }, &flats[..])].into_iter());
        volume += 1.0 - cut.fraction();
        area += cut.surfaces[0].area.iter().sum::<f64>();
    }
    [volume, area]
}

/// What a plane at this distance takes from the volume and the surface of a ball.
fn cap<const D: usize>(radius: f64, distance: f64) -> [f64; 2] {
    let square = (radius + distance) * (radius - distance);
    let height = radius - distance;
    let angle = (distance / radius).acos();
    match D {
        2 => {
            let width = 2.0 * square.sqrt();
            [radius * radius * angle - 0.5 * width * distance, 2.0 * radius * angle - width]
        }
        _ => [PI * height * height * (3.0 * radius - height) / 3.0, 2.0 * PI * radius * height - PI * square],
    }
}

fn whole<const D: usize>(radius: f64) -> [f64; 2] {
    match D {
        2 => [PI * radius.powi(2), 2.0 * PI * radius],
        _ => [4.0 / 3.0 * PI * radius.powi(3), 4.0 * PI * radius.powi(2)],
    }
}

fn assert_near(found: [f64; 2], exact: [f64; 2], tolerance: f64, what: &str) {
    let errors = [found[0] - exact[0], found[1] - exact[1]];
    assert!(errors.iter().all(|e| e.abs() < tolerance), "{what}: {errors:?}");
}

/// One cap or two opposite ones less.
fn caps_are_missing<const D: usize>(tolerance: f64) {
    for seed in 0..6 {
        let mut r = vec![0.0; D + 2];
        fill_pseudo_random(seed + 50, &mut r);
        let center: [f64; D] = std::array::from_fn(|d| 4.0 + r[d]);
        let radius = 2.0 + r[D];
        let normal = direction::<D>(seed + 90);
        let distance = radius * (0.5 + 0.49 * r[D + 1]);
        let planes = [(normal, distance), (normal.map(|n| -n), 0.9 * radius)];
        let planes = planes[..1 + seed as usize % 2].to_vec();
        let mut exact = whole::<D>(radius);
        for plane in &planes {
            let less = cap::<D>(radius, plane.1);
            (0..2).for_each(|k| exact[k] -= less[k]);
        }
        assert_near(measured(center, radius, &planes), exact, tolerance, "caps");
    }
}

#[test]
fn a_truncated_ball_lacks_its_caps() {
    caps_are_missing::<2>(1e-12);
    caps_are_missing::<3>(1e-8);
}

/// An octant of a ball, turned: three flats that meet in the centre.
#[test]
fn flats_may_meet() {
    let (radius, a) = (1.9, direction::<3>(3));
    let b = Vector::<3>::from(direction::<3>(4)).cross(&Vector::from(a)).normalize();
    let c = Vector::<3>::from(a).cross(&b);
    let planes = vec![(a, 0.0), (b.into(), 0.0), (c.into(), 0.0)];
    let [volume, area] = whole::<3>(radius);
    let exact = [volume / 8.0, area / 8.0 + 0.75 * PI * radius * radius];
    assert_near(measured([4.2, 4.1, 3.7], radius, &planes), exact, 1e-8, "octant");
}

/// The ball around a cube, cut down to it: six flats, on the faces of cells or not. On faces the surface is
/// that of the cells outside, once.
fn a_cube_is_left<const D: usize>(tolerance: f64) {
    for (center, half) in [(4.0, 2.0), (4.5, 1.5), (4.3, 1.7), (4.1, 1.7), (4.4, 1.3), (4.3 + 1e-12, 1.7)] {
        let plane = |k: usize| {
            let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            (std::array::from_fn(|d| if d == k / 2 { sign } else { 0.0 }), half)
        };
        let planes: Planes<D> = (0..2 * D).map(plane).collect();
        let exact = [(2.0f64 * half).powi(D as i32), 2.0 * D as f64 * (2.0f64 * half).powi(D as i32 - 1)];
        let radius = 1.05 * half * (D as f64).sqrt();
        assert_near(measured([center; D], radius, &planes), exact, tolerance, "cube");
    }
}

#[test]
fn flats_on_faces_of_cells_are_counted_once() {
    a_cube_is_left::<2>(1e-9);
    a_cube_is_left::<3>(1e-8);
}

/// A plane beyond the ball or the cell is none, one that takes the cell away leaves nothing to integrate.
#[test]
fn planes_may_change_nothing_or_all() {
    let ball = BallInCell { center: [1.4, 0.3, 0.8], radius: 1.2 };
    let flat = |offset| FlatInCell::new([0.6, 0.8, 0.0], offset);
    let cut = |flat| CutMoments::truncated([(&ball, &[flat][..])].into_iter());
    let plain = CutMoments::new(&[ball]);
    assert!(cut(flat(1.08 + 1.2 + 1e-9)) == plain && cut(flat(1.4)) == plain);
    assert!(cut(flat(1.39)) != plain);
    let none = cut(flat(-1e-3));
    assert!((none.fraction() - 1.0).abs() < 1e-14 && none.surfaces[0].area.iter().all(|&r| r == 0.0));
}
