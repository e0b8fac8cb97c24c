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
const ABSENT: Entry = Entry { time: f64::INFINITY, owner: u32::MAX };
const NO_EVENT: Event = Event { time: f64::INFINITY, kind: Kind::Exit, partner: u32::MAX };

/// A calendar as a complete binary tree: the leaves are the owners, each inner node holds the earlier of its two children.
///
/// To reschedule an owner replays its matches on the way to the root and stops at the first whose winner stays the same,
/// which for most events is one of the first few.
#[derive(Clone, Debug, Default)]
pub struct Tournament {
    /// Node 1 is the root, node k has the children 2k and 2k + 1, owner i is the leaf `leaves` + i.
    nodes: Vec<Entry>,
    leaves: usize,
    events: Vec<Event>,
}

/// The winner of a match.
#[inline]
fn earlier(left: Entry, right: Entry, events: &[Event]) -> Entry {
    if left.time < right.time {
        left
    } else if right.time < left.time {
        right
    } else {
        earlier_of_simultaneous(left, right, events)
    }
}

#[cold]
fn earlier_of_simultaneous(left: Entry, right: Entry, events: &[Event]) -> Entry {
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
        let Self { nodes, events, leaves } = self;
        let nodes = nodes.as_mut_slice();
        let mut node = *leaves + owner as usize;
        let mut winner = entry;
        nodes[node] = winner;
        while node > 1 {
            winner = earlier(winner, nodes[node ^ 1], events);
            node /= 2;
            // The same owner at the same time may be another event, and stand elsewhere among simultaneous ones.
            if winner.owner != owner && nodes[node] == winner {
                break;
            }
            nodes[node] = winner;
        }
    }
}

impl Calendar for Tournament {
    fn reserve(&mut self, owners: usize) {
        if owners <= self.leaves {
            return;
        }
        self.leaves = owners.next_power_of_two();
        self.events.resize(self.leaves, NO_EVENT);
        self.nodes.clear();
        self.nodes.resize(2 * self.leaves, ABSENT);
        for (owner, event) in (0..).zip(&self.events) {
            if event.time < f64::INFINITY {
                self.nodes[self.leaves + owner as usize] = Entry { time: event.time, owner };
            }
        }
        for node in (1..self.leaves).rev() {
            self.nodes[node] = earlier(self.nodes[2 * node], self.nodes[2 * node + 1], &self.events);
        }
    }

    #[inline]
    fn schedule(&mut self, owner: u32, event: Event) {
        if owner as usize >= self.events.len() {
            self.reserve(owner as usize + 1);
        }
        self.events[owner as usize] = event;
        let entry = if event.time < f64::INFINITY { Entry { time: event.time, owner } } else { ABSENT };
        self.replay(owner, entry);
    }

    fn cancel(&mut self, owner: u32) {
        if (owner as usize) < self.events.len() {
            self.events[owner as usize] = NO_EVENT;
            self.replay(owner, ABSENT);
        }
    }

    #[inline]
    fn next(&self) -> Option<(u32, Event)> {
        let first = *self.nodes.get(1)?;
        (first.owner != u32::MAX).then(|| (first.owner, self.events[first.owner as usize]))
    }
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
