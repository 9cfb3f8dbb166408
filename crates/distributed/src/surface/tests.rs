//! Matrices of pressures that one rank cannot invert.

use gluey_fem::{Cell, ImplicitTree};
use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::{Communicator, Threads};
use gluey_stokes::Lubrication;
use gluey_stokes::part::PartMethod;
use gluey_testkit::failing::within_a_minute;

use super::space::PartHalos;
use crate::bodies::Shared;
use crate::cuts::equal_cuts;
use crate::levels::Levels;
use crate::space::GhostLayer;

/// What ranks say of masses that one of them multiplies by `factor`.
fn with_masses_of_one_rank(factor: f64) -> Vec<Option<String>> {
    let run = move || {
        Threads::run(3, |ranks| {
            let wants = |_: &Vector<2>, _: f64, _: u8| true;
            let mut tree = ImplicitTree::new(Aabb::unit(), [1; 2], [false; 2], 4, &wants).unwrap();
            let cuts = equal_cuts(&tree, ranks);
            let none: [Ball<2>; 0] = [];
            let bodies = BallTree::new(&none);
            let shared = Shared { cuts: &cuts, ranks, bodies: &bodies, held: &[] };
            let around = GhostLayer { rings: 1, spreads: &|_: &Cell<2>| false };
            let levels = Levels::new(&mut tree, &shared, 1.0, &around).unwrap();
            let viscosity = if ranks.rank() == 1 { factor.recip() } else { 1.0 };
            let method = PartMethod::new(Lubrication::None);
            let mut problem = method.problem(&levels.discretisation, &none, viscosity, &|_| true).unwrap();
            let halos = PartHalos::new(&mut tree, &shared, &levels.finest, &problem);
            problem.system.share(halos.of_system);
            problem.schur_inverse(&levels.cycle).err().map(|error| error.to_string())
        })
    };
    within_a_minute("masses", run).unwrap()
}

#[test]
fn masses_that_one_rank_cannot_invert_are_an_error_of_all() {
    assert_eq!(with_masses_of_one_rank(1.0), [None, None, None]);
    for factor in [-1.0, f64::NAN] {
        let said = with_masses_of_one_rank(factor);
        assert!(said.iter().all(Option::is_some), "{factor}: {said:?}");
    }
}
