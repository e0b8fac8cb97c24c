//! One sphere in free flight.

use nalgebra::Vector3;

/// A sphere that moves in a straight line until something changes its motion.
///
/// `position` is where the centre was at the local time `time`; the flight is advanced only when its motion changes, so
/// every prediction is a pure function of stored states. Exactly what prediction reads, in one cache line of 64 bytes.
///
/// ```
/// use impinge_events::Flight;
/// use nalgebra::Vector3;
///
/// let flight = Flight { position: Vector3::new(0.0, 0.0, 1.0), time: 0.5, velocity: Vector3::new(0.0, 0.0, -2.0), radius: 0.1 };
/// assert_eq!(flight.position_at(0.75).z, 0.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Flight {
    /// Centre at `time`, m.
    pub position: Vector3<f64>,
    /// Local time, s, counted from the start of the current epoch.
    pub time: f64,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Radius, m.
    pub radius: f64,
}

impl Flight {
    /// Where the centre is at `time` (m).
    #[inline]
    #[must_use]
    pub fn position_at(&self, time: f64) -> Vector3<f64> {
        self.position + self.velocity * (time - self.time)
    }

    /// The same flight with its state moved to `time`.
    #[inline]
    #[must_use]
    pub fn advanced_to(&self, time: f64) -> Self {
        Self { position: self.position_at(time), time, ..*self }
    }
}
