//! What is known of a flow around surfaces by sums over ranks: means, motions of bodies, what acts on them,
//! stresses.

use gluey_geom::{Dim, Matrix, Space, Twist, Vector, Wrench};
use gluey_levelset::{Ball, Body};
use gluey_parallel::Communicator;
use gluey_stokes::part::FluidIntegrals;
use gluey_stokes::{Given, Problem, Stress};

use super::context::SolveContext;
use crate::agreement::agreed;
use crate::bodies::rigid;
use crate::flow::FlowError;

impl<'a, const D: usize> SolveContext<'_, 'a, D>
where
    Dim<D>: Space<D>,
{
    /// Integrals over the fluid of all ranks.
    pub(super) fn integrals(&self, problem: &Problem<D>, fields: [&[f64]; 2]) -> FluidIntegrals<D> {
        let own = problem.fluid_integrals(fields);
        let mut sums = vec![own.volume, own.pressure];
        sums.extend(own.velocity.iter());
        self.shared.ranks.sum(&mut sums);
        let velocity = Vector::from_column_slice(&sums[2..]);
        FluidIntegrals { volume: sums[0], pressure: sums[1], velocity }
    }

    /// The mean velocity over fluid and bodies, as in one process: the bodies take what the fluid
    /// leaves of the box, in proportion to their volumes.
    fn mean_velocity(
        &self,
        problem: &Problem<D>,
        velocity: &[f64],
        integrals: &FluidIntegrals<D>,
    ) -> Vector<D> {
        let whole_box: f64 = self.level.part.mesh.domain().extent().product();
        let balls = self.shared.bodies.balls();
        let volume = |ball: &Ball<D>| ball.bounding_radius().powi(D as i32);
        let all: f64 = balls.iter().map(volume).sum();
        let twists = self.twists_of_all(problem, velocity);
        let share = |ball: &Ball<D>| (whole_box - integrals.volume) * volume(ball) / all;
        let of_bodies = balls.iter().zip(&twists).map(|(ball, twist)| twist.velocity * share(ball));
        (integrals.velocity + of_bodies.sum::<Vector<D>>()) / whole_box
    }

    /// The mean velocity where bodies are held; where all are free and no wall is there, it is taken out of a
    /// flow.
    pub(super) fn mean_flow(
        &self,
        problem: &Problem<D>,
        [velocity, whole]: [&mut Vec<f64>; 2],
        integrals: &FluidIntegrals<D>,
    ) -> Option<Vector<D>> {
        let holds_any = !self.shared.held.is_empty();
        if !holds_any && self.level.part.mesh.periodic().contains(&false) {
            return None;
        }
        let mean = self.mean_velocity(problem, velocity, integrals);
        if !holds_any {
            problem.subtract_uniform(&mean, velocity, whole);
        }
        holds_any.then_some(mean)
    }

    /// Forces and torques on all bodies: those that are given, or what held ones lack.
    pub(super) fn wrenches(
        &self,
        problem: &Problem<D>,
        velocity: &[f64],
        whole: &[f64],
    ) -> Result<Vec<Wrench<D>>, FlowError> {
        let all = self.shared.bodies.balls().len();
        match self.conditions.bodies {
            Given::Wrenches([]) => return Ok(vec![Wrench::default(); all]),
            Given::Wrenches(given) => return Ok(given.to_vec()),
            _ => {}
        }
        let own = self.named(problem.own_wrenches(self.conditions, velocity, whole));
        let (own, n) = (agreed(self.shared.ranks, own)?, rigid::<D>());
        let mut numbers = vec![0.0; all * n];
        for (&id, wrench) in self.bodies.ids.iter().zip(&own) {
            let sums = &mut numbers[id as usize * n..][..n];
            sums[..D].copy_from_slice(wrench.force.as_slice());
            sums[D..].copy_from_slice(Dim::<D>::spin_slice(&wrench.torque));
        }
        self.shared.ranks.sum(&mut numbers);
        let lacking = |body: usize| {
            let mut wrench = Wrench::default();
            wrench.force.copy_from_slice(&numbers[body * n..][..D]);
            (D..n).for_each(|k| wrench.torque[k - D] = numbers[body * n + k]);
            wrench
        };
        let given = |body: usize| match self.conditions.bodies {
            Given::Each(each) => each[body].wrench(),
            _ => None,
        };
        Ok((0..all).map(|body| given(body).unwrap_or_else(|| lacking(body))).collect())
    }

    /// The stress of a flow.
    pub(super) fn stress(
        &self,
        problem: &Problem<D>,
        fields: [&[f64]; 2],
        whole: &[f64],
    ) -> Result<Stress<D>, FlowError> {
        let own = self.named(problem.own_stress(&self.conditions.strain, fields, whole));
        let own = agreed(self.shared.ranks, own)?;
        let (all, n) = (self.shared.bodies.balls().len(), D * D);
        let mut numbers = vec![0.0; 2 * all * n];
        for (half, moments) in [&own.moments, &own.of_films].into_iter().enumerate() {
            for (&id, moment) in self.bodies.ids.iter().zip(moments) {
                numbers[(half * all + id as usize) * n..][..n].copy_from_slice(moment.as_slice());
            }
        }
        numbers.extend([own.dissipation, own.dissipation_of_films]);
        self.shared.ranks.sum(&mut numbers);
        let moments = |half: usize| {
            let entries = numbers[half * all * n..][..all * n].chunks_exact(n);
            entries.map(Matrix::<D>::from_column_slice).collect()
        };
        let [dissipation, dissipation_of_films] = [0, 1].map(|k| numbers[2 * all * n + k]);
        Ok(Stress { moments: moments(0), of_films: moments(1), dissipation, dissipation_of_films })
    }

    /// The twists of all bodies, of which each rank has its own.
    pub(super) fn twists_of_all(&self, problem: &Problem<D>, velocity: &[f64]) -> Vec<Twist<D>> {
        let (all, n) = (self.shared.bodies.balls().len(), rigid::<D>());
        if all == 0 {
            return Vec::new();
        }
        let mut numbers = vec![0.0; all * n];
        for body in self.bodies.owned(self.shared.ranks.rank()) {
            let twist = problem.system.space.twist(velocity, body as usize);
            let own = &mut numbers[self.bodies.ids[body as usize] as usize * n..][..n];
            own[..D].copy_from_slice(twist.velocity.as_slice());
            own[D..].copy_from_slice(Dim::<D>::spin_slice(&twist.spin));
        }
        self.shared.ranks.sum(&mut numbers);
        let twist = |numbers: &[f64]| {
            let mut twist = Twist::default();
            twist.velocity.copy_from_slice(&numbers[..D]);
            (D..n).for_each(|k| twist.spin[k - D] = numbers[k]);
            twist
        };
        numbers.chunks_exact(n).map(twist).collect()
    }
}
