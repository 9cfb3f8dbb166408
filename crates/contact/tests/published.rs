//! The crate as strangers get it: packaged, unpacked, and used by a program that knows nothing of this
//! workspace.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A program on `gluey-contact` alone.
const PROGRAM: &str = r#"use gluey_contact::geom::{Twist, Vector};
use gluey_contact::{ContactError, ContactModel, ContactParams, PairContact, StepGeometry};
fn main() -> Result<(), ContactError> {
    let (mut positions, radii, drift) = ([[0.0, 0.0], [2.1, 0.3]].map(Vector::from), [1.0; 2], [Vector::zeros(); 2]);
    let mut contact = PairContact::<2>::new(ContactParams::default());
    for step in 0..40 {
        let push = if step < 20 { 1.0 } else { -1.0 };
        let mut twists = [push, -push].map(|x| Twist { velocity: Vector::<2>::new(x, 0.0), ..Twist::default() });
        let geometry = StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: 0.05, dt: 0.05 };
        contact.correct(&geometry, &mut twists)?;
        positions.iter_mut().zip(&twists).for_each(|(x, twist)| *x += twist.velocity * 0.05);
        println!("{:.3} {}", (positions[1] - positions[0]).norm() - 2.0, contact.contacts().len());
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

/// Packages this crate and what it depends on, and unpacks them side by side.
fn unpacked(workspace: &Path, folder: &Path) {
    let packages = ["gluey-geom", "gluey-contact"];
    let mut package = Command::new(env!("CARGO"));
    package.args(["package", "--offline", "--no-verify", "--allow-dirty"]).current_dir(workspace);
    package.arg("--target-dir").arg(folder).args(packages.map(|name| ["-p", name]).concat());
    output(&mut package);
    for name in packages {
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
    format!(
        "[package]\nname = \"stranger\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n\
         gluey-contact = {{ version = \"{version}\", default-features = false }}\n\n[patch.crates-io]\n\
         gluey-geom = {{ path = \"../gluey-geom-{version}\" }}\n\
         gluey-contact = {{ path = \"../gluey-contact-{version}\" }}\n"
    )
}

#[test]
fn a_program_outside_the_workspace_runs() {
    assert!(PROGRAM.lines().count() <= 15);
    let workspace = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("published");
    let program = folder.join("stranger");
    std::fs::create_dir_all(program.join("src")).expect("a folder of the target directory");
    unpacked(&workspace, &folder);
    std::fs::write(program.join("src/main.rs"), PROGRAM).expect("a file");
    std::fs::write(program.join("Cargo.toml"), manifest()).expect("a file");
    // The versions that were compiled here need no network.
    std::fs::copy(workspace.join("Cargo.lock"), program.join("Cargo.lock")).expect("a lock file");

    let mut run = Command::new(env!("CARGO"));
    run.args(["run", "--offline", "--quiet"]).env("CARGO_PROFILE_DEV_DEBUG", "0").current_dir(&program);
    let printed = output(run.arg("--target-dir").arg(folder.join("target")));
    let gaps: Vec<&str> = printed.lines().collect();
    // They meet, stay together until the pull has made up for the push, and part.
    assert_eq!(gaps.len(), 40);
    assert!(gaps.contains(&"0.000 1") && gaps[39].ends_with(" 0"), "{printed}");
}
