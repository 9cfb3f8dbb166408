//! The flow around particles that move, step after step, on ranks.
//!
//! Ranks share the flow, and contacts. What is small is not shared: where particles are, how they move, what
//! contacts remember. Rank zero leads: it knows when a flow is wanted and tells the others where the
//! particles are. The others follow, or do the same work on their particles beside it; what rank zero says
//! holds.

mod hydrodynamics;
mod memory;
mod told;

pub use hydrodynamics::SharedHydrodynamics;
pub use memory::Memory;
pub(crate) use told::Order;
pub use told::{FrameName, ask_for_fields, ask_to_keep};

use gluey_fem::{ImplicitTree, MeshError};
use gluey_geom::{Aabb, Dim, Lattice, Matrix, Space, Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree};
use gluey_motion::Fields;
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::{Conditions, Field, GivenOf, Lubrication, Refinement};

use crate::contact::ContactFollower;
use crate::cuts::cuts_of_work;
use crate::flow::{BoxFlow, FlowError, MyFlow};
use crate::surface::{SharedTree, SurfaceBodies};
use crate::warm_start::SavedPiece;
use told::Told;

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
    /// Periods along its axes, where it has some. Without walls it is sheared for ever.
    pub periods: [Option<f64>; D],
    /// How the mesh follows the particles.
    pub refinement: Refinement,
    /// Treatment of films that are too thin for the mesh.
    pub lubrication: Lubrication,
    /// Radii of the particles.
    pub radii: Vec<f64>,
    /// Forces and torques on them, or no entries for none on any.
    pub wrenches: Vec<Wrench<D>>,
    /// Motions of the particles that are held or driven while the shear is not reversed, or no entries where
    /// all are free.
    pub given: Vec<Option<Twist<D>>>,
    /// Force per unit of volume on fluid and particles, between walls or where particles are held. Where
    /// particles are held in a box without walls and it is not given, it is what stops the mean flow.
    pub force_density: Option<Vector<D>>,
    /// The shear rate; where the stress is given, one or minus one.
    pub shear_rate: f64,
    /// The shear stress that is given in place of the rate, in a box without walls around free particles.
    pub shear_stress: Option<f64>,
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
    /// The forces between particles drive them faster than the stress that is given.
    #[error(
        "shear_stress = {stress}: the suspension would flow backwards, for the stress of its repulsion at rest is \
         {at_rest:.6}; take a larger stress or less repulsion"
    )]
    NotDriven {
        /// The stress that is given.
        stress: f64,
        /// That at rest.
        at_rest: f64,
    },
}

