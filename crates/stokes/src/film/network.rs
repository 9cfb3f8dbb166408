//! The block of the system for the twists of the bodies and the forces of films, solved exactly.
//!
//! With about the resistances `R` of the bodies by themselves and the rows `s B` of the films the block is
//!
//! `[R, s B^T; s B, -1]`, or `K = R + s^2 B^T B` without the forces,
//!
//! which is sparse, symmetric and positive definite. A correction `(v, g)` of twists and forces with
//! `K v = s B^T r`, `g = s B v - r` makes residuals `r` of the rows vanish and changes the other residuals by
//! no more than the least that any such correction does, in the metric of `R`. The scales `s` grow without
//! bound as films close. A residual that is small beside the loads on the bodies may still stand for a large
//! part of the speed at which a film closes, which is the smaller the thinner the film: rows that hold
//! exactly leave nothing of it, and are judged by nothing but the loads.
//!
//! Rows of what flows through films have nodes of the mesh in them and stay as they are: their forces follow
//! from the fluid, however stiff they are.

use std::ops::Range;
use std::sync::Arc;

use gluey_geom::Dim;
use gluey_linalg::{
    DirectError, DirectSpd, Ordering, Preconditioner, RefinementParams, Scalar, SparseMatrix, Substitution,
    Symbolic, vector,
};
use gluey_parallel::Halo;

/// Unknowns of a twist, at most.
const MOST_RIGID: usize = 6;

/// The body of a side that has none.
const NO_BODY: u32 = u32::MAX;

/// A row of the relative motion of the two sides of a film, `s B`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmRow {
    /// Its number among all rows of films.
    pub row: u32,
    bodies: [u32; 2],
    weights: [[f64; MOST_RIGID]; 2],
}

impl FilmRow {
    /// Numbers that a row is told in, see [`FilmRow::to_numbers`].
    pub const NUMBERS: usize = 3 + 2 * MOST_RIGID;

    /// The row with these entries of twists, of at most two bodies, each `rigid` numbers in order.
    pub(super) fn new(row: usize, rigid: usize, entries: &[(u32, f64)]) -> Self {
        let mut new = Self { row: row as u32, bodies: [NO_BODY; 2], weights: [[0.0; MOST_RIGID]; 2] };
        for (side, entries) in entries.chunks(rigid).enumerate().take(2) {
            new.bodies[side] = entries.first().map_or(NO_BODY, |entry| entry.0 / rigid as u32);
            new.weights[side].iter_mut().zip(entries).for_each(|(weight, entry)| *weight = entry.1);
        }
        new
    }

    /// The same with other numbers of bodies.
    #[must_use]
    pub fn renumbered(mut self, number: impl Fn(u32) -> u32) -> Self {
        self.bodies.iter_mut().filter(|body| **body != NO_BODY).for_each(|body| *body = number(*body));
        self
    }

    /// As numbers, for messages.
    pub fn to_numbers(self) -> [u64; Self::NUMBERS] {
        let head = [self.row, self.bodies[0], self.bodies[1]].map(u64::from);
        let weights = self.weights.as_flattened();
        std::array::from_fn(|k| head.get(k).copied().unwrap_or_else(|| weights[k - head.len()].to_bits()))
    }

    /// The row that these numbers tell.
    pub fn from_numbers(numbers: &[u64; Self::NUMBERS]) -> Self {
        let [row, first, second] = [0, 1, 2].map(|k| numbers[k] as u32);
        let weight = |side: usize, k: usize| f64::from_bits(numbers[3 + side * MOST_RIGID + k]);
        let weights = [0, 1].map(|side| std::array::from_fn(|k| weight(side, k)));
        Self { row, bodies: [first, second], weights }
    }

    /// Positions of its entries among the twists, `rigid` numbers for each body, with their weights.
    pub(super) fn entries(&self, rigid: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let sides = self.bodies.iter().zip(&self.weights).filter(|(body, _)| **body != NO_BODY);
        sides.flat_map(move |(&body, weights)| {
            weights[..rigid].iter().enumerate().map(move |(k, &weight)| (body as usize * rigid + k, weight))
        })
    }

