//! The viscous stress of the penalised solid, `K(I eta_s)`.
//!
//! The mixing law `eta = I eta_s + (1 - I) eta_f` makes the viscous operator of the mixture the sum
//! `K(eta) = K(eta_f) + (1 - 1/r) K(I eta_s)`, so one solid serves the penalty and, as in eq. 9 of Verdon et al. 2010, the
//! multiplier. Cells wholly inside (`I = 1`) are scaled cubes; those with a ramp keep `I` at enough Gauss points to see
//! the surface.

use std::sync::Arc;

use gluey_fem::cells::{CellData, CellOperator, Workspace};
use gluey_fem::{Chunks, NodeMap};
use gluey_geom::{Dim, Matrix, Space, Spin, Twist, Vector};
use gluey_levelset::{Ball, BallTree, Body, Ramp};

use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::point_matrices::PointMatrices;

/// Solid fraction `I` in a cell, and the body it belongs to.
#[derive(Clone, Debug)]
struct SolidCell {
    cell: u32,
    body: u32,
    /// At the quadrature points; empty for a cell wholly inside.
    fraction: Vec<f64>,
}

impl SolidCell {
    fn fraction(&self, point: usize) -> f64 {
        self.fraction.get(point).map_or(1.0, |&f| f)
    }
}

/// The operator `K(I eta_s)` on the velocity nodes of a mesh.
#[derive(Clone, Debug)]
pub struct SolidStress<const D: usize> {
    chunks: Arc<Chunks<D>>,
    cells: Arc<Vec<SolidCell>>,
    /// `eta_s h^(D-2)` of each cell.
    scales: Arc<Vec<f64>>,
    matrices: Arc<PointMatrices<D>>,
}

/// What the solid adds to the viscosities of cells.
pub struct SolidViscosities {
    uniform: Vec<f64>,
    /// Where the viscosities at the points of a cell start; `u32::MAX` for none.
    start: Vec<u32>,
    points: Vec<f64>,
    point_count: usize,
}

impl SolidViscosities {
    /// The viscosity times `h^(D-2)` that the solid adds in all of a cell, and at its quadrature points if it varies.
    pub fn of(&self, cell: usize) -> (f64, &[f64]) {
        let points = match self.start[cell] {
            u32::MAX => &[],
            start => &self.points[start as usize..][..self.point_count],
        };
        (self.uniform[cell], points)
    }
}

/// Where the solid is on a mesh.
#[derive(Clone, Debug)]
pub struct SolidRegion<const D: usize> {
    cells: Arc<Vec<SolidCell>>,
}

