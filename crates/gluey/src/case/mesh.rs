//! The tree that a case asks for: its root cells, and the levels it refines them to.

use gluey_stokes::default_offset;

use super::{Case, Formulation};

/// Largest number of root cells along the shortest edge of the box.
pub(super) const MOST_ROOTS: u32 = 16;

/// A mesh has at most `2^18` cells along an axis: [`gluey_fem::TreeMesh`] refuses more.
pub(super) const FINEST_LEVEL: u32 = 18;

/// Rounding that does not cost a level, relative to the number of cells per radius.
const ROUNDING: f64 = 1e-9;

/// Cells per radius where a case does not state them.
pub fn default_cells_per_radius(dimension: usize, formulation: Formulation) -> f64 {
    match (dimension, formulation) {
        (2, Formulation::RigidDofs) => 12.8,
        (2, Formulation::Paper | Formulation::Unfitted) => 6.4,
        _ => 3.2,
    }
}

/// Levels that gaps may use beyond that of the surfaces where a case does not state them: enough for any film
/// in 2D, none in 3D, where they spoil the convergence of the solver.
pub fn default_gap_levels(dimension: usize) -> u32 {
    if dimension == 2 { 9 } else { 0 }
}

impl Case {
    /// Numbers of equal cubes that fill the box along each axis, as few as possible but no fewer than
    /// [`super::MeshSpec::root_cells`] along the shortest edge: the root cells of the mesh. `None` if it
    /// takes more than 16 of them there, or more than a tree can number along the longest.
    pub fn root_cells(&self) -> Option<Vec<u32>> {
        let edges = self.edges();
        let shortest = edges.iter().copied().fold(f64::INFINITY, f64::min);
        let counts = |along_shortest: u32| -> Option<Vec<u32>> {
            let exact = edges.iter().map(|edge| edge / shortest * f64::from(along_shortest));
            let most = f64::from(1u32 << FINEST_LEVEL);
            let whole = |count: f64| (count - count.round()).abs() <= 1e-9 * count && count <= most;
            exact.map(|count| whole(count).then(|| count.round() as u32)).collect()
        };
        (self.flow.mesh.root_cells..=MOST_ROOTS).find_map(counts)
    }

    /// Edge of the root cells; `None` for a box that is not made of cubes.
    pub(crate) fn root_size(&self) -> Option<f64> {
        Some(self.edges()[0] / f64::from(self.root_cells()?[0]))
    }

    /// The finest level of the tree over this box; `None` for a box that is not made of cubes.
    pub(crate) fn finest_level(&self) -> Option<u32> {
        let most = self.root_cells()?.into_iter().max()?;
        FINEST_LEVEL.checked_sub(most.checked_next_power_of_two()?.ilog2())
    }

    /// The coarsest level whose cells fit [`Case::cells_per_radius`] times into the smallest radius, whether
    /// the tree has it or not; `None` for a box that is not made of cubes.
    pub(crate) fn surface_level(&self) -> Option<f64> {
        let cells = self.cells_per_radius() * self.root_size()? / self.smallest_radius();
        Some((cells * (1.0 - ROUNDING)).log2().ceil().max(0.0))
    }

    /// Cells per radius at the surfaces, as stated or by default.
    pub fn cells_per_radius(&self) -> f64 {
        let default = default_cells_per_radius(self.dimension, self.flow.formulation);
        self.flow.mesh.cells_per_radius.unwrap_or(default)
    }

    /// Levels beyond that of the surfaces that gaps may use in `rigid-dofs`, as stated or by default.
    pub fn gap_levels(&self) -> u32 {
        self.flow.rigid_dofs.gap_levels.unwrap_or(default_gap_levels(self.dimension))
    }

    /// Signed distance, in cells, from which on a node is rigid in `rigid-dofs`, as stated or by default.
    pub fn rigid_offset(&self) -> f64 {
        self.flow.rigid_dofs.offset.unwrap_or(default_offset(self.dimension))
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

    #[test]
    fn the_finest_level_is_that_of_the_tree() {
        let finest = FINEST_LEVEL as u8;
        let mesh = |level| TreeMesh::<2>::refine(Aabb::unit(), [1; 2], [false; 2], level, |_, _, _| false);
        assert!(mesh(finest).is_ok());
        assert!(matches!(mesh(finest + 1), Err(MeshError::TooFine { limit: FINEST_LEVEL, .. })));
    }
}
