//! `cargo xtask test-mpi`: what is there under MPI, as processes on this machine: the same bits as by
//! threads, of flows and contacts for several numbers of ranks; cases of `gluey run` as one process computes
//! them, through contact, and their frames; and an end for all when one rank fails or is killed.

mod frames;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Numbers of ranks.
const RANKS: [&str; 5] = ["1", "2", "3", "4", "8"];
/// Flows that are computed.
const FLOWS: [&str; 6] = [
    "--dimension 2 --level 5",
    "--dimension 2 --level 6 --adaptive --tolerance 1e-11",
    "--dimension 3 --level 3",
    "--dimension 3 --level 4 --adaptive --tolerance 1e-11",
    "--dimension 2 --level 5 --bodies",
    "--dimension 3 --level 4 --bodies",
];
/// Contacts that are solved for.
const CONTACTS: [&str; 3] = [
    "--dimension 2 --fraction 0.6 --count 400 --steps 12",
    "--dimension 3 --fraction 0.4 --count 500 --steps 12 --exact",
    "--dimension 3 --fraction 0.4 --count 500 --steps 4 --solver accelerated",
];
/// Two spheres that the shear drives at each other.
const CASE: &str = r#"name = "near"
dimension = 3
particles = [
    { position = [0.4, 0.53, 0.5], radius = 0.1 },
    { position = [0.597, 0.47, 0.5], radius = 0.1 },
]

[time]
step = 0.1
end = 0.4

[contact]
strategy = "gluey"
exact_gap = false

[flow]
solver = "multigrid"
tolerance = 1e-11

[flow.mesh]
cells_per_radius = 1.6
root_cells = 1
band = 1
"#;
/// Its trajectory.
const TRAJECTORY: &str = "near-gluey-unfitted.csv";
/// Spheres in a box that is sheared for ever, by the default formulation.
const SHEARED: &str = r#"name = "sheared"
dimension = 3

[domain]
boundary = "sheared"

[suspension]
volume_fraction = 0.2
count = 6

[time]
step = 0.1
end = 0.3

[contact]
strategy = "none"

[flow]
tolerance = 1e-11
solver = "multigrid"

[flow.mesh]
cells_per_radius = 1.6
root_cells = 1

[rheology]
every = 1
"#;
/// Its tables.
const TABLES: [&str; 2] = ["sheared-none-unfitted.csv", "sheared-none-unfitted-rheology.csv"];
/// A sphere that is driven past one that is held and a free one, through fluid whose mean is at rest.
const DRIVEN: &str = r#"name = "driven"
dimension = 3
shear_rate = 0.0
particles = [
    { position = [0.3, 0.5, 0.5], radius = 0.12, velocity = [0.5, 0.1, 0.0] },
    { position = [0.62, 0.6, 0.45], radius = 0.1, held = true },
    { position = [0.55, 0.2, 0.6], radius = 0.1 },
]

[domain]
boundary = "sheared"

[time]
step = 0.05
end = 0.1

[contact]
strategy = "none"

[flow]
tolerance = 1e-11
solver = "multigrid"

[flow.mesh]
cells_per_radius = 1.6
root_cells = 1
"#;
/// Its tables.
const TABLES_OF_DRIVEN: [&str; 2] = ["driven-none-unfitted.csv", "driven-none-unfitted-forces.csv"];
/// Largest difference of the numbers in it from those of one process.
const LIMIT: f64 = 1e-11;
/// The same in the sheared box, whose stresses one process finds from the flow of the step before.
const LIMIT_OF_SHEARED: f64 = 5e-10;
/// Its checkpoint.
const CHECKPOINT: &str = "near-gluey-unfitted.checkpoint";
/// A key that makes the run longer.
const LONG: &str = "time.end=2";
/// Ranks of a run that loses one.
const LOSING: &str = "3";
/// What is said of a case that ranks cannot share.
const REFUSAL: &str = "several ranks cannot share the formulation paper";
/// A limit of memory in gigabytes that one process refuses the case under, and eight do not.
const LIMIT_OF_MEMORY: &str = "0.08";
/// What is said of a case that needs more.
const TOO_LARGE: &str = "the limit is";
/// How long the others may go on.
const PATIENCE: Duration = Duration::from_secs(20);
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
    #[error("{ranks} ranks, {problem}: MPI and threads differ\n  MPI:     {mpi}\n  threads: {threads}")]
    Differ {
        /// Number of ranks.
        ranks: &'static str,
        /// Options of the flow or of the contacts.
        problem: &'static str,
        /// The line under MPI.
        mpi: String,
        /// The line of threads.
        threads: String,
    },
    /// A run of a case could not be read or compared.
    #[error("{ranks} ranks, a case: {what}")]
    Case {
        /// Number of ranks.
        ranks: &'static str,
        /// What is wrong.
        what: String,
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
    let [program, contact] =
        ["box_flow", "shear_contact"].map(|name| root.join("target/release/examples").join(name));
    for (program, problems) in [(&program, &FLOWS[..]), (&contact, &CONTACTS)] {
        for problem in problems {
            launcher.compare_with_threads(program, problem)?;
        }
    }
    let mut failing = launcher.command("3", &program, "--level 3 --fail-rank 1");
    let (command, output) = (words(&failing), outcome(&mut failing)?);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() || !text.contains("this rank was told to fail") {
        return Err(MpiError::Unnoticed(command, text));
    }
    println!("a rank that fails ends all of 3 ranks, and says why");
    let case = Case { launcher, root: root.to_owned() };
    case.compare()?;
    case.write_frames()?;
    case.refuse()?;
    case.share_memory()?;
    case.lose_a_rank()
}

