//! The preconditioner of the penalised operator: the solid, the rigid levels, the rest.
//!
//! Every velocity is a field that is rigid on the nodes the solid touches, plus a field that vanishes away
//! from them. The first belongs to the hierarchy of rigid levels, which never sees the solid's viscosity. On
//! the second the penalised operator is a block `A_WW` that holds all of the contrast; [`SolidMultigrid`]
//! approximates its inverse by `C`. The two are combined multiplicatively, then the sweep `G` smooths the
//! residual of both:
//!
//! `z = E C E^T r`, `z += V (r - A z)`, `z += G (r - A z)`.
//!
//! Where the block is factorised, `G` is `E C E^T` once more and the rigid levels smooth on all meshes.
//! Elsewhere `C` has no smoother and `V` none on the finest mesh: `G` is the smoother of the solid and of the
//! fluid ([`PenalisedSmoother`]), and where the cells of two bodies meet, a sweep around these comes before
//! all others ([`FilmSmoother`]).
//!
//! A rigid motion costs the solid nothing, so what it leaves is the fluid's stress only: rounding errors of
//! the motion are not multiplied by the solid's viscosity.

use gluey_linalg::{LinOp, Preconditioner, vector};

use super::multigrid::SolidMultigrid;
use super::smoother::{FilmSmoother, PenalisedSmoother, around_films};
use crate::error::StokesError;
use crate::operator::{CountedOperator, Elements, acting, add_at, assemble_viscous_on, gather};
use crate::precondition::assembly::assemble_on_nodes;
use crate::precondition::numbered::NumberedNodes;
use crate::precondition::{Correction, CycleLevels, Ties};
use crate::space::{Discretisation, VelocitySpace, around_finest_cells, moves_as_one, nodes_of_cells_with};

/// Where the solid is less stiff a sweep around films saves no iterations, see
/// `docs/design/paper.md`.
const LEAST_CONTRAST_OF_FILMS: f64 = 300.0;

/// In 3D the operator in the bodies is factorised on meshes with at most this many cells per largest radius.
const FACTORISED_CELLS: f64 = 2.0;

impl<const D: usize> CycleLevels<'_, D> {
    /// Whether bodies are factorised on the last of the meshes.
    pub fn are_factorised(&self) -> bool {
        let is_small = |mesh: &Discretisation<D>| self.radius <= FACTORISED_CELLS * mesh.finest_cell_size();
        D == 2 || self.meshes.len() < 2 || self.meshes.last().is_none_or(is_small)
    }

    /// The first of the levels.
    pub fn below(&self, count: usize) -> Self {
        Self { meshes: &self.meshes[..count], ..*self }
    }
}

/// The correction of the velocity cycle for the penalised solid: the approximate inverse on its nodes, the
/// sweeps, and the operators that give the residuals between them.
pub struct PenalisedCorrection<const D: usize> {
    cycle: SolidMultigrid<D>,
    /// The cycle's unknowns among the reduced velocities.
    positions: Vec<u32>,
    /// `None` where the cycle, being exact, takes its place.
    smoother: Option<PenalisedSmoother<D>>,
    /// `None` without films.
    film: Option<FilmSmoother<D>>,
    /// The operator on velocities of the cycle and of the film, and on those of the rigid levels, where the
    /// solid's viscosity multiplies nothing.
    around_solid: CountedOperator<f64, D>,
    around_rigid: CountedOperator<f32, D>,
    /// The velocities of the finest rigid level.
    rigid: VelocitySpace<D>,
    b: Vec<f64>,
    x: Vec<f64>,
    /// Load and velocity on the finest rigid level.
    load: Vec<f64>,
    velocity: Vec<f32>,
    /// Loads of that velocity.
    rigid_load: Vec<f32>,
    /// Residual at all nodes.
    r: Vec<f64>,
}

impl<const D: usize> PenalisedCorrection<D> {
    /// For the nodes named in `touched`, which in `rigid` move with their bodies.
    pub fn new(
        elements: &Elements<'_, D>,
        touched: &[Option<u32>],
        rigid: &VelocitySpace<D>,
        levels: CycleLevels<'_, D>,
    ) -> Result<Self, StokesError> {
        let system = elements.system();
        let discretisation = system.discretisation();
        let nodes = &discretisation.velocity;
        let mut block: Vec<bool> = touched.iter().map(Option::is_some).collect();
        let SolidInverse { cycle, positions, smoother, swept } = if levels.are_factorised() {
            // A ring of cells around the solid saves a third of the iterations; in 3D that does not pay for
            // its factorisation.
            if D == 2 {
                block = nodes_of_cells_with(nodes, &block);
            }
            SolidInverse::factorised(elements, &block)?
        } else {
            SolidInverse::smoothed(elements, &block, levels)?
        };
        let is_stiff = system.added.as_ref().is_some_and(|solid| solid.contrast() >= LEAST_CONTRAST_OF_FILMS);
        let films = (smoother.is_some() && is_stiff).then(|| around_films(discretisation, touched)).flatten();
        let new = |nodes| FilmSmoother::new(elements, nodes, &block);
        let film = films.as_deref().map(new).transpose()?;
        // Those with solid in them that do not move as one body are strained by rigid motions, since bodies
        // meet there.
        let mut strained = acting(discretisation, &system.cells, &swept);
        let body_of = |&n: &u32| rigid.body_of(n as usize);
        strained.retain(|c| !moves_as_one(nodes.cell(c.cell as usize).iter().map(body_of)));
        let nodal = system.space.full_dim();
        block.iter_mut().zip(films.iter().flatten()).for_each(|(is_in, film)| *is_in |= film);
        let solid = acting(discretisation, &system.cells, &block);
        Ok(Self {
            around_solid: CountedOperator::within(system, &solid),
            around_rigid: CountedOperator::within(system, &strained),
            b: vec![0.0; positions.len()],
            x: vec![0.0; positions.len()],
            load: vec![0.0; rigid.dim()],
            velocity: vec![0.0; rigid.dim()],
            rigid_load: vec![0.0; nodal],
            r: vec![0.0; nodal],
            rigid: rigid.clone(),
            cycle,
            positions,
            smoother,
            film,
        })
    }

