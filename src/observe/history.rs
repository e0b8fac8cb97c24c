//! The time history: what had happened up to each sample (Mukherjee & Zohdi 2015, fig. 13).

use super::{Ledger, SurfaceEnergy};

/// What had happened up to one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Simulated time, s.
    pub time: f64,
    /// Kinetic energy of the grains inside, J.
    pub kinetic_energy: f64,
    /// Potential energy of the near field less that at the start, J; none where it is not summed.
    pub near_field: Option<f64>,
    /// Potential energy of gravity less that at the start, J: the work of gravity so far, with the other sign; none where no force acts.
    pub gravity: Option<f64>,
    /// Energy brought to the surface so far by first hits, J.
    pub surface_first: f64,
    /// Energy brought to the surface so far by later hits, J.
    pub surface_repeated: f64,
    /// Energy brought to the surface so far by all hits, J.
    pub surface_all: f64,
    /// Energy dissipated so far between grains, J.
    pub dissipated_grain: f64,
    /// Energy dissipated so far at the surface, J.
    pub dissipated_surface: f64,
    /// Collisions between grains so far.
    pub grain_grain: u64,
    /// Collisions with the surface so far.
    pub grain_surface: u64,
    /// Grains inside.
    pub inside: u64,
}

/// One row a sample. It reads what the ledger and the surface energy have added up, and adds up nothing itself.
#[derive(Clone, Debug, Default)]
pub struct History {
    moments: Vec<Moment>,
}

impl History {
    /// Notes where the run stands; to be called after `ledger` and `surface` have seen the sample of `time` (s).
    pub fn note(&mut self, time: f64, ledger: &Ledger, surface: &SurfaceEnergy) {
        let forces = ledger.forces();
        let near_field = forces.and_then(|forces| Some(forces.potential_final()? - forces.potential_initial()?));
        self.moments.push(Moment {
            time,
            kinetic_energy: ledger.inside().energy(),
            near_field,
            gravity: forces.map(|forces| 0.0 - forces.work_gravity()),
            surface_first: surface.first_hits(),
            surface_repeated: surface.repeated_hits(),
            surface_all: surface.all_hits(),
            dissipated_grain: ledger.dissipated_grain(),
            dissipated_surface: ledger.dissipated_surface(),
            grain_grain: ledger.counts().grain_grain,
            grain_surface: ledger.counts().grain_surface,
            inside: ledger.inside().count(),
        });
    }

    /// All rows, in the order of time.
    #[must_use]
    pub fn moments(&self) -> &[Moment] {
        &self.moments
    }
}
