//! The impulses of a step.

use impinge_events::SurfaceContact;
use nalgebra::Vector3;

use crate::law::{Body, resolve_pair, resolve_surface};
use crate::scheme::stepped::{Crowd, Near, approaches};
use crate::scheme::{Broken, Observer};

/// Finds the contacts at the beginning of a step and lets them act.
#[derive(Clone, Debug, Default)]
pub(super) struct Contacts {
    touching: Vec<([u32; 2], Near)>,
    at_surface: Vec<(u32, SurfaceContact)>,
    changes: Vec<Change>,
}

/// What an impulse adds to a grain.
#[derive(Clone, Copy, Debug)]
struct Change {
    slot: u32,
    /// m/s
    velocity: Vector3<f64>,
    /// rad/s
    spin: Vector3<f64>,
}

impl Contacts {
    /// Gives all grains that overlap something and approach it their impulses, each worked out from the velocities before any of them.
    pub(super) fn act(&mut self, crowd: &mut Crowd, observer: &mut impl Observer) -> Result<(), Broken> {
        self.changes.clear();
        self.between_grains(crowd, observer);
        self.with_surface(crowd, observer)?;
        for &Change { slot, velocity, spin } in &self.changes {
            crowd.flights[slot as usize].velocity += velocity;
            crowd.grains[slot as usize].spin += spin;
        }
        Ok(())
    }

    fn between_grains(&mut self, crowd: &mut Crowd, observer: &mut impl Observer) {
        crowd.touching(&mut self.touching);
        for (pair, near) in &self.touching {
            let before = pair.map(|slot| crowd.body(slot));
            let contact = resolve_pair(&crowd.laws().grain, &before[0], &before[1], near.normal);
            let speeds = before[0].velocity.amax() + before[1].velocity.amax();
            if approaches(contact.approach_speed, speeds) && !crowd.shields(*pair) {
                for k in [0, 1] {
                    self.changes.push(Change::of(pair[k], &before[k], &contact.after[k]));
                }
                crowd.tell_pair_impulse(*pair, near, &contact, 0.0, observer);
            }
        }
    }

    fn with_surface(&mut self, crowd: &mut Crowd, observer: &mut impl Observer) -> Result<(), Broken> {
        for k in 0..crowd.at_surface().len() {
            let slot = crowd.at_surface()[k];
            crowd.surface_contacts(slot, 0.0, 0.0, &mut self.at_surface)?;
            for &(element, contact) in &self.at_surface {
                let before = crowd.body(slot);
                let resolved = resolve_surface(&crowd.laws().surface, &before, contact.normal, contact.velocity);
                let speeds = before.velocity.amax() + contact.velocity.amax();
                if approaches(resolved.approach_speed, speeds) && crowd.may_hit(slot) {
                    self.changes.push(Change::of(slot, &before, &resolved.after));
                    crowd.tell_surface_impulse(slot, (element, contact), &before, &resolved, 0.0, observer);
                }
            }
        }
        Ok(())
    }
}

impl Change {
    fn of(slot: u32, before: &Body, after: &Body) -> Self {
        Self { slot, velocity: after.velocity - before.velocity, spin: after.spin - before.spin }
    }
}
