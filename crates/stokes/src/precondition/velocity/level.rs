//! One level of the velocity multigrid: operator, smoother and transfer to the next coarser level, in `f32`.

use gluey_fem::{Interpolation, ReferenceMatrices};
use gluey_linalg::{Chebyshev, ChebyshevParams, Guess, LinOp, vector};
use gluey_parallel::Halo;

use super::SAFETY;
use super::near_bodies::NearBodies;
use crate::error::DiagonalError;
use crate::operator::{BlockDiagonal, CountedOperator, DiagonalSums};
use crate::space::{ActiveCell, VelocitySpace, active_cells, around_finest_cells, cells_touching, own_cells};

/// A way in which a level smooths.
#[derive(Clone, Copy, Debug)]
pub struct Smoothing {
    /// A sweep with the block diagonal as preconditioner. Its largest eigenvalue is known.
    pub sweep: ChebyshevParams,
    /// Whether a sweep from zero goes before the correction, beside the one after it.
    pub before: bool,
}

impl Smoothing {
    /// Below the finest level: one sweep after the correction damps more than two of half its degree, at as
    /// many applications, and the restriction needs no residual.
    pub fn of_eliminated() -> Self {
        Self { sweep: LEVEL_SWEEP, before: false }
    }
}

/// The sweep of levels whose bodies are eliminated.
pub const LEVEL_SWEEP: ChebyshevParams =
    ChebyshevParams { degree: 5, ratio: 5.0, safety: SAFETY, lanczos_steps: 0 };

/// A level of the multigrid.
#[derive(Clone, Debug)]
pub struct Level<const D: usize> {
    /// Reduced velocities.
    pub space: VelocitySpace<D>,
    /// Of these: vectors hold the same at ghosts as at their owners.
    pub halo: Halo,
    /// `None` where it only joins the coarser levels to one that smooths.
    pub relaxation: Option<Relaxation<D>>,
    /// Right-hand side.
    pub b: Vec<f32>,
    /// Solution.
    pub x: Vec<f32>,
    /// Residual or correction where a sweep goes before, else forces and torques while `b` holds them at
    /// rigid nodes.
    r: Vec<f32>,
}

/// The viscous operator `T^T A T` of a level, and how it smooths.
///
/// Only some nodes are smoothed; the cells that act on them take part in the operator. Elsewhere the iterate
/// stays what the coarser level gave, and all residuals that are used are those of the whole operator.
#[derive(Clone, Debug)]
pub struct Relaxation<const D: usize> {
    /// In the reduced velocities.
    pub operator: CountedOperator<f32, D>,
    diagonal: BlockDiagonal,
    chebyshev: Chebyshev<f32>,
    near_bodies: Option<NearBodies<D>>,
    before: bool,
}

impl<const D: usize> Relaxation<D> {
    /// Smooths around the finest cells. All ranks call this.
    fn new(space: &VelocitySpace<D>, viscosity: f64, smoothing: Smoothing) -> Result<Self, DiagonalError> {
        let discretisation = space.discretisation();
        let nodes = &discretisation.velocity;
        let mut smoothed = around_finest_cells(discretisation);
        space.share_marks(&mut smoothed);
        let smoothed = &smoothed;
        let mut cells = own_cells(discretisation, &active_cells(space, viscosity));
        let touches = cells_touching(nodes, smoothed);
        let holds_a_body =
            |c: &ActiveCell| nodes.cell(c.cell as usize).iter().any(|&n| space.body_of(n as usize).is_some());
        let is_beyond = |c: &&ActiveCell| !touches[c.cell as usize] && holds_a_body(c);
        let mut beyond = [cells.iter().filter(is_beyond).count() as f64];
        space.halo().sum_over_ranks(&mut beyond);
        let cell_count = cells.len();
        cells.retain(|c| touches[c.cell as usize]);
        let (sums, operator) = rayon::join(
            || DiagonalSums::new(space, &cells),
            || CountedOperator::new(space, &cells, cell_count),
        );
        let mut diagonal = sums.inverted(space, smoothed)?;
        diagonal.hold(|body| beyond[0] > 0.0 || space.is_held(body));
        let lambda_max = cell_lambda_max::<D>(&space.discretisation().reference());
        Ok(Self {
            near_bodies: NearBodies::new(space, &cells, &diagonal, lambda_max),
            operator,
            chebyshev: Chebyshev::below(lambda_max, space.dim(), &smoothing.sweep),
            before: smoothing.before,
            diagonal,
        })
    }

