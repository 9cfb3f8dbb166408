//! Orders of convergence to smooth flows without bodies.

use gluey_geom::{Aabb, Vector};
use gluey_stokes::FlowSolver;
use gluey_stokes::fem::{MeshError, TreeMesh};
use gluey_testkit::convergence_order;
use gluey_testkit::exact::{PolynomialFlow, StokesSolution, WavyPressure};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method};
use crate::norms::errors;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;

const FLOW: WavyPressure = WavyPressure(PolynomialFlow { viscosity: 1.0 });

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "manufactured",
    title: "Manufactured solutions without bodies",
    text: "The flow of the stream function g(x) g(y), g(t) = t^2 (1-t)^2 (in 3D the curl of g(x) g(y) g(z) (1, 1, 1)), with the \
           pressure xy - 1/4 (xyz - 1/8) plus the sum of cos(pi x_d), under the body force that makes it a solution; on \
           uniform meshes and on meshes with half the cell size in one corner (hanging nodes). Errors are relative, in the \
           mean square; orders are those between the two finest meshes. Q2-Q1 elements have order 3 in the velocity and 2 in the pressure.",
    keys: &["dimension", "hanging nodes", "h"],
    measures: &["velocity", "pressure"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(extent: Extent) -> Vec<Task> {
    let finest = if extent == Extent::Quick { 5 } else { 6 };
    let mut tasks = Vec::new();
    for (method, hanging) in iproduct!(METHODS, [false, true]) {
        tasks.extend((3..=finest).map(|level| task::<2>(method, hanging, level)));
        tasks.extend((2..finest).map(|level| task::<3>(method, hanging, level)));
    }
    tasks
}

fn task<const D: usize>(method: &'static Method, hanging: bool, level: u8) -> Task
where
    PolynomialFlow: StokesSolution<D>,
{
    let at = [D as f64, f64::from(u8::from(hanging)), 0.5f64.powi(level.into())];
    Task::new(method.name, &at, move || measure::<D>(method, mesh(hanging, level)?))
}

/// Cells of `2^-level`, with hanging nodes half that size in one corner.
fn mesh<const D: usize>(hanging: bool, level: u8) -> Result<TreeMesh<D>, MeshError> {
    if !hanging {
        return TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level);
    }
    TreeMesh::refine(Aabb::unit(), [1; D], [false; D], level + 1, |lower, _, l| {
        l < level || lower.iter().all(|&x| x < 0.45)
    })
}

fn measure<const D: usize>(method: &Method, mesh: TreeMesh<D>) -> Result<Vec<f64>, VerifyError>
where
    PolynomialFlow: StokesSolution<D>,
{
    let force = |x: &Vector<D>| FLOW.body_force(x);
    let boundary = |x: &Vector<D>| FLOW.velocity(x);
    let mut solver = FlowSolver::new(method.params::<D>(1e-9))?;
    let flow = solver.solve_forced(mesh, &[], &boundary, Some(&force))?;
    let errors = errors(&flow, &FLOW, &[]);
    Ok(vec![errors.velocity, errors.pressure / errors.pressure_scale])
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let order = |(dimension, hanging, &measure, method): (f64, f64, &&str, &Method)| {
        let mesh = if hanging == 0.0 { "uniform" } else { "hanging nodes" };
        let at = [("dimension", dimension), ("hanging nodes", hanging)];
        let points = points(table, measure, method.name, &at);
        let finest = &points[points.len().saturating_sub(2)..];
        let (sizes, errors): (Vec<f64>, Vec<f64>) = finest.iter().copied().unzip();
        let what = format!("order of the {measure}, {dimension}D, {mesh}");
        Number::new(NumberKind::Order, what, method.name, convergence_order(&sizes, &errors))
    };
    iproduct!([2.0, 3.0], [0.0, 1.0], CASE.measures, METHODS).map(order).collect()
}

fn points(table: &CaseTable, measure: &str, method: &str, at: &[(&str, f64)]) -> Vec<(f64, f64)> {
    table.values("h", method, at).into_iter().zip(table.values(measure, method, at)).collect()
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["*u* 2D", "*u* 3D", "*p* 2D", "*p* 3D"];
    Plot::of_methods("cell size *h*", "relative error", &things, |method, thing| {
        let at = [("dimension", [2.0, 3.0][thing % 2]), ("hanging nodes", 1.0)];
        points(table, CASE.measures[thing / 2], method, &at)
    })
}
