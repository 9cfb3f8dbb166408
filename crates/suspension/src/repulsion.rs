//! Repulsion of round particles that decays with the gap of their surfaces, as that of electric double layers
//! does: `F(g) = F0 s exp(-g / d)` along the line of centres.
//!
//! Surfaces of radii `a`, `b` repel each other in proportion to `s = (2 a b / ((a + b) a_0))^((D-1)/2)`
//! (Derjaguin 1934, DOI 10.1007/BF01433225: spheres, and the same sum over strips of parallel cylinders);
//! for spheres this is the law of Mari, Seto, Morris and Denn (2014, DOI 10.1122/1.4890747). A wall is a
//! surface of infinite radius.

use gluey_contact::Domain;
use gluey_geom::{Matrix, Particle, Vector};

use crate::{Container, for_each_pair};

/// Forces below this part of the one at contact are left out.
const LEAST: f64 = 1e-6;

/// The law: a force between surfaces at a distance.
///
/// ```
/// use gluey_suspension::Repulsion;
/// let repulsion = Repulsion { force: 2.0, range: 0.1, radius: 1.0 };
/// assert_eq!(repulsion.at::<3>(0.0, [1.0, 1.0]), 2.0);
/// assert!((repulsion.at::<3>(0.1, [1.0, 1.0]) - 2.0 / std::f64::consts::E).abs() < 1e-15);
/// // A wall repels twice as much.
/// assert_eq!(repulsion.at::<3>(0.0, [1.0, f64::INFINITY]), 4.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repulsion {
    /// Force `F0` between two particles of the radius `radius` in contact.
    pub force: f64,
    /// Gap `d` in which the force falls to a share of 1/e; a length.
    pub range: f64,
    /// The radius `a_0` that `force` is for.
    pub radius: f64,
}

/// Forces on particles that repel each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Repelled<const D: usize> {
    /// Force on each particle; without walls their sum is zero.
    pub forces: Vec<Vector<D>>,
    /// Sum over pairs of the force on the second times the line from the centre of the first to its own;
    /// minus this over the volume is their stress, tension positive. Walls have no share in it.
    pub moment: Matrix<D>,
}

impl Repulsion {
    /// The force between surfaces of two radii at a gap. Those that overlap repel each other as in contact.
    pub fn at<const D: usize>(&self, gap: f64, [a, b]: [f64; 2]) -> f64 {
        // The harmonic mean of the radii; that of a radius and an infinite one is twice the first.
        let mean = 2.0 / (1.0 / a + 1.0 / b);
        let size = (mean / self.radius).powf(0.5 * (D as f64 - 1.0));
        self.force * size * (-gap.max(0.0) / self.range).exp()
    }

    /// The gap from which on nothing is left of the force but a millionth, which is left out.
    pub fn reach(&self) -> f64 {
        -self.range * LEAST.ln()
    }

    /// Forces between particles, images and walls where they are; at a cost proportional to the number of
    /// particles. Positions need not be wrapped. In a small box particles repel more than one image of each
    /// other, and those of themselves.
    pub fn between<const D: usize>(&self, particles: &[Particle<D>], domain: &Domain<D>) -> Repelled<D> {
        let mut forces = vec![Vector::zeros(); particles.len()];
        let mut moment = Matrix::zeros();
        let centers: Vec<Vector<D>> = particles.iter().map(|particle| particle.pose.position).collect();
        let largest = particles.iter().map(|particle| particle.radius).fold(0.0, f64::max);
        let (reach, container) = (self.reach(), Container::of_lattice(domain.lattice.reduced()));
        for_each_pair(&container, &centers, 2.0 * largest + reach, |pair| {
            let radii = [pair.first, pair.second].map(|particle| particles[particle].radius);
            let distance = pair.arm.norm();
            let gap = distance - radii[0] - radii[1];
            // Equal centres have no line to be pushed along.
            if gap < reach && distance > 0.0 {
                let force = pair.arm * (self.at::<D>(gap, radii) / distance);
                forces[pair.first] -= force;
                forces[pair.second] += force;
                moment += force * pair.arm.transpose();
            }
        });
        for wall in &domain.walls {
            for (particle, force) in particles.iter().zip(&mut forces) {
                let gap = wall.distance(&particle.pose.position) - particle.radius;
                if gap < reach {
                    *force += wall.normal * self.at::<D>(gap, [particle.radius, f64::INFINITY]);
                }
            }
        }
        Repelled { forces, moment }
    }
}

#[cfg(test)]
mod tests {
    use gluey_contact::Wall;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const LAW: Repulsion = Repulsion { force: 3.0, range: 0.02, radius: 0.1 };

    fn particles<const D: usize>(spread: f64) -> Vec<Particle<D>> {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        (0..24)
            .map(|_| {
                let x = Vector::from_fn(|_, _| random.random_range(0.0..spread));
                Particle::new(x, random.random_range(0.05..0.1))
            })
            .collect()
    }

