//! Krylov solution of the Stokes system with a multigrid preconditioner.
//!
//! Generalised conjugate residuals ([`Gcr`]) on `[A, -B^T; -B, 0]` with the block triangular preconditioner `z_p = -S^-1 r_p`,
//! `z_u = V (r_u + B^T z_p)`: `S` is close to the Schur complement (see [`crate::schur`]), `V` one V-cycle on the velocity.
//! Steps are in `f32`, with a residual in `f64` now and then, or in `f64` where rounding would disturb them ([`rounding_noise`]).
//! The levels are the tree's own: level `l` is the mesh cut at depth `l`. On every level the solid nodes of that level
//! are eliminated; a coarse correction enters as the rigid motion that fits it best. In the `paper` formulation the
//! finest level moves every node the solid touches rigidly: what the penalty makes stiff is invisible to all levels, and
//! left to a [`SolidBlock`].

use std::sync::Arc;

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_fem::{Interpolation, ReferenceMatrices};
use gluey_geom::{Dim, Space};
use gluey_levelset::Body;
use gluey_linalg::{DirectSpd, Gcr, GcrParams, LinOp, Ordering, Preconditioner, Reference, Scalar, vector};

use crate::assembly::{Unknowns, assemble_viscous, factorised};
use crate::discretisation::{Discretisation, solid_nodes};
use crate::element::Elements;
use crate::error::StokesError;
use crate::level::{Level, Smoothing};
use crate::pressure::WeakPressures;
use crate::schur::SchurInverse;
use crate::solid_block::{SolidBlock, is_factorised};
use crate::solver::{Preparation, SaddleSolver, SolveReport};
use crate::space::VelocitySpace;
use crate::system::{Penalty, StokesSystem, SystemOperator};

/// Largest [`rounding_noise`] with which steps are taken in single precision. Two spheres in a penalised solid take the same
/// iterations in either precision up to 2; where it is 5 (N = 64, contrast 1e4) they take 99 in place of 22.
const MOST_NOISE: f64 = 1.0;
/// Depth of the coarsest mesh.
const COARSEST_LEVEL: u8 = 2;

/// Generalised conjugate residuals with a multigrid preconditioner.
pub struct MultigridSolver<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// With steps in single and in double precision.
    single: Gcr<f64, f32>,
    double: Gcr<f64>,
    /// See [`rounding_noise`].
    noise: f64,
    cycle: Option<VCycle<D>>,
    schur: Option<SchurInverse<D>>,
    /// The operator of the fluid.
    fluid: Option<CellOperator<f32, D>>,
}

impl<const D: usize> Default for MultigridSolver<D>
where
    Dim<D>: Space<D>,
{
    fn default() -> Self {
        let params = GcrParams { max_iterations: 200, restart: 60, ..GcrParams::default() };
        Self {
            single: Gcr::with_steps(params),
            double: Gcr::new(params),
            noise: 0.0,
            cycle: None,
            schur: None,
            fluid: None,
        }
    }
}

impl<const D: usize> MultigridSolver<D>
where
    Dim<D>: Space<D>,
{
    /// One V-cycle on the velocity block, for reduced velocities; `None` before the solver was prepared.
    pub fn velocity_cycle(&mut self) -> Option<&mut impl Preconditioner<f64>> {
        self.cycle.as_mut()
    }

    /// Levels of the V-cycle it was prepared with.
    pub fn level_count(&self) -> usize {
        self.cycle.as_ref().map_or(0, |cycle| cycle.levels.len())
    }
}

