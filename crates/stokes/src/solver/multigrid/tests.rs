//! Properties of the levels that the Krylov method relies on.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_linalg::{LinOp, vector};

use crate::film::Lubrication;
use crate::formulation::{Formulation, Problem};

use super::MultigridSolver;
use crate::solver::SaddleSolver;

/// Two balls on a mesh with hanging nodes.
fn problem<const D: usize>(formulation: Formulation) -> Problem<D> {
    let balls = [0.3, 0.65].map(|x| Ball::new(Vector::<D>::repeat(x), 0.15));
    let mesh = TreeMesh::refine(Aabb::unit(), [1; D], [false; D], 4, |lower, _, level| {
        level < 3 || lower.iter().all(|&x| x < 0.8)
    })
    .unwrap();
    Problem::new(mesh, &balls, 1.0, formulation).unwrap()
}

fn level_operators_are_symmetric<const D: usize>(formulation: Formulation) {
    let mut solver = MultigridSolver::default();
    solver.prepare(&problem::<D>(formulation)).unwrap();
    let mut levels = solver.cycle.unwrap().levels;
    let finest = levels.len() - 1;
    for (index, level) in levels.iter_mut().enumerate() {
        let space = &level.space;
        // The finest level leaves its operator to the surfaces or to a solid that is not factorised.
        let Some(operator) = level.relaxation.as_mut().map(|r| &mut r.operator) else {
            assert!(index == finest && (D == 3 || matches!(formulation, Formulation::Unfitted { .. })));
            continue;
        };
        let [x, y] = [1, 2].map(|seed| {
            let mut x = vec![0f32; operator.dim()];
            vector::fill_pseudo_random(seed, &mut x);
            space.reduce(&mut x);
            x
        });
        let (mut ax, mut ay) = (x.clone(), y.clone());
        operator.apply(&x, &mut ax);
        operator.apply(&y, &mut ay);
        let scale = vector::norm(&x) * vector::norm(&ay);
        let difference = (vector::dot(&x, &ay) - vector::dot(&y, &ax)).abs() / scale;
        assert!(difference < 1e-6, "{D}D, {formulation:?}, level {index}: {difference:e}");
        assert!(vector::dot(&x, &ax) > 0.0);
    }
}

#[test]
fn operators_of_all_levels_are_symmetric_to_round_off() {
    let unfitted = Formulation::Unfitted { lubrication: Lubrication::Deficit };
    let all = [
        unfitted,
        #[cfg(feature = "paper")]
        Formulation::Paper(crate::PaperParams::default()),
    ];
    for formulation in all {
        level_operators_are_symmetric::<2>(formulation);
        level_operators_are_symmetric::<3>(formulation);
    }
}