/// Solves for a flow under some conditions.
type Solve<'s, const D: usize> = dyn FnMut(&Conditions<'_, D>) -> Result<MyFlow<D>, FlowError> + 's;

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
        ranks: &Ranks,
        positions: &[Vector<D>],
        wrenches: &[Wrench<D>],
        shear_factor: f64,
    ) -> Result<MyFlow<D>, SuspensionError> {
        let told = Told { positions: positions.to_vec(), wrenches: wrenches.to_vec(), ..Told::new(self) };
        Ok(self.solve_as_told(ranks, &Told { shear_factor, ..told }, &Memory::default())?.0)
    }

    /// Whether the box has no walls.
    fn is_sheared(&self) -> bool {
        self.periods.iter().all(Option::is_some)
    }

    /// The flow, and where the stress is given the rate by which it is to be multiplied. The first
    /// solve starts from the flows in memory, and its flow is kept there for the next.
    fn solve_as_told(
        &self,
        ranks: &Ranks,
        told: &Told<D>,
        memory: &Memory<D>,
    ) -> Result<(MyFlow<D>, f64), SuspensionError> {
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
        let deepest = self.refinement.surface;
        let mut whole = tree(deepest)?;
        let mut cuts = cuts_of_work(&whole, &tree_of_balls, ranks);
        let used = finest_level(&mut whole, &cuts.of(ranks.rank()), ranks);
        if used < deepest {
            whole = tree(used)?;
            cuts = cuts_of_work(&whole, &tree_of_balls, ranks);
        }
        let shear = self.undisturbed(told.shear_factor);
        let bodies = SurfaceBodies { balls: &balls, lubrication: self.lubrication };
        let mut kept = memory.last.take();
        let mut first = Some(&mut kept);
        let mut leaves = SharedTree { tree: &mut whole, cuts: &cuts, ranks };
        let mut solve = |conditions: &Conditions<'_, D>| {
            self.flow.solve_from(&bodies, &mut leaves, conditions, first.take())
        };
        let found = match (self.is_sheared(), self.shear_stress) {
            (true, Some(stress)) => self.at_stress(stress, told, &mut solve)?,
            (true, None) => (self.sheared(told, &mut solve)?, 1.0),
            (false, _) => (self.between_walls(told, &shear, &mut solve)?, 1.0),
        };
        memory.last.replace(kept);
        Ok(found)
    }

    /// The motion that is given to a particle now.
    fn given_twist(&self, particle: usize, shear_factor: f64) -> Option<Twist<D>> {
        self.given.get(particle).copied().flatten().map(|twist| twist * shear_factor)
    }

    /// What is known of each particle in a flow relative to one that moves with `undisturbed` at its centre;
    /// no entries where all are free.
    fn given_bodies(&self, told: &Told<D>, undisturbed: impl Fn(&Vector<D>) -> Twist<D>) -> Vec<GivenOf<D>> {
        let of = |(particle, place): (usize, &Vector<D>)| {
            let given = self.given_twist(particle, told.shear_factor);
            given.map_or_else(
                || GivenOf::Wrench(told.wrenches[particle]),
                |twist| GivenOf::Twist(twist - undisturbed(place)),
            )
        };
        match self.given.is_empty() {
            true => Vec::new(),
            false => told.positions.iter().enumerate().map(of).collect(),
        }
    }

    /// The flow in a box with walls or Couette flow around.
    fn between_walls(
        &self,
        told: &Told<D>,
        shear: Field<'_, D>,
        solve: &mut Solve<'_, D>,
    ) -> Result<MyFlow<D>, FlowError> {
        let given = self.given_bodies(told, |_| Twist::default());
        let density = self.force_density.unwrap_or_else(Vector::zeros);
        let uniform = move |_: &Vector<D>| density;
        let conditions = match given[..] {
            [] => Conditions::boundary(shear).with_wrenches(&told.wrenches),
            _ => Conditions::boundary(shear).with_bodies(&given),
        };
        let force: Option<Field<'_, D>> = if density.norm() > 0.0 { Some(&uniform) } else { None };
        solve(&conditions.with_force(force))
    }

    /// The flow in a box that is sheared for ever, with the motions in space. Where all particles are free,
    /// what acts on them is balanced by a uniform force on all of the box; forces between them have no sum.
    /// Where some are held, these carry all of it.
    fn sheared(&self, told: &Told<D>, solve: &mut Solve<'_, D>) -> Result<MyFlow<D>, FlowError> {
        let (mut gradient, undisturbed) = (Matrix::<D>::zeros(), self.undisturbed_twist(told.shear_factor));
        gradient[(0, 1)] = self.shear_rate * told.shear_factor;
        let given = self.given_bodies(told, &undisturbed);
        let total: Vector<D> = self.wrenches.iter().map(|wrench| wrench.force).sum();
        let back = match given[..] {
            [] => -total / self.domain.extent().product(),
            _ => self.force_density.unwrap_or_else(Vector::zeros),
        };
        let uniform = move |_: &Vector<D>| back;
        let conditions = Conditions::in_linear_flow(&gradient);
        let conditions = match given[..] {
            [] => Conditions { stress: told.with_stress, ..conditions.with_wrenches(&told.wrenches) },
            _ if self.force_density.is_none() => conditions.with_bodies(&given).without_mean_flow(),
            _ => conditions.with_bodies(&given),
        };
        let conditions = if back.norm() > 0.0 { conditions.with_force(Some(&uniform)) } else { conditions };
        let mut flow = solve(&conditions)?;
        for (twist, place) in flow.twists.iter_mut().zip(&told.positions) {
            *twist = *twist + undisturbed(place);
        }
        Ok(flow)
    }

    /// The flow at the shear stress that is given, its velocities by the strain, and its rate: the stress is
    /// `r A + B`, `A` of the flow at the rate one and `B` of the forces between particles at rest.
    fn at_stress(
        &self,
        stress: f64,
        told: &Told<D>,
        solve: &mut Solve<'_, D>,
    ) -> Result<(MyFlow<D>, f64), SuspensionError> {
        let direction = self.shear_rate * told.shear_factor;
        let volume = self.domain.extent().product();
        let of_bodies =
            |flow: &MyFlow<D>| flow.stress.as_ref().map_or(0.0, |stress| stress.of_bodies(volume)[(0, 1)]);
        let wrenches = vec![Wrench::default(); told.wrenches.len()];
        let without = Told { wrenches, with_stress: true, ..told.clone() };
        let flow = self.sheared(&without, solve)?;
        let at_rate_one = self.flow.viscosity * direction + of_bodies(&flow);
        if told.wrenches.iter().all(|wrench| wrench.force.amax() == 0.0) {
            return Ok((flow, direction * stress / at_rate_one));
        }
        let pushed = solve(&Conditions::at_rest().with_wrenches(&told.wrenches).with_stress())?;
        let at_rest = told.pair_stress + of_bodies(&pushed);
        let rate = (direction * stress - at_rest) / at_rate_one;
        if rate <= 0.0 || rate.is_nan() {
            return Err(SuspensionError::NotDriven { stress, at_rest: direction * at_rest });
        }
        let wrenches = told.wrenches.iter().map(|wrench| *wrench * rate.recip()).collect();
        let mut both = self.sheared(&Told { wrenches, with_stress: true, ..told.clone() }, solve)?;
        both.solve_count += flow.solve_count + pushed.solve_count;
        both.raised_penalties += flow.raised_penalties;
        both.raised_penalties += pushed.raised_penalties;
        both.iterations += flow.iterations + pushed.iterations;
        Ok((both, rate))
    }

    /// The undisturbed velocity.
    fn undisturbed(&self, shear_factor: f64) -> impl Fn(&Vector<D>) -> Vector<D> + use<D> {
        let (middle, rate) = (self.domain.center()[1], shear_factor * self.shear_rate);
        move |x| Vector::from_fn(|d, _| if d == 0 { rate * (x[1] - middle) } else { 0.0 })
    }

    /// The motion with the undisturbed velocity at a point and its spin.
    fn undisturbed_twist(&self, shear_factor: f64) -> impl Fn(&Vector<D>) -> Twist<D> + use<D> {
        let (velocity, rate) = (self.undisturbed(shear_factor), shear_factor * self.shear_rate);
        move |x| {
            let mut twist = Twist { velocity: velocity(x), ..Twist::default() };
            // About z, the only axis in 2D and the last one in 3D.
            twist.spin[Dim::<D>::ROT - 1] = -0.5 * rate;
            twist
        }
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
    pub fn follow(&self, ranks: &Ranks) {
        self.follow_and_show(ranks, &mut |_, _| {});
    }

    /// The same, and hands `show` the fields in the cells of this rank when rank zero [asks](ask_for_fields)
    /// for them: none if there is no flow.
    pub fn follow_and_show(&self, ranks: &Ranks, show: &mut dyn FnMut(FrameName, Option<Fields<D>>)) {
        self.follow_for(ranks, &Memory::default(), &mut Showing(show));
    }

    /// The same with flows in `memory`, for a follower who keeps them too.
    pub fn follow_for(&self, ranks: &Ranks, memory: &Memory<D>, follower: &mut dyn Follower<D>) {
        let (mut told, mut last) = (Told::new(self), None::<MyFlow<D>>);
        let mut contact = ContactFollower::default();
        loop {
            match Order::End.share(ranks) {
                Order::End => return,
                Order::Predict => {
                    told.share(ranks);
                    // Its memory is free for the next.
                    drop(last.take());
                    // An error is one on all ranks: rank zero says what it is.
                    last = self.solve_as_told(ranks, &told, memory).ok().map(|(flow, _)| flow);
                }
                Order::Show(frame) => {
                    follower.show(frame, last.as_ref().map(|flow| self.fields(flow, &told)));
                }
                Order::Contact => {
                    // An error is one on all ranks here too.
                    let _ = contact.step(ranks);
                }
                Order::Remember => memory.remember(),
                Order::Keep(name) => follower.keep(name, memory.saved()),
            }
        }
    }
}

/// What other ranks do with flows when rank zero asks for it.
pub trait Follower<const D: usize> {
    /// Shows the fields in the cells of this rank; none if there is no flow.
    fn show(&mut self, frame: FrameName, fields: Option<Fields<D>>);

    /// Keeps for a checkpoint what the flow after it starts from.
    fn keep(&mut self, name: u64, pieces: Vec<SavedPiece>);
}

/// Shows fields and keeps nothing.
struct Showing<'s, const D: usize>(&'s mut dyn FnMut(FrameName, Option<Fields<D>>));

impl<const D: usize> Follower<D> for Showing<'_, D> {
    fn show(&mut self, frame: FrameName, fields: Option<Fields<D>>) {
        (self.0)(frame, fields);
    }

    fn keep(&mut self, _: u64, _: Vec<SavedPiece>) {}
}

/// Level of the smallest leaves of all ranks.
fn finest_level<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    own: &std::ops::Range<u64>,
    ranks: &Ranks,
) -> u8 {
    let mut finest = 0;
    let depth = tree.max_level();
    tree.for_each_leaf(depth, own, |leaf| finest = finest.max(leaf.level));
    ranks.all_gather(&[u64::from(finest)]).into_iter().max().map_or(0, |level| level as u8)
}
