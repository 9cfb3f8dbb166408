use std::f64::consts::PI;
use std::sync::Arc;

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Spin, Twist};
use gluey_levelset::Ball;
use gluey_linalg::LinOp;
use nalgebra::DMatrix;

use super::super::{Lubrication, thin_films};
use super::*;
use crate::operator::{StokesSystem, SystemOperator};
use crate::space::Discretisation;

/// Two bodies at this gap, in a general direction.
fn pair<const D: usize>(radii: [f64; 2], gap: f64) -> [Ball<D>; 2] {
    let n = Vector::<D>::from_fn(|d, _| [0.7, -0.4, 0.5][d]).normalize();
    let middle = Vector::<D>::repeat(0.5);
    [Ball::new(middle - n * radii[0], radii[0]), Ball::new(middle + n * (radii[1] + gap), radii[1])]
}

fn space_of<const D: usize>(bodies: &[Ball<D>]) -> VelocitySpace<D> {
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], 2).unwrap();
    let discretisation = Discretisation::new(mesh);
    let nowhere = vec![None; discretisation.velocity.node_count()];
    VelocitySpace::around_surfaces(&discretisation, bodies, &nowhere, Vec::new())
}

fn coupling<const D: usize>(bodies: &[Ball<D>], cell_size: f64) -> (VelocitySpace<D>, FilmCoupling<D>) {
    coupling_with(bodies, cell_size, Vec::new())
}

fn coupling_with<const D: usize>(
    bodies: &[Ball<D>],
    cell_size: f64,
    flows: Vec<FilmFlow<D>>,
) -> (VelocitySpace<D>, FilmCoupling<D>) {
    let space = space_of(bodies);
    let heights = Lubrication::Deficit.heights::<D>(cell_size);
    let films = thin_films(bodies, &Aabb::unit(), &heights);
    let flows = vec![flows; films.len()];
    let coupling = FilmCoupling::new(&space, films, flows, &heights, 1.0);
    (space, coupling)
}

/// `s B V` for twists.
fn motions<const D: usize>(bodies: &[Ball<D>], cell_size: f64, twists: &[Twist<D>]) -> Vec<f64> {
    let (space, coupling) = coupling(bodies, cell_size);
    let (mut x, mut z) = (vec![0.0; space.dim()], vec![0.0; coupling.dim()]);
    twists.iter().enumerate().for_each(|(body, twist)| space.set_twist(&mut x, body, twist));
    let at_rest = vec![0.0; coupling.dim()];
    let y = [&mut *vec![0.0; space.dim()], &mut [], &mut z];
    coupling.add([&x, &[], &at_rest], y, &mut Scratch::<f64>::default());
    z
}

fn spin<const D: usize>() -> Spin<D> {
    let mut spin = Dim::<D>::zero_spin();
    (0..Dim::<D>::ROT).for_each(|k| spin[k] = 0.3 - 0.5 * k as f64);
    spin
}

fn moving_as_one_is_free<const D: usize>() {
    let (bodies, cell_size) = (pair::<D>([0.07, 0.11], 0.004), 0.02);
    let velocity = Vector::<D>::from_fn(|d, _| 0.4 - 0.3 * d as f64);
    let rigid = bodies.map(|body| Twist {
        velocity: velocity + Dim::<D>::cross_spin(&spin::<D>(), body.center()),
        spin: spin::<D>(),
    });
    let size = motions(&bodies, cell_size, &[rigid[0], Twist::default()])
        .iter()
        .map(|m| m.abs())
        .fold(0.0, f64::max);
    assert!(size > 0.1);
    let motions = motions(&bodies, cell_size, &rigid);
    assert_eq!(motions.len(), FilmCoupling::<D>::MODES);
    assert!(motions.iter().all(|m| m.abs() < 1e-12 * size), "{motions:?}");
}

#[test]
fn a_pair_that_moves_as_one_has_no_force() {
    moving_as_one_is_free::<2>();
    moving_as_one_is_free::<3>();
}

