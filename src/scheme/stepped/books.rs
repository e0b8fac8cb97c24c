//! Forces on the grains, and what they did, as the ledger wants to know it.

use impinge_events::Flight;
use nalgebra::Vector3;

use super::Crowd;
use crate::grains::Grain;
use crate::near_field::Singular;
use crate::scheme::{Broken, Kick, Observer};
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

impl Crowd {
    /// Whether a near field acts, so that accelerations depend on positions.
    #[must_use]
    pub fn has_near_field(&self) -> bool {
        self.forces.near_field.is_some()
    }

    /// A speed (m/s) at which grains may hit each other or the surface: that of the fastest grain now, and of the surface, and what a fall through the
    /// whole domain adds to it, or two grains that the near field draws from far away to contact.
    #[must_use]
    pub fn fastest_impact(&self) -> f64 {
        let fastest = self.flights.iter().map(|flight| flight.velocity.norm()).fold(0.0, f64::max) + self.surface_speed;
        let gravity = self.forces.gravity;
        let fall = if gravity == Vector3::zeros() { 0.0 } else { gravity.abs().dot(&self.domain.extent()) };
        let drawn = self.forces.near_field.as_ref().map_or(0.0, |near_field| {
            let depth = |(flight, grain): (&Flight, &Grain)| {
                let potential = near_field.law().potential(2.0 * flight.radius) * grain.strength.powi(2);
                potential.abs() / grain.mass
            };
            self.flights.iter().zip(&self.grains).map(depth).fold(0.0, f64::max)
        });
        // m/2 v²/2 = depth for two of equal mass.
        (fastest * fastest + 2.0 * fall + 4.0 * drawn).sqrt()
    }

    /// Writes the acceleration of each grain under gravity and near field, from where [`flights`](Self::flights) are now, to `pull` (m/s²).
    ///
    /// # Errors
    /// Grains between which there is no finite force.
    pub fn pull(&mut self, pull: &mut Vec<Vector3<f64>>) -> Result<(), Broken> {
        let Self { forces, grains, flights, strengths, .. } = self;
        forces.pull(grains, flights, *strengths, pull).map_err(|singular| self.singular(&singular))
    }

    /// Books that `pull` (m/s², from [`pull`](Self::pull); read only where a near field acts) has acted for `duration` (s) on grains that fly as they do
    /// now. A scheme does so for all the momentum that forces give to its grains, or the ledger does not close.
    pub fn book(&mut self, pull: &[Vector3<f64>], duration: f64) {
        let gravity = self.forces.gravity;
        if gravity != Vector3::zeros() {
            self.books.impulse_gravity += gravity * (self.mass * duration);
        }
        if self.forces.near_field.is_some() {
            for ((pull, grain), flight) in pull.iter().zip(&self.grains).zip(&self.flights) {
                let impulse = (pull - gravity) * (grain.mass * duration);
                self.books.impulse_near_field += impulse;
                self.books.work_near_field += impulse.dot(&flight.velocity);
            }
        }
    }

    /// Whether forces act at all.
    pub(super) fn has_forces(&self) -> bool {
        self.forces.gravity != Vector3::zeros() || self.has_near_field()
    }

    /// Tells `observer` what forces did since it was last told.
    pub(super) fn tell_forces(&mut self, observer: &mut impl Observer) -> Result<(), Broken> {
        if !self.has_forces() {
            return Ok(());
        }
        let Self { forces, flights, grains, .. } = self;
        let potential = forces.near_field.as_mut().map(|near_field| {
            let positions: Vec<_> = flights.iter().map(|flight| flight.position).collect();
            let strengths: Vec<_> = grains.iter().map(|grain| grain.strength).collect();
            near_field.potential_energy(&positions, Some(&strengths))
        });
        let potential = potential.transpose().map_err(|singular| self.singular(&singular))?;
        let depths = self.flights.iter().zip(&self.grains).map(|(flight, grain)| self.depth(flight, grain));
        self.books.depth = Some(depths.sum());
        observer.kick(&self.books.since(&self.told, self.time(), potential));
        self.told = self.books;
        Ok(())
    }

    /// m g·x, J.
    pub(super) fn depth(&self, flight: &Flight, grain: &Grain) -> f64 {
        grain.mass * flight.position.dot(&self.forces.gravity)
    }

    fn singular(&self, singular: &Singular) -> Broken {
        let id = |slot: usize| self.grains[slot].id;
        let grains = match *singular {
            Singular::Coincident(a, b) => vec![id(a), id(b)],
            Singular::NotFinite(grain) => vec![id(grain)],
        };
        Broken::Singular { time: self.time(), grains }
    }
}
