//! `unfitted` on a part of a mesh, for solvers whose ranks hold one part each.
//!
//! A part is a [`Discretisation::of_part`]: own cells, which are added up here, and others around them. What
//! follows from places alone is found without a message: which cells are cut, aggregates, penalties, the
//! blocks of the smoother. For that the part has to reach as far around its own surfaces as
//! [`rings_around_surfaces`] says. Vectors are those of [`StokesSystem`] at all nodes of the part; products
//! of its operator are the sums over the own cells, and sums of these over all parts are right at every node.

use gluey_fem::ReferenceMatrices;
use gluey_geom::{Aabb, Dim, Matrix, Space, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_parallel::Halo;

use crate::error::StokesError;
use crate::film::{Film, FilmCoupling, Lubrication, thin_films};
use crate::flow::{Conditions, NodalFields, Stress, WarmStart, fluid_weights, own_stress, subtract_uniform};
use crate::formulation::{Problem, Unfitted};
use crate::operator::{Elements, StokesSystem};
use crate::precondition::surface;
use crate::space::Discretisation;

pub use crate::space::finest_levels;

pub use crate::film::{FilmNetwork, FilmRow, SharedTwists};
pub use crate::flow::MOST_ROUNDS;
pub use crate::precondition::schur::SchurInverse;
pub use crate::precondition::surface::SurfaceSmoother;
pub use crate::precondition::velocity::{
    Hierarchy, LevelPlan, RELAXED_DIMENSIONS, RELAXED_RINGS, Smoothing, VCycle, coarsest_level,
};
pub use crate::surface::WeakCell;

/// Cells around own ones, without films, in 2D and in 3D. Cut cells depend on four: nodes of a bad cell, its
/// root up to two cells away, and what else that root carries. Weights of the pressures at surfaces take in
/// more cells; with four rings in 2D clusters of discs take up to six iterations more than one process.
const RINGS: [usize; 2] = [6, 4];

/// `unfitted` with penalties as the flows so far want them.
#[derive(Clone, Debug)]
pub struct PartMethod(Unfitted);

impl PartMethod {
    /// With this treatment of films that are too thin for the mesh.
    pub fn new(lubrication: Lubrication) -> Self {
        Self(Unfitted::new(lubrication))
    }

    /// The same with penalties twice as large, if they may grow.
    #[must_use]
    pub fn stiffened(&self) -> Option<Self> {
        self.0.with_stiffer_penalties().map(Self)
    }

    /// The same with the penalty in each of these cells, by their places in the part, multiplied by a factor.
    #[must_use]
    pub fn raised(&self, cells: impl Iterator<Item = (u32, f64)>) -> Self {
        Self(self.0.with_raised_penalties(cells))
    }

    /// The problem around the bodies near a part, in the order of all bodies, with the forces of the films
    /// that are `wanted`: each film of some part.
    ///
    /// # Errors
    /// Those of [`Problem::new`].
    pub fn problem<const D: usize>(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        wanted: &dyn Fn(&Film<D>) -> bool,
    ) -> Result<Problem<D>, StokesError>
    where
        Dim<D>: Space<D>,
    {
        let system = self.0.system(discretisation, bodies, viscosity, wanted)?;
        Ok(Problem { system, bodies: bodies.to_vec(), rigidity: std::sync::Arc::new(self.0.clone()) })
    }
}

/// How many rings of cells around its own a part needs near surfaces, for cells of this size: for the roots
/// of bad cells, and for what flows through the films between these bodies that are `wanted`.
pub fn rings_around_surfaces<const D: usize>(
    lubrication: Lubrication,
    (bodies, domain): (&[Ball<D>], &Aabb<D>),
    cell_size: f64,
    wanted: &dyn Fn(&Film<D>) -> bool,
) -> usize {
    if lubrication == Lubrication::None {
        return RINGS[D - 2];
    }
    let heights = lubrication.heights::<D>(cell_size);
    let films = thin_films(bodies, domain, &heights);
    let edge = |film: &Film<D>| film.shape(film.height(&heights)).edge();
    let widest = films.iter().filter(|film| wanted(film)).map(edge).fold(0.0, f64::max);
    RINGS[D - 2] + (widest / cell_size).ceil() as usize
}

/// Numbers that [`NodalFields::films`] has for a film: a body, its partner (negative for walls), and vectors.
pub fn numbers_of_film<const D: usize>() -> usize
where
    Dim<D>: Space<D>,
{
    FilmCoupling::<D>::KEPT
}

/// Offset in cells of the nodes that are rigid on the levels of the velocity cycle.
pub fn coarse_offset() -> f64 {
    crate::formulation::OFFSET_OF_LEVELS
}

/// The smoother of a part, before parts know of each other.
pub struct AssembledSmoother<'p, const D: usize>
where
    Dim<D>: Space<D>,
{
    elements: Elements<'p, D>,
    smoother: surface::AssembledSmoother<D>,
}

impl<'p, const D: usize> AssembledSmoother<'p, D>
where
    Dim<D>: Space<D>,
{
    /// For a problem that [`PartMethod::problem`] gave.
    ///
    /// # Errors
    /// [`StokesError::SurfaceBlock`] or [`StokesError::AtSurface`] where penalties are too small.
    pub fn new(problem: &'p Problem<D>) -> Result<Self, StokesError> {
        let elements = Elements::new(&problem.system, ReferenceMatrices::<D>::VELOCITY);
        let surfaces = problem.system.surfaces().ok_or(StokesError::NotPrepared)?;
        let smoother = SurfaceSmoother::assembled(&elements, surfaces)?;
        Ok(Self { elements, smoother })
    }

    /// The smoother, with the halos of reduced velocities and of the blocks of twists. All parts call this.
    ///
    /// # Errors
    /// [`StokesError::AtSurface`] where penalties are too small, on all parts that have the body.
    pub fn completed(self, halos: [Halo; 2]) -> Result<SurfaceSmoother<D>, StokesError> {
        self.smoother.completed(&self.elements, halos)
    }
}

impl<const D: usize> StokesSystem<D>
where
    Dim<D>: Space<D>,
{
    /// The own cells that surfaces cut.
    pub fn own_cut_cells(&self) -> impl Iterator<Item = usize> + '_ {
        let cut = self.surfaces().into_iter().flat_map(|surfaces| &surfaces.cut.cells);
        cut.map(|cell| cell.cell as usize).filter(|&cell| self.discretisation().is_own(cell))
    }

    /// The bodies that own cells or own films depend on.
    pub fn bodies_here(&self) -> Vec<bool> {
        let mut here = vec![false; self.space.body_count()];
        for (cell, body) in self.terms.iter().flat_map(|term| term.pieces()) {
            here[body] |= self.discretisation().is_own(cell);
        }
        let nodal = self.space.full_dim();
        for (k, _) in self.rows().flatten() {
            if let Some(twist) = (*k as usize).checked_sub(nodal) {
                here[twist / Dim::<D>::RIGID] = true;
            }
        }
        here
    }

    /// The first bodies of own films, ascending.
    pub fn bodies_with_films(&self) -> Vec<u32> {
        let mut bodies: Vec<u32> = self.films().into_iter().flat_map(|films| films.first_bodies()).collect();
        bodies.sort_unstable();
        bodies.dedup();
        bodies
    }
}

