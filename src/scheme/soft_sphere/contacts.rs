//! Contacts that are open: what each has done since the first touch.

use impinge_events::SurfaceContact;
use nalgebra::Vector3;

use super::Hertz;
use crate::scheme::stepped::{Crowd, GONE, Near, energies};
use crate::scheme::{GrainCollision, Observer, SurfaceHit};

/// Cosine of the angle (18 degrees) by which the normal of a contact with the surface may turn in a step: a grain that rolls from triangle to
/// triangle stays in contact, and one that touches the other side of a groove begins another.
const SAME_CONTACT: f64 = 0.95;

/// A contact that has begun and not ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Slot of the grain; of a pair, the lower one.
    pub(super) slot: u32,
    /// Slot of the other grain, or the element of the surface.
    pub(super) partner: u32,
    pub(super) hertz: Hertz,
    /// Unit vector from grain to partner, now.
    pub(super) normal: Vector3<f64>,
    /// Velocity of the surface, m/s.
    pub(super) surface: Vector3<f64>,
    pub(super) overlap: f64,
    /// Force that pushes the two apart, N; at the end of a contact damping may pull.
    pub(super) force: f64,
    /// What damping dissipates, W.
    power: f64,
    /// Impulse on the partner, N s.
    impulse: Vector3<f64>,
    dissipated: f64,
    deepest: f64,
    /// Step in which the two touched last.
    seen: u64,
    /// The next contact of the same slot.
    next: u32,
    touch: Touch,
}

/// How a contact began.
#[derive(Clone, Copy, Debug)]
struct Touch {
    position: Vector3<f64>,
    normal: Vector3<f64>,
    approach_speed: f64,
    /// With the surface only: element, hit order, and energies brought, J.
    element: u32,
    order: u32,
    energies: [f64; 3],
}

/// No contact.
const NONE: u32 = u32::MAX;

/// Open contacts of one sort, grains with grains or grains with the surface.
///
/// Each slot has a chain of its contacts, so that whoever touches finds its contact without a search: a grain has few.
#[derive(Clone, Debug, Default)]
pub(super) struct Contacts {
    open: Vec<Contact>,
    first: Vec<u32>,
}

