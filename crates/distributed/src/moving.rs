//! The flow around particles that move, step after step, on ranks.
//!
//! Ranks share the flow. What is small is not shared: where particles are, how they move, which of them
//! touch. Rank zero leads: it knows when a flow is wanted and tells the others where the particles are. The
//! others follow, or do the same work on their particles beside it; what rank zero says holds.

use gluey_fem::{ImplicitTree, MeshError};
use gluey_geom::{Aabb, Dim, Lattice, Matrix, Particle, Space, Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_motion::{Fields, Film, FlowStatistics, Hydrodynamics, MeanStress, NoForces};
use gluey_parallel::Communicator;
use gluey_stokes::{Conditions, CutCellPressures, Formulation, Lubrication, Refinement};

use crate::cuts::{cuts_of_work, cuts_of_work_at_surfaces};
use crate::flow::{BoxFlow, FlowError, MyFlow, RigidBodies};
use crate::surface::SurfaceBodies;

/// A box with particles in a shear flow, `u = rate (y - middle) e_x` on its walls, or far away where it has
/// none: then its images in `y` slide along each other.
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
    /// Periods along its axes, where it has some. Without walls it is sheared for ever, by `unfitted` only.
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
    #[error(
        "ranks share flows of `unfitted`, and between walls of `rigid-dofs` with aggregated pressures, only"
    )]
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
        let told = Told { positions: positions.to_vec(), wrenches: wrenches.to_vec(), ..Told::new(self) };
        self.solve_as_told(ranks, &Told { shear_factor, ..told })
    }

    /// Whether the box has no walls.
    fn is_sheared(&self) -> bool {
        self.periods.iter().all(Option::is_some)
    }

    fn solve_as_told(&self, ranks: &dyn Communicator, told: &Told<D>) -> Result<MyFlow<D>, SuspensionError> {
        let balls = self.balls(told);
        let shear = balls.first().map_or(0.0, |ball| ball.lattice().shear());
        let tree_of_balls = BallTree::new(&balls);
        let wants =
            |lower: &Vector<D>, h: f64, level: u8| self.refinement.wants(lower, h, level, &tree_of_balls);
        let periodic = self.periods.map(|period| period.is_some());
        let tree = |depth: u8| {
            let tree = ImplicitTree::new(self.domain, self.roots, periodic, depth, &wants)?;
            Ok::<_, MeshError>(tree.sheared(shear))
        };
        let deepest = self.refinement.deepest();
        let mut whole = tree(deepest)?;
        let cuts_of = |tree: &ImplicitTree<'_, D>| match self.formulation {
            Formulation::Unfitted { .. } => cuts_of_work_at_surfaces(tree, &tree_of_balls, ranks),
            _ => cuts_of_work(tree, &tree_of_balls, ranks),
        };
        let mut cuts = cuts_of(&whole);
        let used = finest_level(&mut whole, &cuts.of(ranks.rank()), ranks);
        if used < deepest {
            // Cells as deep as gaps might ask for are not there: the lattice is that of the finest there are.
            whole = tree(used)?;
            cuts = cuts_of(&whole);
        }
        let shear = self.undisturbed(told.shear_factor);
        let (balls, wrenches) = (&balls, &told.wrenches[..]);
        Ok(match self.formulation {
            Formulation::RigidDofs { offset, cut_cell_pressures: CutCellPressures::Aggregate }
                if !self.is_sheared() =>
            {
                let bodies = RigidBodies { balls, offset, wrenches };
                self.flow.solve_around(&bodies, &mut whole, &cuts, ranks, &shear)?
            }
            Formulation::Unfitted { lubrication } => {
                let bodies = SurfaceBodies { balls, lubrication };
                let mut solve = |conditions: &Conditions<'_, D>| {
                    self.flow.solve_around_surfaces(&bodies, &mut whole, &cuts, ranks, conditions)
                };
                if !self.is_sheared() {
                    return Ok(solve(&Conditions::boundary(&shear).with_wrenches(wrenches))?);
                }
                self.sheared(told, &mut solve)?
            }
            _ => return Err(SuspensionError::Formulation),
        })
    }

    /// The flow in a box that is sheared for ever, with the motions in space.
    fn sheared(
        &self,
        told: &Told<D>,
        solve: &mut dyn FnMut(&Conditions<'_, D>) -> Result<MyFlow<D>, FlowError>,
    ) -> Result<MyFlow<D>, FlowError> {
        let (mut gradient, shear) = (Matrix::<D>::zeros(), self.undisturbed(told.shear_factor));
        gradient[(0, 1)] = self.shear_rate * told.shear_factor;
        // What acts on the particles is balanced by a uniform force on all of the box; forces between them
        // have no sum.
        let total: Vector<D> = self.wrenches.iter().map(|wrench| wrench.force).sum();
        let back = -total / self.domain.extent().product();
        let uniform = move |_: &Vector<D>| back;
        let conditions = Conditions::in_linear_flow(&gradient).with_wrenches(&told.wrenches);
        let conditions = if back.norm() > 0.0 { conditions.with_force(Some(&uniform)) } else { conditions };
        let mut flow = solve(&Conditions { stress: told.with_stress, ..conditions })?;
        for (twist, place) in flow.twists.iter_mut().zip(&told.positions) {
            twist.velocity += shear(place);
            // About z, the only axis in 2D and the last one in 3D.
            twist.spin[Dim::<D>::ROT - 1] -= 0.5 * gradient[(0, 1)];
        }
        Ok(flow)
    }

    /// The undisturbed velocity.
    fn undisturbed(&self, shear_factor: f64) -> impl Fn(&Vector<D>) -> Vector<D> + use<D> {
        let (middle, rate) = (self.domain.center()[1], shear_factor * self.shear_rate);
        move |x| Vector::from_fn(|d, _| if d == 0 { rate * (x[1] - middle) } else { 0.0 })
    }

    fn balls(&self, told: &Told<D>) -> Vec<Ball<D>> {
        let height = self.periods[1].unwrap_or(0.0);
        let lattice = Lattice::new(self.periods).tilted(told.strain * height);
        let origin = self.domain.lower[1];
        let ball = |(place, &radius): (&Vector<D>, &f64)| Ball::in_space(place, radius, &lattice, origin);
        told.positions.iter().zip(&self.radii).map(ball).collect()
    }

    /// The fields of a flow in the cells of a rank, in space.
    fn fields(&self, flow: &MyFlow<D>, told: &Told<D>) -> Fields<D> {
        let mut fields = flow.fields(&self.balls(told));
        if self.is_sheared() {
            let shear = flow.shear();
            let undisturbed = self.undisturbed(told.shear_factor);
            for (point, velocity) in fields.points.iter_mut().zip(&mut fields.velocity) {
                point[0] += shear * (point[1] - self.domain.lower[1]);
                *velocity += undisturbed(point);
            }
        }
        fields
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
                    last = self.solve_as_told(ranks, &told).ok();
                }
                Order::Show(frame) => {
                    show(frame, last.as_ref().map(|flow| self.fields(flow, &told)));
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
    /// Of the images in a box without walls.
    strain: f64,
    with_stress: bool,
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
        let positions = vec![Vector::zeros(); count];
        Self { positions, wrenches, shear_factor: 1.0, strain: 0.0, with_stress: false }
    }

    /// Replaces all by what rank zero says.
    fn share(&mut self, ranks: &dyn Communicator) {
        let mut numbers = vec![self.shear_factor, self.strain, f64::from(u8::from(self.with_stress))];
        numbers.extend(self.positions.iter().flatten());
        for wrench in &self.wrenches {
            numbers.extend(wrench.force.iter().chain(Dim::<D>::spin_slice(&wrench.torque)));
        }
        ranks.share(&mut numbers);
        let mut told = numbers.into_iter();
        let mut next = || told.next().unwrap_or_default();
        [self.shear_factor, self.strain] = [next(), next()];
        self.with_stress = next() > 0.0;
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

impl<const D: usize> SharedHydrodynamics<'_, D>
where
    Dim<D>: Space<D>,
{
    /// Velocity of the image at a film beyond that of its particle.
    fn slide(&self, film: &gluey_stokes::Film<D>) -> Vector<D> {
        let mut slide = Vector::zeros();
        if let (true, Some(second)) = (self.suspension.is_sheared(), film.side(1)) {
            let places = &self.told.positions;
            let direct = places[second][1] - places[film.body as usize][1];
            slide[0] = self.suspension.shear_rate * self.told.shear_factor * (film.branch()[1] - direct);
        }
        slide
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
        let flow = suspension.solve_as_told(*ranks, told);
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

    fn set_strain(&mut self, strain: f64, with_stress: bool) {
        if self.suspension.is_sheared() {
            (self.told.strain, self.told.with_stress) = (strain, with_stress);
        }
    }

    fn stress(&self) -> Option<MeanStress<D>> {
        let stress = self.last.as_ref()?.stress.as_ref()?;
        let volume = self.suspension.domain.extent().product();
        Some(MeanStress {
            rate: self.suspension.shear_rate * self.told.shear_factor,
            viscosity: self.suspension.flow.viscosity,
            of_bodies: stress.of_bodies(volume),
            of_films: stress.of_films.iter().sum::<Matrix<D>>() / volume,
            of_contacts: None,
            of_repulsion: Matrix::zeros(),
            dissipation: stress.dissipation / volume,
        })
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
        let (balls, domain) = (self.suspension.balls(&self.told), &self.suspension.domain);
        let mut films = gluey_stokes::films(&balls, domain, reach);
        films.retain(|film| !film.is_across_flow());
        let film = |film: gluey_stokes::Film<D>| Film {
            first: film.body as usize,
            second: film.side(1),
            branch: film.branch(),
            slide: self.slide(&film),
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
        self.last.as_ref().map(|flow| self.suspension.fields(flow, &self.told))
    }
}
