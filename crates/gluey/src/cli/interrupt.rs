//! Requests to stop.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::failure::INTERRUPTED;
use crate::terminal::say;

/// A flag that the first Ctrl-C sets, or the first request to terminate or hang up; the second ends the
/// program at once.
pub fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = flag.clone();
    let installed = ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::Relaxed) {
            process::exit(i32::from(INTERRUPTED));
        }
        say("stopping after this step; once more to stop at once");
    });
    if let Err(error) = installed {
        say(&format!("Ctrl-C will end the program without a checkpoint: {error}"));
    }
    flag
}
