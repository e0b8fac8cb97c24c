//! What comes soon is fetched from memory while what comes now is worked on.
//!
//! Where there are so many grains that they do not fit the caches, to wait for memory is most of what a collision costs. The calendar knows
//! whose turn it is soon; each of them goes through three stages, because where the later things are is only known once the earlier ones
//! have come: its flight and its place, the cells around it, the grains in these cells. These are hints: they cannot change a bit.

use super::{Encounters, Neighbors};
use crate::Surface;
use crate::calendar::{Calendar, Kind};
use crate::prefetch::prefetch;

/// Grains from which on it pays. Fewer fit the caches, and the hints would cost more than they save.
const FEWEST_GRAINS: usize = 16_000;
/// So many owners come between two stages of one.
const BETWEEN_STAGES: usize = 3;
/// Owners that are remembered: a power of two, more than pass through all stages.
const REMEMBERED: usize = 8;
const _: () = assert!(2 * BETWEEN_STAGES < REMEMBERED);

/// Who comes soon.
#[derive(Clone, Debug, Default)]
pub(super) struct Ahead {
    /// Those that the calendar named last, kept for its memory.
    coming: Vec<u32>,
    /// The latest of all, in turn; before the first of them grain 0 stands for them.
    recent: [u32; REMEMBERED],
    count: usize,
}

impl Ahead {
    /// Notes who comes after all others so far.
    fn note(&mut self, owner: u32) {
        self.recent[self.count % REMEMBERED] = owner;
        self.count = self.count.wrapping_add(1);
    }

    /// Who was noted so many before the last.
    fn before_last(&self, others: usize) -> u32 {
        self.recent[self.count.wrapping_sub(1 + others) % REMEMBERED]
    }
}

impl<S: Surface, C: Calendar> Encounters<S, C> {
    /// Fetches what the next events will need.
    #[inline]
    pub(super) fn look_ahead(&mut self) {
        if self.flights.len() < FEWEST_GRAINS {
            return;
        }
        let Neighbors::Cells(cells) = &self.neighbors else { return };
        let mut coming = std::mem::take(&mut self.ahead.coming);
        self.calendar.coming(&mut coming);
        for owner in coming.drain(..) {
            self.ahead.note(owner);
            prefetch(&self.flights, owner as usize);
            cells.fetch_place(owner);
            let partner = self.calendar.plan(owner).pair().partner;
            self.calendar.fetch(partner);

            let region = |owner: u32| {
                let first = self.calendar.plan(owner).first();
                cells.region_of_next_search(owner, (first.kind == Kind::Crossing).then_some(first.partner as u8))
            };
            if let Some(region) = region(self.ahead.before_last(BETWEEN_STAGES)) {
                cells.fetch_cells(region);
            }
            if let Some(region) = region(self.ahead.before_last(2 * BETWEEN_STAGES)) {
                cells.visit_first_in_cells(region, |grain| prefetch(&self.flights, grain as usize));
            }
        }
        self.ahead.coming = coming;
    }
}
