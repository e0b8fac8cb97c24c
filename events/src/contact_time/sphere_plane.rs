//! Sphere and plane: Arbelaez, Zohdi & Dornfeld (2009), eq. (41).

use nalgebra::Vector3;

use super::{APPROACH_ROUNDING, STANDSTILL};
use crate::{Bend, Flight};

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

/// What rounding may make of a gap, over the lengths that it is the difference of: each bounce rounds the place by half a unit in the last place, and
/// a thousand low bounces wander by some thirty units.
const GAP_ROUNDING: f64 = 32.0 * f64::EPSILON;

/// As [`sphere_plane`] for a sphere that is accelerated: `flight` is its chord, `bend` how it departs from it.
///
/// With g the gap, w its rate and a the acceleration along the normal, all at the local time, contact is at the first root of
/// g + w t + a t²/2 = 0 where the gap closes, in the form that does not cancel. A sphere that touches the plane and leaves it comes back at the
/// second root, -2 w / a. It touches where the gap is of the size of its rounding: to fall through that would give a bouncing sphere √(2 |a| g) at
/// each bounce, 5e-8 m/s for one of 1 m, so that its bounces would not die out in time.
///
/// ```
/// use impinge_events::{Bend, Flight, contact_time::sphere_plane_bent};
/// use nalgebra::Vector3;
///
/// // From rest at a height of 5 m, with 10 m/s²: 1 s. The chord of the first 2 s moves at -10 m/s.
/// let ball = Flight { position: Vector3::new(0.0, 0.0, 5.5), time: 0.0, velocity: Vector3::new(0.0, 0.0, -10.0), radius: 0.5 };
/// let fall = Bend { acceleration: Vector3::new(0.0, 0.0, -10.0), step: 2.0 };
/// assert_eq!(sphere_plane_bent(&ball, &fall, Vector3::zeros(), Vector3::z()), Some(1.0));
/// ```
#[must_use]
pub fn sphere_plane_bent(flight: &Flight, bend: &Bend, point: Vector3<f64>, normal: Vector3<f64>) -> Option<f64> {
    let acceleration = bend.acceleration.dot(&normal);
    let gap = (flight.position + bend.offset(flight.time) - point).dot(&normal) - flight.radius;
    let gap = if gap > GAP_ROUNDING * (flight.position.amax() + point.amax() + flight.radius) { gap } else { 0.0 };
    let rate = (flight.velocity + bend.velocity(flight.time)).dot(&normal);
    let fastest = flight.velocity.amax() + (bend.acceleration * bend.step).amax();
    if fastest < STANDSTILL {
        return None;
    }
    let rounding = APPROACH_ROUNDING * fastest;
    let discriminant = rate * rate - 2.0 * acceleration * gap;
    let interval = if rate < -rounding {
        (discriminant >= 0.0).then(|| 2.0 * gap / (-rate + discriminant.sqrt()))?
    } else if acceleration < 0.0 {
        // It leaves or rests, and is pulled back. Where it lies under the plane by rounding, it comes back to where it is.
        (rate + discriminant.sqrt()) / -acceleration
    } else {
        return None;
    };
    Some(flight.time + interval)
}
