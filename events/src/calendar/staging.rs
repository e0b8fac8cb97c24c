//! Where owners wait until the list that they are about to enter has come from memory.

/// So many others come before an owner leaves; a power of two.
const PLACES: usize = 8;

/// The owners that came last, in turn, and the lists that they are about to enter.
#[derive(Clone, Debug)]
pub(super) struct Staging {
    entries: [Option<(u32, usize)>; PLACES],
    /// How many there have been.
    count: usize,
    /// None of those that wait is to enter the list of an earlier bucket; `i64::MAX` if nobody waits.
    earliest: i64,
}

impl Default for Staging {
    fn default() -> Self {
        Self { entries: [None; PLACES], count: 0, earliest: i64::MAX }
    }
}

impl Staging {
    /// Takes in an owner that is to enter the list of `bucket`; gives the entry that has waited longest, once there are enough.
    #[inline]
    pub(super) fn enter(&mut self, owner: u32, list: usize, bucket: i64) -> Option<(u32, usize)> {
        self.earliest = self.earliest.min(bucket);
        let place = self.count % PLACES;
        self.count = self.count.wrapping_add(1);
        self.entries[place].replace((owner, list))
    }

    /// Nobody who waits is to enter the list of an earlier bucket; `i64::MAX` if nobody waits.
    #[inline]
    pub(super) fn earliest(&self) -> i64 {
        self.earliest
    }

    /// Takes out all that wait.
    pub(super) fn take(&mut self) -> impl Iterator<Item = (u32, usize)> + use<> {
        std::mem::take(self).entries.into_iter().flatten()
    }
}