    /// Forces and their moment by a look at every image of every pair.
    fn by_all_pairs<const D: usize>(particles: &[Particle<D>], domain: &Domain<D>) -> Repelled<D> {
        let mut forces = vec![Vector::zeros(); particles.len()];
        let mut moment = Matrix::zeros();
        for (i, a) in particles.iter().enumerate() {
            for (j, b) in particles.iter().enumerate() {
                for number in 0..9_usize.pow(D as u32) {
                    let image = std::array::from_fn(|d| (number / 9_usize.pow(d as u32) % 9) as i32 - 4);
                    let arm = b.pose.position - a.pose.position + domain.lattice.shift(&image);
                    let gap = arm.norm() - a.radius - b.radius;
                    if gap < LAW.reach() && arm.norm() > 0.0 {
                        let force = arm.normalize() * LAW.at::<D>(gap, [a.radius, b.radius]);
                        forces[i] -= force * 0.5;
                        forces[j] += force * 0.5;
                        moment += force * arm.transpose() * 0.5;
                    }
                }
            }
        }
        Repelled { forces, moment }
    }

    fn agrees<const D: usize>() {
        let mut domain = Domain::periodic(&Vector::<D>::repeat(1.0));
        let particles = particles::<D>(1.0);
        for tilt in [0.0, 0.3, -0.6] {
            domain.set_sliding(tilt, 0.0);
            let found = LAW.between(&particles, &domain);
            let exact = by_all_pairs(&particles, &domain);
            let size = exact.forces.iter().map(Vector::norm).fold(0.0, f64::max);
            assert!(size > 0.1);
            for (found, exact) in found.forces.iter().zip(&exact.forces) {
                assert!((found - exact).norm() < 1e-12 * size, "{found} {exact}");
            }
            assert!((found.moment - exact.moment).norm() < 1e-12 * exact.moment.norm());
            assert!((found.moment - found.moment.transpose()).norm() < 1e-12 * found.moment.norm());
            let sum: Vector<D> = found.forces.iter().sum();
            assert!(sum.norm() < 1e-13 * size * 24.0, "{sum}");
        }
    }

    #[test]
    fn forces_are_those_of_all_images_and_sum_to_zero() {
        agrees::<2>();
        agrees::<3>();
    }

    fn is_that_of_images<const D: usize>() {
        let mut domain = Domain::periodic(&Vector::<D>::repeat(1.0));
        domain.set_sliding(0.7, 0.0);
        let here = particles::<D>(3.0);
        let moved: Vec<Particle<D>> = here
            .iter()
            .enumerate()
            .map(|(k, particle)| {
                let image = std::array::from_fn(|d| (k * (d + 2)) as i32 % 5 - 2);
                Particle::new(particle.pose.position + domain.lattice.shift(&image), particle.radius)
            })
            .collect();
        let [a, b] = [here, moved].map(|particles| LAW.between(&particles, &domain));
        let size = a.forces.iter().map(Vector::norm).fold(0.0, f64::max);
        assert!(a.forces.iter().zip(&b.forces).all(|(a, b)| (a - b).norm() < 1e-11 * size));
        assert!((a.moment - b.moment).norm() < 1e-11 * a.moment.norm());
        // So are those of a lattice that has slid by a period.
        domain.set_sliding(1.7, 0.0);
        let c = LAW.between(&particles::<D>(3.0), &domain);
        assert!(a.forces.iter().zip(&c.forces).all(|(a, c)| (a - c).norm() < 1e-11 * size));
    }

    #[test]
    fn images_repel_as_particles_do() {
        is_that_of_images::<2>();
        is_that_of_images::<3>();
    }

    #[test]
    fn sizes_count_as_derjaguin_has_it() {
        let at = |radii| LAW.at::<3>(0.02, radii) * std::f64::consts::E / LAW.force;
        assert!((at([0.1, 0.1]) - 1.0).abs() < 1e-15);
        assert!((at([0.1, 0.3]) - 1.5).abs() < 1e-15);
        assert!((LAW.at::<2>(0.0, [0.1, 0.3]) / LAW.force - 1.5f64.sqrt()).abs() < 1e-15);
        assert!((LAW.at::<2>(0.0, [0.1, f64::INFINITY]) / LAW.force - 2f64.sqrt()).abs() < 1e-15);
        assert_eq!(LAW.at::<2>(-0.05, [0.1, 0.1]), LAW.force);
    }

    #[test]
    fn walls_push_particles_away() {
        let domain = Domain::<2>::default().with_wall(Wall::new(&Vector::zeros(), &Vector::y()));
        let particle = |y| Particle::new(Vector::<2>::new(0.5, y), 0.1);
        let Repelled { forces, moment } = LAW.between(&[particle(0.12), particle(0.9)], &domain);
        assert!((forces[0] - Vector::y() * LAW.force * 2f64.sqrt() / std::f64::consts::E).norm() < 1e-14);
        assert_eq!((forces[1], moment), (Vector::zeros(), Matrix::zeros()));
    }
}