impl Contacts {
    /// All that are open.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Contact> {
        self.open.iter_mut()
    }

    /// Makes place for so many grains.
    pub(super) fn resize(&mut self, grains: usize) {
        self.first.resize(grains, NONE);
    }

    /// The contact of `slot` that fits, if it is open.
    #[inline]
    fn find(&mut self, slot: u32, fits: impl Fn(&Contact) -> bool) -> Option<&mut Contact> {
        let mut at = self.first[slot as usize];
        while at != NONE && !fits(&self.open[at as usize]) {
            at = self.open[at as usize].next;
        }
        self.open.get_mut(at as usize)
    }

    /// The open contact of a pair.
    #[inline]
    pub(super) fn of_pair(&mut self, [slot, partner]: [u32; 2]) -> Option<&mut Contact> {
        self.find(slot, |contact| contact.partner == partner)
    }

    /// The open contact with the surface at `element` in direction `normal` (unit vector to the surface) that nothing has touched in step `now`.
    pub(super) fn at_surface(
        &mut self,
        slot: u32,
        element: u32,
        normal: Vector3<f64>,
        now: u64,
    ) -> Option<&mut Contact> {
        let goes_on = |contact: &Contact| contact.partner == element || contact.normal.dot(&normal) > SAME_CONTACT;
        let found = self.find(slot, |contact| contact.seen != now && goes_on(contact))?;
        found.partner = element;
        Some(found)
    }

    fn begin(&mut self, contact: Contact) -> &mut Contact {
        let at = self.open.len();
        let first = &mut self.first[contact.slot as usize];
        self.open.push(Contact { next: *first, ..contact });
        *first = at as u32;
        &mut self.open[at]
    }

    /// Opens the contact of two grains that stand to each other as `near`.
    pub(super) fn begin_pair(&mut self, crowd: &Crowd, pair: [u32; 2], near: &Near, hertz: Hertz) -> &mut Contact {
        let [a, b] = pair.map(|slot| &crowd.flights[slot as usize]);
        let touch = Touch {
            position: a.position + near.normal * a.radius,
            normal: near.normal,
            approach_speed: (a.velocity - b.velocity).dot(&near.normal),
            element: 0,
            order: 0,
            energies: [0.0; 3],
        };
        self.begin(Contact::new(pair, hertz, Vector3::zeros(), touch))
    }

    /// Opens the contact of a grain with an element of the surface, and counts the hit.
    pub(super) fn begin_at_surface(
        &mut self,
        crowd: &mut Crowd,
        slot: u32,
        (element, contact): &(u32, SurfaceContact),
        hertz: Hertz,
    ) -> &mut Contact {
        let body = crowd.body(slot);
        let position = crowd.flights[slot as usize].position - contact.normal * (body.radius + contact.gap);
        let touch = Touch {
            position,
            normal: contact.normal,
            approach_speed: (contact.velocity - body.velocity).dot(&contact.normal),
            element: *element,
            order: crowd.count_hit(slot),
            energies: energies(&body, contact),
        };
        self.begin(Contact::new([slot, *element], hertz, contact.velocity, touch))
    }

    /// Takes out the contacts that `ends` and hands each to `tell`.
    pub(super) fn end(&mut self, ends: impl Fn(&Contact) -> bool, mut tell: impl FnMut(Contact)) {
        let mut at = 0;
        while at < self.open.len() {
            if ends(&self.open[at]) {
                tell(self.take(at as u32));
            } else {
                at += 1;
            }
        }
    }

    /// Takes a contact out of its chain; the last one takes its place.
    fn take(&mut self, at: u32) -> Contact {
        let next = self.open[at as usize].next;
        *self.link_to(at) = next;
        let last = self.open.len() as u32 - 1;
        if at != last {
            *self.link_to(last) = at;
        }
        self.open.swap_remove(at as usize)
    }

    /// What points at contact `at`.
    fn link_to(&mut self, at: u32) -> &mut u32 {
        let slot = self.open[at as usize].slot as usize;
        if self.first[slot] == at {
            return &mut self.first[slot];
        }
        let mut before = self.first[slot];
        while self.open[before as usize].next != at {
            before = self.open[before as usize].next;
        }
        &mut self.open[before as usize].next
    }

    /// Gives the grains their new slots; none of those that are [`GONE`] may have a contact.
    pub(super) fn renumber(&mut self, slots: &[u32], pairs: bool) {
        self.first.clear();
        self.first.resize(slots.iter().filter(|&&slot| slot != GONE).count(), NONE);
        for (at, contact) in (0..).zip(&mut self.open) {
            contact.slot = slots[contact.slot as usize];
            if pairs {
                contact.partner = slots[contact.partner as usize];
            }
            contact.next = std::mem::replace(&mut self.first[contact.slot as usize], at);
        }
    }
}

impl Contact {
    fn new([slot, partner]: [u32; 2], hertz: Hertz, surface: Vector3<f64>, touch: Touch) -> Self {
        Self {
            slot,
            partner,
            hertz,
            normal: touch.normal,
            surface,
            overlap: 0.0,
            force: 0.0,
            power: 0.0,
            impulse: Vector3::zeros(),
            dissipated: 0.0,
            deepest: 0.0,
            seen: 0,
            next: NONE,
            touch,
        }
    }

    /// The force (N) that pushes the two apart along `normal` (from grain to partner) in step `now`, at this overlap (m), which grows at `rate` (m/s).
    #[inline]
    pub(super) fn press(&mut self, normal: Vector3<f64>, overlap: f64, rate: f64, now: u64) -> Vector3<f64> {
        let viscous = self.hertz.viscous(overlap, rate);
        self.normal = normal;
        self.overlap = overlap;
        self.force = self.hertz.elastic(overlap) + viscous;
        self.power = viscous * rate;
        self.deepest = self.deepest.max(overlap);
        self.seen = now;
        normal * self.force
    }

    /// Whether the two no longer touch in step `now`.
    pub(super) fn is_over(&self, now: u64) -> bool {
        self.seen != now
    }

    /// Ends a contact that still presses, and tells the force that the partner no longer feels, N. What the contact stores is lost to the grains.
    pub(super) fn release(&mut self) -> Vector3<f64> {
        self.dissipated += self.hertz.stored(self.overlap);
        self.normal * std::mem::take(&mut self.force)
    }

    /// Books that the force acts for `duration` (s).
    #[inline]
    pub(super) fn book(&mut self, duration: f64) {
        self.impulse += self.normal * (self.force * duration);
        self.dissipated += self.power * duration;
    }

