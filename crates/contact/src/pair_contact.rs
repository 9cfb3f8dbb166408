//! The contact step: find pairs, project, re-linearise, remember.

use gluey_geom::{Dim, Space, Twist, Vector};

use crate::constraints::{Constraint, ContactOperator, Workspace};
use crate::graph::{self, Search};
use crate::model::validate;
use crate::push_apart::{PushParams, push_apart};
use crate::solver::{ActiveSet, Projection, ProjectionSolver, SolveReport, Uzawa};
use crate::{
    Contact, ContactError, ContactModel, ContactParams, ContactReport, ContactState, Mobility, PairKey,
    PairState, SolverKind, StepGeometry, StokesDrag, Strategy, WorstPair,
};

/// Contacts between discs or spheres, by one of the [`Strategy`]s.
///
/// Results do not depend on the numbering of the particles, bit for bit.
pub struct PairContact<const D: usize, M = StokesDrag> {
    params: ContactParams,
    mobility: M,
    solver: Box<dyn ProjectionSolver>,
    state: ContactState,
    contacts: Vec<Contact>,
    search: Search,
    workspace: Workspace<D>,
    /// Pairs of the current step, in the order of space.
    constraints: Vec<Constraint<D>>,
    forces: Vec<f64>,
    floors: Vec<f64>,
    free_gaps: Vec<f64>,
    ranks: Vec<u32>,
}

impl<const D: usize> PairContact<D> {
    /// The model with `M = diag(a_i)`.
    pub fn new(params: ContactParams) -> Self {
        Self::with_mobility(params, StokesDrag)
    }
}

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    /// The model with another metric of the projection.
    pub fn with_mobility(params: ContactParams, mobility: M) -> Self {
        let solver: Box<dyn ProjectionSolver> = match params.solver {
            SolverKind::Uzawa => Box::new(Uzawa::default()),
            SolverKind::ActiveSet => Box::new(ActiveSet::default()),
        };
        Self {
            params,
            mobility,
            solver,
            state: ContactState::default(),
            contacts: Vec::new(),
            search: Search::default(),
            workspace: Workspace::default(),
            constraints: Vec::new(),
            forces: Vec::new(),
            floors: Vec::new(),
            free_gaps: Vec::new(),
            ranks: Vec::new(),
        }
    }

    /// The parameters.
    pub fn params(&self) -> &ContactParams {
        &self.params
    }
}

impl<const D: usize, M: Mobility<D>> ContactModel<D> for PairContact<D, M>
where
    Dim<D>: Space<D>,
{
    fn correct(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        validate(step, twists)?;
        if self.params.strategy == Strategy::None {
            return Ok(ContactReport::default());
        }
        let predicted: Vec<Vector<D>> = twists.iter().map(|twist| twist.velocity).collect();
        let mut correction = Correction::new(step, &predicted, self.tolerance(step, &predicted));
        self.begin(step, &correction.displacements)?;
        let report = match self.params.strategy {
            Strategy::VelocityCorrection => self.push(&mut correction)?,
            _ => self.project(&mut correction)?,
        };
        self.remember(&correction);
        for (twist, velocity) in twists.iter_mut().zip(&correction.velocities) {
            twist.velocity = *velocity;
        }
        Ok(report)
    }

    fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn checkpoint(&self) -> ContactState {
        self.state.clone()
    }

    fn resume(&mut self, state: ContactState) {
        self.state = state;
        self.state.tidy();
        self.contacts.clear();
    }

    fn reverse(&mut self) {
        for pair in &mut self.state.pairs {
            pair.lambda = -pair.lambda;
        }
    }
}

/// Velocities on their way from predicted to corrected.
struct Correction<'a, const D: usize> {
    step: &'a StepGeometry<'a, D>,
    predicted: &'a [Vector<D>],
    velocities: Vec<Vector<D>>,
    /// `c v + drift`.
    displacements: Vec<Vector<D>>,
    /// Residual to reach; unit: length.
    tolerance: f64,
}

impl<'a, const D: usize> Correction<'a, D> {
    fn new(step: &'a StepGeometry<'a, D>, predicted: &'a [Vector<D>], tolerance: f64) -> Self {
        let velocities = predicted.to_vec();
        let displacements = displacements(step, predicted);
        Self { step, predicted, velocities, displacements, tolerance }
    }

    fn displace(&mut self) {
        for i in 0..self.velocities.len() {
            self.displacements[i] = self.velocities[i] * self.step.rate + self.step.drift[i];
        }
    }
}

