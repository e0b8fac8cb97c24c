//! How deep grains may go into each other where forces act, and the sub-steps that are split to keep it so.
//!
//! Within a sub-step grains meet where their chords do ([`Bend`](impinge_events::Bend)). Where they accelerate away from each other their paths are
//! nearer than their chords, by up to the difference of their accelerations along the contact normal times h²/8: so much they may overlap when they
//! meet. Under gravity alone that difference is 0. But contact forces act on one grain and not on another that is about to hit it, and are many
//! times gravity where a pile is hit. At each kick, when these forces are known, all pairs that may meet are looked at, and where one would go too
//! deep the sub-step is halved, and halved again, for all: the forces of a shorter one are found anew. What is left of it follows in parts
//! as long as they may be.
//!
//! Who is deflected towards whom within a part is not known then. So where a part may be too long even for that ([`Bound`]) it first runs on a copy,
//! and if grains go too deep it is taken back and halved.

use impinge_events::contact_time::MOST_SLACKS;
use impinge_events::{Flight, Vicinity, YIELDING};
use nalgebra::Vector3;

/// Halvings at the most: a part is no shorter than 1/1024 of the sub-step, and a run in which that does not help ends with its overlap.
const MOST_HALVINGS: u32 = 10;
/// The part of what is allowed that contacts at rest may yield, and up to which others may go when they meet. What nobody foresees at a kick has the
/// rest: grains that are deflected towards each other within the sub-step, or that a surface begins to carry.
const SHARE: f64 = 0.75;
/// Pairs that are that deep in each other already may still go this much deeper, over what is allowed: shorter parts would not bring them out.
const LEAST_SHARE: f64 = 1.0 - SHARE;
/// Parts become twice as long when this part of what is allowed is used: then four times as much still is a little less.
const ROOM: f64 = 0.22;

/// A near field may become so many times as strong from one kick to the next, and a copy is at hand where it will be needed. Where there is none the bound
/// decides.
const FORESIGHT: f64 = 4.0;

/// The parts of a sub-step, of which each is the sub-step halved some times. One that is not split is its only part.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    /// How deep grains may go into each other, over the smaller radius.
    penetration: f64,
    /// How often the sub-step is halved for the current part.
    halvings: u32,
    /// How much of the sub-step the parts so far take, in the shortest parts that there are.
    taken: u32,
    /// Whether a part of twice the length would do.
    room: bool,
    /// Sub-steps that were split so far, and into how many parts.
    split: u64,
    parts: u64,
}

impl Parts {
    pub(super) fn new(penetration: f64) -> Self {
        Self { penetration, halvings: 0, taken: 0, room: true, split: 0, parts: 0 }
    }

    /// How deep grains may go into each other, over the smaller radius.
    pub(super) fn penetration(&self) -> f64 {
        self.penetration
    }

    /// Whether the current part is the last one of its sub-step.
    pub(super) fn are_over(&self) -> bool {
        self.taken == 0
    }

    /// How many sub-steps were split, and into how many parts all together.
    pub(super) fn count(&self) -> (u64, u64) {
        (self.split, self.parts)
    }

    /// Length of the longest part (s) that may come next in a sub-step of length `step` (s).
    pub(super) fn longest(&self, step: f64) -> f64 {
        part(step, self.fewest())
    }

    /// Halvings of the longest part that may come next: one fewer than now where there is room, and where it ends with one of its length.
    fn fewest(&self) -> u32 {
        let fewer = self.halvings.saturating_sub(1);
        if self.room && self.taken.is_multiple_of(ticks(fewer)) { fewer } else { self.halvings }
    }

    /// Whether the current part may stand, in which grains went so deep into each other, over the smaller radius.
    pub(super) fn stands(&mut self, deepest: f64) -> bool {
        self.room &= deepest < ROOM * self.penetration;
        deepest <= self.penetration || self.halvings == MOST_HALVINGS
    }

    /// Makes the next part shorter than this one of the same sub-step was.
    pub(super) fn take_back(&mut self, part: &Self) {
        (self.halvings, self.room) = (part.halvings + 1, false);
    }

