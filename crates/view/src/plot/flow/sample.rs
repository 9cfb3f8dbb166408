//! The flow at the pixels of a plane, by the quadratic elements that the files hold.

use gluey_fem::element::{gradient, value};
use gluey_geom::{Matrix, Vector};
use gluey_motion::Fields;

use super::choice::Quantity;
use super::plane::PicturePlane;

/// Degree of the elements.
const DEGREE: usize = 2;
/// Points so near the border of a cell, over its size, belong to it.
const SLACK: f64 = 1e-9;

/// The flow at a point.
#[derive(Clone, Debug)]
pub struct FlowSample<const D: usize> {
    pub velocity: Vector<D>,
    pub value: f64,
}

/// Pixels in rows from above; nothing outside the box.
pub struct Samples<const D: usize> {
    pub columns: usize,
    pub rows: usize,
    pub all: Vec<Option<FlowSample<D>>>,
}

impl<const D: usize> Samples<D> {
    /// What is drawn in colours.
    pub fn values(&self) -> impl Iterator<Item = Option<f64>> + '_ {
        self.all.iter().map(|sample| sample.as_ref().map(|sample| sample.value))
    }

    /// The pixel at parts of the width, and of the height from above.
    pub fn pixel(&self, [across, down]: [f64; 2]) -> usize {
        let place = |part: f64, count: usize| ((part * count as f64) as usize).min(count - 1);
        place(across, self.columns) + self.columns * place(down, self.rows)
    }
}

/// A flow, and the quantity that is sampled of it.
pub struct Sampling<'a, const D: usize> {
    pub fields: &'a Fields<D>,
    /// Displacement of the cells along x per unit of y.
    pub shear: f64,
    pub quantity: Quantity,
}

/// How far cells lean, per unit of height; nothing without cells.
pub fn shear<const D: usize>(fields: &Fields<D>) -> Option<f64> {
    let cell = fields.cells.get(..3usize.pow(D as u32))?;
    let up = fields.points[cell[6] as usize] - fields.points[cell[0] as usize];
    // Rounding is no shear: boxes at rest are upright.
    let shear = up[0] / up[1];
    Some(if shear.abs() < 1e-12 { 0.0 } else { shear })
}

/// A cell: a box that leans along x.
struct SampledCell<'a, const D: usize> {
    nodes: &'a [u32],
    lower: Vector<D>,
    size: Vector<D>,
    shear: f64,
}

impl<'a, const D: usize> Sampling<'a, D> {
    /// The flow at the middles of the pixels. Of a pixel between cells the last of them decides.
    pub fn samples(&self, plane: &PicturePlane<D>, columns: usize, rows: usize) -> Samples<D> {
        let mut all = vec![None; columns * rows];
        for nodes in self.fields.cells.chunks_exact(3usize.pow(D as u32)) {
            let cell = self.cell(nodes);
            let shifts = plane.period.map_or(vec![0.0], |period| vec![-period, 0.0, period]);
            for shift in shifts {
                let mut lower = cell.lower;
                lower[0] += shift;
                let cell = SampledCell { lower, ..cell };
                let Some(rectangle) = cell.rectangle(plane) else { continue };
                let [across, down] = plane.pixels_in(rectangle, columns, rows);
                for row in down {
                    for column in across.clone() {
                        let x = plane.point(plane.middle_of(column, row, columns, rows));
                        if let Some(local) = cell.local(&x) {
                            all[row * columns + column] = Some(self.sample(&cell, &local, plane.normal));
                        }
                    }
                }
            }
        }
        Samples { columns, rows, all }
    }

    fn cell(&self, nodes: &'a [u32]) -> SampledCell<'a, D> {
        let point = |node: usize| self.fields.points[nodes[node] as usize];
        let lower = point(0);
        // The last node of each edge from the lower corner.
        let size = Vector::from_fn(|d, _| point(2 * 3usize.pow(d as u32))[d] - lower[d]);
        SampledCell { nodes, lower, size, shear: self.shear }
    }

    fn sample(&self, cell: &SampledCell<'_, D>, local: &[f64; D], normal: usize) -> FlowSample<D> {
        let (mut velocity, mut slopes) = (Vector::<D>::zeros(), Matrix::<D>::zeros());
        let mut pressure = 0.0;
        for (i, &node) in cell.nodes.iter().enumerate() {
            let shape = value::<D>(DEGREE, i, local);
            let at_node = self.fields.velocity[node as usize];
            velocity += shape * at_node;
            pressure += shape * self.fields.pressure[node as usize];
            slopes += at_node * cell.gradient(i, local).transpose();
        }
        let value = match self.quantity {
            Quantity::Speed => velocity.norm(),
            Quantity::Pressure => pressure,
            Quantity::StrainRate => (0.5 * (slopes + slopes.transpose()).norm_squared()).sqrt(),
            Quantity::Vorticity => {
                let (first, second) = [(1, 2), (2, 0), (0, 1)][normal];
                slopes[(second, first)] - slopes[(first, second)]
            }
        };
        FlowSample { velocity, value }
    }
}

impl<const D: usize> SampledCell<'_, D> {
    /// Left, low, right, high in the plane; nothing if the plane does not cut the cell.
    fn rectangle(&self, plane: &PicturePlane<D>) -> Option<[f64; 4]> {
        let lean = self.shear * self.size[1];
        let ends = |axis: usize| {
            let (low, high) = (self.lower[axis], self.lower[axis] + self.size[axis]);
            if axis == 0 { (low + lean.min(0.0), high + lean.max(0.0)) } else { (low, high) }
        };
        if D == 3 {
            let (low, high) = ends(plane.normal);
            let slack = SLACK * (high - low);
            if plane.at < low - slack || plane.at > high + slack {
                return None;
            }
        }
        let ((left, right), (low, high)) = (ends(plane.across), ends(plane.up));
        Some([left, low, right, high])
    }

    /// Coordinates in the cell, from 0 to 1.
    fn local(&self, x: &Vector<D>) -> Option<[f64; D]> {
        let mut arm = x - self.lower;
        arm[0] -= self.shear * arm[1];
        let local: [f64; D] = std::array::from_fn(|d| arm[d] / self.size[d]);
        local.iter().all(|x| (-SLACK..=1.0 + SLACK).contains(x)).then_some(local)
    }

    /// Gradient of a shape function in space.
    fn gradient(&self, i: usize, local: &[f64; D]) -> Vector<D> {
        let slopes = gradient::<D>(DEGREE, i, local);
        let mut slopes = Vector::<D>::from_fn(|d, _| slopes[d] / self.size[d]);
        slopes[1] -= self.shear * slopes[0];
        slopes
    }
}
