//! Poisson's equation `-laplace u = f` with biquadratic elements on an adaptive tree:
//! `cargo run --release -p gluey-fem --example poisson`.
//!
//! The solution is a peak `u = exp(-a |x - c|^2)` with its values on the boundary of the unit square; cells
//! near the peak are one level finer, so there are hanging nodes. These and the boundary values are affine
//! constraints `u = T x + g` in the free nodes, and the equations of these are `T^T K T x = T^T (f - K g)`.
//! The error in the mean square falls with the third power of the cell size, as for any smooth function and
//! elements of degree 2: a wrong constraint, a wrong weight or a wrong sign would show as a lower order.

use std::error::Error;
use std::sync::Arc;

use gluey_fem::element::{gauss_cube, gradient, node_count, value};
use gluey_fem::{NodeMap, TreeMesh};
use gluey_geom::{Aabb, Vector};
use gluey_linalg::{
    AffineConstraints, DirectSpd, Ordering, Pattern, RefinementParams, SparseMatrix, Subset, Symbolic,
};

/// Degree of the elements.
const DEGREE: usize = 2;
/// Gauss points per direction.
const POINTS: usize = 4;
/// Sharpness `a` of the peak.
const SHARPNESS: f64 = 20.0;

/// Prints the table and checks the order.
pub fn main() -> Result<(), Box<dyn Error>> {
    println!("level    cells  unknowns  hanging      error  order");
    let mut last: Option<f64> = None;
    for level in 2..=6 {
        let Solution { cells, unknowns, hanging, error } = solve::<2>(level)?;
        let order = last.map(|last| (last / error).log2());
        let shown = order.map_or("-".to_owned(), |order| format!("{order:.2}"));
        println!("{level:5} {cells:8} {unknowns:9} {hanging:8} {error:10.3e} {shown:>6}");
        if let Some(order) = order.filter(|_| level > 3) {
            assert!((order - 3.0).abs() < 0.2, "the order is {order}");
        }
        last = Some(error);
    }
    Ok(())
}

/// A solved problem: the numbers of a row of the table.
pub struct Solution {
    /// Number of cells.
    pub cells: usize,
    /// Number of free nodes.
    pub unknowns: usize,
    /// Number of hanging nodes.
    pub hanging: usize,
    /// Error in the mean square.
    pub error: f64,
}

fn peak<const D: usize>(x: &Vector<D>) -> f64 {
    (-SHARPNESS * (x - Vector::repeat(0.3)).norm_squared()).exp()
}

/// `-laplace` of the peak.
fn load<const D: usize>(x: &Vector<D>) -> f64 {
    let square = (x - Vector::repeat(0.3)).norm_squared();
    (2.0 * D as f64 - 4.0 * SHARPNESS * square) * SHARPNESS * peak(x)
}

/// Solves on cells of `level`, and of one more near the peak.
pub fn solve<const D: usize>(level: u8) -> Result<Solution, Box<dyn Error>> {
    let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], level + 1, |lower, h, l| {
        l < level || (lower + Vector::repeat(0.5 * h - 0.3)).norm() < 0.25
    })?;
    let nodes = NodeMap::new(&mesh, DEGREE);
    let constraints = constraints(&nodes);
    let (matrix, b) = assemble(&mesh, &nodes, &constraints)?;
    let symbolic = Arc::new(Symbolic::new(matrix.pattern().clone(), Ordering::Amd)?);
    let mut solver = DirectSpd::new(symbolic, RefinementParams::default())?;
    solver.factorise(matrix.values())?;
    let mut x = vec![0.0; b.len()];
    solver.solve(&b, &mut x)?;
    let mut u = vec![0.0; nodes.node_count()];
    constraints.apply(&x, &mut u);
    Ok(Solution {
        cells: mesh.cell_count(),
        unknowns: x.len(),
        hanging: nodes.constraints().len(),
        error: error(&mesh, &nodes, &u),
    })
}

