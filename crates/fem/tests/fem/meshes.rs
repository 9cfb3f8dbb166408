//! Meshes refined at random: balance, hanging nodes and transfers hold whatever the tree.

use std::sync::Arc;

use gluey_fem::cells::{CellData, CellOperator, Workspace};
use gluey_fem::element::{gauss_cube, value};
use gluey_fem::{Cell, Chunks, Interpolation, MeshError, NodeMap, TreeMesh};
use gluey_geom::{Aabb, Vector};
use gluey_linalg::vector::{dot, fill_pseudo_random};
use gluey_testkit::convergence_order;

/// Refines the cells around a few random points, each down to a random level.
fn random<const D: usize>(seed: u64, finest: u8, periodic: bool) -> TreeMesh<D> {
    let mut numbers = vec![0f64; 4 * (D + 1)];
    fill_pseudo_random(seed, &mut numbers);
    let points: Vec<(Vector<D>, f64)> = numbers
        .chunks_exact(D + 1)
        .map(|n| (Vector::from_fn(|d, _| n[d].abs().fract()), 1.0 + n[D].abs() * f64::from(finest)))
        .collect();
    TreeMesh::refine(Aabb::unit(), [1; D], [periodic; D], finest, |lower, h, level| {
        let center = lower + Vector::repeat(0.5 * h);
        level < 1 || points.iter().any(|(x, depth)| f64::from(level) < *depth && (center - x).amax() < h)
    })
    .unwrap()
}

/// All offsets to neighbours across faces, edges and corners.
fn offsets<const D: usize>() -> impl Iterator<Item = [i32; D]> {
    (0..3i32.pow(D as u32)).map(|k| std::array::from_fn(|d| k / 3i32.pow(d as u32) % 3 - 1))
}

fn neighbours_differ_by_one_level<const D: usize>(seed: u64, periodic: bool) {
    let mesh = random::<D>(seed, 5, periodic);
    let volume: f64 = mesh.cells().iter().map(|c| mesh.size(c.level).powi(D as i32)).sum();
    assert!((volume - 1.0).abs() < 1e-12);
    for (index, cell) in mesh.cells().iter().enumerate() {
        assert_eq!(mesh.find(cell), Some(index));
        for offset in offsets::<D>() {
            let Some(neighbour) = mesh.neighbour(cell, &offset) else {
                assert!(!periodic, "a periodic box has no border");
                continue;
            };
            if let Some(found) = mesh.find_covering(&neighbour) {
                assert!(mesh.cells()[found].level + 1 >= cell.level);
            }
        }
    }
}

#[test]
fn random_trees_are_balanced() {
    for seed in 0..8 {
        for periodic in [false, true] {
            neighbours_differ_by_one_level::<2>(seed, periodic);
            neighbours_differ_by_one_level::<3>(seed, periodic);
        }
    }
}

/// A polynomial of the element's degree in each direction.
fn polynomial<const D: usize>(x: &Vector<D>, degree: i32) -> f64 {
    (0..D).map(|d| 0.3 + (1.0 + d as f64) * x[d].powi(degree) - 0.4 * x[d]).product()
}

fn polynomials_are_continuous<const D: usize>(seed: u64) {
    let mesh = random::<D>(seed, 5, false);
    for degree in [1, 2] {
        let nodes = NodeMap::new(&mesh, degree);
        let exact = |n: usize| polynomial(&nodes.point(n), degree as i32);
        let mut field: Vec<f64> = (0..nodes.node_count()).map(exact).collect();
        for constraint in nodes.constraints() {
            let sum: f64 = constraint.masters.iter().map(|m| m.1).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            assert!(constraint.masters.iter().all(|m| !nodes.is_hanging(m.0 as usize)));
            field[constraint.node as usize] = f64::NAN;
        }
        nodes.distribute(1, |w| w, &mut field);
        for (n, value) in field.iter().enumerate() {
            assert!((value - exact(n)).abs() < 1e-12, "degree {degree}, node {n}");
        }
    }
}

