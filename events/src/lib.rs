//! When does what touch what? Event prediction for hard spheres, usable alone.
//!
//! ```
//! use impinge_events::{Domain, Encounter, Encounters, Flight, NoSurface};
//! use nalgebra::Vector3;
//!
//! let ball = |x: f64, speed: f64| Flight {
//!     position: Vector3::new(x, 0.0, 0.0),
//!     time: 0.0,
//!     velocity: Vector3::new(speed, 0.0, 0.0),
//!     radius: 0.5,
//! };
//! // Newton's cradle: the last ball leaves with the speed of the first.
//! let mut cradle = Encounters::<NoSurface>::new(vec![ball(-3.0, 2.0), ball(0.0, 0.0), ball(1.0, 0.0)], NoSurface, Domain::unbounded(), f64::INFINITY);
//! while let Some((_time, encounter)) = cradle.next_before(10.0) {
//!     let Encounter::Grains { a, b } = encounter else { continue };
//!     let (va, vb) = (cradle.flight(a).velocity, cradle.flight(b).velocity);
//!     cradle.deflect(&[(a, vb), (b, va)]);
//! }
//! assert_eq!(cradle.flight(2).velocity.x, 2.0);
//! ```
//!
//! The crate knows spheres, planes, triangles and time. It knows no law (the caller says what an encounter does), no file and
//! no chance. From the bottom up:
//!
//! * [`Flight`]: one sphere in free flight, 64 bytes; its state changes only when its motion does.
//! * [`contact_time`]: when two things touch, in closed form; pure functions of two states.
//! * [`Surface`]: what flights can hit besides each other; yours, or made of planes and triangles.
//! * [`calendar`]: the predicted events in one total order; a plain one and a fast one that equals it.
//! * neighbours: cells that drift with the stream (private: they cannot change a bit of what happens).
//! * [`Encounters`]: all of it together; tells who meets whom next.
//! * [`Table`]: what is as long as there are grains, in large pages; for whoever keeps more about each grain, as is [`prefetch`].
//!
//! Lengths are in metres, times in seconds, or in any other consistent units: nothing here has a scale.

mod blocks;
pub mod calendar;
pub mod contact_time;
mod domain;
mod encounters;
mod flight;
mod lists;
mod mesh;
mod neighbors;
mod prefetch;
mod surface;
mod table;

pub use domain::Domain;
pub use encounters::{Encounter, Encounters, Touch, Vicinity, YIELDING};
pub use flight::{Bend, Flight};
pub use mesh::{BadTriangle, Mesh};
pub use neighbors::least_period;
pub use prefetch::prefetch;
pub use surface::{NoSurface, Outlook, Surface, SurfaceContact};
pub use table::{Table, table};

/// The program in README.md runs too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