/// `B^T R B` in `(U_1, w_1, U_2, w_2)`.
fn resistance<const D: usize>(bodies: &[Ball<D>], cell_size: f64) -> DMatrix<f64> {
    let count = bodies.len() * Dim::<D>::RIGID;
    let columns: Vec<Vec<f64>> = (0..count)
        .map(|k| {
            let mut twists = vec![Twist::default(); bodies.len()];
            let (body, k) = (k / Dim::<D>::RIGID, k % Dim::<D>::RIGID);
            match k.checked_sub(D) {
                Some(k) => twists[body].spin[k] = 1.0,
                None => twists[body].velocity[k] = 1.0,
            }
            motions(bodies, cell_size, &twists)
        })
        .collect();
    let rows = DMatrix::from_fn(columns[0].len(), count, |i, j| columns[j][i]);
    rows.transpose() * rows
}

/// The singular terms of Jeffrey and Onishi (1984): what grows with `ln(1/gap)` for spheres of any radii.
#[test]
fn spheres_resist_as_jeffrey_and_onishi_say() {
    for (a, b) in [(0.1, 0.1), (0.12, 0.06), (0.05, 0.15)] {
        let (near, far) = (1e-8, 1e-7);
        let [first, second] =
            [near, far].map(|gap| resistance::<3>(&pair([a, b], gap * a), 1e-2 * a) / 10f64.ln());
        let grown = first - second;
        let n = (pair::<3>([a, b], 0.0)[1].center() - pair::<3>([a, b], 0.0)[0].center()).normalize();
        let t = n.cross(&Vector::<3>::new(0.0, 0.0, 1.0)).normalize();
        let s = n.cross(&t);
        let entry = |row: usize, column: usize, left: &Vector<3>, right: &Vector<3>| -> f64 {
            let block = grown.view((3 * row, 3 * column), (3, 3));
            (left.transpose() * block * right)[(0, 0)]
        };
        let l = b / a;
        let force = 6.0 * PI * a * 4.0 * l * (2.0 + l + 2.0 * l * l) / (15.0 * (1.0 + l).powi(3));
        let torque = 4.0 * PI * a * a * l * (4.0 + l) / (5.0 * (1.0 + l).powi(2));
        let [own, other] =
            [0.4 * l / (1.0 + l) * 8.0 * a.powi(3), 0.8 * l * l / (1.0 + l).powi(4) * (a + b).powi(3)];
        for (found, expected) in [
            (entry(0, 0, &t, &t), force),
            (entry(0, 2, &t, &t), -force),
            (entry(1, 0, &s, &t).abs(), torque),
            (entry(1, 1, &s, &s), PI * own),
            (entry(1, 3, &s, &s), PI * other),
        ] {
            assert!((found / expected - 1.0).abs() < 1e-4, "{a} {b}: {found} {expected}");
        }
        // Along the line the leading term grows like 1 / gap; what is left like the logarithm.
        let squeezed = |gap: f64| 1.5 * PI * (2.0 * a * b / (a + b)).powi(2) / (gap * a);
        let logarithm = entry(0, 0, &n, &n) - (squeezed(near) - squeezed(far)) / 10f64.ln();
        let expected = 6.0 * PI * a * l * (1.0 + 7.0 * l + l * l) / (5.0 * (1.0 + l).powi(3));
        // Rounding of the gap is 1e-9 of the leading term.
        assert!((logarithm - expected).abs() < 1e-6 * squeezed(near), "{logarithm} {expected}");
        let asymmetry = (&grown - grown.transpose()).abs().max();
        assert!(asymmetry < 1e-12 * grown.abs().max(), "{asymmetry}");
    }
}

fn forces_dissipate<const D: usize>() {
    let near_wall = Ball::new(Vector::<D>::from_fn(|d, _| if d == 1 { 0.055 } else { 0.4 }), 0.05);
    let bodies = [pair::<D>([0.07, 0.11], 0.004), [near_wall; 2]].concat()[..3].to_vec();
    let (space, coupling) = coupling(&bodies, 0.02);
    assert_eq!(coupling.dim(), 2 * FilmCoupling::<D>::MODES);
    let g: Vec<f64> = (0..coupling.dim()).map(|k| (1.0 + k as f64).sin()).collect();
    let forces = coupling.forces(&space, &g);
    let mut load = vec![0.0; space.dim()];
    coupling.add_loads(&g, &mut load);
    for body in 0..3 {
        let of_body = |force: &FilmForce<D>| {
            (0..2).filter(|&side| force.film.side(side) == Some(body)).map(|side| force.wrenches[side]).next()
        };
        let sum = forces.iter().filter_map(of_body).fold(Wrench::default(), |sum, wrench| sum + wrench);
        let rest = sum + space.wrench(&load, body);
        assert!(rest.force.norm() < 1e-12, "{body}: {rest:?}");
    }
    let [first, second] = forces[0].wrenches;
    assert!(forces[0].film.partner == super::super::Partner::Body(1));
    assert!((first.force + second.force).norm() < 1e-12 * first.force.norm());
    assert!(forces[0].moment(0).norm() > 0.0);
}