#[test]
fn hanging_nodes_of_random_trees_keep_polynomials_continuous() {
    for seed in 0..8 {
        polynomials_are_continuous::<2>(seed);
        polynomials_are_continuous::<3>(seed);
    }
}

fn transfers_between_levels_fit<const D: usize>(seed: u64) {
    let fine = random::<D>(seed, 5, false);
    let coarse = fine.coarsened(fine.max_level() - 1);
    let (to, from) = (NodeMap::new(&fine, 2), NodeMap::new(&coarse, 2));
    let mut transfer = Interpolation::new(&coarse, from.clone(), &fine, &to);
    assert_eq!(transfer.fine_count(), to.node_count());

    let quadratic: Vec<f32> = (0..from.node_count()).map(|n| polynomial(&from.point(n), 2) as f32).collect();
    let mut moved = vec![0f32; to.node_count()];
    transfer.prolong::<1>(&quadratic, &mut moved);
    for n in (0..to.node_count()).filter(|&n| !to.is_hanging(n)) {
        let error = f64::from(moved[n]) - polynomial(&to.point(n), 2);
        assert!(error.abs() < 1e-5, "node {n}: {error:e}");
    }

    let (mut x, mut y) = (vec![0f32; D * from.node_count()], vec![0f32; D * to.node_count()]);
    fill_pseudo_random(seed + 1, &mut x);
    fill_pseudo_random(seed + 2, &mut y);
    let (mut up, mut down) = (vec![0f32; y.len()], vec![0f32; x.len()]);
    transfer.prolong::<D>(&x, &mut up);
    transfer.restrict::<D>(&y, &mut down);
    let scale = dot(&up, &up).sqrt() * dot(&y, &y).sqrt();
    assert!((dot(&up, &y) - dot(&x, &down)).abs() < 1e-6 * scale);
}

#[test]
fn prolongation_is_exact_and_restriction_its_transpose() {
    for seed in 0..4 {
        transfers_between_levels_fit::<2>(seed);
        transfers_between_levels_fit::<3>(seed);
    }
}

/// L2 error of the interpolant of degree 2 of a smooth function, hanging nodes set from their masters.
fn interpolation_error<const D: usize>(level: u8) -> f64 {
    let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], level + 1, |lower, _, l| {
        l < level || lower.iter().all(|&x| x < 0.45)
    })
    .unwrap();
    let nodes = NodeMap::new(&mesh, 2);
    let f = |x: &Vector<D>| (0..D).map(|d| (2.0 * x[d] + 0.3 * d as f64).sin()).product::<f64>();
    let mut field: Vec<f64> = (0..nodes.node_count()).map(|n| f(&nodes.point(n))).collect();
    nodes.distribute(1, |w| w, &mut field);
    let mut square = 0.0;
    for (index, cell) in mesh.cells().iter().enumerate() {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        for (at, weight) in gauss_cube::<D>(4) {
            let local = nodes.cell(index).iter().enumerate();
            let found: f64 = local.map(|(i, &n)| value::<D>(2, i, &at) * field[n as usize]).sum();
            let x = lower + Vector::from_fn(|d, _| h * at[d]);
            square += weight * h.powi(D as i32) * (found - f(&x)).powi(2);
        }
    }
    square.sqrt()
}

fn interpolation_is_of_third_order<const D: usize>(levels: &[u8]) {
    let sizes: Vec<f64> = levels.iter().map(|&l| 0.5f64.powi(l.into())).collect();
    let errors: Vec<f64> = levels.iter().map(|&l| interpolation_error::<D>(l)).collect();
    let order = convergence_order(&sizes, &errors);
    assert!((order - 3.0).abs() < 0.15, "{D}D: order {order}, {errors:?}");
}

#[test]
fn smooth_functions_are_interpolated_at_order_three() {
    interpolation_is_of_third_order::<2>(&[3, 4, 5, 6]);
    interpolation_is_of_third_order::<3>(&[2, 3, 4]);
}

