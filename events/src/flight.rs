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

/// How an accelerated sphere departs from the straight line between two kicks.
///
/// A sphere with constant acceleration a in a sub-step from time 0 to h (s, epoch time) is where its chord is, plus ½ a t (t - h): at both ends
/// the two agree. The velocity of the chord is the true one less a (t - h/2), also after a collision in between, so spheres of equal
/// acceleration meet exactly when their chords do. The kicks of leapfrog integration (half kick, drift, half kick), synchronised at each
/// collision, are this change of frame.
///
/// ```
/// use impinge_events::Bend;
/// use nalgebra::Vector3;
///
/// // Free fall from rest for 2 s: the chord falls at 10 m/s.
/// let fall = Bend { acceleration: Vector3::new(0.0, 0.0, -10.0), step: 2.0 };
/// assert_eq!(-10.0 * 1.0 + fall.offset(1.0).z, -0.5 * 10.0 * 1.0 * 1.0);
/// assert_eq!(-10.0 + fall.velocity(2.0).z, -20.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Acceleration, m/s².
    pub acceleration: Vector3<f64>,
    /// Length of the sub-step, s.
    pub step: f64,
}

impl Bend {
    /// Where the sphere is at `time` (s), less where its chord is (m).
    #[inline]
    #[must_use]
    pub fn offset(&self, time: f64) -> Vector3<f64> {
        self.acceleration * (0.5 * time * (time - self.step))
    }

    /// Its velocity at `time` (s) less that of its chord (m/s).
    #[inline]
    #[must_use]
    pub fn velocity(&self, time: f64) -> Vector3<f64> {
        self.acceleration * (time - 0.5 * self.step)
    }
}
