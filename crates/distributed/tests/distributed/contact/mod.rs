//! Contact that ranks share: the pairs, forces, memory, velocities and errors of one rank.

mod course;

use gluey_contact::{
    ContactError, ContactLaw, ContactParams, ContactState, Domain, PairKey, PairState, Partner, Wall,
};
use gluey_geom::Vector;

use self::course::{Course, RADIUS, SIZES, Setting, consistent, differences, floor_and_ceiling, packed};

/// Largest differences from one rank: of velocities, forces and memory.
type Limits = [f64; 3];

/// Ranks take the particles where one rank does, and to the same bits each time.
fn ranks_are_as_one<const D: usize>(what: &str, setting: &Setting<D>, limits: Limits) -> Course<D> {
    let serial = setting.run(&mut setting.alone());
    assert_eq!(serial.error, None, "{what}");
    assert_eq!(setting.on(1), serial, "{what}: one rank does what a process without ranks does");
    for size in SIZES {
        let shared = setting.on(size);
        assert_eq!(shared.error, None, "{what}, {size} ranks");
        let found = differences(&serial, &shared);
        let load = shared.loads.last().unwrap();
        let iterations = [&serial, &shared].map(|course| course.reports.last().unwrap().iterations);
        println!("{what}, {size} ranks: {found:?}, {load:?}, iterations {iterations:?}");
        let found = [found.velocities.max(found.places), found.lambda, found.gamma];
        assert!(
            found.iter().zip(&limits).all(|(found, limit)| found <= limit),
            "{what}, {size} ranks: {found:?}"
        );
        assert_eq!(setting.on(size), shared, "{what}, {size} ranks: the same bits");
    }
    serial
}

/// In space, between walls, in a channel, in a box that is sheared for ever; with particles that are held,
/// through a reversal.
fn suspensions<const D: usize>(count: usize, fraction: f64, limits: [Limits; 4]) {
    let (open, side) = packed::<D>(count, fraction);
    let of_x = |d: usize| (d != 1).then_some(side);
    let channel = (0..D).filter_map(|d| Some((d, of_x(d)?)));
    let channel = channel.fold(Domain::default(), |domain, (d, length)| domain.with_period(d, length));
    let paper = ContactParams { exact_gap: true, ..ContactParams::default() };
    let rough = ContactParams { gamma_min: Some(-1e-3), ..consistent() };
    ranks_are_as_one("open", &open, limits[0]);
    let load = *open.on(8).loads.last().unwrap();
    assert!(load.shared_pair_count > 0 && 3 * load.most_pairs < load.pair_count, "{load:?}");
    let walls = Setting {
        domain: floor_and_ceiling(Domain::default(), side),
        params: ContactParams { law: ContactLaw::Inelastic, ..consistent() },
        ..open.clone()
    };
    ranks_are_as_one("walls, inelastic", &walls, limits[1]);
    let held = (0..count).step_by(40).collect();
    let channel =
        Setting { domain: floor_and_ceiling(channel, side), params: paper, held, rate: 0.0, ..open.clone() };
    ranks_are_as_one("channel, held, exact gaps", &channel, limits[2]);
    let domain = Domain::periodic(&Vector::repeat(side));
    let sheared = Setting { domain, params: rough, steps: 6, reversal: 4, ..open };
    ranks_are_as_one("sheared, rough, reversed", &sheared, limits[3]);
}

#[test]
fn discs_touch_as_on_one_rank() {
    let open = [2.0e-12, 1.0e-12, 7.7e-14];
    let walls = [3.7e-12, 1.8e-12, 0.0];
    let channel = [7.0e-13, 3.3e-13, 4.0e-14];
    suspensions::<2>(400, 0.6, [open, walls, channel, [4.0e-13, 2.2e-13, 5.0e-18]]);
}

#[test]
fn spheres_touch_as_on_one_rank() {
    let open = [2.3e-12, 1.1e-12, 5.3e-14];
    let walls = [2.3e-12, 1.1e-12, 0.0];
    let channel = [7.2e-16, 2.6e-16, 5.2e-17];
    suspensions::<3>(500, 0.4, [open, walls, channel, [4.5e-13, 2.2e-13, 2.2e-16]]);
}

