//! Where owners wait until the list that they are about to enter has come from memory.

use super::NOBODY;

/// So many others come before an owner leaves; a power of two.
const PLACES: usize = 8;

/// The owners that came last, in turn.
#[derive(Clone, Debug)]
pub(super) struct Staging {
    owners: [u32; PLACES],
    /// How many there have been.
    count: usize,
    /// None of those that wait has an event in an earlier bucket; `i64::MAX` if nobody waits.
    earliest: i64,
}

impl Default for Staging {
    fn default() -> Self {
        Self { owners: [NOBODY; PLACES], count: 0, earliest: i64::MAX }
    }
}

impl Staging {
    /// Takes in an owner whose event is in `bucket`; gives the one that has waited longest, or [`NOBODY`].
    #[inline]
    pub(super) fn enter(&mut self, owner: u32, bucket: i64) -> u32 {
        self.earliest = self.earliest.min(bucket);
        let place = self.count % PLACES;
        self.count = self.count.wrapping_add(1);
        std::mem::replace(&mut self.owners[place], owner)
    }

    /// Takes out an owner that waits.
    #[inline]
    pub(super) fn leave(&mut self, owner: u32) {
        self.owners.iter_mut().for_each(|waits| *waits = if *waits == owner { NOBODY } else { *waits });
    }

    /// No event of those that wait is in an earlier bucket; `i64::MAX` if nobody waits.
    #[inline]
    pub(super) fn earliest(&self) -> i64 {
        self.earliest
    }

    /// Takes out all that wait.
    pub(super) fn take(&mut self) -> impl Iterator<Item = u32> + use<> {
        std::mem::take(self).owners.into_iter().filter(|&owner| owner != NOBODY)
    }
}
