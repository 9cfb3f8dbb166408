//! Forces of particles that repel each other ([`Repulsion`]), images and walls included.

use gluey_contact::{Domain, Repulsion};
use gluey_geom::{Matrix, Particle, Vector};

use crate::{Container, for_each_pair};

/// Forces on particles that repel each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Repelled<const D: usize> {
    /// Force on each particle; without walls their sum is zero.
    pub forces: Vec<Vector<D>>,
    /// Sum over pairs of the force on the second times the line from the centre of the first to its own;
    /// minus this over the volume is their stress, tension positive. Walls have no share in it.
    pub moment: Matrix<D>,
}

/// Forces between particles, images and walls where they are; at a cost proportional to the number of
/// particles. Positions need not be wrapped. In a small box particles repel more than one image of each
/// other, and those of themselves.
pub fn repelled<const D: usize>(
    law: &Repulsion,
    particles: &[Particle<D>],
    domain: &Domain<D>,
) -> Repelled<D> {
    let mut forces = vec![Vector::zeros(); particles.len()];
    let mut moment = Matrix::zeros();
    let centers: Vec<Vector<D>> = particles.iter().map(|particle| particle.pose.position).collect();
    let largest = particles.iter().map(|particle| particle.radius).fold(0.0, f64::max);
    let (reach, container) = (law.reach(), Container::of_lattice(domain.lattice.reduced()));
    for_each_pair(&container, &centers, 2.0 * largest + reach, |pair| {
        let radii = [pair.first, pair.second].map(|particle| particles[particle].radius);
        let distance = pair.arm.norm();
        let gap = distance - radii[0] - radii[1];
        // Equal centres have no line to be pushed along.
        if gap < reach && distance > 0.0 {
            let force = pair.arm * (law.at::<D>(gap, radii) / distance);
            forces[pair.first] -= force;
            forces[pair.second] += force;
            moment += force * pair.arm.transpose();
        }
    });
    for wall in &domain.walls {
        for (particle, force) in particles.iter().zip(&mut forces) {
            let gap = wall.distance(&particle.pose.position) - particle.radius;
            if gap < reach {
                *force += wall.normal * law.at::<D>(gap, [particle.radius, f64::INFINITY]);
            }
        }
    }
    Repelled { forces, moment }
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
            let found = repelled(&LAW, &particles, &domain);
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
        let [a, b] = [here, moved].map(|particles| repelled(&LAW, &particles, &domain));
        let size = a.forces.iter().map(Vector::norm).fold(0.0, f64::max);
        assert!(a.forces.iter().zip(&b.forces).all(|(a, b)| (a - b).norm() < 1e-11 * size));
        assert!((a.moment - b.moment).norm() < 1e-11 * a.moment.norm());
        // So are those of a lattice that has slid by a period.
        domain.set_sliding(1.7, 0.0);
        let c = repelled(&LAW, &particles::<D>(3.0), &domain);
        assert!(a.forces.iter().zip(&c.forces).all(|(a, c)| (a - c).norm() < 1e-11 * size));
    }

    #[test]
    fn images_repel_as_particles_do() {
        is_that_of_images::<2>();
        is_that_of_images::<3>();
    }

    #[test]
    fn walls_push_particles_away() {
        let domain = Domain::<2>::default().with_wall(Wall::new(&Vector::zeros(), &Vector::y()));
        let particle = |y| Particle::new(Vector::<2>::new(0.5, y), 0.1);
        let Repelled { forces, moment } = repelled(&LAW, &[particle(0.12), particle(0.9)], &domain);
        assert!((forces[0] - Vector::y() * LAW.force * 2f64.sqrt() / std::f64::consts::E).norm() < 1e-14);
        assert_eq!((forces[1], moment), (Vector::zeros(), Matrix::zeros()));
    }
}
