//! Gaps after a step, in balance with the drag of the particles.
//!
//! Each film asks for an impulse `I`. Particles may be so crowded that they have fewer ways to move than
//! there are films, and cannot do what all ask for. Displaced by `x` from where the flow takes it, the
//! particle `i` of the radius `a_i` meets the impulse `a_i x_i` of its drag, and
//!
//! `a_i x_i = sum_k +- n_k L_k`, `L_k = I_k - Phi(g_k)`, `g_k = gap_k(x) > 0`:
//!
//! what films do not get loads the particles. That is the minimum of `sum_k int (Phi - I_k) dg_k + sum_i a_i
//! |x_i|^2 / 2`. A film much thinner than its neighbours is changed by them in proportion to itself: none is
//! closed, whatever they ask for.
//!
//! Solved for the loads `L`, which are free: `gap_k(x(L)) - Phi^-1(I_k - L_k) = 0`, where gaps are linear
//! in `x` the gradient of a convex function (`solver/laws.rs`). Gaps are linearised about the bodies where
//! they are, then about where they went, until they are exact. The distance of centres is convex in `x`: gaps
//! are never below those linearised.

use gluey_geom::Vector;

use super::error::FilmError;
use super::film::FilmLaw;
use crate::delassus::{JacobianRow, Response, ScaledDelassus};
use crate::projection::{self, Effort, Failure, Linearised};
use crate::rows::{GROUND, NormalRow, Row};
use crate::solver::{LawProblem, Loads, SolveFailure, SolveReport, TOLERANCE, farthest};
use crate::{BodyStep, ContactParams};

/// Linearisations of the gaps at most. Steps in which particles move far around each other would take more.
const MOST_PASSES: usize = 50;

/// Displaces particles so that impulses balance.
///
/// # Errors
/// [`FilmError`].
pub(super) fn balance<'a, const D: usize>(
    step: &BodyStep<'_, D>,
    free: &'a [Vector<D>],
    laws: Vec<FilmLaw<'a, D>>,
) -> Result<Balance<'a, D>, FilmError> {
    let params = ContactParams { exact_gap: true, pass_limit: MOST_PASSES, ..ContactParams::default() };
    let (mut problem, mut effort) = (Balance::new(step, free, laws), Effort::default());
    match projection::solve(&mut problem, &params, &mut effort) {
        Ok(()) => Ok(problem),
        Err(failure) => Err(problem.explain(&failure, effort.iterations, step.radii)),
    }
}

/// Films whose gaps are linear in the displacements of their particles.
pub(super) struct Balance<'a, const D: usize> {
    laws: Vec<FilmLaw<'a, D>>,
    rows: Vec<Row<D>>,
    /// Displacements of the particles without loads, and with them.
    free: &'a [Vector<D>],
    pub moved: Vec<Vector<D>>,
    /// By how much they differ; the first is that of walls.
    pub changes: Vec<Vector<D>>,
    /// `1/a` of each particle; zero for those that are held, and for walls.
    weights: Vec<f64>,
    /// Gaps without loads.
    free_gaps: Vec<f64>,
    loads: Loads,
}

impl<'a, const D: usize> Balance<'a, D> {
    fn new(step: &BodyStep<'_, D>, free: &'a [Vector<D>], laws: Vec<FilmLaw<'a, D>>) -> Self {
        let mut weights = vec![0.0];
        weights.extend(step.radii.iter().map(|radius| 1.0 / radius));
        for film in laws.iter().map(|law| law.film) {
            let (first, second) = film.pair.particles();
            let ends = [Some(first), second].into_iter().zip(film.is_held);
            ends.filter(|(_, is_held)| *is_held)
                .filter_map(|(end, _)| end)
                .for_each(|k| weights[k + 1] = 0.0);
        }
        Self {
            rows: laws.iter().map(|law| law.film.row(step.dt)).collect(),
            free,
            moved: free.to_vec(),
            changes: vec![Vector::zeros(); weights.len()],
            weights,
            free_gaps: vec![0.0; laws.len()],
            loads: Loads::new(laws.iter().map(|law| law.film.gap).collect()),
            laws,
        }
    }

