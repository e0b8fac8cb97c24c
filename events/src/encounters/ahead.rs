//! What comes soon is fetched from memory while what comes now is worked on.
//!
//! Where there are so many grains that they do not fit the caches, to wait for memory is most of what a collision costs. The calendar knows
//! whose turn it is soon; each of them goes through three stages, because where the later things are is only known once the earlier ones
//! have come: its flight and its place, the cells around it, the flights and plans of the grains in these cells. These are hints: they cannot change a bit.

use super::{Encounters, Neighbors};
use crate::Surface;
use crate::calendar::{Calendar, Event, Kind};
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
    /// Those of them that will meet something, as found since the latest encounter.
    pub(super) meeting: Vec<u32>,
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
        let mut coming = std::mem::take(&mut self.ahead.coming);
        self.calendar.coming(&mut coming);
        for owner in coming.drain(..) {
            let first = self.calendar.plan(owner).first();
            self.fetch_for(owner);
            if first.kind == Kind::Grains {
                // The calendar names one of the two.
                self.calendar.fetch(first.partner);
                self.fetch_for(first.partner);
            }
        }
        self.ahead.coming = coming;
    }

    /// Takes a grain that comes soon into the first stage, and others into the next ones.
    #[inline]
    fn fetch_for(&mut self, owner: u32) {
        let Neighbors::Cells(cells) = &self.neighbors else { return };
        self.ahead.note(owner);
        prefetch(&self.flights, owner as usize);
        cells.fetch_place(owner);

        let region = |owner: u32, first: Event| {
            cells.region_of_next_search(owner, (first.kind == Kind::Crossing).then_some(first.partner as u8))
        };
        let owner = self.ahead.before_last(BETWEEN_STAGES);
        let first = self.calendar.plan(owner).first();
        if !matches!(first.kind, Kind::Crossing | Kind::Review) {
            self.ahead.meeting.push(owner);
        }
        if let Some(region) = region(owner, first) {
            cells.fetch_cells(region);
        }
        if first.kind == Kind::Crossing {
            cells.fetch_old_and_new(owner, first.partner as u8);
        }
        let owner = self.ahead.before_last(2 * BETWEEN_STAGES);
        if let Some(region) = region(owner, self.calendar.plan(owner).first()) {
            cells.visit_first_in_cells(region, |grain| {
                prefetch(&self.flights, grain as usize);
                // A meeting with it counts only if it comes before what it has planned.
                self.calendar.fetch(grain);
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use nalgebra::Vector3;
    use rand::{RngExt as _, SeedableRng as _};

    use crate::{Domain, Encounter, Encounters, Flight, NoSurface};

    /// Of a gas on a lattice of `side`³, which part of the grains that meet had been said to meet something soon.
    fn foretold(side: u32) -> f64 {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        let place = |cell: u32| Vector3::new(cell % side, cell / side % side, cell / side / side).map(f64::from);
        let mut flight = |cell| Flight {
            position: place(cell),
            time: 0.0,
            velocity: Vector3::from_fn(|_, _| random.random_range(-1.0..1.0)),
            radius: 0.3,
        };
        let domain =
            Domain { min: Vector3::zeros(), max: Vector3::repeat(f64::from(side)), periodic: true, planar: false };
        let mut gas: Encounters = Encounters::new((0..side.pow(3)).map(&mut flight), NoSurface, domain, f64::INFINITY);
        let (mut told, mut hits) = (HashSet::<u32>::new(), 0);
        let meetings = 20_000;
        for _ in 0..meetings {
            let Some((_, Encounter::Grains { a, b })) = gas.next_before(f64::INFINITY) else { panic!("a gas") };
            hits += [a, b].iter().filter(|grain| told.remove(*grain)).count();
            told.extend(gas.soon());
            let (first, second) = (*gas.flight(a), *gas.flight(b));
            // They fly apart as they came.
            gas.deflect(&[(a, second.velocity), (b, first.velocity)]);
        }
        hits as f64 / f64::from(2 * meetings)
    }

    #[test]
    fn who_meets_something_was_named_before_where_grains_do_not_fit_the_caches() {
        assert_eq!(foretold(10), 0.0);
        let part = foretold(26);
        assert!(part > 0.9, "{part}");
    }
}
