//! The projection against closed forms, the optimality conditions and an interior-point solver.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};
use gluey_contact::{
    ContactLaw, ContactModel, ContactParams, ContactState, Mobility, PairContact, PairKey, PairState,
    SolverKind, StepGeometry, StokesDrag,
};
use gluey_geom::{Twist, Vector};
use rand::{RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

const RATE: f64 = 0.15;
const SOLVERS: [SolverKind; 4] = SolverKind::ALL;

/// The two particles of a pair.
fn ends(pair: PairKey) -> (usize, usize) {
    let (i, j) = pair.particles();
    (i, j.expect("no walls here"))
}

/// Particles near contact with random velocities, some pairs glued.
struct Packing<const D: usize> {
    positions: Vec<Vector<D>>,
    radii: Vec<f64>,
    drift: Vec<Vector<D>>,
    predicted: Vec<Vector<D>>,
    glued: Vec<PairKey>,
}

impl<const D: usize> Packing<D> {
    /// A jittered square or cubic lattice of `side^D` particles; without jitter all neighbours touch exactly,
    /// and there are more contacts than degrees of freedom can tell apart.
    fn new(side: usize, jitter: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let count = side.pow(D as u32);
        let spread = |random: &mut ChaCha8Rng, size: f64| {
            Vector::<D>::from_fn(|_, _| size * random.random_range(-1.0..1.0))
        };
        let site = |i: usize| Vector::<D>::from_fn(|d, _| (i / side.pow(d as u32) % side) as f64);
        let positions: Vec<_> =
            (0..count).map(|i| site(i) * (1.0 + 2.0 * jitter) + spread(&mut random, jitter)).collect();
        let radii = (0..count).map(|_| 0.5 - jitter * random.random_range(0.0..1.0)).collect();
        let predicted =
            positions.iter().map(|x| spread(&mut random, 0.6) - (x - site(count - 1) * 0.5) * 0.5).collect();
        let drift = (0..count).map(|_| spread(&mut random, 0.02)).collect();
        // Disjoint pairs, so that gluing them cannot be infeasible.
        let glued = (0..count).filter(|i| (i % side).is_multiple_of(2) && i % side + 1 < side && i % 3 == 0);
        let glued = glued.map(|i| PairKey::new(i, i + 1)).collect();
        Self { positions, radii, drift, predicted, glued }
    }

    /// Shears the square layers of the lattice into triangular ones.
    fn make_triangular(&mut self) {
        for x in &mut self.positions {
            x[0] += 0.5 * x[1];
            x[1] *= 0.75f64.sqrt();
        }
    }

    fn step(&self) -> StepGeometry<'_, D> {
        StepGeometry {
            positions: &self.positions,
            radii: &self.radii,
            drift: &self.drift,
            velocity_weight: RATE,
            dt: 0.1,
        }
    }

    fn twists(&self) -> Vec<Twist<D>> {
        self.predicted.iter().map(|velocity| Twist { velocity: *velocity, ..Twist::default() }).collect()
    }

    fn memory(&self) -> ContactState {
        let pairs = self.glued.iter();
        ContactState {
            pairs: pairs.map(|&pair| PairState { pair, gamma: -1.0, lambda: 0.0 }).collect(),
            ..ContactState::default()
        }
    }

    /// Corrected velocities, and the model for its contacts.
    fn solve(&self, params: ContactParams) -> (Vec<Vector<D>>, PairContact<D>) {
        let mut contact = PairContact::new(params);
        contact.resume(self.memory()).expect("a memory");
        let mut twists = self.twists();
        contact.correct(&self.step(), &mut twists).expect("a good step");
        (twists.iter().map(|twist| twist.velocity).collect(), contact)
    }

    /// All pairs, with normal, gap before the velocity, and whether they are glued.
    fn rows(&self) -> Vec<(PairKey, Vector<D>, f64, bool)> {
        let mut rows = Vec::new();
        for i in 0..self.positions.len() {
            for j in i + 1..self.positions.len() {
                let (pair, separation) = (PairKey::new(i, j), self.positions[j] - self.positions[i]);
                let normal = separation / separation.norm();
                let gap = separation.norm() - self.radii[i] - self.radii[j];
                let known = gap + normal.dot(&(self.drift[j] - self.drift[i]));
                rows.push((pair, normal, known, self.glued.contains(&pair)));
            }
        }
        rows
    }

    /// The same with particles renumbered: new particle `k` is old particle `order[k]`.
    fn shuffled(&self, order: &[usize]) -> Self {
        let pick = |values: &[Vector<D>]| order.iter().map(|&i| values[i]).collect();
        let mut new = vec![0; order.len()];
        order.iter().enumerate().for_each(|(k, &i)| new[i] = k);
        let mut glued: Vec<_> =
            self.glued.iter().map(|pair| ends(*pair)).map(|(i, j)| PairKey::new(new[i], new[j])).collect();
        glued.sort_unstable();
        Self {
            positions: pick(&self.positions),
            radii: order.iter().map(|&i| self.radii[i]).collect(),
            drift: pick(&self.drift),
            predicted: pick(&self.predicted),
            glued,
        }
    }
}

