//! Soft spheres: contacts are forces, and time goes on in steps much shorter than a contact (Huang, Chan & Zamankhan 2010, section II).
//!
//! **Force.** [`Hertz`] along the normal, until the overlap is 0: damping may pull at the end of a contact, or restitution would come out
//! too large (0.8081 for 0.8). Two grains at the surface or at each other overlap by what their stiffness asks for; that is the error of the
//! scheme, together with contacts of several grains at once. It falls with Young's modulus as E^(-2/5), as the contact time does.
//!
//! **Friction.** The paper takes F_t = mu F_n whatever the slip, which chatters and creates energy once a contact sticks. Here the impulse of a step
//! is what ends the slip of the two, 2/7 m_eff s, and at most mu F_n h: the law of the event-driven scheme
//! (the impulse of `law::friction`), applied step by step, whose loss has a closed form. A spring along the slip (Mindlin) would give a tangential
//! restitution that hard spheres do not have, and the two schemes would not agree as E grows. With mu_s > mu_d a contact that slips at first
//! goes on slipping under mu_d until it sticks, where the impulse law compares with mu_s once. Spins take up J_t with its arm, as (3) must have it.
//!
//! **Time.** Velocity Verlet, with the velocity predicted to the end of the step (v + a h) where the damping needs it: second order, one evaluation
//! of the forces a step, and symplectic where nothing is dissipated. All steps are equal but for those that end at a sample. As the damping begins with
//! the fourth root of the overlap, restitution comes out within 0.002 at 50 steps a contact (the default) and within 0.001 at 100.
//!
//! **Records.** One a contact, told when it ends, with what it has done and how it began: approach speed, place, hit order and energy brought are
//! those of the first touch. What it dissipates is the work of damping and friction; so the residual of the ledger is the error of the
//! integration. A contact that is open when the run ends, or when its grain leaves, is told as far as it has got, what it stores counted as lost.
//! A contact without restitution (e = 0) never ends by itself: its overlap only tends to 0.

mod contacts;
mod hertz;

use impinge_events::SurfaceContact;
use nalgebra::Vector3;

use self::contacts::{Contact, Contacts};
pub use self::hertz::{Hertz, effective_modulus};
use super::stepped::{Crowd, GONE, Method, Near, even, retain};
use super::{Broken, Observer};
use crate::law::{Friction, friction};
use crate::scene;

/// Grains as soft spheres.
#[derive(Clone, Debug)]
pub struct SoftSphere {
    /// Y_eff, Pa.
    modulus: f64,
    /// Step over the shortest contact time.
    fraction: f64,
    /// Speed of the fastest impact, m/s.
    fastest: f64,
    /// Longest step, s.
    step: f64,
    /// Steps so far: what touches now has this number.
    now: u64,
    /// Of each grain at the end of the last step, m/s².
    acceleration: Vec<Vector3<f64>>,
    /// Of them, what gravity and near field give.
    pull: Vec<Vector3<f64>>,
    /// The same at the end of this step.
    next: Vec<Vector3<f64>>,
    next_pull: Vec<Vector3<f64>>,
    pairs: Contacts,
    hits: Contacts,
    /// Pairs that touch.
    touching: Vec<([u32; 2], Near)>,
    /// Contacts of one grain with the surface.
    found: Vec<(u32, SurfaceContact)>,
}

impl SoftSphere {
    /// Soft spheres of the given stiffness for the grains of `crowd`, which hit each other at up to `fastest` (m/s).
    #[must_use]
    pub fn new(settings: &scene::SoftSphere, crowd: &Crowd, fastest: f64) -> Self {
        let mut scheme = Self {
            modulus: effective_modulus(settings.young_modulus, settings.poisson_ratio),
            fraction: settings.step_fraction,
            fastest,
            step: f64::INFINITY,
            now: 0,
            acceleration: Vec::new(),
            pull: Vec::new(),
            next: Vec::new(),
            next_pull: Vec::new(),
            pairs: Contacts::default(),
            hits: Contacts::default(),
            touching: Vec::new(),
            found: Vec::new(),
        };
        scheme.shorten(crowd, 0);
        scheme
    }

    /// The longest step, s; infinity where there are no grains yet.
    #[must_use]
    pub fn longest_step(&self) -> f64 {
        self.step
    }