    /// `z += E C E^T r`.
    fn correct_solid(&mut self, r: &[f64], z: &mut [f64]) {
        gather(&self.positions, r, &mut self.b);
        self.cycle.apply(&self.b, &mut self.x);
        add_at(&self.positions, &self.x, z);
    }

    /// `z += E C E^T r` for the residual in the workspace.
    fn correct_solid_by_residual(&mut self, z: &mut [f64]) {
        let residual = std::mem::take(&mut self.r);
        self.correct_solid(&residual, z);
        self.r = residual;
    }
}

impl<const D: usize> Correction for PenalisedCorrection<D> {
    fn apply(
        &mut self,
        r: &[f64],
        z: &mut [f64],
        levels: &mut dyn FnMut(&mut [f64], &mut [f32]),
        _: Option<Ties<'_>>,
    ) {
        z.fill(0.0);
        match &mut self.film {
            Some(film) => {
                film.add_to(r, z);
                film.loads(z, &mut self.r);
                vector::residual_from_product(r, &mut self.r);
                self.correct_solid_by_residual(z);
            }
            None => self.correct_solid(r, z),
        }
        self.around_solid.apply(z, &mut self.r);
        vector::residual_from_product(r, &mut self.r);

        let nodal = self.r.len();
        self.load[..nodal].copy_from_slice(&self.r);
        levels(&mut self.load, &mut self.velocity);
        vector::axpy(1.0, &self.velocity[..nodal], z);
        self.rigid.add_rigid_motions(&self.velocity, z);
        self.rigid.expand(&mut self.velocity);
        self.around_rigid.apply_to_field(&self.velocity, &mut self.rigid_load);
        vector::axpy(-1.0, &self.rigid_load, &mut self.r);

        match &mut self.smoother {
            Some(smoother) => smoother.add_to(&self.r, z),
            None => self.correct_solid_by_residual(z),
        }
    }

    fn take_applications(&mut self) -> f64 {
        let smoother = self.smoother.as_mut().map_or(0.0, PenalisedSmoother::take_applications);
        let film = self.film.as_mut().map_or(0.0, FilmSmoother::take_applications);
        self.around_solid.take_applications() + self.around_rigid.take_applications() + smoother + film
    }
}

/// The approximate inverse on the nodes of the solid and the sweep that goes with it.
struct SolidInverse<const D: usize> {
    cycle: SolidMultigrid<D>,
    positions: Vec<u32>,
    smoother: Option<PenalisedSmoother<D>>,
    /// The nodes whose residuals are looked at after the rigid levels.
    swept: Vec<bool>,
}

impl<const D: usize> SolidInverse<D> {
    fn factorised(elements: &Elements<'_, D>, block: &[bool]) -> Result<Self, StokesError> {
        let assembled = assemble_viscous_on(elements, |node| block[node])?;
        Ok(Self {
            cycle: SolidMultigrid::factorised(&assembled.matrix, &assembled.blocks.minimum_degree()?)?,
            positions: assembled.unknowns.positions().to_vec(),
            smoother: None,
            swept: block.to_vec(),
        })
    }

    fn smoothed(
        elements: &Elements<'_, D>,
        block: &[bool],
        levels: CycleLevels<'_, D>,
    ) -> Result<Self, StokesError> {
        let system = elements.system();
        let discretisation = system.discretisation();
        let nodes = NumberedNodes::new(discretisation, |node| system.space.is_free(node) && block[node]);
        let matrix = assemble_on_nodes(&nodes, elements)?;
        let factorised = (1..levels.meshes.len()).rev().find(|&count| levels.below(count).are_factorised());
        let coarser = &levels.meshes[factorised.map_or(0, |count| count - 1)..levels.meshes.len() - 1];
        let swept = around_finest_cells(discretisation);
        Ok(Self {
            cycle: SolidMultigrid::below(&nodes, &matrix, coarser.iter().rev())?,
            positions: nodes.positions(),
            smoother: Some(PenalisedSmoother::new(system, &swept, &nodes, &matrix)?),
            swept,
        })
    }
}