fn params(solver: SolverKind) -> ContactParams {
    ContactParams { solver, ..Default::default() }
}

/// Feasibility of all pairs (also those the search left out), stationarity, sign and complementarity: these
/// characterise the solution of a strictly convex problem.
fn assert_optimal<const D: usize>(packing: &Packing<D>, velocities: &[Vector<D>], contact: &PairContact<D>) {
    let mut balance: Vec<Vector<D>> =
        (0..velocities.len()).map(|i| (velocities[i] - packing.predicted[i]) * packing.radii[i]).collect();
    for (pair, normal, known, glued) in packing.rows() {
        let (i, j) = ends(pair);
        let gap = known + RATE * normal.dot(&(velocities[j] - velocities[i]));
        let found = contact.contacts().iter().find(|contact| contact.pair == pair);
        let lambda = found.map_or(0.0, |contact| contact.lambda);
        if glued {
            assert!(gap.abs() < 1e-12, "{pair:?} is glued, its gap {gap:e}");
        } else {
            assert!(gap > -1e-12 && lambda >= 0.0, "{pair:?}: gap {gap:e}, force {lambda:e}");
            assert!(gap * lambda < 1e-11, "{pair:?}: gap {gap:e}, force {lambda:e}");
        }
        balance[i] += normal * lambda;
        balance[j] -= normal * lambda;
    }
    for (i, rest) in balance.iter().enumerate() {
        assert!(rest.norm() < 1e-12, "particle {i}: {rest}");
    }
}