impl<const D: usize> SolidRegion<D>
where
    Dim<D>: Space<D>,
{
    /// Evaluates the solid fraction at the quadrature points of all cells near the bodies.
    pub fn new(
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        ramp: Ramp,
        matrices: &PointMatrices<D>,
    ) -> Self {
        let bodies = BallTree::new(bodies);
        let mut cells = Vec::new();
        for (cell, c) in discretisation.mesh.cells().iter().enumerate() {
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let center = lower + Vector::repeat(0.5 * h);
            let reach = 0.5 * h * (D as f64).sqrt();
            let Some((body, _)) = bodies.nearest_within(&center, reach) else { continue };
            let at = |x: &[f64; D]| {
                let x = lower + Vector::from_fn(|d, _| h * x[d]);
                bodies.nearest_within(&x, 0.0).map_or(0.0, |b| ramp.fraction(b.1))
            };
            let mut fraction: Vec<f64> = matrices.points().map(|p| at(p.0)).collect();
            if fraction.iter().any(|&f| f > 0.0) {
                if fraction.iter().all(|&f| f == 1.0) {
                    fraction = Vec::new();
                }
                cells.push(SolidCell { cell: cell as u32, body: body as u32, fraction });
            }
        }
        Self { cells: Arc::new(cells) }
    }

    /// Whether each of `count` bodies has any cell.
    pub fn held(&self, count: usize) -> Vec<bool> {
        let mut held = vec![false; count];
        self.cells.iter().for_each(|c| held[c.body as usize] = true);
        held
    }

    /// The nodes of all cells with any solid in them, each with the body nearest to it.
    pub fn touched_nodes(&self, nodes: &NodeMap<D>, bodies: &[Ball<D>]) -> Vec<Option<u32>> {
        let bodies = BallTree::new(bodies);
        let mut touched = vec![None; nodes.node_count()];
        for solid in self.cells.iter() {
            for &node in nodes.cell(solid.cell as usize) {
                let body = bodies.nearest(&nodes.point(node as usize)).map(|b| b.0 as u32);
                touched[node as usize] = body;
            }
        }
        touched
    }

    /// The rigid motions closest to a velocity field in the `I`-weighted mean: `U = int I u / int I` and the spin from
    /// the angular momentum, `int I r x u = J w` with `J` the `I`-weighted inertia.
    ///
    /// # Errors
    /// [`StokesError::NoSolid`] for a body that is the nearest at no quadrature point of the solid, or at too few of them.
    pub fn twists(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        matrices: &PointMatrices<D>,
        velocity: &[f64],
    ) -> Result<Vec<Twist<D>>, StokesError> {
        let mut moments = vec![Moments::<D>::new(); bodies.len()];
        let tree = BallTree::new(bodies);
        for solid in self.cells.iter() {
            let cell = solid.cell as usize;
            let c = &discretisation.mesh.cells()[cell];
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let nodes = discretisation.velocity.cell(cell);
            let solid_points = matrices.points().enumerate().filter(|(q, _)| solid.fraction(*q) > 0.0);
            for (q, (x, weight, shapes)) in solid_points {
                let mut u = Vector::<D>::zeros();
                for (&node, &shape) in nodes.iter().zip(shapes) {
                    for d in 0..D {
                        u[d] += shape * velocity[node as usize * D + d];
                    }
                }
                let position = lower + Vector::from_fn(|d, _| h * x[d]);
                let Some((body, _)) = tree.nearest(&position) else { continue };
                let weight = weight * h.powi(D as i32) * solid.fraction(q);
                moments[body].add(weight, &bodies[body].arm(&position), &u);
            }
        }
        let cell_size = discretisation.mesh.size(discretisation.mesh.max_level());
        let twist = |(body, moments): (usize, &Moments<D>)| {
            let radius = bodies[body].bounding_radius();
            moments.twist().ok_or(StokesError::NoSolid { body, radius, cell_size })
        };
        moments.iter().enumerate().map(twist).collect()
    }
}

/// Weighted sums over a body.
#[derive(Clone, Debug)]
struct Moments<const D: usize>
where
    Dim<D>: Space<D>,
{
    mass: f64,
    momentum: Vector<D>,
    first: Vector<D>,
    second: Matrix<D>,
    angular: Spin<D>,
}

impl<const D: usize> Moments<D>
where
    Dim<D>: Space<D>,
{
    fn new() -> Self {
        Self {
            mass: 0.0,
            momentum: Vector::zeros(),
            first: Vector::zeros(),
            second: Matrix::zeros(),
            angular: Dim::<D>::zero_spin(),
        }
    }

    fn add(&mut self, weight: f64, arm: &Vector<D>, u: &Vector<D>) {
        self.mass += weight;
        self.momentum += u * weight;
        self.first += arm * weight;
        self.second += arm * arm.transpose() * weight;
        self.angular += Dim::<D>::moment(arm, u) * weight;
    }

    /// Velocity and spin about the centroid of the weights, the velocity then moved to the reference point; `None` where the
    /// weights do not fix them.
    fn twist(&self) -> Option<Twist<D>> {
        if self.mass <= 0.0 {
            return None;
        }
        let (mean, centroid) = (self.momentum / self.mass, self.first / self.mass);
        let second = self.second - centroid * centroid.transpose() * self.mass;
        let mut angular = self.angular;
        angular += -(Dim::<D>::moment(&centroid, &mean) * self.mass);
        let spin = solve_inertia::<D>(&second, &angular)?;
        Some(Twist { velocity: mean - Dim::<D>::cross_spin(&spin, &centroid), spin })
    }
}