    /// Goes on to the next part of a sub-step of length `step` (s) and gives its length (s). `depth` prepares a part of the length that it is given (s) and
    /// tells how deep grains may go into each other in it, over how deep they may.
    pub(super) fn next(&mut self, step: f64, mut depth: impl FnMut(f64) -> f64) -> f64 {
        self.halvings = self.fewest();
        let mut deepest = depth(part(step, self.halvings));
        while deepest > 1.0 && self.halvings < MOST_HALVINGS {
            // It goes with the square of the length.
            let more = (0.5 * deepest.log2()).ceil().clamp(1.0, f64::from(MOST_HALVINGS));
            self.halvings = (self.halvings + more as u32).min(MOST_HALVINGS);
            deepest = depth(part(step, self.halvings));
        }
        self.room = deepest < ROOM;
        if self.halvings > 0 || self.taken > 0 {
            self.split += u64::from(self.taken == 0);
            self.parts += 1;
        }
        self.taken = (self.taken + ticks(self.halvings)) % ticks(0);
        part(step, self.halvings)
    }
}

/// How far chords may depart from paths where grains touch, over the smallest radius: of that many times as much contacts yield, they take no more than their
/// share of `penetration`.
pub(super) fn most_sag(penetration: f64) -> f64 {
    SHARE * penetration / MOST_SLACKS - YIELDING
}

/// Length of a part (s) of a sub-step of length `step` (s); exact, as is the sum of all parts.
fn part(step: f64, halvings: u32) -> f64 {
    step / f64::from(1 << halvings)
}

/// The same in the shortest parts.
fn ticks(halvings: u32) -> u32 {
    1 << (MOST_HALVINGS - halvings)
}

/// What bounds how deep grains may go into each other, whoever meets whom.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// Strongest pull on a grain, without what contacts carry, m/s²: chords of contacts may yield in proportion to it.
    pub(super) strongest: f64,
    /// Largest acceleration of a grain, with gravity and without, m/s²: the paths of two grains are nearer than their chords by twice as much times
    /// h²/8 at the most. Gravity counts because a surface may begin to carry one of them.
    pub(super) bend: f64,
}

impl Bound {
    /// Of forces about which nothing is known.
    pub(super) const UNKNOWN: Self = Self { strongest: f64::INFINITY, bend: f64::INFINITY };

    /// How deep grains may go in a part of this length (s), over `penetration`, which is over the smallest radius (m), as are both.
    pub(super) fn depth(&self, length: f64, radius: f64, penetration: f64) -> f64 {
        let sag = 0.125 * length * length / radius;
        let yielded = MOST_SLACKS * (YIELDING + (self.strongest * sag).min(most_sag(penetration)));
        (yielded + 2.0 * self.bend * sag) / penetration
    }

    /// Whether the next part, if it is so long (s), may need a copy to go back to. `changes` is whether forces do.
    pub(super) fn is_near(&self, changes: bool, length: f64, radius: f64, penetration: f64) -> bool {
        let foresight = if changes { FORESIGHT } else { 1.0 };
        let stronger = Self { strongest: foresight * self.strongest, bend: foresight * self.bend };
        stronger.depth(length, radius, penetration) > 1.0
    }
}

/// All grains at a kick.
pub(super) struct Bends<'a> {
    /// With the velocities of their chords of the sub-step before.
    pub(super) flights: &'a [Flight],
    /// Accelerations from now on, m/s².
    pub(super) accelerations: &'a [Vector3<f64>],
    /// What all of them have in common, m/s².
    pub(super) gravity: Vector3<f64>,
    /// Length of the sub-step that has ended, and of the next one, s.
    pub(super) ended: f64,
    pub(super) step: f64,
}