/// Every node in terms of the free ones.
fn constraints<const D: usize>(nodes: &NodeMap<D>) -> AffineConstraints {
    let free = Subset::new(nodes.node_count(), |n| !nodes.is_hanging(n) && !nodes.is_on_boundary(n));
    let mut constraints = AffineConstraints::zeros(nodes.node_count(), free.len());
    for node in 0..nodes.node_count() {
        match free.number(node) {
            Some(unknown) => constraints.set(node, [(unknown as u32, 1.0)]),
            None => constraints.set_inhomogeneity(node, peak(&nodes.point(node))),
        }
    }
    for hanging in nodes.constraints() {
        let masters = hanging.masters.iter().map(|&(master, weight)| (master as usize, weight));
        constraints.set_combination(hanging.node as usize, masters);
    }
    constraints
}

/// `T^T K T` and `T^T (f - K g)`, cell by cell.
fn assemble<const D: usize>(
    mesh: &TreeMesh<D>,
    nodes: &NodeMap<D>,
    constraints: &AffineConstraints,
) -> Result<(SparseMatrix, Vec<f64>), Box<dyn Error>> {
    let terms = |node: u32| constraints.terms(node as usize);
    let unknowns_of =
        |cell: usize| nodes.cell(cell).iter().flat_map(|&n| terms(n)).map(|term| term.0 as usize);
    let groups: Vec<Vec<usize>> = (0..mesh.cell_count()).map(|cell| unknowns_of(cell).collect()).collect();
    let pattern = Pattern::from_groups(constraints.unknown_count(), &groups)?;
    let mut matrix = SparseMatrix::zeros(Arc::new(pattern));
    let mut b = vec![0.0; constraints.unknown_count()];
    let stiffness = stiffness::<D>();
    for (index, cell) in mesh.cells().iter().enumerate() {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        let local = nodes.cell(index);
        for (i, &row) in local.iter().enumerate() {
            let at =
                |x: &[f64; D]| load(&(lower + Vector::from_fn(|d, _| h * x[d]))) * value::<D>(DEGREE, i, x);
            let mut f: f64 =
                gauss_cube::<D>(POINTS).iter().map(|(x, weight)| weight * h.powi(D as i32) * at(x)).sum();
            for (j, &column) in local.iter().enumerate() {
                let k = h.powi(D as i32 - 2) * stiffness[i * local.len() + j];
                f -= k * constraints.inhomogeneity(column as usize);
                for &(r, v) in terms(row) {
                    for &(c, w) in terms(column) {
                        matrix.add(r as usize, c as usize, v * w * k)?;
                    }
                }
            }
            terms(row).iter().for_each(|&(r, v)| b[r as usize] += v * f);
        }
    }
    Ok((matrix, b))
}

/// `int grad phi_i . grad phi_j` over the unit cube.
fn stiffness<const D: usize>() -> Vec<f64> {
    let n = node_count::<D>(DEGREE);
    let mut matrix = vec![0.0; n * n];
    for (x, weight) in gauss_cube::<D>(POINTS) {
        let slopes: Vec<[f64; D]> = (0..n).map(|i| gradient::<D>(DEGREE, i, &x)).collect();
        for (k, entry) in matrix.iter_mut().enumerate() {
            *entry += weight * (0..D).map(|d| slopes[k / n][d] * slopes[k % n][d]).sum::<f64>();
        }
    }
    matrix
}

/// Distance from the peak in the mean square.
fn error<const D: usize>(mesh: &TreeMesh<D>, nodes: &NodeMap<D>, u: &[f64]) -> f64 {
    let mut square = 0.0;
    for (index, cell) in mesh.cells().iter().enumerate() {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        for (x, weight) in gauss_cube::<D>(POINTS) {
            let local = nodes.cell(index).iter().enumerate();
            let found: f64 = local.map(|(i, &n)| value::<D>(DEGREE, i, &x) * u[n as usize]).sum();
            let exact = peak(&(lower + Vector::from_fn(|d, _| h * x[d])));
            square += weight * h.powi(D as i32) * (found - exact).powi(2);
        }
    }
    square.sqrt()
}