    /// Impulses that the films have.
    pub(super) fn impulses(&self) -> impl Iterator<Item = f64> {
        self.laws.iter().zip(&self.loads.loads).map(|(law, load)| law.asked - load)
    }

    /// Gap of a film where the particles are now.
    fn gap(&self, k: usize) -> f64 {
        self.rows[k].gap_at(&self.rows[k].between(|place| self.moved[place as usize]))
    }

    /// Gaps without loads, linear along the normals.
    fn set_free_gaps(&mut self) {
        for (row, free_gap) in self.rows.iter().zip(&mut self.free_gaps) {
            *free_gap = row.normal.dot(&row.between(|place| self.free[place as usize])) - row.rest;
        }
    }

    /// Why there is no balance after so many corrections: a film that is closed, or the one that is farthest
    /// off.
    fn explain(&self, failure: &Failure, corrections: usize, radii: &[f64]) -> FilmError {
        let (worst, more) = match failure {
            Failure::Solve(failure) => (failure.worst, failure.report.iterations),
            Failure::Gap { contact, .. } => (*contact, 0),
        };
        let thinnest = (0..self.rows.len()).min_by(|&a, &b| self.gap(a).total_cmp(&self.gap(b)));
        let closed = thinnest.filter(|&k| self.gap(k) <= 0.0);
        let k = closed.unwrap_or(worst);
        let (film, pair) = (self.laws[k].film, self.laws[k].film.pair);
        let over_radius = |gap: f64| gap / radii[pair.first as usize];
        let (gap, left) = (over_radius(film.gap), over_radius(self.gap(k)));
        match closed {
            Some(_) => FilmError::Closed { pair, gap, left, is_given: false },
            None => {
                let wanted = over_radius(self.loads.gaps()[k]);
                FilmError::NotBalanced { pair, gap, left, wanted, corrections: corrections + more }
            }
        }
    }
}

impl<const D: usize> Linearised for Balance<'_, D> {
    fn begin(&mut self) {
        self.set_free_gaps();
    }

    fn project(&mut self) -> Result<SolveReport, SolveFailure> {
        let slot = |place: u32| if place == GROUND { 0 } else { place + 1 };
        let normal_row =
            |row: &Row<D>| NormalRow { normal: row.normal, tail: slot(row.tail), head: slot(row.head) };
        let rows: Vec<NormalRow<D>> = self.rows.iter().map(normal_row).collect();
        let diagonal: Vec<f64> = rows.iter().map(|row| row.compliance(&self.weights)).collect();
        let response = FilmMobility(&self.weights);
        let mut operator = ScaledDelassus { rows: &rows, response, motions: &mut self.changes };
        let (laws, free_gaps) = (&self.laws, &self.free_gaps);
        let mut problem = LawProblem { operator: &mut operator, diagonal: &diagonal, laws, free_gaps };
        let outcome = self.loads.solve(&mut problem);
        operator.move_bodies(&self.loads.loads);
        for (moved, (free, change)) in self.moved.iter_mut().zip(self.free.iter().zip(&self.changes[1..])) {
            *moved = free + change;
        }
        outcome
    }

    /// About the bodies where they are now; walls stay as they are.
    fn linearise(&mut self, _pass: usize) -> Option<(usize, f64)> {
        let off = |k: usize| self.gap(k) - self.loads.gaps()[k];
        let (worst, error) = farthest(&self.laws, self.loads.gaps(), off);
        if error <= 2.0 * TOLERANCE {
            return None;
        }
        let gap = self.gap(worst);
        for row in self.rows.iter_mut().filter(|row| !row.is_flat) {
            row.normal = row.between(|place| self.moved[place as usize]).normalize();
        }
        self.set_free_gaps();
        Some((worst, gap))
    }
}

/// Particles each of which feels its own drag.
struct FilmMobility<'a>(&'a [f64]);

impl<const D: usize> Response<NormalRow<D>> for FilmMobility<'_> {
    const IS_COUPLED: bool = false;

    fn respond(&self, motions: &mut [Vector<D>]) {
        motions.iter_mut().zip(self.0).for_each(|(motion, weight)| *motion *= *weight);
    }
}