    /// A step is a part of the shortest contact time that grains from slot `from` on can have at the fastest impact: that of two of the smallest.
    fn shorten(&mut self, crowd: &Crowd, from: usize) {
        for slot in from..crowd.len() {
            let body = crowd.body(slot as u32);
            // The contact time goes with (m² / r)^(1/5): unlike grains have a longer one.
            let two_alike = Hertz::new(self.modulus, 0.5 * body.mass, 0.5 * body.radius, 1.0);
            self.step = self.step.min(self.fraction * two_alike.duration(self.fastest));
        }
    }

    /// Takes in the grains that have come since the last step.
    fn take_in(&mut self, crowd: &mut Crowd) -> Result<(), Broken> {
        let known = self.acceleration.len();
        if known == crowd.len() {
            return Ok(());
        }
        crowd.pull(&mut self.pull)?;
        self.acceleration.extend_from_slice(&self.pull[known..]);
        self.pairs.resize(crowd.len());
        self.hits.resize(crowd.len());
        self.shorten(crowd, known);
        Ok(())
    }

    /// Books what forces and contacts of this moment do in `duration` (s).
    fn book(&mut self, crowd: &mut Crowd, duration: f64) {
        crowd.book(&self.pull, duration);
        self.pairs.iter_mut().chain(self.hits.iter_mut()).for_each(|contact| contact.book(duration));
    }

    /// Pushes apart the pairs that touch.
    fn press_pairs(&mut self, crowd: &mut Crowd) {
        crowd.touching(&mut self.touching);
        for k in 0..self.touching.len() {
            let (pair, near) = self.touching[k];
            let contact = match self.pairs.of_pair(pair) {
                Some(open) => open,
                None if crowd.shields(pair) => continue,
                None => {
                    let hertz = self.hertz_of_pair(crowd, pair);
                    self.pairs.begin_pair(crowd, pair, &near, hertz)
                }
            };
            let [a, b] = pair.map(|slot| slot as usize);
            let rate = (crowd.flights[a].velocity - crowd.flights[b].velocity).dot(&near.normal);
            let force = contact.press(near.normal, -near.gap, rate, self.now);
            self.next[a] -= force / crowd.grains[a].mass;
            self.next[b] += force / crowd.grains[b].mass;
        }
    }

    fn hertz_of_pair(&self, crowd: &Crowd, pair: [u32; 2]) -> Hertz {
        let [a, b] = pair.map(|slot| crowd.body(slot));
        let mass = a.mass * b.mass / (a.mass + b.mass);
        let radius = a.radius * b.radius / (a.radius + b.radius);
        Hertz::new(self.modulus, mass, radius, crowd.laws().grain.restitution)
    }

    /// Pushes off the surface the grains that touch it, `step` seconds into the step.
    fn press_off_surface(&mut self, crowd: &mut Crowd, step: f64) -> Result<(), Broken> {
        for k in 0..crowd.at_surface().len() {
            let slot = crowd.at_surface()[k];
            crowd.surface_contacts(slot, step, 0.0, &mut self.found)?;
            for touching in &self.found {
                let (element, at) = touching;
                let normal = -at.normal;
                let contact = match self.hits.at_surface(slot, *element, normal, self.now) {
                    Some(open) => open,
                    None if !crowd.may_hit(slot) => continue,
                    None => {
                        let body = crowd.body(slot);
                        let restitution = crowd.laws().surface.restitution;
                        let hertz = Hertz::new(self.modulus, body.mass, body.radius, restitution);
                        self.hits.begin_at_surface(crowd, slot, touching, hertz)
                    }
                };
                let (flight, grain) = (&crowd.flights[slot as usize], &crowd.grains[slot as usize]);
                let rate = (flight.velocity - at.velocity).dot(&normal);
                let force = contact.press(normal, -at.gap, rate, self.now);
                self.next[slot as usize] -= force / grain.mass;
            }
        }
        Ok(())
    }

