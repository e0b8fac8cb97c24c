//! What is measured in a run: one measurement a file, each an [`Observer`](crate::scheme::Observer).
//!
//! ```
//! use impinge::grains::{Grain, Snapshot};
//! use impinge::observe::Ledger;
//! use impinge::scheme::Observer;
//! use impinge_events::Flight;
//! use nalgebra::Vector3;
//!
//! let flights = [Flight { position: Vector3::zeros(), time: 0.0, velocity: Vector3::new(0.0, 0.0, -2.0), radius: 0.1 }];
//! let grains = [Grain { id: 0, mass: 3.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 }];
//! let mut ledger = Ledger::default();
//! ledger.sample(&Snapshot { time: 0.0, flights: &flights, grains: &grains });
//! assert_eq!(ledger.initial().energy(), 6.0);
//! assert_eq!(ledger.energy_residual(), 0.0);
//! ```

#[cfg(test)]
pub(crate) mod fake_jet;
mod forces;
mod history;
mod ledger;
pub mod measure;
mod surface_energy;
mod surface_map;

pub use forces::Forces;
pub use history::{History, Moment};
pub use ledger::{Amounts, Counts, Ledger};
pub use surface_energy::{OrderTally, SurfaceEnergy};
pub use surface_map::{PlaneMap, PlaneShape, SurfaceMap, SurfaceShape, Tally, TriangleShape};

pub use crate::sum::{Sum, VectorSum};
