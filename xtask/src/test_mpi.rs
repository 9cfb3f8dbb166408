//! `cargo xtask test-mpi`: what is there under MPI, as processes on this machine: the same bits as by
//! threads, of flows and contacts for several numbers of ranks; cases of `gluey run` as one process computes
//! them, through contact, and their frames; and an end for all when one rank fails or is killed.

mod frames;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};

use crate::program::{self, Missing};

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
const CASE: &str = include_str!("test_mpi/near.toml");
/// Its trajectory.
const TRAJECTORY: &str = "near-gluey-unfitted.csv";
/// Spheres in a box that is sheared for ever, by the default formulation.
const SHEARED: &str = include_str!("test_mpi/sheared.toml");
/// Its tables.
const TABLES: [&str; 2] = ["sheared-none-unfitted.csv", "sheared-none-unfitted-rheology.csv"];
/// A sphere that is driven past one that is held and a free one, through fluid whose mean is at rest.
const DRIVEN: &str = include_str!("test_mpi/driven.toml");
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

/// Builds with the feature and runs everything.
///
/// # Errors
/// [`Missing`] where MPI is, another one where a run fails or its result is not that of threads.
pub fn run(root: &Path) -> anyhow::Result<()> {
    let launcher = Launcher::find()?;
    let mut build = program::cargo("build --release --workspace --features gluey-cli/mpi --bin gluey");
    build.args(["--example", "box_flow", "--example", "shear_contact"]).current_dir(root);
    let needs = "it needs the headers of MPI and libclang";
    program::run(&mut build, &format!("the build with the feature mpi failed; {needs}; {PACKAGES}"))?;
    let [program, contact] =
        ["box_flow", "shear_contact"].map(|name| root.join("target/release/examples").join(name));
    FLOWS.iter().try_for_each(|problem| launcher.compare_with_threads(&program, problem))?;
    CONTACTS.iter().try_for_each(|problem| launcher.compare_with_threads(&contact, problem))?;
    let mut failing = launcher.command("3", &program, "--level 3 --fail-rank 1");
    notices(&mut failing, |said| said.contains("this rank was told to fail"))?;
    println!("a rank that fails ends all of 3 ranks, and says why");
    let case = CaseOnRanks { launcher, root: root.to_owned() };
    case.compare()?;
    case.write_frames()?;
    case.refuse()?;
    case.share_memory()?;
    case.lose_a_rank()
}

/// Whether a command fails and gives the reason.
fn notices(command: &mut Command, is_reason: impl Fn(&str) -> bool) -> anyhow::Result<()> {
    let output = program::output(command)?;
    let said = program::complaint(&output);
    ensure!(!output.status.success() && is_reason(&said), unnoticed(&words(command), &said));
    Ok(())
}

/// What is said of a failure without consequences.
fn unnoticed(command: &str, said: &str) -> String {
    format!("a rank failed and `{command}` ended as if nothing had happened, or without the reason: {said}")
}

/// Runs of a case by `gluey`.
struct CaseOnRanks {
    launcher: Launcher,
    root: PathBuf,
}

impl CaseOnRanks {
    /// The places of the particles are those of one process, and the same bits run after run; the stress too
    /// where there is one.
    fn compare(&self) -> anyhow::Result<()> {
        compare("between walls", LIMIT, |ranks| {
            line(&mut self.command(ranks, "time.end=0.4")?)?;
            self.read(TRAJECTORY)
        })?;
        compare("sheared for ever", LIMIT_OF_SHEARED, |ranks| {
            line(&mut self.command_of("sheared.toml", SHEARED, ranks)?)?;
            self.read_all(TABLES)
        })?;
        compare("held and driven", LIMIT_OF_SHEARED, |ranks| {
            line(&mut self.command_of("driven.toml", DRIVEN, ranks)?)?;
            self.read_all(TABLES_OF_DRIVEN)
        })
    }

    fn read_all(&self, tables: [&str; 2]) -> anyhow::Result<String> {
        tables.iter().map(|table| self.read(table)).collect()
    }

    fn read(&self, table: &str) -> anyhow::Result<String> {
        let file = self.folder().join(table);
        std::fs::read_to_string(&file).with_context(|| file.display().to_string())
    }

    fn folder(&self) -> PathBuf {
        self.root.join("target/test-mpi")
    }

    fn command(&self, ranks: &'static str, key: &str) -> anyhow::Result<Command> {
        let mut command = self.command_into(&self.folder(), ranks, key)?;
        command.arg("--force");
        Ok(command)
    }

    /// The run of another case, in the place of what a run before left.
    fn command_of(&self, name: &str, case: &str, ranks: &'static str) -> anyhow::Result<Command> {
        let mut command = self.run(name, case, &self.folder(), ranks)?;
        command.arg("--force");
        Ok(command)
    }

    /// The same with another folder for the results, where there are none.
    fn command_into(&self, out: &Path, ranks: &'static str, key: &str) -> anyhow::Result<Command> {
        let mut command = self.run("near.toml", CASE, out, ranks)?;
        command.args(["--set", key]);
        Ok(command)
    }

