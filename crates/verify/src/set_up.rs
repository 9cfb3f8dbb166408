//! Set-ups and measures that several cases share.

use std::f64::consts::PI;

use gluey_geom::{Aabb, Dim, Matrix, Spin, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::fem::TreeMesh;
use gluey_stokes::{Flow, FlowSolver, Refinement, Stress};
use gluey_testkit::exact::{InclusionViscosity, RigidSphere, ViscousInclusion};
use gluey_testkit::reference::{self, TableError};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerifyError};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::norms::Lattice;
use crate::number::Number;
use crate::statistics::{mean, scatter};

/// The tolerance of a solve that cases have by default.
pub const DEFAULT_TOLERANCE: f64 = 1e-6;

/// Radius of the discs in the reference data.
pub const RADIUS: f64 = 0.05;

/// One flow, computed from nothing.
pub fn solve<const D: usize>(
    method: &Method,
    tolerance: f64,
    mesh: TreeMesh<D>,
    balls: &[Ball<D>],
    boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
) -> Result<Flow<D>, VerifyError> {
    Ok(FlowSolver::new(method.params::<D>(tolerance))?.solve(mesh, balls, boundary)?)
}

/// The mesh of the unit box.
pub fn mesh<const D: usize>(refinement: &Refinement, balls: &[Ball<D>]) -> Result<TreeMesh<D>, VerifyError> {
    Ok(refinement.mesh(Aabb::unit(), [1; D], [false; D], balls)?)
}

/// The level of the unit box whose cells fit this many times into a radius.
pub fn level(radius: f64, cells_per_radius: f64) -> u8 {
    (cells_per_radius / radius).log2().round() as u8
}

/// The mesh of a box with periodic borders, its edges one long, whose cells are of one size.
pub fn periodic_mesh<const D: usize>(level: u8, balls: &[Ball<D>]) -> Result<TreeMesh<D>, VerifyError> {
    let refinement = Refinement { coarsest: level, ..Refinement::to_level(level) };
    Ok(refinement.mesh(Aabb::unit(), [1; D], [true; D], balls)?)
}

/// The radius of a body that takes this share of the unit box.
pub fn radius_of(dimension: usize, phi: f64) -> f64 {
    if dimension == 2 { (phi / PI).sqrt() } else { (0.75 * phi / PI).cbrt() }
}

/// Couette flow `(y - 1/2) e_x`.
pub fn couette<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] - 0.5;
    u
}

/// The gradient of simple shear at the rate one, `y e_x`.
pub fn simple_shear<const D: usize>() -> Matrix<D> {
    let mut gradient = Matrix::zeros();
    gradient[(0, 1)] = 1.0;
    gradient
}

/// The stress of a flow that was asked for it.
///
/// # Errors
/// [`VerifyError::NoReference`] for one that was not.
pub fn stress_of<const D: usize>(flow: &Flow<D>) -> Result<&Stress<D>, VerifyError> {
    flow.stress.as_ref().ok_or_else(|| VerifyError::NoReference("the stress".to_owned()))
}

/// Half the edge of the box around one body of radius one, in radii.
const HALF_WIDTH: f64 = 2.5;

/// The nodes of a box around one body of radius one, with this many cells in a radius.
pub fn around_one_body<const D: usize>(cells: f64) -> Lattice<D> {
    let corner = Vector::<D>::repeat(HALF_WIDTH);
    let domain = Aabb { lower: -corner, upper: corner };
    Lattice { domain, cells: (2.0 * HALF_WIDTH * cells).round() as usize }
}

/// The mesh of equal cells with as few roots as possible.
pub fn uniform<const D: usize>(lattice: &Lattice<D>) -> Result<TreeMesh<D>, VerifyError> {
    let level = lattice.cells.trailing_zeros();
    let roots = (lattice.cells >> level) as u32;
    Ok(TreeMesh::uniform(lattice.domain, [roots; D], [false; D], level as u8)?)
}

/// A disc of radius one and of this viscosity in a linear flow, and the strain of that.
pub fn disc_in_linear_flow(
    center: Vector<2>,
    inclusion_viscosity: InclusionViscosity,
) -> (ViscousInclusion, Matrix<2>) {
    let (pure_shear, simple_shear, spin) = (0.6, 1.0, -0.5);
    let disc = ViscousInclusion {
        center,
        radius: 1.0,
        matrix_viscosity: 1.0,
        inclusion_viscosity,
        pure_shear,
        simple_shear,
        spin,
    };
    (disc, Matrix::<2>::new(0.6, 0.5, 0.5, -0.6))
}

/// A rigid sphere of radius one in a general linear flow.
pub fn sphere_in_linear_flow(center: Vector<3>) -> RigidSphere {
    RigidSphere {
        center,
        radius: 1.0,
        viscosity: 1.0,
        strain: Matrix::<3>::new(0.5, 0.2, -0.3, 0.2, -0.8, 0.4, -0.3, 0.4, 0.3),
        spin: Spin::<3>::new(0.3, -0.2, -0.5),
    }
}

/// Position number `k` of a body relative to the lattice, in cells from -1/2 to 1/2: multiples of powers of
/// the root of `x^4 = x + 1` modulo one, which fill the cell evenly.
pub fn shift<const D: usize>(k: usize) -> Vector<D> {
    let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
    Vector::from_fn(|d, _| ((k + 1) as f64 * steps[d]).fract() - 0.5)
}

