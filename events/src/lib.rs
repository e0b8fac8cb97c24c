//! When does what touch what?
pub mod calendar;
pub mod contact_time;
mod domain;
mod encounters;
mod flight;
mod neighbors;
mod surface;

pub use domain::Domain;
pub use encounters::{Encounter, Encounters};
pub use flight::Flight;
pub use surface::{NoSurface, Outlook, Surface, SurfaceContact};
