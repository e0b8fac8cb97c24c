//! Sphere and plane: Arbelaez, Zohdi & Dornfeld (2009), eq. (41).

use nalgebra::Vector3;

use super::{APPROACH_ROUNDING, STANDSTILL};
use crate::Flight;

/// Time (s, epoch time) at which `flight` touches the one-sided plane through `point` with unit normal `normal`, or `None`
/// when it does not approach.
///
/// The paper prints -(d·n)/(v·n), the time at which the centre reaches the plane; contact is when the distance is one
/// radius: -(d·n - r)/(v·n). A sphere that already overlaps the plane and approaches touches it at once (its local time);
/// one that recedes never does.
///
/// ```
/// use impinge_events::{Flight, contact_time::sphere_plane};
/// use nalgebra::Vector3;
///
/// let ball = Flight { position: Vector3::new(0.0, 0.0, 2.1), time: 1.0, velocity: Vector3::new(3.0, 0.0, -4.0), radius: 0.1 };
/// let time = sphere_plane(&ball, Vector3::zeros(), Vector3::z()).unwrap();
/// assert!((time - 1.5).abs() < 1e-15);
/// ```
#[inline]
#[must_use]
pub fn sphere_plane(flight: &Flight, point: Vector3<f64>, normal: Vector3<f64>) -> Option<f64> {
    let approach = -flight.velocity.dot(&normal);
    let fastest = flight.velocity.amax();
    // The comparison is false for NaN, so a degenerate normal never gives a time.
    if approach > APPROACH_ROUNDING * fastest && fastest >= STANDSTILL {
        let gap = (flight.position - point).dot(&normal) - flight.radius;
        Some(flight.time + (gap / approach).max(0.0))
    } else {
        None
    }
}
