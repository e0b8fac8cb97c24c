//! The search for the next partner of a grain.

use nalgebra::Vector3;

use crate::Flight;
use crate::calendar::{Calendar, Event, Kind};
use crate::contact_time::{sphere_sphere, sphere_sphere_yielding, spheres_may_touch};
use crate::neighbors::Near;

/// By this part of the smaller radius grains that touch under force may overlap before they meet again ([`sphere_sphere_yielding`]).
pub const YIELDING: f64 = 1e-6;

/// So many fours are looked at before going on with any: a bit each of 64.
const PART: usize = 16;

/// A search for the first grain that `grain` meets.
pub(super) struct Search<'a, C> {
    pub(super) grain: u32,
    pub(super) flight: &'a Flight,
    /// Later meetings do not count, s.
    pub(super) until: f64,
    /// How far chords depart from paths (m), where grains press against each other.
    pub(super) sag: Option<f64>,
    /// End of the sub-step, s.
    pub(super) horizon: f64,
    pub(super) flights: &'a [Flight],
    pub(super) calendar: &'a C,
    /// The best so far.
    pub(super) best: Event,
}

impl<C: Calendar> Search<'_, C> {
    /// The first meeting with one of `near` that comes before all that either of the two has planned, or else what this grain has planned.
    ///
    /// Most of `near` are out of reach. To find out about four of them at once, and about all before going on with any, is the fastest way: which are in
    /// reach cannot be foretold, and a wrong guess costs a processor as much as a look.
    #[inline]
    pub(super) fn first_among(mut self, near: &Near) -> Event {
        // Of these the compiler knows that they stay as they are.
        let (ours, flights) = (*self.flight, self.flights);
        let (here, mut left) = near.here();
        for part in here.chunks(PART) {
            let mut in_reach = 0;
            for (number, four) in part.iter().enumerate() {
                let theirs = four.map(|other| &flights[other as usize]);
                in_reach |= u64::from(spheres_may_touch(&ours, theirs, self.until)) << (4 * number);
            }
            if left < 4 * part.len() {
                // The last ones have nobody beside them.
                in_reach &= (1 << left) - 1;
            }
            left = left.saturating_sub(4 * PART);
            while in_reach != 0 {
                let number = in_reach.trailing_zeros() as usize;
                self.consider(part[number / 4][number % 4], Vector3::zeros());
                in_reach &= in_reach - 1;
            }
        }
        for few in near.beyond.chunks(4) {
            let four: [_; 4] = std::array::from_fn(|number| few[number.min(few.len() - 1)]);
            let images = four.map(|(other, shift)| {
                let theirs = &flights[other as usize];
                Flight { position: theirs.position + shift, ..*theirs }
            });
            let in_reach = spheres_may_touch(&ours, images.each_ref(), self.until);
            for (number, &(other, shift)) in few.iter().enumerate() {
                if in_reach >> number & 1 != 0 {
                    self.consider(other, shift);
                }
            }
        }
        self.best
    }

    /// Takes the meeting with `other` for the best if it comes before all that either of the two has planned.
    ///
    /// What `other` has planned earlier will deflect it, and then it looks for itself; so does whoever it leaves.
    #[inline(never)]
    fn consider(&mut self, other: u32, shift: Vector3<f64>) {
        let theirs = &self.flights[other as usize];
        let met = if let Some(sag) = self.sag {
            let slack = YIELDING * self.flight.radius.min(theirs.radius) + sag;
            sphere_sphere_yielding(self.flight, theirs, shift, slack, self.horizon)
        } else {
            sphere_sphere(self.flight, theirs, shift)
        };
        let Some(time) = met else { return };
        if time > self.until {
            return;
        }
        let event = Event { time, kind: Kind::Grains, partner: other };
        let theirs = self.calendar.plan(other);
        // A meeting comes before the surface and the exit of either where the times are equal: the order of kinds.
        if event.is_before(self.grain, &self.best, self.grain)
            && event.is_before(self.grain, &theirs.pair(), other)
            && time <= theirs.side_time()
        {
            (self.best, self.until) = (event, time);
        }
    }
}
