//! Frames for ParaView that several processes write in pieces: they hold what one process writes, other
//! programs read them, and a process that cannot write ends all.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use gluey::output::vtk::read_fields;
use gluey_motion::Fields;

use super::{CaseOnRanks, RANKS, line, notices, within};
use crate::{program, python};

/// Its folder of frames.
const FRAMES: &str = "near-gluey-unfitted-vtk";
/// Steps with a frame, and the words that ask for them.
const STEPS: [usize; 3] = [0, 2, 4];
const EVERY: [&str; 2] = ["--vtk", "2"];
/// Its last time.
const END: &str = "time.end=0.4";
/// Nodes of a cell in 3D.
const NODES: usize = 27;
/// Largest difference of velocities from those of one process.
const LIMIT: f64 = 1e-9;
/// What reads the files back, from the root of the workspace, and the packages it needs.
const READER: &str = "tests/read_back.py";
const PACKAGES: [&str; 2] = ["meshio", "vtk"];

impl CaseOnRanks {
    /// Pieces hold what one process writes, and others read them.
    pub(super) fn write_frames(&self) -> anyhow::Result<()> {
        let frames = self.folder().join(FRAMES);
        let alone = self.frames(RANKS[0], ".vtu")?;
        for ranks in [RANKS[1], RANKS[2]] {
            let found = self.frames(ranks, ".pvtu")?;
            for ((step, alone), found) in STEPS.iter().zip(&alone).zip(&found) {
                let difference = largest_difference(alone, found);
                within(LIMIT, difference, || format!("{ranks} ranks, a case: fields of step {step}"))?;
            }
            let listed = std::fs::read_to_string(frames.join("fields.pvd")).unwrap_or_default();
            let count = listed.matches(".pvtu\"").count();
            ensure!(count == STEPS.len(), "{ranks} ranks, a case: the collection has {listed}");
            println!("{ranks} ranks write the fields of one process in pieces");
            self.read_back(&frames)?;
        }
        self.refuse_a_piece()
    }

    /// The fields of all frames.
    fn frames(&self, ranks: &'static str, ending: &str) -> anyhow::Result<Vec<Fields<3>>> {
        line(self.command(ranks, END)?.args(EVERY))?;
        let read = |step: &usize| {
            let file = self.folder().join(FRAMES).join(format!("fields-{step:06}{ending}"));
            Ok(read_fields::<3>(&file)?)
        };
        STEPS.iter().map(read).collect()
    }

    /// By meshio and VTK, where these are or can be fetched; says so where they cannot.
    fn read_back(&self, frames: &Path) -> anyhow::Result<()> {
        let read = || {
            let mut python = Command::new(python::with_packages(&self.root, "target/read-back", &PACKAGES)?);
            let said = line(python.arg(self.root.join(READER)).arg(frames))?;
            println!("{} read back {} files", PACKAGES.join(" and "), said.lines().count());
            Ok(())
        };
        program::where_possible(read(), &format!("nothing is read back by {}", PACKAGES.join(" and ")))
    }

    /// A piece cannot be written: all ranks end with an error that names the file and the reason once.
    fn refuse_a_piece(&self) -> anyhow::Result<()> {
        let (ranks, folder) = (RANKS[2], self.folder().join("unwritable"));
        let _ = std::fs::remove_dir_all(&folder);
        // Where a file should be there is a folder.
        let file: PathBuf = folder.join(FRAMES).join("fields-000002-0001.vtu");
        std::fs::create_dir_all(&file).with_context(|| file.display().to_string())?;
        let mut command = self.command_into(&folder, ranks, END)?;
        command.args(EVERY).env("NO_COLOR", "1");
        notices(&mut command, |said| {
            let names = said.matches("fields-000002-0001.vtu: cannot write the file").count();
            names == 1 && said.matches("Is a directory (os error 21), on rank 1").count() == 1
        })?;
        println!("a piece that cannot be written ends all of {ranks} ranks, and they say why");
        Ok(())
    }
}

/// Largest difference of velocities in the same cells; nothing where cells are not the same, or there twice.
fn largest_difference(one: &Fields<3>, other: &Fields<3>) -> Option<f64> {
    let cells = |fields: &Fields<3>| -> BTreeMap<Vec<u64>, Vec<u32>> {
        let ends = |nodes: &[u32]| [nodes[0], nodes[NODES - 1]].map(|node| fields.points[node as usize]);
        let key = |nodes: &[u32]| ends(nodes).iter().flatten().map(|x| x.to_bits()).collect();
        fields.cells.chunks_exact(NODES).map(|nodes| (key(nodes), nodes.to_vec())).collect()
    };
    let (cells_of_one, cells_of_other) = (cells(one), cells(other));
    let is_same = one.cells.len() == other.cells.len()
        && cells_of_one.len() * NODES == one.cells.len()
        && cells_of_one.keys().eq(cells_of_other.keys());
    let pairs = cells_of_one.values().flatten().zip(cells_of_other.values().flatten());
    let differences = pairs.map(|(&a, &b)| (one.velocity[a as usize] - other.velocity[b as usize]).norm());
    is_same.then(|| differences.fold(0.0, |m, x| if x.is_nan() { f64::INFINITY } else { f64::max(m, x) }))
}
