//! The tree that a case asks for: its root cells, and the levels it refines them to.

use super::{Case, Hydrodynamics};

/// Largest number of root cells along the shortest edge of the box.
pub(super) const MOST_ROOTS: u32 = 16;

/// Multiples of the fewest root cells that are chosen from: the coarsest level is solved for by a factor
/// whose cost grows faster than all the rest with the number of roots.
const FACTORS: [u32; 3] = [1, 3, 5];

/// Largest number of root cells in the box that are chosen where a case does not state them.
const MOST_CHOSEN: u32 = 125;

/// The coarsest level of the mesh where a case does not state it and cells at the surfaces are no coarser.
const COARSEST_LEVEL: u32 = 3;

/// The same where there are three or five times the fewest roots.
const COARSEST_OF_CHOSEN: u32 = 1;

/// A mesh has at most `2^18` cells along an axis: [`gluey_fem::TreeMesh`] refuses more.
pub(super) const FINEST_LEVEL: u32 = 18;

/// Rounding that does not cost a level, relative to the number of cells per radius.
const ROUNDING: f64 = 1e-9;

/// Cells per radius where a case does not state them.
pub fn default_cells_per_radius(dimension: usize) -> f64 {
    if dimension == 2 { 6.4 } else { 3.2 }
}

impl Case {
    /// Numbers of equal cubes that fill the box along each axis: the root cells of the mesh. They are as few
    /// as possible, but no fewer than [`super::MeshSpec::root_cells`] along the shortest edge. In 3D, where
    /// neither that nor a coarsest level is given, it is once, three or five times the fewest, whichever
    /// comes nearest to [`Case::cells_per_radius`]. `None` if it takes more than 16 of them along that edge,
    /// or more than a tree can number along the longest.
    pub fn root_cells(&self) -> Option<Vec<u32>> {
        let fewest = self.cubes(self.flow.mesh.root_cells.unwrap_or(1))?;
        let factor = self.factor_of_roots(&fewest);
        Some(fewest.into_iter().map(|count| count * factor).collect())
    }

    /// By how much the fewest root cells are multiplied: what makes the largest cells at the surfaces that
    /// are small enough.
    fn factor_of_roots(&self, fewest: &[u32]) -> u32 {
        let mesh = &self.flow.mesh;
        if self.dimension == 2 || mesh.root_cells.is_some() || mesh.coarsest_level.is_some() {
            return 1;
        }
        let cells = |factor: u32| -> Option<f64> {
            let roots: Vec<u32> = fewest.iter().map(|count| count * factor).collect();
            let level = self.level_of(&roots);
            let is_cheap = roots.iter().product::<u32>() <= MOST_CHOSEN;
            (factor == 1 || (is_cheap && level >= 1.0)).then(|| f64::from(factor) * level.exp2())
        };
        let counts = FACTORS.into_iter().filter_map(|factor| Some((factor, cells(factor)?)));
        counts.reduce(|best, next| if next.1 < best.1 { next } else { best }).map_or(1, |best| best.0)
    }

    /// Numbers of equal cubes along each axis, as few as possible but no fewer than these along the shortest.
    fn cubes(&self, least: u32) -> Option<Vec<u32>> {
        let edges = self.edges();
        let shortest = edges.iter().copied().fold(f64::INFINITY, f64::min);
        let counts = |along_shortest: u32| -> Option<Vec<u32>> {
            let exact = edges.iter().map(|edge| edge / shortest * f64::from(along_shortest));
            let most = f64::from(1u32 << FINEST_LEVEL);
            let whole = |count: f64| (count - count.round()).abs() <= 1e-9 * count && count <= most;
            exact.map(|count| whole(count).then(|| count.round() as u32)).collect()
        };
        (least..=MOST_ROOTS).find_map(counts)
    }

    /// Edge of the root cells; `None` for a box that is not made of cubes.
    pub(crate) fn root_size(&self) -> Option<f64> {
        Some(self.size_of(&self.root_cells()?))
    }

    /// Edge of these root cells.
    fn size_of(&self, roots: &[u32]) -> f64 {
        self.edges()[0] / f64::from(roots[0])
    }

    /// The finest level of the tree over this box; `None` for a box that is not made of cubes.
    pub(crate) fn finest_level(&self) -> Option<u32> {
        let most = self.root_cells()?.into_iter().max()?;
        FINEST_LEVEL.checked_sub(most.checked_next_power_of_two()?.ilog2())
    }

    /// The coarsest level whose cells fit [`Case::cells_per_radius`] times into the smallest radius, whether
    /// the tree has it or not; `None` for a box that is not made of cubes.
    pub(crate) fn surface_level(&self) -> Option<f64> {
        Some(self.level_of(&self.root_cells()?))
    }

