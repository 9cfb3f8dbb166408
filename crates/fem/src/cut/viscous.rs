//! The viscous matrices of cut cells, by products of shape functions.
//!
//! With the integrals `V_ab` of `d_a phi_i d_b phi_j` over the fluid, `N_ab` of `phi_i d_a phi_j n_b` and `P`
//! of `beta phi_i phi_j` over the surface, Nitsche's form
//!
//! `int 2 eps(u):eps(v) - int (2 eps(u) n).v - int (2 eps(v) n).u + int beta u.v`
//!
//! has the entry `delta_ab (sum_d (V_dd - N_dd - N_dd^T) + P) + V_ba - N_ab - N_ba^T` for component `a` at
//! node `i` and `b` at node `j`. To apply the form to one unknown after another would cost twenty times as
//! much.

use gluey_linalg::vectorised;

use super::moments::{CutMoments, SurfaceMoments};
use super::polynomials::POINTS;
use super::products::{PairLines, Places, Products, add_products, pair_count};
use crate::element::node_count;

/// Points of a cell, at most.
const MOST_POINTS: usize = POINTS * POINTS * POINTS;

/// Tables that viscous matrices are made with.
#[derive(Clone, Debug)]
pub struct ViscousMatrices<const D: usize> {
    shear: f64,
    lines: PairLines<D>,
    places: Places,
    /// `V_ab`.
    volume: Products<D>,
    /// `N_ab` by derivative and normal.
    normal: [[Vec<f64>; D]; D],
    /// `P`.
    penalty: Vec<f64>,
}

impl<const D: usize> ViscousMatrices<D> {
    /// For cells with this shear.
    pub fn new(shear: f64) -> Self {
        let plane = || vec![0.0; pair_count::<D>()];
        Self {
            shear,
            lines: PairLines::new([0.0; D]),
            places: Places::new::<D>(),
            volume: Products::zeros(),
            normal: std::array::from_fn(|_| std::array::from_fn(|_| plane())),
            penalty: plane(),
        }
    }

    /// Writes the matrix of a cell with Nitsche's penalty, in units of `factor`, row by row, components of a
    /// node side by side.
    pub fn fill(&mut self, moments: &CutMoments<D>, penalty: f64, factor: f64, matrix: &mut [f64]) {
        self.volume.clear();
        self.volume.add(&self.lines, &moments.volume);
        self.volume.shear(self.shear);
        vectorised(
            #[inline(always)]
            || self.integrate(&moments.surfaces, penalty),
        );
        self.write(factor, matrix);
    }

    /// The integrals over all surfaces.
    #[inline(always)]
    fn integrate(&mut self, surfaces: &[SurfaceMoments<D>], factor: f64) {
        let Self { lines, normal, penalty, .. } = self;
        let mut numbers = [0.0; MOST_POINTS];
        let numbers = &mut numbers[..POINTS.pow(D as u32)];
        for surface in surfaces {
            numbers.iter_mut().zip(&surface.area).for_each(|(n, area)| *n += factor * area);
        }
        penalty.fill(0.0);
        add_products(lines, [None, None], numbers, penalty);
        for b in 0..D {
            numbers.fill(0.0);
            for surface in surfaces {
                numbers.iter_mut().zip(&surface.normal).for_each(|(n, normal)| *n += normal[b]);
            }
            for (a, of_normals) in normal.iter_mut().enumerate() {
                of_normals[b].fill(0.0);
                add_products(lines, [None, Some(a)], numbers, &mut of_normals[b]);
            }
            // In space.
            let [first, second, ..] = &mut normal[..] else { continue };
            second[b].iter_mut().zip(&first[b]).for_each(|(sum, along)| *sum -= self.shear * along);
        }
    }

    /// The entries, by pairs of nodes.
    fn write(&self, factor: f64, matrix: &mut [f64]) {
        let (n, normal) = (node_count::<D>(2), &self.normal);
        let size = D * n;
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let [here, there] = [[i, j], [j, i]].map(|pair| self.places.of(pair));
            let on_diagonal =
                |d: usize| self.volume.of([d, d], [i, j]) - normal[d][d][here] - normal[d][d][there];
            let diagonal = self.penalty[here] + (0..D).map(on_diagonal).sum::<f64>();
            for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
                // The integral of `d_b phi_i d_a phi_j`.
                let volume =
                    if b >= a { self.volume.of([b, a], [i, j]) } else { self.volume.of([a, b], [j, i]) };
                let mut entry = volume - normal[a][b][here] - normal[b][a][there];
                if a == b {
                    entry += diagonal;
                }
                matrix[(i * D + a) * size + j * D + b] = factor * entry;
                matrix[(j * D + b) * size + i * D + a] = factor * entry;
            }
        }
    }
}
