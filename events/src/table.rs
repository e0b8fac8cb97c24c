//! Tables that are as long as there are grains, in large pages.

use std::ops::{Deref, DerefMut};

use allocator_api2::vec::Vec;
use hugealloc::HugeAlloc;

/// A large page, bytes.
const LARGE: usize = 2 << 20;
/// Whoever asks for more than this (bytes) gets pages that nobody has used, not what was given back, which is in small pages: the limit of glibc, and a page. Room
/// that is not used takes no memory.
const ALWAYS_MAPPED: usize = (32 << 20) + LARGE;

/// A vector that asks the operating system for large pages (2 MB, where it has such) once it is as large itself.
///
/// What a collision needs of the grains around it lies anywhere in tables of many megabytes. In pages of 4 KB the processor has to find out where in memory each of these
/// is, which takes a tenth of the time of a gas of 1e5 grains and more of larger ones (`docs/performance.md`). Nothing but time depends on it.
#[derive(Debug)]
pub struct Table<T>(Vec<T, HugeAlloc>);

impl<T> Deref for Table<T> {
    type Target = Vec<T, HugeAlloc>;

    #[inline]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<T> DerefMut for Table<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// In large pages like the first.
impl<T: Clone> Clone for Table<T> {
    fn clone(&self) -> Self {
        table(self.iter().cloned())
    }
}

/// A table of these items, without room for more if it is small and their number is known.
///
/// ```
/// let mut masses = impinge_events::table([1.0, 2.5]);
/// masses.push(3.0);
/// assert_eq!(masses.iter().sum::<f64>(), 6.5);
/// ```
#[must_use]
pub fn table<T>(items: impl IntoIterator<Item = T>) -> Table<T> {
    let items = items.into_iter();
    let mut table = Table(Vec::new_in(HugeAlloc));
    make_room(&mut table, items.size_hint().0);
    table.extend(items);
    table
}

/// Makes room for so many items in all.
pub(crate) fn make_room<T>(table: &mut Table<T>, items: usize) {
    let large = items.saturating_mul(size_of::<T>()) >= LARGE;
    let room = if large { items.max(ALWAYS_MAPPED / size_of::<T>()) } else { items };
    let more = room.saturating_sub(table.len());
    table.reserve_exact(more);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_large_tables_have_more_room_than_they_need() {
        let small = table(std::iter::repeat_n([1.0; 4], 1000));
        assert_eq!((small.len(), small.capacity()), (1000, 1000));
        let large = table(std::iter::repeat_n([1.0; 4], 100_000));
        assert_eq!((large.len(), large.capacity()), (100_000, ALWAYS_MAPPED / 32));
        assert_eq!(large.iter().flatten().sum::<f64>(), 400_000.0);
        let huge = table(std::iter::repeat_n([1.0; 4], ALWAYS_MAPPED / 16));
        assert_eq!((huge.len(), huge.capacity()), (ALWAYS_MAPPED / 16, ALWAYS_MAPPED / 16));
        assert_eq!(table(std::iter::repeat_n((), 10)).len(), 10);
    }

    /// The second of two halves is a copy, and was in small pages.
    #[test]
    fn a_copy_was_not_in_memory_of_its_own() {
        let large = table(std::iter::repeat_n([1.0; 4], 100_000));
        let copy = large.clone();
        assert_eq!((&copy[..], copy.capacity()), (&large[..], large.capacity()));
    }
}
