//! What lies before each grain, and the search for its next partner.

use nalgebra::Vector3;

use crate::Flight;
use crate::calendar::{Event, Kind};
use crate::contact_time::{sphere_sphere, sphere_sphere_yielding, spheres_may_touch, spheres_may_touch_two};
use crate::neighbors::Near;

/// No partner.
pub(super) const NOBODY: u32 = u32::MAX;

/// By this part of the smaller radius grains that touch under force may overlap before they meet again ([`sphere_sphere_yielding`]).
pub const YIELDING: f64 = 1e-6;

/// The earliest of each sort of event that lies before a grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// With another grain ([`Kind::Grains`]) or, where that grain has been deflected meanwhile, a new look ([`Kind::Review`]).
    pub(super) pair: Event,
    /// With the surface or a side of the domain.
    pub(super) side: Event,
    /// Until when the surface has been looked at, s.
    pub(super) looked_until: f64,
    /// Out of its cell, along the axis `partner`.
    pub(super) crossing: Event,
    /// Whether the surface stops this grain.
    pub(super) stopped_by_surface: bool,
}

pub(super) const fn never(kind: Kind) -> Event {
    Event { time: f64::INFINITY, kind, partner: NOBODY }
}

pub(super) const NO_PLAN: Plan = Plan {
    pair: never(Kind::Review),
    side: never(Kind::Exit),
    looked_until: f64::NEG_INFINITY,
    crossing: never(Kind::Crossing),
    stopped_by_surface: true,
};

impl Plan {
    /// The first of the three; they stand in the order of their kinds, so the earlier one wins where times are equal.
    #[inline]
    pub(super) fn first(&self) -> Event {
        let mut first = self.crossing;
        for event in [self.pair, self.side] {
            if event.time < first.time {
                first = event;
            }
        }
        first
    }
}

/// A search for the first grain that `grain` meets.
pub(super) struct Search<'a> {
    pub(super) grain: u32,
    pub(super) flight: Flight,
    /// Later meetings do not count, s.
    pub(super) until: f64,
    /// How far chords depart from paths (m), where grains press against each other.
    pub(super) sag: Option<f64>,
    /// End of the sub-step, s.
    pub(super) horizon: f64,
    pub(super) flights: &'a [Flight],
    pub(super) plans: &'a [Plan],
    /// The best so far.
    pub(super) best: Event,
}

impl Search<'_> {
    /// The first meeting with one of `near` that comes before all that either of the two has planned, or else what this grain has planned.
    ///
    /// Most of `near` are out of reach. To find out about two of them at once before going on with either is the fastest way.
    #[inline]
    pub(super) fn first_among(mut self, near: &mut Near) -> Event {
        if !near.here.len().is_multiple_of(2) {
            near.here.push(self.grain);
        }
        for two in near.here.as_chunks::<2>().0 {
            let flights = two.map(|other| &self.flights[other as usize]);
            let mut in_reach = spheres_may_touch_two(&self.flight, flights, self.until);
            while in_reach != 0 {
                self.consider(two[in_reach.trailing_zeros() as usize], Vector3::zeros());
                in_reach &= in_reach - 1;
            }
        }
        for &(other, shift) in &near.beyond {
            if spheres_may_touch(&self.flight, &self.flights[other as usize], shift, self.until) {
                self.consider(other, shift);
            }
        }
        self.best
    }

    /// Takes the meeting with `other` for the best if it comes before all that either of the two has planned.
    ///
    /// What `other` has planned earlier will deflect it, and then it looks for itself; so does whoever it leaves.
    #[inline(never)]
    fn consider(&mut self, other: u32, shift: Vector3<f64>) {
        if other == self.grain {
            return;
        }
        let theirs = &self.flights[other as usize];
        let met = if let Some(sag) = self.sag {
            let slack = YIELDING * self.flight.radius.min(theirs.radius) + sag;
            sphere_sphere_yielding(&self.flight, theirs, shift, slack, self.horizon)
        } else {
            sphere_sphere(&self.flight, theirs, shift)
        };
        let Some(time) = met else { return };
        if time > self.until {
            return;
        }
        let event = Event { time, kind: Kind::Grains, partner: other };
        let theirs = &self.plans[other as usize];
        // A meeting comes before the surface and the exit of either where the times are equal: the order of kinds.
        if event.is_before(self.grain, &self.best, self.grain)
            && event.is_before(self.grain, &theirs.pair, other)
            && time <= theirs.side.time
        {
            (self.best, self.until) = (event, time);
        }
    }
}
