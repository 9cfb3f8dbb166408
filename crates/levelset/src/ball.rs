//! Level sets of discs and spheres.

use gluey_geom::{Lattice, Vector};

/// A signed distance: positive inside, negative outside.
pub trait LevelSet<const D: usize> {
    /// `alpha(x)`.
    fn value(&self, x: &Vector<D>) -> f64;
}

/// A rigid body immersed in the fluid.
pub trait Body<const D: usize>: LevelSet<D> {
    /// Displacement from the body's reference point to `x` (to the nearest periodic image). In a tilted
    /// lattice `x` is a place in the box without tilt, the displacement one in space.
    fn arm(&self, x: &Vector<D>) -> Vector<D>;
    /// Radius of the smallest ball around the reference point that holds the body.
    fn bounding_radius(&self) -> f64;
}

/// A disc or sphere, repeated with a period where the box is periodic.
///
/// Images may slide along each other: with the tilt of a [`Lattice`] places are those in the box without tilt
/// that shears into space, see [`Lattice::to_box`], and balls are round in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball<const D: usize> {
    center: Vector<D>,
    radius: f64,
    lattice: Lattice<D>,
}

impl<const D: usize> Ball<D> {
    /// A single ball.
    pub fn new(center: Vector<D>, radius: f64) -> Self {
        Self { center, radius, lattice: Lattice::default() }
    }

    /// A ball repeated with the given period in some directions.
    pub fn periodic(center: Vector<D>, radius: f64, period: [Option<f64>; D]) -> Self {
        Self { center, radius, lattice: Lattice::new(period) }
    }

    /// A ball repeated by a lattice, with its centre in the box without tilt.
    pub fn in_lattice(center: Vector<D>, radius: f64, lattice: Lattice<D>) -> Self {
        Self { center, radius, lattice }
    }

    /// A ball at a place in space, repeated by a lattice of any tilt, for a box whose lower border across
    /// `y` is at `origin`. The tilt is reduced to half a period at most, which changes nothing but the box.
    pub fn in_space(place: &Vector<D>, radius: f64, lattice: &Lattice<D>, origin: f64) -> Self {
        let lattice = lattice.reduced();
        Self { center: lattice.to_box(place, origin), radius, lattice }
    }

    /// Centre, in the box without tilt.
    pub fn center(&self) -> &Vector<D> {
        &self.center
    }

    /// Calls `visit(arm)` for all images whose surface is no farther than `reach` from a place in the box,
    /// with the displacements from their centres.
    pub fn for_each_image(&self, x: &Vector<D>, reach: f64, mut visit: impl FnMut(&Vector<D>)) {
        let (nearest, farthest) = (self.arm(x), self.radius + reach);
        // No two images of a point are nearer to each other than the shortest period.
        if self.period().iter().flatten().all(|period| 2.0 * farthest < *period) {
            if nearest.norm() <= farthest {
                visit(&nearest);
            }
            return;
        }
        self.lattice.reduced().for_each_within(&nearest, farthest, |_, arm| visit(arm));
    }

    /// An image of a displacement in the box: the one within half a period along each axis, in space.
    fn image_of(&self, arm: &Vector<D>) -> Vector<D> {
        let mut image =
            Vector::from_fn(|d, _| if d == 0 { arm[d] } else { nearest_image(arm[d], self.period()[d]) });
        image[0] = nearest_image(image[0] + self.lattice.shear() * image[1], self.period()[0]);
        image
    }

    /// Period along each axis, where there is one.
    pub fn period(&self) -> &[Option<f64>; D] {
        self.lattice.periods()
    }

    /// The translations that repeat it.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }
}

impl<const D: usize> LevelSet<D> for Ball<D> {
    fn value(&self, x: &Vector<D>) -> f64 {
        self.radius - self.arm(x).norm()
    }
}

impl<const D: usize> Body<D> for Ball<D> {
    fn arm(&self, x: &Vector<D>) -> Vector<D> {
        let arm = x - self.center;
        let shear = self.lattice.shear();
        if shear == 0.0 {
            return Vector::from_fn(|d, _| nearest_image(arm[d], self.period()[d]));
        }
        self.lattice.nearest_of_rows(&self.image_of(&arm)).0
    }

