//! A hint to the processor that something will soon be needed from memory.

/// Asks for the cache line of `slice[index]`, if there is such an item. Changes nothing but the time that it takes to come; does nothing where the
/// processor has no such hint.
///
/// ```
/// # let (masses, numbers) = (vec![1.0; 100], [7, 93, 12]);
/// // Two misses at once, in place of one after the other.
/// impinge_events::prefetch(&masses, numbers[1]);
/// let sum = masses[numbers[0]] + masses[numbers[1]];
/// # assert_eq!(sum, 2.0);
/// ```
#[inline]
pub fn prefetch<T>(slice: &[T], index: usize) {
    #[cfg(target_feature = "sse")]
    if let Some(item) = slice.get(index) {
        safe_arch::prefetch_t0(item);
    }
    #[cfg(not(target_feature = "sse"))]
    let _ = (slice, index);
}
