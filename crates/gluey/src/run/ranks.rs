//! Cases whose flow and contact are shared by ranks: which can be, and what becomes of them.

use std::rc::Rc;

use gluey_distributed::{BoxFlow, Memory, SharedContact, SharedHydrodynamics, SharedSuspension};
use gluey_geom::{Dim, Space};
use gluey_parallel::{Communicator, Ranks};

use super::contacts;
use super::frames::StreamOptions;
use super::pieces::{Follows, OtherRanks};
use super::{
    RunError, RunInProgress, RunOptions, claim_outputs, flow_pieces, logged, overwrite_guard, stale_files,
};
use crate::case::{Case, Formulation, Hydrodynamics, Solver};
use crate::flow::suspension;
use crate::hydrodynamics::HydrodynamicsError;
use crate::memory::{Sharing, available};
use crate::progress::Progress;
use crate::report::RunReport;

/// Iterations after which a flow is given up.
const MOST_ITERATIONS: usize = 500;

/// Runs `case` like [`super::run`] with flow and contact that `ranks` share. All ranks call this; rank zero
/// moves the particles, writes the results and returns a report.
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
) -> Result<Option<RunReport>, RunError>
where
    Dim<D>: Space<D>,
{
    let suspension = suspension::<D>(case).map_err(HydrodynamicsError::from)?;
    let flow = BoxFlow { viscosity: 1.0, tolerance: case.flow.tolerance, max_iterations: MOST_ITERATIONS };
    let suspension = SharedSuspension { flow, suspension };
    let memory = Rc::new(Memory::default());
    if let Some(checkpoint) = &options.resume {
        flow_pieces::restore(case, checkpoint, &suspension, ranks, &memory)?;
    }
    if ranks.rank() > 0 {
        let (streams, checkpoint) = (StreamOptions::of_run(case, options), options.checkpoint.clone());
        suspension.follow_for(ranks, &memory, &mut Follows { ranks, streams, checkpoint });
        return Ok(None);
    }
    // However this ends, the others learn of it when the leader is dropped.
    let leader = SharedHydrodynamics::leading(&suspension, ranks).remembering(memory.clone());
    let contact = SharedContact::leading(contacts::of_case(case), ranks, memory.clone());
    let others = OtherRanks { ranks, memory };
    let _claims = claim_outputs(case, options, progress)?;
    overwrite_guard::check_free(case, options)?;
    stale_files::remove(case, options)?;
    let report = logged(case, options, progress, |log| {
        RunInProgress::start(case, options, log, leader, contact, Some(&others))?.finish()
    })?;
    Ok(Some(report))
}

/// How many ranks there are, and what memory there is for each: those on one machine, by its name, share what
/// is left there. All of them come to the same answer.
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