impl Bends<'_> {
    /// The largest acceleration of a grain, with gravity and without, m/s².
    pub(super) fn bend(&self) -> f64 {
        let inside = self.accelerations.iter().zip(self.flights).filter(|(_, flight)| flight.radius > 0.0);
        let larger = |acceleration: &Vector3<f64>| acceleration.norm().max((acceleration - self.gravity).norm());
        inside.map(|(acceleration, _)| larger(acceleration)).fold(0.0, f64::max)
    }

    /// How deep grains may go into each other in the next sub-step, over `penetration`, which is over the smaller radius.
    ///
    /// Where there are contacts at rest, `pressing` is the largest acceleration without them (m/s²), and 0 else: when chords depart from paths
    /// by more than `penetration`, contacts at rest are looked for much farther apart than they may be.
    pub(super) fn deepest(&self, vicinity: &mut Vicinity<'_>, pressing: f64, penetration: f64) -> f64 {
        let sag = 0.125 * self.step * self.step;
        let inside = || (0..).zip(self.flights).filter(|(_, flight)| flight.radius > 0.0);
        let smallest = inside().map(|(_, flight)| flight.radius).fold(f64::INFINITY, f64::min);
        let mut deepest = pressing * sag / (penetration * smallest);
        // What two grains that bend less make together is little enough for any pair.
        let least = 0.5 * LEAST_SHARE * penetration * smallest;
        for (grain, flight) in inside() {
            if (self.accelerations[grain as usize] - self.gravity).norm() * sag > least {
                vicinity.around(grain, |other, shift| {
                    if other != grain {
                        deepest = deepest.max(self.between(flight, grain, other, shift, penetration));
                    }
                });
            }
        }
        deepest
    }

    /// The same of two grains, of which the second is seen shifted by `shift` (m).
    fn between(&self, ours: &Flight, grain: u32, other: u32, shift: Vector3<f64>, penetration: f64) -> f64 {
        let theirs = &self.flights[other as usize];
        let apart = theirs.position + shift - ours.position;
        let (distance, radius) = (apart.norm(), ours.radius.min(theirs.radius));
        let [one, two] = [grain, other].map(|grain| self.accelerations[grain as usize]);
        let parting = (two - one).dot(&apart) / distance * (0.125 * self.step * self.step);
        let velocity = theirs.velocity - ours.velocity + (two - one) * (0.5 * (self.ended + self.step));
        let gap = distance - ours.radius - theirs.radius;
        // Whoever deflects one of them, it goes no faster then, or not much.
        if gap > velocity.norm() * self.step + parting.max(0.0) {
            return 0.0;
        }
        let room = SHARE * penetration * radius + gap.min(0.0);
        parting.max(0.0) / room.max(LEAST_SHARE * penetration * radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lengths of the parts of sub-steps of 1 s, as long as the last one is not over, where grains go so deep in parts of 1 s at these times.
    fn parts_of(deep: impl Fn(f64) -> f64, until: f64) -> (Vec<f64>, Parts) {
        let (mut parts, mut lengths, mut time) = (Parts::new(1e-4), Vec::new(), 0.0);
        while time < until || !parts.are_over() {
            let length = parts.next(1.0, |length| deep(time) * length * length);
            assert!(deep(time) * length * length <= 1.0 || length == 1.0 / 1024.0, "{length} s at {time} s");
            lengths.push(length);
            time += length;
        }
        (lengths, parts)
    }

    #[test]
    fn what_is_shallow_is_not_split() {
        let (lengths, parts) = parts_of(|_| 1.0, 5.0);
        assert_eq!(lengths, [1.0; 5]);
        assert_eq!(parts.count(), (0, 0));
    }

    /// Sub-steps end when they would have ended anyway. A part is twice as long as the one before at the most.
    #[test]
    fn parts_are_as_short_as_they_must_and_grow_again() {
        let (lengths, parts) = parts_of(|time| if (1.3..1.6).contains(&time) { 100.0 } else { 0.5 }, 4.0);
        assert_eq!(lengths.iter().sum::<f64>(), 4.0);
        assert_eq!(lengths, [1.0; 4], "nobody looks within a sub-step that has begun");
        assert_eq!(parts.count(), (0, 0));
        let (lengths, parts) = parts_of(|time| if (1.0..1.3).contains(&time) { 15.0 } else { 0.5 }, 4.0);
        assert_eq!(lengths, [1.0, 0.25, 0.25, 0.25, 0.25, 0.5, 0.5, 1.0]);
        assert_eq!(parts.count(), (2, 6));
    }

    #[test]
    fn nothing_is_split_without_end() {
        let (lengths, parts) = parts_of(|_| f64::INFINITY, 1.0);
        assert_eq!((lengths.len(), lengths[0]), (1024, 1.0 / 1024.0));
        assert_eq!(parts.count(), (1, 1024));
    }
}
