//! Profiles across the box: volume fraction and velocity of the particles in slabs.

use std::f64::consts::PI;

use gluey_geom::Vector;

use crate::Container;

/// A slab of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab<const D: usize> {
    /// Middle of the slab along the axis of the profile.
    pub middle: f64,
    /// Volume of the particles over that of the slab.
    pub fraction: f64,
    /// Mean velocity of the centres of the particles, weighted by their volumes in the slab; none without
    /// any.
    pub velocity: Option<Vector<D>>,
}

/// Volume fraction and velocity in slabs across an axis. The volumes of balls in slabs are exact.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile<const D: usize> {
    axis: usize,
    /// Volumes of particles and volumes times velocities.
    sums: Vec<(f64, Vector<D>)>,
    lower: f64,
    width: f64,
    /// Volume of all configurations added.
    volume: f64,
}

impl<const D: usize> Profile<D> {
    /// Slabs of equal width across `axis`.
    pub fn new(container: &Container<D>, axis: usize, slab_count: usize) -> Self {
        let (bounds, count) = (container.bounds(), slab_count.max(1));
        let (lower, edge) = (bounds.lower[axis], bounds.extent()[axis]);
        Self {
            axis,
            sums: vec![(0.0, Vector::zeros()); count],
            lower,
            width: edge / count as f64,
            volume: 0.0,
        }
    }

    /// Adds one configuration; one velocity for each particle. Where the box is periodic across the slabs
    /// particles may be anywhere, and an image one period up moves with `slide` more.
    pub fn add(
        &mut self,
        container: &Container<D>,
        positions: &[Vector<D>],
        radii: &[f64],
        velocities: &[Vector<D>],
        slide: &Vector<D>,
    ) {
        self.volume += container.volume();
        let slide = (!container.is_walled(self.axis)).then_some(slide);
        for ((x, &radius), velocity) in positions.iter().zip(radii).zip(velocities) {
            self.add_ball((x[self.axis] - self.lower) / self.width, radius, velocity, slide);
        }
    }

    /// Adds a ball whose centre is `at` slabs above the lower end.
    fn add_ball(&mut self, at: f64, radius: f64, velocity: &Vector<D>, slide: Option<&Vector<D>>) {
        let (reach, count) = (radius / self.width, self.sums.len() as i64);
        let below = |height: i64| volume_below::<D>((height as f64 - at) * self.width, radius);
        for slab in (at - reach).floor() as i64..=(at + reach).floor() as i64 {
            let volume = below(slab + 1) - below(slab);
            let (place, velocity) = match slide {
                Some(slide) => (slab.rem_euclid(count), velocity - slide * slab.div_euclid(count) as f64),
                None => (slab, *velocity),
            };
            if let Some(sum) = usize::try_from(place).ok().and_then(|place| self.sums.get_mut(place)) {
                sum.0 += volume;
                sum.1 += velocity * volume;
            }
        }
    }

    /// The slabs, averaged over all configurations.
    pub fn slabs(&self) -> Vec<Slab<D>> {
        let slab_volume = self.volume / self.sums.len() as f64;
        let slab = |(slab, (volume, moved)): (usize, &(f64, Vector<D>))| Slab {
            middle: self.lower + (slab as f64 + 0.5) * self.width,
            fraction: if slab_volume > 0.0 { volume / slab_volume } else { 0.0 },
            velocity: (*volume > 0.0).then(|| moved / *volume),
        };
        self.sums.iter().enumerate().map(slab).collect()
    }
}

/// Volume of the part of a ball at most `height` above its centre.
fn volume_below<const D: usize>(height: f64, radius: f64) -> f64 {
    let u = (height / radius).clamp(-1.0, 1.0);
    match D {
        2 => radius * radius * (0.5 * PI + u.asin() + u * (1.0 - u * u).max(0.0).sqrt()),
        _ => PI * radius.powi(3) * (2.0 / 3.0 + u - u.powi(3) / 3.0),
    }
}

#[cfg(test)]
mod tests {
    use gluey_geom::Aabb;

    use super::*;
    use gluey_geom::ball_volume;

    fn check<const D: usize>() {
        for is_periodic in [true, false] {
            let container = Container::<D>::new(Aabb::unit(), [is_periodic; D]);
            let mut profile = Profile::new(&container, 1, 7);
            // The second crosses the border where there is one to cross.
            let heights = [0.4, if is_periodic { 0.95 } else { 0.8 }];
            let positions = heights.map(|y| Vector::<D>::from_fn(|d, _| if d == 1 { y } else { 0.5 }));
            let velocities = [1.0, 3.0].map(Vector::repeat);
            profile.add(&container, &positions, &[0.1, 0.2], &velocities, &Vector::zeros());
            let slabs = profile.slabs();
            let fraction = slabs.iter().map(|slab| slab.fraction).sum::<f64>() / 7.0;
            let volume = ball_volume::<D>(0.1) + ball_volume::<D>(0.2);
            assert!((fraction - volume).abs() < 1e-14, "{D}D: {fraction}");
            let velocity = |slab: usize| slabs[slab].velocity.map(|velocity| velocity[0]);
            assert_eq!((velocity(2), velocity(5)), (Some(1.0), Some(3.0)));
            assert_eq!(velocity(1).is_none(), !is_periodic, "{slabs:?}");
            assert_eq!(slabs[0].fraction > 0.0, is_periodic);
        }
    }

    #[test]
    fn no_volume_is_lost() {
        check::<2>();
        check::<3>();
    }

    /// Particles that follow a linear shear, wherever they have got to.
    #[test]
    fn images_move_with_the_row_they_are_in() {
        let container = Container::<2>::periodic(&Vector::repeat(1.0));
        let mut profile = Profile::new(&container, 1, 4);
        let positions = [0.1, 3.3, -1.4, 2.98].map(|y| Vector::<2>::new(0.5, y));
        let velocities = positions.map(|x| Vector::<2>::new(2.0 * x[1], 0.0));
        profile.add(&container, &positions, &[0.05; 4], &velocities, &Vector::<2>::new(2.0, 0.0));
        let slabs = profile.slabs();
        let middle = |slab: usize| slabs[slab].velocity.expect("particles")[0];
        assert!((middle(1) - 0.6).abs() < 1e-12 && (middle(2) - 1.2).abs() < 1e-12, "{slabs:?}");
        // The last one reaches into the first slab, where its image below is.
        let upper = volume_below::<2>(0.02, 0.05) / ball_volume::<2>(0.05);
        let lower = 1.0 - upper;
        assert!((middle(3) - 1.96).abs() < 1e-12, "{slabs:?}");
        assert!((middle(0) - (0.2 - 0.04 * lower) / (1.0 + lower)).abs() < 1e-12, "{slabs:?}");
    }

    #[test]
    fn half_a_ball_is_below_its_centre() {
        assert!((volume_below::<3>(0.0, 2.0) - 0.5 * ball_volume::<3>(2.0)).abs() < 1e-14);
        assert!((volume_below::<2>(0.0, 2.0) - 0.5 * ball_volume::<2>(2.0)).abs() < 1e-14);
    }
}
