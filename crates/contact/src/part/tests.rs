//! Partitions and searches, without messages.

use std::collections::BTreeMap;

use gluey_geom::{Twist, Vector};
use gluey_testkit::packing::Packing;

use super::{PartContact, RankOf, RankShare};
use crate::neighbours::{NeighbourList, Ownership, PartSearch};
use crate::{ContactParams, Domain, PairContact, PairKey, StepGeometry, Wall};

const SIZES: [usize; 7] = [1, 2, 3, 4, 8, 13, 64];

/// Particles, their radii and how they are to move.
struct Cloud<const D: usize> {
    positions: Vec<Vector<D>>,
    radii: Vec<f64>,
    twists: Vec<Twist<D>>,
    drift: Vec<Vector<D>>,
    domain: Domain<D>,
}

impl<const D: usize> Cloud<D> {
    fn new(count: usize, sizes: [f64; 3], domain: impl Fn(f64) -> Domain<D>) -> Self {
        let packing = Packing::<D>::fluid(count, 0.3, 3);
        let flow = |(k, x): (usize, &Vector<D>)| {
            Vector::from_fn(|d, _| {
                (x[D - 1 - d] + 0.3 * (k * (d + 1)) as f64).sin() + if d == 0 { x[1] } else { 0.0 }
            })
        };
        let twist = |of| Twist { velocity: flow(of), ..Twist::default() };
        // Wound around the periods, each otherwise.
        let domain = domain(packing.side);
        let wind = |(k, x): (usize, &Vector<D>)| x + domain.shift(&[k as i32 % 3, k as i32 % 2 - 1, 0]);
        let positions: Vec<_> = packing.positions.iter().enumerate().map(wind).collect();
        Self {
            radii: (0..count).map(|k| sizes[usize::from(k % 5 == 0) + usize::from(k == 7)]).collect(),
            twists: packing.positions.iter().enumerate().map(twist).collect(),
            drift: vec![Vector::zeros(); count],
            positions,
            domain,
        }
    }

    fn step(&self) -> StepGeometry<'_, D> {
        let Self { positions, radii, drift, .. } = self;
        StepGeometry { positions, radii, drift, velocity_weight: 0.1, dt: 0.1 }
    }

    /// The candidates of a search for all, and the free displacements.
    fn serial(&self) -> (Vec<PairKey>, Vec<Vector<D>>) {
        let free: Vec<_> = self.twists.iter().map(|twist| twist.velocity * 0.1).collect();
        let mut list = NeighbourList::default();
        list.begin(&self.step(), &self.domain, &free).expect("slow particles");
        let mut keys: Vec<_> = list.candidates.iter().map(|candidate| list.key(candidate)).collect();
        keys.sort_unstable();
        (keys, free)
    }

    /// The candidates of a rank.
    fn of_rank(&self, shares: &RankShare, free: &[Vector<D>]) -> Vec<PairKey> {
        let of = &shares.particles;
        let mut ownership = Ownership {
            names: of.iter().map(|particle| particle.index).collect(),
            is_own: of.iter().map(|particle| particle.owner == shares.rank).collect(),
        };
        let [positions, free] = [&self.positions[..], free]
            .map(|all| of.iter().map(|particle| all[particle.index as usize]).collect::<Vec<_>>());
        let radii: Vec<f64> = of.iter().map(|particle| self.radii[particle.index as usize]).collect();
        let reach: Vec<f64> = of.iter().map(|particle| particle.reach).collect();
        let step = StepGeometry { positions: &positions, radii: &radii, drift: &[], ..self.step() };
        let part = PartSearch { ownership: &mut ownership, free: &free, reach: &reach, wall_slack: 0.0 };
        let mut list = NeighbourList::default();
        list.search_part(&step, &self.domain, part);
        list.candidates.iter().map(|candidate| list.key(candidate)).collect()
    }

    fn ranks_find_what_one_search_does(&self, what: &str) {
        let (serial, free) = self.serial();
        assert!(serial.len() > 100, "{what}: {} pairs", serial.len());
        let alone = PairContact::new(ContactParams::default()).within(self.domain.clone());
        for (size, shares) in SIZES.into_iter().zip(self.shares(alone, &SIZES)) {
            let mut found: Vec<_> = shares.iter().flat_map(|shares| self.of_rank(shares, &free)).collect();
            found.sort_unstable();
            assert_eq!(found, serial, "{what}, {size} ranks: each pair once");
            self.particles_are_dealt_evenly(&shares);
        }
    }

    /// What each of so many ranks gets.
    fn shares(&self, alone: PairContact<D>, sizes: &[usize]) -> Vec<Vec<RankShare>> {
        let mut contact = PartContact::new(alone);
        contact.begin(&self.step(), &self.twists).expect("a good step");
        let mut share =
            |rank, size| contact.share(&self.step(), RankOf { rank, size }).expect("slow particles");
        sizes.iter().map(|&size| (0..size).map(|rank| share(rank, size)).collect()).collect()
    }

    fn particles_are_dealt_evenly(&self, shares: &[RankShare]) {
        let mut owners = BTreeMap::new();
        for RankShare { rank, particles, .. } in shares {
            assert!(particles.is_sorted_by(|a, b| a.order < b.order));
            let own = particles.iter().filter(|particle| particle.owner == *rank);
            let count =
                own.map(|particle| owners.insert(particle.index, rank)).filter(Option::is_none).count();
            assert!(count.abs_diff(self.positions.len() / shares.len()) <= 1, "{count}");
        }
        assert_eq!(owners.len(), self.positions.len(), "each particle once");
    }
}

