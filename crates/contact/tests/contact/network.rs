//! The contact network against exact answers.

use gluey_contact::{
    Contact, ContactError, ContactLaw, ContactModel, ContactNetwork, ContactParams, Domain, PairContact,
    PairKey, StepGeometry, Wall,
};
use gluey_geom::{Matrix, Twist, Vector};

fn contact(pair: PairKey, lambda: f64) -> Contact {
    Contact { pair, lambda, gamma: -0.5 * lambda, gap: 0.0 }
}

/// A simple cubic crystal of `side^D` touching unit spheres in a periodic box, every contact pushing with
/// `lambda`.
fn crystal<const D: usize>(side: usize, lambda: f64) -> (Domain<D>, Vec<Vector<D>>, Vec<Contact>) {
    let length = 2.0 * side as f64;
    let domain = Domain::periodic(&Vector::<D>::repeat(length));
    let count = side.pow(D as u32);
    let digit = |i: usize, d: usize| i / side.pow(d as u32) % side;
    let positions = (0..count).map(|i| Vector::from_fn(|d, _| 2.0 * digit(i, d) as f64 + 1.0)).collect();
    let mut contacts = Vec::new();
    for i in 0..count {
        for d in 0..D {
            let last = digit(i, d) + 1 == side;
            let next =
                if last { i + side.pow(d as u32) - side.pow(d as u32 + 1) } else { i + side.pow(d as u32) };
            let mut image = [0; 3];
            image[d] = i32::from(last);
            contacts.push(contact(PairKey::across(i, next, image), lambda));
        }
    }
    (domain, positions, contacts)
}

fn check_crystal<const D: usize>() {
    let (side, lambda) = (3, 0.7);
    let (domain, positions, contacts) = crystal::<D>(side, lambda);
    let radii = vec![1.0; positions.len()];
    let network = ContactNetwork::new(&contacts, &positions, &radii, &domain).expect("a good network");

    // A particle takes up the cube of edge 2 and has D contacts of its own, each of arm 2.
    let exact = -Matrix::<D>::identity() * (2.0 * lambda / 2f64.powi(D as i32));
    let stress = network.stress(6f64.powi(D as i32));
    assert!((stress - exact).norm() < 1e-14, "{stress} {exact}");

    let coordination = network.coordination();
    assert_eq!((coordination.mean, coordination.mean_of_backbone), (2.0 * D as f64, 2.0 * D as f64));
    assert_eq!(coordination.rattler_count, 0);

    let clusters = network.clusters();
    assert_eq!(clusters.size_distribution(), [(side.pow(D as u32), 1)]);
    assert_eq!(clusters.clusters[0].percolates, [true; D]);
}

#[test]
fn a_crystal_under_uniform_compression() {
    check_crystal::<2>();
    check_crystal::<3>();
}

#[test]
fn sheared_contacts_make_a_symmetric_stress() {
    // One contact along (3, 4)/5, of arm 2.
    let positions = [Vector::<2>::zeros(), Vector::<2>::new(1.2, 1.6)];
    let domain = Domain::default();
    let contacts = [contact(PairKey::new(0, 1), 1.0)];
    let network = ContactNetwork::new(&contacts, &positions, &[1.0; 2], &domain).expect("good");
    let exact = -Matrix::<2>::new(0.72, 0.96, 0.96, 1.28);
    assert!((network.stress(1.0) - exact).norm() < 1e-15);
    assert!((network.arm(&contacts[0]).point - Vector::<2>::new(0.6, 0.8)).norm() < 1e-15);
}

