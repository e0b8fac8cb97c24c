//! What forces between events did, and resting contacts: the part of the ledger that a run without forces does not have.

use nalgebra::Vector3;

use super::{Sum, VectorSum};
use crate::scheme::{Kick, Rest};

/// Work, impulse and potential energy of the forces of a run, and what resting contacts did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forces {
    work_gravity: Sum,
    impulse_gravity: VectorSum,
    potential: Option<Potential>,
    work_near_field: Sum,
    impulse_near_field: VectorSum,
    rest_impulse: VectorSum,
    rest_work_surface: Sum,
    rest_dissipated_grain: Sum,
    rest_dissipated_surface: Sum,
    rest_added: Sum,
    most_resting: u32,
    /// The largest energy that any of the forces had given or taken at any time, J.
    exchanged: f64,
}

/// Potential energy of the near field, J.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Potential {
    initial: f64,
    latest: f64,
}

impl Forces {
    /// Work of gravity, J.
    #[must_use]
    pub fn work_gravity(&self) -> f64 {
        self.work_gravity.value()
    }

    /// Momentum that gravity gave to grains, N s.
    #[must_use]
    pub fn impulse_gravity(&self) -> Vector3<f64> {
        self.impulse_gravity.value()
    }

    /// Potential energy of the near field at the start, J; none where it was never summed.
    #[must_use]
    pub fn potential_initial(&self) -> Option<f64> {
        self.potential.map(|potential| potential.initial)
    }

    /// Potential energy of the near field when it was summed last, J.
    #[must_use]
    pub fn potential_final(&self) -> Option<f64> {
        self.potential.map(|potential| potential.latest)
    }

    /// Kinetic energy that the near field gave to grains, J.
    #[must_use]
    pub fn work_near_field(&self) -> f64 {
        self.work_near_field.value()
    }

    /// Momentum that the near field gave to all grains together, N s: what is left of forces in pairs is rounding.
    #[must_use]
    pub fn impulse_near_field(&self) -> Vector3<f64> {
        self.impulse_near_field.value()
    }

    /// Momentum that grains at rest on the surface got from it, N s.
    #[must_use]
    pub fn rest_impulse(&self) -> Vector3<f64> {
        self.rest_impulse.value()
    }

    /// Work that moving surfaces did on grains at rest on them, J.
    #[must_use]
    pub fn rest_work_surface(&self) -> f64 {
        self.rest_work_surface.value()
    }

    /// Energy dissipated in resting contacts between grains, J.
    #[must_use]
    pub fn rest_dissipated_grain(&self) -> f64 {
        self.rest_dissipated_grain.value()
    }

    /// Energy dissipated in resting contacts with the surface, J.
    #[must_use]
    pub fn rest_dissipated_surface(&self) -> f64 {
        self.rest_dissipated_surface.value()
    }

    /// Energy that the treatment of resting contacts added, J.
    #[must_use]
    pub fn rest_added(&self) -> f64 {
        self.rest_added.value()
    }

    /// The largest number of resting contacts at the end of any sub-step.
    #[must_use]
    pub fn most_resting(&self) -> u32 {
        self.most_resting
    }

    /// The largest energy that any of the forces had given or taken at any time, J.
    pub(super) fn exchanged(&self) -> f64 {
        self.exchanged
    }

    /// Takes a kick in. One before the first sample belongs to how the scene came about: only its potential energy counts.
    pub(super) fn kick(&mut self, kick: &Kick, begun: bool) {
        if let Some(latest) = kick.potential_energy {
            let initial = self.potential.filter(|_| begun).map_or(latest, |potential| potential.initial);
            self.potential = Some(Potential { initial, latest });
            self.note_exchange(latest - initial);
        }
        if begun {
            self.work_gravity += kick.work_gravity;
            self.impulse_gravity += kick.impulse_gravity;
            self.work_near_field += kick.work_near_field;
            self.impulse_near_field += kick.impulse_near_field;
            self.note_exchange(self.work_gravity());
            self.note_exchange(self.work_near_field());
        }
    }

    pub(super) fn rest(&mut self, rest: &Rest) {
        self.rest_impulse += rest.impulse_surface;
        self.rest_work_surface += rest.work_surface;
        self.note_exchange(self.rest_work_surface());
        self.rest_dissipated_grain += rest.dissipated_grain;
        self.rest_dissipated_surface += rest.dissipated_surface;
        self.rest_added += rest.added;
        self.most_resting = self.most_resting.max(rest.contacts);
    }

    fn note_exchange(&mut self, energy: f64) {
        self.exchanged = self.exchanged.max(energy.abs());
    }
}
