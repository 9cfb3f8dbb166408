//! Particles on the sites of a lattice.

use gluey_geom::Vector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Arrangement, PackingError};
use crate::Container;

/// How much the cell of a lattice may be stretched along one axis against another, to fit a box.
const STRETCH: f64 = 1.1;

/// Most cells along the first axis that are looked through.
const MOST_CELLS: usize = 2000;

/// Cell of a lattice: edges in relation to each other, and sites as parts of the edges. No site lies on a
/// face, so that walls are no nearer than neighbours.
struct LatticeCell<const D: usize> {
    edges: Vector<D>,
    sites: Vec<Vector<D>>,
}

impl<const D: usize> LatticeCell<D> {
    fn of(arrangement: Arrangement) -> Option<Self> {
        let (low, middle, high) = (0.25, 0.5, 0.75);
        let (dimension, edges, sites): (usize, [f64; 3], &[[f64; 3]]) = match arrangement {
            Arrangement::Square => (2, [1.0; 3], &[[middle; 3]]),
            Arrangement::Hexagonal => (2, [1.0, 3f64.sqrt(), 1.0], &[[low; 3], [high; 3]]),
            Arrangement::SimpleCubic => (3, [1.0; 3], &[[middle; 3]]),
            Arrangement::BodyCentred => (3, [1.0; 3], &[[low; 3], [high; 3]]),
            Arrangement::FaceCentred => {
                (3, [1.0; 3], &[[low; 3], [high, high, low], [high, low, high], [low, high, high]])
            }
            Arrangement::Random | Arrangement::Equilibrium { .. } => return None,
        };
        let vector = |x: &[f64; 3]| Vector::from_fn(|d, _| x[d]);
        (dimension == D).then(|| Self { edges: vector(&edges), sites: sites.iter().map(vector).collect() })
    }

    /// Cells along each axis of a box, for each number along the first that makes well-shaped ones.
    fn fitting(&self, lengths: &Vector<D>) -> impl Iterator<Item = [usize; D]> {
        let shape = lengths.component_div(&self.edges);
        (1..MOST_CELLS).filter_map(move |first| {
            let size = shape[0] / first as f64;
            let counts: [usize; D] = std::array::from_fn(|d| ((shape[d] / size).round() as usize).max(1));
            let stretch = (0..D).map(|d| shape[d] / counts[d] as f64 / size);
            let [least, most] = stretch.fold([1.0f64; 2], |[a, b], s| [a.min(s), b.max(s)]);
            (most <= STRETCH * least).then_some(counts)
        })
    }

    fn particle_count(&self, cells: &[usize; D]) -> usize {
        self.sites.len() * cells.iter().product::<usize>()
    }
}

/// The numbers of particles nearest to `count`, below and above or equal, that a lattice in this box has.
pub(super) fn fitting_counts<const D: usize>(
    arrangement: Arrangement,
    container: &Container<D>,
    count: usize,
) -> Result<Vec<usize>, PackingError> {
    let crystal = crystal::<D>(arrangement)?;
    let edges = container.bounds().extent();
    let counts = crystal.fitting(&edges).map(|cells| crystal.particle_count(&cells));
    let (mut below, mut above) = (None, None);
    for fitting in counts {
        if fitting >= count {
            above = Some(fitting);
            break;
        }
        below = Some(fitting);
    }
    Ok(below.into_iter().chain(above).collect())
}

/// The sites of a lattice of `count` particles.
pub(super) fn sites<const D: usize>(
    arrangement: Arrangement,
    container: &Container<D>,
    count: usize,
) -> Result<Vec<Vector<D>>, PackingError> {
    let crystal = crystal::<D>(arrangement)?;
    let bounds = container.bounds();
    let lengths = bounds.extent();
    let mut fitting = crystal.fitting(&lengths);
    let Some(cells) = fitting.find(|cells| crystal.particle_count(cells) == count) else {
        let fitting = fitting_counts(arrangement, container, count)?;
        return Err(PackingError::NoLattice { arrangement, count, fitting });
    };
    let edges = Vector::<D>::from_fn(|d, _| lengths[d] / cells[d] as f64);
    let cell_count: usize = cells.iter().product();
    let corner = |number: usize| {
        let mut rest = number;
        Vector::<D>::from_fn(|d, _| {
            let at = rest % cells[d];
            rest /= cells[d];
            at as f64
        })
    };
    let in_cell = |number: usize| {
        let corner = corner(number);
        let site = move |site: &Vector<D>| bounds.lower + (corner + site).component_mul(&edges);
        crystal.sites.iter().map(site).collect::<Vec<_>>()
    };
    Ok((0..cell_count).flat_map(in_cell).collect())
}

fn crystal<const D: usize>(arrangement: Arrangement) -> Result<LatticeCell<D>, PackingError> {
    LatticeCell::of(arrangement).ok_or(PackingError::OtherDimension { arrangement, dimension: D })
}

/// Moves each point to a random one of the ball of this radius around it.
pub(super) fn jitter<const D: usize>(positions: &mut [Vector<D>], radius: f64, random: &mut ChaCha8Rng) {
    for x in positions {
        *x += radius * in_unit_ball(random);
    }
}

fn in_unit_ball<const D: usize>(random: &mut ChaCha8Rng) -> Vector<D> {
    loop {
        let x = Vector::<D>::from_fn(|_, _| random.random_range(-1.0..1.0));
        if x.norm_squared() <= 1.0 {
            return x;
        }
    }
}