/// Most pairs are in one island, which all ranks have rows of; none has much more than its share.
fn thousands<const D: usize>(count: usize, fraction: f64, limits: Limits) {
    let (open, side) = packed::<D>(count, fraction);
    let domain = Domain::periodic(&Vector::repeat(side));
    let sheared = Setting { domain, sizes: [1.0; 3], steps: 10, strength: 0.0, ..open };
    let serial = sheared.run(&mut sheared.alone());
    assert!(serial.contacts.iter().filter(|contact| contact.gamma < 0.0).count() > count / 2);
    for size in SIZES {
        let shared = sheared.on(size);
        let found = differences(&serial, &shared);
        let load = shared.loads.last().unwrap();
        println!("{count} particles, {size} ranks: {found:?}, {load:?}");
        let found = [found.velocities.max(found.places), found.lambda, found.gamma];
        assert!(found.iter().zip(&limits).all(|(found, limit)| found <= limit), "{size} ranks: {found:?}");
        assert!(2 * load.shared_pair_count > load.pair_count, "{size} ranks: {load:?}");
        assert!(load.most_pairs * size * 2 < load.pair_count * 3, "{size} ranks: {load:?}");
    }
}

#[test]
fn thousands_of_discs_are_shared() {
    thousands::<2>(3000, 0.6, [2.3e-11, 2.9e-11, 1.4e-12]);
}

#[test]
fn thousands_of_spheres_are_shared() {
    thousands::<3>(3000, 0.4, [2.9e-12, 1.4e-12, 7.4e-14]);
}

/// A line of particles that touch, pressed together.
fn chain<const D: usize>(count: usize) -> Setting<D> {
    let (setting, _) = packed::<D>(200, 0.2);
    let place = |k: usize| Vector::from_fn(|d, _| [k as f64, 0.01 * (k as f64).sin(), 0.0][d]);
    Setting {
        positions: (0..count).map(|k| place(k * 7 % count)).collect(),
        sizes: [1.0; 3],
        strength: 0.0,
        rate: 0.0,
        ..setting
    }
}

/// The chain between walls of which one comes nearer: infeasible if the other stays.
fn pressed<const D: usize>(count: usize, speeds: [f64; 2]) -> Setting<D> {
    let along = Vector::<D>::from_fn(|d, _| f64::from(u8::from(d == 0)));
    let [left, right] = [-RADIUS, RADIUS - count as f64];
    let domain = Domain::default()
        .with_wall(Wall { normal: along, offset: left, speed: speeds[0] })
        .with_wall(Wall { normal: -along, offset: right, speed: speeds[1] });
    Setting { domain, steps: 1, ..chain(count) }
}

fn a_chain_spans_all_ranks<const D: usize>(limits: Limits) {
    let pushed = pressed::<D>(60, [1.0, -1.0]);
    let serial = ranks_are_as_one("chain", &pushed, limits);
    assert!(serial.contacts.len() >= 60, "{}", serial.contacts.len());
    for size in SIZES {
        let load = *pushed.on(size).loads.last().unwrap();
        assert_eq!(load.shared_pair_count, load.pair_count, "{size} ranks: one island");
    }
}

#[test]
fn a_chain_of_touching_particles_spans_all_ranks() {
    a_chain_spans_all_ranks::<2>([2.1e-13, 8.2e-14, 4.5e-15]);
    a_chain_spans_all_ranks::<3>([2.1e-13, 8.2e-14, 4.5e-15]);
}

/// All ranks say of a failure what one rank says; velocities (see `Setting::run`) and memory are as before.
fn all_fail<const D: usize>(what: &str, setting: &Setting<D>) -> ContactError {
    let serial = setting.run(&mut setting.alone());
    let error = serial.error.clone().unwrap();
    for size in SIZES {
        let shared = setting.on(size);
        println!("{what}, {size} ranks: {}", shared.error.as_ref().unwrap());
        assert_eq!(shared.error, serial.error, "{what}, {size} ranks");
        assert_eq!(shared.memory, setting.memory, "{what}, {size} ranks: the memory is as before");
    }
    error
}

