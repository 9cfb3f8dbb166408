//! `cargo xtask test-mpi`: what is there under MPI, as processes on this machine: the same bits as by
//! threads, for several numbers of ranks, and an end for all when one rank fails.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Numbers of ranks.
const RANKS: [&str; 5] = ["1", "2", "3", "4", "8"];
/// Flows that are computed.
const FLOWS: [&str; 4] = [
    "--dimension 2 --level 5",
    "--dimension 2 --level 6 --adaptive --tolerance 1e-11",
    "--dimension 3 --level 3",
    "--dimension 3 --level 4 --adaptive --tolerance 1e-11",
];
/// What to install where something is missing.
const PACKAGES: &str = "on Debian and Ubuntu: apt-get install libopenmpi-dev openmpi-bin libclang-dev";

/// Why nothing was tested, or what is wrong.
#[derive(Debug, thiserror::Error)]
pub enum MpiError {
    /// A program of MPI is not there.
    #[error("no {0} is there; {PACKAGES}")]
    Missing(&'static str),
    /// A program could not be started.
    #[error("cannot start {program}: {source}")]
    Start {
        /// The program.
        program: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Cargo said no.
    #[error("the build with the feature mpi failed; it needs the headers of MPI and libclang; {PACKAGES}")]
    Build,
    /// A run failed.
    #[error("`{command}` failed: {text}")]
    Run {
        /// The command.
        command: String,
        /// What it said.
        text: String,
    },
    /// The bits depend on how messages travel.
    #[error("{ranks} ranks, {flow}: MPI and threads differ\n  MPI:     {mpi}\n  threads: {threads}")]
    Differ {
        /// Number of ranks.
        ranks: &'static str,
        /// Options of the flow.
        flow: &'static str,
        /// The line under MPI.
        mpi: String,
        /// The line of threads.
        threads: String,
    },
    /// A failure went unnoticed.
    #[error("a rank failed and `{0}` ended as if nothing had happened, or without the reason: {1}")]
    Unnoticed(String, String),
}

/// Builds with the feature and runs everything.
///
/// # Errors
/// [`MpiError`] where MPI is missing, a run fails, or its result is not that of threads.
pub fn run(root: &Path) -> Result<(), MpiError> {
    let launcher = Launcher::find()?;
    build(root)?;
    let program = root.join("target/release/examples/box_flow");
    for flow in FLOWS {
        for ranks in RANKS {
            let mpi = line(&mut launcher.command(ranks, &program, flow))?;
            let mut threads = Command::new(&program);
            threads.args(["--ranks", ranks]).args(flow.split(' '));
            let threads = line(&mut threads)?;
            if mpi != threads {
                return Err(MpiError::Differ { ranks, flow, mpi, threads });
            }
            println!("{ranks} ranks, {flow}: the same bits by MPI and by threads");
        }
    }
    let mut failing = launcher.command("3", &program, "--level 3 --fail-rank 1");
    let (command, output) = (words(&failing), outcome(&mut failing)?);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() || !text.contains("this rank was told to fail") {
        return Err(MpiError::Unnoticed(command, text));
    }
    println!("a rank that fails ends all of 3 ranks, and says why");
    Ok(())
}

fn build(root: &Path) -> Result<(), MpiError> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(&cargo);
    command.args(["build", "--release", "-p", "gluey-distributed", "--features", "mpi"]);
    let status = command.args(["--example", "box_flow"]).current_dir(root).status();
    let status = status.map_err(|source| MpiError::Start { program: cargo, source })?;
    if status.success() { Ok(()) } else { Err(MpiError::Build) }
}

/// How processes are started.
struct Launcher {
    is_open_mpi: bool,
}

impl Launcher {
    fn find() -> Result<Self, MpiError> {
        let said = |program: &'static str| {
            let output = Command::new(program).arg("--version").output();
            let output = output.map_err(|_| MpiError::Missing(program))?;
            Ok(String::from_utf8_lossy(&output.stdout).into_owned())
        };
        said("mpicc")?;
        Ok(Self { is_open_mpi: said("mpirun")?.contains("Open MPI") })
    }

    /// More processes than cores are as good as fewer here, also for root in a container.
    fn command(&self, ranks: &str, program: &PathBuf, options: &str) -> Command {
        let mut command = Command::new("mpirun");
        command.args(["-n", ranks]).env("RAYON_NUM_THREADS", "1");
        if self.is_open_mpi {
            command.args(["--oversubscribe", "--allow-run-as-root", "--mca", "mpi_yield_when_idle", "1"]);
        }
        command.arg(program).args(options.split(' '));
        command
    }
}

fn words(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

fn outcome(command: &mut Command) -> Result<Output, MpiError> {
    let program = command.get_program().to_string_lossy().into_owned();
    command.output().map_err(|source| MpiError::Start { program, source })
}

/// What a command prints.
fn line(command: &mut Command) -> Result<String, MpiError> {
    let output = outcome(command)?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned());
    }
    let text = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    Err(MpiError::Run { command: words(command), text })
}
