//! Timings of the finite-element core: meshes, numbering, and the bare kernels of whole and of cut cells in
//! both precisions.
//!
//! `cargo bench -p gluey-fem`; `docs/benchmarks.md` has a table of a run.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gluey_fem::cells::{CellData, CellOperator, CellScalar, CutOperator, CutPiece, Workspace};
use gluey_fem::cut::{BallInCell, CutMoments};
use gluey_fem::element::node_count;
use gluey_fem::{Chunks, Interpolation, NodeMap, TreeMesh};
use gluey_geom::{Aabb, Dim, Vector};

/// A mesh refined towards the centre of the box.
fn graded<const D: usize>(finest: u8) -> TreeMesh<D> {
    let center = Vector::<D>::repeat(0.5);
    TreeMesh::refine(Aabb::unit(), [1; D], [false; D], finest, |lower, h, level| {
        level < 3 || (lower + Vector::repeat(0.5 * h) - center).norm() < 3.0 * h
    })
    .expect("the unit box is a cube")
}

fn uniform<const D: usize>(level: u8) -> TreeMesh<D> {
    TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).expect("the unit box is a cube")
}

fn meshes<const D: usize>(criterion: &mut Criterion, finest: u8) {
    let mesh = graded::<D>(finest);
    let mut group = criterion.benchmark_group(format!("mesh-{D}d-{}-cells", mesh.cell_count()));
    group.throughput(Throughput::Elements(mesh.cell_count() as u64));
    group.bench_function("refine", |b| b.iter(|| graded::<D>(black_box(finest))));
    group.bench_function("number", |b| b.iter(|| NodeMap::new(black_box(&mesh), 2)));
    let coarse = mesh.coarsened(finest - 1);
    let (fine_nodes, coarse_nodes) = (NodeMap::new(&mesh, 2), Arc::new(NodeMap::new(&coarse, 2)));
    group.bench_function("interpolate", |b| {
        b.iter(|| Interpolation::new(black_box(&coarse), coarse_nodes.clone(), &mesh, &fine_nodes));
    });
    group.finish();
}

/// The viscous and the Stokes operator on all cells of a uniform mesh, every `varying`-th with a viscosity
/// given at `4^D` points; throughput in unknowns.
fn operator<T: CellScalar, const D: usize>(criterion: &mut Criterion, level: u8, varying: usize) {
    const QUADRATURE: usize = 4;
    let mesh = uniform::<D>(level);
    let (velocity, pressure) = (NodeMap::new(&mesh, 2), NodeMap::new(&mesh, 1));
    let chunks = Arc::new(Chunks::new(&velocity, &pressure));
    let eta = vec![1.0; QUADRATURE.pow(D as u32)];
    let cells = (0..mesh.cell_count()).map(|cell| {
        let points = if cell % varying == varying - 1 { eta.as_slice() } else { &[] };
        CellData { cell, viscous: 1.0, divergence: 1.0, points }
    });
    let operator = CellOperator::<T, D>::new(&chunks, &velocity, cells, QUADRATURE, &[], 0);
    let wave = |dim: usize| (0..dim).map(|i| T::from_f64((0.7 * i as f64).sin())).collect::<Vec<T>>();
    let (x, p) = (wave(operator.velocity_dim()), wave(operator.pressure_dim()));
    let (mut y, mut q, mut work) = (x.clone(), p.clone(), Workspace::default());
    let kind = if varying == usize::MAX { "constant" } else { "variable" };
    let name = format!("cells-{D}d-f{}-{kind}", 8 * size_of::<T>());
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(x.len() as u64));
    group.bench_function("viscous", |b| b.iter(|| operator.viscous(&x, &mut y, &mut work)));
    group.throughput(Throughput::Elements((x.len() + p.len()) as u64));
    group.bench_function("stokes", |b| b.iter(|| operator.stokes(&x, &p, &mut y, &mut q, &mut work)));
    group.finish();
}

/// The Stokes operator on pieces of cut cells, with nodes of their own; throughput in pieces.
fn cut<T: CellScalar, const D: usize>(criterion: &mut Criterion) {
    const PIECES: usize = 1296;
    const RADIUS: f64 = 2.3;
    let center = std::array::from_fn(|d| 1.9 - 0.3 * d as f64);
    let moments = CutMoments::new(&[BallInCell { center, radius: RADIUS }]);
    let penalty: Vec<f64> = moments.surfaces[0].area.iter().map(|area| 20.0 * area).collect();
    let (n, m) = (node_count::<D>(2), node_count::<D>(1));
    let nodes: Vec<u32> = (0..(PIECES * n) as u32).collect();
    let piece = |k: usize| CutPiece {
        nodes: &nodes[k * n..][..n],
        pressures: &nodes[k * m..][..m],
        body: k as u32,
        origin: center.map(|x| -x / RADIUS),
        edge: 1.0 / RADIUS,
        viscous: 1.0,
        pressure: 1.0,
        volume: &moments.volume,
        normal: &moments.surfaces[0].normal,
        penalty: &penalty,
    };
    let pieces: Vec<CutPiece<'_, D>> = (0..PIECES).map(piece).collect();
    let operator = CutOperator::<T, D>::new(pieces.into_iter(), [PIECES * n, PIECES * m, PIECES]);
    let wave = |dim: usize| (0..dim).map(|i| T::from_f64((0.7 * i as f64).sin())).collect::<Vec<T>>();
    let (x, p) = (wave(PIECES * (n * D + Dim::<D>::RIGID)), wave(PIECES * m));
    let (mut y, mut q, mut work) = (x.clone(), p.clone(), Vec::new());
    let mut group = criterion.benchmark_group(format!("cut-cells-{D}d-f{}", 8 * size_of::<T>()));
    group.throughput(Throughput::Elements(PIECES as u64));
    group.bench_function("stokes", |b| b.iter(|| operator.add([&x, &p], [&mut y, &mut q], &mut work)));
    group.finish();
}

fn all(criterion: &mut Criterion) {
    meshes::<2>(criterion, 9);
    meshes::<3>(criterion, 7);
    for varying in [usize::MAX, 10] {
        operator::<f32, 2>(criterion, 8, varying);
        operator::<f64, 2>(criterion, 8, varying);
        operator::<f32, 3>(criterion, 5, varying);
        operator::<f64, 3>(criterion, 5, varying);
    }
    cut::<f32, 2>(criterion);
    cut::<f64, 2>(criterion);
    cut::<f32, 3>(criterion);
    cut::<f64, 3>(criterion);
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    targets = all
}
criterion_main!(benches);