#[test]
fn forces_are_those_of_the_rows_and_opposite() {
    forces_dissipate::<2>();
    forces_dissipate::<3>();
}

/// Forces that were kept are those of the same films, and of no other ones.
fn kept_forces_come_back<const D: usize>() {
    let flow = FilmFlow {
        nodes: Vec::new(),
        boundary: Vec::new(),
        total: Vector::repeat(0.02),
        first: Matrix::zeros(),
        approach: 0.0,
        turning: 1e-4,
    };
    let (_, coupling) = coupling_with(&pair::<D>([0.07, 0.11], 0.004), 0.02, vec![flow; D - 1]);
    assert_eq!(coupling.dim(), FilmCoupling::<D>::MODES);
    assert!(coupling.modes[0].iter().filter(|mode| mode.is_flow && mode.lacks > 0.0).count() == D - 1);
    // Forces of what the mesh does not lack are zero.
    let force = |(k, scale): (usize, &f64)| if *scale > 0.0 { 0.4 + (k as f64).sin() } else { 0.0 };
    let g: Vec<f64> = coupling.scales.iter().enumerate().map(force).collect();
    let kept = coupling.kept(&g);
    assert_eq!(kept.len(), FilmCoupling::<D>::KEPT);
    let mut found = vec![0.0; g.len()];
    coupling.restore(&kept, &mut found);
    assert!(g.iter().zip(&found).all(|(g, found)| (g - found).abs() < 1e-12), "{g:?} {found:?}");
    // Of another body, and of an image on the other side.
    for (number, value) in [(0, 1.0), (1, 0.0), (2, -kept[2])] {
        let mut other = kept.clone();
        other[number] = value;
        other[3] = if number == 2 { -kept[3] } else { kept[3] };
        let mut untouched = vec![7.0; g.len()];
        coupling.restore(&other, &mut untouched);
        assert!(untouched.iter().all(|g| *g == 7.0), "{number}");
    }
}

#[test]
fn forces_of_films_are_kept_from_mesh_to_mesh() {
    kept_forces_come_back::<2>();
    kept_forces_come_back::<3>();
}

/// In the rows of a closed film velocities that differ by a unit of rounding are the same, and no others.
fn rounding_is_no_residual<const D: usize>() {
    let (space, coupling) = coupling(&pair::<D>([0.1, 0.1], 0.0), 0.05);
    let (rows, twists) = (coupling.dim(), space.full_dim()..space.dim());
    let mut system = StokesSystem::new(space, 1.0);
    system.terms.push(Arc::new(coupling));
    let mut operator = SystemOperator::new(&system);
    let first = system.dim() - rows;
    let mut x: Vec<f64> = (0..system.dim()).map(|k| (k as f64).sin()).collect();
    x[first..].fill(0.0);
    let mut b = vec![0.0; x.len()];
    operator.apply(&x, &mut b);
    let mut residual = |b: &[f64], x: &[f64]| {
        let mut r = vec![0.0; x.len()];
        operator.apply(x, &mut r);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        let before = r.clone();
        let is_cleared = operator.clear_rounding(b, x, &mut r);
        assert_eq!(before[..first], r[..first]);
        (before[first..].to_vec(), is_cleared.then(|| r[first..].to_vec()))
    };
    x[twists].iter_mut().for_each(|v| *v *= 1.0 + f64::EPSILON);
    let (before, cleared) = residual(&b, &x);
    let of_rounding = before.iter().map(|r| r.abs()).fold(0.0, f64::max);
    assert!(of_rounding > 0.0 && cleared == Some(vec![0.0; rows]), "{before:?}");
    b[first] += 100.0 * of_rounding;
    let (before, cleared) = residual(&b, &x);
    assert_eq!(cleared.unwrap_or_else(|| before.clone())[0], before[0]);
}

#[test]
fn rounding_in_closed_films_is_no_residual() {
    rounding_is_no_residual::<2>();
    rounding_is_no_residual::<3>();
}
