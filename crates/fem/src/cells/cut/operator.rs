//! Pieces in groups of lanes, and the sweep over them.

use gluey_linalg::{Jagged, Scalar};
use rayon::prelude::*;

use super::super::scalar::CellScalar;
use super::super::simd::{Lanes, Portable};
use super::kernel::{self, Pieces, Shapes, numbers, slots, twist_len};
use crate::cut::POINTS;
use crate::element::node_count;

/// Pieces are padded to multiples of this, the largest number of lanes.
const GROUP: usize = 16;
/// Numbers of a group of pieces with the most unknowns.
const MOST_SLOTS: usize = 96 * GROUP;
/// Stands for an unknown that a padding piece does not have.
const NONE: u32 = u32::MAX;

/// A part of a cell with the surface of one ball in it.
#[derive(Clone, Copy, Debug)]
pub struct CutPiece<'a, const D: usize> {
    /// Velocity nodes of the cell, as numbered in the vectors.
    pub nodes: &'a [u32],
    /// Its pressure nodes.
    pub pressures: &'a [u32],
    /// The ball.
    pub body: u32,
    /// Arm of the lower corner of the cell from the centre of the ball, in radii of the ball.
    pub origin: [f64; D],
    /// Edge of the cell in radii of the ball.
    pub edge: f64,
    /// `eta h^(D-2)`.
    pub viscous: f64,
    /// `h / eta`.
    pub pressure: f64,
    /// Integrals over the fluid in the unit cube; empty where another piece of the cell has them.
    pub volume: &'a [f64],
    /// Integrals of the normal out of the fluid.
    pub normal: &'a [[f64; D]],
    /// Integrals of `beta h / eta` over the surface.
    pub penalty: &'a [f64],
}

/// `[A, -B^T; -B, 0]` on pieces of cut cells, for vectors that hold the velocities of numbered nodes (`D`
/// interleaved components), then the twist of each ball (its spin times its radius), and pressures of
/// numbered nodes.
#[derive(Clone, Debug)]
pub struct CutOperator<T, const D: usize> {
    shapes: Shapes<T>,
    /// Place of the first number of a node, a pressure or a twist in the vectors, slot by slot in groups of
    /// lanes.
    places: Vec<u32>,
    /// Moments: group by group, see [`Pieces::moments`].
    moments: Vec<T>,
    /// `h / eta`, edge and origin: numbers of each piece, group by group.
    geometry: Vec<T>,
    /// Where in the loads of all pieces the terms of each node, pressure and twist are.
    velocity_terms: Jagged<u32>,
    pressure_terms: Jagged<u32>,
    twist_terms: Jagged<u32>,
    piece_count: usize,
    /// Shear of the cells.
    shear: T,
}

impl<T: CellScalar, const D: usize> CutOperator<T, D> {
    const NODES: usize = node_count::<D>(2);
    const CORNERS: usize = node_count::<D>(1);
    const SLOTS: usize = slots::<D>();
    const TWIST: usize = twist_len::<D>();
    const NUMBERS: usize = POINTS.pow(D as u32) * numbers::<D>();
    /// Of a piece beside its moments.
    const GEOMETRY: usize = D + 2;
    /// Nodes, pressures and the twist of a piece.
    const PLACES: usize = Self::NODES + Self::CORNERS + 1;

