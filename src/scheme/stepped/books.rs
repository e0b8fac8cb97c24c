//! What forces did, as the ledger wants to know it.

use nalgebra::Vector3;

use crate::scheme::Kick;
use crate::sum::{Sum, VectorSum};

/// What forces did in all.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Books {
    pub(super) impulse_gravity: VectorSum,
    pub(super) impulse_near_field: VectorSum,
    pub(super) work_near_field: Sum,
    /// m g·x of grains that left, less that of grains that entered, and what wraps at the sides of a periodic domain took, J.
    pub(super) carried_away: Sum,
    /// m g·x of the grains inside, J; none before the first look.
    pub(super) depth: Option<f64>,
}

impl Books {
    /// What has been added since `told`.
    pub(super) fn since(&self, told: &Self, time: f64, potential_energy: Option<f64>) -> Kick {
        let fallen = |(now, before): (f64, f64)| now + self.carried_away.value() - before - told.carried_away.value();
        let difference = |now: VectorSum, before: VectorSum| -> Vector3<f64> { now.value() - before.value() };
        Kick {
            time,
            work_gravity: self.depth.zip(told.depth).map_or(0.0, fallen),
            impulse_gravity: difference(self.impulse_gravity, told.impulse_gravity),
            potential_energy,
            impulse_near_field: difference(self.impulse_near_field, told.impulse_near_field),
            work_near_field: self.work_near_field.value() - told.work_near_field.value(),
        }
    }
}
