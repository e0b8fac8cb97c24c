//! A hint to the processor that something will soon be needed from memory.

/// Asks for the cache line of `slice[index]`, if there is such an item. Changes nothing but the time that it takes to come.
#[inline]
pub(crate) fn prefetch<T>(slice: &[T], index: usize) {
    #[cfg(target_feature = "sse")]
    if let Some(item) = slice.get(index) {
        safe_arch::prefetch_t0(item);
    }
    #[cfg(not(target_feature = "sse"))]
    let _ = (slice, index);
}
