//! Particles as a picture shows them: brought into a periodic box, with the images that reach into it.

use gluey_geom::{Particle, Vector};
use gluey_suspension::Container;

/// A box whose particles are shown in it, and how fast its images slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownBox<const D: usize> {
    /// The box and its lattice.
    pub container: Container<D>,
    /// Velocity along `x` of the image one period up in `y`, beyond that of its particle.
    pub slide: f64,
}

/// A particle or an image of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown<const D: usize> {
    /// Which particle, from 0.
    pub particle: usize,
    /// Where it is shown.
    pub center: Vector<D>,
    /// How much faster it moves along `x` than where its particle is counted to be.
    pub slide: f64,
    /// Whether it is there beside its particle.
    pub is_image: bool,
}

/// All particles in their order, then the images that reach into the box. Without a box all are where they
/// are.
pub(super) fn shown<const D: usize>(
    particles: &[Particle<D>],
    in_box: Option<&ShownBox<D>>,
) -> Vec<Shown<D>> {
    let places = particles.iter().enumerate().map(|(particle, Particle { pose, .. })| Shown {
        particle,
        center: pose.position,
        slide: 0.0,
        is_image: false,
    });
    let Some(ShownBox { container, slide }) = in_box else { return places.collect() };
    // Tilts that differ by a period are the same lattice.
    let container = container.tilted(container.lattice().reduced().tilt());
    let mut list: Vec<Shown<D>> = places
        .map(|shown| {
            let center = container.wrapped(&shown.center);
            Shown { center, slide: periods_up(&container, &(center - shown.center)) * slide, ..shown }
        })
        .collect();
    for own in 0..particles.len() {
        let Shown { center, slide: of_own, .. } = list[own];
        for (image, center) in container.images_inside(&center, particles[own].radius) {
            let slide = of_own + f64::from(image[1]) * slide;
            list.push(Shown { particle: own, center, slide, is_image: true });
        }
    }
    list
}

/// By how many periods in `y` a displacement leads up.
fn periods_up<const D: usize>(container: &Container<D>, by: &Vector<D>) -> f64 {
    container.lattice().periods()[1].map_or(0.0, |period| (by[1] / period).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever is in the box is covered by a ball that is shown there, and no ball is shown twice.
    fn is_whole<const D: usize>() {
        let container = Container::<D>::periodic(&Vector::from_fn(|d, _| [1.0, 0.8, 1.2][d])).tilted(2.3);
        let in_box = ShownBox { container, slide: 0.5 };
        let number = |k: usize| (0.5 + k as f64 * 0.754_877_666).fract();
        let particles: Vec<Particle<D>> = (0..12)
            .map(|k| Particle::new(Vector::from_fn(|d, _| 6.0 * number(D * k + d) - 3.0), 0.15))
            .collect();
        let list = shown(&particles, Some(&in_box));
        assert!(list.len() > 15 && list[..12].iter().enumerate().all(|(k, shown)| shown.particle == k));
        let distance = |a: &Vector<D>, b: &Vector<D>| container.lattice().nearest(&(a - b)).0.norm();
        for (k, shown) in list.iter().enumerate() {
            assert!(distance(&shown.center, &particles[shown.particle].pose.position) < 1e-12);
            assert!(list[..k].iter().all(|other| (other.center - shown.center).norm() > 1e-3));
            let up = ((shown.center - particles[shown.particle].pose.position)[1] / 0.8).round();
            assert!((shown.slide - 0.5 * up).abs() < 1e-12);
        }
        for k in 0..2000 {
            let place = Vector::<D>::from_fn(|d, _| [1.0, 0.8, 1.2][d] * number(D * k + d + 100));
            let x = container.tilted(0.3).lattice().from_box(&place, 0.0);
            let inside = particles.iter().filter(|ball| distance(&ball.pose.position, &x) < 0.15).count();
            let seen = list.iter().filter(|ball| (ball.center - x).norm() < 0.15).count();
            assert_eq!(seen, inside, "at {x}");
        }
    }

    #[test]
    fn pictures_of_a_sheared_box_are_whole() {
        is_whole::<2>();
        is_whole::<3>();
    }
}