/// The viscous operator with hanging nodes: symmetric, and without work on rigid motions.
fn operators_on_random_trees_are_symmetric<const D: usize>(seed: u64) {
    let mesh = random::<D>(seed, 4, false);
    let (velocity, pressure) = (NodeMap::new(&mesh, 2), NodeMap::new(&mesh, 1));
    let cells = (0..mesh.cell_count()).map(|c| CellData {
        cell: c,
        viscous: (1.0 + c as f64 % 3.0) * mesh.size(mesh.cells()[c].level).powi(D as i32 - 2),
        divergence: 1.0,
        points: &[],
    });
    let chunks = Arc::new(Chunks::new(&velocity, &pressure));
    let operator = CellOperator::<f64, D>::new(&chunks, &velocity, cells, 1, &[], 0);
    let apply = |x: &[f64]| {
        let mut y = vec![0.0; x.len()];
        operator.viscous(x, &mut y, &mut Workspace::default());
        y
    };
    let dim = D * velocity.node_count();
    let (mut a, mut b) = (vec![0.0; dim], vec![0.0; dim]);
    fill_pseudo_random(seed + 3, &mut a);
    fill_pseudo_random(seed + 4, &mut b);
    for node in (0..velocity.node_count()).filter(|&n| velocity.is_hanging(n) || velocity.is_on_boundary(n)) {
        a[node * D..][..D].fill(0.0);
        b[node * D..][..D].fill(0.0);
    }
    let (ka, kb) = (apply(&a), apply(&b));
    let energy = dot(&a, &ka);
    assert!(energy > 0.0);
    assert!((dot(&b, &ka) - dot(&a, &kb)).abs() < 1e-12 * energy);
    let mut rotation = vec![0.0; dim];
    for (n, u) in rotation.chunks_exact_mut(D).enumerate() {
        let x = velocity.point(n);
        (u[0], u[1]) = (0.2 - x[1], x[0] - 0.1);
    }
    assert!(apply(&rotation).iter().all(|force| force.abs() < 1e-12));
}

#[test]
fn viscous_operators_are_symmetric_and_blind_to_rigid_motions() {
    for seed in 0..4 {
        operators_on_random_trees_are_symmetric::<2>(seed);
        operators_on_random_trees_are_symmetric::<3>(seed);
    }
}

#[test]
fn meshes_that_cannot_be_are_refused() {
    for level in [22, 30, 64, 255] {
        let refused = TreeMesh::<2>::refine(Aabb::unit(), [1; 2], [false; 2], level, |_, _, _| false);
        assert!(matches!(refused, Err(MeshError::TooFine { .. })), "level {level}");
    }
    for upper in [Vector::<2>::new(f64::NAN, 1.0), Vector::<2>::new(0.0, 0.0), Vector::<2>::new(1.0, 1.1)] {
        let domain = Aabb { lower: Vector::zeros(), upper };
        let refused = TreeMesh::<2>::uniform(domain, [1, 1], [false; 2], 2);
        assert!(matches!(refused, Err(MeshError::NotCubic { .. })), "{upper:?}");
    }
    let refused = TreeMesh::<2>::uniform(Aabb::unit(), [0, 0], [false; 2], 2);
    assert!(matches!(refused, Err(MeshError::NotCubic { .. })));
}

/// A mesh asked to be finer than anything in it has the cells of one that is not.
#[test]
fn cutting_unused_levels_changes_no_cell() {
    let deep = TreeMesh::<2>::refine(Aabb::unit(), [1, 1], [false; 2], 8, |_, _, level| level < 3).unwrap();
    let cut = deep.coarsened(3);
    assert_eq!(deep.max_level(), 8);
    assert_eq!(cut.max_level(), 3);
    let same: &[Cell<2>] = cut.cells();
    assert_eq!(deep.cells(), same);
    let (a, b) = (NodeMap::new(&deep, 2), NodeMap::new(&cut, 2));
    assert!((0..a.node_count()).all(|n| (a.point(n) - b.point(n)).norm() < 1e-15));
}