impl<const D: usize> SaddleSolver<D> for MultigridSolver<D>
where
    Dim<D>: Space<D>,
{
    fn prepare(
        &mut self,
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        preparation: &Preparation<'_, D>,
    ) -> Result<(), StokesError> {
        let elements = Elements::new(discretisation, system, ReferenceMatrices::<D>::VELOCITY);
        let before = self.cycle.take().map(|cycle| cycle.hierarchy).unwrap_or_default();
        let hierarchy = Hierarchy::new(discretisation, before);
        let before = self.schur.take();
        self.schur =
            Some(SchurInverse::new(&hierarchy.meshes, system, &elements, preparation.viscosity, before)?);
        self.cycle = Some(VCycle::new(hierarchy, discretisation, system, &elements, preparation)?);
        self.fluid = Some(system.in_single_precision(discretisation));
        self.noise = rounding_noise(discretisation, system);
        Ok(())
    }

    fn solve(
        &mut self,
        system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<SolveReport, StokesError> {
        let (Some(cycle), Some(schur), Some(fluid)) = (&mut self.cycle, &mut self.schur, &self.fluid) else {
            return Err(StokesError::NotPrepared);
        };
        cycle.take_fine_applications();
        let operator = &mut SystemOperator::new(system);
        let preconditioner = &mut BlockTriangular::new(system, fluid, cycle, schur);
        let residuals = if self.noise <= MOST_NOISE {
            run(&mut self.single, operator, preconditioner, b, x, tolerance)?
        } else {
            run(&mut self.double, operator, preconditioner, b, x, tolerance)?
        };
        Ok(SolveReport {
            iterations: residuals.len() - 1,
            fine_operator_applications: operator.applications() as f64 + cycle.take_fine_applications(),
            residuals,
        })
    }
}

/// Solves `A x = b` with steps in `S` and returns the norms of the residuals.
fn run<S: Scalar>(
    krylov: &mut Gcr<f64, S>,
    a: &mut (impl LinOp<f64> + LinOp<S>),
    m: &mut impl Preconditioner<S>,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
) -> Result<Vec<f64>, StokesError> {
    krylov.set_relative_tolerance(tolerance);
    krylov.solve(a, m, b, x, Reference::RightHandSide)?;
    Ok(krylov.residual_history().to_vec())
}

/// What rounding a velocity to single precision changes in its viscous force, over the force of a velocity as smooth as the
/// box: a difference of neighbours, times the viscosity of the solid.
fn rounding_noise<const D: usize>(discretisation: &Discretisation<D>, system: &StokesSystem<D>) -> f64
where
    Dim<D>: Space<D>,
{
    let mesh = &discretisation.mesh;
    let contrast = system.penalty.as_ref().map_or(1.0, Penalty::contrast);
    let cells = mesh.domain().extent().max() / mesh.size(mesh.max_level());
    f64::from(f32::EPSILON) * contrast * cells * cells
}

/// `z_p = -S^-1 r_p`, `z_u = V (r_u + B^T z_p)`.
struct BlockTriangular<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    system: &'a StokesSystem<D>,
    fluid: &'a CellOperator<f32, D>,
    cycle: &'a mut VCycle<D>,
    schur: &'a mut SchurInverse<D>,
    /// `r_p`, then `z_p` at all nodes.
    pressure: Vec<f32>,
    /// `z_p`.
    answer: Vec<f32>,
    work: Workspace<f32>,
}

impl<'a, const D: usize> BlockTriangular<'a, D>
where
    Dim<D>: Space<D>,
{
    fn new(
        system: &'a StokesSystem<D>,
        fluid: &'a CellOperator<f32, D>,
        cycle: &'a mut VCycle<D>,
        schur: &'a mut SchurInverse<D>,
    ) -> Self {
        let zeros = || vec![0.0; system.pressure.dim()];
        Self { system, fluid, cycle, schur, pressure: zeros(), answer: zeros(), work: Workspace::default() }
    }
}

impl<S: Scalar, const D: usize> Preconditioner<S> for BlockTriangular<'_, D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, r: &[S], z: &mut [S]) {
        let Self { system, fluid, cycle, schur, pressure, answer, work } = self;
        let (ru, rp) = r.split_at(system.velocity_dim());
        let (zu, zp) = z.split_at_mut(system.velocity_dim());
        vector::convert(-1.0, rp, pressure);
        system.pressure.remove_mean(pressure);
        schur.apply(&system.pressure, pressure, answer);
        system.pressure.remove_mean(answer);
        vector::convert(1.0, answer, zp);
        vector::copy(answer, pressure);
        system.pressure.expand(pressure);
        cycle.answer(ru, |load| fluid.gradient(pressure, load, work), zu);
    }
}

/// The meshes of the levels, coarsest first.
struct Hierarchy<const D: usize> {
    meshes: Vec<Discretisation<D>>,
    /// `transfers[l]` joins mesh `l` to mesh `l + 1`.
    transfers: Vec<Interpolation<D>>,
}

impl<const D: usize> Default for Hierarchy<D> {
    fn default() -> Self {
        Self { meshes: Vec::new(), transfers: Vec::new() }
    }
}

