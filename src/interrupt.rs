//! The wish of whoever runs the program that it should end.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set once by a signal, never taken back. Loops that take longer than a second without writing anything look at it.
pub static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Whether the program should end.
pub fn is_asked() -> bool {
    INTERRUPT.load(Ordering::Relaxed)
}
