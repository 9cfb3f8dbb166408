//! Which bodies are near to each other or to a wall.

use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, BallTree, Body};

use super::deficit::FilmShape;

/// Films thinner than this share of their `A`, also where bodies overlap, resist like one of this thickness.
const THINNEST: f64 = 1e-9;

/// Thicknesses to which films are widened; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heights {
    /// Between bodies that touch.
    pub at_contact: f64,
    /// By how much that grows with the gap.
    pub per_gap: f64,
    /// Between bodies at most.
    pub largest: f64,
    /// At walls, on which faces of cells lie: there the mesh resolves thinner films.
    pub at_walls: f64,
}

/// A body or a wall on the other side of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Another body, or a periodic image of the same one.
    Body(u32),
    /// The wall of the box across this axis, at its lower or upper end.
    Wall {
        /// The axis.
        axis: u32,
        /// Whether it is the wall at the upper end.
        is_upper: bool,
    },
}

/// A film between a body and its partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film<const D: usize> {
    /// The body.
    pub body: u32,
    /// What is on the other side.
    pub partner: Partner,
    /// From the body to its partner, of length one.
    pub normal: Vector<D>,
    /// Thickness in the middle, negative where the two overlap.
    pub gap: f64,
    /// Radii of the two; infinite for a wall.
    pub radii: [f64; 2],
    /// Centre of the body.
    pub center: Vector<D>,
}

impl Partner {
    /// Whether it is a wall.
    pub fn is_wall(self) -> bool {
        matches!(self, Self::Wall { .. })
    }
}

impl<const D: usize> Film<D> {
    /// The same with other numbers of bodies.
    #[must_use]
    pub fn renumbered(self, number: impl Fn(u32) -> u32) -> Self {
        let partner = match self.partner {
            Partner::Body(other) => Partner::Body(number(other)),
            wall @ Partner::Wall { .. } => wall,
        };
        Self { body: number(self.body), partner, ..self }
    }

    /// `A` of the profile `H(r) = g + r^2 / A`.
    pub fn curvature_radius(&self) -> f64 {
        2.0 / (1.0 / self.radii[0] + 1.0 / self.radii[1])
    }

    /// Its shape where the mesh sees it no thinner than `height`.
    pub fn shape(&self, height: f64) -> FilmShape {
        let radius = self.curvature_radius();
        let gap = self.gap.max(THINNEST * radius);
        FilmShape { gap, height, radius, logarithm: self.logarithm() }
    }

    /// Coefficient of `6 pi mu A ln(1/g)` in the normal resistance of spheres (Jeffrey 1982,
    /// 10.1112/S002557930001233X), for any ratio of the radii.
    fn logarithm(&self) -> f64 {
        // With the curvature of the flatter one over that of the other.
        let [a, b] = self.radii;
        let ratio = a.min(b) / a.max(b);
        // Over 6 pi mu a for the smaller radius a, with 1 / ratio for the larger over the smaller.
        let of_smaller = (1.0 + 7.0 * ratio + ratio * ratio) / (5.0 * (1.0 + ratio).powi(3));
        of_smaller * 0.5 * (1.0 + ratio)
    }

    /// The one of these to which it is widened.
    pub fn height(&self, heights: &Heights) -> f64 {
        let Heights { at_contact, per_gap, largest, at_walls } = *heights;
        if self.partner.is_wall() { at_walls } else { largest.min(at_contact + per_gap * self.gap.max(0.0)) }
    }

    /// The body on a side, the first or its partner; `None` for a wall.
    pub fn side(&self, side: usize) -> Option<usize> {
        match (side, self.partner) {
            (0, _) => Some(self.body as usize),
            (_, Partner::Body(other)) => Some(other as usize),
            (_, Partner::Wall { .. }) => None,
        }
    }

    /// Distance of the middle of the film from a centre; from that of the body to its surface at a wall,
    /// which does not turn.
    pub fn arm(&self, side: usize) -> f64 {
        match self.partner {
            Partner::Body(_) => self.radii[side] + 0.5 * self.gap,
            Partner::Wall { .. } => self.radii[side],
        }
    }

    /// Whether it lies at a side of the box through which a shear flow along x goes. The fluid there moves
    /// along the normal and a body with it, whatever the resistance: such a gap is no measure of a force.
    pub fn is_across_flow(&self) -> bool {
        matches!(self.partner, Partner::Wall { axis: 0, .. })
    }

    /// How much slip rolls: half the difference of the curvatures.
    pub fn roll_of_slip(&self) -> f64 {
        0.5 * (1.0 / self.radii[1] - 1.0 / self.radii[0])
    }

    /// Directions across the film: orthogonal to the normal and to each other.
    pub fn tangents(&self) -> Vec<Vector<D>> {
        let n = &self.normal;
        let mut axes: Vec<usize> = (0..D).collect();
        axes.sort_by(|&i, &j| n[i].abs().total_cmp(&n[j].abs()));
        let mut tangents: Vec<Vector<D>> = Vec::with_capacity(D - 1);
        for &axis in &axes[..D - 1] {
            let mut t = Vector::zeros();
            t[axis] = 1.0;
            t -= n * n[axis];
            tangents.iter().for_each(|before: &Vector<D>| t -= before * before[axis]);
            tangents.push(t.normalize());
        }
        tangents
    }

