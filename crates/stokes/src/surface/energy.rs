//! Strain energies of nodal velocities, in the fluid and at surfaces.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, node_count};
use gluey_geom::{Matrix, Vector};

use super::cut_cells::{CellState, CutCells};
use super::shapes::slope;
use crate::space::Discretisation;

/// Gauss points per direction for products of strains in whole cells.
const STRAIN_POINTS: usize = 3;

/// A Gauss rule: weights, and the gradients of the velocity functions in a cell with edges of length one.
type GaussRule<const D: usize> = Vec<(f64, Vec<Vector<D>>)>;

/// Strain energies on one mesh, of velocities `E x + u` with a strain `E` and nodal values `u`.
pub struct StrainEnergy<'a, const D: usize> {
    discretisation: &'a Discretisation<D>,
    cut: &'a CutCells<D>,
    whole: GaussRule<D>,
    fine: GaussRule<D>,
}

impl<'a, const D: usize> StrainEnergy<'a, D> {
    /// Those in the fluid that bodies leave of a mesh.
    pub fn new(discretisation: &'a Discretisation<D>, cut: &'a CutCells<D>) -> Self {
        let shear = discretisation.mesh.shear();
        let rule = |points: usize| -> GaussRule<D> {
            let of_point = |x: &[f64; D]| (0..node_count::<D>(2)).map(|i| slope(shear, i, x)).collect();
            gauss_cube::<D>(points).iter().map(|(x, weight)| (*weight, of_point(x))).collect()
        };
        Self { discretisation, cut, whole: rule(STRAIN_POINTS), fine: rule(POINTS) }
    }

    /// `int 2 eps:eps` over the fluid in a cell of the mesh.
    pub fn in_cell(&self, cell: usize, velocity: &[f64], strain: &Matrix<D>) -> f64 {
        let volume = self.cut.cut(cell).map(|cut| &cut.moments.volume);
        let doubled = match volume {
            Some(volume) => self.sum(cell, &self.fine, velocity, strain, |q, _| volume[q]),
            None if self.cut.states[cell] != CellState::Fluid => 0.0,
            None => self.sum(cell, &self.whole, velocity, strain, |_, weight| weight),
        };
        0.5 * doubled
    }

    /// `h int 4 eps:eps` over the surfaces in a cut cell with edges of length `h`.
    pub fn at_surfaces(&self, place: usize, velocity: &[f64], strain: &Matrix<D>) -> f64 {
        let cut = &self.cut.cells[place];
        let area = cut.moments.area();
        self.sum(cut.cell as usize, &self.fine, velocity, strain, |q, _| area[q])
    }

    /// `h^D` times the sum of `4 eps:eps` at the points of a rule with the weights `weight(q, w_q)`.
    fn sum(
        &self,
        cell: usize,
        rule: &GaussRule<D>,
        velocity: &[f64],
        strain: &Matrix<D>,
        weight: impl Fn(usize, f64) -> f64,
    ) -> f64 {
        let h = self.discretisation.cell_size(cell);
        let nodes = self.discretisation.velocity.cell(cell);
        let nodal = |&node: &u32| Vector::<D>::from_column_slice(&velocity[node as usize * D..][..D]);
        let velocities: Vec<Vector<D>> = nodes.iter().map(nodal).collect();
        let of_point = |(q, (of_rule, slopes)): (usize, &(f64, Vec<Vector<D>>))| {
            let mut gradient = strain * h;
            for (u, slope) in velocities.iter().zip(slopes) {
                gradient += u * slope.transpose();
            }
            let twice = gradient + gradient.transpose();
            weight(q, *of_rule) * twice.norm_squared()
        };
        h.powi(D as i32 - 2) * rule.iter().enumerate().map(of_point).sum::<f64>()
    }
}
