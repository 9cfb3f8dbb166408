//! `unfitted`: the fluid ends at the true surfaces of the bodies, wherever these cut the mesh.
//!
//! Aggregated unfitted elements with Nitsche's symmetric conditions on the surfaces and the rigid motions as
//! unknowns: Badia, Verdugo and Martin 2018 (Comput. Methods Appl. Mech. Eng. 336, 533), Nitsche 1971. Force
//! and torque on a free body vanish because they are the residual of its own unknowns. No parameter is left
//! to choose.

use std::sync::Arc;

use gluey_fem::TreeMesh;
use gluey_geom::{Matrix, Twist, Vector};
use gluey_levelset::{Ball, Body};

use super::problem::{FlowData, LinearSolve, Method, Multiplier, Problem, Rigidity, check_resolved};
use crate::error::StokesError;
use crate::film::{Film, FilmCoupling, Heights, Lubrication, thin_films};
use crate::operator::{Elements, StokesSystem};
use crate::precondition::surface::SurfaceCorrection;
use crate::precondition::velocity::Smoothing;
use crate::precondition::{Correction, CycleLevels};
use crate::space::{Discretisation, PressureSpace, SolidNodes, VelocitySpace, solid_nodes};
use crate::surface::{
    Aggregates, CellState, CutCells, Flat, Flats, PenaltyFactor, SurfaceCoupling, WeakCell, first_moments,
    flows_through_films, weak_cells,
};

/// Offset in cells of the nodes that are rigid on the levels of the velocity cycle.
pub const OFFSET: f64 = -0.1;

/// Multiple of the largest local ratio in Nitsche's penalty, and what it may be doubled to where that is too
/// little: the ratio of each root does not see bad cells next to each other whose ghosts have other roots.
const PENALTY: f64 = 2.0;
const LARGEST_PENALTY: f64 = 16.0;

/// The formulation.
#[derive(Clone, Debug)]
pub struct Unfitted {
    /// Treatment of films that are too thin for the mesh.
    lubrication: Lubrication,
    /// Multiple of the largest local ratio in Nitsche's penalty.
    penalty: PenaltyFactor,
}

impl Unfitted {
    /// The formulation with this treatment of films that are too thin for the mesh.
    pub fn new(lubrication: Lubrication) -> Self {
        Self { lubrication, penalty: PenaltyFactor::new(PENALTY) }
    }

    /// The same with penalties twice as large, if they may grow.
    pub fn with_stiffer_penalties(&self) -> Option<Self> {
        let penalty = self.penalty.doubled(LARGEST_PENALTY)?;
        Some(Self { penalty, ..*self })
    }

    /// The same with the penalty in each of these cells of the mesh multiplied by a factor.
    #[must_use]
    pub fn with_raised_penalties(&self, cells: impl Iterator<Item = (u32, f64)>) -> Self {
        Self { penalty: self.penalty.clone().raised(cells), ..*self }
    }

    /// The system around these bodies, with the forces of the films whose middles are in the run of the rank.
    pub fn system<const D: usize>(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
    ) -> Result<StokesSystem<D>, StokesError> {
        let heights = self.lubrication.heights::<D>(discretisation.finest_cell_size());
        let mut films = thin_films(bodies, discretisation.mesh.domain(), &heights);
        let flats = flats(&films, bodies.len(), &heights);
        let mut system = around(discretisation, bodies, &flats, viscosity, &self.penalty)?;
        let shear = discretisation.mesh.shear();
        films.retain(|film| discretisation.is_own_point(&film.middle(shear)));
        let lubricates = self.lubrication == Lubrication::Deficit && !films.is_empty();
        if let Some(surfaces) = system.surfaces().filter(|_| lubricates) {
            let (space, pressure) = (&system.space, &system.pressure);
            let flows = flows_through_films(space, pressure, &surfaces.cut, bodies, &films, &heights);
            system.terms.push(Arc::new(FilmCoupling::new(space, films, flows, &heights, viscosity)));
        }
        Ok(system)
    }
}

impl<const D: usize> Method<D> for Unfitted {
    fn discretised(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
    ) -> Result<(StokesSystem<D>, Arc<dyn Rigidity<D>>), StokesError> {
        check_resolved(discretisation, bodies, |body| reaches_into(&discretisation.mesh, &bodies[body]))?;
        let system = self.system(discretisation, bodies, viscosity)?;
        Ok((system, Arc::new(self.clone())))
    }

    fn stiffened(&self) -> Option<Arc<dyn Method<D>>> {
        self.with_stiffer_penalties().map(|stiffer| Arc::new(stiffer) as Arc<dyn Method<D>>)
    }

    fn raised(&self, cells: &[WeakCell]) -> Option<Arc<dyn Method<D>>> {
        let factors = cells.iter().filter_map(|weak| Some((weak.place?, weak.factor())));
        Some(Arc::new(self.with_raised_penalties(factors)))
    }
}

/// Whether a body lies at least in part in the box of a mesh.
fn reaches_into<const D: usize>(mesh: &TreeMesh<D>, body: &Ball<D>) -> bool {
    let (domain, periodic, center) = (mesh.domain(), mesh.periodic(), body.center());
    let beyond = |d: usize| match periodic[d] {
        true => 0.0,
        false => center[d] - center[d].clamp(domain.lower[d], domain.upper[d]),
    };
    let is_near = Vector::<D>::from_fn(|d, _| beyond(d)).norm() < body.bounding_radius();
    is_near && center.iter().all(|x| x.is_finite())
}

