//! A plane of rays through a ball cut flat: a disc and lines.
//!
//! What planes leave of a ball is convex, so that a ray is inside between two ends: the last entry and the
//! first exit, each on the ball or on a flat. The moments of a plane change their form at the rays through
//! corners, where two of circle, lines and faces meet.

use super::disc::{Disc, Lanes, RAYS, Ray, Rays};

/// How far outside the section a corner may lie, by rounding.
const SLACK: f64 = 1e-9;
/// Angles nearer than this are one.
const SAME: f64 = 1e-13;

/// A half-plane in a plane of rays: `n . (x, y) <= offset`, x along the rays. The normal is that of a flat,
/// without its component across the plane.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
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
    pub edges: Vec<Edge>,
}

impl Slice {
    /// The ends of a ray, if it meets what the flats leave.
    #[inline]
    pub fn ends(&self, ray: &Ray) -> Option<[f64; 2]> {
        let [mut entry, mut exit] = [ray.middle - ray.half, ray.middle + ray.half];
        for edge in &self.edges {
            // Infinite for an edge along the rays, which keeps or drops the whole ray.
            let at = (edge.offset - edge.normal[1] * ray.at) / edge.normal[0].abs();
            if edge.normal[0] >= 0.0 && at < exit {
                exit = at;
            } else if edge.normal[0] < 0.0 && -at > entry {
                entry = -at;
            }
        }
        (entry <= exit).then_some([entry, exit])
    }

    /// The chords of rays in the unit interval, empty for rays that miss.
    #[inline(always)]
    pub fn chords(&self, rays: &Rays) -> [Lanes; 2] {
        let [mut from, mut to] = [[0.0; RAYS]; 2];
        for q in 0..RAYS {
            from[q] = rays.middle[q] - rays.half[q];
            to[q] = rays.middle[q] + rays.half[q];
        }
        for edge in &self.edges {
            for q in 0..RAYS {
                let at = (edge.offset - edge.normal[1] * rays.at[q]) / edge.normal[0].abs();
                if edge.normal[0] >= 0.0 {
                    to[q] = if at < to[q] { at } else { to[q] };
                } else {
                    from[q] = if -at > from[q] { -at } else { from[q] };
                }
            }
        }
        for q in 0..RAYS {
            from[q] = from[q].clamp(0.0, 1.0);
            to[q] = to[q].min(1.0).max(from[q]);
        }
        [from, to]
    }

    /// Whether one of the lines leaves nothing of the disc.
    pub fn is_empty(&self) -> bool {
        self.edges.iter().any(|line| self.distance(line) <= -self.disc.radius)
    }

    /// The angles of the rays through corners on lines, in ascending order.
    pub fn corners(&self) -> Vec<f64> {
        let mut angles = Vec::new();
        for (k, line) in self.edges.iter().enumerate() {
            angles.extend(self.corners_on_circle(line));
            for other in self.edges[k + 1..].iter().chain(&FACES) {
                angles.extend(meet(line, other).and_then(|point| self.angle(point)));
            }
        }
        angles.sort_by(f64::total_cmp);
        angles.dedup_by(|a, b| (*a - *b).abs() < SAME);
        angles
    }

    /// The angles of the rays whose chords end on the faces they stand on.
    pub fn ends_on_faces(&self) -> impl Iterator<Item = f64> {
        FACES.iter().flat_map(|face| self.ends_on_line(face)).filter(|end| !end[0].is_nan()).map(angle_of)
    }

    /// Normal of a line in coordinates in which the section is round.
    fn round_normal(&self, line: &Edge) -> [f64; 2] {
        let (Disc { widths, lean, .. }, [x, y]) = (self.disc, line.normal);
        [x * widths[0], x * lean + y * widths[1]]
    }

    /// Distance of a line from the centre in the round section, positive if the centre is inside. Infinite
    /// for a flat parallel to the plane.
    fn distance(&self, line: &Edge) -> f64 {
        let ([x, y], [u, v]) = (line.normal, self.round_normal(line));
        (line.offset - x * self.disc.along - y * self.disc.across) / length([u, v])
    }

    /// The points of the unit circle, for the round section, where a line cuts it; not numbers if it does
    /// not.
    fn ends_on_line(&self, line: &Edge) -> [[f64; 2]; 2] {
        let [u, v] = self.round_normal(line);
        let size = length([u, v]);
        let [u, v] = [u / size, v / size];
        let near = self.distance(line) / self.disc.radius;
        let half = ((1.0 - near) * (1.0 + near)).sqrt();
        [[near * u + half * v, near * v - half * u], [near * u - half * v, near * v + half * u]]
    }

    fn corners_on_circle(&self, line: &Edge) -> impl Iterator<Item = f64> {
        let Disc { along, across, radius, widths, lean } = self.disc;
        self.ends_on_line(line).into_iter().filter_map(move |end| {
            let arm = end.map(|x| radius * x);
            let point = [along + lean * arm[1] + widths[0] * arm[0], across + widths[1] * arm[1]];
            self.angle(point).map(|_| angle_of(end))
        })
    }

    /// The angle of the ray through a point of the section.
    fn angle(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let Disc { along, across, radius, widths, lean } = self.disc;
        let is_inside = |line: &Edge| line.normal[0] * x + line.normal[1] * y <= line.offset + SLACK;
        let second = (y - across) / widths[1];
        let first = (x - along - lean * second) / widths[0];
        let is_corner =
            length([first, second]) <= radius + SLACK && FACES.iter().chain(&self.edges).all(is_inside);
        is_corner.then(|| (second / radius).clamp(-1.0, 1.0).asin())
    }
}

/// The angle of the ray through a point of the unit circle.
fn angle_of([x, y]: [f64; 2]) -> f64 {
    y.atan2(x.abs())
}

/// The faces of the cell that rays stand on.
const FACES: [Edge; 2] =
    [Edge { normal: [-1.0, 0.0], offset: 0.0 }, Edge { normal: [1.0, 0.0], offset: 1.0 }];

/// Where two lines meet.
fn meet(a: &Edge, b: &Edge) -> Option<[f64; 2]> {
    let det = |[p, q]: [f64; 2], [r, s]: [f64; 2]| p * s - q * r;
    let area = det(a.normal, b.normal);
    let point = [
        det([a.offset, a.normal[1]], [b.offset, b.normal[1]]) / area,
        det([a.normal[0], a.offset], [b.normal[0], b.offset]) / area,
    ];
    point.iter().all(|x| x.is_finite()).then_some(point)
}

/// Lengths are those of a cell: `hypot` would take care of others.
fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}
