//! Admission of candidates to a step: those that remember, those that would close, and those that others
//! would push together.

use gluey_geom::Vector;

use super::{Buffers, PairContact, PairMemory, Participation};
use crate::neighbours::Candidate;
use crate::parallel;
use crate::rows::{Row, closes};
use crate::{ContactError, Domain, Mobility, PairState, StepGeometry};

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    /// Sets up the pairs that remember and those that would close.
    pub(super) fn begin(
        &mut self,
        step: &StepGeometry<'_, D>,
        buffers: &mut Buffers<D>,
    ) -> Result<(), ContactError> {
        let neighbours = &mut self.neighbours;
        buffers.weights.clear();
        let mobility =
            |&i: &u32| self.mobility.own(i as usize, step.radii[i as usize]) * step.velocity_weight;
        buffers.weights.extend(neighbours.order.iter().map(mobility));
        buffers.changes.clear();
        buffers.changes.resize(neighbours.count(), Vector::zeros());
        buffers.displacements.clone_from(&neighbours.free);

        buffers.memory.clear();
        buffers.forces.clear();
        buffers.takes_part.clear();
        for (k, state) in self.record.state.pairs.iter().enumerate() {
            let candidate = check_known(state, self.record.expected(k), step, &self.domain)
                .map(|()| neighbours.find_or_add(state.pair))?;
            let size = buffers.memory.len().max(neighbours.candidates.len());
            buffers.memory.resize(size, PairMemory::default());
            buffers.takes_part.resize(size, Participation::No);
            buffers.memory[candidate] = PairMemory { gamma: state.gamma, lambda: state.lambda };
            buffers.takes_part[candidate] = Participation::Fresh;
        }
        buffers.memory.resize(neighbours.candidates.len(), PairMemory::default());
        buffers.takes_part.resize(neighbours.candidates.len(), Participation::No);
        buffers.forces.extend(buffers.memory.iter().map(|memory| memory.lambda));
        self.admit(step, buffers);
        Ok(())
    }

    /// Whether remembered contacts still are where the last step left them.
    pub(super) fn check_memory(&self, step: &StepGeometry<'_, D>) -> Result<(), ContactError> {
        let mut pairs = self.record.state.pairs.iter().enumerate();
        pairs.try_for_each(|(k, state)| check_known(state, self.record.expected(k), step, &self.domain))
    }

    /// Lets candidates that `displacements` close take part; whether there are any.
    pub(super) fn admit(&self, step: &StepGeometry<'_, D>, buffers: &mut Buffers<D>) -> bool {
        let (neighbours, margin) = (&self.neighbours, 0.5 * self.margin());
        let Buffers { takes_part, displacements, weights, .. } = buffers;
        let movable = |place: u32| weights.get(place as usize).is_some_and(|weight| *weight > 0.0);
        let admit = |part: &mut Participation, candidate: &Candidate| {
            let closing = *part == Participation::No
                && closes(candidate, neighbours, &self.domain, step.dt, displacements, margin)
                && (movable(candidate.head) || movable(candidate.tail));
            if closing {
                *part = Participation::Fresh;
            }
            closing
        };
        parallel::visit_all(takes_part, &neighbours.candidates, admit)
    }

    /// Refuses motions that are given and make particles overlap, or stick in a wall: nothing can yield
    /// there.
    pub(super) fn check_given_motions(
        &self,
        step: &StepGeometry<'_, D>,
        tolerance: f64,
        buffers: &Buffers<D>,
    ) -> Result<(), ContactError> {
        let (neighbours, weights) = (&self.neighbours, &buffers.weights);
        if weights.iter().all(|weight| *weight > 0.0) {
            return Ok(());
        }
        let movable = |place: u32| weights.get(place as usize).is_some_and(|weight| *weight > 0.0);
        for (k, candidate) in neighbours.candidates.iter().enumerate() {
            if movable(candidate.head) || movable(candidate.tail) {
                continue;
            }
            let row = Row::new(k, neighbours, &self.domain, step)?;
            let gap = row.gap_after(&neighbours.positions, &buffers.displacements);
            if gap < -tolerance {
                return Err(ContactError::Given { pair: neighbours.key(candidate), gap });
            }
        }
        Ok(())
    }

    /// Lists the candidates that take part, in the order of space.
    pub(super) fn list_rows(
        &self,
        step: &StepGeometry<'_, D>,
        buffers: &mut Buffers<D>,
    ) -> Result<(), ContactError> {
        buffers.rows.clear();
        for (candidate, part) in buffers.takes_part.iter().enumerate() {
            if *part != Participation::No {
                buffers.rows.push(Row::new(candidate, &self.neighbours, &self.domain, step)?);
            }
        }
        buffers.rows.sort_unstable_by_key(|row| row.rank);
        Ok(())
    }
}

/// Part of the period by which a gap is not what the last step left.
const FAR: f64 = 0.25;

/// Whether a remembered contact still is where the last step left it. A gap that has opened says nothing:
/// with the forces of two steps in the impulse, what a contact remembers fades over many steps after it
/// opened. A record that was resumed has no gap to compare with.
fn check_known<const D: usize>(
    state: &PairState,
    expected: Option<f64>,
    step: &StepGeometry<'_, D>,
    domain: &Domain<D>,
) -> Result<(), ContactError> {
    let PairState { pair, .. } = *state;
    ContactError::unless_known(pair, step.positions.len(), domain.walls.len())?;
    let ((first, Some(second)), Some(expected)) = (pair.particles(), expected) else { return Ok(()) };
    let distance = pair.branch(step.positions, domain).map_or(0.0, |branch| branch.norm());
    let gap = distance - step.radii[first] - step.radii[second];
    let shortest = domain.lattice.periods().iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let is_wrapped = (gap - expected).abs() > FAR * shortest;
    if is_wrapped { Err(ContactError::Wrapped { pair, gap }) } else { Ok(()) }
}
