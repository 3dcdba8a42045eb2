//! Loops with the widest registers that the machine has.

/// Runs `work` compiled for the machine at hand. Products and sums are not fused and stay in their order, so the bits
/// are those of any machine. What `work` calls has to be inlined.
#[inline(always)]
pub fn wide<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}
