//! Nodes that move with bodies.

use gluey_linalg::Scalar;

/// A node that moves with a body: `u = U + w x arm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidNode<T, const D: usize> {
    /// The node.
    pub node: u32,
    /// The body.
    pub body: u32,
    /// From the reference point of the body to the node, in the unit of length that the spin is scaled with.
    pub arm: [T; D],
}

impl<T: Scalar, const D: usize> RigidNode<T, D> {
    /// `u = U + w x arm`, in the first `D` places.
    #[inline(always)]
    pub fn set_velocity<X: Scalar>(&self, twist: &[X], u: &mut [T; 4]) {
        let a = &self.arm;
        let entry = |k: usize| T::from_f64(twist[k].to_f64());
        (0..D).for_each(|c| u[c] = entry(c));
        if D == 2 {
            u[0] += -(entry(D) * a[1]);
            u[1] += entry(D) * a[0];
        } else {
            for c in 0..D {
                let (i, j) = ((c + 1) % D, (c + 2) % D);
                u[c] += entry(D + i) * a[j] - entry(D + j) * a[i];
            }
        }
    }

    /// Adds the force and its moment `arm x f`.
    #[inline(always)]
    pub fn add_moment<X: Scalar>(&self, f: &[T; D], load: &mut [X]) {
        let a = &self.arm;
        let mut add = |k: usize, value: T| load[k] += X::from_f64(value.to_f64());
        (0..D).for_each(|c| add(c, f[c]));
        if D == 2 {
            add(2, a[0] * f[1] - a[1] * f[0]);
        } else {
            for k in 0..D {
                let (i, j) = ((k + 1) % D, (k + 2) % D);
                add(D + k, a[i] * f[j] - a[j] * f[i]);
            }
        }
    }
}