    /// The same for these root cells.
    fn level_of(&self, roots: &[u32]) -> f64 {
        let cells = self.cells_per_radius() * self.size_of(roots) / self.smallest_radius();
        (cells * (1.0 - ROUNDING)).log2().ceil().max(0.0)
    }

    /// The level that all cells have at least, as stated or by default: that of cells of about an eighth of
    /// the shortest edge, where roots are chosen.
    pub fn coarsest_level(&self) -> u32 {
        let factor = self.cubes(1).map_or(1, |fewest| self.factor_of_roots(&fewest));
        let level = if factor == 1 { COARSEST_LEVEL } else { COARSEST_OF_CHOSEN };
        let surface = || self.surface_level().map_or(level, |surface| surface as u32);
        self.flow.mesh.coarsest_level.unwrap_or_else(|| level.min(surface()))
    }

    /// Cells per radius of the smallest particle as the mesh has them at the surfaces, no fewer than
    /// [`Case::cells_per_radius`]; `None` where the flow has no mesh.
    pub fn cells_per_radius_as_built(&self) -> Option<f64> {
        let (roots, level) = (self.root_cells()?, self.surface_level()?);
        let has_mesh = self.flow.hydrodynamics == Hydrodynamics::Stokes && !self.particles.is_empty();
        has_mesh.then(|| self.smallest_radius() / self.size_of(&roots) * level.exp2())
    }

    /// Cells per radius at the surfaces, as stated or by default.
    pub fn cells_per_radius(&self) -> f64 {
        self.flow.mesh.cells_per_radius.unwrap_or(default_cells_per_radius(self.dimension))
    }

    /// Radius of the smallest particle.
    pub(crate) fn smallest_radius(&self) -> f64 {
        self.particles.iter().map(|particle| particle.radius).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use gluey_fem::{MeshError, TreeMesh};
    use gluey_geom::Aabb;

    use super::*;

    fn case(dimension: usize, upper: &str, radius: f64, mesh: &str) -> Case {
        let text = format!(
            "name = \"x\"\ndimension = {dimension}\ndomain = {{ upper = {upper}, boundary = \"sheared\" }}\n\
             particles = [{{ position = {:?}, radius = {radius:?} }}]\n\
             time = {{ step = 0.1, end = 1.0 }}\nflow = {{ formulation = \"unfitted\", mesh = {{ {mesh} }} }}\n",
            vec![0.5; dimension]
        );
        Case::parse(&text, "x.toml").unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn roots_come_near_to_the_cells_that_are_asked_for() {
        for (upper, radius, mesh, roots, built) in [
            ("[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 1.6", [1; 3], 1.6),
            ("[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.0", [5; 3], 2.0),
            ("[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.1", [3; 3], 2.4),
            ("[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.5", [1; 3], 3.2),
            ("[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.1, root_cells = 1", [1; 3], 3.2),
            // Roots as many as that would cost more than they save.
            ("[4.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.0", [12, 3, 3], 2.4),
            ("[8.0, 1.0, 2.0]", 0.1, "cells_per_radius = 2.0", [8, 1, 2], 3.2),
            // The mesh is named by its levels.
            ("[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.1, coarsest_level = 2", [1; 3], 3.2),
        ] {
            let case = case(3, upper, radius, mesh);
            assert_eq!(case.root_cells().as_deref(), Some(&roots[..]), "{upper} {mesh}");
            let found = case.cells_per_radius_as_built().expect("a mesh");
            assert!((found - built).abs() < 1e-9, "{upper} {mesh}: {found}");
        }
        let disc = case(2, "[1.0, 1.0]", 0.1, "cells_per_radius = 2.0");
        assert_eq!((disc.root_cells(), disc.coarsest_level()), (Some(vec![1, 1]), 3));
        let sphere = case(3, "[1.0, 1.0, 1.0]", 0.1, "cells_per_radius = 2.0");
        let filled = sphere.filled();
        assert_eq!((sphere.coarsest_level(), filled.coarsest_level()), (1, 1));
        assert_eq!(filled.root_cells(), sphere.root_cells());
    }

    #[test]
    fn roots_of_a_small_box_need_no_levels() {
        let disc = case(2, "[1.0, 1.0]", 0.24, "cells_per_radius = 1.0, root_cells = 3");
        assert_eq!((disc.coarsest_level(), disc.surface_level()), (1, Some(1.0)));
        assert_eq!(disc.filled().flow.mesh.coarsest_level, Some(1));
    }

    #[test]
    fn the_finest_level_is_that_of_the_tree() {
        let finest = FINEST_LEVEL as u8;
        let mesh = |level| TreeMesh::<2>::refine(Aabb::unit(), [1; 2], [false; 2], level, |_, _, _| false);
        assert!(mesh(finest).is_ok());
        assert!(matches!(mesh(finest + 1), Err(MeshError::TooFine { limit: FINEST_LEVEL, .. })));
    }
}
