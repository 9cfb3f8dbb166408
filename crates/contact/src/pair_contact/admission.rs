//! Which links take part in a step: those that remember, those that would close, and those that others would
//! push together.

use gluey_geom::{Dim, Space, Vector};

use super::{Buffers, PairContact, PairMemory, Part};
use crate::graph::Link;
use crate::parallel;
use crate::rows::{Row, closes};
use crate::{ContactError, Domain, Mobility, PairState, StepGeometry};

impl<const D: usize, M: Mobility<D>> PairContact<D, M>
where
    Dim<D>: Space<D>,
{
    /// Sets up the pairs that remember and those that would close.
    pub(super) fn begin(
        &mut self,
        step: &StepGeometry<'_, D>,
        buffers: &mut Buffers<D>,
    ) -> Result<(), ContactError> {
        let graph = &mut self.graph;
        buffers.weights.clear();
        let mobility =
            |&i: &u32| self.mobility.own(i as usize, step.radii[i as usize]) * step.velocity_weight;
        buffers.weights.extend(graph.order.iter().map(mobility));
        buffers.changes.clear();
        buffers.changes.resize(graph.count(), Vector::zeros());
        buffers.displacements.clone_from(&graph.free);

        buffers.memory.clear();
        buffers.forces.clear();
        buffers.takes_part.clear();
        for state in &self.record.state.pairs {
            let link = check_known(state, step, &self.domain).map(|()| graph.recall(state.pair))?;
            let size = buffers.memory.len().max(graph.links.len());
            buffers.memory.resize(size, PairMemory::default());
            buffers.takes_part.resize(size, Part::No);
            buffers.memory[link] = PairMemory { gamma: state.gamma, lambda: state.lambda };
            buffers.takes_part[link] = Part::Fresh;
        }
        buffers.memory.resize(graph.links.len(), PairMemory::default());
        buffers.takes_part.resize(graph.links.len(), Part::No);
        buffers.forces.extend(buffers.memory.iter().map(|memory| memory.lambda));
        self.admit(step, buffers);
        Ok(())
    }

    /// Lets links that `displacements` close take part; whether there are any.
    pub(super) fn admit(&self, step: &StepGeometry<'_, D>, buffers: &mut Buffers<D>) -> bool {
        let (graph, margin) = (&self.graph, 0.5 * self.margin());
        let Buffers { takes_part, displacements, weights, .. } = buffers;
        let movable = |place: u32| weights.get(place as usize).is_some_and(|weight| *weight > 0.0);
        let admit = |part: &mut Part, link: &Link| {
            let closing = *part == Part::No
                && closes(link, graph, &self.domain, step.dt, displacements, margin)
                && (movable(link.head) || movable(link.tail));
            if closing {
                *part = Part::Fresh;
            }
            closing
        };
        parallel::visit_all(takes_part, &graph.links, admit)
    }

    /// Lists the links that take part, in the order of space.
    pub(super) fn list_rows(
        &self,
        step: &StepGeometry<'_, D>,
        buffers: &mut Buffers<D>,
    ) -> Result<(), ContactError> {
        buffers.rows.clear();
        for (link, part) in buffers.takes_part.iter().enumerate() {
            if *part != Part::No {
                buffers.rows.push(Row::new(link, &self.graph, &self.domain, step)?);
            }
        }
        buffers.rows.sort_unstable_by_key(|row| row.rank);
        Ok(())
    }
}

/// Part of the period by which the particles of a contact cannot have moved apart.
const FAR: f64 = 0.25;

/// Whether a remembered contact still can be one.
fn check_known<const D: usize>(
    state: &PairState,
    step: &StepGeometry<'_, D>,
    domain: &Domain<D>,
) -> Result<(), ContactError> {
    let PairState { pair, .. } = *state;
    pair.check_known(step.positions.len(), domain.walls.len())?;
    let (first, Some(second)) = pair.particles() else { return Ok(()) };
    let distance = pair.branch(step.positions, domain).map_or(0.0, |branch| branch.norm());
    let gap = distance - step.radii[first] - step.radii[second];
    let shortest = domain.periods.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    if gap > FAR * shortest { Err(ContactError::Wrapped { pair, gap }) } else { Ok(()) }
}