    fn smooth(&mut self, b: &[f32], x: &mut [f32], guess: Guess) {
        self.chebyshev.smooth(&mut self.operator, &mut self.diagonal, b, x, guess);
    }
}

impl<const D: usize> Level<D> {
    /// A level with rigid bodies, which smooths around its finest cells only, if at all.
    ///
    /// # Errors
    /// [`DiagonalError`] for a diagonal that has no inverse.
    pub fn new(
        space: VelocitySpace<D>,
        viscosity: f64,
        smoothing: Option<Smoothing>,
    ) -> Result<Self, DiagonalError> {
        let relaxation =
            smoothing.map(|smoothing| Relaxation::new(&space, viscosity, smoothing)).transpose()?;
        let (dim, nodal) = (space.dim(), space.full_dim());
        let before = relaxation.as_ref().is_some_and(|r| r.before);
        let r = vec![0.0; if before { dim } else { dim - nodal }];
        let halo = space.halo().clone();
        Ok(Self { b: vec![0.0; dim], x: vec![0.0; dim], r, relaxation, space, halo })
    }

    /// Applications since the last call, each counted as its share of the mesh.
    pub fn take_applications(&mut self) -> f64 {
        let Some(Relaxation { operator, near_bodies, .. }) = &mut self.relaxation else { return 0.0 };
        let near_bodies = near_bodies.as_mut().map_or(0.0, NearBodies::take_applications);
        operator.take_applications() + near_bodies * operator.share()
    }

    /// Smooths `A x = b` from the present `x`, then once more around the bodies.
    pub fn smooth(&mut self) {
        let Some(relaxation) = &mut self.relaxation else { return };
        relaxation.smooth(&self.b, &mut self.x, Guess::Given);
        if let Some(near_bodies) = &mut relaxation.near_bodies {
            near_bodies.smooth(&self.b, &mut self.x);
        }
    }

    /// Restricts to the right-hand side of the coarser level: the residual of a sweep from zero, or the
    /// right-hand side of this level.
    pub fn restrict(&mut self, transfer: &mut Interpolation<D>, coarse: &mut Self) {
        let Self { space, relaxation, b, x, r, .. } = self;
        let first = space.discretisation().own_nodes().start * D;
        match relaxation {
            Some(relaxation) if relaxation.before => {
                relaxation.smooth(b, x, Guess::Zero);
                relaxation.operator.apply(x, r);
                vector::residual_from_product(b, r);
                space.spread(r);
                transfer.restrict::<D>(&r[first..], &mut coarse.b);
            }
            _ => restrict_load(space, b, r, |b| transfer.restrict::<D>(&b[first..], &mut coarse.b)),
        }
        coarse.space.reduce(&mut coarse.b);
        coarse.halo.sum(&mut coarse.b);
    }

    /// Adds the correction of the coarser level, whose entries it expands in place.
    pub fn correct(&mut self, transfer: &Interpolation<D>, coarse: &mut Self) {
        coarse.space.expand(&mut coarse.x);
        let before = self.relaxation.as_ref().is_some_and(|r| r.before);
        let correction = if before { &mut self.r } else { &mut self.x };
        let first = self.space.discretisation().own_nodes().start * D;
        transfer.prolong::<D>(&coarse.x, &mut correction[first..self.space.full_dim()]);
        self.halo.clear(correction);
        self.space.begin_projection(correction);
        self.halo.sum(correction);
        self.space.end_projection(correction);
        if before {
            vector::axpy(1.0, &self.r, &mut self.x);
        }
    }
}

/// Restricts `b` with the loads on the twists spread over the nodes; `twist_loads` keeps them meanwhile.
fn restrict_load<const D: usize>(
    space: &VelocitySpace<D>,
    b: &mut [f32],
    twist_loads: &mut [f32],
    restrict: impl FnOnce(&[f32]),
) {
    let nodal = space.full_dim();
    twist_loads.copy_from_slice(&b[nodal..]);
    // Smoothers ignore the entries that this leaves at rigid nodes.
    space.spread(b);
    restrict(b);
    b[nodal..].copy_from_slice(twist_loads);
}

