//! `cargo xtask verify`: computes the cases of `gluey-verify`, holds them against their limits, writes the
//! book.

mod book;
mod drawing;
mod page;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::bail;
use gluey_verify::{CASES, CaseTable, CaseTables, Extent, Limit, Task, VerificationCase};

use crate::book::progress::NowAndThen;
use crate::book::{BookFailure, files, keep, schedule, write_drawing};
use crate::workspace_root;
use book::{Book, Chapter};

/// Cases to verify, and where to put the book.
#[derive(clap::Args)]
pub struct VerificationOptions {
    /// Fewer positions and coarser meshes: a minute.
    #[arg(long)]
    quick: bool,
    /// Only these cases, separated by commas; `cost` needs `discs` and `spheres`.
    #[arg(long, value_delimiter = ',', value_name = "CASES")]
    only: Vec<String>,
    /// Output folder.
    #[arg(long, default_value = "target/verification", value_name = "DIR")]
    out: PathBuf,
}

/// Computes and writes the book; whether all is well. Failures of single computations are part of it.
pub fn run(options: &VerificationOptions) -> anyhow::Result<bool> {
    let start = Instant::now();
    let VerificationOptions { quick, only, out } = options;
    files::prepare_folder(out)?;
    let limits = gluey_verify::limits()?;
    let cases = chosen(only)?;
    let extent = if *quick { Extent::Quick } else { Extent::Full };
    let mut failures = Vec::new();
    let tables = compute(&cases, extent, &mut failures);
    let chapters: Vec<Chapter> =
        cases.into_iter().map(|case| chapter(case, &tables, &limits, extent)).collect();
    for Chapter { case, drawing, .. } in &chapters {
        files::write(&out.join(format!("{}.csv", case.name)), tables.of(case.name).csv().as_bytes())?;
        write_drawing(out, case.name, drawing, &mut failures)?;
    }
    let wall_s = start.elapsed().as_secs_f64();
    let book = Book { quick: *quick, commit: commit(&workspace_root()), wall_s, chapters, failures };
    let proposals = book.chapters.iter().flat_map(|chapter| &chapter.proposals);
    let proposals: String = proposals.map(|line| format!("{line}\n")).collect();
    let texts = [
        ("numbers.csv", page::csv(&book)),
        ("proposed-limits.csv", proposals),
        ("index.html", page::html(&book)),
    ];
    texts.iter().try_for_each(|(name, text)| files::write(&out.join(name), text.as_bytes()))?;
    println!("{}", book.account());
    println!("tables, pictures and index.html are in {}", out.display());
    Ok(book.holds())
}

fn chapter(
    case: &'static VerificationCase,
    tables: &CaseTables,
    limits: &[Limit],
    extent: Extent,
) -> Chapter {
    let numbers = (case.numbers)(tables);
    let judged = gluey_verify::judge(case.name, &numbers, limits, extent);
    let free = numbers.iter().zip(&judged).filter(|(_, judged)| judged.verdict.is_none());
    let proposals =
        free.filter_map(|(number, _)| gluey_verify::proposal(case.name, number, extent)).collect();
    Chapter { case, judged, proposals, drawing: drawing::draw(&(case.plot)(tables)) }
}

fn chosen(only: &[String]) -> anyhow::Result<Vec<&'static VerificationCase>> {
    let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
    if let Some(name) = only.iter().find(|name| !names.contains(&name.as_str())) {
        bail!("there is no case {name}; the cases are {}", names.join(", "));
    }
    Ok(CASES.iter().filter(|case| only.is_empty() || only.iter().any(|name| name == case.name)).collect())
}

