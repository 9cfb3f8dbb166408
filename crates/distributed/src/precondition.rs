//! The block triangular preconditioner of the serial solver: `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`,
//! with the lumped mass over the viscosity for the Schur complement `S`.

use gluey_linalg::Preconditioner;
use gluey_parallel::GhostPlan;

use crate::cycle::VCycle;
use crate::space::LevelSpace;

pub struct BlockTriangular<'a, const D: usize> {
    pub cycle: VCycle<'a, D>,
    pressures: GhostPlan,
    /// Lumped mass at the owned pressure nodes; zero at hanging ones.
    pub mass: Vec<f64>,
    viscosity: f64,
    /// At all pressure nodes of the part.
    p: Vec<f32>,
}

impl<'a, const D: usize> BlockTriangular<'a, D> {
    pub fn new(cycle: VCycle<'a, D>, mut pressures: GhostPlan, viscosity: f64) -> Self {
        let top = &cycle.levels[cycle.levels.len() - 1].operator;
        let mut mass = lumped_mass(&top.space);
        pressures.accumulate::<f64, 1>(top.ranks, &mut mass);
        let p = vec![0.0; mass.len()];
        let mass = mass[top.space.pressure.owned.clone()].to_vec();
        Self { cycle, pressures, mass, viscosity, p }
    }
}

/// What own cells have of it, at all nodes of the part.
fn lumped_mass<const D: usize>(space: &LevelSpace<D>) -> Vec<f64> {
    let (mesh, map) = (&space.part.mesh, &space.pressure.map);
    let mut mass = vec![0.0; map.node_count()];
    for cell in space.part.own() {
        let corner = (0.5 * mesh.size(mesh.cells()[cell].level)).powi(D as i32);
        map.cell(cell).iter().for_each(|&node| mass[node as usize] += corner);
    }
    map.condense(1, |w| w, &mut mass);
    mass
}

impl<const D: usize> Preconditioner<f64> for BlockTriangular<'_, D> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Self { cycle, pressures, mass, viscosity, p } = self;
        let top = cycle.levels.len() - 1;
        let level = &mut cycle.levels[top];
        let operator = &mut level.operator;
        let (ru, rp) = r.split_at(operator.space.velocity.owned.len() * D);
        let (zu, zp) = z.split_at_mut(ru.len());
        for ((z, &r), &mass) in zp.iter_mut().zip(rp).zip(&*mass) {
            *z = if mass > 0.0 { -*viscosity * r / mass } else { 0.0 };
        }
        let owned = operator.space.pressure.owned.clone();
        p[owned].iter_mut().zip(&*zp).for_each(|(p, &z)| *p = z as f32);
        pressures.update::<f32, 1>(operator.ranks, p);
        operator.space.pressure.map.distribute(1, |w| w as f32, p);
        operator.cells.gradient(p, &mut operator.y, &mut operator.work);
        operator.gather(&mut level.b);
        level.b.iter_mut().zip(ru).for_each(|(b, &r)| *b = r as f32 - *b);
        cycle.run();
        zu.iter_mut().zip(&cycle.levels[top].z).for_each(|(zu, &z)| *zu = f64::from(z));
    }
}
