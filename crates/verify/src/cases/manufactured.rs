//! Orders of convergence to smooth flows without bodies.

use gluey_geom::{Aabb, Dim, Space, Vector};
use gluey_stokes::FlowSolver;
use gluey_stokes::fem::{MeshError, TreeMesh};
use gluey_testkit::convergence_order;
use gluey_testkit::exact::{PolynomialFlow, StokesSolution, WavyPressure};

use crate::case::{Case, Extent, Table, Tables, Task, VerifyError};
use crate::method::{METHODS, Method};
use crate::norms::errors;
use crate::number::{Kind, Number};
use crate::plot::Plot;

const FLOW: WavyPressure = WavyPressure(PolynomialFlow { viscosity: 1.0 });

/// The chapter.
pub const CASE: Case = Case {
    name: "manufactured",
    title: "Manufactured solutions without bodies",
    text: "The flow of the stream function g(x) g(y), g(t) = t^2 (1-t)^2 (in 3D the curl of g(x) g(y) g(z) (1, 1, 1)), with the \
           pressure xy - 1/4 (xyz - 1/8) plus the sum of cos(pi x_d), under the body force that makes it a solution; on \
           uniform meshes and on meshes with half the cell size in one corner (hanging nodes). Errors are relative, in the \
           mean square; orders are those between the two finest meshes. Q2-Q1 elements have order 3 in the velocity and 2 in the pressure.",
    keys: &["dimension", "hanging nodes", "h"],
    measures: &["velocity", "pressure"],
    tasks,
    numbers,
    plot,
};

fn tasks(extent: Extent) -> Vec<Task> {
    let (plane, space): (&[u8], &[u8]) = match extent {
        Extent::Quick => (&[3, 4, 5], &[2, 3, 4]),
        Extent::Full => (&[3, 4, 5, 6], &[2, 3, 4, 5]),
    };
    let mut tasks = Vec::new();
    for method in METHODS {
        for hanging in [false, true] {
            tasks.extend(plane.iter().map(|&level| task::<2>(method, hanging, level)));
            tasks.extend(space.iter().map(|&level| task::<3>(method, hanging, level)));
        }
    }
    tasks
}

fn task<const D: usize>(method: &'static Method, hanging: bool, level: u8) -> Task
where
    Dim<D>: Space<D>,
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
    Dim<D>: Space<D>,
    PolynomialFlow: StokesSolution<D>,
{
    let force = |x: &Vector<D>| FLOW.body_force(x);
    let boundary = |x: &Vector<D>| FLOW.velocity(x);
    let mut solver = FlowSolver::new(method.params::<D>(1e-9))?;
    let flow = solver.solve_forced(mesh, &[], &boundary, Some(&force))?;
    let errors = errors(&flow, &FLOW, &[]);
    Ok(vec![errors.velocity, errors.pressure / errors.pressure_scale])
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for (dimension, hanging) in [(2.0, 0.0), (2.0, 1.0), (3.0, 0.0), (3.0, 1.0)] {
        let mesh = if hanging == 0.0 { "uniform" } else { "hanging nodes" };
        for measure in CASE.measures {
            numbers.extend(METHODS.iter().map(|method| {
                let points = points(
                    &table,
                    measure,
                    method.name,
                    &[("dimension", dimension), ("hanging nodes", hanging)],
                );
                let finest = &points[points.len().saturating_sub(2)..];
                let (sizes, errors): (Vec<f64>, Vec<f64>) = finest.iter().copied().unzip();
                let what = format!("order of the {measure}, {dimension}D, {mesh}");
                Number::new(Kind::Order, what, method.name, convergence_order(&sizes, &errors))
            }));
        }
    }
    numbers
}

fn points(table: &Table, measure: &str, method: &str, at: &[(&str, f64)]) -> Vec<(f64, f64)> {
    table.values("h", method, at).into_iter().zip(table.values(measure, method, at)).collect()
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    Plot::of_methods(
        "cell size *h*",
        "relative error",
        &["*u* 2D", "*u* 3D", "*p* 2D", "*p* 3D"],
        |method, thing| {
            let dimension = [2.0, 3.0][thing % 2];
            points(
                &table,
                CASE.measures[thing / 2],
                method,
                &[("dimension", dimension), ("hanging nodes", 1.0)],
            )
        },
    )
}
