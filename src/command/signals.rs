//! Signals: the first asks for a clean end, the second ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

use monolayer::output::console;
use monolayer::run::unsaved::has_unsaved_work;

use crate::{Failure, INTERRUPT};

/// Exit code of what was interrupted.
const INTERRUPTED: i32 = 130;

/// Takes Ctrl-C, a request to end, and the loss of the terminal for a wish to end cleanly; what is done until then is
/// told.
///
/// Before there is anything to finish, the process ends at once. So it does at the second request, for which a terminal
/// that was lost does not count: a shell that goes down may say it twice. A signal that was ignored when the program
/// began, as by `nohup`, stays ignored.
///
/// # Errors
/// A system that takes no handlers.
pub fn catch(doing: &'static str) -> Result<(), Failure> {
    system::watch(move |kind| {
        static ASKED: AtomicBool = AtomicBool::new(false);
        let again = kind == EndCause::BodyOutputs && ASKED.swap(true, Ordering::SeqCst);
        if again {
            std::process::exit(INTERRUPTED);
        }
        if end(doing) && kind == EndCause::BodyOutputs {
            // a terminal that takes nothing must not keep the next signal waiting
            std::thread::spawn(move || console::note(&format!("interrupted: {doing} (again to stop at once)")));
        }
    })
}

/// Asks for a clean end, if there is something to finish, or ends.
fn end(doing: &str) -> bool {
    let first = !INTERRUPT.swap(true, Ordering::SeqCst);
    if !has_unsaved_work() {
        if first && !doing.is_empty() {
            console::note("interrupted before there was anything to save");
        }
        std::process::exit(INTERRUPTED);
    }
    first
}

/// Asks for a clean end once standard input is closed.
pub fn end_with_input() {
    std::thread::spawn(|| {
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        end("");
    });
}

/// Why the process should end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EndCause {
    /// By somebody, or by a system that goes down.
    BodyOutputs,
    /// The terminal is gone.
    HungUp,
}

#[cfg(unix)]
mod system {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    use super::{EndCause, Failure};

    pub(super) fn watch(then: impl Fn(EndCause) + Send + 'static) -> Result<(), Failure> {
        let ignored = ignored();
        let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| (ignored >> (signal - 1)) & 1 == 0);
        let mut signals = Signals::new(heard)?;
        std::thread::spawn(move || {
            for signal in &mut signals {
                then(if signal == SIGHUP { EndCause::HungUp } else { EndCause::BodyOutputs });
            }
        });
        Ok(())
    }

    /// Signals that are ignored, as bits, where the system tells.
    fn ignored() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
    }
}

#[cfg(not(unix))]
mod system {
    use super::{EndCause, Failure};

    pub(super) fn watch(then: impl Fn(EndCause) + Send + 'static) -> Result<(), Failure> {
        ctrlc::set_handler(move || then(EndCause::BodyOutputs))?;
        Ok(())
    }
}
