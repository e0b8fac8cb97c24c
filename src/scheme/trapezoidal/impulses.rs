//! The contacts of one step and their impulses.

use impinge_events::SurfaceContact;
use nalgebra::Vector3;
use rustc_hash::FxHashSet;

use crate::law::{Body, resolve_pair, resolve_surface};
use crate::scheme::stepped::{Crowd, Near, approaches};
use crate::scheme::{Broken, Observer};

/// The surface as the partner of a grain.
const SURFACE: u32 = u32::MAX;

/// What the contacts of one step give to each grain: each its impulse once, from the velocities that the crowd has, which are those at the
/// beginning of the step until [`finish`](Self::finish).
#[derive(Clone, Debug, Default)]
pub(super) struct Impulses {
    /// Pairs of slots, or of a slot and the surface, that have had theirs.
    met: FxHashSet<[u32; 2]>,
    /// Slots of the grains that have got any, some more than once.
    touched: Vec<u32>,
    /// What each grain has got, m/s and rad/s; 0 between steps.
    jumps: Vec<Jump>,
    /// Pairs that overlap.
    touching: Vec<([u32; 2], Near)>,
    /// Contacts of one grain with the surface.
    found: Vec<(u32, SurfaceContact)>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Jump {
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

impl Impulses {
    /// Makes place for so many grains.
    pub(super) fn resize(&mut self, grains: usize) {
        self.jumps.resize(grains, Jump::default());
    }

    /// What contacts have added to the velocity of a grain, m/s.
    #[inline]
    pub(super) fn jump(&self, slot: usize) -> Vector3<f64> {
        self.jumps[slot].velocity
    }

    /// Slots of the grains that contacts have changed, some more than once.
    pub(super) fn touched(&self) -> &[u32] {
        &self.touched
    }

    /// Looks for contacts where the grains are now, `after` seconds into the step, and says whether there were any new ones.
    pub(super) fn find(&mut self, crowd: &mut Crowd, after: f64, observer: &mut impl Observer) -> Result<bool, Broken> {
        let known = self.touched.len();
        // Without a near field only those move from one iterate to the next that contacts have changed.
        if known == 0 || crowd.has_near_field() {
            crowd.look(after, 0.0);
        } else {
            crowd.look_again(&self.touched, after, 0.0);
        }
        self.find_pairs(crowd, after, observer);
        self.find_hits(crowd, after, observer)?;
        Ok(self.touched.len() > known)
    }

    fn find_pairs(&mut self, crowd: &mut Crowd, after: f64, observer: &mut impl Observer) {
        crowd.touching(&mut self.touching);
        for k in 0..self.touching.len() {
            let (pair, near) = self.touching[k];
            let before = pair.map(|slot| crowd.body(slot));
            let contact = resolve_pair(&crowd.laws().grain, &before[0], &before[1], near.normal);
            let speeds = before[0].velocity.amax() + before[1].velocity.amax();
            if approaches(contact.approach_speed, speeds) && self.met.insert(pair) && !crowd.shields(pair) {
                (0..2).for_each(|k| self.add(pair[k], &before[k], &contact.after[k]));
                crowd.tell_pair_impulse(pair, &near, &contact, after, observer);
            }
        }
    }

    fn find_hits(&mut self, crowd: &mut Crowd, after: f64, observer: &mut impl Observer) -> Result<(), Broken> {
        for k in 0..crowd.at_surface().len() {
            let slot = crowd.at_surface()[k];
            if self.met.contains(&[slot, SURFACE]) {
                continue;
            }
            crowd.surface_contacts(slot, after, 0.0, &mut self.found)?;
            let before = crowd.body(slot);
            for k in 0..self.found.len() {
                let (element, contact) = self.found[k];
                let resolved = resolve_surface(&crowd.laws().surface, &before, contact.normal, contact.velocity);
                let speeds = before.velocity.amax() + contact.velocity.amax();
                if approaches(resolved.approach_speed, speeds) && crowd.may_hit(slot) {
                    self.met.insert([slot, SURFACE]);
                    self.add(slot, &before, &resolved.after);
                    crowd.tell_surface_impulse(slot, (element, contact), &before, &resolved, after, observer);
                }
            }
        }
        Ok(())
    }

    fn add(&mut self, slot: u32, before: &Body, after: &Body) {
        let jump = &mut self.jumps[slot as usize];
        jump.velocity += after.velocity - before.velocity;
        jump.spin += after.spin - before.spin;
        self.touched.push(slot);
    }

    /// Ends the step: spins get their share. Velocities are up to the scheme.
    pub(super) fn finish(&mut self, crowd: &mut Crowd) {
        self.met.clear();
        for slot in self.touched.drain(..) {
            let jump = std::mem::take(&mut self.jumps[slot as usize]);
            crowd.grains[slot as usize].spin += jump.spin;
        }
    }
}