    /// The operator on these pieces, for so many nodes, pressures and balls.
    pub fn new<'a>(
        pieces: impl ExactSizeIterator<Item = CutPiece<'a, D>>,
        [node_count, pressure_count, body_count]: [usize; 3],
    ) -> Self {
        let piece_count = pieces.len();
        let group_count = piece_count.div_ceil(GROUP);
        let mut new = Self {
            shapes: Shapes::new(),
            places: vec![NONE; group_count * GROUP * Self::PLACES],
            moments: vec![T::ZERO; group_count * GROUP * Self::NUMBERS],
            geometry: vec![T::ZERO; group_count * GROUP * Self::GEOMETRY],
            velocity_terms: Jagged::default(),
            pressure_terms: Jagged::default(),
            twist_terms: Jagged::default(),
            piece_count,
            shear: T::ZERO,
        };
        for (k, piece) in pieces.enumerate() {
            new.set(k, &piece);
        }
        let corners = Self::NODES..Self::NODES + Self::CORNERS;
        new.velocity_terms = new.terms(0..Self::NODES, node_count);
        new.pressure_terms = new.terms(corners, pressure_count);
        new.twist_terms = new.terms(Self::PLACES - 1..Self::PLACES, body_count);
        new
    }

    /// The operator in cells that are sheared: a point of the unit cube has the place `x + shear y e_1`.
    #[must_use]
    pub fn sheared(self, shear: f64) -> Self {
        Self { shear: T::from_f64(shear), ..self }
    }

    fn set(&mut self, piece: usize, data: &CutPiece<'_, D>) {
        let (group, lane) = (piece / GROUP, piece % GROUP);
        let at = |count: usize, k: usize| (group * count + k) * GROUP + lane;
        let places = data.nodes.iter().chain(data.pressures).copied().chain([data.body]);
        for (k, place) in places.enumerate() {
            self.places[at(Self::PLACES, k)] = place;
        }
        let geometry = [data.pressure, data.edge].into_iter().chain(data.origin);
        for (k, value) in geometry.enumerate() {
            self.geometry[at(Self::GEOMETRY, k)] = T::from_f64(value);
        }
        for q in 0..POINTS.pow(D as u32) {
            let place = kernel::place::<D>(q);
            let volume = data.volume.get(q).copied().unwrap_or(0.0);
            let all = [volume].into_iter().chain(data.normal[q]).chain([data.penalty[q]]);
            for (k, value) in all.enumerate() {
                let number = T::from_f64(data.viscous * value);
                self.moments[at(Self::NUMBERS, place * numbers::<D>() + k)] = number;
            }
        }
    }

    /// Where the loads of the unknowns in these places are.
    fn terms(&self, range: std::ops::Range<usize>, count: usize) -> Jagged<u32> {
        let slot_of = |k: usize| match k {
            k if k < Self::NODES => k,
            k if k < Self::NODES + Self::CORNERS => k + (D - 1) * Self::NODES,
            _ => Self::SLOTS - Self::TWIST,
        };
        let groups = self.places.len() / (GROUP * Self::PLACES);
        let pairs = (0..groups)
            .flat_map(|group| range.clone().flat_map(move |k| (0..GROUP).map(move |lane| (group, k, lane))));
        let pairs = pairs.filter_map(|(group, k, lane)| {
            let place = self.places[(group * Self::PLACES + k) * GROUP + lane];
            (place != NONE)
                .then(|| (place as usize, ((group * Self::SLOTS + slot_of(k)) * GROUP + lane) as u32))
        });
        Jagged::grouped(count, pairs)
    }

    /// Number of pieces.
    pub fn piece_count(&self) -> usize {
        self.piece_count
    }

    /// `(y, q) += (A x - B^T p, -B x)`, or without the pressures where `q` is empty. `loads` is a workspace.
    pub fn add(&self, [x, p]: [&[T]; 2], [y, q]: [&mut [T]; 2], loads: &mut Vec<T>) {
        loads.resize(self.places.len() / Self::PLACES * Self::SLOTS, T::ZERO);
        let group_len = Self::SLOTS * GROUP;
        loads.par_chunks_mut(group_len).enumerate().for_each(|(group, loads)| {
            let mut unknowns = [T::ZERO; MOST_SLOTS];
            self.gather(group, [x, p], &mut unknowns);
            self.dispatch(group, &unknowns[..group_len], loads);
        });
        let (velocity, twists) = y.split_at_mut(self.velocity_terms.len() * D);
        sum_terms::<T, D>(&self.velocity_terms, loads, Self::NODES * GROUP, velocity);
        for (terms, twist) in self.twist_terms.iter().zip(twists.chunks_exact_mut(Self::TWIST)) {
            for (k, entry) in twist.iter_mut().enumerate() {
                *entry = terms.iter().fold(*entry, |sum, &at| sum + loads[at as usize + k * GROUP]);
            }
        }
        if !q.is_empty() {
            sum_terms::<T, 1>(&self.pressure_terms, loads, 0, q);
        }
    }

    /// The unknowns of a group of pieces; without pressures where `p` is empty.
    fn gather(&self, group: usize, [x, p]: [&[T]; 2], to: &mut [T]) {
        let places = &self.places[group * Self::PLACES * GROUP..][..Self::PLACES * GROUP];
        let twists = self.velocity_terms.len() * D;
        for (k, places) in places.chunks_exact(GROUP).enumerate() {
            for (lane, &place) in places.iter().enumerate().filter(|place| *place.1 != NONE) {
                let place = place as usize;
                if k < Self::NODES {
                    (0..D).for_each(|c| to[(c * Self::NODES + k) * GROUP + lane] = x[place * D + c]);
                } else if k + 1 < Self::PLACES {
                    let slot = k + (D - 1) * Self::NODES;
                    to[slot * GROUP + lane] = p.get(place).copied().unwrap_or(T::ZERO);
                } else {
                    for (e, &entry) in x[twists + place * Self::TWIST..][..Self::TWIST].iter().enumerate() {
                        to[(Self::SLOTS - Self::TWIST + e) * GROUP + lane] = entry;
                    }
                }
            }
        }
    }

    /// Runs the kernel compiled for the widest vectors this processor has.
    pub(super) fn dispatch(&self, group: usize, x: &[T], y: &mut [T]) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
                // SAFETY: the instructions the function is compiled for were detected just above; its code is
                // the safe generic `run`. The test `vector_and_portable_kernels_agree` compares all three.
                return unsafe { run_avx512(self, group, x, y) };
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                // SAFETY: as above.
                return unsafe { run_avx2(self, group, x, y) };
            }
        }
        self.run::<Portable<T>>(group, x, y);
    }

    /// A group of pieces.
    #[inline(always)]
    pub(super) fn run<V: Lanes<Scalar = T>>(&self, group: usize, x: &[T], y: &mut [T]) {
        let moments = &self.moments[group * Self::NUMBERS * GROUP..][..Self::NUMBERS * GROUP];
        let geometry = &self.geometry[group * Self::GEOMETRY * GROUP..][..Self::GEOMETRY * GROUP];
        for first in (0..GROUP).step_by(V::COUNT) {
            let at = |k: usize| V::load(&geometry[k * GROUP + first..]);
            let pieces = Pieces {
                moments: &moments[first..],
                step: GROUP,
                pressure: at(0),
                shear: V::splat(self.shear),
                edge: at(1),
                origin: std::array::from_fn(|d| if d < D { at(2 + d) } else { V::splat(T::ZERO) }),
            };
            kernel::apply::<V, D>(&self.shapes, &pieces, &x[first..], &mut y[first..]);
        }
    }

    /// The symmetric matrix of a piece, row by row: velocities node by node (`D` interleaved components),
    /// pressures, twist.
    pub fn matrix(&self, piece: usize, matrix: &mut [f64]) {
        let (group, lane) = (piece / GROUP, piece % GROUP);
        let slot_of = |k: usize| match k / D < Self::NODES {
            true => k % D * Self::NODES + k / D,
            false => k,
        };
        let (mut x, mut y) = (vec![T::ZERO; Self::SLOTS * GROUP], vec![T::ZERO; Self::SLOTS * GROUP]);
        // As many columns at a time as there are lanes.
        let alone = self.alone(group, lane);
        for first in (0..Self::SLOTS).step_by(GROUP) {
            let columns = first..(first + GROUP).min(Self::SLOTS);
            x.fill(T::ZERO);
            columns.clone().zip(0..).for_each(|(k, l): (usize, usize)| x[slot_of(k) * GROUP + l] = T::ONE);
            alone.dispatch(0, &x, &mut y);
            for (column, l) in columns.zip(0..) {
                for row in 0..Self::SLOTS {
                    matrix[row * Self::SLOTS + column] = y[slot_of(row) * GROUP + l].to_f64();
                }
            }
        }
    }

    /// An operator whose lanes are all this piece.
    fn alone(&self, group: usize, lane: usize) -> Self {
        let spread = |from: &[T], count: usize| -> Vec<T> {
            let group = &from[group * count * GROUP..][..count * GROUP];
            group.chunks_exact(GROUP).flat_map(|lanes| [lanes[lane]; GROUP]).collect()
        };
        Self {
            shapes: self.shapes.clone(),
            places: Vec::new(),
            moments: spread(&self.moments, Self::NUMBERS),
            geometry: spread(&self.geometry, Self::GEOMETRY),
            velocity_terms: Jagged::default(),
            pressure_terms: Jagged::default(),
            twist_terms: Jagged::default(),
            piece_count: GROUP,
            shear: self.shear,
        }
    }
}

/// Adds up the terms of every node with `N` components, whose loads are `stride` numbers apart.
fn sum_terms<T: Scalar, const N: usize>(terms: &Jagged<u32>, loads: &[T], stride: usize, y: &mut [T]) {
    y.par_chunks_exact_mut(N).with_min_len(256).enumerate().for_each(|(node, y)| {
        for &at in &terms[node] {
            y.iter_mut().enumerate().for_each(|(c, y)| *y += loads[at as usize + c * stride]);
        }
    });
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<T: CellScalar, const D: usize>(operator: &CutOperator<T, D>, group: usize, x: &[T], y: &mut [T]) {
    operator.run::<T::Avx2>(group, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
fn run_avx512<T: CellScalar, const D: usize>(
    operator: &CutOperator<T, D>,
    group: usize,
    x: &[T],
    y: &mut [T],
) {
    operator.run::<T::Avx512>(group, x, y);
}