    fn bounding_radius(&self) -> f64 {
        self.radius
    }
}

/// The shortest image of a distance along an axis that may be periodic.
pub fn nearest_image(distance: f64, period: Option<f64>) -> f64 {
    match period {
        Some(length) => distance - length * (distance / length).round(),
        None => distance,
    }
}

/// The body with the largest level set at `x`, and its value: `max_i alpha_i(x)`. Of equals, the first. Asks
/// all of them: for many bodies there is [`crate::BallTree`].
pub fn nearest<const D: usize, B: LevelSet<D>>(bodies: &[B], x: &Vector<D>) -> Option<(usize, f64)> {
    let values = bodies.iter().map(|b| b.value(x)).enumerate();
    values.reduce(|best, next| if next.1 > best.1 { next } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_periodic_ball_is_seen_across_the_border() {
        let ball = Ball::periodic(Vector::<2>::new(0.02, 0.5), 0.05, [Some(1.0), None]);
        let x = Vector::<2>::new(0.99, 0.5);
        assert!((ball.value(&x) - 0.02).abs() < 1e-14);
        assert!((ball.arm(&x)[0] + 0.03).abs() < 1e-14);
        assert!(ball.value(&Vector::<2>::new(0.02, 0.99)) < -0.4);
    }

    #[test]
    fn a_sheared_ball_is_seen_across_all_borders() {
        let lattice = Lattice::<3>::new([Some(1.0); 3]).tilted(0.4);
        let (place, at) = (Vector::<3>::new(0.9, 0.97, 0.01), Vector::<3>::new(0.2, 0.02, 0.97));
        let ball = Ball::in_lattice(lattice.to_box(&place, 0.0), 0.1, lattice);
        let arm = ball.arm(&lattice.to_box(&at, 0.0));
        assert!((arm - lattice.nearest(&(at - place)).0).norm() < 1e-15);
        // Up by 0.05 across a border whose image is 0.4 further along x.
        assert!((arm - Vector::<3>::new(-0.3, 0.05, -0.04)).norm() < 1e-14, "{arm:?}");
    }

    /// The nearest image, and all that are near, of a loop over many.
    #[test]
    fn images_are_those_of_a_loop() {
        for trial in 0..400u32 {
            let number = |k: u32| f64::from((trial * 7919 + k * 104_729) % 1000) / 1000.0;
            let length = [1.0, 6.4, 0.2][trial as usize % 3];
            let lattice = Lattice::<2>::new([Some(length), Some(0.8)]).tilted((number(1) - 0.5) * length);
            let center = Vector::<2>::new(number(2) * length, number(3));
            let x = Vector::<2>::new(number(4) * length, number(5));
            let ball = Ball::in_lattice(center, 0.1, lattice);
            let arm = lattice.from_box(&x, 0.0) - lattice.from_box(&center, 0.0);
            let images = (-9..=9).flat_map(|i| (-9..=9).map(move |j| [i, j]));
            let mut norms: Vec<f64> = images.map(|image| (arm + lattice.shift(&image)).norm()).collect();
            norms.sort_by(f64::total_cmp);
            assert!((ball.arm(&x).norm() - norms[0]).abs() < 1e-14);
            for reach in [0.05, 0.3, 0.9] {
                let mut found = Vec::new();
                ball.for_each_image(&x, reach, |arm| found.push(arm.norm()));
                found.sort_by(f64::total_cmp);
                let near: Vec<f64> = norms.iter().copied().take_while(|norm| *norm <= 0.1 + reach).collect();
                assert_eq!(found.len(), near.len());
                assert!(found.iter().zip(&near).all(|(a, b)| (a - b).abs() < 1e-13));
            }
        }
    }

    #[test]
    fn the_nearest_body_has_the_largest_level_set() {
        let balls = [0.2, 0.6].map(|x| Ball::new(Vector::<3>::repeat(x), 0.1));
        let (body, alpha) = nearest(&balls, &Vector::<3>::repeat(0.59)).unwrap();
        assert_eq!(body, 1);
        assert!((alpha - (0.1 - 0.01 * 3f64.sqrt())).abs() < 1e-14);
        assert!(nearest::<3, Ball<3>>(&[], &Vector::zeros()).is_none());
    }
}
