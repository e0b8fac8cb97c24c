//! Grains at rest against each other hand on what one of them was given.
//!
//! A grain that is pushed a little pushes those that it touches, and they push theirs. One event at a time that goes to and fro as slowly as heat
//! spreads. Here the approach ends at all contacts at rest that the push reaches, by plastic impulses in sweeps (Moreau 1999), before any of the
//! grains is predicted anew. What that takes is of the second order in the sub-step, as the speeds of contacts at rest are of the first.

use impinge_events::calendar::Calendar;
use impinge_events::contact_time::MOST_SLACKS;
use impinge_events::{Surface, YIELDING};
use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use super::EventDriven;
use crate::scheme::resting::PAIR_REACH;

/// Approach that contacts at rest may keep, over the speed below which they are at rest: in a sub-step the overlap grows less by it than grains
/// under force may yield, or they would meet again at once.
const KEPT: f64 = 1.0 / 64.0;
/// Sweeps at the most, and grains at the most whose own contacts are looked for: what is left then is for events and the next kick.
const SWEEPS: u32 = 8;
const GRAINS: usize = 64;

/// A grain that a push may reach.
#[derive(Clone, Copy, Debug)]
struct Member {
    grain: u32,
    mass: f64,
    /// Velocity of its chord before and now, m/s.
    before: Vector3<f64>,
    now: Vector3<f64>,
    /// Velocity beyond that of its chord, m/s.
    bent: Vector3<f64>,
    /// Whether its own contacts have been looked for.
    reached: bool,
}

/// Two members that touch.
#[derive(Clone, Copy, Debug)]
struct Contact {
    first: usize,
    second: usize,
    /// From the first to the second.
    normal: Vector3<f64>,
    /// Approach that they may keep; where it is negative they are to part, m/s.
    may: f64,
    /// Whether it is the one at which the push began.
    origin: bool,
}

/// A member that touches the surface.
#[derive(Clone, Copy, Debug)]
struct Footing {
    member: usize,
    normal: Vector3<f64>,
    /// Velocity of the surface along the normal, m/s.
    speed: f64,
}