    /// From the centre of the body to that of its partner, or to the wall.
    pub fn branch(&self) -> Vector<D> {
        let beyond = if self.partner.is_wall() { 0.0 } else { self.radii[1] };
        self.normal * (self.radii[0] + self.gap + beyond)
    }

    /// Its middle in a box with this shear, relative to which bodies are.
    pub fn middle(&self, shear: f64) -> Vector<D> {
        let beyond = if self.partner.is_wall() { self.gap } else { 0.0 };
        let mut middle = self.normal * (self.arm(0) + 0.5 * beyond);
        middle[0] -= shear * middle[1];
        self.center + middle
    }

    /// The point of the wall or the partner's surface that is nearest to the body.
    pub fn far_point(&self) -> Vector<D> {
        self.center + self.normal * (self.radii[0] + self.gap)
    }

    /// How far from the centre each of the two is cut flat, for a film that is to be `height` thick: both
    /// flats end where the film has this thickness.
    pub fn flats(&self, height: f64) -> [f64; 2] {
        let depth = (height - self.gap).max(0.0) * self.curvature_radius();
        self.radii.map(|radius| radius - depth / (2.0 * radius))
    }
}

/// The films that are widened to these heights.
pub fn thin_films<const D: usize>(bodies: &[Ball<D>], domain: &Aabb<D>, heights: &Heights) -> Vec<Film<D>> {
    let mut films = films(bodies, domain, heights.at_walls.max(heights.largest));
    films.retain(|film| film.gap < film.height(heights));
    films
}

/// The films thinner than `reach`, by body and then by partner, walls first. Walls are the borders of
/// `domain` across axes that are not periodic.
pub fn films<const D: usize>(bodies: &[Ball<D>], domain: &Aabb<D>, reach: f64) -> Vec<Film<D>> {
    let tree = BallTree::new(bodies);
    let mut films = Vec::new();
    for (index, body) in bodies.iter().enumerate() {
        let mut partners = Vec::new();
        tree.any_within(body.center(), body.bounding_radius() + reach, |other| {
            if other >= index {
                partners.push(other);
            }
            false
        });
        partners.sort_unstable();
        films.extend(at_walls(body, index, domain).filter(|film| film.gap < reach));
        for other in partners {
            films.extend(between(bodies, [index, other], reach));
        }
    }
    films
}

/// The films thinner than `reach` between a body and all images of another.
fn between<const D: usize>(bodies: &[Ball<D>], [body, other]: [usize; 2], reach: f64) -> Vec<Film<D>> {
    let (first, second) = (&bodies[body], &bodies[other]);
    let radii = [first, second].map(Body::bounding_radius);
    let mut arms: Vec<([i32; D], Vector<D>)> = Vec::new();
    let nearest = first.arm(second.center());
    first.lattice().reduced().for_each_within(&nearest, radii[0] + radii[1] + reach, |image, arm| {
        // Of the images of the body itself one of each pair.
        if body != other || image.iter().find(|k| **k != 0).is_some_and(|k| *k > 0) {
            arms.push((*image, *arm));
        }
    });
    arms.sort_by_key(|(image, _)| order(image));
    let film = |(_, arm): ([i32; D], Vector<D>)| {
        let distance = arm.norm();
        Film {
            body: body as u32,
            partner: Partner::Body(other as u32),
            normal: arm / distance,
            gap: distance - radii[0] - radii[1],
            radii,
            center: *first.center(),
        }
    };
    arms.into_iter().map(film).filter(|film| film.gap < reach).collect()
}

/// Images in the order 0, -1, 1, -2, ... of their numbers along the last axis, then along those before.
fn order<const D: usize>(image: &[i32; D]) -> [i32; D] {
    std::array::from_fn(|d| {
        let k = image[D - 1 - d];
        2 * k.abs() - i32::from(k < 0)
    })
}

/// The films between a body and the walls.
fn at_walls<const D: usize>(body: &Ball<D>, index: usize, domain: &Aabb<D>) -> impl Iterator<Item = Film<D>> {
    let (center, radius) = (*body.center(), body.bounding_radius());
    let is_wall = body.period().map(|period| period.is_none());
    let sides = (0..D).filter(move |&axis| is_wall[axis]).flat_map(|axis| [(axis, false), (axis, true)]);
    let [lower, upper] = [domain.lower, domain.upper];
    sides.map(move |(axis, is_upper)| {
        let mut normal = Vector::zeros();
        normal[axis] = if is_upper { 1.0 } else { -1.0 };
        let distance = if is_upper { upper[axis] - center[axis] } else { center[axis] - lower[axis] };
        Film {
            body: index as u32,
            partner: Partner::Wall { axis: axis as u32, is_upper },
            normal,
            gap: distance - radius,
            radii: [radius, f64::INFINITY],
            center,
        }
    })
}
