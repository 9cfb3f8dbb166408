//! The bodies' entries of reduced vectors: twists, forces and torques, and twists that are data.

use gluey_geom::{Dim, Twist, Wrench};
use gluey_linalg::Scalar;

use super::VelocitySpace;

impl<const D: usize> VelocitySpace<D> {
    /// The twist of a body in a reduced vector.
    pub fn twist<T: Scalar>(&self, x: &[T], body: usize) -> Twist<D> {
        let entries = &x[self.full_dim() + body * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
        let mut twist = Twist::default();
        for c in 0..D {
            twist.velocity[c] = entries[c].to_f64();
        }
        for k in 0..Dim::<D>::ROT {
            twist.spin[k] = entries[D + k].to_f64() / self.radius[body];
        }
        twist
    }

    /// Writes the twist of a body into a reduced vector.
    pub fn set_twist<T: Scalar>(&self, x: &mut [T], body: usize, twist: &Twist<D>) {
        let entries = &mut x[self.full_dim() + body * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
        for c in 0..D {
            entries[c] = T::from_f64(twist.velocity[c]);
        }
        for k in 0..Dim::<D>::ROT {
            entries[D + k] = T::from_f64(twist.spin[k] * self.radius[body]);
        }
    }

    /// Adds force and torque on a body to a reduced load. What does the work on `s w` is the torque over `s`.
    pub fn add_wrench(&self, load: &mut [f64], body: usize, wrench: &Wrench<D>) {
        let rows = &mut load[self.full_dim() + body * Dim::<D>::RIGID..][..Dim::<D>::RIGID];
        for c in 0..D {
            rows[c] += wrench.force[c];
        }
        for k in 0..Dim::<D>::ROT {
            rows[D + k] += wrench.torque[k] / self.radius[body];
        }
    }

    /// Force and torque on a body in a reduced load.
    pub fn wrench(&self, load: &[f64], body: usize) -> Wrench<D> {
        self.wrench_of(&load[self.full_dim() + body * Dim::<D>::RIGID..][..Dim::<D>::RIGID], body)
    }

    /// Force and torque on a body from its rows of a reduced load.
    pub fn wrench_of(&self, rows: &[f64], body: usize) -> Wrench<D> {
        let mut wrench = Wrench::<D>::default();
        wrench.force.copy_from_slice(&rows[..D]);
        for k in 0..Dim::<D>::ROT {
            wrench.torque[k] = rows[D + k] * self.radius[body];
        }
        wrench
    }

    /// Makes the twists of these bodies, of all, data, which are zero in reduced vectors, and those of the
    /// others unknowns; no entries stand for none. Vectors keep their length and maps what they do, but for
    /// projections, which leave twists that are data at zero; operators and solvers leave out their rows and
    /// columns.
    pub fn hold(&mut self, held: &[bool]) {
        let held = if held.contains(&true) { held } else { &[] };
        self.held = self.discretisation.near(held);
        self.held_of_all = held.to_vec();
    }

    /// Which bodies have twists that are data; no entries where none has.
    pub fn held(&self) -> &[bool] {
        &self.held
    }

    /// The same of all bodies, where the mesh is a part.
    pub fn held_of_all(&self) -> &[bool] {
        &self.held_of_all
    }

    /// Whether the twist of a body is data.
    pub fn is_held(&self, body: usize) -> bool {
        self.held.get(body) == Some(&true)
    }

    /// Whether the twist of any body is data.
    pub fn holds_any(&self) -> bool {
        !self.held_of_all.is_empty()
    }

    /// Clears the twists of a reduced vector where they are data.
    pub fn clear_held<T: Scalar>(&self, x: &mut [T]) {
        let twists = x[self.full_dim()..self.dim()].chunks_exact_mut(Dim::<D>::RIGID);
        for (twist, _) in twists.zip(&self.held).filter(|(_, held)| **held) {
            twist.fill(T::ZERO);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::space;
    use super::*;
    use gluey_geom::{Spin, Vector};

    #[test]
    fn twists_survive_storage() {
        let space = space::<3>();
        let twist = Twist { velocity: Vector::<3>::new(1.0, 2.0, 3.0), spin: Spin::<3>::new(-0.5, 0.1, 0.2) };
        let mut x = vec![0.0; space.dim()];
        space.set_twist(&mut x, 1, &twist);
        let back = space.twist(&x, 1);
        assert!((back.velocity - twist.velocity).norm() + (back.spin - twist.spin).norm() < 1e-15);
        space.expand(&mut x);
        let rim = (0..space.nodes().node_count()).find(|&n| space.body_of(n) == Some(1)).unwrap();
        let arm = space.nodes().point(rim) - Vector::<3>::repeat(0.7);
        let want = twist.velocity_at(&arm);
        assert!((0..3).all(|c| (x[rim * 3 + c] - want[c]).abs() < 1e-14));
    }

    /// The load of a wrench does the work of the wrench.
    fn wrenches_work<const D: usize>() {
        let space = space::<D>();
        let (mut twist, mut wrench) = (Twist::default(), Wrench::default());
        twist.velocity = Vector::<D>::from_fn(|d, _| 0.3 - d as f64);
        wrench.force = Vector::<D>::from_fn(|d, _| 1.0 + d as f64);
        for k in 0..Dim::<D>::ROT {
            (twist.spin[k], wrench.torque[k]) = (0.7 + k as f64, -0.4 * k as f64 + 2.0);
        }
        let (mut x, mut load) = (vec![0.0; space.dim()], vec![0.0; space.dim()]);
        space.set_twist(&mut x, 1, &twist);
        space.add_wrench(&mut load, 1, &wrench);
        let work: f64 = x.iter().zip(&load).map(|(x, f)| x * f).sum();
        assert!((work - wrench.power(&twist)).abs() < 1e-14);
        let back = space.wrench(&load, 1) - wrench;
        assert!(
            back.force.amax() < 1e-15 && Dim::<D>::spin_slice(&back.torque).iter().all(|t| t.abs() < 1e-15)
        );
    }

    #[test]
    fn loads_of_wrenches_do_their_work() {
        wrenches_work::<2>();
        wrenches_work::<3>();
    }
}