/// Runs of a case by `gluey`.
struct Case {
    launcher: Launcher,
    root: PathBuf,
}

impl Case {
    /// The places of the particles are those of one process, and the same bits run after run; the stress too
    /// where there is one.
    fn compare(&self) -> Result<(), MpiError> {
        compare("between walls", LIMIT, |ranks| {
            line(&mut self.command(ranks, "time.end=0.4")?)?;
            self.read(ranks, TRAJECTORY)
        })?;
        compare("sheared for ever", LIMIT_OF_SHEARED, |ranks| {
            line(&mut self.command_of("sheared.toml", SHEARED, ranks)?)?;
            self.read_all(ranks, TABLES)
        })?;
        compare("held and driven", LIMIT_OF_SHEARED, |ranks| {
            line(&mut self.command_of("driven.toml", DRIVEN, ranks)?)?;
            self.read_all(ranks, TABLES_OF_DRIVEN)
        })
    }

    fn read_all(&self, ranks: &'static str, tables: [&str; 2]) -> Result<String, MpiError> {
        let tables = tables.map(|table| self.read(ranks, table));
        Ok(tables.into_iter().collect::<Result<Vec<_>, _>>()?.concat())
    }

    fn read(&self, ranks: &'static str, table: &str) -> Result<String, MpiError> {
        let file = self.folder().join(table);
        std::fs::read_to_string(&file)
            .map_err(|error| MpiError::Case { ranks, what: format!("{}: {error}", file.display()) })
    }

    fn folder(&self) -> PathBuf {
        self.root.join("target/test-mpi")
    }

    fn command(&self, ranks: &'static str, key: &str) -> Result<Command, MpiError> {
        let mut command = self.command_into(&self.folder(), ranks, key)?;
        command.arg("--force");
        Ok(command)
    }

    /// The run of another case, in the place of what a run before left.
    fn command_of(&self, name: &str, case: &str, ranks: &'static str) -> Result<Command, MpiError> {
        let mut command = self.run(name, case, &self.folder(), ranks)?;
        command.arg("--force");
        Ok(command)
    }

    /// The same with another folder for the results, where there are none.
    fn command_into(&self, out: &Path, ranks: &'static str, key: &str) -> Result<Command, MpiError> {
        let mut command = self.run("near.toml", CASE, out, ranks)?;
        command.args(["--set", key]);
        Ok(command)
    }

    fn run(&self, name: &str, case: &str, out: &Path, ranks: &'static str) -> Result<Command, MpiError> {
        let (program, folder) = (self.root.join("target/release/gluey"), self.folder());
        let file = folder.join(name);
        std::fs::create_dir_all(&folder)
            .and_then(|()| std::fs::write(&file, case))
            .map_err(|error| MpiError::Case { ranks, what: format!("{}: {error}", file.display()) })?;
        let (file, out) = (file.display(), out.display());
        let words = format!("run {file} --quiet --threads 1 --out {out}");
        Ok(self.launcher.command(ranks, &program, &words))
    }

    /// What ranks cannot share is refused with a reason, by one of them.
    fn refuse(&self) -> Result<(), MpiError> {
        let mut command = self.command(LOSING, "flow.formulation=paper")?;
        let (said, output) = (words(&command), outcome(&mut command)?);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() || text.matches(REFUSAL).count() != 1 {
            return Err(MpiError::Unnoticed(said, text));
        }
        println!("a case that ranks cannot share is refused");
        Ok(())
    }

