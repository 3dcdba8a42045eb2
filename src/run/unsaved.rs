//! What would be lost if the process ended at once.
//!
//! A signal asks whatever is at work for a clean end. Before the first step there is nothing to finish: meshes and
//! factors are made again, and may take minutes in which nobody looks at a flag. So whoever has something to save says
//! so.

use std::sync::atomic::{AtomicUsize, Ordering};

static UNSAVED: AtomicUsize = AtomicUsize::new(0);

/// While it lives, this process has something that only a clean end saves.
#[derive(Debug)]
pub struct UnsavedWork(());

impl UnsavedWork {
    /// From now on.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Self {
        UNSAVED.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for UnsavedWork {
    fn drop(&mut self) {
        UNSAVED.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Whether a clean end is worth waiting for.
pub fn has_unsaved_work() -> bool {
    UNSAVED.load(Ordering::SeqCst) > 0
}
