//! What runs at one time has to fit into the memory together.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::run::AnyScene;

/// Lets runs in as long as their estimates fit together; one alone is always let in, and decides by itself.
#[derive(Debug)]
pub struct MemoryGate {
    /// Bytes, where the system tells.
    free: Option<f64>,
    /// Bytes that are promised, and to how many.
    promised: Mutex<(f64, usize)>,
    changed: Condvar,
}

/// A run that was let in; its bytes are free again when this is dropped.
#[derive(Debug)]
pub struct Pass<'g> {
    gate: &'g MemoryGate,
    need: f64,
    /// Bytes that it may take, where it is not alone.
    pub limit: Option<f64>,
}

impl MemoryGate {
    /// With so many bytes for all.
    pub fn new(free: Option<f64>) -> Self {
        Self { free, promised: Mutex::new((0.0, 0)), changed: Condvar::new() }
    }

    fn promised(&self) -> MutexGuard<'_, (f64, usize)> {
        self.promised.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until so many bytes are left, or nobody else is in.
    pub fn enter(&self, need: f64) -> Pass<'_> {
        let mut promised = self.promised();
        let full = |promised: &(f64, usize)| promised.1 > 0 && self.free.is_some_and(|free| promised.0 + need > free);
        while full(&promised) {
            promised = self.changed.wait(promised).unwrap_or_else(PoisonError::into_inner);
        }
        let limit = self.free.filter(|_| promised.1 > 0).map(|free| free - promised.0);
        *promised = (promised.0 + need, promised.1 + 1);
        Pass { gate: self, need, limit }
    }
}

impl Drop for Pass<'_> {
    fn drop(&mut self) {
        let mut promised = self.gate.promised();
        promised.1 -= 1;
        promised.0 = if promised.1 == 0 { 0.0 } else { promised.0 - self.need };
        drop(promised);
        self.gate.changed.notify_all();
    }
}

/// Estimate of a run's largest memory in bytes; `None` for a scene that will be refused anyway, or that needs next to
/// none.
pub fn need(scene: &AnyScene) -> Option<f64> {
    scene.bytes()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use super::MemoryGate;

    #[test]
    fn what_does_not_fit_together_runs_one_after_the_other() {
        let (gate, inside, most) = (MemoryGate::new(Some(10.0)), AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for _ in 0..6 {
                scope.spawn(|| {
                    let pass = gate.enter(4.0);
                    assert!(pass.limit.is_none_or(|limit| limit >= 4.0));
                    most.fetch_max(inside.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(20));
                    inside.fetch_sub(1, Ordering::SeqCst);
                });
            }
        });
        assert_eq!(most.load(Ordering::SeqCst), 2, "two of 4 fit into 10, three do not");
    }

    #[test]
    fn what_does_not_fit_at_all_is_let_in_alone() {
        let gate = MemoryGate::new(Some(10.0));
        assert_eq!(gate.enter(50.0).limit, None);
        let first = gate.enter(1.0);
        assert_eq!(gate.enter(2.0).limit, Some(9.0));
        drop(first);
    }
}
