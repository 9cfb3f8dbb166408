//! One V-cycle on the velocities, as the serial solver runs it for bodies that are eliminated: loads go down
//! as they are, and each level but the finest smooths once on the way up.

use gluey_fem::{ImplicitTree, Interpolation};
use gluey_geom::{Dim, Space};
use gluey_parallel::Communicator;
use gluey_stokes::part::coarsest_level;

use crate::agreement::agreed;
use crate::bodies::Shared;
use crate::coarse::WholeLevel;
use crate::flow::FlowError;
use crate::level::{Level, LevelOperator};
use crate::space::{Around, LevelSpace, ghost_plan};

pub struct VCycle<'a, const D: usize> {
    /// Coarsest first.
    pub levels: Vec<Level<'a, D>>,
    /// `transfers[l]` joins level `l` to level `l + 1`.
    transfers: Vec<Interpolation<D>>,
    /// On rank zero.
    coarse: Option<WholeLevel>,
}

impl<'a, const D: usize> VCycle<'a, D>
where
    Dim<D>: Space<D>,
{
    /// Under a smoother of the finest level elsewhere, for which its part is to hold more. All ranks call
    /// this.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'a, '_, D>,
        viscosity: f64,
        around: &Around<'_, D>,
    ) -> Result<Self, FlowError> {
        let ranks = shared.ranks;
        let finest = tree.max_level();
        let coarsest = coarsest_level(tree.frame().roots()).min(finest);
        let mut levels = Vec::new();
        for depth in coarsest..=finest {
            // Rank zero holds all of the coarsest level: what it lacks are ghosts.
            let all = (depth == coarsest && ranks.rank() == 0).then(|| 0..tree.end());
            let around = (depth == finest).then_some(around);
            let space = LevelSpace::new(tree, depth, shared, all, around);
            let plans = ghost_plan(tree, shared, &space);
            let mut level = Level::new(ranks, space, plans, viscosity)?;
            if depth > coarsest && depth < finest {
                level.relax_near_bodies(tree, shared, viscosity);
            }
            levels.push(level);
        }
        let transfer = |pair: &[Level<'a, D>]| {
            let [coarse, fine] = [0, 1].map(|k| &pair[k].operator.space);
            Interpolation::of_parts(&coarse.part, coarse.velocity.map.clone(), &fine.part, &fine.velocity.map)
        };
        let transfers = levels.windows(2).map(transfer).collect();
        let coarse =
            (ranks.rank() == 0).then(|| WholeLevel::new(&levels[0].operator.space, shared, viscosity));
        let coarse = agreed(ranks, coarse.transpose())?;
        Ok(Self { levels, transfers, coarse })
    }

    /// `z = V b` on the finest level.
    pub fn run(&mut self) {
        for fine in (1..self.levels.len()).rev() {
            let (below, above) = self.levels.split_at_mut(fine);
            let (coarse, fine_level) = (&mut below[fine - 1], &mut above[0]);
            let Level { operator, b, nodal, .. } = fine_level;
            operator.spread(b, nodal);
            let LevelOperator { space, y, .. } = &mut coarse.operator;
            self.transfers[fine - 1].restrict::<D>(nodal, &mut y[..space.nodal_dim()]);
            coarse.operator.reduce();
            coarse.operator.gather(&mut coarse.b);
        }
        self.solve_coarsest();
        for fine in 1..self.levels.len() {
            let (below, above) = self.levels.split_at_mut(fine);
            let (coarse, fine_level) = (&mut below[fine - 1], &mut above[0]);
            coarse.operator.scatter(&coarse.z);
            coarse.operator.expand();
            let LevelOperator { space, x, .. } = &coarse.operator;
            let Level { operator, z, .. } = fine_level;
            let nodal = operator.space.owned_nodal_dim();
            self.transfers[fine - 1].prolong::<D>(&x[..space.nodal_dim()], &mut z[..nodal]);
            operator.project(z);
            if fine + 1 < self.levels.len() {
                self.levels[fine].smooth();
            }
        }
    }

    /// All loads to rank zero, and its answers to their owners: its own ones and those of ghosts.
    fn solve_coarsest(&mut self) {
        let Level { operator, b, z, .. } = &mut self.levels[0];
        operator.scatter(b);
        operator.y.fill(0.0);
        if let Some(level) = &mut self.coarse {
            level.solve(&operator.space, &operator.x, &mut operator.y);
        }
        operator.gather(z);
    }
}