/// Largest eigenvalue of `D^-1 K` for the viscous matrix `K` of a cell and its diagonal `D`, which bounds
/// that of sums over cells: `x^T K_c x <= lambda x^T D_c x` on each. On uniform meshes it is a few percent
/// too large.
pub fn cell_lambda_max<const D: usize>(reference: &ReferenceMatrices<D>) -> f64 {
    let n = ReferenceMatrices::<D>::VELOCITY;
    let viscous = &reference.viscous;
    let scale = |i: usize| viscous[i * (n + 1)].sqrt();
    let scaled = nalgebra::DMatrix::from_fn(n, n, |i, j| viscous[i * n + j] / (scale(i) * scale(j)));
    scaled.symmetric_eigenvalues().max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{Discretisation, solid_nodes};
    use gluey_fem::TreeMesh;
    use gluey_geom::{Aabb, Vector};
    use gluey_levelset::Ball;
    use gluey_linalg::estimate_lambda_max;

    /// With hanging nodes, bodies and cells that two bodies share.
    fn eigenvalues_stay_below_the_interval<const D: usize>(gap: f64) {
        let centres = [-1.0, 1.0].map(|side| {
            let mut centre = Vector::<D>::repeat(0.47);
            centre[0] += side * (0.2 + 0.5 * gap);
            centre
        });
        let balls = centres.map(|centre| Ball::new(centre, 0.2));
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 5, |lower, h, level| {
            level < 3 || centres.iter().any(|c| ((lower - c).norm() - 0.2).abs() < 2.0 * h)
        })
        .unwrap();
        let discretisation = Discretisation::new(mesh);
        assert!(!discretisation.velocity.constraints().is_empty());
        let solid = solid_nodes(&discretisation, &balls, -0.1);
        let space = VelocitySpace::new(&discretisation, &balls, &solid);
        let level = Level::new(space, 1.7, Some(Smoothing::of_eliminated())).unwrap();
        let mut relaxation = level.relaxation.unwrap();
        let largest = estimate_lambda_max(&mut relaxation.operator, &mut relaxation.diagonal, 40).unwrap();
        let upper = relaxation.chebyshev.interval().upper;
        assert!(largest < upper && upper < 1.2 * largest, "{largest} {upper}");
    }

    fn level_around_a_ball<const D: usize>() -> Level<D> {
        let ball = Ball::new(Vector::<D>::repeat(0.47), 0.1);
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 4, |_, _, _| true).unwrap();
        let discretisation = Discretisation::new(mesh);
        let solid = solid_nodes(&discretisation, &[ball], -0.1);
        let space = VelocitySpace::new(&discretisation, &[ball], &solid);
        Level::new(space, 1.0, Some(Smoothing::of_eliminated())).unwrap()
    }

    #[test]
    fn relaxation_damps_errors_near_a_disc_and_touches_no_others() {
        let Level { space, relaxation, .. } = level_around_a_ball::<2>();
        let Relaxation { mut operator, near_bodies, .. } = relaxation.unwrap();
        let mut near = near_bodies.unwrap();
        let dim = operator.dim();
        let (mut random, zeros) = (vec![0.0; dim], vec![0.0; dim]);
        vector::fill_pseudo_random(1, &mut random);
        space.reduce(&mut random);
        let distance = |k: usize| (space.nodes().point(k / 2) - Vector::<2>::repeat(0.47)).norm();
        let far: Vec<usize> = (0..space.full_dim()).filter(|&k| distance(k) > 0.4).collect();
        let mut energy = |x: &[f32]| {
            let mut ax = vec![0.0; dim];
            operator.apply(x, &mut ax);
            vector::dot(x, &ax)
        };
        let mut x = random.clone();
        near.smooth(&zeros, &mut x);
        assert!(!far.is_empty() && far.iter().all(|&k| x[k] == random[k]));
        assert!(energy(&x) < energy(&random));
        // What changed lies near the disc.
        let local: Vec<f32> = random.iter().zip(&x).map(|(before, after)| before - after).collect();
        let mut left = local.clone();
        near.smooth(&zeros, &mut left);
        assert!(energy(&left) < 0.05 * energy(&local), "{} {}", energy(&left), energy(&local));
        assert!(level_around_a_ball::<3>().relaxation.unwrap().near_bodies.is_none());
    }

    #[test]
    fn the_bound_of_a_cell_holds_on_the_mesh() {
        for gap in [0.001, 0.02, 0.1] {
            eigenvalues_stay_below_the_interval::<2>(gap);
            eigenvalues_stay_below_the_interval::<3>(gap);
        }
    }
}
