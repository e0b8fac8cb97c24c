//! What the engine does where forces act: sub-steps, synchronised kicks, contacts at rest within a sub-step.

use std::collections::BTreeMap;

use std::ops::ControlFlow;

use impinge_events::calendar::Calendar;
use impinge_events::{Bend, Flight, Surface, SurfaceContact, Vicinity};
use nalgebra::Vector3;

use super::EventDriven;
use super::pressed::Pressed;
use crate::grains::Grain;
use crate::law::{Body, External, NearField};
use crate::near_field::Singular;
use crate::scheme::Broken;
use crate::scheme::resting::PAIR_REST;

/// A contact under force whose approach speed is below this part of what the force gives in a sub-step has come to rest. A bouncing grain then
/// comes to rest early by this part of a sub-step over 1 - e.
const STICKING: f64 = 1e-8;
/// What a contact at rest leaves of an acceleration, out of the contact, over the whole of it: enough that rounding turns none of it inwards, or the
/// contact would be met again and again at the same time.
const RELIEF: f64 = 1.0 / (1u64 << 48) as f64;

/// What becomes of a contact that forces press together. [`Carried`](Self::Carried) is how runs are done; the others are there to be compared with
/// it (`examples/rest_treatments.rs`, docs/contacts-at-rest.md).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AtRest {
    /// Below what forces give in a few sub-steps it sticks, and contact forces carry it.
    #[default]
    Carried,
    /// Below that speed it is elastic; nothing sticks or is carried.
    Elastic,
    /// It collides by its law, but a hit within 0.001 radii of flight (of the fastest grain) of the one before is elastic: the TC model (Luding &
    /// McNamara 1998).
    Colliding,
}

/// What acts in a sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::scheme) struct Under {
    /// Grains nearer to each other than this (m) may be in contact at rest.
    pub(in crate::scheme) reach: f64,
    /// m/s²; what a grain that enters is accelerated at until the next sub-step.
    pub(in crate::scheme) gravity: Vector3<f64>,
    /// The near field, as it acts between two grains that touch.
    pub(in crate::scheme) near_field: Option<NearField>,
    /// Whether grains that collide see it as all others make it at that moment, and not only each other.
    pub(in crate::scheme) all_pairs: bool,
    /// How long a contact lasts for the impulse that forces give to it, s.
    pub(in crate::scheme) contact_time: f64,
    /// How far chords may depart from paths, over the smallest radius, for contacts to yield as much.
    pub(in crate::scheme) most_sag: f64,
}

/// What the treatment of contacts at rest did within sub-steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Impulse of the surface on grains, N s; counted in the velocities of chords.
    pub impulse_surface: Vector3<f64>,
    /// What gravity and near field gave to grains that came or went, beyond or short of the kick before, N s.
    pub impulse_gravity: Vector3<f64>,
    /// The same of the near field.
    pub impulse_near_field: Vector3<f64>,
    /// Kinetic energy taken from grains at contacts with each other, J; negative where some was given.
    pub dissipated_grain: f64,
    /// The same at contacts with the surface.
    pub dissipated_surface: f64,
    /// Work of a moving surface on grains, J; where it carries them, until the middle of the sub-step, as the impulse.
    pub work_surface: f64,
    /// Power of a moving surface on the grains that it carries since they came to rest on it in this sub-step, W.
    pub power_surface: f64,
}

/// A grain that the surface carries until the end of the sub-step, or until it leaves.
#[derive(Clone, Debug, Default)]
pub(super) struct Support {
    /// What the surface adds to the acceleration, m/s².
    acceleration: Vector3<f64>,
    /// Where the grain was when that changed last, m.
    place: Vector3<f64>,
    /// Normals of the contacts, and how fast (m/s) the surface moves along each.
    contacts: Vec<(Vector3<f64>, f64)>,
    /// Power of the surface, W; 0 where it does not move.
    power: f64,
}

/// What the engine keeps of forces.
#[derive(Clone, Debug, Default)]
pub(super) struct UnderForce {
    pub(super) at_rest: AtRest,
    /// Whether they act: then the epoch is a sub-step, and somebody else says when the next one starts.
    pub(super) acts: bool,
    pub(super) under: Under,
    /// Approach speed below which a contact has come to rest, m/s.
    pub(super) resting_speed: f64,
    /// The same for two grains, and for grains among others at the surface.
    pub(super) resting_speed_of_pairs: f64,
    /// Where the grains were at the last kick, m; empty without a near field, and nowhere for a grain that has come since.
    pub(super) anchors: Vec<Option<Vector3<f64>>>,
    /// Which grains touched others at the last kick.
    touching: Vec<bool>,
    /// Grains that the surface carries since they came to rest on it in this sub-step.
    pub(super) supported: BTreeMap<u32, Support>,
    /// What contacts at rest did since it was last asked.
    pub(super) held: Held,
    /// Who pushes whom; kept for its memory.
    pub(super) pressed: Pressed,
}

