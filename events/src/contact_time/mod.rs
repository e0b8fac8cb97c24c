//! When do two things touch? One file a pair; every function is pure: states in, time out.

mod grazing;
mod sphere_plane;
mod sphere_sphere;
mod sphere_triangle;
mod wide;

pub use sphere_plane::{sphere_plane, sphere_plane_bent};
pub use sphere_sphere::{MOST_SLACKS, sphere_sphere, sphere_sphere_yielding, spheres_may_touch};
pub use sphere_triangle::{Edge, Face, Sweep, sphere_corner, sphere_triangle};

/// Approach speeds below this fraction of the speeds they are the difference of are rounding, not approach.
///
/// A normal speed is a difference of products and carries an error of a few units in the last place (2^-53) of the
/// speeds themselves. Two touching things that "approach" slower than this have come to rest against each other
/// (restitution 0, or a collapsed sequence of hits); to resolve such a contact again would never end. Consequence: in
/// the time in which they move by a thousand radii they can sink into each other by at most 2e-12 radii.
pub const APPROACH_ROUNDING: f64 = 1.0 / (1u64 << 49) as f64;

/// Speeds below this (m/s) are rest.
///
/// Near the smallest number that a float can hold (5e-324) restitution rounds to 1 and a collapsed sequence of hits would go on for
/// ever; this is far enough above it that every approach that [`APPROACH_ROUNDING`] lets pass still has all its digits.
/// Consequence: in 1e270 s a grain at rest could have moved by 1e-10 m.
pub const STANDSTILL: f64 = 1e-280;
