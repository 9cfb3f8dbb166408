//! The verification book of the Stokes solver: what it computes beside exact solutions, in every formulation.
//!
//! A [`VerificationCase`] is a chapter: its [`Task`]s are computed one by one, their results make a
//! [`CaseTable`], numbers taken from it are held against `limits.csv`. `cargo xtask verify` computes the
//! tasks side by side and writes the book; `docs/verification.md` says what each case is.
//!
//! ```
//! use gluey_verify::{CASES, CaseTable, CaseTables, Extent, judge, limits};
//!
//! let case = CASES.iter().find(|case| case.name == "integrator").expect("a case of this name");
//! let tasks = (case.tasks)(Extent::Quick);
//! let mut tables = CaseTables::default();
//! tables.insert(case.name, CaseTable::new(case, tasks.iter().map(|task| (task, task.run().ok()))));
//! let judged = judge(case.name, &(case.numbers)(&tables), &limits()?, Extent::Quick);
//! assert!(!judged.is_empty() && judged.iter().all(|judged| !judged.is_failure()));
//! # Ok::<(), gluey_verify::LimitError>(())
//! ```
//!
//! Not for programs that users run: it is a test that takes minutes and leaves pictures.

mod case;
mod cases;
mod limits;
pub mod literature;
mod method;
mod norms;
mod number;
mod plot;
mod set_up;
pub mod statistics;
mod verdict;

pub use case::{CPU_TIME, CaseTable, CaseTables, Extent, Task, TaskResult, VerificationCase, VerifyError};
pub use cases::CASES;
pub use limits::{Judged, Limit, LimitError, judge, limits, proposal};
pub use method::{FILM_METHODS, METHODS, Method};
pub use number::{Number, NumberKind};
pub use plot::{Curve, Plot};
pub use verdict::{Judgement, Wanted};
