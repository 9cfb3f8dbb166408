//! parry's bounding volume hierarchy. The only module that knows parry: coordinates cross the border as arrays.

use gluey_geom::Vector;

use super::{Broadphase, meet};

/// Balls in a binary tree of boxes: for sizes so different that cells would hold too many.
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
        let admit = |i: u32, j: u32| {
            let (here, there) = (i as usize, j as usize);
            j > i && meet(&centers[here], &centers[there], radii[here] + radii[there])
        };
        // D is a constant: one of the two branches is compiled.
        if D == 2 {
            planar(centers, radii, asker_count, admit, pairs);
        } else {
            spatial(centers, radii, asker_count, admit, pairs);
        }
        pairs.sort_unstable();
    }
}

macro_rules! search {
    ($name:ident, $parry:ident, $dimension:literal) => {
        /// Pairs of balls whose boxes meet, as far as `admit` lets them.
        fn $name<const D: usize>(
            centers: &[Vector<D>],
            radii: &[f64],
            asker_count: usize,
            admit: impl Fn(u32, u32) -> bool,
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
                pairs.extend(tree.intersect_aabb(query).filter(|&j| admit(i, j)).map(|j| (i, j)));
            }
        }
    };
}

search!(planar, parry2d_f64, 2);
search!(spatial, parry3d_f64, 3);
