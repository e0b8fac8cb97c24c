//! What impacts do to the solid below the surface: stresses of point loads, moduli of a porous solid, and a measure of damage.
//!
//! Closed forms only: no grain, no engine. [`observe::measure::Subsurface`](crate::observe::measure::Subsurface) sums them up over the hits of a run.
//!
//! ```
//! use impinge::solid::{Elastic, PointLoad, Stress};
//! use nalgebra::Vector3;
//!
//! // Straight below a load of 1 N: sigma_zz = -3 F / (2 pi z²), whatever the solid (Boussinesq 1885).
//! let load = PointLoad::new(Vector3::new(0.0, 0.0, 1.0), 0.3);
//! let Stress { zz, .. } = load.stress(Vector3::new(0.0, 0.0, 2.0));
//! assert!((zz + 3.0 / (8.0 * std::f64::consts::PI)).abs() < 1e-16);
//!
//! let steel = Elastic::from_young(210e9, 0.3);
//! assert!(steel.porous(0.2, 1.0, 1e-4).bulk < 0.8 * steel.bulk);
//! ```

mod damage;
mod point_load;
mod porous;

pub use damage::{damage_indicator, equivalent_stress, triaxiality};
pub use point_load::{PointLoad, Stress};
pub use porous::{Elastic, hashin_shtrikman_bulk, hashin_shtrikman_shear};