/// Two balls around `center`, at a gap of `gap` radii and an angle of their line of centres in degrees.
pub fn pair<const D: usize>(center: Vector<D>, radius: f64, gap: f64, degrees: f64) -> [Ball<D>; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let mut arm = Vector::zeros();
    arm[0] = cos * radius * (1.0 + 0.5 * gap);
    arm[1] = sin * radius * (1.0 + 0.5 * gap);
    [Ball::new(center - arm, radius), Ball::new(center + arm, radius)]
}

/// The motion of two balls relative to each other in the plane of shear.
#[derive(Clone, Copy, Debug)]
pub struct PairMotion {
    /// Speed along the line of centres, negative when they approach.
    pub normal_speed: f64,
    /// Rate at which the line of centres turns.
    pub line_rotation: f64,
    /// Spin of the first ball about the axis of vorticity.
    pub spin: f64,
}

impl PairMotion {
    /// That of two balls at these centres.
    pub fn of<const D: usize>(centers: [Vector<D>; 2], twists: &[Twist<D>]) -> Self {
        let line = centers[1] - centers[0];
        let e = line.normalize();
        let relative = twists[1].velocity - twists[0].velocity;
        Self {
            normal_speed: relative.dot(&e),
            line_rotation: (e[0] * relative[1] - e[1] * relative[0]) / line.norm(),
            spin: twists[0].spin[Dim::<D>::ROT - 1],
        }
    }
}

/// Mean and scatter of a measure over the rows at `at`, as numbers of what `name` says.
pub fn mean_and_scatter(
    table: &CaseTable,
    method: &'static str,
    measure: &str,
    at: &[(&str, f64)],
    name: &str,
) -> [Number; 2] {
    let values = table.values(measure, method, at);
    Number::mean_and_scatter(name, method, mean(&values), scatter(&values))
}

/// The cells of these names in the row of a table of exact values where columns have these values.
///
/// # Errors
/// [`VerifyError::NoReference`] if there is no such row.
pub fn exact_row<const N: usize>(
    table: &reference::Table,
    at: &[(&str, f64)],
    names: [&str; N],
) -> Result<[f64; N], VerifyError> {
    let keys = at.iter().map(|&(name, value)| Ok((table.column(name)?, value)));
    let keys = keys.collect::<Result<Vec<_>, TableError>>()?;
    let row = (0..table.row_count()).find(|&row| keys.iter().all(|(column, value)| column[row] == *value));
    let row = row.ok_or_else(|| VerifyError::NoReference(format!("{at:?}")))?;
    let mut values = [0.0; N];
    for (value, name) in values.iter_mut().zip(names) {
        *value = table.column(name)?[row];
    }
    Ok(values)
}

/// The measures of a pair by a method, with these cells per radius, at this gap and position.
type PairMeasure = fn(&Method, f64, f64, usize) -> Result<Vec<f64>, VerifyError>;

/// A chapter on two spheres in a periodic box, each at several places in the cells and in several directions.
pub struct SpherePairs {
    /// Cells per radius.
    pub meshes: &'static [f64],
    /// Gaps in radii.
    pub gaps: &'static [f64],
}

impl SpherePairs {
    /// A computation for each mesh, gap and position, by the methods that know such boxes.
    pub fn tasks(&self, extent: Extent, measure: PairMeasure) -> Vec<Task> {
        let positions = if extent == Extent::Quick { 2 } else { 8 };
        let places = iproduct!(IN_SHEARED_BOXES, self.meshes, self.gaps, 0..positions);
        let task = |(method, &cells, &gap, k): (&'static Method, &f64, &f64, usize)| {
            Task::new(method.name, &[cells, gap, k as f64], move || measure(method, cells, gap, k))
        };
        places.map(task).collect()
    }

    /// Mean and scatter of each measure over the positions; names begin with `what`.
    pub fn numbers(&self, table: &CaseTable, measures: &[&str], what: &str) -> Vec<Number> {
        let places = iproduct!(IN_SHEARED_BOXES, self.meshes, self.gaps, measures);
        let of_place = |(method, cells, gap, measure): (&Method, &f64, &f64, &&str)| {
            let name = format!("{what}{measure}, a/h = {cells}, gap {gap} a");
            mean_and_scatter(table, method.name, measure, &[("a/h", *cells), ("gap", *gap)], &name)
        };
        places.flat_map(of_place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_lie_in_a_cell_and_are_spread() {
        let shifts: Vec<Vector<3>> = (0..27).map(shift).collect();
        assert!(shifts.iter().all(|s| s.amax() <= 0.5));
        let mean = shifts.iter().sum::<Vector<3>>() / 27.0;
        assert!(mean.amax() < 0.12, "{mean:?}");
    }

    #[test]
    fn levels_have_the_cells_they_are_asked_for() {
        assert_eq!([3.2, 6.4, 12.8].map(|cells| level(RADIUS, cells)), [6, 7, 8]);
        assert_eq!(level(0.0125, 3.2), 8);
    }

    /// In a rigid rotation the pair keeps its distance and turns with it.
    #[test]
    fn a_pair_in_a_rigid_motion_only_turns() {
        let balls = pair(Vector::<2>::new(0.4, 0.6), RADIUS, 0.3, 35.0);
        let centers = balls.map(|ball| *ball.center());
        let twists = centers.map(|x| Twist {
            velocity: Vector::<2>::new(-x[1], x[0]) * 0.7,
            spin: gluey_geom::Spin::<2>::new(0.7),
        });
        let motion = PairMotion::of(centers, &twists);
        assert!(motion.normal_speed.abs() < 1e-16);
        assert!((motion.line_rotation - 0.7).abs() < 1e-15 && motion.spin == 0.7);
    }
}
