//! Films to images that slide, as in simple shear for ever (Lees and Edwards 1972).

use gluey_contact::{Film, PairKey};
use gluey_geom::{Lattice, Particle, Twist, Vector};
use gluey_motion::{LinearFlow, Scheme};

use crate::common::FilmIntegrator;

const HEIGHT: f64 = 7.0;
const LENGTH: f64 = 9.0;

/// A pair in a shear whose gap follows `(1 + 1/gap) d gap / dt = ` what it would be without a film. The
/// second particle is followed as the one that is so many rows of boxes further down.
struct Pair<const D: usize> {
    particles: [Particle<D>; 2],
    rows: i32,
    lattice: Lattice<D>,
    rate: f64,
    /// Films with larger gaps are not told of: the first force of each comes from the history then.
    widest: f64,
    integrator: FilmIntegrator<D>,
}

impl<const D: usize> Pair<D> {
    fn new(scheme: Scheme, rows: i32) -> Self {
        let lattice = Lattice::new(std::array::from_fn(|d| Some([LENGTH, HEIGHT, LENGTH][d]))).tilted(1.3);
        let mut pair = Self {
            particles: [[-3.0, 0.5], [3.0, -0.5]]
                .map(|x| Particle::new(Vector::from_fn(|d, _| x.get(d).copied().unwrap_or(0.2)), 1.0)),
            rows,
            lattice,
            rate: 1.0,
            widest: f64::INFINITY,
            integrator: FilmIntegrator::new(scheme),
        };
        let shift = pair.shift();
        pair.particles[1].pose.position -= shift;
        pair
    }

    /// Displacement of the image that the first meets.
    fn shift(&self) -> Vector<D> {
        self.lattice.shift(&std::array::from_fn(|d| if d == 1 { self.rows } else { 0 }))
    }

    fn branch(&self) -> Vector<D> {
        let [first, second] = self.particles.map(|particle| particle.pose.position);
        second + self.shift() - first
    }

    fn gap(&self) -> f64 {
        self.branch().norm() - 2.0
    }

    /// Velocity of the image beyond that of its particle.
    fn slide(&self) -> Vector<D> {
        let speed = self.rate * f64::from(self.rows) * HEIGHT;
        Vector::from_fn(|d, _| if d == 0 { speed } else { 0.0 })
    }

    fn step(&mut self, dt: f64) {
        let (branch, gap, slide) = (self.branch(), self.gap(), self.slide());
        let n = branch.normalize();
        let free = LinearFlow::<D>::shear(self.rate, 0.0).velocity(&branch);
        let relative = free - n * (n.dot(&free) / (1.0 + gap));
        let velocities = [relative * -0.5, relative * 0.5 - slide];
        let mut twists = velocities.map(|velocity| Twist { velocity, ..Twist::default() });
        let film = Film {
            pair: PairKey::across(0, 1, [0, self.rows, 0]),
            branch,
            slide,
            is_held: [false; 2],
            gap,
            curvature_radius: 1.0,
        };
        let reach = self.integrator.film_reach(dt, &self.particles, &twists, self.rate);
        let films: Vec<_> = [film].into_iter().filter(|film| film.gap < reach.min(self.widest)).collect();
        self.integrator.open_films(dt, &self.particles, &films, &mut twists).unwrap();
        self.integrator.advance(dt, &mut self.particles, &twists);
        self.lattice = self.lattice.tilted(self.lattice.tilt() + self.rate * HEIGHT * dt);
    }

    /// The gap every two steps, there and back.
    fn gaps(mut self, dt: f64) -> Vec<f64> {
        let mut gaps = Vec::new();
        for n in 0..(16.0 / dt) as usize {
            if n == (10.0 / dt) as usize {
                self.rate = -self.rate;
                self.integrator.reverse();
            }
            gaps.push(self.gap());
            self.step(dt);
        }
        gaps
    }
}

fn difference(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn images_are_as_good_as_particles<const D: usize>() {
    let known_late = |scheme, rows| Pair::<D> { widest: 0.8, ..Pair::new(scheme, rows) }.gaps(0.05);
    for scheme in [Scheme::Euler, Scheme::AdamsBashforth2] {
        let [direct, late] = [Pair::<D>::new(scheme, 0).gaps(0.05), known_late(scheme, 0)];
        let least = direct.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least > 0.0 && least < 0.3, "{least}");
        for rows in [1, -2] {
            let image = Pair::<D>::new(scheme, rows).gaps(0.05);
            let differences = [difference(&direct, &image), difference(&late, &known_late(scheme, rows))];
            println!("{D}D {scheme}, {rows} rows up: gaps differ by {differences:?}");
            assert!(differences.iter().all(|difference| *difference < 8e-13), "{differences:?}");
        }
    }
}