#[test]
fn what_is_infeasible_is_so_on_all_ranks() {
    let flat = all_fail("discs between walls", &straight(pressed::<2>(24, [1.0, 0.0])));
    assert!(matches!(&flat, ContactError::Infeasible { pairs } if pairs.len() == 25), "{flat}");
    let solid = all_fail("spheres between walls", &straight(pressed::<3>(24, [0.5, 0.0])));
    assert!(matches!(&solid, ContactError::Infeasible { pairs } if pairs.len() == 25), "{solid}");
    // Between two that are held; they have the numbers 0 and 1 in the chain.
    let held = Setting { held: vec![0, 1], domain: Domain::default(), ..pressed::<2>(8, [0.0; 2]) };
    let between = all_fail("discs between held ones", &straight(Setting { squeeze: 1.0, ..held }));
    assert!(matches!(&between, ContactError::Infeasible { pairs } if pairs.len() == 7), "{between}");
}

/// The chain without bends, so that it cannot buckle.
fn straight<const D: usize>(mut setting: Setting<D>) -> Setting<D> {
    setting.positions.iter_mut().for_each(|x| x[1] = 0.0);
    setting
}

#[test]
fn other_failures_are_said_by_all_ranks() {
    let chain = chain::<2>(30);
    let told =
        all_fail("told to overlap", &Setting { held: (0..30).collect(), squeeze: 1.0, ..chain.clone() });
    assert!(matches!(told, ContactError::Given { .. }), "{told}");
    let same = Setting { positions: vec![Vector::zeros(); 2], ..chain.clone() };
    let coincident = all_fail("centres coincide", &same);
    assert!(matches!(coincident, ContactError::Coincident { .. }), "{coincident}");
    let not_finite = all_fail("not finite", &Setting { piston: Some(f64::NAN), ..chain });
    assert!(matches!(not_finite, ContactError::NotFinite { particle: 0, .. }), "{not_finite}");
}

/// The residual is that of another sum, but who gives up when is the same.
#[test]
fn iterations_that_do_not_suffice_are_an_error_on_all_ranks() {
    let mut setting = pressed::<2>(60, [1.0, -1.0]);
    setting.params.iteration_limit = 5;
    let serial = setting.run(&mut setting.alone()).error.unwrap();
    let ContactError::NotConverged { iterations: 5, residual: expected, .. } = serial else {
        panic!("{serial}")
    };
    for size in SIZES {
        let error = setting.on(size).error.unwrap();
        let ContactError::NotConverged { iterations, residual, history, .. } = error else {
            panic!("{error}")
        };
        assert_eq!((iterations, history.entries.len()), (5, 4));
        assert!((0.3..3.0).contains(&(residual / expected)), "{size} ranks: {residual} {expected}");
    }
}

/// What a pair remembers goes on acting when its particles have left each other, on whatever ranks they are.
#[test]
fn memory_reaches_across_ranks() {
    let mut setting = Setting { steps: 2, ..packed::<2>(300, 0.3).0 };
    let far = |first: u32, index: u32| PairKey { first, second: Partner::Particle { index, image: [0; 3] } };
    let state = |(k, pair): (u32, PairKey)| PairState { pair, gamma: -1e-4 * f64::from(k), lambda: 1e-3 };
    let pairs = (0..40).map(|k| (k, far(k, 299 - 3 * k)));
    setting.memory = ContactState { pairs: pairs.map(state).collect(), ..ContactState::default() };
    let serial = ranks_are_as_one("far pairs", &setting, [0.0; 3]);
    assert!(serial.reports[0].pair_count >= 40);
}