/// Solves `J w = l` with `J = tr(S) 1 - S`, if that is positive definite.
fn solve_inertia<const D: usize>(second: &Matrix<D>, angular: &Spin<D>) -> Option<Spin<D>>
where
    Dim<D>: Space<D>,
{
    let rot = Dim::<D>::ROT;
    let inertia = nalgebra::DMatrix::from_fn(rot, rot, |i, j| {
        let diagonal = if i == j { second.trace() } else { 0.0 };
        diagonal - if rot == 1 { 0.0 } else { second[(i, j)] }
    });
    let load = nalgebra::DVector::from_fn(rot, |i, _| angular[i]);
    let solution = inertia.cholesky()?.solve(&load);
    let mut spin = Dim::<D>::zero_spin();
    (0..rot).for_each(|k| spin[k] = solution[k]);
    Some(spin)
}

impl<const D: usize> SolidStress<D> {
    /// Gauss points a direction.
    pub fn quadrature(&self) -> usize {
        self.matrices.line()
    }

    /// `factor I eta_s h^(D-2)` in the cells of a mesh.
    pub fn viscosities(&self, factor: f64, cell_count: usize) -> SolidViscosities {
        let mut new = SolidViscosities {
            uniform: vec![0.0; cell_count],
            start: vec![u32::MAX; cell_count],
            points: Vec::new(),
            point_count: self.matrices.points().len(),
        };
        for (solid, scale) in self.cells.iter().zip(self.scales.iter()) {
            let scale = factor * scale;
            if solid.fraction.is_empty() {
                new.uniform[solid.cell as usize] = scale;
            } else {
                new.start[solid.cell as usize] = new.points.len() as u32;
                new.points.extend(solid.fraction.iter().map(|f| scale * f));
            }
        }
        new
    }

    /// Takes `K(I eta_s)` for `eta_s = solid_viscosity`.
    pub fn new(
        discretisation: &Discretisation<D>,
        region: &SolidRegion<D>,
        matrices: &Arc<PointMatrices<D>>,
        solid_viscosity: f64,
    ) -> Self {
        let scale =
            |c: &SolidCell| solid_viscosity * discretisation.cell_size(c.cell as usize).powi(D as i32 - 2);
        Self {
            chunks: discretisation.chunks.clone(),
            scales: Arc::new(region.cells.iter().map(scale).collect()),
            cells: region.cells.clone(),
            matrices: matrices.clone(),
        }
    }

    /// Number of solid cells that are not wholly inside.
    pub fn cut_cell_count(&self) -> usize {
        self.cells.iter().filter(|solid| !solid.fraction.is_empty()).count()
    }

    /// Calls `visit(cell, scale, matrix)` for every solid cell: interior ones have the matrix `scale * K`, cut ones
    /// their own, which is integrated for the visit.
    pub fn for_each_cell(&self, mut visit: impl FnMut(u32, f64, Option<&[f64]>)) {
        for (solid, &scale) in self.cells.iter().zip(self.scales.iter()) {
            match solid.fraction.is_empty() {
                true => visit(solid.cell, scale, None),
                false => visit(solid.cell, 1.0, Some(&self.matrices.matrix(scale, &solid.fraction))),
            }
        }
    }

    /// `y += K(I eta_s) x` for nodal velocities that fulfil the constraints, with the loads on hanging nodes moved to
    /// their masters.
    pub fn apply(&self, nodes: &NodeMap<D>, x: &[f64], y: &mut [f64]) {
        let viscosities = self.viscosities(1.0, nodes.cell_count());
        let data = self.cells.iter().map(|solid| {
            let (viscous, points) = viscosities.of(solid.cell as usize);
            CellData { cell: solid.cell as usize, viscous, divergence: 0.0, points }
        });
        let operator = CellOperator::<f64, D>::new(&self.chunks, nodes, data, self.quadrature(), &[], 0);
        let mut load = vec![0.0; operator.velocity_dim()];
        operator.viscous_of_field(x, &mut load, &mut Workspace::default());
        gluey_linalg::vector::axpy(1.0, &load, &mut y[..load.len()]);
    }
}