#[test]
fn a_periodic_chain_percolates_along_itself_only() {
    let domain = Domain::periodic(&Vector::<3>::new(8.0, 20.0, 20.0));
    // Out of order and unwrapped: particle 2 is written three periods away; 4 and 5 are elsewhere.
    let at = |x: f64, y: f64| Vector::<3>::new(x, y, 0.0);
    let positions =
        [at(1.0, 0.0), at(5.0, 0.0), at(3.0 + 24.0, 0.0), at(7.0, 0.0), at(1.0, 9.0), at(3.0, 9.0)];
    let mut contacts = vec![
        contact(PairKey::across(0, 2, [-3, 0, 0]), 1.0),
        contact(PairKey::across(2, 1, [3, 0, 0]), 1.0),
        contact(PairKey::new(1, 3), 1.0),
        contact(PairKey::across(3, 0, [1, 0, 0]), 1.0),
        contact(PairKey::new(4, 5), 1.0),
    ];
    let radii = [1.0; 6];
    let clusters = |contacts: &[Contact]| {
        ContactNetwork::new(contacts, &positions, &radii, &domain).expect("good").clusters()
    };
    for contact in &contacts {
        let branch = contact.pair.branch(&positions, &domain).expect("there");
        assert!((branch.norm() - 2.0).abs() < 1e-12, "{}: {branch}", contact.pair);
    }
    for _ in 0..contacts.len() {
        let found = clusters(&contacts);
        assert_eq!(found.of_particle, [0, 0, 0, 0, 1, 1]);
        assert_eq!(found.largest().map(|cluster| cluster.percolates), Some([true, false, false]));
        assert_eq!(found.clusters[1].percolates, [false; 3]);
        contacts.rotate_left(1);
    }
    // Open at one place, it reaches round no longer.
    let found = clusters(&contacts[1..]);
    assert_eq!(found.size_distribution(), [(4, 1), (2, 1)]);
    assert_eq!(found.clusters[0].percolates, [false; 3]);
}

#[test]
fn a_helix_percolates_where_its_way_round_leads() {
    // One turn of the chain advances by a period in x and one in y.
    let domain = Domain::periodic(&Vector::<2>::new(4.0, 4.0));
    let positions = [Vector::<2>::zeros(), Vector::<2>::new(2.0, 2.0)];
    let contacts = [contact(PairKey::new(0, 1), 1.0), contact(PairKey::across(1, 0, [1, 1, 0]), 1.0)];
    let radii = [2f64.sqrt(); 2];
    let network = ContactNetwork::new(&contacts, &positions, &radii, &domain).expect("good");
    assert_eq!(network.clusters().clusters[0].percolates, [true, true]);
}

#[test]
fn a_column_percolates_upwards_in_any_tilt() {
    // Two discs that stand on each other; the next row of boxes is a little, and some periods, further along.
    let positions = [Vector::<2>::zeros(), Vector::<2>::new(0.0, 2.0)];
    for turns in [0, 3, -2] {
        let mut domain = Domain::periodic(&Vector::<2>::new(10.0, 4.0));
        domain.set_sliding(0.1 + 10.0 * f64::from(turns), 0.0);
        let up = PairKey::across(1, 0, [-turns, 1, 0]);
        let contacts = [contact(PairKey::new(0, 1), 1.0), contact(up, 1.0)];
        assert!((up.branch(&positions, &domain).expect("there").norm() - 2.0).abs() < 3e-3);
        let network = ContactNetwork::new(&contacts, &positions, &[1.0; 2], &domain).expect("good");
        assert_eq!(network.clusters().clusters[0].percolates, [false, true], "{turns}");
    }
}

