//! When does what touch what?
pub mod contact_time;
mod flight;
mod mesh;
mod surface;

pub use flight::Flight;
pub use mesh::{BadTriangle, Mesh};
pub use surface::{NoSurface, Outlook, Surface, SurfaceContact};
