//! Poisson's equation by GCR with a two-grid cycle: `cargo run --release -p gluey-linalg --example two_grid`.
//!
//! The cycle smooths with Chebyshev polynomials, restricts the residual to a grid of half as many points per
//! direction, solves there directly, interpolates the correction and smooths again. The number of iterations
//! does not grow with the grid: that is the point of a multigrid method.

use std::error::Error;
use std::sync::Arc;

use gluey_linalg::{
    AffineConstraints, Chebyshev, ChebyshevParams, DirectSpd, Gcr, GcrParams, Guess, Jacobi, Ordering,
    Preconditioner, Reference, RefinementParams, SparseMatrix, Symbolic, vector,
};

/// Prints the table and checks it.
pub fn main() -> Result<(), Box<dyn Error>> {
    println!("points  iterations");
    let mut counts = Vec::new();
    for n in [15, 31, 63, 127] {
        counts.push(iterations(n)?);
        println!("{n:3}^2   {:10}", counts[counts.len() - 1]);
    }
    assert!(counts.iter().all(|&count| count <= counts[0] + 1), "the number of iterations grows: {counts:?}");
    Ok(())
}

/// Iterations of GCR for the five-point Laplacian on `n x n` points, `n` odd, to a residual of 1e-10.
fn iterations(n: usize) -> Result<usize, Box<dyn Error>> {
    let mut a = laplacian(n)?;
    let mut cycle = TwoGrid::new(&a, n)?;
    let b = vec![1.0; n * n];
    let mut x = vec![0.0; n * n];
    let mut gcr = Gcr::new(GcrParams { relative_tolerance: 1e-10, ..Default::default() });
    let report = gcr.solve(&mut a, &mut cycle, &b, &mut x, Reference::RightHandSide)?;
    assert!(report.residual_norm <= 1e-10 * vector::norm(&b), "the true residual is checked");
    Ok(report.iterations)
}

/// The five-point Laplacian on `n x n` points with zero values around them.
fn laplacian(n: usize) -> Result<SparseMatrix, Box<dyn Error>> {
    let mut entries = Vec::new();
    for row in 0..n * n {
        entries.push((row, row, 4.0));
        if row % n > 0 {
            entries.extend([(row, row - 1, -1.0), (row - 1, row, -1.0)]);
        }
        if row >= n {
            entries.extend([(row, row - n, -1.0), (row - n, row, -1.0)]);
        }
    }
    Ok(SparseMatrix::from_triplets(n * n, n * n, &entries)?)
}

/// Bilinear interpolation from the points with odd coordinates.
fn interpolation(n: usize) -> AffineConstraints {
    let coarse = n / 2;
    let line = |i: usize| match i % 2 {
        1 => vec![(i / 2, 1.0)],
        _ => [(i / 2).checked_sub(1), Some(i / 2).filter(|&k| k < coarse)]
            .into_iter()
            .flatten()
            .map(|k| (k, 0.5))
            .collect(),
    };
    let mut p = AffineConstraints::zeros(n * n, coarse * coarse);
    for row in 0..n * n {
        let (x, y) = (line(row % n), line(row / n));
        p.set(
            row,
            y.iter().flat_map(|&(j, v)| x.iter().map(move |&(i, w)| ((j * coarse + i) as u32, v * w))),
        );
    }
    p
}

/// The Galerkin product `P^T A P`.
fn galerkin(a: &SparseMatrix, p: &AffineConstraints) -> Result<SparseMatrix, Box<dyn Error>> {
    let mut entries = Vec::new();
    for row in 0..p.row_count() {
        let values = &a.values()[a.pattern().range(row)];
        for (&column, &value) in a.pattern().columns_of(row).iter().zip(values) {
            for &(i, v) in p.terms(row) {
                let terms = p.terms(column as usize).iter();
                entries.extend(terms.map(|&(j, w)| (i as usize, j as usize, v * w * value)));
            }
        }
    }
    Ok(SparseMatrix::from_triplets(p.unknown_count(), p.unknown_count(), &entries)?)
}

/// Smoothing, correction on the coarse grid, smoothing.
struct TwoGrid {
    a: SparseMatrix,
    jacobi: Jacobi<f64>,
    smoother: Chebyshev<f64>,
    p: AffineConstraints,
    coarse: DirectSpd,
    fine_work: Vec<f64>,
    coarse_work: [Vec<f64>; 2],
}

impl TwoGrid {
    fn new(a: &SparseMatrix, n: usize) -> Result<Self, Box<dyn Error>> {
        let p = interpolation(n);
        let coarse_matrix = galerkin(a, &p)?;
        let symbolic = Arc::new(Symbolic::new(coarse_matrix.pattern().clone(), Ordering::Amd)?);
        let mut coarse = DirectSpd::new(symbolic, RefinementParams::default())?;
        coarse.factorise(coarse_matrix.values())?;
        let (mut a, mut jacobi) = (a.clone(), Jacobi::new(&a.diagonal())?);
        let params = ChebyshevParams { degree: 3, ratio: 4.0, ..Default::default() };
        let smoother = Chebyshev::for_operator(&mut a, &mut jacobi, &params)?;
        let coarse_work = [vec![0.0; p.unknown_count()], vec![0.0; p.unknown_count()]];
        Ok(Self { a, jacobi, smoother, coarse, fine_work: vec![0.0; p.row_count()], coarse_work, p })
    }
}

impl Preconditioner<f64> for TwoGrid {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Self { a, jacobi, smoother, p, coarse, fine_work, coarse_work: [load, correction] } = self;
        smoother.smooth(a, jacobi, r, z, Guess::Zero);
        a.multiply(z, fine_work);
        vector::residual_from_product(r, fine_work);
        p.apply_transpose(fine_work, load);
        coarse.apply(load, correction);
        p.apply(correction, fine_work);
        vector::axpy(1.0, fine_work, z);
        smoother.smooth(a, jacobi, r, z, Guess::Given);
    }
}
