//! What observers are told of impulses.

use impinge_events::SurfaceContact;
use impinge_events::contact_time::APPROACH_ROUNDING;

use super::{Crowd, Near};
use crate::law::{Body, PairImpulse, SurfaceImpulse};
use crate::scheme::{GrainCollision, Observer, SurfaceHit};

impl Crowd {
    /// Tells of the impulse of two grains that stand to each other as `near`, `after` seconds into the step. The grains themselves stay as they are.
    pub fn tell_pair_impulse(
        &mut self,
        [a, b]: [u32; 2],
        near: &Near,
        contact: &PairImpulse,
        after: f64,
        observer: &mut impl Observer,
    ) {
        let (first, second) = (&self.flights[a as usize], &self.flights[b as usize]);
        let collision = GrainCollision {
            time: self.time() + after,
            ids: [a, b].map(|slot| self.grains[slot as usize].id),
            position: first.position + near.normal * first.radius,
            normal: near.normal,
            radii: [first.radius, second.radius],
            impulse_normal: contact.impulse.normal,
            impulse_tangential: -contact.impulse.tangential,
            approach_speed: contact.approach_speed,
            dissipated: contact.impulse.dissipated,
            withheld: 0.0,
            overlap_over_radius: -near.gap / first.radius.min(second.radius),
        };
        self.tell_collision(collision, observer);
    }

    /// Counts and tells the impulse of a grain, which was `before`, with `element` of the surface, `after` seconds into the step. The grain itself
    /// stays as it is.
    pub fn tell_surface_impulse(
        &mut self,
        slot: u32,
        (element, contact): (u32, SurfaceContact),
        before: &Body,
        resolved: &SurfaceImpulse,
        after: f64,
        observer: &mut impl Observer,
    ) {
        let order = self.count_hit(slot);
        let [energy_normal, energy_tangential, energy_spin] = energies(before, &contact);
        let hit = SurfaceHit {
            time: self.time() + after,
            id: self.grains[slot as usize].id,
            mass: before.mass,
            radius: before.radius,
            element,
            position: self.flights[slot as usize].position - contact.normal * (before.radius + contact.gap),
            normal: contact.normal,
            order,
            impulse_normal: resolved.impulse.normal,
            impulse_tangential: -resolved.impulse.tangential,
            approach_speed: resolved.approach_speed,
            energy_normal,
            energy_tangential,
            energy_spin,
            dissipated: resolved.impulse.dissipated,
            withheld: 0.0,
            work: resolved.work,
            overlap_over_radius: -contact.gap / before.radius,
        };
        self.tell_hit(slot, &hit, observer);
    }
}

/// Whether a normal speed of approach (m/s) is more than the rounding of the speeds that it is the difference of: grains that e = 0 has stopped
/// against each other would go on colliding as long as they overlap.
#[must_use]
pub fn approaches(approach: f64, speeds: f64) -> bool {
    approach > APPROACH_ROUNDING * speeds
}

/// Kinetic energy (J) that a grain brings to the surface, relative to it: along the normal, across it, and in its rotation.
#[must_use]
pub fn energies(grain: &Body, contact: &SurfaceContact) -> [f64; 3] {
    let arriving = grain.velocity - contact.velocity;
    let along = arriving.dot(&contact.normal);
    let across = arriving - contact.normal * along;
    [
        0.5 * grain.mass * along.powi(2),
        0.5 * grain.mass * across.norm_squared(),
        0.2 * grain.mass * grain.radius.powi(2) * grain.spin.norm_squared(),
    ]
}
