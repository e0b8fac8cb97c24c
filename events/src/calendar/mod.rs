//! The calendar: the predicted events in time order, one for each owner.
//!
//! Every event has a place in one total order (time, kind, ids), never that of insertion; so a run does not depend on which
//! calendar keeps its events. [`PlainCalendar`] is the obvious one, [`Buckets`] the fast one, and the tests hold the
//! second against the first.

mod buckets;
mod plain;
mod plan;
mod staging;

pub use buckets::Buckets;
pub use plain::PlainCalendar;
pub use plan::Plan;
pub(crate) use plan::{NOBODY, earlier, never};

use std::cmp::Ordering;

use ordered_float::OrderedFloat;

/// What an event is. At equal times bookkeeping goes before physics, so that a prediction that is only made at that moment
/// still takes its place in the order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// The owner leaves its cell.
    Crossing,
    /// The partner that the owner would have met has been deflected: look again.
    Review,
    /// The owner and its partner, another grain, touch.
    Grains,
    /// The owner touches the element `partner` of the surface.
    Surface,
    /// The owner leaves the domain.
    Exit,
}

/// The next event of one owner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When, s (epoch time).
    pub time: f64,
    /// What.
    pub kind: Kind,
    /// With whom: a grain, an element of the surface, or 0.
    pub partner: u32,
}

impl Event {
    /// Whether this event of `owner` comes before another.
    #[inline]
    #[must_use]
    pub fn is_before(&self, owner: u32, other: &Self, other_owner: u32) -> bool {
        self.time < other.time || (self.time == other.time && self.order(owner, other, other_owner).is_lt())
    }

    /// The place of this event of `owner` in the total order (time, kind, lower id, higher id).
    #[inline]
    #[must_use]
    pub fn order(&self, owner: u32, other: &Self, other_owner: u32) -> Ordering {
        OrderedFloat(self.time).cmp(&OrderedFloat(other.time)).then_with(|| {
            let ids = |event: &Self, owner: u32| match event.kind {
                Kind::Grains => (owner.min(event.partner), owner.max(event.partner)),
                _ => (owner, event.partner),
            };
            self.kind.cmp(&other.kind).then_with(|| ids(self, owner).cmp(&ids(other, other_owner)))
        })
    }
}

/// Keeps at most one event for each owner and knows the first of them all.
pub trait Calendar: Default {
    /// Makes room for the owners 0 to `owners` - 1, keeping what is scheduled.
    fn reserve(&mut self, owners: usize);

    /// Schedules the event of `owner` in place of the one it had.
    fn schedule(&mut self, owner: u32, event: Event);

    /// Takes the event of `owner` out.
    fn cancel(&mut self, owner: u32);

    /// The first event and its owner; it stays in the calendar.
    fn next(&mut self) -> Option<(u32, Event)>;

    /// Adds to `owners`, which is empty, those whose events come soon, so that what they need can be fetched from memory: each in its turn, well before its
    /// event comes, and as a rule once. Those that were scheduled at short notice are not among them, and a calendar that does not know adds none.
    fn coming(&mut self, _owners: &mut Vec<u32>) {}

    /// Asks the memory for what is kept of `owner`, if there is such an owner.
    fn fetch(&self, _owner: u32) {}

    /// What else lies before `owner`.
    fn plan(&self, owner: u32) -> &Plan;

    /// The same, to be changed.
    fn plan_mut(&mut self, owner: u32) -> &mut Plan;

    /// Takes all events out, and leaves the plans: those to come may lie earlier than those that have been.
    fn clear(&mut self);
}