#[test]
fn an_encounter_across_a_sliding_border_is_that_without_one() {
    images_are_as_good_as_particles::<2>();
    images_are_as_good_as_particles::<3>();
}

/// Difference of the gaps at equal times from those of half the step.
fn error<const D: usize>(dt: f64) -> f64 {
    let [coarse, fine] = [dt, 0.5 * dt].map(|dt| Pair::<D>::new(Scheme::AdamsBashforth2, 1).gaps(dt));
    difference(&coarse, &fine.into_iter().step_by(2).collect::<Vec<_>>())
}

fn is_of_second_order<const D: usize>() {
    let errors = [0.04, 0.02, 0.01].map(error::<D>);
    println!("{D}D: {errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[0] / pair[1] > 3.5, "{errors:?}");
    }
}

#[test]
fn a_film_to_a_sliding_image_is_of_second_order() {
    is_of_second_order::<2>();
    is_of_second_order::<3>();
}

/// Two images of one partner, one on each side of a period that two diameters fit into: the second film, new
/// in the second step, does not take the history of the first.
#[test]
fn images_of_one_partner_are_told_apart() {
    let (radius, dt) = (1.0, 0.1);
    let particles = [Vector::<2>::zeros(), Vector::<2>::new(2.0, 2.1)].map(|x| Particle::new(x, radius));
    let film = |x: f64, image: i32| {
        let branch = Vector::<2>::new(x, 2.1);
        let gap = branch.norm() - 2.0 * radius;
        let slide = Vector::zeros();
        let pair = PairKey::across(0, 1, [image, 0, 0]);
        Film { pair, branch, slide, is_held: [false; 2], gap, curvature_radius: radius }
    };
    let (right, left) = (film(2.0, 0), film(-2.0, -1));
    let mut predicted = [Twist::default(); 2];
    predicted[1].velocity = Vector::<2>::new(-1.0, 0.0);
    let mut integrator = FilmIntegrator::new(Scheme::AdamsBashforth2);
    let mut relative = Vector::<2>::zeros();
    for films in [&[right][..], &[left, right]] {
        let mut twists = predicted;
        integrator.open_films(dt, &particles, films, &mut twists).unwrap();
        integrator.advance(dt, &mut particles.clone(), &twists);
        relative = twists[1].velocity - twists[0].velocity;
    }
    // The one opens as the other closes.
    println!("{relative:?}");
    assert!((relative - Vector::<2>::new(-1.0, 0.0)).norm() < 0.05, "{relative}");
}

/// Whatever comes within the reach that films are remembered up to was asked for before the step.
#[test]
fn the_reach_covers_what_a_step_brings_near() {
    let (dt, rate) = (0.05, 2.0);
    let count = 60;
    let noise =
        |k: usize| Vector::<2>::new((k as f64 * 0.7548).fract() - 0.5, (k as f64 * 0.5698).fract() - 0.5);
    // Over ten periods up and down.
    let particles: Vec<Particle<2>> =
        (0..count).map(|k| Particle::new(noise(k) * 20.0 * HEIGHT, 1.0)).collect();
    let shear = LinearFlow::<2>::shear(rate, 0.0);
    let twist = |(k, particle): (usize, &Particle<2>)| Twist {
        velocity: shear.velocity(&particle.pose.position) + noise(7 * k + 3) * 8.0,
        ..Twist::default()
    };
    let twists: Vec<Twist<2>> = particles.iter().enumerate().map(twist).collect();
    let integrator = FilmIntegrator::new(Scheme::AdamsBashforth2);
    let reach = integrator.film_reach(dt, &particles, &twists, rate);
    let all_rows = integrator.film_reach(dt, &particles, &twists, 0.0);
    println!("reach {reach}, without the shear {all_rows}");
    // 1.5 A, the random motion of both, and a tenth of the distance of the centres.
    assert!((3.0..6.0).contains(&reach) && all_rows > 2.0 * reach, "{reach} {all_rows}");
    let lattice = Lattice::<2>::new([Some(LENGTH), Some(HEIGHT)]).tilted(0.4);
    let mut farthest = 0.0f64;
    for i in 0..count {
        for j in i + 1..count {
            let direct = particles[j].pose.position - particles[i].pose.position;
            let (branch, image) = lattice.nearest(&direct);
            let mut moved = (twists[j].velocity - twists[i].velocity) * dt;
            moved[0] += rate * dt * f64::from(image[1]) * HEIGHT;
            if (branch + moved).norm() - 2.0 < 3.0 {
                farthest = farthest.max(branch.norm() - 2.0);
            }
        }
    }
    assert!(farthest > 3.0 && farthest <= reach, "{farthest} of {reach}");
}
