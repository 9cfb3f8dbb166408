//! Nodes that move with a body: `u = U + w x r`.

use std::ops::Range;

use gluey_fem::NodeMap;
use gluey_geom::{Dim, Spin, Vector};
use gluey_levelset::Body;
use gluey_linalg::Scalar;
use gluey_parallel::Halo;

/// A node that moves with a body, with its arm in units of the body's radius.
#[derive(Clone, Debug)]
pub struct RigidNode<const D: usize> {
    pub node: u32,
    pub body: u32,
    pub arm: Vector<D>,
}

/// The nodes that move with bodies, those named in `solid`.
pub fn rigid_nodes<const D: usize, B: Body<D>>(
    nodes: &NodeMap<D>,
    bodies: &[B],
    solid: &[Option<u32>],
) -> Vec<RigidNode<D>> {
    let usable = |n: &usize| !nodes.is_on_boundary(*n) && !nodes.is_hanging(*n);
    let rigid = |n: usize| {
        solid[n].map(|body| {
            let b = &bodies[body as usize];
            RigidNode { node: n as u32, body, arm: b.arm(&nodes.point(n)) / b.bounding_radius() }
        })
    };
    (0..nodes.node_count()).filter(usable).filter_map(rigid).collect()
}

/// Component `c` of `w x arm`.
pub fn rotation_entry<T: Scalar, const D: usize>(arm: &Vector<D>, c: usize, w: &[T]) -> T {
    let a = |d: usize| T::from_f64(arm[d]);
    match (D, c) {
        (2, 0) => -(w[0] * a(1)),
        (2, _) => w[0] * a(0),
        (_, c) => {
            let (i, j) = ((c + 1) % 3, (c + 2) % 3);
            w[i] * a(j) - w[j] * a(i)
        }
    }
}

/// Adds force and moment of a nodal load to the load on a body.
pub fn add_moment<T: Scalar, const D: usize>(arm: &Vector<D>, f: &[T], load: &mut [T]) {
    let a = |d: usize| T::from_f64(arm[d]);
    for c in 0..D {
        load[c] += f[c];
    }
    if D == 2 {
        load[2] += a(0) * f[1] - a(1) * f[0];
    } else {
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            load[3 + k] += a(i) * f[j] - a(j) * f[i];
        }
    }
}

/// The `D x RIGID` matrix that maps a twist to the velocity at `arm`, row-major.
pub fn rigid_matrix<const D: usize>(arm: &Vector<D>) -> Vec<f64> {
    let n = Dim::<D>::RIGID;
    let mut rows = vec![0.0; D * n];
    for c in 0..D {
        rows[c * n + c] = 1.0;
    }
    for k in 0..Dim::<D>::ROT {
        let mut unit: Spin<D> = Dim::<D>::zero_spin();
        unit[k] = 1.0;
        let velocity = Dim::<D>::cross_spin(&unit, arm);
        for c in 0..D {
            rows[c * n + D + k] = velocity[c];
        }
    }
    rows
}

/// Inverses of sums over the `own` nodes of all ranks.
pub fn gram_inverses<const D: usize>(
    body_count: usize,
    rigid: &[RigidNode<D>],
    own: &Range<usize>,
    halo: &mut Halo,
) -> Vec<Option<Vec<f64>>> {
    let n = Dim::<D>::RIGID;
    let mut grams = vec![0.0; body_count * n * n];
    for r in rigid.iter().filter(|r| own.contains(&(r.node as usize))) {
        let rows = rigid_matrix(&r.arm);
        let gram = &mut grams[r.body as usize * n * n..][..n * n];
        for row in rows.chunks_exact(n) {
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += row[i] * row[j];
                }
            }
        }
    }
    halo.sum(&mut grams);
    grams.chunks_exact(n * n).map(|gram| invert_gram(n, gram)).collect()
}

/// Inverse of a symmetric matrix whose conditioning tells whether the nodes define a rigid motion.
fn invert_gram(n: usize, gram: &[f64]) -> Option<Vec<f64>> {
    const WORST_CONDITION: f64 = 1e6;
    let matrix = nalgebra::DMatrix::from_row_slice(n, n, gram);
    let eigen = matrix.clone().symmetric_eigen().eigenvalues;
    let (least, most) = (eigen.min(), eigen.max());
    if !(least > 0.0 && most / least < WORST_CONDITION) {
        return None;
    }
    matrix.cholesky().map(|c| c.inverse().as_slice().to_vec())
}