/// All computations of the cases, as many at a time as there are cores; the last cases, which have the
/// longest computations, go first.
fn compute(
    cases: &[&'static VerificationCase],
    extent: Extent,
    failures: &mut Vec<BookFailure>,
) -> CaseTables {
    let of_case = |case: &&'static VerificationCase| {
        (case.tasks)(extent).into_iter().map(|task| (*case, task)).collect::<Vec<_>>()
    };
    let jobs: Vec<(&'static VerificationCase, Task)> = cases.iter().rev().flat_map(of_case).collect();
    let (done, line) = (AtomicUsize::new(0), NowAndThen::default());
    let results = schedule::in_parallel(&jobs, rayon::current_num_threads(), |(_, task)| {
        let row = task.run();
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        line.print(|| format!("{done} of {} computations", jobs.len()));
        Ok(row?)
    });
    let mut rows = Vec::new();
    for ((case, task), result) in jobs.iter().zip(results) {
        let what = format!("{}, {} at {:?}", case.name, task.method, task.at);
        rows.push((case.name, task, keep(what, result, failures)));
    }
    let mut tables = CaseTables::default();
    for case in cases {
        let own = rows.iter().filter(|(of, _, _)| *of == case.name);
        tables.insert(case.name, CaseTable::new(case, own.map(|(_, task, row)| (*task, row.clone()))));
    }
    tables
}

/// The commit of the sources, and whether they have changed since; `None` where git does not know.
fn commit(root: &Path) -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").current_dir(root).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"])?;
    Some(if changed.is_empty() { commit } else { commit + " with changes" })
}

#[cfg(test)]
mod tests {
    use gluey_pictures::Canvas;
    use gluey_verify::{Judged, Judgement, Number};

    use super::*;

    fn judged(value: Option<f64>, outcome: Judgement) -> Judged {
        let verdict = Some((gluey_verify::Wanted::AtMost(1.0), outcome));
        Judged { what: "speed".into(), method: "soft".into(), value, verdict, reason: String::new() }
    }

    fn book(judged: Vec<Judged>, failures: Vec<BookFailure>) -> Book {
        let chapters =
            vec![Chapter { case: &CASES[0], judged, proposals: vec![], drawing: Canvas::new(1.0, 1.0) }];
        Book { quick: true, commit: Some("0123456789ab".into()), wall_s: 1.0, chapters, failures }
    }

    #[test]
    fn a_miss_a_missing_number_and_a_failed_computation_each_fail_the_book() {
        let good = || judged(Some(0.5), Judgement::Yes);
        assert!(book(vec![good()], vec![]).holds());
        assert!(!book(vec![good(), judged(Some(2.0), Judgement::No)], vec![]).holds());
        assert!(!book(vec![judged(None, Judgement::NotMeasured)], vec![]).holds());
        let failure = crate::book::BookFailure { what: "disc".into(), error: "broke".into() };
        assert!(!book(vec![good()], vec![failure]).holds());
    }

    #[test]
    fn page_and_table_show_number_limit_verdict_and_commit() {
        let book = book(vec![judged(Some(2.0), Judgement::No)], vec![]);
        let page = page::html(&book);
        for part in ["0123456789ab", "speed", "2.000", "at most 1", "not within"] {
            assert!(page.contains(part), "{part}");
        }
        assert!(page::csv(&book).ends_with("manufactured;speed;soft;2;at most 1;no;\n"));
        assert!(book.account().contains("error: manufactured, speed"));
    }

    #[test]
    fn unknown_cases_are_refused() {
        let error = chosen(&["disk".to_owned()]).err().expect("it is refused").to_string();
        assert!(error.starts_with("there is no case disk; the cases are manufactured, "), "{error}");
        assert_eq!(chosen(&[]).unwrap().len(), CASES.len());
    }

    /// One case from its computations to its page, and the same with a sign reversed.
    #[test]
    fn a_case_holds_and_its_mirror_image_does_not() {
        let case = CASES.iter().find(|case| case.name == "integrator").unwrap();
        let mut failures = Vec::new();
        let tables = compute(&[case], Extent::Quick, &mut failures);
        let numbers = (case.numbers)(&tables);
        let limits = gluey_verify::limits().unwrap();
        let fails = |numbers: &[Number]| {
            let judged = gluey_verify::judge(case.name, numbers, &limits, Extent::Quick);
            judged.iter().any(Judged::is_failure)
        };
        assert!(failures.is_empty() && !numbers.is_empty() && !fails(&numbers));
        let mirrored =
            |number: &gluey_verify::Number| gluey_verify::Number { value: -number.value, ..number.clone() };
        assert!(fails(&numbers.iter().map(mirrored).collect::<Vec<_>>()));
    }
}
