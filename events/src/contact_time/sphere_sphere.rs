//! Sphere and sphere: Arbelaez, Zohdi & Dornfeld (2009), eq. (36) to (39).

use nalgebra::Vector3;
use wide::f64x4;

use super::grazing::{self, GRAZING};
use super::wide::{Wide, WideVector};
use super::{APPROACH_ROUNDING, STANDSTILL};
use crate::Flight;

/// Time (s, epoch time) at which the spheres `a` and `b` touch, or `None` when they never do.
///
/// `shift` (m) is added to the position of `b`: the image of a periodic domain that is meant, zero elsewhere.
///
/// With r and v the relative position and velocity at the later of the two local times and s the sum of the radii,
/// contact is at t = (r² - s²) / (-b + √G), b = r·v, G = s² v² - |r × v|². The paper prints (-b ± √G) / v², which
/// cancels for distant and for touching pairs; this is the same root (the earlier one) without the cancellation, and the
/// same holds of G against b² - v² (r² - s²). Where the two all but miss each other G is a small difference again, and is taken in
/// double length.
///
/// The two states are taken for exact. A grazing contact then comes out to 1e-15 of the interval after the later local time, any
/// other to what r and r² - s² have lost by rounding.
///
/// Spheres that overlap and approach touch at once, those that overlap and recede do not (Bannerman et al. 2014): then no
/// rounding can lose a collision or resolve one twice. The result is the same bit for bit when `a` and `b` change places
/// (and `shift` its sign).
///
/// ```
/// use impinge_events::{Flight, contact_time::sphere_sphere};
/// use nalgebra::Vector3;
///
/// let a = Flight { position: Vector3::zeros(), time: 0.0, velocity: Vector3::x(), radius: 0.5 };
/// let b = Flight { position: Vector3::new(3.0, 0.0, 0.0), velocity: -Vector3::x(), ..a };
/// assert_eq!(sphere_sphere(&a, &b, Vector3::zeros()), Some(1.0));
/// ```
#[inline]
#[must_use]
pub fn sphere_sphere(a: &Flight, b: &Flight, shift: Vector3<f64>) -> Option<f64> {
    let v = b.velocity - a.velocity;
    // Whoever is at the later time is where its state says.
    let (base, r) = if a.time >= b.time {
        (a.time, b.position_at(a.time) - a.position)
    } else {
        (b.time, b.position - a.position_at(b.time))
    };
    let r = r + shift;
    let approach = -r.dot(&v);
    if approach > 0.0 {
        let v2 = v.norm_squared();
        let interval =
            if v2 >= SMALLEST_SPEED_SQUARED { meeting(a, b, shift, r, v) } else { slow_meeting(a, b, shift, r, v) };
        return interval.map(|interval| base + interval);
    }
    None
}

/// Spheres under force overlap by no more than this many times the slack of [`sphere_sphere_yielding`] before they meet.
pub const MOST_SLACKS: f64 = 4.0;

/// As [`sphere_sphere`] for spheres under force, which may press against each other: a pair that touches already, nearer than ¼ `slack` (m), meets only where
/// its overlap would grow by `slack`, or beyond [`MOST_SLACKS`] times as much, until `horizon` (s, epoch time), the end of the sub-step.
///
/// So what is left of an approach when a contact has come to rest makes no event as long as it leads nowhere. A pair that happens to be as near as that
/// when a sub-step begins, and comes on, meets when it touches.
#[must_use]
pub fn sphere_sphere_yielding(a: &Flight, b: &Flight, shift: Vector3<f64>, slack: f64, horizon: f64) -> Option<f64> {
    let base = a.time.max(b.time);
    let touching = a.radius + b.radius + 0.25 * slack;
    let apart = (b.position_at(base) - a.position_at(base) + shift).norm_squared();
    if apart <= touching * touching {
        let overlap = (a.radius + b.radius - apart.sqrt()).max(0.0);
        let yielded = (overlap + slack).min(MOST_SLACKS * slack);
        let shrunk = |flight: &Flight| Flight { radius: flight.radius - 0.5 * yielded, ..*flight };
        sphere_sphere(&shrunk(a), &shrunk(b), shift).filter(|&time| time <= horizon)?;
    }
    sphere_sphere(a, b, shift)
}

