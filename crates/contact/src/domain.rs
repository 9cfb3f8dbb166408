//! Surroundings of the particles: walls, and periodic directions whose images may slide.

use gluey_geom::{Aabb, Lattice, Vector};

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
///
/// In simple shear for ever (Lees and Edwards 1972, 10.1088/0022-3719/5/15/006) with the rate `r`, the image
/// `(i, j, k)` of a particle at `x` in a box with the periods `L`, `H`, `W` is at
///
/// `x + (i L + j tilt, j H, k W)`,  `tilt = r H t`,
///
/// and moves by `j tilt_step` along `x` in a step besides the particle's own motion, `tilt_step = r H dt`.
/// The tilt is not brought back into the period, so that images keep their names; [`Domain::set_sliding`]
/// sets both at every step.
///
/// ```
/// use gluey_contact::Domain;
/// use gluey_geom::Vector;
///
/// let (rate, height, t, dt) = (0.5, 3.0, 20.0, 0.01);
/// let mut domain = Domain::periodic(&Vector::<2>::new(4.0, height));
/// domain.set_sliding(rate * height * t, rate * height * dt);
/// assert_eq!(domain.shift(&[-7, 1, 0]), Vector::<2>::new(2.0, 3.0));
/// assert!((domain.end_shift(&[-7, 1, 0]) - Vector::<2>::new(2.015, 3.0)).norm() < 1e-12);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Domain<const D: usize> {
    /// Walls; contacts name them by their place here.
    pub walls: Vec<Wall<D>>,
    /// Periods of the directions that have one, and the tilt at the beginning of the step.
    pub lattice: Lattice<D>,
    /// Growth of the tilt in the step; unit: length. No effect unless both `x` and `y` have a period.
    pub tilt_step: f64,
}

impl<const D: usize> Default for Domain<D> {
    fn default() -> Self {
        Self { walls: Vec::new(), lattice: Lattice::default(), tilt_step: 0.0 }
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
        let mut periods = *self.lattice.periods();
        periods[direction] = Some(length);
        self.lattice = Lattice::new(periods).tilted(self.lattice.tilt());
        self
    }

    /// Sets the tilt at the beginning of the step and its growth in the step; unit: length. See [`Domain`].
    pub fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        self.lattice = self.lattice.tilted(tilt);
        self.tilt_step = tilt_step;
    }

    /// Whether any direction is periodic.
    pub fn is_periodic(&self) -> bool {
        self.lattice.is_periodic()
    }

    /// The lattice at the end of the step.
    pub fn end_lattice(&self) -> Lattice<D> {
        self.lattice.tilted(self.lattice.tilt() + self.tilt_step)
    }

    /// The displacement of an image at the beginning of the step; `image` counts periods along each axis.
    pub fn shift(&self, image: &[i32; 3]) -> Vector<D> {
        self.lattice.shift(&in_space(image))
    }

    /// The displacement of an image at the end of the step.
    pub fn end_shift(&self, image: &[i32; 3]) -> Vector<D> {
        self.end_lattice().shift(&in_space(image))
    }

    /// How far an image slides in the step, besides its particle's own motion.
    pub(crate) fn slide(&self, image: &[i32; 3]) -> Vector<D> {
        let tilts = self.end_lattice().tilt() - self.lattice.tilt();
        Vector::from_fn(|d, _| if d == 0 { f64::from(image[1]) * tilts } else { 0.0 })
    }

    /// Shear strain of the lattice in the step: displacement along `x` per unit of `y`.
    pub(crate) fn strain_step(&self) -> f64 {
        self.end_lattice().shear() - self.lattice.shear()
    }
}

/// The counts of the axes that there are.
fn in_space<const D: usize>(image: &[i32; 3]) -> [i32; D] {
    std::array::from_fn(|d| image[d])
}
