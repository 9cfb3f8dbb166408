//! Arrangements: no overlaps, exact fractions, refusals.

use gluey_geom::{Aabb, Vector};
use gluey_suspension::Container;
use gluey_suspension::packing::{
    Amount, Arrangement, LargeShare, Packing, PackingError, PackingParams, Sizes,
};
use gluey_suspension::structure::StructureFactor;

const BRIEF: Arrangement = Arrangement::Equilibrium { sweep_count: 20 };

/// Whether particles are inside, have the fraction, and the smallest gap.
fn is_right<const D: usize>(container: &Container<D>, params: &PackingParams, fraction: f64) -> Packing<D> {
    let packing = Packing::new(container, params).expect("room");
    assert!((packing.fraction(container) / fraction - 1.0).abs() < 1e-12, "{params:?}");
    let mean = packing.radii.iter().sum::<f64>() / packing.radii.len() as f64;
    let gap = packing.smallest_gap(container) / mean;
    assert!(gap >= params.min_gap * (1.0 - 1e-9), "{gap} in {params:?}");
    assert!(packing.positions.iter().all(|x| container.bounds().contains(x)));
    packing
}

fn random<const D: usize>(dense: f64) {
    let bounds = Aabb { lower: Vector::repeat(-1.0), upper: Vector::from_fn(|d, _| [3.0, 2.0, 2.5][d]) };
    let sizes = [
        Sizes::Equal,
        Sizes::Bidisperse { ratio: 1.4, large: LargeShare::OfVolume(0.5) },
        Sizes::Lognormal { deviation: 0.2 },
    ];
    for is_periodic in [[true; D], std::array::from_fn(|d| d != 1), [false; D]] {
        let container = Container::new(bounds, is_periodic);
        for (seed, sizes) in (1..).zip(sizes) {
            for (fraction, min_gap, arrangement) in
                [(0.05, 0.1, BRIEF), (0.3, 0.01, BRIEF), (0.3, 0.0, Arrangement::Random)]
            {
                let amount = Amount::Count { fraction, count: 150 };
                let params =
                    PackingParams { sizes, min_gap, arrangement, seed, ..PackingParams::new(amount) };
                is_right(&container, &params, fraction);
            }
        }
    }
    let container = Container::new(bounds, [true; D]);
    let amount = Amount::Count { fraction: dense, count: 400 };
    for arrangement in [BRIEF, Arrangement::Random] {
        let params = PackingParams { arrangement, min_gap: 0.01, ..PackingParams::new(amount) };
        is_right(&container, &params, dense);
    }
}

/// Random arrangements are as even over long distances as their neighbours allow, and no lattice.
#[test]
fn random_arrangements_have_no_order() {
    let container = Container::<2>::periodic(&Vector::repeat(1.0));
    let amount = Amount::Count { fraction: 0.5, count: 400 };
    let params = PackingParams { arrangement: Arrangement::Random, ..PackingParams::new(amount) };
    let discs = is_right(&container, &params, 0.5);
    let step = std::f64::consts::TAU;
    let mut factor = StructureFactor::new(30.0 * step, step);
    factor.add(&container, &discs.positions);
    let highest = factor.bins().iter().map(|bin| bin.s).fold(0.0, f64::max);
    println!("S at the smallest k {:.3}, highest {highest:.2}", factor.bins()[0].s);
    // A lattice of 400 has peaks of 400.
    assert!(factor.bins()[0].s < 0.15 && highest < 6.0, "{highest}");
}

#[test]
fn random_particles_keep_their_gap() {
    random::<2>(0.75);
    random::<3>(0.55);
}

#[test]
fn the_seed_says_all() {
    let container = Container::periodic(&Vector::<3>::repeat(2.0));
    let params = PackingParams::new(Amount::Count { fraction: 0.4, count: 60 });
    let packings = [1, 1, 2].map(|seed| Packing::new(&container, &PackingParams { seed, ..params }));
    assert_eq!(packings[0], packings[1]);
    assert_ne!(packings[0], packings[2]);
}

