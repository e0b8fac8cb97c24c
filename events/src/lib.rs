//! When does what touch what?
pub mod contact_time;
mod flight;
mod surface;

pub use flight::Flight;
pub use surface::{NoSurface, Outlook, Surface, SurfaceContact};