/// A jammed cluster: as many contacts as degrees of freedom and more, which gradient methods do not solve.
#[test]
fn a_jammed_cluster_across_ranks_is_solved() {
    let spread = |k: usize, d: usize| 0.01 * ((k * (d + 3)) as f64 * 0.618_033_988_75).fract() - 0.005;
    let place = |k: usize| {
        let (x, y) = ((k % 8) as f64, (k / 8) as f64);
        Vector::<2>::new(x + 0.5 * y + spread(k, 0), y * 0.75f64.sqrt() + spread(k, 1)) * 1.01
    };
    let mut jammed =
        Setting { positions: (0..60).map(place).collect(), squeeze: 1.0, steps: 1, ..chain::<2>(60) };
    jammed.params.exact_gap = true;
    let serial = jammed.run(&mut jammed.alone());
    assert!(serial.contacts.len() > 120, "{} contacts", serial.contacts.len());
    assert!(serial.reports[0].iterations > 500, "{:?}", serial.reports[0]);
    for size in SIZES {
        // Forces are not unique, motions are.
        let shared = jammed.on(size);
        let apart = serial.velocities.iter().zip(&shared.velocities).map(|(a, b)| (a - b).norm());
        let difference = apart.fold(0.0, f64::max);
        let iterations = [&serial, &shared].map(|course| course.reports[0].iterations);
        println!("jammed, {size} ranks: {difference:.1e}, iterations {iterations:?}, {:?}", shared.loads[0]);
        assert!(difference < 2.1e-11, "{size} ranks: {difference:e}");
        assert_eq!(jammed.on(size), shared, "{size} ranks: the same bits");
    }
}

/// Particles that are pushed farther than they would move are looked for anew.
#[test]
fn a_push_that_reaches_far_finds_all_it_meets() {
    // Gaps that the first particle closes, one after the other; a second line beside the first.
    let place =
        |k: usize| Vector::<2>::new(1.3 * (k / 2) as f64, 1.2 * (k % 2) as f64 + 0.01 * (k as f64).sin());
    let walled = Domain::default().with_wall(Wall { normal: -Vector::x(), offset: -60.0, speed: 0.0 });
    let pushed = Setting {
        positions: (0..60).map(place).collect(),
        domain: walled,
        held: vec![0],
        piston: Some(30.0),
        dt: 0.5,
        steps: 2,
        ..chain::<2>(60)
    };
    let serial = ranks_are_as_one("piston", &pushed, [4.1e-11, 4.8e-10, 3.6e-10]);
    let moved = serial.positions.iter().zip(&pushed.positions).map(|(x, before)| (x - before).norm());
    let farthest = moved.skip(1).fold(0.0, f64::max);
    assert!(farthest > 8.0 && serial.reports[1].pair_count > 200, "{farthest}");
}

/// Islands inside ranks are solved as without ranks: to the same bits.
#[test]
fn islands_inside_ranks_have_the_bits_of_one() {
    let (setting, _) = packed::<3>(200, 0.2);
    // Pairs that are far from each other, far apart on the curve too.
    let place = |k: usize| {
        let corner = [k / 2 % 4, k / 8 % 4, k / 32].map(|n| 10.0 * n as f64);
        Vector::<3>::from_fn(|d, _| {
            corner[d] + if d == 1 { 1.01 * (k % 2) as f64 } else { 0.1 * (k % 2) as f64 }
        })
    };
    let positions = (0..128).map(place).collect();
    let pairs = Setting { positions, sizes: [1.0; 3], strength: 3.0, steps: 10, ..setting };
    let serial = pairs.run(&mut pairs.alone());
    assert!(serial.contacts.len() >= 10, "{}", serial.contacts.len());
    for size in SIZES {
        let shared = pairs.on(size);
        let bits =
            |course: &Course<3>| (course.positions.clone(), course.contacts.clone(), course.memory.clone());
        let load = shared.loads.last().unwrap();
        println!("{size} ranks: {load:?}");
        assert_eq!(load.shared_pair_count, 0);
        assert_eq!(bits(&shared), bits(&serial), "{size} ranks");
    }
}

/// A run goes on from a checkpoint on another number of ranks as it would have, and on the same number to the
/// same bits.
#[test]
fn a_checkpoint_goes_on_with_any_number_of_ranks() {
    let (open, side) = packed::<2>(300, 0.6);
    let domain = Domain::periodic(&Vector::repeat(side));
    let first = Setting { domain, steps: 4, rate: 0.0, ..open };
    let before = first.on(3);
    let second = Setting { positions: before.positions, memory: before.memory, steps: 3, ..first };
    let serial = second.run(&mut second.alone());
    for size in SIZES {
        let shared = second.on(size);
        let found = differences(&serial, &shared);
        println!("gone on with by {size} ranks: {found:?}");
        assert!(found.velocities < 1e-12 && found.lambda < 5.1e-13 && found.gamma < 6e-14, "{found:?}");
    }
}
