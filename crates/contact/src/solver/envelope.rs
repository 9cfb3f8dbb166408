//! Cholesky factors of sparse matrices in their envelope: each row from its first entry to the diagonal
//! (George and Liu 1981, Computer Solution of Large Sparse Positive Definite Systems, chapter 4), in the
//! order of Cuthill and McKee (1969, DOI 10.1145/800195.805928) reversed.

use super::{Factor, dot};

/// Entries beyond which a factorisation would take longer than it saves; 240 MB.
const MOST_ENTRIES: usize = 30_000_000;

/// A symmetric positive definite matrix `1 + sum of multiples of R_k R_k^T`, and its factor.
pub(super) struct Envelope {
    /// Place of each coordinate in the order of elimination.
    places: Vec<usize>,
    /// First column of each row.
    first: Vec<usize>,
    /// Rows one after the other, each ends with its diagonal.
    starts: Vec<usize>,
    entries: Vec<f64>,
    right: Vec<f64>,
}

impl Envelope {
    /// Room for the matrices of `factor`; `None` if that is too much.
    pub(super) fn new(factor: &Factor) -> Option<Self> {
        let count = factor.coordinate_count();
        let places = reversed_cuthill_mckee(factor);
        let first = first_columns(factor, &places);
        let mut starts = vec![0];
        for (row, column) in first.iter().enumerate() {
            starts.push(starts[row] + row + 1 - column);
        }
        let size = starts[count];
        (size <= MOST_ENTRIES).then(|| Self {
            places,
            first,
            starts,
            entries: vec![0.0; size],
            right: vec![0.0; count],
        })
    }

    /// Sets the matrix to `1 + sigma sum R_k R_k^T` over the rows that are `active`, and factorises it.
    pub(super) fn factorise(&mut self, factor: &Factor, sigma: f64, active: &[bool]) {
        self.entries.fill(0.0);
        for row in 0..self.first.len() {
            self.entries[self.starts[row + 1] - 1] = 1.0;
        }
        for k in (0..factor.row_count()).filter(|&k| active[k]) {
            for (i, x) in factor.row(k) {
                for (j, y) in factor.row(k) {
                    let (row, column) = (self.places[i], self.places[j]);
                    if column <= row {
                        self.entries[self.starts[row] + column - self.first[row]] += sigma * x * y;
                    }
                }
            }
        }
        for row in 0..self.first.len() {
            self.eliminate(row);
        }
    }

    fn eliminate(&mut self, row: usize) {
        let (above, here) = self.entries.split_at_mut(self.starts[row]);
        let first = self.first[row];
        for column in first..row {
            let (start, from) = (self.starts[column], self.first[column].max(first));
            let other = &above[start + from - self.first[column]..self.starts[column + 1]];
            let (rest, diagonal) = other.split_at(column - from);
            let known = dot(&here[from - first..column - first], rest);
            here[column - first] = (here[column - first] - known) / diagonal[0];
        }
        let (left, diagonal) = here[..row + 1 - first].split_at_mut(row - first);
        // At least 1 but for rounding.
        diagonal[0] = (diagonal[0] - dot(left, left)).max(0.5).sqrt();
    }

    /// Overwrites `x` by the solution of the system with the right-hand side `x`.
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        let Self { places, first, starts, entries, right } = self;
        for (place, value) in places.iter().zip(&*x) {
            right[*place] = *value;
        }
        let row = |i: usize| entries[starts[i]..starts[i + 1]].split_at(i - first[i]);
        for i in 0..first.len() {
            let (left, diagonal) = row(i);
            right[i] = (right[i] - dot(left, &right[first[i]..i])) / diagonal[0];
        }
        for i in (0..first.len()).rev() {
            let (left, diagonal) = row(i);
            right[i] /= diagonal[0];
            let value = right[i];
            for (known, entry) in right[first[i]..i].iter_mut().zip(left) {
                *known -= value * entry;
            }
        }
        for (place, value) in places.iter().zip(x) {
            *value = right[*place];
        }
    }
}

/// First column of each row of the matrices, the coordinates in these places.
fn first_columns(factor: &Factor, places: &[usize]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..places.len()).collect();
    for k in 0..factor.row_count() {
        let least = factor.row(k).map(|(coordinate, _)| places[coordinate]).min().unwrap_or(0);
        factor.row(k).for_each(|(coordinate, _)| {
            first[places[coordinate]] = first[places[coordinate]].min(least);
        });
    }
    first
}

/// Place of each coordinate: breadth first from an end of each component, backwards.
fn reversed_cuthill_mckee(factor: &Factor) -> Vec<usize> {
    let count = factor.coordinate_count();
    let neighbours = neighbours(factor);
    let mut order: Vec<usize> = Vec::with_capacity(count);
    let mut is_known = vec![false; count];
    for seed in 0..count {
        if is_known[seed] {
            continue;
        }
        // The last of a search is far from its start, and that of a second farther.
        let mut end = seed;
        for _ in 0..2 {
            let mut trial = is_known.clone();
            end = breadth_first(&neighbours, end, &mut trial).last().copied().unwrap_or(end);
        }
        order.extend(breadth_first(&neighbours, end, &mut is_known));
    }
    let mut places = vec![0; count];
    order.iter().rev().enumerate().for_each(|(place, &coordinate)| places[coordinate] = place);
    places
}

fn breadth_first(neighbours: &[Vec<usize>], start: usize, is_known: &mut [bool]) -> Vec<usize> {
    let mut order = vec![start];
    is_known[start] = true;
    let mut next = 0;
    while next < order.len() {
        let begin = order.len();
        for &near in &neighbours[order[next]] {
            if !std::mem::replace(&mut is_known[near], true) {
                order.push(near);
            }
        }
        order[begin..].sort_by_key(|&coordinate| neighbours[coordinate].len());
        next += 1;
    }
    order
}

/// Coordinates that share a row.
fn neighbours(factor: &Factor) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); factor.coordinate_count()];
    for k in 0..factor.row_count() {
        for (i, _) in factor.row(k) {
            neighbours[i].extend(factor.row(k).map(|(j, _)| j).filter(|&j| j != i));
        }
    }
    for near in &mut neighbours {
        near.sort_unstable();
        near.dedup();
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_are_solved_to_rounding() {
        // A ring with chords: rows join coordinates in no order.
        let count = 40;
        let mut factor = Factor::new(count);
        for k in 0..90 {
            let wave = |phase: usize| ((k * 7 + phase) as f64).sin();
            factor.push((0..4).map(|n| ((k * 13 + n * (1 + k % 3)) % count, wave(n))));
        }
        let active: Vec<bool> = (0..90usize).map(|k| !k.is_multiple_of(4)).collect();
        let wanted: Vec<f64> = (0..count).map(|i| (i as f64).cos()).collect();
        let sigma = 30.0;
        let mut x = wanted.clone();
        for k in (0..90).filter(|&k| active[k]) {
            let product: f64 = factor.row(k).map(|(i, value)| value * wanted[i]).sum();
            factor.row(k).for_each(|(i, value)| x[i] += sigma * product * value);
        }
        let mut envelope = Envelope::new(&factor).expect("small");
        envelope.factorise(&factor, sigma, &active);
        envelope.solve(&mut x);
        for (found, wanted) in x.iter().zip(&wanted) {
            assert!((found - wanted).abs() < 1e-11, "{found} {wanted}");
        }
    }
}
