//! What lies before each owner, in few bytes.

use super::{Event, Kind};

/// No partner.
pub(crate) const NOBODY: u32 = u32::MAX;

pub(crate) const fn never(kind: Kind) -> Event {
    Event { time: f64::INFINITY, kind, partner: NOBODY }
}

/// The earlier of two times, none of which is NaN: one instruction, where `f64::min` takes five.
#[inline]
pub(crate) fn earlier(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

/// The earliest of each sort of event that lies before an owner. Only the first of them is in the calendar; the calendar keeps the rest for
/// [`Encounters`](crate::Encounters) and knows nothing of it.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    pair_time: f64,
    side_time: f64,
    crossing_time: f64,
    pair_partner: u32,
    side_partner: u32,
    /// Until when the surface has been looked at, s, rounded down.
    looked_until: f32,
    /// Through which side of its cell the owner leaves it.
    cell_side: u8,
    pair_is_review: bool,
    side_is_exit: bool,
    stopped_by_surface: bool,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            pair_time: f64::INFINITY,
            side_time: f64::INFINITY,
            crossing_time: f64::INFINITY,
            pair_partner: NOBODY,
            side_partner: NOBODY,
            looked_until: f32::NEG_INFINITY,
            cell_side: 0,
            pair_is_review: true,
            side_is_exit: true,
            stopped_by_surface: true,
        }
    }
}

impl Plan {
    /// Nothing yet, for an owner that the surface stops or does not.
    pub(crate) fn new(stopped_by_surface: bool) -> Self {
        Self { stopped_by_surface, ..Self::default() }
    }

    /// The event with another grain ([`Kind::Grains`]) or, where that grain has been deflected meanwhile, a new look ([`Kind::Review`]).
    #[inline]
    pub(crate) fn pair(&self) -> Event {
        let kind = if self.pair_is_review { Kind::Review } else { Kind::Grains };
        Event { time: self.pair_time, kind, partner: self.pair_partner }
    }

    #[inline]
    pub(crate) fn set_pair(&mut self, event: Event) {
        (self.pair_time, self.pair_partner) = (event.time, event.partner);
        self.pair_is_review = event.kind == Kind::Review;
    }

    /// The event with the surface or a side of the domain.
    #[inline]
    pub(crate) fn side(&self) -> Event {
        let kind = if self.side_is_exit { Kind::Exit } else { Kind::Surface };
        Event { time: self.side_time, kind, partner: self.side_partner }
    }

    /// When that is, s.
    #[inline]
    pub(crate) fn side_time(&self) -> f64 {
        self.side_time
    }

    #[inline]
    pub(crate) fn set_side(&mut self, event: Event) {
        (self.side_time, self.side_partner) = (event.time, event.partner);
        self.side_is_exit = event.kind == Kind::Exit;
    }

    /// Out of the cell of a grain, through its side `partner`.
    #[inline]
    pub(crate) fn crossing(&self) -> Event {
        Event { time: self.crossing_time, kind: Kind::Crossing, partner: u32::from(self.cell_side) }
    }

    #[inline]
    pub(crate) fn set_crossing(&mut self, time: f64, cell_side: u8) {
        (self.crossing_time, self.cell_side) = (time, cell_side);
    }

    /// Whether the surface stops a grain and has not been looked at until `until` (s).
    #[inline]
    pub(crate) fn has_to_look(&self, until: f64) -> bool {
        self.stopped_by_surface && f64::from(self.looked_until) < until
    }

    /// Notes that the surface has been looked at until `until` (s), and nothing earlier than that if it is minus infinity.
    #[inline]
    pub(crate) fn set_looked_until(&mut self, until: f64) {
        let rounded = until as f32;
        self.looked_until = if f64::from(rounded) > until { rounded.next_down() } else { rounded };
    }

    pub(crate) fn pass_through_surface(&mut self) {
        self.stopped_by_surface = false;
    }

    /// The first of the three; they stand in the order of their kinds, so the earlier one wins where times are equal.
    #[inline]
    pub(crate) fn first(&self) -> Event {
        let time = earlier(self.pair_time, self.side_time);
        if self.crossing_time <= time {
            self.crossing()
        } else if self.pair_time <= self.side_time {
            self.pair()
        } else {
            self.side()
        }
    }
}
