//! Meshes refined near bodies.

use gluey_fem::{MeshError, TreeMesh, half_diagonal};
use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, BallTree, Body};

/// Part of its size by which a cell may be too far away and still counts as near: where bodies have round
/// places and sizes many distances are equal to the band, and rounding must not decide.
const SLACK: f64 = 1e-9;
/// Bodies are sought this much farther than they can matter, so that rounding loses none.
const ENOUGH: f64 = 1.0 + SLACK;

/// Levels by which a mesh follows the bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Every cell has at least this level.
    pub coarsest: u8,
    /// Level of the cells at the surfaces.
    pub surface: u8,
    /// Cells of each level are kept to this many cell sizes outside a body, everywhere inside it (what a
    /// coarse interior would save is little, see `docs/design/mesh-and-kernels.md`), and where they touch one
    /// that meets it.
    pub band: f64,
}

impl Refinement {
    /// Cells of this level in bodies and two cell sizes around them.
    pub fn to_level(surface: u8) -> Self {
        Self { coarsest: surface.min(3), surface, band: 2.0 }
    }

    /// The mesh of `domain` around `bodies`, sheared like the lattice that repeats these.
    ///
    /// # Errors
    /// [`MeshError`] as [`TreeMesh::refine`].
    pub fn mesh<const D: usize>(
        &self,
        domain: Aabb<D>,
        roots: [u32; D],
        periodic: [bool; D],
        bodies: &[Ball<D>],
    ) -> Result<TreeMesh<D>, MeshError> {
        let shear = bodies.first().map_or(0.0, |body| body.lattice().shear());
        let bodies = &BallTree::new(bodies);
        let wants = |lower: &Vector<D>, h: f64, level: u8| self.wants(lower, h, level, bodies);
        let mesh = TreeMesh::refine(domain, roots, periodic, self.surface, wants)?;
        let mesh = mesh.sheared(shear);
        let used = mesh.cells().iter().map(|c| c.level).max().unwrap_or(0);
        Ok(if used < self.surface { mesh.coarsened(used) } else { mesh })
    }

    /// Whether a cell with this lower corner, size and level is to be refined.
    pub fn wants<const D: usize>(
        &self,
        lower: &Vector<D>,
        h: f64,
        level: u8,
        bodies: &BallTree<'_, D>,
    ) -> bool {
        let center = lower + Vector::repeat(0.5 * h);
        level < self.coarsest || (level < self.surface && self.is_near_surface(&center, h, bodies))
    }

    /// Whether a cell of size `h` comes closer to a body than the band of its children, or one of their size
    /// that touches it meets a body: surfaces meet cells of one size, however cells lean in a tilted box.
    fn is_near_surface<const D: usize>(&self, center: &Vector<D>, h: f64, bodies: &BallTree<'_, D>) -> bool {
        let band = self.band * 0.5 * h;
        let shear = shear_of(bodies);
        let farthest = (band + half_diagonal::<D>(h, shear)).max(half_diagonal::<D>(2.0 * h, shear));
        bodies.any_within(center, ENOUGH * farthest, |body| {
            let body = &bodies.balls()[body];
            let half = |d: usize| 0.5 * h * if d == 0 { 1.0 + shear.abs() } else { 1.0 };
            let mut is_near = false;
            body.for_each_image(center, ENOUGH * farthest, |arm| {
                let outside = Vector::<D>::from_fn(|d, _| (arm[d].abs() - half(d)).max(0.0)).norm();
                let radius = body.bounding_radius() + SLACK * h;
                is_near |= outside < radius + band || distance_from_cell(arm, h, shear) < radius;
            });
            is_near
        })
    }
}

/// Distance in space of a point from a cell of a sheared mesh that extends by `half` along each edge from its
/// centre, which is at `arm` from the point.
fn distance_from_cell<const D: usize>(arm: &Vector<D>, half: f64, shear: f64) -> f64 {
    let beyond = |length: f64| (length.abs() - half).max(0.0);
    // At the height `up` over the centre the cell is displaced by `shear up`. The squared distance is convex
    // in `up`: least at the height of the point, or where one of the slanted sides is nearest to it.
    let at = |up: f64| beyond(arm[0] + shear * up).hypot(arm[1] + up);
    let beside = |side: f64| -(arm[1] + shear * (arm[0] + side)) / (1.0 + shear * shear);
    let heights = [-arm[1], beside(half), beside(-half)];
    let in_plane = heights.map(|up| at(up.clamp(-half, half))).into_iter().fold(f64::INFINITY, f64::min);
    (2..D).fold(in_plane, |distance, d| distance.hypot(beyond(arm[d])))
}

/// Shear of the box that bodies are in.
fn shear_of<const D: usize>(bodies: &BallTree<'_, D>) -> f64 {
    bodies.balls().first().map_or(0.0, |body| body.lattice().shear())
}

#[cfg(test)]
mod tests {
    use gluey_geom::Lattice;
    use gluey_levelset::LevelSet;

    use super::*;

