//! The flow around particles that move, step after step, on ranks.
//!
//! Ranks share the flow. What is small is not shared: where particles are, how they move, which of them
//! touch. Rank zero leads: it knows when a flow is wanted and tells the others where the particles are. The
//! others follow, or do the same work on their particles beside it; what rank zero says holds.

use gluey_fem::{ImplicitTree, MeshError};
use gluey_geom::{Aabb, Dim, Particle, Space, Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_motion::{Fields, Film, FlowStatistics, Hydrodynamics, NoForces};
use gluey_parallel::Communicator;
use gluey_stokes::{CutCellPressures, Formulation, Lubrication, Refinement};

use crate::cuts::cuts_of_work;
use crate::flow::{BoxFlow, FlowError, MyFlow, RigidBodies};
use crate::surface::SurfaceBodies;

/// A box with particles in a shear flow, `u = rate (y - middle) e_x` on its walls.
#[derive(Clone, Debug)]
pub struct Suspension<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Fluid and tolerance.
    pub flow: BoxFlow,
    /// The box.
    pub domain: Aabb<D>,
    /// Cells along its edges before any is refined.
    pub roots: [u32; D],
    /// Periods along its axes, where it has some; at least one has none.
    pub periods: [Option<f64>; D],
    /// How the mesh follows the particles.
    pub refinement: Refinement,
    /// How rigidity is imposed: `rigid-dofs` with aggregated pressures, or `unfitted`.
    pub formulation: Formulation,
    /// Radii of the particles.
    pub radii: Vec<f64>,
    /// Forces and torques on them, or no entries for none on any.
    pub wrenches: Vec<Wrench<D>>,
    /// The shear rate.
    pub shear_rate: f64,
}

/// Why there is no flow around the particles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SuspensionError {
    /// The box has no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The flow failed, on all ranks.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// Ranks have it not.
    #[error("ranks share flows of `unfitted`, and of `rigid-dofs` with aggregated pressures, only")]
    Formulation,
}

/// A frame with the fields of the last flow that rank zero wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameName {
    /// Which of several streams of frames it belongs to.
    pub stream: u32,
    /// Its step.
    pub step: u32,
}

/// What rank zero wants of the others.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    End,
    Predict,
    Show(FrameName),
}

impl Order {
    /// What rank zero wants, on all ranks.
    fn share(self, ranks: &dyn Communicator) -> Self {
        let mut numbers = match self {
            Self::End => [0.0; 3],
            Self::Predict => [1.0, 0.0, 0.0],
            Self::Show(FrameName { stream, step }) => [2.0, f64::from(stream), f64::from(step)],
        };
        ranks.share(&mut numbers);
        let [order, stream, step] = numbers.map(|number| number as u32);
        match order {
            0 => Self::End,
            1 => Self::Predict,
            _ => Self::Show(FrameName { stream, step }),
        }
    }
}

/// For rank zero between two flows: has the others, who [`Suspension::follow_and_show`], show the fields of
/// the last one.
pub fn ask_for_fields(ranks: &dyn Communicator, frame: FrameName) {
    Order::Show(frame).share(ranks);
}