fn displacements<const D: usize>(step: &StepGeometry<'_, D>, velocities: &[Vector<D>]) -> Vec<Vector<D>> {
    velocities.iter().zip(step.drift).map(|(velocity, drift)| velocity * step.rate + drift).collect()
}

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    /// The relative tolerance times a length, but never below what positions can resolve.
    fn tolerance(&self, step: &StepGeometry<'_, D>, predicted: &[Vector<D>]) -> f64 {
        let radius = step.radii.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = displacements(step, predicted).iter().map(|s| s.norm()).fold(0.0, f64::max);
        let extent = step.positions.iter().map(|x| x.amax()).fold(0.0, f64::max);
        (self.params.tolerance * radius.max(farthest)).max(8.0 * f64::EPSILON * (extent + farthest))
    }

    /// Gap below which pairs are pushed apart, relative to the mean radius.
    fn margin(&self) -> f64 {
        if self.params.strategy == Strategy::VelocityCorrection {
            self.params.threshold.max(0.0)
        } else {
            0.0
        }
    }

    /// Sets up the pairs that remember and those that could close.
    fn begin(&mut self, step: &StepGeometry<'_, D>, displacements: &[Vector<D>]) -> Result<(), ContactError> {
        let count = step.positions.len();
        let last = self.state.pairs.iter().map(|state| state.pair).max_by_key(|pair| pair.second);
        if let Some(pair) = last.filter(|pair| pair.second as usize >= count) {
            return Err(ContactError::UnknownParticle { pair, count });
        }
        self.workspace.resize(count);
        self.search.begin();
        self.ranks = graph::ranks(step.positions);
        self.constraints.clear();
        self.forces.clear();
        let mut pairs = self.near_pairs(step, displacements);
        pairs.extend(self.state.pairs.iter().map(|state| state.pair));
        self.admit(step, pairs);
        Ok(())
    }

    /// Pairs whose gap could close under `displacements`.
    fn near_pairs(&mut self, step: &StepGeometry<'_, D>, displacements: &[Vector<D>]) -> Vec<PairKey> {
        let margin = self.margin();
        let candidates = self.search.candidates(step.positions, step.radii, displacements, margin);
        let near = |pair: &&PairKey| {
            Constraint::<D>::new(**pair, &self.ranks, step.radii).could_close(
                step.positions,
                displacements,
                margin,
            )
        };
        candidates.iter().filter(near).copied().collect()
    }

    /// Adds pairs to the constraints, which stay in the order of space, each with the force it ended the last step with.
    fn admit(&mut self, step: &StepGeometry<'_, D>, pairs: Vec<PairKey>) {
        let ranks = &self.ranks;
        let mut entries: Vec<(Constraint<D>, f64)> =
            self.constraints.drain(..).zip(self.forces.drain(..)).collect();
        let added = pairs.into_iter().map(|pair| Constraint::new(pair, ranks, step.radii));
        entries.extend(added.map(|constraint| (constraint, self.state.get(constraint.pair).lambda)));
        // Stable, so that of two entries for a pair the one already there survives.
        entries.sort_by_key(|(constraint, _)| (ranks[constraint.tail], ranks[constraint.head]));
        entries.dedup_by_key(|(constraint, _)| constraint.pair);
        (self.constraints, self.forces) = entries.into_iter().unzip();
        self.floors.clear();
        for constraint in &self.constraints {
            let state = self.state.get(constraint.pair);
            self.floors.push(match self.params.strategy {
                Strategy::Gluey => self.params.memory.floor(&state, step.rate, step.dt),
                _ => 0.0,
            });
        }
    }

    /// Admits pairs that the corrected velocities bring together; `false` if there are none.
    fn admit_new(&mut self, correction: &Correction<'_, D>) -> bool {
        let step = correction.step;
        let mut pairs = self.near_pairs(step, &correction.displacements);
        let mut known: Vec<PairKey> = self.constraints.iter().map(|constraint| constraint.pair).collect();
        known.sort_unstable();
        pairs.retain(|pair| known.binary_search(pair).is_err());
        let closes = |pair: &PairKey| {
            let constraint = Constraint::<D>::new(*pair, &self.ranks, step.radii);
            let separation = constraint.difference(step.positions);
            let distance = separation.norm();
            let approach = constraint.difference(&correction.displacements).dot(&separation) / distance;
            distance - constraint.rest + approach < 0.5 * self.margin() * constraint.rest
        };
        if !pairs.iter().any(closes) {
            return false;
        }
        self.admit(step, pairs);
        true
    }

    /// The velocity correction: no projection.
    fn push(&mut self, correction: &mut Correction<'_, D>) -> Result<ContactReport, ContactError> {
        let params = PushParams {
            threshold: self.params.threshold,
            tolerance: correction.tolerance,
            sweep_limit: self.params.iteration_limit,
        };
        let mut report = ContactReport::default();
        self.forces.fill(0.0);
        loop {
            let (sweeps, residual) = push_apart(
                correction.step,
                &mut self.constraints,
                &mut correction.displacements,
                &mut self.forces,
                &params,
            )?;
            report.iterations += sweeps;
            report.passes += 1;
            report.residual = residual;
            if !self.admit_new(correction) {
                break;
            }
        }
        for i in 0..correction.velocities.len() {
            let moved = correction.displacements[i] - correction.step.drift[i];
            correction.velocities[i] = moved / correction.step.rate;
        }
        Ok(self.summary(report, correction))
    }

    /// The projection, with as many linearisations as the gaps need.
    fn project(&mut self, correction: &mut Correction<'_, D>) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        // The first linearisation is the paper's: about the particles where they are.
        let mut base = vec![Vector::zeros(); correction.predicted.len()];
        while report.passes < self.params.pass_limit {
            report.passes += 1;
            self.linearise(correction, &base)?;
            let solve = self.solve(correction)?;
            report.iterations += solve.iterations;
            report.residual = solve.residual;
            if self.admit_new(correction) {
                continue;
            }
            if !self.params.exact_gap || self.farthest_off(correction).is_none() {
                return Ok(self.summary(report, correction));
            }
            base.copy_from_slice(&correction.displacements);
        }
        let (pair, gap) = self.farthest_off(correction).unwrap_or((PairKey::new(0, 0), 0.0));
        Err(ContactError::GapNotClosed { pair, gap, passes: report.passes })
    }

    /// Writes the gaps at the end of the step as linear functions of the velocities, about the displacements `base`.
    ///
    /// The gaps are exact at `base`, the normals those of the beginning of the step throughout: contact forces belong to
    /// `u^n`, which multi-step schemes extrapolate. Normals of the end of the step converge faster (by `phi^2/2` a pass
    /// here, `phi` the rotation of the pair in the step), but make the encounter of two spheres first order in dt.
    fn linearise(&mut self, correction: &Correction<'_, D>, base: &[Vector<D>]) -> Result<(), ContactError> {
        let step = correction.step;
        let free = displacements(step, correction.predicted);
        self.free_gaps.clear();
        for constraint in &mut self.constraints {
            constraint.point_along(&constraint.difference(step.positions))?;
            let beyond = constraint.difference(&free) - constraint.difference(base);
            let gap = constraint.gap(step.positions, base);
            self.free_gaps.push(gap + constraint.normal.dot(&beyond));
        }
        Ok(())
    }

    fn solve(&mut self, correction: &mut Correction<'_, D>) -> Result<SolveReport, ContactError> {
        let mut operator = ContactOperator {
            constraints: &self.constraints,
            step: correction.step,
            mobility: &self.mobility,
            workspace: &mut self.workspace,
        };
        let mut problem = Projection {
            operator: &mut operator,
            free_gaps: &self.free_gaps,
            floors: &self.floors,
            tolerance: correction.tolerance,
            iteration_limit: self.params.iteration_limit,
        };
        let solved = self.solver.solve(&mut problem, &mut self.forces);
        let report = solved.map_err(|failure| ContactError::NotConverged {
            residual: failure.report.residual,
            tolerance: correction.tolerance,
            iterations: failure.report.iterations,
            history: failure.history,
            worst: self.constraints[failure.worst].pair,
        })?;
        let changes = operator.velocities(&self.forces);
        for i in 0..changes.len() {
            correction.velocities[i] = correction.predicted[i] + changes[i];
        }
        correction.displace();
        Ok(report)
    }

    /// The pair whose gap at the end of the step is farthest from what it should be, beyond the tolerance.
    fn farthest_off(&self, correction: &Correction<'_, D>) -> Option<(PairKey, f64)> {
        let mut farthest = None;
        let mut largest = 2.0 * correction.tolerance;
        for (k, constraint) in self.constraints.iter().enumerate() {
            let gap = constraint.gap(correction.step.positions, &correction.displacements);
            let compliance = correction.step.rate
                * (1.0 / correction.step.radii[constraint.tail]
                    + 1.0 / correction.step.radii[constraint.head]);
            let off = gap.min(compliance * (self.forces[k] - self.floors[k])).abs();
            if off > largest {
                (farthest, largest) = (Some((constraint.pair, gap)), off);
            }
        }
        farthest
    }

    fn summary(&self, report: ContactReport, correction: &Correction<'_, D>) -> ContactReport {
        let mut worst: Option<WorstPair> = None;
        for constraint in &self.constraints {
            let gap = constraint.gap(correction.step.positions, &correction.displacements);
            if worst.is_none_or(|worst| gap < worst.gap) {
                worst = Some(WorstPair { pair: constraint.pair, gap });
            }
        }
        let active_count = self.forces.iter().filter(|force| **force != 0.0).count();
        ContactReport { pair_count: self.constraints.len(), active_count, worst, ..report }
    }

    /// Updates gamma and lists the contacts.
    fn remember(&mut self, correction: &Correction<'_, D>) {
        let step = correction.step;
        self.contacts.clear();
        for (constraint, &lambda) in self.constraints.iter().zip(&self.forces) {
            let old = self.state.get(constraint.pair);
            let gamma = match self.params.strategy {
                Strategy::Gluey => self.params.memory.update(&old, lambda, step.rate, step.dt, &self.params),
                _ => 0.0,
            };
            let negligible = f64::EPSILON * constraint.rest.powi(2);
            if gamma < 0.0 || (step.rate * lambda).abs() > negligible {
                let gap = constraint.gap(step.positions, &correction.displacements);
                self.contacts.push(Contact { pair: constraint.pair, lambda, gamma, gap });
            }
        }
        self.contacts.sort_unstable_by_key(|contact| contact.pair);
        self.state.pairs.clear();
        self.state.pairs.extend(self.contacts.iter().map(|contact| PairState {
            pair: contact.pair,
            gamma: contact.gamma,
            lambda: contact.lambda,
        }));
    }
}
