//! parry's closest points: coordinates cross the border as arrays, in units of the shapes' size, for parry's
//! tolerances are absolute.

use gluey_geom::{Dim, Matrix, Pose, Rotation, Vector};

use super::Shape;

/// Distance of the surfaces of two shapes; `None` if their cores meet.
pub fn gap<const D: usize, S: Shape<D>>(shapes: [&S; 2], poses: [&Pose<D>; 2]) -> Option<f64> {
    let frames = poses.map(|pose| frame(&pose.orientation));
    let between = poses[1].position - poses[0].position;
    let [p, q] = closest(shapes, [&frames[0], &frames[1]], &between)?;
    Some((between + q - p).norm() - shapes[0].rounding() - shapes[1].rounding())
}

/// Cores nearer than this part of the shapes' size meet.
const MEETING: f64 = 1e-12;

/// The axes of the body in space, as columns.
pub(super) fn frame<const D: usize>(orientation: &Rotation<D>) -> Matrix<D> {
    let axis = |d: usize| Dim::<D>::rotate(orientation, &Vector::from_fn(|k, _| f64::from(u8::from(k == d))));
    Matrix::from_columns(&std::array::from_fn::<_, D, _>(axis))
}

/// The points of two cores that are closest to each other, in space, each relative to its own centre.
/// `between` points from the first centre to the second. `None` if the cores meet.
pub(super) fn closest<const D: usize, S: Shape<D>>(
    shapes: [&S; 2],
    frames: [&Matrix<D>; 2],
    between: &Vector<D>,
) -> Option<[Vector<D>; 2]> {
    let size = shapes[0].reach() + shapes[1].reach();
    let turned = [0, 1].map(|k| Turned { shape: shapes[k], frame: frames[k], size });
    let offset = between / size;
    const { assert!(D != 2 || cfg!(feature = "dim2"), "shapes in the plane need the feature `dim2`") };
    const { assert!(D != 3 || cfg!(feature = "dim3"), "shapes in space need the feature `dim3`") };
    // D is a constant: one of the arms is compiled.
    let found = match D {
        #[cfg(feature = "dim2")]
        2 => planar::closest(&turned, &offset),
        #[cfg(feature = "dim3")]
        3 => spatial::closest(&turned, &offset),
        _ => None,
    };
    let [p, q] = match turned.each_ref().map(Turned::half_axis) {
        [Some(first), Some(second)] => nearest_end(found?, first, second, &offset),
        _ => found?,
    };
    Some([p * size, q * size]).filter(|_| (offset + q - p).norm() > MEETING)
}

/// parry takes segments that are parallel to `1e-8` for parallel. Then, as always unless they cross, one of
/// the closest points is an end: takes the best of `found` and the ends with their projections.
fn nearest_end<const D: usize>(
    found: [Vector<D>; 2],
    first: Vector<D>,
    second: Vector<D>,
    offset: &Vector<D>,
) -> [Vector<D>; 2] {
    let project = |x: Vector<D>, half: Vector<D>| {
        let along = half.dot(&x) / half.norm_squared();
        if along.is_finite() { half * along.clamp(-1.0, 1.0) } else { Vector::zeros() }
    };
    let from_first = |end: Vector<D>| [end, project(end - offset, second)];
    let from_second = |end: Vector<D>| [project(end + offset, first), end];
    let mut best = found;
    for points in [from_first(first), from_first(-first), from_second(second), from_second(-second)] {
        let square = |[p, q]: &[Vector<D>; 2]| (offset + q - p).norm_squared();
        if square(&points) < square(&best) {
            best = points;
        }
    }
    best
}

/// A core in space.
struct Turned<'a, const D: usize, S> {
    shape: &'a S,
    frame: &'a Matrix<D>,
    /// Unit of length.
    size: f64,
}

impl<const D: usize, S: Shape<D>> Turned<'_, D, S> {
    fn support(&self, direction: &Vector<D>) -> Vector<D> {
        self.frame * self.shape.core_support(&self.frame.tr_mul(direction)) / self.size
    }

    fn half_axis(&self) -> Option<Vector<D>> {
        self.shape.half_axis().map(|half| self.frame * half / self.size)
    }
}

macro_rules! closest {
    ($name:ident, $parry:ident, $dimension:literal) => {
        mod $name {
            use gluey_geom::Vector;
            use $parry::math::{Pose, Vector as Point};
            use $parry::query::ClosestPoints;
            use $parry::query::details::{
                closest_points_segment_segment, closest_points_support_map_support_map,
            };
            use $parry::shape::{Segment, SupportMap};

            use super::{Shape, Turned};

            fn there<const D: usize>(x: &Vector<D>) -> Point {
                Point::from_array(std::array::from_fn::<f64, $dimension, _>(|d| x[d]))
            }

            fn back<const D: usize>(x: Point) -> Vector<D> {
                Vector::from_fn(|d, _| x.to_array()[d])
            }

            struct Core<'a, 'b, const D: usize, S>(&'a Turned<'b, D, S>);

            impl<const D: usize, S: Shape<D>> SupportMap for Core<'_, '_, D, S> {
                fn local_support_point(&self, direction: Point) -> Point {
                    there(&self.0.support(&back(direction)))
                }
            }

            pub(super) fn closest<const D: usize, S: Shape<D>>(
                shapes: &[Turned<'_, D, S>; 2],
                between: &Vector<D>,
            ) -> Option<[Vector<D>; 2]> {
                let place = Pose::from_translation(there(between));
                let segment = |half: Vector<D>| Segment::new(there(&-half), there(&half));
                let points = match shapes.each_ref().map(Turned::half_axis) {
                    [Some(first), Some(second)] => {
                        closest_points_segment_segment(&place, &segment(first), &segment(second), f64::MAX)
                    }
                    _ => {
                        let [first, second] = shapes.each_ref().map(Core);
                        closest_points_support_map_support_map(&place, &first, &second, f64::MAX)
                    }
                };
                match points {
                    ClosestPoints::WithinMargin(p, q) => Some([back(p), back(q)]),
                    ClosestPoints::Intersecting | ClosestPoints::Disjoint => None,
                }
            }
        }
    };
}

#[cfg(feature = "dim2")]
closest!(planar, parry2d_f64, 2);
#[cfg(feature = "dim3")]
closest!(spatial, parry3d_f64, 3);