impl<const D: usize> Suspension<D>
where
    Dim<D>: Space<D>,
{
    /// The flow around particles at these places, under these forces and torques, with this multiple of the
    /// shear. All ranks call this with the same numbers.
    ///
    /// # Errors
    /// [`SuspensionError`], on all ranks.
    pub fn solve(
        &self,
        ranks: &dyn Communicator,
        positions: &[Vector<D>],
        wrenches: &[Wrench<D>],
        shear_factor: f64,
    ) -> Result<MyFlow<D>, SuspensionError> {
        let balls = self.balls(positions);
        let tree_of_balls = BallTree::new(&balls);
        let wants =
            |lower: &Vector<D>, h: f64, level: u8| self.refinement.wants(lower, h, level, &tree_of_balls);
        let periodic = self.periods.map(|period| period.is_some());
        let tree = |depth: u8| ImplicitTree::new(self.domain, self.roots, periodic, depth, &wants);
        let deepest = self.refinement.deepest();
        let mut whole = tree(deepest)?;
        let mut cuts = cuts_of_work(&whole, &tree_of_balls, ranks);
        let used = finest_level(&mut whole, &cuts.of(ranks.rank()), ranks);
        if used < deepest {
            // Cells as deep as gaps might ask for are not there: the lattice is that of the finest there are.
            whole = tree(used)?;
            cuts = cuts_of_work(&whole, &tree_of_balls, ranks);
        }
        let (middle, rate) = (self.domain.center()[1], shear_factor * self.shear_rate);
        let shear = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { rate * (x[1] - middle) } else { 0.0 });
        let balls = &balls;
        Ok(match self.formulation {
            Formulation::RigidDofs { offset, cut_cell_pressures: CutCellPressures::Aggregate } => {
                let bodies = RigidBodies { balls, offset, wrenches };
                self.flow.solve_around(&bodies, &mut whole, &cuts, ranks, &shear)?
            }
            Formulation::Unfitted { lubrication } => {
                let bodies = SurfaceBodies { balls, lubrication, wrenches };
                self.flow.solve_around_surfaces(&bodies, &mut whole, &cuts, ranks, &shear)?
            }
            _ => return Err(SuspensionError::Formulation),
        })
    }

    fn balls(&self, positions: &[Vector<D>]) -> Vec<Ball<D>> {
        let ball = |(&place, &radius): (&Vector<D>, &f64)| Ball::periodic(place, radius, self.periods);
        positions.iter().zip(&self.radii).map(ball).collect()
    }

    /// Does what rank zero asks for with its [`SharedHydrodynamics::leading`], until that ends. All other
    /// ranks call this.
    pub fn follow(&self, ranks: &dyn Communicator) {
        self.follow_and_show(ranks, &mut |_, _| {});
    }

    /// The same, and hands `show` the fields in the cells of this rank when rank zero [asks](ask_for_fields)
    /// for them: none if there is no flow.
    pub fn follow_and_show(
        &self,
        ranks: &dyn Communicator,
        show: &mut dyn FnMut(FrameName, Option<Fields<D>>),
    ) {
        let (mut told, mut last) = (Told::new(self), None::<MyFlow<D>>);
        loop {
            match Order::End.share(ranks) {
                Order::End => return,
                Order::Predict => {
                    told.share(ranks);
                    // Its memory is free for the next.
                    drop(last.take());
                    // An error is one on all ranks: rank zero says what it is.
                    last = self.solve(ranks, &told.positions, &told.wrenches, told.shear_factor).ok();
                }
                Order::Show(frame) => {
                    show(frame, last.as_ref().map(|flow| flow.fields(&self.balls(&told.positions))));
                }
            }
        }
    }
}

/// Level of the smallest leaves of all ranks.
fn finest_level<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    own: &std::ops::Range<u64>,
    ranks: &dyn Communicator,
) -> u8 {
    let mut finest = 0;
    let depth = tree.max_level();
    tree.for_each_leaf(depth, own, |leaf| finest = finest.max(leaf.level));
    ranks.all_gather(&[u64::from(finest)]).into_iter().max().map_or(0, |level| level as u8)
}

/// What rank zero tells the others.
#[derive(Clone, Debug)]
struct Told<const D: usize>
where
    Dim<D>: Space<D>,
{
    positions: Vec<Vector<D>>,
    wrenches: Vec<Wrench<D>>,
    shear_factor: f64,
}

impl<const D: usize> Told<D>
where
    Dim<D>: Space<D>,
{
    fn new(suspension: &Suspension<D>) -> Self {
        let count = suspension.radii.len();
        let wrenches = match suspension.wrenches.len() {
            0 => vec![Wrench::default(); count],
            _ => suspension.wrenches.clone(),
        };
        Self { positions: vec![Vector::zeros(); count], wrenches, shear_factor: 1.0 }
    }

    /// Replaces all by what rank zero says.
    fn share(&mut self, ranks: &dyn Communicator) {
        let mut numbers = vec![self.shear_factor];
        numbers.extend(self.positions.iter().flatten());
        for wrench in &self.wrenches {
            numbers.extend(wrench.force.iter().chain(Dim::<D>::spin_slice(&wrench.torque)));
        }
        ranks.share(&mut numbers);
        let mut told = numbers.into_iter();
        let mut next = || told.next().unwrap_or_default();
        self.shear_factor = next();
        for position in &mut self.positions {
            position.iter_mut().for_each(|x| *x = next());
        }
        for wrench in &mut self.wrenches {
            wrench.force.iter_mut().for_each(|f| *f = next());
            (0..Dim::<D>::ROT).for_each(|k| wrench.torque[k] = next());
        }
    }
}

