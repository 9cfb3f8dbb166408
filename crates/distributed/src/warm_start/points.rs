//! Values of kept flows at points, whichever rank has them.

use std::ops::Range;

use gluey_fem::{Evaluator, NodeMap};
use gluey_geom::Vector;
use gluey_parallel::{Communicator, Ranks, route};

use super::flows::{FlowPiece, KeptFlows, MOST};
use super::pieces::SavedPiece;

/// Numbers of a question: who asks, for which node, the run and up to three coordinates.
const QUESTION: usize = 6;
/// Numbers of an answer: the node, then up to three components of each flow.
const ANSWER: usize = 1 + 3 * MOST;

/// A point and the run that holds it.
type PointInRun<const D: usize> = (usize, Vector<D>);

impl<const D: usize> KeptFlows<D> {
    /// Number of flows that are kept, on all ranks.
    pub(super) fn flow_count(&self) -> usize {
        self.small.bodies.len()
    }

    /// Kept fields with this many components at nodes, right at those of some cells and zero elsewhere; for
    /// each flow. All ranks call this.
    pub(super) fn at_nodes(
        &self,
        ranks: &Ranks,
        nodes: &NodeMap<D>,
        cells: Range<usize>,
        components: usize,
    ) -> Vec<Vec<f64>> {
        let mut wanted: Vec<u32> = nodes.cells(cells).to_vec();
        wanted.sort_unstable();
        wanted.dedup();
        let (mut own, mut own_places, mut questions) = (Vec::new(), Vec::new(), Vec::new());
        for node in wanted {
            let point = nodes.point(node as usize);
            let run = self.run_of(&point);
            let holder = SavedPiece::holder(run, self.cuts.count(), ranks.size());
            if holder == ranks.rank() {
                own.push(node);
                own_places.push((run, point));
                continue;
            }
            let mut question = [ranks.rank() as u64, u64::from(node), run as u64, 0, 0, 0];
            question[3..].iter_mut().zip(&point).for_each(|(bits, x)| *bits = x.to_bits());
            questions.push((holder, question));
        }
        let answers = self.answers(ranks, questions, nodes.degree(), components);
        let mut fields = vec![vec![0.0; nodes.node_count() * components]; self.flow_count()];
        let values = self.at_places(&own_places, nodes.degree(), components);
        for (field, values) in fields.iter_mut().zip(&values) {
            for (&node, values) in own.iter().zip(values.chunks_exact(components)) {
                field[node as usize * components..][..components].copy_from_slice(values);
            }
        }
        for answer in answers {
            let (node, flows) = (answer[0] as usize, answer[1..].chunks_exact(3));
            for (field, values) in fields.iter_mut().zip(flows) {
                let target = field[node * components..][..components].iter_mut();
                target.zip(values).for_each(|(value, &bits)| *value = f64::from_bits(bits));
            }
        }
        fields
    }

    /// What other ranks say. All ranks call this.
    fn answers(
        &self,
        ranks: &Ranks,
        questions: Vec<(usize, [u64; QUESTION])>,
        degree: usize,
        components: usize,
    ) -> Vec<[u64; ANSWER]> {
        let asked = route(ranks, questions);
        let place = |question: &[u64; QUESTION]| {
            (question[2] as usize, Vector::from_fn(|d, _| f64::from_bits(question[3 + d])))
        };
        let places: Vec<PointInRun<D>> = asked.iter().map(place).collect();
        let values = self.at_places(&places, degree, components);
        let answer = |(k, question): (usize, &[u64; QUESTION])| {
            let mut answer = [0; ANSWER];
            answer[0] = question[1];
            for (to, values) in answer[1..].chunks_exact_mut(3).zip(&values) {
                let values = &values[k * components..][..components];
                to.iter_mut().zip(values).for_each(|(bits, value)| *bits = value.to_bits());
            }
            (question[0] as usize, answer)
        };
        route(ranks, asked.iter().enumerate().map(answer).collect())
    }

    /// The run that holds a point of the box.
    fn run_of(&self, point: &Vector<D>) -> usize {
        let (cell, _) = Evaluator::new(&self.frame).lattice_cell(point);
        self.cuts.owner(self.frame.key(&cell))
    }

    /// Values at points in the pieces of this rank, for each flow.
    fn at_places(&self, places: &[PointInRun<D>], degree: usize, components: usize) -> Vec<Vec<f64>> {
        let mut fields = vec![vec![0.0; places.len() * components]; self.flow_count()];
        for piece in &self.pieces {
            let here: Vec<usize> = (0..places.len()).filter(|&k| places[k].0 == piece.run).collect();
            let values = piece.at_points((here.len(), |k| places[here[k]].1), degree, components);
            for (field, values) in fields.iter_mut().zip(values) {
                for (&k, values) in here.iter().zip(values.chunks_exact(components)) {
                    field[k * components..][..components].copy_from_slice(values);
                }
            }
        }
        fields
    }
}

impl<const D: usize> FlowPiece<D> {
    /// Velocities or pressures at points in its cells, for each flow.
    fn at_points(
        &self,
        points: (usize, impl Fn(usize) -> Vector<D> + Sync),
        degree: usize,
        components: usize,
    ) -> Vec<Vec<f64>> {
        let (nodes, kind) = match degree {
            2 => (&self.velocity_nodes, 0),
            _ => (&self.pressure_nodes, 1),
        };
        let mut values = vec![vec![0.0; points.0 * components]; self.flows.len()];
        let from = self.flows.iter().map(|flow| &flow[kind][..]);
        let mut pairs: Vec<_> = from.zip(values.iter_mut().map(Vec::as_mut_slice)).collect();
        Evaluator::new(&self.mesh).transfer_to_points(nodes, components, points.0, points.1, &mut pairs);
        values
    }
}
