//! Matrices of pressures that one rank cannot invert.

use gluey_fem::ImplicitTree;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::{Ball, BallTree};
use gluey_parallel::{Communicator, Threads};
use gluey_stokes::PressureSpace;
use gluey_testkit::failing::within_a_minute;

use super::{Flowing, PressureCells, SchurInverse};
use crate::bodies::Shared;
use crate::cuts::equal_cuts;
use crate::pressures::SharedPressures;
use crate::space::LevelSpace;

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
            let space = LevelSpace::new(&mut tree, 4, &shared, None, None);
            let free = PressureSpace::around_surfaces(&space.pressure.map, |_| true, &[]);
            let pressures = SharedPressures::new(&mut tree, &shared, &space, &free);
            let scale = if ranks.rank() == 1 { factor } else { 1.0 };
            let unit = gluey_fem::ReferenceMatrices::<2>::new().pressure_mass;
            let matrix: Vec<f64> = unit.iter().map(|entry| scale * entry).collect();
            let masses = |visit: &mut dyn FnMut(usize, &[f64])| {
                space.part.own().for_each(|cell| visit(cell, &matrix));
            };
            let map = &space.velocity.map;
            let is_fixed = (0..map.node_count()).map(|node| map.is_on_boundary(node)).collect();
            let all = (0..map.cell_count()).collect();
            let flowing = Flowing { own: space.part.own().collect(), all, is_fixed };
            let cells = PressureCells { viscosity: 1.0, flowing: &flowing, masses: &masses };
            let made = SchurInverse::new(&tree, ranks, &space, &pressures, &cells);
            made.err().map(|error| error.to_string())
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