impl<S: Surface + Clone, C: Calendar + Clone> EventDriven<S, C> {
    /// How deep grains will have gone into each other or the surface, over the radius, by the end of the sub-step at simulated time `end` (s), if nobody
    /// enters. Between collisions paths are farthest from chords in the middle.
    pub(in crate::scheme) fn deepest_until(&mut self, end: f64) -> f64 {
        let mut ahead = Self { deepest: 0.0, ..self.clone() };
        for time in [0.5 * (self.time + end), end] {
            if ahead.advance(time, &mut (), &mut |_| ControlFlow::Continue(())).is_err() {
                return f64::INFINITY;
            }
            ahead.deepest = ahead.deepest.max(ahead.encounters.deepest_overlap(time - self.epoch_start));
        }
        ahead.deepest
    }
}

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// Starts a sub-step at the time that has been reached. `kick` is given what [`Encounters::start_sub_step`] gives it, and what grains carry; it
    /// gives the length of the sub-step (s) and the strongest acceleration (m/s²).
    pub(in crate::scheme) fn start_sub_step(
        &mut self,
        under: &Under,
        kick: impl FnOnce(&S, &mut Vicinity<'_>, &mut [Grain], &mut [Flight], &mut [Vector3<f64>]) -> (f64, f64),
    ) {
        self.force.under = *under;
        let after = self.time - self.epoch_start;
        self.natural_epoch(after);
        self.force.acts = true;
        let (grains, mut length, mut strongest) = (&mut self.grains, 0.0, 0.0);
        let touching = &mut self.force.touching;
        touching.clear();
        touching.resize(grains.len(), false);
        let most_sag = under.most_sag * self.smallest;
        self.encounters.start_sub_step(after, under.reach, |surface, vicinity, flights, accelerations| {
            for touch in vicinity.touches() {
                touching[touch.a as usize] = true;
                touching[touch.b as usize] = true;
            }
            (length, strongest) = kick(surface, vicinity, grains, flights, accelerations);
            (length, (0.125 * strongest * length * length).min(most_sag))
        });
        self.force.resting_speed = STICKING * strongest * length;
        let sticks = self.laws.grain.restitution < 1.0;
        self.force.resting_speed_of_pairs =
            if sticks { PAIR_REST * strongest * length } else { self.force.resting_speed };
        if self.force.at_rest == AtRest::Colliding {
            (self.force.resting_speed, self.force.resting_speed_of_pairs) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        }
        self.force.anchors.clear();
        if under.near_field.is_some() {
            let slots = 0..self.grains.len() as u32;
            self.force.anchors.extend(slots.map(|grain| Some(self.encounters.flight(grain).position)));
        }
        self.begin(after, length);
    }

    /// Chooses what becomes of contacts that forces press together.
    pub(in crate::scheme) fn treat(&mut self, at_rest: AtRest) {
        self.force.at_rest = at_rest;
    }

    /// What contacts at rest did until simulated time `time` (s), to which the run has been advanced, since it was last taken.
    #[must_use]
    pub fn held(&self, time: f64) -> Held {
        let given = |(&grain, support): (&u32, &Support)| self.given(grain, support, time - self.epoch_start);
        let dissipated_surface =
            self.force.held.dissipated_surface - self.force.supported.iter().map(given).sum::<f64>();
        Held { dissipated_surface, ..self.force.held }
    }

    /// What contacts at rest did in the sub-step that has ended.
    pub(in crate::scheme) fn take_held(&mut self) -> Held {
        let held = self.held(self.time);
        self.force.supported.clear();
        self.force.held = Held::default();
        held
    }

    /// Energy (J) that the surface gave to a grain that it carries until `time` (s).
    fn given(&self, grain: u32, support: &Support, time: f64) -> f64 {
        let flight = self.encounters.flight(grain).advanced_to(time);
        let place = flight.position + self.encounters.bend(grain).offset(time);
        support.acceleration.dot(&(place - support.place)) * self.grains[grain as usize].mass
    }

    /// Mass of all grains (kg), their momentum beyond that of their chords at simulated time `time` (N s), and how far that is behind the middle
    /// of the sub-step (s).
    #[must_use]
    pub fn lag(&self, time: f64) -> (f64, Vector3<f64>, f64) {
        let now = time - self.epoch_start;
        let of_grain = |grain: u32| {
            let mass = self.grains[grain as usize].mass;
            (mass, self.encounters.bend(grain).velocity(now) * mass)
        };
        let add = |sum: (f64, Vector3<f64>), one: (f64, Vector3<f64>)| (sum.0 + one.0, sum.1 + one.1);
        let (mass, lag) = self.encounters.inside().map(of_grain).fold((0.0, Vector3::zeros()), add);
        (mass, lag, if self.force.acts { now - 0.5 * self.epoch } else { 0.0 })
    }

    /// The near field has no finite value; its grains are counted over those inside.
    #[must_use]
    pub fn singular(&self, singular: &Singular) -> Broken {
        let inside: Vec<u32> = self.encounters.inside().collect();
        let id = |number: usize| self.grains[inside[number] as usize].id;
        let grains = match *singular {
            Singular::Coincident(a, b) => vec![id(a), id(b)],
            Singular::NotFinite(grain) => vec![id(grain)],
        };
        Broken::Singular { time: self.time, grains }
    }

    /// What forces give to two grains during a contact of finite duration.
    #[inline]
    pub(super) fn external(&self, grains: [u32; 2]) -> External {
        if self.force.under.contact_time == 0.0 {
            return External::default();
        }
        let force = |grain: u32| self.encounters.bend(grain).acceleration * self.grains[grain as usize].mass;
        External::new(grains.map(force), self.force.under.contact_time)
    }

    /// What grains that touch at `time` (s) lack of the velocity (m/s) that they have there: they collide with it, and go on without it. `turns` is by
    /// how much a collision without loss would change the velocity of each (m/s).
    ///
    /// First, the near field has changed since the kick. With v_c = v_half + a (tau - h/2), a that of contact, the map of a sub-step is its own
    /// reverse, and errors of many collisions do not add up to a drift.
    ///
    /// Second, what leapfrog keeps is not the energy but, for unit masses, E + h²/12 v·Kv - h²/24 a², with K the second derivatives of the potential
    /// (Hairer, Lubich & Wanner 2006, section IX.8). Seen from v_c this is ½ v_c² - w v_c·Kv_c and what a collision leaves alone, where
    /// w = ½ tau (h - tau) - h²/12 is 0 on average: left to itself it makes a random walk of the energy. Grains that collide with
    /// v_c - w K (v_c + v_c') instead keep it, as v·Kv changes by (v_c' - v_c)·K (v_c' + v_c). Momentum is kept in any case.
    ///
    /// Where the near field is not summed pair by pair, or collisions lose energy, what is not of the two that collide stays as it was at the kick,
    /// and the energy drifts at second order.
    pub(super) fn synchronisation<const N: usize>(
        &self,
        time: f64,
        grains: [u32; N],
        turns: [Vector3<f64>; N],
    ) -> [Vector3<f64>; N] {
        let mut lacks = [Vector3::zeros(); N];
        let Some(near_field) = self.force.under.near_field else { return lacks };
        for ((lack, turn), grain) in lacks.iter_mut().zip(turns).zip(grains) {
            let Some(anchor) = self.anchor(grain) else { continue };
            let flight = *self.encounters.flight(grain);
            let (mut change, mut rate) = (Vector3::zeros(), Vector3::zeros());
            let mut add = |other: u32| {
                let Some(other_anchor) = self.anchor(other).filter(|_| other != grain) else { return };
                let theirs = self.encounters.flight(other);
                let apart = self.domain.nearest(theirs.position_at(time) - flight.position_at(time));
                let at_kick = self.domain.nearest(other_anchor - anchor);
                let strength = self.grains[other as usize].strength;
                let velocity = (theirs.velocity - flight.velocity) * 2.0 - turn;
                let [force, force_rate] = near_field.force_and_rate_on(apart, velocity);
                change += (force - near_field.force_on(at_kick)) * strength;
                // What the two that collide do to each other is the same before and after.
                if !grains.contains(&other) {
                    rate += force_rate * strength;
                }
            };
            if self.force.under.all_pairs {
                self.encounters.inside().for_each(add);
            } else {
                grains.into_iter().for_each(&mut add);
            }
            let Grain { mass, strength, .. } = self.grains[grain as usize];
            let Bend { step, .. } = self.encounters.bend(grain);
            let weight = 0.5 * time * (step - time) - step * step / 12.0;
            *lack = (change * (time - 0.5 * step) + rate * weight) * (strength / mass);
        }
        lacks
    }

    /// Where a grain was at the last kick (m), if the near field acts on it since.
    #[inline]
    fn anchor(&self, grain: u32) -> Option<Vector3<f64>> {
        self.force.anchors.get(grain as usize).copied().flatten()
    }

    /// Approach speed (m/s) below which a grain has come to rest against the surface.
    pub(super) fn resting_speed_at_surface(&self, grain: u32) -> f64 {
        let grain = grain as usize;
        let among_grains =
            self.force.touching.get(grain) == Some(&true) || self.rows.get(grain).is_some_and(|row| row.among_grains());
        if among_grains { self.force.resting_speed_of_pairs } else { self.force.resting_speed }
    }

    /// A grain at rest against the surface stays so until the end of the sub-step: the surface carries what pulls it there.
    pub(super) fn hold_on_surface(
        &mut self,
        time: f64,
        grain: u32,
        before: &Body,
        contact: &SurfaceContact,
    ) -> Result<(), Broken> {
        let id = self.grains[grain as usize].id;
        let rate = (before.velocity - contact.velocity).dot(&contact.normal);
        let after = before.velocity - contact.normal * rate.min(0.0);
        self.check(time, &[id], -contact.gap / before.radius, &[after])?;
        let chord = self.encounters.flight(grain).velocity;
        let acceleration = self.encounters.bend(grain).acceleration;
        let pull = (acceleration.dot(&contact.normal) - RELIEF * acceleration.amax()).min(0.0);
        self.encounters.accelerate(grain, acceleration - contact.normal * pull);
        self.redirect(&[(grain, after)]);
        let mut support = self.release(grain);
        let speed = contact.velocity.dot(&contact.normal);
        support.acceleration -= contact.normal * pull;
        support.place = self.true_flight(grain).position;
        support.contacts.push((contact.normal, speed));
        support.power -= pull * speed * before.mass;
        let held = &mut self.force.held;
        held.impulse_surface += (self.encounters.flight(grain).velocity - chord) * before.mass;
        held.power_surface += support.power;
        let work =
            (after - before.velocity).dot(&contact.velocity) * before.mass - support.power * (time - 0.5 * self.epoch);
        held.work_surface += work;
        held.dissipated_surface += 0.5 * before.mass * (before.velocity.norm_squared() - after.norm_squared()) + work;
        self.force.supported.insert(grain, support);
        Ok(())
    }

    /// The surface no longer carries a grain that leaves it at `velocity` (m/s), faster than grains at rest push each other about.
    #[cold]
    pub(super) fn let_go(&mut self, grain: u32, velocity: Vector3<f64>) {
        let resting = self.force.resting_speed_of_pairs;
        let leaves = |(normal, speed): &(Vector3<f64>, f64)| velocity.dot(normal) - speed > resting;
        if self.force.supported.get(&grain).is_some_and(|support| support.contacts.iter().any(leaves)) {
            let support = self.release(grain);
            let chord = self.encounters.flight(grain).velocity;
            let acceleration = self.encounters.bend(grain).acceleration;
            self.encounters.accelerate(grain, acceleration - support.acceleration);
            let mass = self.grains[grain as usize].mass;
            self.force.held.impulse_surface += (self.encounters.flight(grain).velocity - chord) * mass;
        }
    }

    /// Books what the surface did to a grain that has just met something, if it has carried it, and tells how.
    pub(super) fn release(&mut self, grain: u32) -> Support {
        let Some(support) = self.force.supported.remove(&grain) else { return Support::default() };
        let time = self.encounters.flight(grain).time;
        let work = support.power * (time - 0.5 * self.epoch);
        let given = self.given(grain, &support, time);
        let held = &mut self.force.held;
        held.work_surface += work;
        held.power_surface -= support.power;
        held.dissipated_surface += work - given;
        support
    }

    /// The flight of a grain as it is at its local time: without forces the stored one.
    #[inline]
    pub(super) fn true_flight(&self, grain: u32) -> Flight {
        self.true_flight_at(grain, self.encounters.flight(grain).time)
    }

    /// The flight of a grain as it will be at `time` (s, epoch time), if nothing happens to it until then.
    #[inline]
    pub(super) fn true_flight_at(&self, grain: u32, time: f64) -> Flight {
        let mut flight = self.encounters.flight(grain).advanced_to(time);
        if self.force.acts {
            let bend = self.encounters.bend(grain);
            flight.position += bend.offset(flight.time);
            flight.velocity += bend.velocity(flight.time);
        }
        flight
    }

    /// Books what forces gave to a grain that goes (`sign` 1) or comes (-1) beyond the kick before.
    pub(super) fn pass(&mut self, grain: u32, sign: f64) {
        if self.force.acts {
            let bend = self.encounters.bend(grain);
            let mass = sign * self.grains[grain as usize].mass;
            let lag = self.encounters.flight(grain).time - 0.5 * bend.step;
            self.force.held.impulse_gravity += self.force.under.gravity * (mass * lag);
            self.force.held.impulse_near_field += (bend.acceleration - self.force.under.gravity) * (mass * lag);
        }
    }
}

/// Kinetic energy, J.
pub(super) fn energy(body: &Body) -> f64 {
    0.5 * body.mass * (body.velocity.norm_squared() + 0.4 * body.radius.powi(2) * body.spin.norm_squared())
}
