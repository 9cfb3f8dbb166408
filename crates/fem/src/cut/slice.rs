//! A plane of rays through a ball cut flat: a disc and lines.
//!
//! What planes leave of a ball is convex, so that a ray is inside between two ends: the last entry and the
//! first exit, each on the ball or on a flat. The moments of a plane change their form at the rays through
//! corners, where two of circle, lines and faces meet.

use super::disc::{Disc, Ray};

/// How far outside the section a corner may lie, by rounding.
const SLACK: f64 = 1e-9;
/// Angles nearer than this are one.
const SAME: f64 = 1e-13;

/// A half-plane in a plane of rays: `n . (x, y) <= offset`, x along the rays. The normal is that of a flat,
/// without its component across the plane.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Components along the rays and across them.
    pub normal: [f64; 2],
    /// Where the half-plane ends.
    pub offset: f64,
}

/// The section of a ball cut flat with a plane of rays.
#[derive(Clone, Debug)]
pub struct Slice {
    /// The section of the ball.
    pub disc: Disc,
    /// Those of the flats.
    pub lines: Vec<Line>,
}

/// Where a ray enters or leaves.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Coordinate along the ray.
    pub at: f64,
    /// Size of the component along the ray of the normal there.
    pub slope: f64,
    /// Whether this piece of surface belongs to the cell.
    pub is_in_cell: bool,
}

impl Slice {
    /// The ends of a ray through a ball of this radius, if it meets what the flats leave.
    ///
    /// A flat on a face of the cell belongs to the cell on its outer side, where the fluid is.
    pub fn ends(&self, ray: &Ray, ball_radius: f64) -> Option<[End; 2]> {
        let slope = ray.half / ball_radius;
        let on_ball = |at: f64| End { at, slope, is_in_cell: 0.0 < at && at < 1.0 };
        let [mut entry, mut exit] = [self.disc.along - ray.half, self.disc.along + ray.half].map(on_ball);
        for line in &self.lines {
            let slope = line.normal[0].abs();
            // Infinite for a line along the rays, which keeps or drops the whole ray.
            let at = (line.offset - line.normal[1] * ray.at) / slope;
            if line.normal[0] >= 0.0 && at < exit.at {
                exit = End { at, slope, is_in_cell: (0.0..1.0).contains(&at) };
            } else if line.normal[0] < 0.0 && -at > entry.at {
                entry = End { at: -at, slope, is_in_cell: 0.0 < -at && -at <= 1.0 };
            }
        }
        (entry.at <= exit.at).then_some([entry, exit])
    }

    /// Whether one of the lines leaves nothing of the disc.
    pub fn is_empty(&self) -> bool {
        self.lines.iter().any(|line| self.distance(line) <= -self.disc.radius)
    }

    /// The angles of the rays through corners on lines, in ascending order.
    pub fn corners(&self) -> Vec<f64> {
        let mut angles = Vec::new();
        for (k, line) in self.lines.iter().enumerate() {
            angles.extend(self.corners_on_circle(line));
            for other in self.lines[k + 1..].iter().chain(&FACES) {
                angles.extend(meet(line, other).and_then(|point| self.angle(point)));
            }
        }
        angles.sort_by(f64::total_cmp);
        angles.dedup_by(|a, b| (*a - *b).abs() < SAME);
        angles
    }

    /// Distance of a line from the centre, positive if the centre is inside. Infinite for a flat parallel to
    /// the plane.
    fn distance(&self, line: &Line) -> f64 {
        let [x, y] = line.normal;
        (line.offset - x * self.disc.along - y * self.disc.across) / x.hypot(y)
    }

    fn corners_on_circle(&self, line: &Line) -> impl Iterator<Item = f64> {
        let radius = self.disc.radius;
        let middle = line.normal[1].atan2(line.normal[0]);
        let half = (self.distance(line) / radius).acos();
        [middle - half, middle + half].into_iter().filter_map(move |angle| {
            let arm = [radius * angle.cos(), radius * angle.sin()];
            self.angle([self.disc.along + arm[0], self.disc.across + arm[1]])
                .map(|_| arm[1].atan2(arm[0].abs()))
        })
    }

    /// The angle of the ray through a point of the section.
    fn angle(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let Disc { along, across, radius } = self.disc;
        let is_inside = |line: &Line| line.normal[0] * x + line.normal[1] * y <= line.offset + SLACK;
        let is_corner =
            (x - along).hypot(y - across) <= radius + SLACK && FACES.iter().chain(&self.lines).all(is_inside);
        is_corner.then(|| ((y - across) / radius).clamp(-1.0, 1.0).asin())
    }
}

/// The faces of the cell that rays stand on.
const FACES: [Line; 2] =
    [Line { normal: [-1.0, 0.0], offset: 0.0 }, Line { normal: [1.0, 0.0], offset: 1.0 }];

/// Where two lines meet.
fn meet(a: &Line, b: &Line) -> Option<[f64; 2]> {
    let det = |[p, q]: [f64; 2], [r, s]: [f64; 2]| p * s - q * r;
    let area = det(a.normal, b.normal);
    let point = [
        det([a.offset, a.normal[1]], [b.offset, b.normal[1]]) / area,
        det([a.normal[0], a.offset], [b.normal[0], b.offset]) / area,
    ];
    point.iter().all(|x| x.is_finite()).then_some(point)
}
