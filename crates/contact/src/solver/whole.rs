//! Newton steps of a whole problem. Where several ranks hold the contacts the first of them takes the steps
//! for all, of as many contacts as it can hold.

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
    if problem.operator.is_shared() {
        return improve_on_ranks(problem, forces, norm, step_limit);
    }
    let factor = DelassusOperator::factor(problem.operator)?;
    Some(Newton::new(&factor)?.improve(problem, forces, norm, step_limit))
}

/// Improves `forces` by Newton steps, on all ranks; `None`, on all, if there are too many contacts or their
/// system is too large to be factorised.
fn improve_on_ranks(
    problem: &mut Projection<'_>,
    forces: &mut [f64],
    norm: f64,
    step_limit: usize,
) -> Option<SolveReport> {
    if problem.count(forces.len()) > MOST_CONTACTS {
        return None;
    }
    let factor = problem.operator.factor()?;
    let gathered = problem.operator.gather(&words_of(&factor, problem, forces));
    let improved = gathered.map(|all| {
        let tuning = (problem.tolerance, norm, step_limit);
        Whole::of(&all).improved(tuning).unwrap_or_else(|| vec![Vec::new(); all.len()])
    });
    let own = problem.operator.scatter(improved);
    let (&[iterations, residual], found) = own.split_first_chunk::<2>()?;
    for (force, found) in forces.iter_mut().zip(found) {
        *force = f64::from_bits(*found);
    }
    Some(SolveReport { iterations: iterations as usize, residual: f64::from_bits(residual) })
}

/// Contacts as numbers: how many entries their row has, free gap, floor and force, then the row.
fn words_of(factor: &Factor, problem: &Projection<'_>, forces: &[f64]) -> Vec<u64> {
    let mut words = Vec::new();
    for (k, force) in forces.iter().enumerate() {
        words.push(factor.row(k).count() as u64);
        words.extend([problem.free_gaps[k], problem.floors[k], *force].map(f64::to_bits));
        words.extend(factor.row(k).flat_map(|(coordinate, value)| [coordinate as u64, value.to_bits()]));
    }
    words
}

/// The problem of all ranks.
#[derive(Default)]
struct Whole {
    factor: Factor,
    free_gaps: Vec<f64>,
    floors: Vec<f64>,
    forces: Vec<f64>,
    /// Contacts of each rank.
    counts: Vec<usize>,
}

impl Whole {
    fn of(words: &[Vec<u64>]) -> Self {
        let mut rows: Vec<Vec<(u64, f64)>> = Vec::new();
        let mut whole = Self::default();
        for words in words {
            let (before, mut rest) = (rows.len(), &words[..]);
            while let Some((&[entry_count, numbers @ ..], after)) = rest.split_first_chunk::<4>() {
                let [free_gap, floor, force] = numbers.map(f64::from_bits);
                whole.free_gaps.push(free_gap);
                whole.floors.push(floor);
                whole.forces.push(force);
                let (row, after) = after.split_at(2 * entry_count as usize);
                let entries = row.as_chunks::<2>().0.iter();
                rows.push(entries.map(|&[column, value]| (column, f64::from_bits(value))).collect());
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

    /// Iterations, residual and better forces for each rank.
    fn improved(mut self, (tolerance, norm, step_limit): (f64, f64, usize)) -> Option<Vec<Vec<u64>>> {
        let mut newton = Newton::new(&self.factor)?;
        let mut operator = OfFactor { factor: &self.factor, y: vec![0.0; self.factor.coordinate_count()] };
        let mut problem = Projection {
            operator: &mut operator,
            free_gaps: &self.free_gaps,
            floors: &self.floors,
            tolerance,
            iteration_limit: step_limit,
        };
        let report = newton.improve(&mut problem, &mut self.forces, norm, step_limit);
        let head = [report.iterations as u64, report.residual.to_bits()];
        let mut rest = &self.forces[..];
        let of_rank = |&count: &usize| {
            let (own, others) = rest.split_at(count);
            rest = others;
            head.into_iter().chain(own.iter().map(|force| force.to_bits())).collect()
        };
        Some(self.counts.iter().map(of_rank).collect())
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