    /// `s B V`.
    fn motion<S: Scalar>(&self, rigid: usize, twists: &[S]) -> f64 {
        self.entries(rigid).map(|(k, weight)| weight * twists[k].to_f64()).sum()
    }
}

/// The block of twists and films, factorised.
#[derive(Debug)]
pub struct FilmNetwork {
    rigid: usize,
    /// Bodies whose twists are data.
    held: Vec<bool>,
    /// The rows whose forces are here.
    rows: Vec<FilmRow>,
    factor: DirectSpd,
    shared: Option<SharedTwists>,
}

/// Twists of all bodies, of which each rank has some in its vectors.
#[derive(Clone, Debug)]
pub struct SharedTwists {
    /// The ranks.
    pub halo: Halo,
    /// Numbers among all bodies of those in vectors, in their order.
    pub bodies: Vec<u32>,
    /// Which of them this rank owns; the entries of others are zero.
    pub is_own: Vec<bool>,
}

impl SharedTwists {
    /// The own bodies: where their twists are in a vector, and among those of all.
    fn own(&self, rigid: usize) -> impl Iterator<Item = [Range<usize>; 2]> + '_ {
        let own = self.bodies.iter().enumerate().zip(&self.is_own).filter(|of| *of.1);
        own.map(move |((place, &body), _)| {
            [place, body as usize].map(|body| body * rigid..(body + 1) * rigid)
        })
    }
}

impl FilmNetwork {
    /// Of bodies with these resistances, a block for the twist of each, row by row, some of which may be
    /// `held` (no entries stand for none), and the rows of `all` films, of which those of `own` films have
    /// their forces in vectors here. `None` without films.
    ///
    /// # Errors
    /// [`DirectError`] if the block of a body is not positive definite.
    pub fn new<const D: usize>(
        twist_blocks: &[f64],
        held: &[bool],
        all: &[FilmRow],
        own: Vec<FilmRow>,
    ) -> Result<Option<Self>, DirectError> {
        if all.is_empty() {
            return Ok(None);
        }
        let rigid = Dim::<D>::RIGID;
        let is_held = |k: usize| held.get(k / rigid) == Some(&true);
        let of_blocks = twist_blocks.chunks_exact(rigid).enumerate().flat_map(|(k, row)| {
            let first = k / rigid * rigid;
            row.iter().enumerate().map(move |(l, &value)| (k, first + l, value))
        });
        let of_films = all.iter().flat_map(|row| {
            row.entries(rigid).flat_map(move |(k, a)| row.entries(rigid).map(move |(l, b)| (k, l, a * b)))
        });
        let free = of_blocks.chain(of_films).filter(|&(k, l, _)| !is_held(k) && !is_held(l));
        let dim = twist_blocks.len() / rigid;
        let fixed = (0..dim).filter(|&k| is_held(k)).map(|k| (k, k, 1.0));
        let triplets: Vec<_> = free.chain(fixed).collect();
        let matrix = SparseMatrix::from_triplets(dim, dim, &triplets).expect("films join known bodies");
        let symbolic = Symbolic::new(matrix.pattern().clone(), Ordering::Amd)?;
        let mut factor = DirectSpd::new(Arc::new(symbolic), RefinementParams::default())?;
        factor.factorise(matrix.values())?;
        Ok(Some(Self { rigid, held: held.to_vec(), rows: own, factor, shared: None }))
    }

    /// The same for vectors with the twists of some of the bodies.
    #[must_use]
    pub fn with_shared(self, twists: SharedTwists) -> Self {
        Self { shared: Some(twists), ..self }
    }

