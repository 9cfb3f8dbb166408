//! The mobility of particles with the films between near ones, whatever a mesh resolves of these.
//!
//! Each particle has the drag that it has alone, and each film thinner than the radius of the smaller of its
//! two all that lubrication theory knows of it: as the deficit of a mesh that resolves films from that
//! thickness on. Of what the flow does with forces between near particles this is nearly all.

use gluey_geom::{Dim, Twist, Vector, Wrench};
use gluey_linalg::DirectError;
use gluey_motion::{LoneDrag, PairKey, TwistMobility};
use nalgebra::{DMatrix, DVector};

use super::coupling::{row_of_velocity, rows_of_film};
use super::near::Film;
use super::network::{FilmNetwork, FilmRow};

/// Particles in a fluid, and the films between them.
#[derive(Debug)]
pub struct NearMobility<const D: usize> {
    radii: Vec<f64>,
    is_held: Vec<bool>,
    viscosity: f64,
    /// None without films.
    network: Option<FilmNetwork>,
    /// Compliances of the pairs with films, sorted.
    pairs: Vec<(PairKey, [f64; 2])>,
}

impl<const D: usize> NearMobility<D> {
    /// Of particles with these radii, of which some are held (no entries stand for none), and films with
    /// their names.
    ///
    /// # Errors
    /// [`DirectError`].
    pub fn new(
        radii: Vec<f64>,
        is_held: Vec<bool>,
        viscosity: f64,
        films: &[(PairKey, Film<D>)],
    ) -> Result<Self, DirectError> {
        let rigid = Dim::<D>::RIGID;
        let mut blocks = vec![0.0; radii.len() * rigid * rigid];
        for (block, radius) in blocks.chunks_exact_mut(rigid * rigid).zip(&radii) {
            let drag = drags::<D>(viscosity, *radius);
            (0..rigid).for_each(|k| block[k * rigid + k] = drag(k));
        }
        let (mut rows, mut pairs) = (Vec::new(), Vec::with_capacity(films.len()));
        for (pair, film) in films {
            let of_film = rows_of_film(film, height(film), viscosity, rows.len());
            pairs.push((*pair, compliance(film, &of_film, &radii, &is_held, viscosity)));
            rows.extend(of_film);
        }
        pairs.sort_unstable_by_key(|pair| pair.0);
        let network = FilmNetwork::new::<D>(&blocks, &is_held, &rows, Vec::new())?;
        Ok(Self { radii, is_held, viscosity, network, pairs })
    }

    fn lone(&self) -> LoneDrag<'_> {
        LoneDrag { viscosity: self.viscosity, radii: &self.radii, is_held: &self.is_held }
    }
}

/// Thickness up to which a film counts.
fn height<const D: usize>(film: &Film<D>) -> f64 {
    film.radii[0].min(film.radii[1])
}

/// The drag on each component of the motion of a particle, of spins times the radius.
fn drags<const D: usize>(viscosity: f64, radius: f64) -> impl Fn(usize) -> f64 {
    let [moving, turning] = LoneDrag::of::<D>(viscosity, radius);
    move |k| if k < D { moving } else { turning }
}

/// Velocities per force between the two sides of a film, along its normal and across it, as if nobody else
/// were there.
fn compliance<const D: usize>(
    film: &Film<D>,
    rows: &[FilmRow],
    radii: &[f64],
    is_held: &[bool],
    viscosity: f64,
) -> [f64; 2] {
    let rigid = Dim::<D>::RIGID;
    let mut bodies: Vec<usize> = [0, 1].into_iter().filter_map(|side| film.side(side)).collect();
    bodies.dedup();
    bodies.retain(|&body| is_held.get(body) != Some(&true));
    // Where a motion stands in the block of the two.
    let place = |k: usize| Some(bodies.iter().position(|&body| body == k / rigid)? * rigid + k % rigid);
    let entries = |row: &FilmRow| -> Vec<(usize, f64)> {
        row.entries(rigid).filter_map(|(k, weight)| Some((place(k)?, weight))).collect()
    };
    let mut matrix = DMatrix::zeros(bodies.len() * rigid, bodies.len() * rigid);
    for (first, &body) in bodies.iter().enumerate() {
        let drag = drags::<D>(viscosity, radii[body]);
        (0..rigid).for_each(|k| matrix[(first * rigid + k, first * rigid + k)] = drag(k));
    }
    for row in rows.iter().map(entries) {
        for &(k, a) in &row {
            row.iter().for_each(|&(l, b)| matrix[(k, l)] += a * b);
        }
    }
    let Some(factor) = matrix.cholesky() else { return [0.0; 2] };
    let along = |direction: Vector<D>| {
        let mut load = DVector::zeros(bodies.len() * rigid);
        entries(&row_of_velocity(film, direction)).into_iter().for_each(|(k, weight)| load[k] += weight);
        load.dot(&factor.solve(&load))
    };
    [along(film.normal), along(film.tangents()[0])]
}

impl<const D: usize> TwistMobility<D> for NearMobility<D> {
    fn respond(&mut self, loads: &[Wrench<D>], twists: &mut [Twist<D>]) {
        let Some(network) = &self.network else { return self.lone().respond(loads, twists) };
        let rigid = Dim::<D>::RIGID;
        let mut load = Vec::with_capacity(loads.len() * rigid);
        for (wrench, radius) in loads.iter().zip(&self.radii) {
            load.extend(wrench.force.iter());
            load.extend(Dim::<D>::spin_slice(&wrench.torque).iter().map(|torque| torque / radius));
        }
        // What cannot be found for want of memory is no number, which the iteration reports.
        let motions = network.respond(&mut load).unwrap_or_else(|_| vec![f64::NAN; load.len()]);
        for ((twist, motion), radius) in twists.iter_mut().zip(motions.chunks_exact(rigid)).zip(&self.radii) {
            twist.velocity = Vector::from_column_slice(&motion[..D]);
            (D..rigid).for_each(|k| twist.spin[k - D] = motion[k] / radius);
        }
    }

    fn of_pair(&self, pair: PairKey) -> [f64; 2] {
        match self.pairs.binary_search_by_key(&pair, |known| known.0) {
            Ok(place) => self.pairs[place].1,
            Err(_) => TwistMobility::<D>::of_pair(&self.lone(), pair),
        }
    }
}
