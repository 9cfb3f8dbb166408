//! Level sets of discs and spheres.

use gluey_geom::Vector;

/// A signed distance: positive inside, negative outside.
pub trait LevelSet<const D: usize> {
    /// `alpha(x)`.
    fn value(&self, x: &Vector<D>) -> f64;
}

/// A rigid body immersed in the fluid.
pub trait Body<const D: usize>: LevelSet<D> {
    /// Displacement from the body's reference point to `x` (to the nearest periodic image).
    fn arm(&self, x: &Vector<D>) -> Vector<D>;
    /// Radius of the smallest ball around the reference point that holds the body.
    fn bounding_radius(&self) -> f64;
}

/// A disc or sphere, repeated with a period where the box is periodic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball<const D: usize> {
    center: Vector<D>,
    radius: f64,
    period: [Option<f64>; D],
}

impl<const D: usize> Ball<D> {
    /// A single ball.
    pub fn new(center: Vector<D>, radius: f64) -> Self {
        Self { center, radius, period: [None; D] }
    }

    /// A ball repeated with the given period in some directions.
    pub fn periodic(center: Vector<D>, radius: f64, period: [Option<f64>; D]) -> Self {
        Self { center, radius, period }
    }

    /// Centre.
    pub fn center(&self) -> &Vector<D> {
        &self.center
    }

    /// Period along each axis, where there is one.
    pub fn period(&self) -> &[Option<f64>; D] {
        &self.period
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
        Vector::from_fn(|d, _| nearest_image(arm[d], self.period[d]))
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
    fn the_nearest_body_has_the_largest_level_set() {
        let balls = [0.2, 0.6].map(|x| Ball::new(Vector::<3>::repeat(x), 0.1));
        let (body, alpha) = nearest(&balls, &Vector::<3>::repeat(0.59)).unwrap();
        assert_eq!(body, 1);
        assert!((alpha - (0.1 - 0.01 * 3f64.sqrt())).abs() < 1e-14);
        assert!(nearest::<3, Ball<3>>(&[], &Vector::zeros()).is_none());
    }
}