/// The planes that widen films to these heights.
fn flats<const D: usize>(films: &[Film<D>], body_count: usize, heights: &Heights) -> Flats<D> {
    let sides = films.iter().flat_map(|film| {
        let distances = film.flats(film.height(heights));
        let side = move |side: usize, sign: f64| {
            let flat = Flat { normal: film.normal * sign, distance: distances[side] };
            film.side(side).map(|body| (body, flat))
        };
        [side(0, 1.0), side(1, -1.0)].into_iter().flatten()
    });
    Flats::grouped(body_count, sides)
}

/// The system around bodies that planes cut flat, with this multiple of the largest ratios as penalty.
fn around<const D: usize>(
    discretisation: &Discretisation<D>,
    bodies: &[Ball<D>],
    flats: &Flats<D>,
    viscosity: f64,
    penalty: &PenaltyFactor,
) -> Result<StokesSystem<D>, StokesError> {
    check_resolved(discretisation, bodies, |_| true)?;
    let cut = CutCells::new(discretisation, bodies, flats);
    let aggregates = Aggregates::new(discretisation, &cut)?;
    let solid = without_fluid(discretisation, &cut);
    let ghosts = aggregates.velocity.clone();
    let space = VelocitySpace::around_surfaces(discretisation, bodies, &solid, ghosts);
    let has_unknowns = |cell: usize| cut.states[cell].has_unknowns();
    let pressure =
        PressureSpace::around_surfaces(&discretisation.pressure, has_unknowns, &aggregates.pressure);
    let surfaces = SurfaceCoupling::new(&space, bodies, viscosity, cut, penalty, &aggregates)?;
    Ok(StokesSystem::beside(Arc::new(surfaces), space, pressure, viscosity))
}

/// The nodes with no fluid in the cells around them, each with the body of one of these.
fn without_fluid<const D: usize>(discretisation: &Discretisation<D>, cut: &CutCells<D>) -> SolidNodes {
    let nodes = &discretisation.velocity;
    let mut solid = vec![None; nodes.node_count()];
    for &(cell, body) in &cut.solid_body {
        nodes.cell(cell as usize).iter().for_each(|&node| solid[node as usize] = Some(body));
    }
    for cell in (0..nodes.cell_count()).filter(|&cell| cut.states[cell] != CellState::Solid) {
        nodes.cell(cell).iter().for_each(|&node| solid[node as usize] = None);
    }
    solid
}

impl<const D: usize> Rigidity<D> for Unfitted {
    fn twists(&self, problem: &Problem<D>, velocity: &[f64]) -> Result<Vec<Twist<D>>, StokesError> {
        let space = &problem.system.space;
        Ok((0..space.body_count()).map(|body| space.twist(velocity, body)).collect())
    }

    fn solve(
        &self,
        _problem: &Problem<D>,
        data: &FlowData<'_>,
        x: &mut [f64],
        solve: &mut LinearSolve<'_>,
    ) -> Result<Multiplier, StokesError> {
        solve(data.b, x, 1.0)?;
        Ok(Multiplier::new())
    }

    /// From the tractions on the true surface.
    fn first_moments(
        &self,
        problem: &Problem<D>,
        fields: [&[f64]; 2],
        undisturbed: &Matrix<D>,
    ) -> Result<Vec<Matrix<D>>, StokesError> {
        let Problem { system, bodies, .. } = problem;
        let Some(surfaces) = system.surfaces() else { return Ok(Vec::new()) };
        Ok(first_moments(surfaces, &system.space, bodies, system.viscosity(), fields, undisturbed))
    }

    fn weak_cells(&self, problem: &Problem<D>, velocity: &[f64], strain: &Matrix<D>) -> Vec<WeakCell> {
        let surfaces = problem.system.surfaces();
        surfaces.map_or_else(Vec::new, |surfaces| weak_cells(surfaces, velocity, strain))
    }

    fn coarse_offset(&self) -> f64 {
        OFFSET
    }

    fn finest_level(&self, problem: &Problem<D>) -> VelocitySpace<D> {
        let discretisation = problem.discretisation();
        let solid = solid_nodes(discretisation, &problem.bodies, OFFSET);
        VelocitySpace::new(discretisation, &problem.bodies, &solid)
    }

    /// The smoother of the finest mesh is that of the surfaces.
    fn smoothing(&self, _: CycleLevels<'_, D>, is_finest: bool) -> Option<Smoothing> {
        (!is_finest).then(Smoothing::of_eliminated)
    }

    fn correction(
        &self,
        elements: &Elements<'_, D>,
        finest: &VelocitySpace<D>,
        _: CycleLevels<'_, D>,
    ) -> Result<Option<Box<dyn Correction>>, StokesError> {
        let Some(surfaces) = elements.system().surfaces() else { return Ok(None) };
        Ok(Some(Box::new(SurfaceCorrection::new(elements, surfaces, finest)?)))
    }
}

#[cfg(test)]
mod tests;