/// Whether the sphere `a` may touch each of four `others` until `until` (s, epoch time); bit k tells of the k-th. A bound without branch or root that hardly ever
/// says yes in vain, so that most pairs need no more.
///
/// It never says no where [`sphere_sphere`] gives a time up to `until`, nor for an image, whose position has been shifted.
#[inline]
#[must_use]
pub fn spheres_may_touch(a: &Flight, others: [&Flight; 4], until: f64) -> u32 {
    let four = |of: fn(&Flight) -> f64| f64x4::from(others.map(of));
    // Products are rounded with their sums or not, as the processor can: it is a bound.
    let dot = |a: [f64x4; 3], b: [f64x4; 3]| a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]));
    let velocity = [four(|b| b.velocity.x), four(|b| b.velocity.y), four(|b| b.velocity.z)];
    let position = [four(|b| b.position.x), four(|b| b.position.y), four(|b| b.position.z)];
    let later = a.time - four(|b| b.time);
    let v: [f64x4; 3] = std::array::from_fn(|axis| velocity[axis] - a.velocity[axis]);
    let r: [f64x4; 3] = std::array::from_fn(|axis| velocity[axis].mul_add(later, position[axis] - a.position[axis]));
    let s = four(|b| b.radius) + a.radius;
    let (approach, v2, s2) = (-dot(r, v), dot(v, v), s * s);
    let separation = dot(r, r) * (1.0 - CAUTION) - s2 * (1.0 + CAUTION);
    // r² - s² falls by less than 2 approach t within t.
    let in_time = separation.simd_le(approach * (2.0 * (until - a.time)));
    let on_course = (v2 * separation).simd_le(approach * approach);
    // Where squares of speeds underflow the course is not known; whoever flies side by side is never in time.
    let unknown = v2.simd_lt(f64x4::splat(SMALLEST_SPEED_SQUARED));
    (in_time & (on_course | unknown)).to_bitmask()
}

/// What rounding may do to the squares of distances in a bound, relative: much more than it does (as far as 1e9 radii from the origin), and too little to
/// let many pairs pass that are not a thousand radii apart.
const CAUTION: f64 = 1e-6;

/// Below this relative speed squared ((1e-140 m/s)²) the products of the root would underflow.
const SMALLEST_SPEED_SQUARED: f64 = 1e-280;

/// Interval until contact of a pair that approaches, s.
#[inline]
fn meeting(a: &Flight, b: &Flight, shift: Vector3<f64>, r: Vector3<f64>, v: Vector3<f64>) -> Option<f64> {
    let s = a.radius + b.radius;
    let most = s * s * v.norm_squared();
    let across = r.cross(&v).norm_squared();
    if across > most * (1.0 + GRAZING) {
        return None;
    }
    let approach = -r.dot(&v);
    let speeds = a.velocity.amax() + b.velocity.amax();
    if approach <= APPROACH_ROUNDING * speeds * s {
        return None;
    }
    let reach = most - across;
    if reach < GRAZING * most {
        return grazing_meeting(a, b, shift);
    }
    let separation = r.norm_squared() - s * s;
    Some(separation.max(0.0) / (approach + reach.sqrt()))
}

/// The same for a pair that all but misses, from the states themselves.
#[cold]
#[inline(never)]
fn grazing_meeting(a: &Flight, b: &Flight, shift: Vector3<f64>) -> Option<f64> {
    let base = a.time.max(b.time);
    let place = |flight: &Flight| {
        WideVector::from(flight.position) + WideVector::from(flight.velocity).times(Wide::sum(base, -flight.time))
    };
    // Where a and b change places (and the shift its sign), r and v change their signs and not a bit more.
    let r = place(b) - place(a) + shift.into();
    let v = WideVector::from(b.velocity) - a.velocity.into();
    let s = Wide::sum(a.radius, b.radius);
    grazing::interval(&r, &v, s * s, 0.0)
}

/// The same for grains so slow that squares of their speeds underflow, as at the end of a collapse: in units of time in which
/// their speeds are near 1. The unit is a power of two, so nothing is rounded.
#[cold]
fn slow_meeting(a: &Flight, b: &Flight, shift: Vector3<f64>, r: Vector3<f64>, v: Vector3<f64>) -> Option<f64> {
    let fastest = a.velocity.amax().max(b.velocity.amax());
    if fastest < STANDSTILL {
        return None;
    }
    let unit = 2f64.powi(fastest.log2().floor().min(0.0) as i32);
    let scaled = |flight: &Flight| Flight { velocity: flight.velocity / unit, time: flight.time * unit, ..*flight };
    meeting(&scaled(a), &scaled(b), shift, r, v / unit).map(|interval| interval / unit)
}