fn in_all_surroundings<const D: usize>(count: usize, sizes: [f64; 3]) {
    let up = Vector::<D>::from_fn(|d, _| f64::from(u8::from(d == 1)));
    let wall = |normal: Vector<D>, offset: f64| Wall { normal, offset, speed: 0.2 };
    let walls = |side: f64| {
        Domain::default().with_wall(wall(up, -0.5)).with_wall(wall(-up, -side - 0.5)).with_period(0, side)
    };
    let sheared = |side: f64| {
        let mut domain = Domain::periodic(&Vector::repeat(side));
        domain.set_sliding(1.3 * side, 0.1 * side);
        domain
    };
    Cloud::<D>::new(count, sizes, |_| Domain::default()).ranks_find_what_one_search_does("open");
    Cloud::<D>::new(count, sizes, walls).ranks_find_what_one_search_does("a channel");
    Cloud::<D>::new(count, sizes, |side| Domain::periodic(&Vector::repeat(side)))
        .ranks_find_what_one_search_does("periodic");
    Cloud::<D>::new(count, sizes, sheared).ranks_find_what_one_search_does("sheared");
}

#[test]
fn ranks_find_the_pairs_of_one_search() {
    in_all_surroundings::<2>(300, [0.5; 3]);
    in_all_surroundings::<3>(400, [0.5; 3]);
}

#[test]
fn ranks_find_the_pairs_of_one_search_where_sizes_differ() {
    in_all_surroundings::<2>(300, [0.45, 0.2, 3.0]);
    in_all_surroundings::<3>(2000, [0.45, 0.2, 1.8]);
}

/// What a pair remembers goes to the owner of its first particle, who has its second one too.
#[test]
fn memory_goes_with_the_first_particle() {
    let cloud = Cloud::<2>::new(200, [0.5; 3], |_| Domain::default());
    let mut contact = PairContact::new(ContactParams::default()).within(cloud.domain.clone());
    let state = |k: usize| crate::PairState { pair: PairKey::new(k, 199 - k), gamma: -0.1, lambda: k as f64 };
    let pairs = (0..100).map(state).collect();
    crate::ContactModel::resume(&mut contact, crate::ContactState { pairs, ..Default::default() })
        .expect("a memory");
    let mut found = 0;
    for RankShare { rank, particles, memory } in &cloud.shares(contact, &[8])[0] {
        for of in memory {
            let (one, other) = of.pair.particles();
            let of_pair = [particles[one], particles[other.expect("a particle")]];
            let first = of_pair.iter().min_by_key(|of| of.index).expect("two");
            assert_eq!((first.owner, of_pair[0].index + of_pair[1].index), (*rank, 199));
            assert_eq!((of.gamma, of.lambda), (-0.1, f64::from(first.index)));
            found += 1;
        }
    }
    assert_eq!(found, 100);
}
