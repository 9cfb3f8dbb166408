//! The last flows at the nodes of another mesh.

use gluey_fem::ImplicitTree;
use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::NodalFields;

use super::films::{self, KeptFilm};
use super::flows::{GlobalState, MOST, Piece, Values, WarmStart};
use crate::bodies::{NearBodies, Shared, rigid};
use crate::space::LevelSpace;

/// The last flows at the nodes of other cells.
pub struct TransferredFlows {
    /// At all nodes of the part; right at those of own cells.
    pub flows: Vec<Values>,
    pub small: GlobalState,
}

impl<const D: usize> WarmStart<D>
where
    Dim<D>: Space<D>,
{
    /// After a flow of which `last` is kept, for the bodies near the part, and the flows before it on its
    /// cells. All ranks call this.
    pub fn new(
        (tree, shared): (&ImplicitTree<'_, D>, &Shared<'_, '_, D>),
        level: &LevelSpace<D>,
        bodies: &NearBodies<D>,
        last: NodalFields,
        before: Option<TransferredFlows>,
    ) -> Self {
        let NodalFields { velocity, pressure, bodies: motions, films } = last;
        let (mut flows, mut small) = (vec![[velocity, pressure]], GlobalState::default());
        small.bodies.push(motions_of_all(shared, bodies, &motions));
        small.films = films::kept::<D>(&bodies.ids, &films);
        if let Some(before) = before {
            flows.extend(before.flows);
            small.bodies.extend(before.small.bodies);
            small.films.extend(before.small.films.into_iter().map(KeptFilm::older));
        }
        flows.truncate(MOST);
        small.bodies.truncate(MOST);
        small.films.retain(|film| film.age() < MOST);
        let piece = Piece {
            run: shared.ranks.rank(),
            mesh: level.part.mesh.clone(),
            cells: level.part.own(),
            velocity_nodes: level.velocity.map.clone(),
            pressure_nodes: level.pressure.map.clone(),
            flows,
        };
        Self { frame: tree.frame().clone(), cuts: shared.cuts.clone(), pieces: vec![piece], small }
    }

    /// The flows at the nodes of the cells of this rank. All ranks call this.
    pub fn moved(&self, ranks: &Ranks, level: &LevelSpace<D>) -> TransferredFlows {
        let own = level.part.own();
        let [velocities, pressures] = [(&level.velocity, D), (&level.pressure, 1)]
            .map(|(nodes, components)| self.at_nodes(ranks, (&nodes.map, own.clone()), components));
        let flows = velocities.into_iter().zip(pressures).map(|(velocity, pressure)| [velocity, pressure]);
        TransferredFlows { flows: flows.collect(), small: self.small.clone() }
    }
}

impl TransferredFlows {
    /// The last flow and the one before, with the bodies and films near a part, if they are known. Keeps what
    /// all ranks know of films by first bodies that this rank owns. All ranks call this.
    pub fn near<const D: usize>(
        &mut self,
        (tree, shared): (&ImplicitTree<'_, D>, &Shared<'_, '_, D>),
        bodies: &NearBodies<D>,
        first_bodies: &[u32],
    ) -> [Option<NodalFields>; MOST]
    where
        Dim<D>: Space<D>,
    {
        let asked: Vec<u32> = first_bodies.iter().map(|&place| bodies.ids[place as usize]).collect();
        let films = films::exchanged((tree, shared), &mut self.small.films, &asked);
        let n = rigid::<D>();
        let fields = |age: usize| {
            let [velocity, pressure] = self.flows.get(age)?.clone();
            let all = &self.small.bodies[age];
            let of_body = |&id: &u32| &all[id as usize * n..][..n];
            let near = bodies.ids.iter().flat_map(of_body).copied().collect();
            let films = films::near::<D>(&bodies.ids, films.iter().filter(|film| film.age() == age));
            Some(NodalFields { velocity, pressure, bodies: near, films })
        };
        std::array::from_fn(fields)
    }
}

/// The motions of all bodies, of which each rank has its own.
fn motions_of_all<const D: usize>(
    shared: &Shared<'_, '_, D>,
    bodies: &NearBodies<D>,
    motions: &[f64],
) -> Vec<f64> {
    let n = rigid::<D>();
    let mut all = vec![0.0; shared.bodies.balls().len() * n];
    for place in bodies.owned(shared.ranks.rank()) {
        let id = bodies.ids[place as usize] as usize;
        all[id * n..][..n].copy_from_slice(&motions[place as usize * n..][..n]);
    }
    shared.ranks.sum(&mut all);
    all
}