    /// Corrections with a workspace of their own.
    ///
    /// # Errors
    /// [`DirectError::OutOfMemory`].
    pub fn correction(&self) -> Result<FilmCorrection<'_>, DirectError> {
        let dim = self.factor.symbolic().dim();
        Ok(FilmCorrection {
            network: self,
            factor: self.factor.substitution(1)?,
            residuals: vec![0.0; self.rows.len()],
            load: vec![0.0; dim],
            twists: vec![0.0; dim],
            all: vec![0.0; if self.shared.is_some() { dim } else { 0 }],
        })
    }

    /// The motions of all bodies under a load, `K^-1` of it: zero for those that are held.
    ///
    /// # Errors
    /// [`DirectError::OutOfMemory`].
    pub fn respond(&self, load: &mut [f64]) -> Result<Vec<f64>, DirectError> {
        self.clear_held(load);
        let mut motions = vec![0.0; load.len()];
        self.factor.substitution(1)?.apply(load, &mut motions);
        Ok(motions)
    }

    /// The sums of the entries of own rows times `factors`, over all ranks: zero for bodies that are held.
    fn add_up(&self, factors: impl Iterator<Item = f64>, load: &mut [f64]) {
        load.fill(0.0);
        for (row, factor) in self.rows.iter().zip(factors) {
            row.entries(self.rigid).for_each(|(k, weight)| load[k] += weight * factor);
        }
        if let Some(shared) = &self.shared {
            shared.halo.sum_over_ranks(load);
        }
        self.clear_held(load);
    }

    fn clear_held(&self, load: &mut [f64]) {
        let bodies = load.chunks_exact_mut(self.rigid).zip(&self.held);
        bodies.filter(|(_, held)| **held).for_each(|(load, _)| load.fill(0.0));
    }
}

/// A correction that makes rows of films hold.
#[derive(Debug)]
pub struct FilmCorrection<'n> {
    network: &'n FilmNetwork,
    factor: Substitution<'n>,
    residuals: Vec<f64>,
    load: Vec<f64>,
    twists: Vec<f64>,
    /// The twists of all bodies, where ranks share them.
    all: Vec<f64>,
}

impl FilmCorrection<'_> {
    /// Changes the twists of all bodies and the forces `g` of own films so that `s B V - g = b` holds in the
    /// rows of motion. All ranks call this.
    pub fn apply<S: Scalar, T: Scalar>(&mut self, b: &[S], twists: &mut [T], g: &mut [S]) {
        let network = self.network;
        let Some(shared) = &network.shared else { return self.correct(b, twists, g) };
        let mut all = std::mem::take(&mut self.all);
        all.fill(0.0);
        for [here, at] in shared.own(network.rigid) {
            vector::convert(1.0, &twists[here], &mut all[at]);
        }
        shared.halo.sum_over_ranks(&mut all);
        self.correct(b, &mut all, g);
        for [here, at] in shared.own(network.rigid) {
            vector::convert(1.0, &all[at], &mut twists[here]);
        }
        self.all = all;
    }

    /// Writes the loads `s B^T g` on the bodies that vectors here have, of the forces `g` of own films by the
    /// numbers of their rows. All ranks call this.
    pub fn loads(&mut self, g: impl Fn(usize) -> f64, loads: &mut [f64]) {
        let Self { network, load, .. } = self;
        network.add_up(network.rows.iter().map(|row| g(row.row as usize)), load);
        let Some(SharedTwists { bodies, .. }) = &network.shared else { return loads.copy_from_slice(load) };
        let rigid = network.rigid;
        for (loads, &body) in loads.chunks_exact_mut(rigid).zip(bodies) {
            loads.copy_from_slice(&load[body as usize * rigid..][..rigid]);
        }
    }

    fn correct<S: Scalar, T: Scalar>(&mut self, b: &[S], twists: &mut [T], g: &mut [S]) {
        let Self { network, factor, residuals, load, twists: change, .. } = self;
        let rigid = network.rigid;
        for (row, residual) in network.rows.iter().zip(&mut *residuals) {
            let at = row.row as usize;
            *residual = b[at].to_f64() - row.motion(rigid, twists) + g[at].to_f64();
        }
        network.add_up(residuals.iter().copied(), load);
        factor.apply(load, change);
        let sums = twists.iter_mut().zip(&*change);
        sums.for_each(|(twist, change)| *twist = T::from_f64(twist.to_f64() + change));
        for (row, residual) in network.rows.iter().zip(&*residuals) {
            let at = row.row as usize;
            g[at] = S::from_f64(g[at].to_f64() + row.motion(rigid, change) - residual);
        }
    }
}
