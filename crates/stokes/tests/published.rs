//! The crate as strangers get it: packaged, unpacked, and used by a program that knows nothing of this
//! workspace.

use std::path::{Path, PathBuf};
use std::process::Command;

/// This crate and what it depends on.
const PACKAGES: [&str; 5] = ["gluey-geom", "gluey-linalg", "gluey-levelset", "gluey-fem", "gluey-stokes"];

/// A program on `gluey-stokes` alone.
const PROGRAM: &str = r#"use gluey_stokes::geom::{Aabb, Vector};
use gluey_stokes::levelset::Ball;
use gluey_stokes::{FlowParams, FlowSolver, Refinement, StokesError};

fn main() -> Result<(), StokesError> {
    let mut solver = FlowSolver::<2>::new(FlowParams::for_dimension(2))?;
    for y in [0.5, 0.6, 0.7] {
        let disc = [Ball::new(Vector::<2>::new(0.5, y), 0.15)];
        let mesh = Refinement::to_level(4).mesh(Aabb::unit(), [1, 1], [false; 2], &disc)?;
        let flow = solver.solve(mesh, &disc, &|x| Vector::<2>::new(x[1] - 0.5, 0.0))?;
        println!("{:.3} {:.3}", flow.twists[0].velocity[0].abs(), flow.twists[0].spin[0]);
    }
    Ok(())
}
"#;

/// Runs a command and returns what it prints.
fn output(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}\n{errors}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn if_missing(error: std::io::Error) -> std::io::Result<()> {
    if error.kind() == std::io::ErrorKind::NotFound { Ok(()) } else { Err(error) }
}

/// Packages the crates and unpacks them side by side.
fn unpacked(workspace: &Path, folder: &Path) {
    let mut package = Command::new(env!("CARGO"));
    package.args(["package", "--offline", "--no-verify", "--allow-dirty"]).current_dir(workspace);
    package.arg("--target-dir").arg(folder).args(PACKAGES.map(|name| ["-p", name]).concat());
    output(&mut package);
    for name in PACKAGES {
        let package = format!("{name}-{}", env!("CARGO_PKG_VERSION"));
        let path = folder.join(format!("package/{package}.crate"));
        let archive = std::fs::read(&path).expect("a package");
        let unpacked = folder.join(format!("{name}.unpacked"));
        // What is known already is not compiled again.
        if std::fs::read(&unpacked).is_ok_and(|known| known == archive) {
            continue;
        }
        std::fs::remove_dir_all(folder.join(&package)).or_else(if_missing).expect("a folder of this test");
        // With the time of now, by which cargo sees that they are new.
        output(Command::new("tar").arg("xmzf").arg(path).arg("-C").arg(folder));
        std::fs::write(&unpacked, archive).expect("a file");
    }
}

/// The manifest of the program: the packages stand where the registry would.
fn manifest() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let patches = PACKAGES.map(|name| format!("{name} = {{ path = \"../{name}-{version}\" }}\n")).concat();
    format!(
        "[package]\nname = \"stranger\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n\
         gluey-stokes = \"{version}\"\n\n[patch.crates-io]\n{patches}"
    )
}

#[test]
fn a_program_outside_the_workspace_runs() {
    assert!(PROGRAM.lines().count() <= 15);
    let workspace = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("published-stokes");
    let program = folder.join("stranger");
    std::fs::create_dir_all(program.join("src")).expect("a folder of the target directory");
    unpacked(&workspace, &folder);
    std::fs::write(program.join("src/main.rs"), PROGRAM).expect("a file");
    std::fs::write(program.join("Cargo.toml"), manifest()).expect("a file");
    // The versions that were compiled here need no network.
    std::fs::copy(workspace.join("Cargo.lock"), program.join("Cargo.lock")).expect("a lock file");

    // Without optimisation: to compile faer takes longer than to solve these.
    let mut run = Command::new(env!("CARGO"));
    run.args(["run", "--offline", "--quiet"]).env("CARGO_PROFILE_DEV_DEBUG", "0").current_dir(&program);
    let printed = output(run.arg("--target-dir").arg(folder.join("target")));
    let rows: Vec<Vec<f64>> = printed
        .lines()
        .map(|line| line.split(' ').filter_map(|number| number.parse().ok()).collect())
        .collect();
    // At rest in the middle, faster and faster above, and always turning at about half the shear rate.
    assert_eq!(rows.len(), 3);
    assert!(rows[0][0] < 1e-3 && rows.windows(2).all(|pair| pair[1][0] > pair[0][0] + 0.08), "{printed}");
    assert!(rows.iter().all(|row| (row[1] + 0.5).abs() < 0.1), "{printed}");
}
