//! The region in which grains are followed.

use nalgebra::Vector3;
use wide::f64x4;

use crate::Flight;

/// The region in which grains are followed.
///
/// In a planar domain nothing ever happens along y: all positions and velocities have y = 0, and the domain has no sides
/// there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// Lower corner, m.
    pub min: Vector3<f64>,
    /// Upper corner, m.
    pub max: Vector3<f64>,
    /// Whether what leaves on one side comes in on the other.
    pub periodic: bool,
    /// Whether the scene lies in the plane y = 0.
    pub planar: bool,
}

impl Domain {
    /// A domain without sides.
    #[must_use]
    pub fn unbounded() -> Self {
        let far = Vector3::repeat(f64::INFINITY);
        Self { min: -far, max: far, periodic: false, planar: false }
    }

    /// The axes along which grains move.
    pub(crate) fn axes(&self) -> &'static [usize] {
        if self.planar { &[0, 2] } else { &[0, 1, 2] }
    }

    /// Lengths of the sides, m.
    #[must_use]
    pub fn extent(&self) -> Vector3<f64> {
        self.max - self.min
    }

    /// When the centre of `flight` leaves an open domain (s, epoch time); infinity when it never does.
    #[inline]
    pub(crate) fn exit_time(&self, flight: &Flight) -> f64 {
        if self.periodic {
            return f64::INFINITY;
        }
        let three = |vector: &Vector3<f64>| f64x4::from([vector.x, vector.y, vector.z, 0.0]);
        let (never, none) = (f64x4::splat(f64::INFINITY), f64x4::ZERO);
        let [place, speed, min, max] = [&flight.position, &flight.velocity, &self.min, &self.max].map(three);
        let wait = (speed.simd_gt(none).bitselect(max, min) - place) / speed;
        // A grain beyond the side leaves at once. One at rest along an axis gives 0/0 or x/0, and never does.
        let time = flight.time + wait.simd_gt(none).bitselect(wait, none);
        let [x, y, z, _] = speed.simd_eq(none).bitselect(never, time).to_array();
        let first = if x < y { x } else { y };
        if z < first { z } else { first }
    }

    /// Moves `position` (m) into a periodic domain; elsewhere nothing happens.
    #[inline]
    pub fn wrap(&self, position: &mut Vector3<f64>) {
        if self.periodic {
            for &axis in self.axes() {
                let (low, high) = (self.min[axis], self.max[axis]);
                // Most are inside, and stay what they are.
                if !(low..high).contains(&position[axis]) {
                    position[axis] -= ((position[axis] - low) / (high - low)).floor() * (high - low);
                }
            }
        }
    }

    /// The shortest of the periodic images of `apart`, a difference of two positions (m).
    #[inline]
    #[must_use]
    pub fn nearest(&self, mut apart: Vector3<f64>) -> Vector3<f64> {
        if self.periodic {
            for &axis in self.axes() {
                let length = self.max[axis] - self.min[axis];
                // Most are near, and stay what they are.
                if apart[axis].abs() > 0.25 * length {
                    apart[axis] -= (apart[axis] / length).round() * length;
                }
            }
        }
        apart
    }

    /// Whether grains of this radius (m) fit into a periodic domain ([`least_period`](crate::least_period)).
    #[must_use]
    pub fn holds(&self, radius: f64) -> bool {
        !self.periodic || self.axes().iter().all(|&axis| self.extent()[axis] >= crate::neighbors::least_period(radius))
    }
}