impl<const D: usize> Hierarchy<D> {
    /// The meshes below `finest`. What was the same in the hierarchy `before` is taken from there.
    fn new(finest: &Discretisation<D>, before: Self) -> Self {
        let depth = finest.mesh.max_level();
        let mut meshes: Vec<Discretisation<D>> = (COARSEST_LEVEL.min(depth)..depth)
            .map(|level| {
                let is_kept = |mesh: &&Discretisation<D>| {
                    mesh.mesh.max_level() == level && mesh.mesh.is_coarsening_of(&finest.mesh)
                };
                let kept = before.meshes.iter().find(is_kept).cloned();
                kept.unwrap_or_else(|| Discretisation::new(finest.mesh.coarsened(level)))
            })
            .collect();
        meshes.push(finest.clone());
        let mut kept: Vec<_> = before.meshes.windows(2).zip(before.transfers).collect();
        let transfers = meshes.windows(2).map(|pair| {
            let is_same =
                |old: &[Discretisation<D>]| (0..2).all(|k| Arc::ptr_eq(&old[k].mesh, &pair[k].mesh));
            if let Some(place) = kept.iter().position(|old| is_same(old.0)) {
                return kept.swap_remove(place).1;
            }
            let (coarse, fine) = (&pair[0], &pair[1]);
            Interpolation::new(&coarse.mesh, coarse.velocity.clone(), &fine.mesh, &fine.velocity)
        });
        Self { transfers: transfers.collect(), meshes }
    }
}

/// One V-cycle on the velocity block.
struct VCycle<const D: usize>
where
    Dim<D>: Space<D>,
{
    hierarchy: Hierarchy<D>,
    /// Coarsest first.
    levels: Vec<Level<D>>,
    coarse: CoarseSolver,
    /// The penalised solid, in that formulation.
    solid: Option<SolidBlock<D>>,
    /// What it is given and what it answers.
    wide: [Vec<f64>; 2],
}

impl<const D: usize> VCycle<D>
where
    Dim<D>: Space<D>,
{
    fn new(
        hierarchy: Hierarchy<D>,
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        elements: &Elements<'_, D>,
        preparation: &Preparation<'_, D>,
    ) -> Result<Self, StokesError> {
        let meshes = &hierarchy.meshes;
        let radius = preparation.bodies.iter().map(Body::bounding_radius).fold(0.0, f64::max);
        let mut levels = Vec::with_capacity(meshes.len() + 1);
        for (index, mesh) in meshes.iter().enumerate() {
            let is_finest = index + 1 == meshes.len();
            let space = match is_finest {
                true => finest_rigid_space(system, preparation),
                false => rigid_space(mesh, preparation),
            };
            let smoothing = match preparation.touched {
                None => Some(Smoothing::of_eliminated(is_finest)),
                Some(_) if is_factorised(meshes, radius) => Some(Smoothing::of_penalised(is_finest)),
                // The solid's smoother is that of the finest mesh.
                Some(_) => (!is_finest).then(|| Smoothing::of_eliminated(is_finest)),
            };
            levels.push(Level::rigid(mesh, space, preparation.viscosity, (index, smoothing))?);
        }
        let finest = &levels[levels.len() - 1].space;
        let solid = match preparation.touched {
            Some(touched) => {
                let hierarchy = (&meshes[..], radius);
                Some(SolidBlock::new(discretisation, system, elements, touched, finest, hierarchy)?)
            }
            None => None,
        };
        let coarse_space = levels[0].space.clone();
        let coarse = CoarseSolver::new(&meshes[0], coarse_space, preparation.viscosity)?;
        Ok(Self { hierarchy, levels, coarse, solid, wide: Default::default() })
    }

    /// Applications on the finest mesh since the last call, see [`SolveReport::fine_operator_applications`].
    fn take_fine_applications(&mut self) -> f64 {
        let levels = self.levels.last_mut().map_or(0.0, Level::take_applications);
        levels + self.solid.as_mut().map_or(0.0, SolidBlock::take_applications)
    }

    fn run(&mut self, top: usize) {
        if top == 0 {
            let level = &mut self.levels[0];
            self.coarse.solve(&level.b, &mut level.x);
            return;
        }
        let (below, above) = self.levels.split_at_mut(top);
        let (coarse, fine) = (&mut below[top - 1], &mut above[0]);
        fine.restrict(&mut self.hierarchy.transfers[top - 1], &coarse.space, &mut coarse.b);
        self.run(top - 1);
        let (below, above) = self.levels.split_at_mut(top);
        let (coarse, fine) = (&mut below[top - 1], &mut above[0]);
        let mut x = std::mem::take(&mut coarse.x);
        fine.correct(&self.hierarchy.transfers[top - 1], &coarse.space, &mut x);
        coarse.x = x;
        fine.smooth();
    }
}