#[test]
fn two_discs_and_walls() {
    // Pressed down by u = -1 each: the lower contact carries both, 2 a.
    let floor = Wall::new(&Vector::<2>::zeros(), &Vector::<2>::y());
    let ceiling = Wall::new(&Vector::<2>::new(0.0, 4.0), &-Vector::<2>::y());
    let domain = Domain::default().with_wall(floor).with_wall(ceiling);
    let positions = [Vector::<2>::new(0.0, 1.0), Vector::<2>::new(0.0, 3.0), Vector::<2>::new(9.0, 2.0)];
    let radii = [1.0; 3];
    let mut model = PairContact::new(ContactParams::default()).within(domain.clone());
    let mut twists = [Twist::<2>::default(); 3];
    twists[..2].iter_mut().for_each(|twist| twist.velocity.y = -1.0);
    let drift = [Vector::zeros(); 3];
    let step =
        StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: 0.1, dt: 0.1 };
    model.correct(&step, &mut twists).expect("a good step");
    let mut contacts = model.contacts().to_vec();
    contacts.push(contact(PairKey::wall(1, 1), 0.0));

    let network = ContactNetwork::new(&contacts, &positions, &radii, &domain).expect("good");
    // lambda: wall 2, pair 1; arms 1 and 2.
    let stress = network.stress(8.0);
    assert!((stress - Matrix::<2>::new(0.0, 0.0, 0.0, -0.5)).norm() < 1e-12, "{stress}");
    // What contact has added to the velocities, times the radii.
    let forces = network.forces();
    let exact = [(0, 1.0), (1, 1.0), (2, 0.0)].map(|(k, up)| (forces[k] - Vector::<2>::new(0.0, up)).norm());
    assert!(exact.iter().all(|error| *error < 1e-11), "{forces:?}");
    let coordination = network.coordination();
    assert!((coordination.mean - 4.0 / 3.0).abs() < 1e-15);
    assert_eq!((coordination.mean_of_backbone, coordination.rattler_count), (0.0, 3));
    let clusters = network.clusters();
    assert_eq!(clusters.of_particle, [0, 0, 1]);
    assert!(clusters.clusters[0].bridges(0, 1) && clusters.clusters[1].walls.is_empty());

    let mut table = Vec::new();
    network.write_csv(&mut table).expect("memory");
    let table = String::from_utf8(table).expect("text");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(
        rows[0].join(" "),
        "first partner second image_x image_y lambda gamma gap normal_x normal_y point_x point_y"
    );
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().expect("a number");
    // Numbers are counted from 1.
    assert_eq!(rows[1][..5], ["1", "particle", "2", "0", "0"]);
    assert_eq!(rows[2][..5], ["1", "wall", "1", "0", "0"]);
    assert_eq!(rows[3][..5], ["2", "wall", "2", "0", "0"]);
    for (row, contact) in contacts.iter().enumerate() {
        let values = [contact.lambda, contact.gamma, contact.gap];
        assert_eq!([5, 6, 7].map(|column| number(row + 1, column)), values, "read back exactly");
    }
    assert_eq!([8, 9, 10, 11].map(|column| number(1, column)), [0.0, 1.0, 0.0, 2.0]);
    assert_eq!([8, 9, 10, 11].map(|column| number(2, column)), [0.0, -1.0, 0.0, 0.0]);
    assert_eq!([8, 9, 10, 11].map(|column| number(3, column)), [0.0, 1.0, 0.0, 4.0]);
}

/// A heap that is pressed together across periodic, tilted borders: forces are changes of velocity times
/// radii.
fn moves_as_forces_say<const D: usize>() {
    let mut domain = Domain::periodic(&Vector::<D>::repeat(4.0));
    domain.set_sliding(0.7, 0.0);
    let number = |k: usize| (0.5 + k as f64 * 0.754_877_666).fract();
    let positions: Vec<_> = (0..2usize.pow(D as u32))
        .map(|n| Vector::<D>::from_fn(|d, _| 2.0 * f64::from(n as u32 >> d & 1)))
        .collect();
    let radii: Vec<f64> = (0..positions.len()).map(|n| 0.9 + 0.1 * number(n)).collect();
    let mut twists: Vec<_> = (0..positions.len())
        .map(|n| Twist::<D> {
            velocity: Vector::from_fn(|d, _| 4.0 * number(D * n + d) - 2.0),
            ..Twist::default()
        })
        .collect();
    let before = twists.clone();
    let drift = vec![Vector::zeros(); positions.len()];
    let step =
        StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: 0.1, dt: 0.1 };
    let params = ContactParams { law: ContactLaw::Inelastic, ..ContactParams::default() };
    let mut model = PairContact::new(params).within(domain.clone());
    model.correct(&step, &mut twists).expect("a good step");
    let network = ContactNetwork::new(model.contacts(), &positions, &radii, &domain).expect("good");
    let forces = network.forces();
    assert!(model.contacts().len() > 1 && forces.iter().any(|force| force.norm() > 0.1), "{forces:?}");
    for (n, force) in forces.iter().enumerate() {
        let change = (twists[n].velocity - before[n].velocity) * radii[n];
        assert!((change - force).norm() < 1e-9, "{n}: {change} {force}");
    }
}

