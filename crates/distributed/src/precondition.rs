//! The block triangular preconditioner of the serial solver: `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`.

use gluey_geom::{Dim, Space};
use gluey_linalg::{Preconditioner, Scalar, vector};

use crate::cycle::VCycle;
use crate::pressures::SharedPressures;
use crate::schur::SchurInverse;

pub struct BlockTriangular<'a, const D: usize> {
    cycle: VCycle<'a, D>,
    pressures: SharedPressures,
    schur: SchurInverse<'a, D>,
    /// At the owned pressures.
    r: Vec<f32>,
    z: Vec<f32>,
    /// At all pressure nodes of the part, and elsewhere.
    p: Vec<f32>,
}

impl<'a, const D: usize> BlockTriangular<'a, D> {
    pub fn new(cycle: VCycle<'a, D>, pressures: SharedPressures, schur: SchurInverse<'a, D>) -> Self {
        let p = vec![0.0; pressures.dim()];
        let [r, z] = [0, 1].map(|_| vec![0.0; pressures.is_free.len()]);
        Self { cycle, pressures, schur, r, z, p }
    }
}

impl<S: Scalar, const D: usize> Preconditioner<S> for BlockTriangular<'_, D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, r: &[S], z: &mut [S]) {
        let Self { cycle, pressures, schur, r: rhs, z: answer, p } = self;
        let top = cycle.levels.len() - 1;
        let level = &mut cycle.levels[top];
        let operator = &mut level.operator;
        let (ru, rp) = r.split_at(operator.space.owned_dim());
        let (zu, zp) = z.split_at_mut(ru.len());
        vector::convert(-1.0, rp, rhs);
        schur.apply(rhs, answer);
        answer.iter_mut().zip(&pressures.is_free).filter(|e| !*e.1).for_each(|(z, _)| *z = 0.0);
        if pressures.has_bridges {
            // Constants are not quite in the kernel then: as in the serial solver pressures have no mean.
            pressures.remove_mean(operator.ranks, answer);
        }
        vector::convert(1.0, answer, zp);
        let owned = operator.space.pressure.owned.clone();
        p[owned].copy_from_slice(answer);
        pressures.plan.update::<f32, 1>(operator.ranks, p);
        pressures.expand(p);
        let map = &operator.space.pressure.map;
        map.distribute(1, |w| w as f32, p);
        operator.cells.gradient(&p[..map.node_count()], &mut operator.y, &mut operator.work);
        operator.gather(&mut level.b);
        vector::residual_from_product(ru, &mut level.b);
        cycle.run();
        vector::convert(1.0, &cycle.levels[top].z, zu);
    }
}