impl<const D: usize> Problem<D>
where
    Dim<D>: Space<D>,
{
    /// The inverse of about the Schur complement of the pressures, on the meshes of a cycle. All parts call
    /// this.
    ///
    /// # Errors
    /// Those of [`SchurInverse::new`], on all parts.
    pub fn schur_inverse(&self, cycle: &VCycle<D>) -> Result<SchurInverse<D>, StokesError> {
        let elements = Elements::new(&self.system, ReferenceMatrices::<D>::VELOCITY);
        SchurInverse::new(&cycle.hierarchy.meshes, &elements, None)
    }

    /// The own cells whose penalty is too small for a velocity that [`Problem::velocity`] gave, right at all
    /// cells around own ones, relative to a linear flow with this strain.
    pub fn weak_cells(&self, velocity: &[f64], strain: &Matrix<D>) -> Vec<WeakCell> {
        self.rigidity.weak_cells(self, velocity, strain)
    }

    /// The field that carries the data of some conditions, and the sums over own cells of its residual with
    /// the loads. Wrenches are for those to give who own the body.
    ///
    /// # Errors
    /// Those of [`Problem::add_wrenches`] and [`Problem::set_twists`].
    pub fn data_under(&self, conditions: &Conditions<'_, D>) -> Result<(Vec<f64>, Vec<f64>), StokesError> {
        conditions.data(self)
    }

    /// The share of the own cells and films in the forces and torques on the bodies near the part that make a
    /// flow a solution, of the fields [`Problem::velocity`] gives and a vector.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] in a formulation without unknowns for twists.
    pub fn own_wrenches(
        &self,
        conditions: &Conditions<'_, D>,
        velocity: &[f64],
        x: &[f64],
    ) -> Result<Vec<Wrench<D>>, StokesError> {
        self.wrenches(velocity, &self.pressure_and_films(x), conditions.force, &conditions.strain)
    }

    /// Integrals over the fluid of the own cells of a velocity that [`Problem::velocity`] gave, and of
    /// pressures at all nodes.
    pub fn fluid_integrals(&self, [velocity, pressure]: [&[f64]; 2]) -> FluidIntegrals<D> {
        let mut sums = FluidIntegrals { volume: 0.0, velocity: Vector::zeros(), pressure: 0.0 };
        let Some(surfaces) = self.system.surfaces() else { return sums };
        let (discretisation, cut) = (self.discretisation(), &surfaces.cut);
        let weights = fluid_weights(discretisation, &discretisation.velocity, cut);
        for (weight, u) in weights.iter().zip(velocity.chunks_exact(D)) {
            sums.volume += weight;
            sums.velocity += Vector::<D>::from_column_slice(u) * *weight;
        }
        let weights = fluid_weights(discretisation, &discretisation.pressure, cut);
        sums.pressure = weights.iter().zip(pressure).map(|(weight, p)| weight * p).sum();
        sums
    }

    /// Takes a uniform velocity from a velocity that [`Problem::velocity`] gave, and from the vector that it
    /// belongs to.
    pub fn subtract_uniform(&self, by: &Vector<D>, velocity: &mut [f64], x: &mut [f64]) {
        let space = &self.system.space;
        subtract_uniform(space, velocity, by, |_| true);
        subtract_uniform(space, x, by, |node| space.is_free(node));
    }

    /// What is kept of a vector for the next flow to start from: the deviation from the field that carries
    /// the data, right at the nodes of own cells if the vector is right at all that these depend on.
    pub fn deviation(&self, x: &[f64]) -> NodalFields {
        NodalFields::of(&self.system, x, self.pressure(x))
    }

    /// The vector that a solve starts from after flows whose deviations were moved to this part: the last
    /// one, and the one before if it is known. `b` is the right-hand side that [`Problem::data_under`] gives.
    /// `complete` is to bring those velocities of others to a vector which own films depend on.
    pub fn guess(
        &self,
        [last, before]: [Option<NodalFields>; 2],
        b: &[f64],
        complete: &mut dyn FnMut(&mut [f64]),
    ) -> Vec<f64> {
        let system = &self.system;
        match last {
            Some(last) => {
                WarmStart::new(self.discretisation().clone(), last, before).guess(system, b, complete)
            }
            None => vec![0.0; system.dim()],
        }
    }

    /// What the own cells and films add to the stress in a linear flow of this strain, for pressures whose
    /// mean over the fluid vanishes, and a vector with the forces of films; for the bodies near the part.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] where the formulation has no tractions.
    pub fn own_stress(
        &self,
        strain: &Matrix<D>,
        fields: [&[f64]; 2],
        x: &[f64],
    ) -> Result<Stress<D>, StokesError> {
        own_stress(self, strain, fields, x)
    }
}

/// Integrals over the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidIntegrals<const D: usize> {
    /// Its volume.
    pub volume: f64,
    /// Of its velocity.
    pub velocity: Vector<D>,
    /// Of its pressure.
    pub pressure: f64,
}
