//! A steady step allocates nothing.

use gluey_contact::{
    ContactLaw, ContactParams, Domain, GammaUpdate, PairContact, SolverKind, StepGeometry, Wall,
};
use gluey_geom::{Twist, Vector};
use gluey_testkit::allocation::{CountingAllocator, count_in_thread};
use gluey_testkit::packing::Packing;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn a_steady_step_allocates_nothing() {
    let packing = Packing::<3>::fluid(1000, 0.4, 2);
    // The allocations of this one thread are counted.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for law in [ContactLaw::Inelastic, ContactLaw::Gluey] {
        for solver in SolverKind::ALL {
            pool.install(|| check(&packing, law, solver));
        }
    }
}

fn check(packing: &Packing<3>, law: ContactLaw, solver: SolverKind) {
    let params = ContactParams {
        law,
        solver,
        gamma_update: GammaUpdate::Consistent,
        tolerance: 1e-6,
        ..Default::default()
    };
    let floor = Wall::new(&Vector::zeros(), &Vector::<3>::z());
    let domain = Domain::default().with_period(0, packing.side).with_period(1, packing.side).with_wall(floor);
    let mut contact = PairContact::<3>::new(params).within(domain);
    let positions: Vec<Vector<3>> = packing.positions.iter().map(|x| x + Vector::z() * 0.5).collect();
    let (radii, drift) = (vec![0.5; positions.len()], vec![Vector::zeros(); positions.len()]);
    let sink = |x: &Vector<3>| Twist { velocity: -x * 0.1, ..Twist::default() };
    let predicted: Vec<Twist<3>> = positions.iter().map(sink).collect();
    let mut twists = predicted.clone();
    // The same step again and again: sizes do not change any more.
    for repetition in 0..4 {
        twists.copy_from_slice(&predicted);
        let step = StepGeometry {
            positions: &positions,
            radii: &radii,
            drift: &drift,
            velocity_weight: 0.05,
            dt: 0.05,
        };
        let (report, allocations) = count_in_thread(|| contact.correct(&step, &mut twists));
        assert!(report.expect("feasible").active_count > 30);
        assert!(repetition < 2 || allocations == 0, "{law} {solver:?}: {allocations} allocations");
    }
}
