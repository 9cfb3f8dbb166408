//! parry's bounding volume hierarchy. The only module that knows parry: coordinates cross the border as
//! arrays.

use gluey_geom::Vector;

use super::cells::CellList;
use super::search::Broadphase;

/// Balls in a binary tree of boxes: for sizes so different that cells would hold too many.
///
/// Needs the feature `dim2` or `dim3`; a dimension without its feature is searched by a [`CellList`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Hierarchy;

impl<const D: usize> Broadphase<D> for Hierarchy {
    fn meeting(
        &mut self,
        centers: &[Vector<D>],
        radii: &[f64],
        asker_count: usize,
        pairs: &mut Vec<(u32, u32)>,
    ) {
        pairs.clear();
        if centers.len() < 2 {
            return;
        }
        // D is a constant: one of the arms is compiled.
        match D {
            #[cfg(feature = "dim2")]
            2 => planar(centers, radii, asker_count, pairs),
            #[cfg(feature = "dim3")]
            3 => spatial(centers, radii, asker_count, pairs),
            _ => CellList::default().meeting(centers, radii, asker_count, pairs),
        }
        pairs.sort_unstable();
    }
}

/// Whether two balls meet of which the second has the larger index.
#[cfg(any(feature = "dim2", feature = "dim3"))]
fn are_pair<const D: usize>(centers: &[Vector<D>], radii: &[f64], i: u32, j: u32) -> bool {
    let (here, there) = (i as usize, j as usize);
    j > i && super::search::meet(&centers[here], &centers[there], radii[here] + radii[there])
}

#[cfg(any(feature = "dim2", feature = "dim3"))]
macro_rules! search {
    ($name:ident, $parry:ident, $dimension:literal) => {
        /// Pairs of balls that meet, among those whose boxes do.
        fn $name<const D: usize>(
            centers: &[Vector<D>],
            radii: &[f64],
            asker_count: usize,
            pairs: &mut Vec<(u32, u32)>,
        ) {
            use $parry::bounding_volume::Aabb;
            use $parry::math::Vector as Point;
            use $parry::partitioning::{Bvh, BvhBuildStrategy};

            let corner = |x: &Vector<D>, shift: f64| {
                Point::from_array(std::array::from_fn::<f64, $dimension, _>(|d| x[d] + shift))
            };
            let boxes: Vec<Aabb> = centers
                .iter()
                .zip(radii)
                .map(|(x, &radius)| Aabb::new(corner(x, -radius), corner(x, radius)))
                .collect();
            let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
            for (i, query) in (0..).zip(&boxes[..asker_count]) {
                pairs.extend(
                    tree.intersect_aabb(query).filter(|&j| are_pair(centers, radii, i, j)).map(|j| (i, j)),
                );
            }
        }
    };
}

#[cfg(feature = "dim2")]
search!(planar, parry2d_f64, 2);
#[cfg(feature = "dim3")]
search!(spatial, parry3d_f64, 3);
