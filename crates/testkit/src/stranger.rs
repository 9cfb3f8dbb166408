//! A program that knows nothing of this workspace and uses crates as strangers get them: packaged and
//! unpacked.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The program, and what it stands on.
#[derive(Clone, Debug)]
pub struct Stranger<'a> {
    /// The crate that it uses, in the version of this workspace.
    pub uses: &'a str,
    /// Whether with the features that the crate has by default.
    pub default_features: bool,
    /// Names of this crate and of those it depends on.
    pub packages: &'a [&'a str],
    /// Its `main.rs`.
    pub program: &'a str,
    /// Folder that it has to itself, in that of built files: what was compiled there is not compiled again.
    pub folder: PathBuf,
}

impl Stranger<'_> {
    /// What the program prints.
    ///
    /// # Panics
    ///
    /// If a crate cannot be packaged, or the program does not compile or fails.
    #[must_use]
    pub fn run(&self) -> String {
        let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
        let program = self.folder.join("stranger");
        fs::create_dir_all(program.join("src")).expect("a folder of the target directory");
        self.unpack(workspace);
        fs::write(program.join("src/main.rs"), self.program).expect("a file");
        fs::write(program.join("Cargo.toml"), self.manifest()).expect("a file");
        // The versions that were compiled here need no network.
        fs::copy(workspace.join("Cargo.lock"), program.join("Cargo.lock")).expect("a lock file");

        // Without optimisation: to compile takes longer than to run.
        let mut run = Command::new(env!("CARGO"));
        run.args(["run", "--offline", "--quiet"]).env("CARGO_PROFILE_DEV_DEBUG", "0").current_dir(&program);
        output(run.arg("--target-dir").arg(self.folder.join("target")))
    }

    /// Packages the crates and unpacks them side by side.
    fn unpack(&self, workspace: &Path) {
        let mut package = Command::new(env!("CARGO"));
        package.args(["package", "--offline", "--no-verify", "--allow-dirty"]).current_dir(workspace);
        package.arg("--target-dir").arg(&self.folder);
        output(package.args(self.packages.iter().flat_map(|name| ["-p", name])));
        for name in self.packages {
            let package = format!("{name}-{}", env!("CARGO_PKG_VERSION"));
            let path = self.folder.join(format!("package/{package}.crate"));
            let archive = fs::read(&path).expect("a package");
            let unpacked = self.folder.join(format!("{name}.unpacked"));
            // What is known already is not compiled again.
            if fs::read(&unpacked).is_ok_and(|known| known == archive) {
                continue;
            }
            fs::remove_dir_all(self.folder.join(&package))
                .or_else(if_missing)
                .expect("a folder of this test");
            // With the time of now, by which cargo sees that they are new.
            output(Command::new("tar").arg("xmzf").arg(path).arg("-C").arg(&self.folder));
            fs::write(&unpacked, archive).expect("a file");
        }
    }

    /// The packages stand where the registry would.
    fn manifest(&self) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let patch = |name: &&str| format!("{name} = {{ path = \"../{name}-{version}\" }}\n");
        let patches: String = self.packages.iter().map(patch).collect();
        let Self { uses, default_features, .. } = self;
        format!(
            "[package]\nname = \"stranger\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[workspace]\n\n\
             [dependencies]\n{uses} = {{ version = \"{version}\", default-features = {default_features} }}\n\n\
             [patch.crates-io]\n{patches}"
        )
    }
}

/// Runs a command and returns what it prints.
fn output(command: &mut Command) -> String {
    let output = command.output().expect("cargo and tar");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}\n{errors}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn if_missing(error: std::io::Error) -> std::io::Result<()> {
    if error.kind() == std::io::ErrorKind::NotFound { Ok(()) } else { Err(error) }
}