#[test]
fn forces_are_what_contact_adds_to_velocities() {
    moves_as_forces_say::<2>();
    moves_as_forces_say::<3>();
}

#[test]
fn rattlers_are_peeled_off() {
    // A crystal with a particle on a string of two contacts more.
    let (domain, mut positions, mut contacts) = crystal::<2>(3, 1.0);
    let count = positions.len();
    positions.extend([Vector::<2>::repeat(2.0), Vector::<2>::repeat(2.1), Vector::<2>::repeat(4.0)]);
    contacts.extend([(0, count), (count, count + 1)].map(|(i, j)| contact(PairKey::new(i, j), 0.0)));
    let radii = vec![1.0; positions.len()];
    let network = ContactNetwork::new(&contacts, &positions, &radii, &domain).expect("good");
    let coordination = network.coordination();
    assert_eq!((coordination.mean_of_backbone, coordination.rattler_count), (4.0, 3));
    assert_eq!(network.clusters().size_distribution(), [(count + 2, 1), (1, 1)]);
}

fn refuses<const D: usize>(pair: PairKey) -> ContactError {
    let domain = Domain::<D>::default();
    ContactNetwork::new(&[contact(pair, 1.0)], &[Vector::zeros()], &[1.0], &domain).expect_err("nobody there")
}

#[test]
fn contacts_of_nobody_are_refused() {
    let pair = PairKey::new(0, 7);
    assert_eq!(refuses::<2>(pair), ContactError::UnknownParticle { pair, count: 1 });
    let pair = PairKey::wall(0, 2);
    assert_eq!(refuses::<3>(pair), ContactError::UnknownWall { pair, count: 0 });
}

#[test]
fn contacts_name_the_image_of_particles_that_have_left_the_period() {
    // The second disc is written two periods away; the pair is 2.1 apart, within the period and across its
    // border.
    let domain = Domain::default().with_period(0, 8.0);
    let (radii, drift) = ([1.0; 2], [Vector::zeros(); 2]);
    for (first, second, image) in [(1.0, 3.1 + 16.0, -2), (1.0, -1.1 - 16.0, 2), (7.9 - 8.0, 2.0, 0)] {
        let positions = [first, second].map(|x| Vector::<2>::new(x, 0.0));
        let towards = positions[1].x - 8.0 * 2.0 * (second / 16.0).round() - first;
        let mut twists = [1.0, -1.0].map(|sign| Twist {
            velocity: Vector::<2>::new(sign * towards.signum(), 0.0),
            ..Twist::default()
        });
        let step = StepGeometry {
            positions: &positions,
            radii: &radii,
            drift: &drift,
            velocity_weight: 0.1,
            dt: 0.1,
        };
        let mut model = PairContact::new(ContactParams::default()).within(domain.clone());
        model.correct(&step, &mut twists).expect("a good step");
        let found = model.contacts().first().unwrap_or_else(|| panic!("no contact of {first} and {second}"));
        assert_eq!(found.pair, PairKey::across(0, 1, [image, 0, 0]));
        assert!(found.gap.abs() < 1e-12 && (twists[0].velocity.x.abs() - 0.5).abs() < 1e-9, "{found:?}");
    }
}
