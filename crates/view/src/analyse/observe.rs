//! What is measured: numbers of each frame, and distributions over all that count.

use std::f64::consts::TAU;

use gluey::output::xyz::XyzFrame;
use gluey_contact::ContactError;
use gluey_geom::{Matrix, Vector};
use gluey_suspension::structure::{
    AngularDistribution, Diffusivity, Displacements, GapStatistics, Profile, ProximityNetwork,
    RadialDistribution, StructureFactor,
};

/// Width of the bins of g(r), in mean radii.
const RADIAL_WIDTH: f64 = 0.05;
/// Farthest distance of g(r), in mean radii.
const RADIAL_RANGE: f64 = 20.0;
/// Contact distances up to which a pair counts for g(theta).
const SHELL: f64 = 1.1;
/// Bins of g(theta).
const ANGLE_COUNT: usize = 36;
/// Largest wave number times the mean radius.
const WAVE_RANGE: f64 = 10.0;
/// Most radii of which pairs are told apart.
const MOST_SIZES: usize = 3;
/// Slabs of the profile per mean radius.
const SLABS_PER_RADIUS: f64 = 2.0;

/// Numbers of one frame; lengths in mean radii.
#[derive(Clone, Debug)]
pub(super) struct FrameNumbers<const D: usize> {
    pub time: f64,
    pub strain: f64,
    /// Nearest gaps; nothing where a particle has no neighbour.
    pub gaps: Option<GapStatistics>,
    /// Contacts per particle.
    pub contacts: f64,
    /// Part of the particles in the largest cluster.
    pub largest_cluster: f64,
    /// Along which axes a cluster is endless.
    pub percolates: [bool; D],
    /// Nothing without a contact between particles.
    pub fabric: Option<Matrix<D>>,
}

impl<const D: usize> FrameNumbers<D> {
    /// Measures a frame; gaps up to `reach_over_a` mean radii are contacts.
    pub(super) fn of(frame: &XyzFrame<D>, reach_over_a: f64) -> Result<Self, ContactError> {
        let XyzFrame { time, strain, container, positions, radii, .. } = frame;
        let a = mean_radius(radii);
        let network = ProximityNetwork::new(container, positions, radii, reach_over_a * a);
        let clusters = network.clusters()?;
        let percolates =
            std::array::from_fn(|d| clusters.clusters.iter().any(|cluster| cluster.percolates[d]));
        let over_a = |gaps: GapStatistics| GapStatistics {
            smallest: gaps.smallest / a,
            percentile: gaps.percentile / a,
            median: gaps.median / a,
        };
        Ok(Self {
            time: *time,
            strain: *strain,
            gaps: GapStatistics::of(container, positions, radii).map(over_a),
            contacts: network.coordination()?.mean,
            largest_cluster: clusters.largest().map_or(0.0, |one| one.size as f64)
                / radii.len().max(1) as f64,
            percolates,
            fabric: network.fabric(),
        })
    }
}

fn mean_radius(radii: &[f64]) -> f64 {
    radii.iter().sum::<f64>() / radii.len().max(1) as f64
}

/// The radii that there are, the smallest first.
fn sizes(radii: &[f64]) -> Vec<f64> {
    let mut sizes = radii.to_vec();
    sizes.sort_unstable_by(f64::total_cmp);
    sizes.dedup();
    sizes
}

/// All pairs of two or three sizes; none of one size, and of so many that each is rare.
fn pairs_of(sizes: usize) -> impl Iterator<Item = [usize; 2]> {
    let few = if (2..=MOST_SIZES).contains(&sizes) { sizes } else { 0 };
    (0..few).flat_map(move |one| (one..few).map(move |other| [one, other]))
}

/// Distributions over frames.
#[derive(Debug)]
pub(super) struct Distributions<const D: usize> {
    /// Mean radius.
    pub a: f64,
    /// Number of particles.
    pub particle_count: usize,
    /// Volume of the particles over that of the box.
    pub fraction: f64,
    pub radial: RadialDistribution<D>,
    /// The same between particles of two radii, which count from the smallest.
    pub partial: Vec<([usize; 2], RadialDistribution<D>)>,
    pub angular: AngularDistribution<D>,
    pub waves: Option<StructureFactor<D>>,
    pub profile: Profile<D>,
    pub displacements: Displacements<D>,
    /// Time from frame to frame; nothing unless it is always the same.
    pub interval: Option<f64>,
    /// Strain per time between the first two frames.
    pub rate: f64,
}

