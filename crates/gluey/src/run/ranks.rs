//! Cases whose flow and contact are shared by ranks: which can be, and what becomes of them.

use std::path::Path;
use std::rc::Rc;

use gluey_distributed::{BoxFlow, FlowMemory, SharedContact, SharedHydrodynamics, SharedSuspension};
use gluey_parallel::{Communicator, Ranks};

use super::contacts::CaseContact;
use super::sharing::RunRanks;
use super::{RunError, RunInProgress, RunOptions, flow_pieces, prepare};
use crate::case::{Case, Formulation, Hydrodynamics, Solver};
use crate::flow::suspension;
use crate::hydrodynamics::HydrodynamicsError;
use crate::memory::{Sharing, available};
use crate::progress::{Progress, Silent};
use crate::report::RunReport;

/// Iterations after which a flow is given up.
const MOST_ITERATIONS: usize = 500;

/// Runs `case` like [`super::run`] with flow and contact that `ranks` share. All ranks call this and do the
/// same steps; rank zero writes the results and returns a report.
pub fn run_shared(
    case: &Case,
    options: &RunOptions,
    progress: &dyn Progress,
    ranks: &Ranks,
) -> Result<Option<RunReport>, RunError> {
    case.check()?;
    check(case)?;
    crate::memory::check_shared(case, options.memory_limit, sharing(ranks))?;
    match case.dimension {
        2 => run_beside::<2>(case, options, progress, ranks),
        _ => run_beside::<3>(case, options, progress, ranks),
    }
}

fn run_beside<const D: usize>(
    case: &Case,
    options: &RunOptions,
    progress: &dyn Progress,
    ranks: &Ranks,
) -> Result<Option<RunReport>, RunError> {
    let suspension = suspension::<D>(case).map_err(HydrodynamicsError::from)?;
    let flow = BoxFlow { viscosity: 1.0, tolerance: case.flow.tolerance, max_iterations: MOST_ITERATIONS };
    let suspension = SharedSuspension { flow, suspension };
    let memory = Rc::new(FlowMemory::default());
    if let Some(checkpoint) = &options.resume {
        flow_pieces::restore(case, checkpoint, &suspension, ranks, &memory)?;
    }
    let flow = SharedHydrodynamics::new(&suspension, ranks).remembering(memory.clone());
    let contact = CaseContact::of_case(case, |contact| SharedContact::new(contact, ranks));
    let keep_flow = |checkpoint: &Path, name| flow_pieces::write(checkpoint, name, &memory.saved());
    let sharing = RunRanks { ranks: ranks.clone(), keep_flow: Some(&keep_flow) };
    let prepared = sharing.is_first().then(|| prepare(case, options, progress)).transpose();
    let prepared = sharing.agreed(prepared)?;
    let log = prepared.as_ref().map(|(_, log)| log);
    let listener = log.map_or(&Silent as &dyn Progress, |log| log);
    let started = RunInProgress::start(case, options, listener, flow, contact, &sharing);
    let outcome = sharing.agreed(started).and_then(RunInProgress::finish);
    log.into_iter().for_each(|log| log.end(&outcome));
    outcome
}

/// Number of ranks and the memory there is for each: those on one machine, by its name, share what is left
/// there. All of them come to the same answer.
fn sharing(ranks: &Ranks) -> Sharing {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let machine = name.bytes().fold(0u64, |hash, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let machines = ranks.all_gather(&[machine]);
    let here = machines.into_iter().filter(|&other| other == machine).count() as u64;
    let own = available().map_or(u64::MAX, |bytes| bytes / here);
    let least = ranks.all_gather(&[own]).into_iter().min();
    Sharing { ranks: ranks.size(), available: least.filter(|&bytes| bytes < u64::MAX) }
}

/// Refuses what ranks cannot share.
fn check(case: &Case) -> Result<(), RunError> {
    let refused = [
        (case.flow.hydrodynamics != Hydrodynamics::Stokes, "hydrodynamics other than stokes"),
        (case.flow.formulation == Formulation::Paper, "the formulation paper"),
        (case.flow.solver == Solver::Direct, "the direct solver"),
    ];
    match refused.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, what)) => Err(RunError::NotShared { what }),
        None => Ok(()),
    }
}