impl<const D: usize> VCycle<D>
where
    Dim<D>: Space<D>,
{
    /// `z = V r` on the reduced vectors of the finest rigid level.
    fn rigid_cycle<T: Scalar>(&mut self, r: &[f64], z: &mut [T]) {
        let norm = vector::norm(r);
        if norm == 0.0 {
            z.fill(T::ZERO);
            return;
        }
        let top = self.levels.len() - 1;
        vector::convert(1.0 / norm, r, &mut self.levels[top].b);
        self.run(top);
        vector::convert(norm, &self.levels[top].x, z);
    }

    /// The reduced velocities `u` with which the finest rigid level answers the nodal load `f`, which it reduces.
    fn rigid_velocities(&mut self, f: &mut [f64], u: &mut [f32]) {
        self.levels[self.levels.len() - 1].space.reduce(f);
        self.rigid_cycle(f, u);
    }

    /// `z = V (r - g)` for the gradient `g` that `gradient` writes.
    fn answer<S: Scalar>(&mut self, r: &[S], gradient: impl FnOnce(&mut [f32]), z: &mut [S]) {
        let top = self.levels.len() - 1;
        gradient(&mut self.levels[top].b[..r.len()]);
        let Some(mut solid) = self.solid.take() else {
            vector::residual_from_product(r, &mut self.levels[top].b);
            self.run(top);
            return vector::convert(1.0, &self.levels[top].x, z);
        };
        let [mut load, mut answer] = std::mem::take(&mut self.wide);
        [&mut load, &mut answer].into_iter().for_each(|v| v.resize(r.len(), 0.0));
        vector::convert(1.0, &self.levels[top].b[..r.len()], &mut load);
        vector::residual_from_product(r, &mut load);
        solid.apply(&load, &mut answer, |f, u| self.rigid_velocities(f, u));
        vector::convert(1.0, &answer, z);
        self.wide = [load, answer];
        self.solid = Some(solid);
    }
}

impl<const D: usize> Preconditioner<f64> for VCycle<D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Some(mut solid) = self.solid.take() else { return self.rigid_cycle(r, z) };
        solid.apply(r, z, |f, u| self.rigid_velocities(f, u));
        self.solid = Some(solid);
    }
}

/// Velocities of one level with the bodies' nodes on it eliminated.
fn rigid_space<const D: usize>(mesh: &Discretisation<D>, preparation: &Preparation<'_, D>) -> VelocitySpace<D>
where
    Dim<D>: Space<D>,
{
    let solid = solid_nodes(&mesh.mesh, &mesh.velocity, preparation.bodies, preparation.offset);
    VelocitySpace::new(mesh.velocity.clone(), preparation.bodies, &solid)
}

/// The same on the finest mesh: the space of the system, or that in which all nodes the penalised solid touches are rigid.
fn finest_rigid_space<const D: usize>(
    system: &StokesSystem<D>,
    preparation: &Preparation<'_, D>,
) -> VelocitySpace<D>
where
    Dim<D>: Space<D>,
{
    match preparation.touched {
        Some(touched) => VelocitySpace::new(system.space.shared_nodes(), preparation.bodies, touched),
        None => system.space.clone(),
    }
}

/// Direct solver of the coarsest level.
struct CoarseSolver {
    factor: DirectSpd,
    unknowns: Unknowns,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl CoarseSolver {
    fn new<const D: usize>(
        discretisation: &Discretisation<D>,
        space: VelocitySpace<D>,
        viscosity: f64,
    ) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        let system = StokesSystem::new(discretisation, space, viscosity, WeakPressures::Keep, None);
        let assembled = assemble_viscous(discretisation, &system)?;
        let factor = factorised(&assembled.matrix, Ordering::Amd)?;
        let count = assembled.unknowns.positions.len();
        Ok(Self { factor, unknowns: assembled.unknowns, b: vec![0.0; count], x: vec![0.0; count] })
    }

    fn solve(&mut self, b: &[f32], x: &mut [f32]) {
        for (value, &k) in self.b.iter_mut().zip(&self.unknowns.positions) {
            *value = f64::from(b[k as usize]);
        }
        self.factor.apply(&self.b, &mut self.x);
        x.fill(0.0);
        for (value, &k) in self.x.iter().zip(&self.unknowns.positions) {
            x[k as usize] = *value as f32;
        }
    }
}

#[cfg(test)]
mod tests;
