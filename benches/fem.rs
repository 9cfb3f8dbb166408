//! Timings of the finite-element core: meshes, numbering, and the bare cell kernels in both precisions.
//!
//! `cargo bench -p gluey-fem`; `docs/benchmarks.md` has a table of a run.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gluey_fem::kernel::{CellBatches, CellData, CubeKernel};
use gluey_fem::{Interpolation, NodeMap, TreeMesh};
use gluey_geom::{Aabb, Vector};
use gluey_linalg::Scalar;

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

/// The viscous kernel on all cells of a uniform mesh; throughput in velocity unknowns.
fn kernel<T: Scalar, const D: usize>(criterion: &mut Criterion, level: u8) {
    let mesh = uniform::<D>(level);
    let (velocity, pressure) = (NodeMap::new(&mesh, 2), NodeMap::new(&mesh, 1));
    let cells = (0..mesh.cell_count()).map(|c| CellData {
        velocity: velocity.cell(c),
        pressure: pressure.cell(c),
        viscous: 1.0,
        divergence: 1.0,
    });
    let (kernel, batches) = (CubeKernel::<T, D>::default(), CellBatches::<T>::new(cells));
    let dim = velocity.node_count() * D;
    let x: Vec<T> = (0..dim).map(|i| T::from_f64((0.7 * i as f64).sin())).collect();
    let mut y = vec![T::ZERO; dim];
    let mut group = criterion.benchmark_group(format!("kernel-{D}d-{dim}-dofs"));
    group.throughput(Throughput::Elements(dim as u64));
    let precision = 8 * size_of::<T>();
    group.bench_function(format!("f{precision}"), |b| b.iter(|| kernel.viscous(&batches, &x, &mut y)));
    group.finish();
}

fn all(criterion: &mut Criterion) {
    meshes::<2>(criterion, 9);
    meshes::<3>(criterion, 7);
    kernel::<f32, 2>(criterion, 8);
    kernel::<f64, 2>(criterion, 8);
    kernel::<f32, 3>(criterion, 5);
    kernel::<f64, 3>(criterion, 5);
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
