//! The block triangular preconditioner of the serial solver: `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`,
//! with the lumped mass over the viscosity for the Schur complement `S`.

use gluey_linalg::Preconditioner;

use crate::cycle::VCycle;
use crate::pressures::SharedPressures;
use crate::space::LevelSpace;

pub struct BlockTriangular<'a, 'b, const D: usize> {
    cycle: VCycle<'a, D>,
    pressures: SharedPressures,
    /// Lumped mass at the owned pressure nodes; zero where no pressure is unknown.
    mass: &'b [f64],
    /// Unit of pressures and of rows of divergences, see [`crate::operator`].
    unit: f64,
    viscosity: f64,
    /// At all pressure nodes of the part, and elsewhere.
    p: Vec<f32>,
}

impl<'a, 'b, const D: usize> BlockTriangular<'a, 'b, D> {
    pub fn new(
        cycle: VCycle<'a, D>,
        pressures: SharedPressures,
        mass: &'b [f64],
        [unit, viscosity]: [f64; 2],
    ) -> Self {
        let p = vec![0.0; pressures.dim()];
        Self { cycle, pressures, mass, unit, viscosity, p }
    }
}

/// The lumped mass at the owned pressure nodes.
pub fn lumped_mass<const D: usize>(
    space: &LevelSpace<D>,
    pressures: &SharedPressures,
    ranks: &dyn gluey_parallel::Communicator,
) -> Vec<f64> {
    let (mesh, map) = (&space.part.mesh, &space.pressure.map);
    let mut mass = vec![0.0; pressures.dim()];
    for cell in space.own_cells() {
        let corner = (0.5 * mesh.size(mesh.cells()[cell].level)).powi(D as i32);
        map.cell(cell).iter().for_each(|&node| mass[node as usize] += corner);
    }
    map.condense(1, |w| w, &mut mass);
    pressures.reduce(&mut mass);
    pressures.plan.clone().accumulate::<f64, 1>(ranks, &mut mass);
    mass[space.pressure.owned.clone()].to_vec()
}

impl<const D: usize> Preconditioner<f64> for BlockTriangular<'_, '_, D> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Self { cycle, pressures, mass, unit, viscosity, p } = self;
        let top = cycle.levels.len() - 1;
        let level = &mut cycle.levels[top];
        let operator = &mut level.operator;
        let (ru, rp) = r.split_at(operator.space.owned_dim());
        let (zu, zp) = z.split_at_mut(ru.len());
        for ((z, &r), &mass) in zp.iter_mut().zip(rp).zip(*mass) {
            *z = if mass > 0.0 { -*viscosity * r / (*unit * *unit * mass) } else { 0.0 };
        }
        if pressures.has_bridges {
            // Constants are not quite in the kernel then: as in the serial solver pressures have no mean.
            pressures.remove_mean(operator.ranks, zp);
        }
        let owned = operator.space.pressure.owned.clone();
        p[owned].iter_mut().zip(&*zp).for_each(|(p, &z)| *p = (*unit * z) as f32);
        pressures.plan.update::<f32, 1>(operator.ranks, p);
        pressures.expand(p);
        let map = &operator.space.pressure.map;
        map.distribute(1, |w| w as f32, p);
        operator.cells.gradient(&p[..map.node_count()], &mut operator.y, &mut operator.work);
        operator.gather(&mut level.b);
        level.b.iter_mut().zip(ru).for_each(|(b, &r)| *b = r as f32 - *b);
        cycle.run();
        zu.iter_mut().zip(&cycle.levels[top].z).for_each(|(zu, &z)| *zu = f64::from(z));
    }
}