    /// Eight processes run under a limit of memory what one refuses.
    fn share_memory(&self) -> Result<(), MpiError> {
        let within = |ranks: &'static str| {
            let mut command = self.command(ranks, "flow.mesh.cells_per_radius=3.2")?;
            command.args(["--set", "time.end=0.1", "--memory-limit", LIMIT_OF_MEMORY]);
            let output = outcome(&mut command)?;
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            Ok((words(&command), output.status.success(), text))
        };
        let (said, was_run, text) = within("1")?;
        if was_run || !text.contains(TOO_LARGE) {
            return Err(MpiError::Unnoticed(said, text));
        }
        let (command, was_run, text) = within("8")?;
        if !was_run {
            return Err(MpiError::Run { command, text });
        }
        println!("8 ranks run under a limit of {LIMIT_OF_MEMORY} GB what one refuses");
        Ok(())
    }

    /// A rank is killed in the middle of a run: the others end soon, with a message and an error, and the
    /// last checkpoint goes on with another number of ranks.
    fn lose_a_rank(&self) -> Result<(), MpiError> {
        let mut command = self.command(LOSING, LONG)?;
        command.args(["--checkpoint-every", "1"]);
        let checkpoint = self.folder().join(CHECKPOINT);
        let _ = std::fs::remove_file(&checkpoint);
        let said = words(&command);
        let failed = |source| MpiError::Start { program: "mpirun".into(), source };
        let mut run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().map_err(failed)?;
        let start = Instant::now();
        while !checkpoint.is_file() && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(100));
        }
        let Some(&victim) = children_of(run.id()).last() else {
            return Err(MpiError::Unnoticed(said, "it ended before a rank was killed".into()));
        };
        let killed = Command::new("kill").args(["-9", &victim.to_string()]).status().map_err(failed)?;
        let start = Instant::now();
        while run.try_wait().map_err(failed)?.is_none() {
            if !killed.success() || start.elapsed() > PATIENCE {
                let _ = run.kill();
                return Err(MpiError::Unnoticed(said, format!("still there after {PATIENCE:?}")));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        println!("a rank that is killed ends all of {LOSING} ranks in {:.1?}", start.elapsed());
        let output = run.wait_with_output().map_err(failed)?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() || text.trim().is_empty() {
            return Err(MpiError::Unnoticed(said, text));
        }
        self.go_on(&checkpoint)
    }

    /// From a checkpoint to where one process ends.
    fn go_on(&self, checkpoint: &Path) -> Result<(), MpiError> {
        let ranks = RANKS[1];
        let mut command = self.command(ranks, LONG)?;
        command.arg("--resume").arg(checkpoint);
        line(&mut command)?;
        let resumed = self.read(ranks, TRAJECTORY)?;
        line(&mut self.command(RANKS[0], LONG)?)?;
        let alone = self.read(RANKS[0], TRAJECTORY)?;
        let difference = largest_difference(&alone, &resumed);
        if difference.is_none_or(|difference| difference > LIMIT) {
            let what = format!("a resumed run differs from one process by {difference:?}, not {LIMIT}");
            return Err(MpiError::Case { ranks, what });
        }
        println!(
            "its checkpoint goes on with {ranks} ranks: {:e} from one process",
            difference.unwrap_or(0.0)
        );
        Ok(())
    }
}

/// Tables of a case on several numbers of ranks beside those of one process.
fn compare(
    case: &str,
    limit: f64,
    tables: impl Fn(&'static str) -> Result<String, MpiError>,
) -> Result<(), MpiError> {
    let alone = tables(RANKS[0])?;
    for ranks in RANKS.into_iter().skip(1) {
        let found = tables(ranks)?;
        if tables(ranks)? != found {
            return Err(MpiError::Case { ranks, what: format!("{case}: two runs have other bits") });
        }
        let difference = largest_difference(&alone, &found);
        if difference.is_none_or(|difference| difference > limit) {
            let what =
                format!("{case}: rows differ from those of one process by {difference:?}, not {limit}");
            return Err(MpiError::Case { ranks, what });
        }
        println!("{ranks} ranks, a case {case}: {:e} from one process", difference.unwrap_or(0.0));
    }
    Ok(())
}

/// The processes that a process started.
fn children_of(parent: u32) -> Vec<u32> {
    let file = format!("/proc/{parent}/task/{parent}/children");
    let listed = std::fs::read_to_string(file).unwrap_or_default();
    listed.split_whitespace().filter_map(|child| child.parse().ok()).collect()
}

/// Largest difference of the numbers in two tables; nothing where the tables have other shapes.
fn largest_difference(one: &str, other: &str) -> Option<f64> {
    let numbers = |text: &str| -> Vec<f64> {
        let rows = text.lines().skip(1).flat_map(|row| row.split(',').map(str::to_owned).collect::<Vec<_>>());
        rows.filter_map(|cell| cell.parse().ok()).collect()
    };
    let (one, other) = (numbers(one), numbers(other));
    let is_same_shape = one.len() == other.len() && !one.is_empty();
    is_same_shape.then(|| one.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
}

fn build(root: &Path) -> Result<(), MpiError> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(&cargo);
    command.args(["build", "--release", "--workspace", "--features", "gluey/mpi", "--bin", "gluey"]);
    let status =
        command.args(["--example", "box_flow", "--example", "shear_contact"]).current_dir(root).status();
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

    /// A program prints the same line by MPI and by threads.
    fn compare_with_threads(&self, program: &PathBuf, problem: &'static str) -> Result<(), MpiError> {
        for ranks in RANKS {
            let mpi = line(&mut self.command(ranks, program, problem))?;
            let mut threads = Command::new(program);
            threads.args(["--ranks", ranks]).args(problem.split(' '));
            let threads = line(&mut threads)?;
            if mpi != threads {
                return Err(MpiError::Differ { ranks, problem, mpi, threads });
            }
            println!("{ranks} ranks, {problem}: the same bits by MPI and by threads");
        }
        Ok(())
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
