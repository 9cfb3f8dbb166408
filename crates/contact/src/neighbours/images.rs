//! Periodic images: positions brought into the periods, and their images around these.
//!
//! In a tilted lattice the periods are still a box along the axes: rows of boxes that slide along each other
//! like bricks.

use gluey_geom::{Lattice, Vector};

use crate::Domain;

/// Positions brought into the periods, `0 <= x < period`, and how many periods each was moved by.
pub(crate) fn wrap<const D: usize>(
    positions: &[Vector<D>],
    domain: &Domain<D>,
    wrapped: &mut Vec<Vector<D>>,
    windings: &mut Vec<[i32; 3]>,
) {
    windings.clear();
    windings.extend(positions.iter().map(|x| winding(x, &domain.lattice)));
    wrapped.clear();
    wrapped.extend(positions.iter().zip(windings).map(|(x, winding)| x + domain.shift(winding)));
}

/// The image of a position that is in the periods.
fn winding<const D: usize>(x: &Vector<D>, lattice: &Lattice<D>) -> [i32; 3] {
    let count = |d: usize, x: f64| {
        let period = lattice.periods().get(d).copied().flatten();
        period.map_or(0, |period| -(x / period).floor() as i32)
    };
    let up = count(1, x[1]);
    let along = count(0, x[0] + f64::from(up) * lattice.tilt());
    [along, up, if D > 2 { count(2, x[2]) } else { 0 }]
}

/// Visits the images of a position in the periods that come within a margin of them, but for itself.
pub(crate) fn for_each_image<const D: usize>(
    x: &Vector<D>,
    lattice: &Lattice<D>,
    margin: f64,
    mut visit: impl FnMut([i32; 3]),
) {
    let range = |d: usize, x: f64| match lattice.periods().get(d).copied().flatten() {
        None => 0..=0,
        Some(period) => {
            ((-margin - x) / period).ceil() as i32..=((period + margin - x) / period).floor() as i32
        }
    };
    let across = if D > 2 { range(2, x[2]) } else { 0..=0 };
    for k in across {
        for j in range(1, x[1]) {
            for i in range(0, x[0] + f64::from(j) * lattice.tilt()) {
                if [i, j, k] != [0; 3] {
                    visit([i, j, k]);
                }
            }
        }
    }
}