#[test]
fn two_of_three_numbers_say_how_many() {
    let container = Container::periodic(&Vector::<2>::repeat(1.0));
    let fraction = 0.3;
    let by_radius = PackingParams::new(Amount::Radius { fraction, radius: 0.05 });
    let packing = is_right(&container, &PackingParams { arrangement: BRIEF, ..by_radius }, fraction);
    assert_eq!(packing.radii.len(), 38);
    assert!((packing.radii[0] / 0.05 - 1.0).abs() < 0.01);
    let both = PackingParams::new(Amount::CountAndRadius { count: 38, radius: 0.05 });
    let packing = Packing::new(&container, &PackingParams { arrangement: BRIEF, ..both }).expect("room");
    assert!((packing.fraction(&container) - 38.0 * std::f64::consts::PI * 0.0025).abs() < 1e-12);
    // Polydisperse radii have the mean that is asked for.
    let sizes = Sizes::Lognormal { deviation: 0.3 };
    let packing =
        Packing::new(&container, &PackingParams { sizes, arrangement: BRIEF, ..both }).expect("room");
    assert!((packing.radii.iter().sum::<f64>() / 38.0 - 0.05).abs() < 1e-15);
}

fn lattice<const D: usize>(arrangement: Arrangement, edges: Vector<D>, count: usize, densest: f64) {
    for container in
        [Container::periodic(&edges), Container::walled(Aabb { lower: Vector::zeros(), upper: edges })]
    {
        let params = |fraction, jitter| PackingParams {
            arrangement,
            jitter,
            min_gap: 1e-6,
            ..PackingParams::new(Amount::Count { fraction, count })
        };
        is_right(&container, &params(0.03, 1.0), 0.03);
        let is_periodic = !container.is_walled(0);
        if is_periodic {
            is_right(&container, &params(densest * 0.9999, 0.0), densest * 0.9999);
        }
        let refused = Packing::new(&container, &params(densest * 1.001, 0.0));
        assert!(
            matches!(refused, Err(PackingError::LatticeTooDense { most, .. })
            if !is_periodic || (most / densest - 1.0).abs() < 1e-4),
            "{refused:?}"
        );
        let odd = PackingParams::new(Amount::Count { fraction: 0.1, count: count + 1 });
        match Packing::new(&container, &PackingParams { arrangement, ..odd }) {
            Err(PackingError::NoLattice { fitting, .. }) => assert_eq!(fitting[0], count),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn lattices_are_exact() {
    use std::f64::consts::PI;
    lattice(Arrangement::Square, Vector::<2>::new(3.0, 2.0), 54, PI / 4.0);
    lattice(Arrangement::Hexagonal, Vector::<2>::new(2.0, 3f64.sqrt()), 16, PI / 12f64.sqrt());
    lattice(Arrangement::SimpleCubic, Vector::<3>::new(1.0, 2.0, 1.0), 16, PI / 6.0);
    lattice(Arrangement::BodyCentred, Vector::<3>::repeat(1.0), 54, 3f64.sqrt() * PI / 8.0);
    lattice(Arrangement::FaceCentred, Vector::<3>::repeat(1.0), 32, PI / 18f64.sqrt());
}

#[test]
fn what_cannot_be_is_refused_with_its_numbers() {
    let cube = Container::periodic(&Vector::<3>::repeat(1.0));
    let refusal = |container: &Container<3>, params: &PackingParams| {
        Packing::new(container, params).expect_err("refused").to_string()
    };
    let count = |fraction, count| PackingParams::new(Amount::Count { fraction, count });
    let dense = PackingParams { min_gap: 0.1, ..count(0.5, 100) };
    for (container, params, wanted) in [
        (cube, dense, "a volume fraction of 0.5000 (0.5788"),
        (cube, count(0.5, 3), "a particle of radius 0.341"),
        (cube, count(1.2, 3), "the volume fraction = 1.2: it must be between 0 and 1"),
        (cube, count(0.2, 0), "the number of particles = 0: it must be from 1"),
        (cube.tilted(0.1), count(0.2, 9), "the box has a tilt of 0.1"),
        (cube, PackingParams { jitter: 2.0, ..count(0.2, 9) }, "the jitter = 2"),
        (cube, PackingParams { arrangement: Arrangement::Square, ..count(0.2, 9) }, "is not one in 3D"),
        (cube, PackingParams { arrangement: Arrangement::SimpleCubic, ..count(0.2, 9) }, "8 or 27 do"),
    ] {
        let message = refusal(&container, &params);
        assert!(message.contains(wanted), "{message}");
    }
}