/// All that a push may reach; kept for its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Pressed {
    members: Vec<Member>,
    /// Which member a grain is.
    numbers: FxHashMap<u32, usize>,
    contacts: Vec<Contact>,
    footings: Vec<Footing>,
}

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// Ends the approach of two grains at rest against each other that touch at `time` (s, epoch time), and of all contacts at rest that feel it.
    pub(super) fn hand_on(&mut self, time: f64, grains: [u32; 2], normal: Vector3<f64>) {
        let mut pressed = std::mem::take(&mut self.force.pressed);
        let resting = self.force.resting_speed_of_pairs;
        // These two part by a trifle, or would be held again and again in no time.
        let trifle = YIELDING * self.encounters.flight(grains[0]).radius / self.epoch;
        let may = -trifle.min(KEPT * resting);
        let [first, second] = grains.map(|grain| self.member(&mut pressed, time, grain));
        pressed.contacts.push(Contact { first, second, normal, may, origin: true });
        for grain in grains {
            self.reach(&mut pressed, time, grain);
        }
        for _ in 0..SWEEPS {
            let mut quiet = true;
            // Contacts that are found on the way take part at once.
            let mut number = 0;
            while let Some(&Contact { first, second, normal, may, origin }) = pressed.contacts.get(number) {
                number += 1;
                let [one, other] = [first, second].map(|number| pressed.members[number]);
                let approach = (one.now - other.now).dot(&normal);
                // What is faster is a collision, and an event of its own.
                if approach <= may || (approach > resting && !origin) {
                    continue;
                }
                quiet = false;
                let change = normal * (approach - may.min(0.0));
                let mass = one.mass * other.mass / (one.mass + other.mass);
                let between = one.now + one.bent - other.now - other.bent - change * 0.5;
                self.force.held.dissipated_grain += mass * change.dot(&between);
                pressed.members[first].now -= change * (mass / one.mass);
                pressed.members[second].now += change * (mass / other.mass);
                for Member { grain, reached, .. } in [one, other] {
                    if !reached && pressed.members.len() < GRAINS {
                        self.reach(&mut pressed, time, grain);
                    }
                }
            }
            for &Footing { member, normal, speed } in &pressed.footings {
                let member = &mut pressed.members[member];
                let velocity = member.now + member.bent;
                let approach = speed - velocity.dot(&normal);
                if approach > 0.0 && approach <= resting {
                    quiet &= approach <= KEPT * resting;
                    let change = normal * approach;
                    let work = member.mass * approach * speed;
                    let held = &mut self.force.held;
                    held.impulse_surface += change * member.mass;
                    held.work_surface += work;
                    held.dissipated_surface += work - member.mass * change.dot(&(velocity + change * 0.5));
                    member.now += change;
                }
            }
            if quiet {
                break;
            }
        }
        self.move_on(time, &pressed);
        pressed.members.clear();
        pressed.numbers.clear();
        pressed.contacts.clear();
        pressed.footings.clear();
        self.force.pressed = pressed;
    }

    /// Gives all that were pushed their new velocities.
    fn move_on(&mut self, time: f64, pressed: &Pressed) {
        let mut chords = Vec::with_capacity(pressed.members.len());
        // The two that met are predicted anew in any case: their meeting is over.
        let moved = |&(number, member): &(usize, &Member)| number < 2 || member.now != member.before;
        for (_, member) in pressed.members.iter().enumerate().filter(moved) {
            self.encounters.bring(member.grain, time);
            let velocity = member.now + member.bent;
            self.let_go(member.grain, velocity);
            // Its acceleration is another where the surface has let it go.
            chords.push((member.grain, velocity - self.encounters.bend(member.grain).velocity(time)));
        }
        self.encounters.deflect(&chords);
    }

    /// Looks for what a grain touches.
    fn reach(&self, pressed: &mut Pressed, time: f64, grain: u32) {
        let number = self.member(pressed, time, grain);
        pressed.members[number].reached = true;
        let flight = self.true_flight_at(grain, time);
        self.encounters.surface().touches(&flight, PAIR_REACH * flight.radius, &mut |_, contact| {
            let speed = contact.velocity.dot(&contact.normal);
            pressed.footings.push(Footing { member: number, normal: contact.normal, speed });
        });
        let slack = |radius: f64| YIELDING * flight.radius.min(radius) + self.encounters.sag();
        let mut others = Vec::with_capacity(16);
        self.encounters.touching(grain, time, 0.25 * slack(flight.radius), |other, apart| others.push((other, apart)));
        // In the order of their numbers, whoever keeps the neighbours.
        others.sort_unstable_by_key(|&(other, _)| other);
        for (other, apart) in others {
            let second = self.member(pressed, time, other);
            if pressed.members[second].reached {
                continue;
            }
            let (distance, radius) = (apart.norm(), self.encounters.flight(other).radius);
            // The deeper they are in each other, the less; from half of what grains may yield on they part.
            let depth = (flight.radius + radius - distance).max(0.0) / (0.5 * MOST_SLACKS * slack(radius));
            let may = KEPT * self.force.resting_speed_of_pairs * (1.0 - depth);
            pressed.contacts.push(Contact { first: number, second, normal: apart / distance, may, origin: false });
        }
    }

    /// The number of a grain among those that are pressed.
    fn member(&self, pressed: &mut Pressed, time: f64, grain: u32) -> usize {
        let Pressed { members, numbers, .. } = pressed;
        *numbers.entry(grain).or_insert_with(|| {
            let before = self.encounters.flight(grain).velocity;
            let (mass, bent) = (self.grains[grain as usize].mass, self.encounters.bend(grain).velocity(time));
            members.push(Member { grain, mass, before, now: before, bent, reached: false });
            members.len() - 1
        })
    }
}
