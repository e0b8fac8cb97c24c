//! The fast calendar: a tournament (winner) tree over the owners.

use std::cmp::Ordering;

use super::{Calendar, Event, Kind};

/// One player: when its event is, and whose it is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    time: f64,
    owner: u32,
}

/// An owner without an event never wins.
const ABSENT: Entry = Entry { time: f64::INFINITY, owner: NOBODY };
const NOBODY: u32 = u32::MAX;
const NO_EVENT: Event = Event { time: f64::INFINITY, kind: Kind::Exit, partner: u32::MAX };

/// A calendar as a complete binary tree of matches, each between two players; the winner plays in the next match.
///
/// To reschedule an owner replays its matches on the way to the final and stops at the first that somebody else wins as before,
/// which for most events is one of the first few.
#[derive(Clone, Debug, Default)]
pub struct Tournament {
    /// The winner of match k plays on side k % 2 of match k / 2. Match 1 is the final; its winner stands in match 0. The owners 2k
    /// and 2k + 1 meet first, in match `first_round` + k.
    matches: Vec<[Entry; 2]>,
    first_round: usize,
    events: Vec<Event>,
}

/// The winner of a match.
#[inline]
fn winner([left, right]: [Entry; 2], events: &[Event]) -> Entry {
    if left.time < right.time {
        left
    } else if right.time < left.time {
        right
    } else {
        winner_of_simultaneous(left, right, events)
    }
}

#[cold]
fn winner_of_simultaneous(left: Entry, right: Entry, events: &[Event]) -> Entry {
    let event = |entry: Entry| events.get(entry.owner as usize).unwrap_or(&NO_EVENT);
    match event(left).order(left.owner, event(right), right.owner) {
        Ordering::Greater => right,
        _ => left,
    }
}

impl Tournament {
    /// Replays the matches of `owner`.
    #[inline]
    fn replay(&mut self, owner: u32, entry: Entry) {
        let Self { matches, events, first_round } = self;
        let (mut number, mut side) = (*first_round + owner as usize / 2, owner as usize % 2);
        let mut player = entry;
        loop {
            let match_ = &mut matches[number];
            // The same owner at the same time may have another event, and stand elsewhere among simultaneous ones.
            if player.owner != owner && match_[side] == player {
                break;
            }
            match_[side] = player;
            if number == 0 {
                break;
            }
            player = winner(*match_, events);
            (number, side) = (number / 2, number % 2);
        }
    }
}

impl Calendar for Tournament {
    fn reserve(&mut self, owners: usize) {
        if owners <= 2 * self.first_round {
            return;
        }
        self.first_round = owners.next_power_of_two().max(2) / 2;
        self.events.resize(2 * self.first_round, NO_EVENT);
        self.matches.clear();
        self.matches.resize(2 * self.first_round, [ABSENT; 2]);
        for (owner, event) in (0..).zip(&self.events) {
            self.matches[self.first_round + owner as usize / 2][owner as usize % 2] = entry(owner, event);
        }
        for number in (1..2 * self.first_round).rev() {
            self.matches[number / 2][number % 2] = winner(self.matches[number], &self.events);
        }
    }

    #[inline]
    fn schedule(&mut self, owner: u32, event: Event) {
        if owner as usize >= self.events.len() {
            self.reserve(owner as usize + 1);
        }
        self.events[owner as usize] = event;
        self.replay(owner, entry(owner, &event));
    }

    fn cancel(&mut self, owner: u32) {
        if (owner as usize) < self.events.len() {
            self.events[owner as usize] = NO_EVENT;
            self.replay(owner, ABSENT);
        }
    }

    #[inline]
    fn next(&mut self) -> Option<(u32, Event)> {
        let first = self.matches.first()?[1];
        (first.owner != NOBODY).then(|| (first.owner, self.events[first.owner as usize]))
    }

    fn clear(&mut self) {
        self.matches.fill([ABSENT; 2]);
        self.events.fill(NO_EVENT);
    }
}

/// An owner as a player; one whose event never comes does not play.
#[inline]
fn entry(owner: u32, event: &Event) -> Entry {
    if event.time < f64::INFINITY { Entry { time: event.time, owner } } else { ABSENT }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;
    use crate::calendar::PlainCalendar;

    /// Random schedules and cancellations with many equal times: both calendars give the same events in the same order.
    #[test]
    fn tournament_equals_plain_calendar() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let (mut fast, mut plain) = (Tournament::default(), PlainCalendar::default());
        for step in 0..200_000 {
            let owner = random.random_range(0..1 + step / 500);
            if random.random_range(0..4) == 0 {
                fast.cancel(owner);
                plain.cancel(owner);
            } else {
                let kind =
                    [Kind::Crossing, Kind::Review, Kind::Grains, Kind::Surface, Kind::Exit][random.random_range(0..5)];
                let time = f64::from(random.random_range(-20..20)) / 8.0;
                let event = Event { time, kind, partner: random.random_range(0..9) };
                fast.schedule(owner, event);
                plain.schedule(owner, event);
            }
            let ends = (fast.next(), plain.next());
            let same = match ends {
                // A pair may stand in the calendar under both of its grains: then either may come first.
                (Some((a, x)), Some((b, y))) => x.order(a, &y, b) == Ordering::Equal,
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same, "step {step}: {ends:?}");
            if let Some((owner, _)) = ends.0.filter(|_| step % 3 == 0) {
                fast.cancel(owner);
                plain.cancel(owner);
            }
        }
    }

    #[test]
    fn an_event_that_never_comes_is_none() {
        let mut calendar = Tournament::default();
        calendar.schedule(3, Event { time: f64::INFINITY, kind: Kind::Grains, partner: 1 });
        assert_eq!(calendar.next(), None);
    }
}
