//! Matrices of pressures that one rank cannot invert.

use gluey_fem::{Cell, Cuts, ImplicitTree, ReferenceMatrices};
use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::{Communicator, Threads};
use gluey_testkit::failing::within_a_minute;

use super::{GhostLayer, levels};
use crate::film::Lubrication;
use crate::formulation::{Method, Unfitted};
use crate::operator::Elements;
use crate::precondition::schur::SchurInverse;

/// What ranks say of masses that one of them multiplies by `factor`.
fn with_masses_of_one_rank(factor: f64) -> Vec<Option<String>> {
    let run = move || {
        Threads::run(3, |ranks| {
            let wants = |_: &Vector<2>, _: f64, _: u8| true;
            let mut tree = ImplicitTree::new(Aabb::unit(), [1; 2], [false; 2], 4, &wants).unwrap();
            let cuts = Cuts::equal(&mut tree, ranks.size());
            let none: [Ball<2>; 0] = [];
            let bodies = BallTree::new(&none);
            let around = GhostLayer { rings: 1, spreads: &|_: &Cell<2>| false };
            let meshes = levels(&mut tree, ranks, &cuts, &bodies, &around);
            let viscosity = if ranks.rank() == 1 { factor.recip() } else { 1.0 };
            let finest = &meshes[meshes.len() - 1];
            let (mut system, _) =
                Unfitted::new(Lubrication::None).discretised(finest, &none, viscosity).unwrap();
            system.share();
            let elements = Elements::new(&system, ReferenceMatrices::<2>::VELOCITY);
            SchurInverse::new(&meshes, &elements, None).err().map(|error| error.to_string())
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
