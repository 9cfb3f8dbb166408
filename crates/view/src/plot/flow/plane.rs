//! The plane of a picture: where it lies in the box, and where it lies on paper.

use gluey_geom::Vector;
use gluey_suspension::Container;

use super::super::error::PlotError;
use super::choice::{AXES, SliceChoice};

/// A plane across an axis; the plane itself in 2D.
pub struct PicturePlane<const D: usize> {
    /// Axis across it; 2 in 2D.
    pub normal: usize,
    /// Where on this axis.
    pub at: f64,
    /// Axes to the right and up.
    pub across: usize,
    pub up: usize,
    /// Corners of the box: lower left, lower right, upper right, upper left.
    pub corners: [(f64, f64); 4],
    /// Whether walls end it across, and up.
    pub is_walled: [bool; 2],
    /// Ends of its axes, at the lower left corner.
    pub ends: [[f64; 2]; 2],
    /// Period along x that a plane across x of a tilted box crosses.
    pub period: Option<f64>,
    /// Left, low, right, high.
    pub bounds: [f64; 4],
}

impl<const D: usize> PicturePlane<D> {
    /// The plane that is chosen, else that across z through the middle.
    pub fn of(container: &Container<D>, slice: Option<SliceChoice>) -> Result<Self, PlotError> {
        let (lattice, bounds) = (container.lattice(), container.bounds());
        if D == 2 && slice.is_some() {
            return Err(PlotError::SliceOfPlane);
        }
        let default = || SliceChoice { axis: 2, at: if D == 2 { 0.0 } else { bounds.center()[D - 1] } };
        let SliceChoice { axis: normal, at } = slice.unwrap_or_else(default);
        if D == 3 && !(bounds.lower[normal]..=bounds.upper[normal]).contains(&at) {
            let ends = [bounds.lower[normal], bounds.upper[normal]];
            return Err(PlotError::SliceOutside { axis: AXES[normal], at, ends });
        }
        let (across, up) = [(2, 1), (0, 2), (0, 1)][normal];
        let shift = |y: f64| lattice.shear() * (y - bounds.lower[1]);
        let corner = |right: bool, high: bool| {
            let end = |axis: usize, upper: bool| if upper { bounds.upper[axis] } else { bounds.lower[axis] };
            let y = if up == 1 { end(1, high) } else { at };
            (end(across, right) + if across == 0 { shift(y) } else { 0.0 }, end(up, high))
        };
        let corners = [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
        let least = |value: fn(&(f64, f64)) -> f64| corners.iter().map(value).fold(f64::INFINITY, f64::min);
        let most =
            |value: fn(&(f64, f64)) -> f64| corners.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
        Ok(Self {
            normal,
            at,
            across,
            up,
            corners,
            is_walled: [container.is_walled(across), container.is_walled(up)],
            ends: [[corners[0].0, corners[1].0], [corners[0].1, corners[3].1]],
            period: lattice.periods()[0].filter(|_| normal == 0 && lattice.tilt() != 0.0),
            bounds: [least(|c| c.0), least(|c| c.1), most(|c| c.0), most(|c| c.1)],
        })
    }

    /// Where a point lies in the plane, seen across it; the part of a vector in it.
    pub fn place(&self, x: &Vector<D>) -> (f64, f64) {
        (x[self.across], x[self.up])
    }

    /// The point of space at a place in the plane.
    pub fn point(&self, place: (f64, f64)) -> Vector<D> {
        Vector::from_fn(|d, _| match d {
            d if d == self.across => place.0,
            d if d == self.up => place.1,
            _ => self.at,
        })
    }

    /// Radius of the circle in which the plane cuts a sphere; that of a disc.
    pub fn cut(&self, center: &Vector<D>, radius: f64) -> Option<f64> {
        if D == 2 {
            return Some(radius);
        }
        let off = center[self.normal] - self.at;
        (off.abs() < radius).then(|| (radius * radius - off * off).sqrt())
    }

    /// The middle of a pixel, whose rows count from above.
    pub fn middle_of(&self, column: usize, row: usize, columns: usize, rows: usize) -> (f64, f64) {
        let [left, low, right, high] = self.bounds;
        let part = |n: usize, count: usize| (n as f64 + 0.5) / count as f64;
        (left + part(column, columns) * (right - left), high - part(row, rows) * (high - low))
    }

    /// Columns and rows of the pixels whose middles lie in a rectangle: left, low, right, high.
    pub fn pixels_in(&self, rectangle: [f64; 4], columns: usize, rows: usize) -> [std::ops::Range<usize>; 2] {
        let [left, low, right, high] = self.bounds;
        let range = |from: f64, to: f64, count: usize| {
            let place = |part: f64| (part * count as f64).clamp(0.0, count as f64);
            place(from).floor() as usize..place(to).ceil() as usize
        };
        let (width, height) = (right - left, high - low);
        [
            range((rectangle[0] - left) / width, (rectangle[2] - left) / width, columns),
            range((high - rectangle[3]) / height, (high - rectangle[1]) / height, rows),
        ]
    }
}

/// The place of the plane on paper.
pub struct PlaneView {
    left: f64,
    high: f64,
    extent: (f64, f64),
    corner: (f64, f64),
    width: f64,
    below: f64,
    /// SVG pixels of a length of the case.
    pub scale: f64,
}

impl PlaneView {
    /// As wide as there is room, but not higher than wide; room beside, over and below the field.
    pub fn new<const D: usize>(plane: &PicturePlane<D>, width: f64, [beside, over, below]: [f64; 3]) -> Self {
        let [left, low, right, high] = plane.bounds;
        let extent = (right - left, high - low);
        let room = width - beside - over;
        let scale = room / extent.0.max(extent.1);
        let corner = (beside + 0.5 * (room - scale * extent.0), over);
        Self { left, high, extent, corner, width, below, scale }
    }

    /// Pixels across and down, one to an SVG pixel but at most so many.
    pub fn pixels(&self, most: f64) -> (usize, usize) {
        let (width, height) = (self.scale * self.extent.0, self.scale * self.extent.1);
        let scale = (most / width.max(height)).min(1.0);
        let count = |length: f64| (scale * length).round().max(1.0) as usize;
        (count(width), count(height))
    }

    /// Corner and size of the field.
    pub fn field(&self) -> ((f64, f64), (f64, f64)) {
        (self.corner, (self.scale * self.extent.0, self.scale * self.extent.1))
    }

    /// Width and height of the picture.
    pub fn canvas(&self) -> (f64, f64) {
        (self.width, self.corner.1 + self.scale * self.extent.1 + self.below)
    }

    /// A place of the plane.
    pub fn on_paper(&self, place: (f64, f64)) -> (f64, f64) {
        let [right, down] = [place.0 - self.left, self.high - place.1];
        (self.corner.0 + self.scale * right, self.corner.1 + self.scale * down)
    }
}