    /// Rubs all that touch for a step of length `step` (s), one after the other, so that friction never gives energy.
    fn rub(&mut self, crowd: &mut Crowd, step: f64) {
        let Self { pairs, hits, now, .. } = self;
        let laws = *crowd.laws();
        let touches = |contact: &&mut Contact| !contact.is_over(*now) && contact.force > 0.0;
        let pairs = pairs.iter_mut().filter(|_| laws.grain.friction != Friction::Smooth);
        for contact in pairs.filter(touches) {
            let normal = contact.normal;
            let [mut a, mut b] = [contact.slot, contact.partner].map(|slot| crowd.body(slot));
            let slip = b.velocity_at(-normal) - a.velocity_at(normal);
            let across = slip - normal * slip.dot(&normal);
            let (impulse, lost) = friction(&laws.grain, contact.hertz.mass, across, contact.force * step);
            a.take(impulse, impulse, normal);
            b.take(-impulse, -impulse, -normal);
            contact.book_friction(-impulse, lost);
            crowd.put(contact.slot, &a);
            crowd.put(contact.partner, &b);
        }
        let hits = hits.iter_mut().filter(|_| laws.surface.friction != Friction::Smooth);
        for contact in hits.filter(touches) {
            let normal = contact.normal;
            let mut body = crowd.body(contact.slot);
            let slip = contact.surface - body.velocity_at(normal);
            let across = slip - normal * slip.dot(&normal);
            let (impulse, lost) = friction(&laws.surface, contact.hertz.mass, across, contact.force * step);
            body.take(impulse, impulse, normal);
            contact.book_friction(-impulse, lost);
            crowd.put(contact.slot, &body);
        }
    }

    /// Tells of the contacts that are over.
    fn tell_ended(&mut self, crowd: &mut Crowd, time: f64, observer: &mut impl Observer) {
        let now = self.now;
        self.pairs.end(|contact| contact.is_over(now), |contact| contact.tell_pair(crowd, time, observer));
        self.hits.end(|contact| contact.is_over(now), |contact| contact.tell_hit(crowd, time, observer));
    }

    /// Cuts short the contacts of grains in slots that `stop`: their forces act no longer.
    fn cut_short(&mut self, crowd: &mut Crowd, stop: impl Fn(u32) -> bool, observer: &mut impl Observer) {
        let Self { pairs, hits, acceleration, .. } = self;
        let time = crowd.time();
        let of_pair = |contact: &Contact| stop(contact.slot) || stop(contact.partner);
        pairs.end(of_pair, |mut contact| {
            let force = contact.release();
            let [a, b] = [contact.slot, contact.partner].map(|slot| slot as usize);
            acceleration[a] += force / crowd.grains[a].mass;
            acceleration[b] -= force / crowd.grains[b].mass;
            contact.tell_pair(crowd, time, observer);
        });
        hits.end(
            |contact| stop(contact.slot),
            |mut contact| {
                let slot = contact.slot as usize;
                acceleration[slot] += contact.release() / crowd.grains[slot].mass;
                contact.tell_hit(crowd, time, observer);
            },
        );
    }
}

impl Method for SoftSphere {
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
        self.take_in(crowd)?;
        let step = even(room, self.step);
        self.now += 1;
        self.book(crowd, 0.5 * step);
        for (flight, acceleration) in crowd.flights.iter_mut().zip(&self.acceleration) {
            flight.position += (flight.velocity + acceleration * (0.5 * step)) * step;
            flight.velocity += acceleration * step;
        }
        crowd.look(step, 0.0);
        crowd.pull(&mut self.next)?;
        let far = crowd.has_near_field();
        if far {
            // What contacts add is told by them, and booking needs the rest alone.
            self.next_pull.clone_from(&self.next);
        }
        self.press_pairs(crowd);
        self.press_off_surface(crowd, step)?;
        for ((flight, next), acceleration) in crowd.flights.iter_mut().zip(&self.next).zip(&self.acceleration) {
            flight.velocity += (next - acceleration) * (0.5 * step);
        }
        std::mem::swap(&mut self.acceleration, &mut self.next);
        if far {
            std::mem::swap(&mut self.pull, &mut self.next_pull);
        }
        self.tell_ended(crowd, crowd.time() + step, observer);
        self.book(crowd, 0.5 * step);
        self.rub(crowd, step);
        Ok(step)
    }

    fn renumber(&mut self, crowd: &mut Crowd, slots: &[u32], observer: &mut impl Observer) {
        let is_gone = |slot: u32| slots[slot as usize] == GONE;
        self.cut_short(crowd, is_gone, observer);
        retain(&mut self.acceleration, slots);
        retain(&mut self.pull, slots);
        self.pairs.renumber(slots, true);
        self.hits.renumber(slots, false);
    }

    fn finish(&mut self, crowd: &mut Crowd, observer: &mut impl Observer) {
        self.cut_short(crowd, |_| true, observer);
    }
}