    /// Cells at most `band` of their size from a body are of the finest level, inside it as deep as it goes;
    /// farther ones are not.
    fn fine_cells_fill_bodies_and_their_bands<const D: usize>() {
        let ball = Ball::new(Vector::<D>::repeat(0.47), 0.2);
        let refinement = Refinement { coarsest: 2, surface: 5, band: 1.5 };
        let mesh = refinement.mesh(Aabb::unit(), [1; D], [false; D], &[ball]).unwrap();
        let mut deepest = 0.0f64;
        for cell in mesh.cells() {
            let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
            let alpha = ball.value(&(lower + Vector::repeat(0.5 * h)));
            deepest = deepest.max(alpha);
            let (near, far) = (
                alpha >= -1.5 * mesh.size(5),
                alpha < -1.5 * mesh.size(5) - 4.0 * half_diagonal::<D>(h, 0.0),
            );
            assert!(!near || cell.level == 5, "level {} at {alpha}", cell.level);
            assert!(!far || cell.level < 5, "level {} at {alpha}", cell.level);
        }
        assert!(deepest > 0.17 && mesh.cells().iter().any(|cell| cell.level < 4));
    }

    /// No cell that touches one that meets a body is coarser, in flat and high boxes at any tilt, with one to
    /// six cells in a radius and with any band.
    fn surfaces_meet_cells_of_one_size<const D: usize>() {
        for trial in 0..60u32 {
            let number = |k: u32| f64::from((trial * 7919 + k * 104_729) % 1000) / 1000.0;
            let aspect = [1, 2, 4, 8, 3][trial as usize % 5];
            let roots = std::array::from_fn(|d| if d == 0 { aspect } else { 1 });
            let edges = Vector::<D>::from_fn(|d, _| f64::from(roots[d]));
            let domain = Aabb { lower: Vector::zeros(), upper: edges };
            let lattice = Lattice::new(std::array::from_fn(|d| Some(edges[d])));
            let lattice = lattice.tilted((number(1) - 0.5) * edges[0]);
            let radius = 0.1 + 0.15 * number(2);
            let ball = Ball::in_space(&edges.map(|edge| edge * number(3)), radius, &lattice, 0.0);
            let surface = [3, 4, 5][trial as usize % 3] - D as u8 / 3;
            let band = [2.0, 0.0, 0.7, 4.0][trial as usize % 4];
            let refinement = Refinement { coarsest: 1, surface, band };
            let mesh = refinement.mesh(domain, roots, [true; D], &[ball]).expect("a mesh");
            let h = mesh.size(surface);
            for cell in mesh.cells() {
                let center = mesh.lower_corner(cell) + Vector::repeat(0.5 * mesh.size(cell.level));
                let mut meets = false;
                ball.for_each_image(&center, mesh.half_diagonal(mesh.size(cell.level)), |arm| {
                    let half = 0.5 * mesh.size(cell.level);
                    meets |= distance_from_cell(arm, half, mesh.shear()) < radius * (1.0 - 1e-9);
                });
                assert!(!meets || cell.level == surface, "{lattice:?}");
                let offsets =
                    (0..3i32.pow(D as u32)).map(|k| std::array::from_fn(|d| k / 3i32.pow(d as u32) % 3 - 1));
                let around = offsets.filter_map(|offset| mesh.neighbour(cell, &offset));
                let is_alone = !meets || around.map(|cell| mesh.find(&cell)).all(|found| found.is_some());
                assert!(is_alone, "{lattice:?}, {radius} in cells of {h}, a band of {band}");
            }
        }
    }

    #[test]
    fn surfaces_meet_cells_of_one_size_at_any_tilt() {
        surfaces_meet_cells_of_one_size::<2>();
        surfaces_meet_cells_of_one_size::<3>();
    }

    /// The distance from a leaning cell is the least of many of its points.
    #[test]
    fn distances_from_cells_are_those_of_their_points() {
        for trial in 0..200u32 {
            let number = |k: u32| f64::from((trial * 7919 + k * 104_729) % 1000) / 500.0 - 1.0;
            let (shear, half) = (4.0 * number(1), 0.3);
            let arm = Vector::<2>::new(3.0 * number(2), number(3));
            let places = || (0..=200).map(|k| half * (f64::from(k) / 100.0 - 1.0));
            let points = places().flat_map(|y| places().map(move |x| Vector::<2>::new(x + shear * y, y)));
            let least = points.map(|point| (arm + point).norm()).fold(f64::INFINITY, f64::min);
            let found = distance_from_cell(&arm, half, shear);
            assert!(found < least + 1e-14 && least < found + 0.01, "{found} {least}");
            let deep = Vector::<3>::new(arm[0], arm[1], 0.7);
            assert!((distance_from_cell(&deep, half, shear) - found.hypot(0.4)).abs() < 1e-14);
        }
    }

    #[test]
    fn the_band_of_fine_cells_is_outside_and_the_interior_is_as_fine() {
        fine_cells_fill_bodies_and_their_bands::<2>();
        fine_cells_fill_bodies_and_their_bands::<3>();
    }
}
