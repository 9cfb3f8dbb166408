//! What is in the box.

use clap::ValueEnum;
use gluey_geom::Vector;
use gluey_levelset::Ball;
use serde::Serialize;

/// Seed of the lattice of [`BenchCase::M3`].
const LATTICE_SEED: u64 = 2010;
/// Half the width of the jitter of the lattice.
const JITTER: f64 = 0.03;
/// Radius of the pair's particles, and of those on the lattice.
const RADII: [f64; 2] = [0.05, 0.1];

/// A benchmark case; the digit is the dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
pub enum BenchCase {
    /// No particle, constant viscosity, a polynomial force.
    #[value(name = "C2")]
    C2,
    /// Two discs that nearly touch, as in figure 5 of the paper.
    #[value(name = "S2")]
    S2,
    /// As C2, in 3D.
    #[value(name = "C3")]
    C3,
    /// Two spheres at nearly the places of the discs.
    #[value(name = "S3")]
    S3,
    /// Twenty-seven spheres on a jittered lattice.
    #[value(name = "M3")]
    M3,
}

impl BenchCase {
    /// 2 or 3.
    pub fn dimension(self) -> usize {
        match self {
            Self::C2 | Self::S2 => 2,
            Self::C3 | Self::S3 | Self::M3 => 3,
        }
    }

    /// The particles.
    pub fn balls<const D: usize>(self) -> Vec<Ball<D>> {
        match self {
            Self::C2 | Self::C3 => Vec::new(),
            Self::S2 => balls(&[[0.451, 0.51, 0.5], [0.549, 0.49, 0.5]], RADII[0]),
            Self::S3 => balls(&[[0.45, 0.51, 0.5], [0.55, 0.49, 0.5]], RADII[0]),
            Self::M3 => balls(&lattice(), RADII[1]),
        }
    }

    /// The balls an adaptive mesh follows: the particles; where there are none, those of the case with two,
    /// so that both are solved on one mesh.
    pub fn balls_of_the_mesh<const D: usize>(self) -> Vec<Ball<D>> {
        match self {
            Self::C2 => Self::S2.balls(),
            Self::C3 => Self::S3.balls(),
            Self::S2 | Self::S3 | Self::M3 => self.balls(),
        }
    }

    /// The body force of the cases without particles.
    pub fn force<const D: usize>(self) -> Option<&'static dyn Fn(&Vector<D>) -> Vector<D>> {
        match self {
            Self::C2 | Self::C3 => Some(&polynomial_force),
            Self::S2 | Self::S3 | Self::M3 => None,
        }
    }
}

/// `(y - 1/2) e_x`.
pub fn couette<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] - 0.5;
    u
}

/// `f_d = x_(d+1)^2 (1 - x_d)` with indices modulo `D`: not a gradient, so it drives a flow.
fn polynomial_force<const D: usize>(x: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|d, _| x[(d + 1) % D].powi(2) * (1.0 - x[d]))
}

fn balls<const D: usize>(centers: &[[f64; 3]], radius: f64) -> Vec<Ball<D>> {
    centers.iter().map(|x| Ball::new(Vector::from_fn(|d, _| x[d]), radius)).collect()
}

/// A lattice of 3 x 3 x 3 points in the unit box, each moved a little in every direction.
fn lattice() -> [[f64; 3]; 27] {
    let mut random = XorShift(LATTICE_SEED);
    std::array::from_fn(|k| {
        let place = [k % 3, k / 3 % 3, k / 9];
        place.map(|i| (1.0 + 2.0 * i as f64) / 6.0 + JITTER * (2.0 * random.uniform() - 1.0))
    })
}

/// Marsaglia's generator with the shifts 13, 7, 17 (2003, 10.18637/jss.v008.i14): four lines that give the
/// same lattice for ever.
struct XorShift(u64);

impl XorShift {
    /// The next number in `[0, 1)`.
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_levelset::Body;

    #[test]
    fn the_spheres_of_the_lattice_neither_touch_nor_leave_the_box() {
        let spheres = BenchCase::M3.balls::<3>();
        assert_eq!(spheres.len(), 27);
        for (i, a) in spheres.iter().enumerate() {
            assert!(a.center().iter().all(|&x| x > 0.1 && x < 0.9));
            for b in &spheres[..i] {
                let gap = (a.center() - b.center()).norm() - a.bounding_radius() - b.bounding_radius();
                assert!(gap > 0.0, "{gap}");
            }
        }
        let first = spheres[0].center();
        assert!((first - Vector::<3>::repeat(1.0 / 6.0)).amax() <= JITTER && first[0] != first[1]);
    }

    #[test]
    fn the_force_is_no_gradient() {
        let at = |x: f64, y: f64| polynomial_force::<2>(&Vector::<2>::new(x, y));
        let h = 1e-6;
        let curl = (at(0.3 + h, 0.6)[1] - at(0.3, 0.6)[1] - at(0.3, 0.6 + h)[0] + at(0.3, 0.6)[0]) / h;
        assert!(curl.abs() > 0.1, "{curl}");
    }
}