/// The flow of a suspension as a model of how its particles move.
pub struct SharedHydrodynamics<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    suspension: &'a Suspension<D>,
    ranks: &'a dyn Communicator,
    told: Told<D>,
    /// Whether others follow and are to be told of the end.
    leads: bool,
    /// Whether a prediction has begun and not ended.
    is_predicting: bool,
    /// Of the last prediction, if it succeeded.
    last: Option<MyFlow<D>>,
    statistics: FlowStatistics,
}

impl<'a, const D: usize> SharedHydrodynamics<'a, D>
where
    Dim<D>: Space<D>,
{
    /// For ranks that all make the same predictions.
    pub fn beside(suspension: &'a Suspension<D>, ranks: &'a dyn Communicator) -> Self {
        let (told, statistics) = (Told::new(suspension), FlowStatistics::default());
        Self { suspension, ranks, told, leads: false, is_predicting: false, last: None, statistics }
    }

    /// For rank zero, while the others [`Suspension::follow`].
    pub fn leading(suspension: &'a Suspension<D>, ranks: &'a dyn Communicator) -> Self {
        let mut new = Self::beside(suspension, ranks);
        new.leads = true;
        new
    }
}

impl<const D: usize> Drop for SharedHydrodynamics<'_, D>
where
    Dim<D>: Space<D>,
{
    fn drop(&mut self) {
        // A rank that panics ends the others anyhow.
        if std::thread::panicking() {
            return;
        }
        assert!(!self.is_predicting, "a flow that other ranks share was broken off");
        if self.leads {
            Order::End.share(self.ranks);
        }
    }
}

impl<const D: usize> Hydrodynamics<D> for SharedHydrodynamics<'_, D>
where
    Dim<D>: Space<D>,
{
    type Error = SuspensionError;

    fn predict(
        &mut self,
        _t: f64,
        particles: &[Particle<D>],
        twists: &mut [Twist<D>],
    ) -> Result<(), SuspensionError> {
        let Self { suspension, ranks, told, .. } = self;
        let places = particles.iter().map(|particle| particle.pose.position);
        told.positions.iter_mut().zip(places).for_each(|(told, place)| *told = place);
        self.is_predicting = true;
        Order::Predict.share(*ranks);
        told.share(*ranks);
        self.last = None;
        let start = std::time::Instant::now();
        let flow = suspension.solve(*ranks, &told.positions, &told.wrenches, told.shear_factor);
        self.is_predicting = false;
        let flow = flow?;
        twists.copy_from_slice(&flow.twists);
        self.statistics = FlowStatistics {
            cell_count: flow.cell_count,
            dof_count: flow.dof_count,
            solve_count: 1,
            iteration_count: flow.iterations,
            residual: flow.relative_residual,
            phases: vec![("shared flow", start.elapsed().as_secs_f64())],
        };
        self.last = Some(flow);
        Ok(())
    }

    fn set_shear_factor(&mut self, factor: f64) {
        self.told.shear_factor = factor;
    }

    fn set_wrenches(&mut self, wrenches: &[Wrench<D>]) -> Result<(), NoForces> {
        self.told.wrenches = Told::new(self.suspension).wrenches;
        for (acting, more) in self.told.wrenches.iter_mut().zip(wrenches) {
            acting.force += more.force;
            acting.torque += more.torque;
        }
        Ok(())
    }

    fn films(&self, reach: f64) -> Vec<Film<D>> {
        let lubrication = Lubrication::Deficit;
        if self.last.is_none() || self.suspension.formulation != (Formulation::Unfitted { lubrication }) {
            return Vec::new();
        }
        let (balls, domain) = (self.suspension.balls(&self.told.positions), &self.suspension.domain);
        let mut films = gluey_stokes::films(&balls, domain, reach);
        films.retain(|film| !film.is_across_flow());
        let film = |film: gluey_stokes::Film<D>| Film {
            first: film.body as usize,
            second: film.side(1),
            branch: film.branch(),
            slide: Vector::zeros(),
            is_held: [false; 2],
            gap: film.gap,
            curvature_radius: film.curvature_radius(),
        };
        films.into_iter().map(film).collect()
    }

    fn statistics(&self) -> FlowStatistics {
        self.statistics.clone()
    }

    /// Those in the cells of this rank.
    fn fields(&self) -> Option<Fields<D>> {
        self.last.as_ref().map(|flow| flow.fields(&self.suspension.balls(&self.told.positions)))
    }
}