    /// Books an impulse along the slip on the partner (N s), and what it dissipates, J.
    pub(super) fn book_friction(&mut self, on_partner: Vector3<f64>, dissipated: f64) {
        self.impulse += on_partner;
        self.dissipated += dissipated;
    }

    /// Tells of the contact of two grains, over by now.
    pub(super) fn tell_pair(&self, crowd: &mut Crowd, time: f64, observer: &mut impl Observer) {
        let slots = [self.slot, self.partner].map(|slot| slot as usize);
        let radii = slots.map(|slot| crowd.flights[slot].radius);
        let impulse_normal = self.impulse.dot(&self.touch.normal);
        let collision = GrainCollision {
            time,
            ids: slots.map(|slot| crowd.grains[slot].id),
            position: self.touch.position,
            normal: self.touch.normal,
            radii,
            impulse_normal,
            impulse_tangential: self.impulse - self.touch.normal * impulse_normal,
            approach_speed: self.touch.approach_speed,
            dissipated: self.dissipated,
            withheld: 0.0,
            overlap_over_radius: self.deepest / radii[0].min(radii[1]),
        };
        crowd.tell_collision(collision, observer);
    }

    /// Tells of the hit of a grain at the surface, over by now.
    pub(super) fn tell_hit(&self, crowd: &mut Crowd, time: f64, observer: &mut impl Observer) {
        let (on_grain, normal) = (-self.impulse, self.touch.normal);
        let impulse_normal = on_grain.dot(&normal);
        let [energy_normal, energy_tangential, energy_spin] = self.touch.energies;
        let hit = SurfaceHit {
            time,
            id: crowd.grains[self.slot as usize].id,
            mass: crowd.grains[self.slot as usize].mass,
            radius: crowd.flights[self.slot as usize].radius,
            element: self.touch.element,
            position: self.touch.position,
            normal,
            order: self.touch.order,
            impulse_normal,
            impulse_tangential: on_grain - normal * impulse_normal,
            approach_speed: self.touch.approach_speed,
            energy_normal,
            energy_tangential,
            energy_spin,
            dissipated: self.dissipated,
            withheld: 0.0,
            work: on_grain.dot(&self.surface),
            overlap_over_radius: self.deepest / crowd.flights[self.slot as usize].radius,
        };
        crowd.tell_hit(self.slot, &hit, observer);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    fn contact(pair: [u32; 2]) -> Contact {
        let hertz = Hertz::new(1e9, 1.0, 1.0, 0.8);
        let normal = Vector3::x();
        let touch = Touch { position: normal, normal, approach_speed: 1.0, element: 0, order: 0, energies: [0.0; 3] };
        Contact::new(pair, hertz, Vector3::zeros(), touch)
    }

    /// Whatever begins, ends and gets new slots, each open contact is found by its pair, and no other.
    #[test]
    fn chains_name_the_open_contacts() {
        const GRAINS: u32 = 12;
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut contacts = Contacts::default();
        contacts.resize(GRAINS as usize);
        let mut open = BTreeSet::new();
        for turn in 0..4000 {
            let pair: [u32; 2] = [random.random_range(0..GRAINS - 1), random.random_range(1..GRAINS)];
            if pair[0] >= pair[1] {
                continue;
            }
            if open.remove(&pair) {
                let mut ended = Vec::new();
                contacts.end(|open| [open.slot, open.partner] == pair, |gone| ended.push([gone.slot, gone.partner]));
                assert_eq!(ended, [pair]);
            } else {
                contacts.begin(contact(pair));
                open.insert(pair);
            }
            if turn % 100 == 0 {
                // The first grain goes, all others move up, and a new one comes last.
                contacts.end(|open| open.slot == 0, drop);
                let slots: Vec<u32> = (0..GRAINS).map(|slot| if slot == 0 { GONE } else { slot - 1 }).collect();
                contacts.renumber(&slots, true);
                contacts.resize(GRAINS as usize);
                open = open.into_iter().filter(|pair| pair[0] > 0).map(|[a, b]| [a - 1, b - 1]).collect();
            }
            for a in 0..GRAINS {
                for b in a + 1..GRAINS {
                    let found = contacts.of_pair([a, b]).map(|found| [found.slot, found.partner]);
                    assert_eq!(found, open.get(&[a, b]).copied());
                }
            }
        }
    }
}
