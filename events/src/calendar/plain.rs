//! The plain calendar: a priority queue of keys.

use std::cmp::Reverse;

use ordered_float::OrderedFloat;
use priority_queue::PriorityQueue;

use super::{Calendar, Event, Kind};

/// (time, kind, lower id, higher id, partner): compares as [`Event::order`] does; the partner tells the event back.
type Key = Reverse<(OrderedFloat<f64>, Kind, u32, u32, u32)>;

/// A calendar on `priority-queue` with `ordered-float` keys: short, obvious, and the twin that the fast one is tested against.
#[derive(Clone, Debug, Default)]
pub struct PlainCalendar {
    queue: PriorityQueue<u32, Key>,
}

impl Calendar for PlainCalendar {
    fn reserve(&mut self, owners: usize) {
        self.queue.reserve(owners.saturating_sub(self.queue.len()));
    }

    fn schedule(&mut self, owner: u32, event: Event) {
        let Event { time, kind, partner } = event;
        let (low, high) = match kind {
            Kind::Grains => (owner.min(partner), owner.max(partner)),
            _ => (owner, partner),
        };
        self.queue.push(owner, Reverse((OrderedFloat(time), kind, low, high, partner)));
    }

    fn cancel(&mut self, owner: u32) {
        self.queue.remove(&owner);
    }

    fn next(&mut self) -> Option<(u32, Event)> {
        let (&owner, &Reverse((time, kind, _, _, partner))) = self.queue.peek()?;
        Some((owner, Event { time: time.into_inner(), kind, partner }))
    }

    fn clear(&mut self) {
        self.queue.clear();
    }
}