fn check_optimality<const D: usize>(side: usize) {
    for seed in 0..20 {
        // Every fourth packing touches exactly: its multipliers are not unique, its velocities are.
        let mut packing = Packing::<D>::new(side, if seed % 4 == 0 { 0.0 } else { 0.01 }, seed);
        if seed % 2 == 0 {
            packing.glued.clear();
        }
        let [one, others @ ..] = SOLVERS.map(|solver| {
            let (velocities, contact) = packing.solve(params(solver));
            assert_optimal(&packing, &velocities, &contact);
            assert!(contact.contacts().len() > side);
            velocities
        });
        for other in others {
            let difference = one.iter().zip(&other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(difference < 1e-10, "seed {seed}: the solvers differ by {difference:e}");
        }
    }
}

#[test]
fn velocities_are_optimal() {
    check_optimality::<2>(5);
    check_optimality::<3>(3);
}

/// More contacts than degrees of freedom, squeezed: which of them carry forces is what takes gradient methods
/// so long.
fn check_jammed<const D: usize>(side: usize) {
    let mut packing = Packing::<D>::new(side, 0.0025, 17);
    packing.make_triangular();
    packing.glued.clear();
    let centre = packing.positions.iter().sum::<Vector<D>>() / packing.positions.len() as f64;
    packing.predicted = packing.positions.iter().map(|x| centre - x).collect();
    let (velocities, contact) = packing.solve(params(SolverKind::Auto));
    assert_optimal(&packing, &velocities, &contact);
    assert!(10 * contact.contacts().len() > 8 * D * packing.positions.len(), "{}", contact.contacts().len());
    let exact = ContactParams { exact_gap: true, ..params(SolverKind::Auto) };
    let (velocities, _) = packing.solve(exact);
    let end = |i: usize| packing.positions[i] + (velocities[i] * RATE + packing.drift[i]);
    for (pair, ..) in packing.rows() {
        let (i, j) = ends(pair);
        assert!((end(j) - end(i)).norm() > packing.radii[i] + packing.radii[j] - 1e-12, "{pair}");
    }
}

#[test]
fn jammed_clusters_are_solved_for() {
    check_jammed::<2>(10);
    check_jammed::<3>(5);
}

/// The same problem for an interior-point method: minimise 1/2 v.M v - (M u*).v subject to all pairs'
/// constraints.
fn interior_point<const D: usize>(packing: &Packing<D>) -> Vec<f64> {
    // Pairs that are far apart cannot bind.
    let mut rows: Vec<_> = packing.rows().into_iter().filter(|row| row.2 < 0.8).collect();
    rows.sort_by_key(|row| !row.3);
    let equality_count = rows.iter().filter(|row| row.3).count();
    let size = D * packing.positions.len();
    let (mut at_row, mut at_column, mut values, mut right) = (vec![], vec![], vec![], vec![]);
    for (row, (pair, normal, known, _)) in rows.iter().enumerate() {
        let (i, j) = ends(*pair);
        for d in 0..D {
            at_row.extend([row, row]);
            at_column.extend([D * i + d, D * j + d]);
            values.extend([RATE * normal[d], -RATE * normal[d]]);
        }
        right.push(*known);
    }
    let constraints = CscMatrix::new_from_triplets(rows.len(), size, at_row, at_column, values);
    let mass: Vec<f64> = (0..size).map(|k| packing.radii[k / D]).collect();
    let linear: Vec<f64> = (0..size).map(|k| -mass[k] * packing.predicted[k / D][k % D]).collect();
    let quadratic = CscMatrix::new(size, size, (0..=size).collect(), (0..size).collect(), mass);
    let mut cones = vec![NonnegativeConeT(rows.len() - equality_count)];
    if equality_count > 0 {
        cones.insert(0, ZeroConeT(equality_count));
    }
    // It gives up on some packings with one length of step and solves them with another.
    for step_fraction in [0.99, 0.9, 0.8, 0.6, 0.4] {
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .tol_gap_abs(1e-14)
            .tol_gap_rel(1e-13)
            .tol_feas(1e-12)
            .max_step_fraction(step_fraction)
            .build()
            .expect("good settings");
        let mut solver = DefaultSolver::new(&quadratic, &linear, &constraints, &right, &cones, settings)
            .expect("a good problem");
        solver.solve();
        if solver.solution.status == SolverStatus::Solved {
            return solver.solution.x;
        }
        println!(
            "step fraction {step_fraction}: {:?}, dual residual {:e}",
            solver.solution.status, solver.solution.r_dual
        );
    }
    panic!("the interior-point solver failed");
}

/// Velocities agree to 1e-8 of the largest.
fn check_interior_point<const D: usize>(packing: &Packing<D>, solver: SolverKind) -> usize {
    let (velocities, contact) = packing.solve(params(solver));
    assert_optimal(packing, &velocities, &contact);
    let other = interior_point(packing);
    let largest = velocities.iter().map(|v| v.amax()).fold(0.0, f64::max);
    for (i, velocity) in velocities.iter().enumerate() {
        for d in 0..D {
            let difference = (velocity[d] - other[D * i + d]).abs() / largest;
            assert!(difference < 1e-8, "{solver:?}, particle {i} of {}: {difference:e}", velocities.len());
        }
    }
    contact.contacts().len()
}

/// 100 packings of 2 to 12 (in 3D 2 to 5) particles a side; small ones now and then with triangular layers,
/// which have more contacts than degrees of freedom, so that contacts depend on each other linearly; two of
/// three have pairs that must stay closed.
fn check_packings<const D: usize>(largest_side: u64) {
    let (mut fewest, mut most) = (usize::MAX, 0);
    for seed in 0..100 {
        let side = 2 + seed % (largest_side - 1);
        let mut packing = Packing::<D>::new(side as usize, 0.01, 100 + seed);
        if seed % 4 == 0 && side <= 4 {
            packing.make_triangular();
        }
        if seed % 3 == 0 {
            packing.glued.clear();
        }
        // Uzawa's iterations go like the square of the size.
        let solver = if side <= 5 { SOLVERS[seed as usize % 4] } else { SolverKind::Auto };
        let count = check_interior_point(&packing, solver);
        (fewest, most) = (fewest.min(count), most.max(count));
    }
    println!("{D}D: {fewest} to {most} contacts");
    assert!(fewest < 10 && most > 250);
}

#[test]
fn an_interior_point_solver_agrees_on_two_hundred_packings() {
    check_packings::<2>(12);
    check_packings::<3>(5);
}

/// One pair of different sizes: `lambda = -q / (c (1/a_i + 1/a_j))`, the paper's eq. 29 in closed form.
fn check_closed_form<const D: usize>() {
    let normal = Vector::<D>::from_fn(|d, _| 0.8 - d as f64).normalize();
    let (radii, first_gap) = ([0.3, 0.7], 0.05);
    let positions = [Vector::<D>::repeat(0.2), Vector::<D>::repeat(0.2) + normal * (1.0 + first_gap)];
    let drift = [normal * 0.01, normal * -0.02];
    for (approach, glued) in [(1.0, false), (0.1, false), (-1.0, false), (1.0, true), (-1.0, true)] {
        let predicted = [normal * (0.5 * approach), normal * (-0.5 * approach)];
        let packing = Packing {
            positions: positions.to_vec(),
            radii: radii.to_vec(),
            drift: drift.to_vec(),
            predicted: predicted.to_vec(),
            glued: if glued { vec![PairKey::new(0, 1)] } else { vec![] },
        };
        let free = first_gap - 0.03 - RATE * approach;
        let unclipped = -free / (RATE * (1.0 / 0.3 + 1.0 / 0.7));
        let lambda = if glued { unclipped } else { unclipped.max(0.0) };
        for solver in SOLVERS {
            let (velocities, contact) = packing.solve(params(solver));
            assert!((velocities[0] - (predicted[0] - normal * (lambda / 0.3))).norm() < 1e-13);
            assert!((velocities[1] - (predicted[1] + normal * (lambda / 0.7))).norm() < 1e-13);
            let known = contact.contacts().first().map_or(0.0, |contact| contact.lambda);
            assert!((known - lambda).abs() < 1e-13, "{known} {lambda}");
        }
    }
}

#[test]
fn one_pair_has_a_closed_form() {
    check_closed_form::<2>();
    check_closed_form::<3>();
}

fn check_numbering<const D: usize>(side: usize, law: ContactLaw) {
    let packing = Packing::<D>::new(side, 0.01, 7);
    let mut order: Vec<usize> = (0..packing.positions.len()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(3));
    let shuffled = packing.shuffled(&order);
    for solver in SOLVERS {
        let tuning = ContactParams { law, exact_gap: true, ..params(solver) };
        let (straight, _) = packing.solve(tuning.clone());
        let (other, _) = shuffled.solve(tuning);
        let back: Vec<_> = order.iter().map(|&i| straight[i]).collect();
        assert_ne!(straight, packing.predicted);
        assert_eq!(back, other, "{law} {solver:?}");
    }
}

#[test]
fn numbering_changes_no_bit() {
    for law in [ContactLaw::Gluey, ContactLaw::Inelastic, ContactLaw::VelocityCorrection] {
        check_numbering::<2>(5, law);
        check_numbering::<3>(3, law);
    }
}

fn check_exact_gaps<const D: usize>(side: usize) {
    for law in [ContactLaw::Gluey, ContactLaw::Inelastic, ContactLaw::VelocityCorrection] {
        for solver in SOLVERS {
            let packing = Packing::<D>::new(side, 0.01, 11);
            let tuning = ContactParams { law, exact_gap: true, ..params(solver) };
            let (velocities, _) = packing.solve(tuning);
            let end = |i: usize| packing.positions[i] + (velocities[i] * RATE + packing.drift[i]);
            for (pair, _, _, glued) in packing.rows() {
                let (i, j) = ends(pair);
                let gap = (end(j) - end(i)).norm() - packing.radii[i] - packing.radii[j];
                assert!(gap > -1e-12, "{law} {pair:?}: {gap:e}");
                assert!(!(glued && law == ContactLaw::Gluey) || gap < 1e-12, "{pair:?}: {gap:e}");
            }
        }
    }
}

#[test]
fn many_exact_gaps_at_once() {
    check_exact_gaps::<2>(5);
    check_exact_gaps::<3>(3);
}

/// Stokes drag plus a velocity common to all particles, proportional to the total force.
struct Coupled;

impl<const D: usize> Mobility<D> for Coupled {
    const COUPLED: bool = true;

    fn own(&self, _particle: usize, radius: f64) -> f64 {
        1.0 / radius + 0.3
    }

    fn apply(&self, radii: &[f64], forces: &[Vector<D>], velocities: &mut [Vector<D>]) {
        Mobility::<D>::apply(&StokesDrag, radii, forces, velocities);
        let total: Vector<D> = forces.iter().sum();
        velocities.iter_mut().for_each(|velocity| *velocity += total * 0.3);
    }
}

#[test]
fn contact_forces_balance_so_a_common_velocity_makes_no_difference() {
    let packing = Packing::<2>::new(5, 0.01, 5);
    let (expected, _) = packing.solve(params(SolverKind::ActiveSet));
    let mut contact = PairContact::with_mobility(params(SolverKind::ActiveSet), Coupled);
    contact.resume(packing.memory()).expect("a memory");
    let mut twists = packing.twists();
    contact.correct(&packing.step(), &mut twists).expect("a good step");
    for (twist, velocity) in twists.iter().zip(expected) {
        assert!((twist.velocity - velocity).norm() < 1e-11);
    }
}

#[test]
fn a_push_reaches_pairs_that_were_not_closing() {
    // A row of discs, only the first of which moves: each contact closes because of the one before.
    let count = 12;
    let positions: Vec<_> = (0..count).map(|i| Vector::<2>::new(1.05 * i as f64, 0.0)).collect();
    let mut predicted = vec![Vector::<2>::zeros(); count];
    predicted[0].x = 20.0;
    let (radii, drift) = (vec![0.5; count], vec![Vector::zeros(); count]);
    let packing = Packing { positions, radii, drift, predicted, glued: vec![] };
    for solver in SOLVERS {
        let (velocities, contact) = packing.solve(params(solver));
        assert_optimal(&packing, &velocities, &contact);
        assert!(contact.contacts().len() >= 6);
    }
}