impl<const D: usize> Distributions<D> {
    /// Measures frames, of which there is at least one.
    pub(super) fn of(frames: &[XyzFrame<D>]) -> Self {
        let first = &frames[0];
        let container = &first.container;
        let (a, edges) = (mean_radius(&first.radii), container.bounds().extent());
        let range = (RADIAL_RANGE * a).min(0.5 * edges.min());
        let volume: f64 = first.radii.iter().map(|&radius| gluey_geom::ball_volume::<D>(radius)).sum();
        let waves = container.lattice().is_periodic().then(|| {
            let width = TAU / edges.max();
            StructureFactor::new(WAVE_RANGE / a, width.max(WAVE_RANGE / a / 200.0))
        });
        let radial = RadialDistribution::new(container, range, (range / (RADIAL_WIDTH * a)).ceil() as usize);
        let mut all = Self {
            a,
            particle_count: first.radii.len(),
            fraction: volume / container.volume(),
            partial: pairs_of(sizes(&first.radii).len()).map(|pair| (pair, radial.clone())).collect(),
            radial,
            angular: AngularDistribution::new(SHELL, ANGLE_COUNT),
            waves,
            profile: Profile::new(container, 1, (SLABS_PER_RADIUS * edges[1] / a).ceil() as usize),
            displacements: Displacements::new(container.bounds().center()[1]),
            interval: interval(frames),
            rate: rate(frames),
        };
        frames.iter().enumerate().for_each(|(number, frame)| all.add(frame, rate_at(frames, number)));
        all
    }

    /// Adds a frame that is sheared at this rate.
    fn add(&mut self, frame: &XyzFrame<D>, rate: f64) {
        let XyzFrame { container, positions, radii, velocities, strain, .. } = frame;
        self.radial.add(container, positions, self.a);
        let sizes = sizes(radii);
        let size_of = |particle: usize| sizes.partition_point(|size| *size < radii[particle]);
        for (pair, radial) in &mut self.partial {
            let margin = 0.5 * (sizes[pair[0]] + sizes[pair[1]]);
            radial.add_between(container, positions, size_of, *pair, margin);
        }
        self.angular.add(container, positions, radii);
        if let Some(waves) = &mut self.waves {
            waves.add(container, positions);
        }
        let slide = Vector::from_fn(|d, _| if d == 0 { rate * container.bounds().extent()[1] } else { 0.0 });
        self.profile.add(container, positions, radii, velocities, &slide);
        self.displacements.push(*strain, positions);
    }
}

impl<const D: usize> Distributions<D> {
    /// Longest lag of the table of mean squares: half of the frames.
    pub(super) fn longest_lag(&self) -> usize {
        self.displacements.frame_count() / 2
    }

    /// Diffusivities per unit of time, from the second half of the lags.
    pub(super) fn diffusivity(&self) -> Option<[Diffusivity; D]> {
        let longest = self.longest_lag();
        self.displacements.diffusivity(longest.div_ceil(2).max(1)..=longest, self.interval?)
    }
}

/// Time between frames that are equally far apart.
fn interval<const D: usize>(frames: &[XyzFrame<D>]) -> Option<f64> {
    let mut steps = frames.windows(2).map(|pair| pair[1].time - pair[0].time);
    let first = steps.next()?;
    (first > 0.0 && steps.all(|step| (step / first - 1.0).abs() < 1e-6)).then_some(first)
}

/// Rate of shear from a frame to the next one, for the last frame from the one before.
fn rate_at<const D: usize>(frames: &[XyzFrame<D>], number: usize) -> f64 {
    rate(&frames[number.min(frames.len().saturating_sub(2))..])
}

/// Rate of shear between the first two frames.
fn rate<const D: usize>(frames: &[XyzFrame<D>]) -> f64 {
    match frames {
        [first, second, ..] => (second.strain - first.strain) / (second.time - first.time),
        _ => 0.0,
    }
}
