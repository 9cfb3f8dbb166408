//! The last flows at the nodes of another mesh.

use gluey_fem::TreeMesh;
use gluey_geom::Dim;
use gluey_levelset::Ball;
use gluey_parallel::Communicator;
use gluey_stokes::{Discretisation, NodalFields, Partition};

use super::films::{self, KeptFilm};
use super::flows::{FlowPiece, GlobalState, KeptFlows, MOST, Values};

/// The last flows at the nodes of other cells.
pub struct TransferredFlows {
    /// At all nodes of the part; right at those of own cells.
    pub flows: Vec<Values>,
    pub small: GlobalState,
}

impl<const D: usize> KeptFlows<D> {
    /// After a flow of which `last` is kept, for the bodies near the part, and the flows before it on its
    /// cells. All ranks call this.
    pub fn new(
        frame: &TreeMesh<D>,
        partition: &Partition<D>,
        last: NodalFields,
        before: Option<TransferredFlows>,
    ) -> Self {
        let NodalFields { velocity, pressure, bodies: motions, films } = last;
        let (mut flows, mut small) = (vec![[velocity, pressure]], GlobalState::default());
        small.bodies.push(motions_of_all(partition, &motions));
        small.films = films::kept::<D>(&partition.bodies.ids, &films);
        if let Some(before) = before {
            flows.extend(before.flows);
            small.bodies.extend(before.small.bodies);
            small.films.extend(before.small.films.into_iter().map(KeptFilm::older));
        }
        flows.truncate(MOST);
        small.bodies.truncate(MOST);
        small.films.retain(|film| film.age() < MOST);
        let piece = FlowPiece {
            run: partition.ranks.rank(),
            mesh: partition.part.mesh.clone(),
            cells: partition.part.own(),
            velocity_nodes: partition.velocity.map.clone(),
            pressure_nodes: partition.pressure.map.clone(),
            flows,
        };
        Self { frame: frame.clone(), cuts: partition.cuts.clone(), pieces: vec![piece], small }
    }

    /// The flows at the nodes of the own cells of a part. All ranks call this.
    pub fn moved(&self, to: &Discretisation<D>) -> TransferredFlows {
        let ranks = &to.partition().expect("the mesh is a part").ranks;
        let [velocities, pressures] = [(&to.velocity, D), (&to.pressure, 1)]
            .map(|(nodes, components)| self.at_nodes(ranks, nodes, to.own_cells(), components));
        let flows = velocities.into_iter().zip(pressures).map(|(velocity, pressure)| [velocity, pressure]);
        TransferredFlows { flows: flows.collect(), small: self.small.clone() }
    }
}

impl TransferredFlows {
    /// The last flow and the one before, with the bodies and films near a part, if they are known. Keeps what
    /// all ranks know of films by first bodies that this rank owns. All ranks call this.
    pub fn near<const D: usize>(
        &mut self,
        partition: &Partition<D>,
        balls: &[Ball<D>],
    ) -> [Option<NodalFields>; MOST] {
        let films = films::exchanged(partition, balls, &mut self.small.films);
        let (ids, n) = (&partition.bodies.ids, Dim::<D>::RIGID);
        let fields = |age: usize| {
            let [velocity, pressure] = self.flows.get(age)?.clone();
            let all = &self.small.bodies[age];
            let of_body = |&id: &u32| &all[id as usize * n..][..n];
            let near = ids.iter().flat_map(of_body).copied().collect();
            let films = films::near::<D>(ids, films.iter().filter(|film| film.age() == age));
            Some(NodalFields { velocity, pressure, bodies: near, films })
        };
        std::array::from_fn(fields)
    }
}

/// The motions of all bodies, of which each rank has its own.
fn motions_of_all<const D: usize>(partition: &Partition<D>, motions: &[f64]) -> Vec<f64> {
    let n = Dim::<D>::RIGID;
    let mut own = vec![0.0; motions.len()];
    partition.own_bodies().for_each(|body| own[body * n..][..n].copy_from_slice(&motions[body * n..][..n]));
    partition.sums_of_bodies(&own, n)
}
