//! Newton steps of a whole problem. Where several ranks hold the contacts each of them learns of all, of as
//! many as one can hold, and takes the same steps.

use super::newton::Newton;
use super::{DelassusOperator, Factor, Projection, SolveReport};

/// Most contacts that one rank takes from all others.
const MOST_CONTACTS: usize = 100_000;

/// Improves `forces` by Newton steps, if the factor of the operator is known and small enough.
pub(super) fn improve(
    problem: &mut Projection<'_>,
    forces: &mut [f64],
    norm: f64,
    step_limit: usize,
) -> Option<SolveReport> {
    if let Some(place) = problem.operator.place() {
        return improve_with_others(problem, forces, norm, step_limit, place);
    }
    let factor = DelassusOperator::factor(problem.operator)?;
    Some(Newton::new(&factor)?.improve(problem, forces, norm, step_limit))
}

/// Improves `forces` by Newton steps, on all ranks; `None`, on all, if there are too many contacts or their
/// system is too large to be factorised.
fn improve_with_others(
    problem: &mut Projection<'_>,
    forces: &mut [f64],
    norm: f64,
    step_limit: usize,
    place: usize,
) -> Option<SolveReport> {
    if problem.count(forces.len()) > MOST_CONTACTS {
        return None;
    }
    let factor = problem.operator.factor()?;
    let all = problem.operator.gather(&numbers_of(&factor, problem, forces));
    let mut whole = GatheredProblem::of(&all);
    let report = whole.improve(problem.tolerance, norm, step_limit)?;
    let first: usize = whole.counts[..place].iter().sum();
    forces.copy_from_slice(&whole.forces[first..][..forces.len()]);
    Some(report)
}

/// Contacts as numbers: how many entries their row has, free gap, floor and force, then the row.
fn numbers_of(factor: &Factor, problem: &Projection<'_>, forces: &[f64]) -> Vec<f64> {
    let mut numbers = Vec::new();
    for (k, &force) in forces.iter().enumerate() {
        numbers.extend([factor.row(k).count() as f64, problem.free_gaps[k], problem.floors[k], force]);
        numbers.extend(factor.row(k).flat_map(|(coordinate, value)| [coordinate as f64, value]));
    }
    numbers
}

/// The problem of all ranks.
#[derive(Default)]
struct GatheredProblem {
    factor: Factor,
    free_gaps: Vec<f64>,
    floors: Vec<f64>,
    forces: Vec<f64>,
    /// Contacts of each rank.
    counts: Vec<usize>,
}

impl GatheredProblem {
    fn of(numbers: &[Vec<f64>]) -> Self {
        let mut rows: Vec<Vec<(u64, f64)>> = Vec::new();
        let mut whole = Self::default();
        for numbers in numbers {
            let (before, mut rest) = (rows.len(), &numbers[..]);
            while let Some((&[entry_count, free_gap, floor, force], after)) = rest.split_first_chunk::<4>() {
                whole.free_gaps.push(free_gap);
                whole.floors.push(floor);
                whole.forces.push(force);
                let (row, after) = after.split_at(2 * entry_count as usize);
                rows.push(
                    row.as_chunks::<2>().0.iter().map(|&[column, value]| (column as u64, value)).collect(),
                );
                rest = after;
            }
            whole.counts.push(rows.len() - before);
        }
        let mut columns: Vec<u64> = rows.iter().flatten().map(|entry| entry.0).collect();
        columns.sort_unstable();
        columns.dedup();
        whole.factor = Factor::new(columns.len());
        for row in rows {
            let place = |column: u64| columns.binary_search(&column).unwrap_or(0);
            whole.factor.push(row.into_iter().map(|(column, value)| (place(column), value)));
        }
        whole
    }

    /// Replaces the forces by better ones.
    fn improve(&mut self, tolerance: f64, norm: f64, step_limit: usize) -> Option<SolveReport> {
        let mut newton = Newton::new(&self.factor)?;
        let mut operator = OfFactor { factor: &self.factor, y: vec![0.0; self.factor.coordinate_count()] };
        let mut problem = Projection {
            operator: &mut operator,
            free_gaps: &self.free_gaps,
            floors: &self.floors,
            tolerance,
            iteration_limit: step_limit,
        };
        Some(newton.improve(&mut problem, &mut self.forces, norm, step_limit))
    }
}

/// `R R^T`.
struct OfFactor<'a> {
    factor: &'a Factor,
    y: Vec<f64>,
}

impl DelassusOperator for OfFactor<'_> {
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]) {
        self.y.fill(0.0);
        for (k, force) in forces.iter().enumerate() {
            self.factor.add_row(k, *force, &mut self.y);
        }
        for (k, gap) in gaps.iter_mut().enumerate() {
            *gap = self.factor.product(k, &self.y);
        }
    }
}