    fn run(&self, name: &str, case: &str, out: &Path, ranks: &'static str) -> anyhow::Result<Command> {
        let (program, folder) = (self.root.join("target/release/gluey"), self.folder());
        let file = folder.join(name);
        let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, case));
        written.with_context(|| file.display().to_string())?;
        let (file, out) = (file.display(), out.display());
        let words = format!("run {file} --quiet --threads 1 --out {out}");
        Ok(self.launcher.command(ranks, &program, &words))
    }

    /// What ranks cannot share is refused with a reason, by one of them.
    fn refuse(&self) -> anyhow::Result<()> {
        let mut command = self.command(LOSING, "flow.formulation=paper")?;
        notices(&mut command, |said| said.matches(REFUSAL).count() == 1)?;
        println!("a case that ranks cannot share is refused");
        Ok(())
    }

    /// Eight processes run under a limit of memory what one refuses.
    fn share_memory(&self) -> anyhow::Result<()> {
        let within = |ranks: &'static str| -> anyhow::Result<Command> {
            let mut command = self.command(ranks, "flow.mesh.cells_per_radius=3.2")?;
            command.args(["--set", "time.end=0.1", "--memory-limit", LIMIT_OF_MEMORY]);
            Ok(command)
        };
        notices(&mut within("1")?, |said| said.contains(TOO_LARGE))?;
        line(&mut within("8")?)?;
        println!("8 ranks run under a limit of {LIMIT_OF_MEMORY} GB what one refuses");
        Ok(())
    }

    /// A rank is killed in the middle of a run: the others end soon, with a message and an error, and the
    /// last checkpoint goes on with another number of ranks.
    fn lose_a_rank(&self) -> anyhow::Result<()> {
        let mut command = self.command(LOSING, LONG)?;
        command.args(["--checkpoint-every", "1"]);
        let checkpoint = self.folder().join(CHECKPOINT);
        let _ = std::fs::remove_file(&checkpoint);
        let said = words(&command);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut run = command.spawn().with_context(|| program::cannot_start(&command))?;
        let start = Instant::now();
        while !checkpoint.is_file() && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(100));
        }
        let victim = children_of(run.id()).pop();
        let victim = victim.with_context(|| unnoticed(&said, "it ended before a rank was killed"))?;
        let killed = Command::new("kill").args(["-9", &victim.to_string()]).status()?;
        let start = Instant::now();
        while run.try_wait()?.is_none() {
            if !killed.success() || start.elapsed() > PATIENCE {
                let _ = run.kill();
                bail!(unnoticed(&said, &format!("still there after {PATIENCE:?}")));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        println!("a rank that is killed ends all of {LOSING} ranks in {:.1?}", start.elapsed());
        let output = run.wait_with_output()?;
        let text = program::complaint(&output);
        ensure!(!output.status.success() && !text.trim().is_empty(), unnoticed(&said, &text));
        self.go_on(&checkpoint)
    }

    /// From a checkpoint to where one process ends.
    fn go_on(&self, checkpoint: &Path) -> anyhow::Result<()> {
        let ranks = RANKS[1];
        line(self.command(ranks, LONG)?.arg("--resume").arg(checkpoint))?;
        let resumed = self.read(TRAJECTORY)?;
        line(&mut self.command(RANKS[0], LONG)?)?;
        let difference = largest_difference(&self.read(TRAJECTORY)?, &resumed);
        let difference = within(LIMIT, difference, || format!("{ranks} ranks, a resumed run"))?;
        println!("its checkpoint goes on with {ranks} ranks: {difference:e} from one process");
        Ok(())
    }
}

/// A difference that is there and not above a limit.
fn within(limit: f64, difference: Option<f64>, what: impl Fn() -> String) -> anyhow::Result<f64> {
    let small = difference.filter(|difference| *difference <= limit);
    small.with_context(|| format!("{} differs from one process by {difference:?}, not {limit}", what()))
}

/// Tables of a case on several numbers of ranks beside those of one process.
fn compare(
    case: &str,
    limit: f64,
    tables: impl Fn(&'static str) -> anyhow::Result<String>,
) -> anyhow::Result<()> {
    let alone = tables(RANKS[0])?;
    for ranks in RANKS.into_iter().skip(1) {
        let found = tables(ranks)?;
        ensure!(tables(ranks)? == found, "{ranks} ranks, a case {case}: two runs have other bits");
        let difference = largest_difference(&alone, &found);
        let difference = within(limit, difference, || format!("{ranks} ranks, a case {case}"))?;
        println!("{ranks} ranks, a case {case}: {difference:e} from one process");
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

/// The program that starts processes.
struct Launcher {
    is_open_mpi: bool,
}

impl Launcher {
    fn find() -> Result<Self, Missing> {
        let said = |program: &'static str| {
            let output = Command::new(program).arg("--version").output();
            let output = output.map_err(|_| Missing(format!("no {program} is there; {PACKAGES}")))?;
            Ok(String::from_utf8_lossy(&output.stdout).into_owned())
        };
        said("mpicc")?;
        Ok(Self { is_open_mpi: said("mpirun")?.contains("Open MPI") })
    }

    /// A program prints the same line by MPI and by threads.
    fn compare_with_threads(&self, program: &PathBuf, problem: &'static str) -> anyhow::Result<()> {
        for ranks in RANKS {
            let mpi = line(&mut self.command(ranks, program, problem))?;
            let mut threads = Command::new(program);
            threads.args(["--ranks", ranks]).args(problem.split(' '));
            let threads = line(&mut threads)?;
            let lines = format!("  MPI:     {mpi}\n  threads: {threads}");
            ensure!(mpi == threads, "{ranks} ranks, {problem}: MPI and threads differ\n{lines}");
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

/// What a command prints.
fn line(command: &mut Command) -> anyhow::Result<String> {
    let output = program::output(command)?;
    let complaint = program::complaint(&output);
    ensure!(output.status.success(), "`{}` failed: {}", words(command), complaint.trim());
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
