//! Which boxes overlap, by parry's bounding volume hierarchy. The only module that knows parry: coordinates cross the
//! border as arrays.

use gluey_geom::Vector;

use crate::PairKey;

/// Replaces `pairs` by the sorted pairs of cubes `centers[i] +- half_widths[i]` that overlap.
///
/// The set does not depend on how the hierarchy is built, only on the boxes.
pub(crate) fn overlapping<const D: usize>(
    centers: &[Vector<D>],
    half_widths: &[f64],
    pairs: &mut Vec<PairKey>,
) {
    pairs.clear();
    if centers.len() < 2 {
        return;
    }
    // D is a constant: one of the two branches is compiled.
    if D == 2 {
        planar(centers, half_widths, pairs);
    } else {
        spatial(centers, half_widths, pairs);
    }
    pairs.sort_unstable();
}

macro_rules! search {
    ($name:ident, $parry:ident, $dimension:literal) => {
        fn $name<const D: usize>(centers: &[Vector<D>], half_widths: &[f64], pairs: &mut Vec<PairKey>) {
            use $parry::bounding_volume::Aabb;
            use $parry::math::Vector as Point;
            use $parry::partitioning::{Bvh, BvhBuildStrategy};

            let corner = |center: &Vector<D>, shift: f64| {
                let mut corner = [0.0; $dimension];
                for d in 0..D.min($dimension) {
                    corner[d] = center[d] + shift;
                }
                Point::from_array(corner)
            };
            let boxes: Vec<Aabb> = centers
                .iter()
                .zip(half_widths)
                .map(|(center, &half)| Aabb::new(corner(center, -half), corner(center, half)))
                .collect();
            let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
            for (first, query) in boxes.iter().enumerate() {
                let first = first as u32;
                let later = tree.intersect_aabb(query).filter(|&second| second > first);
                pairs.extend(later.map(|second| PairKey { first, second }));
            }
        }
    };
}

search!(planar, parry2d_f64, 2);
search!(spatial, parry3d_f64, 3);

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const D: usize>() {
        for count in [0, 1, 2, 3, 50, 200] {
            // A quasi-random cloud, denser than one neighbour each.
            let centers: Vec<Vector<D>> = (0..count)
                .map(|i| Vector::from_fn(|d, _| (0.5 + i as f64 * [0.7548, 0.5698, 0.4301][d]).fract()))
                .collect();
            let halves: Vec<f64> = (0..count).map(|i| 0.02 + 0.001 * (i % 50) as f64).collect();
            let mut pairs = Vec::new();
            overlapping(&centers, &halves, &mut pairs);
            let mut expected = Vec::new();
            for i in 0..count {
                for j in i + 1..count {
                    let reach = halves[i] + halves[j];
                    if (0..D).all(|d| (centers[i][d] - centers[j][d]).abs() <= reach) {
                        expected.push(PairKey { first: i as u32, second: j as u32 });
                    }
                }
            }
            assert_eq!(pairs, expected, "{count} boxes in {D}D");
            assert!(count < 50 || !pairs.is_empty());
        }
    }

    #[test]
    fn pairs_equal_brute_force() {
        check::<2>();
        check::<3>();
    }
}
