//! Surroundings of the particles: walls and periodic directions.

use gluey_geom::{Aabb, Vector};

/// A plane that particles do not cross, in contact like a body of infinite radius and mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall<const D: usize> {
    /// Unit vector from the wall to the particles.
    pub normal: Vector<D>,
    /// Particles keep to `normal . x >= offset + radius`; unit: length.
    pub offset: f64,
    /// Velocity of the wall along its normal.
    pub speed: f64,
}

impl<const D: usize> Wall<D> {
    /// The plane through `point`, at rest; particles are on the side that `direction` points to.
    ///
    /// # Panics
    /// If `direction` has no length or is not finite.
    pub fn new(point: &Vector<D>, direction: &Vector<D>) -> Self {
        let normal = direction / direction.norm();
        assert!(normal.iter().all(|x| x.is_finite()), "a wall needs a direction, not {direction:?}");
        Self { normal, offset: normal.dot(point), speed: 0.0 }
    }

    /// Distance of a point from the wall, positive inside.
    pub fn distance(&self, x: &Vector<D>) -> f64 {
        self.normal.dot(x) - self.offset
    }
}

/// Walls and periodic directions. The default has neither.
///
/// Positions are continuous in time: in a periodic direction they may leave the period and are not to be
/// wrapped, for contacts name the image of the partner relative to them.
///
/// ```
/// use gluey_contact::{Domain, Wall};
/// use gluey_geom::Vector;
///
/// // A channel of height 1 along x, with the period 4.
/// let floor = Wall::new(&Vector::<2>::zeros(), &Vector::<2>::y());
/// let ceiling = Wall::new(&Vector::<2>::y(), &-Vector::<2>::y());
/// let channel = Domain::default().with_period(0, 4.0).with_wall(floor).with_wall(ceiling);
/// assert_eq!(channel.walls.len(), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Domain<const D: usize> {
    /// Walls; contacts name them by their place here.
    pub walls: Vec<Wall<D>>,
    /// Length of the period in each direction that has one.
    pub periods: [Option<f64>; D],
}

impl<const D: usize> Default for Domain<D> {
    fn default() -> Self {
        Self { walls: Vec::new(), periods: [None; D] }
    }
}

impl<const D: usize> Domain<D> {
    /// The inside of a box: walls `2 d` and `2 d + 1` are its lower and upper face in the direction `d`.
    pub fn inside(bounds: &Aabb<D>) -> Self {
        let faces = |d: usize| {
            let inwards = Vector::<D>::from_fn(|k, _| f64::from(u8::from(k == d)));
            [Wall::new(&bounds.lower, &inwards), Wall::new(&bounds.upper, &-inwards)]
        };
        Self { walls: (0..D).flat_map(faces).collect(), ..Self::default() }
    }

    /// A box that is periodic in all directions.
    pub fn periodic(lengths: &Vector<D>) -> Self {
        (0..D).fold(Self::default(), |domain, d| domain.with_period(d, lengths[d]))
    }

    /// Adds a wall.
    pub fn with_wall(mut self, wall: Wall<D>) -> Self {
        self.walls.push(wall);
        self
    }

    /// Makes a direction periodic.
    pub fn with_period(mut self, direction: usize, length: f64) -> Self {
        self.periods[direction] = Some(length);
        self
    }

    /// Whether any direction is periodic.
    pub fn is_periodic(&self) -> bool {
        self.periods.iter().any(Option::is_some)
    }

    /// The displacement of an image: `image * period`.
    pub fn shift<N: Copy + Into<f64>>(&self, image: &[N; 3]) -> Vector<D> {
        Vector::from_fn(|d, _| self.periods[d].map_or(0.0, |period| image[d].into() * period))
    }
}
