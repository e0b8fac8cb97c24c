//! Two grains in a line hit a wall: the whole sequence of hits in closed form.
//!
//! Mukherjee & Zohdi (2015), section 2.7, stop after the second wall hit of grain 1 and call that all collisions; the sequence goes on.
//! Velocities count towards the wall and are over v0, with which both grains start; a cycle is one wall hit of grain 1 and one
//! grain–grain hit. The approach speeds c(n) before grain–grain hit n + 1 obey c(n + 1) = T c(n) - s q c(n - 1), so they are Chebyshev
//! polynomials of the second kind: c(n) = (1 + s) ρ^n sin((n + 1) θ) / sin θ with ρ = √(s q) and cos θ = T / (2 ρ). The sequence ends at the
//! first that is not positive; where θ does not exist it never does, in a finite time (inelastic collapse).

use std::f64::consts::PI;

/// Error of pi / theta. Near collapse it is larger, but there pi / theta is never that close to a whole number for restitutions of few digits.
const ANGLE_ROUNDING: f64 = 1e-12;
/// Hits on the surface that bring less than this part of E0 each are not summed where they go on for ever: each is smaller than the one
/// before by a constant factor.
const NEGLIGIBLE: f64 = 1e-20;

/// Two grains in a line in front of a wall.
///
/// ```
/// use impinge::study::reproduce::Sequence;
///
/// let sequence = Sequence { s: 0.2, q: 0.2, m1: 1.0, m2: 1.0 };
/// assert_eq!((sequence.grain_hits(), sequence.surface_hits()), (Some(4), Some(5)));
/// assert!(Sequence { s: 0.15, q: 0.15, ..sequence }.collapses());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sequence {
    /// Restitution of the surface, e_s.
    pub s: f64,
    /// Restitution between the grains, e_p.
    pub q: f64,
    /// Mass of the grain that hits the surface first, kg.
    pub m1: f64,
    /// Mass of the other, kg.
    pub m2: f64,
}

impl Sequence {
    /// Trace T of the matrix that takes the velocities over a cycle.
    fn trace(&self) -> f64 {
        let Self { s, q, m1, m2 } = *self;
        (m2 * (1.0 + s * q) - m1 * (s + q)) / (m1 + m2)
    }

    fn rho(&self) -> f64 {
        (self.s * self.q).sqrt()
    }

    /// Whether the hits never end and the grains come to rest at the wall: T ≥ 2 ρ; for equal masses (1 + √s) (1 + √q) ≤ 2.
    #[must_use]
    pub fn collapses(&self) -> bool {
        self.trace() > 0.0 && self.trace() >= 2.0 * self.rho()
    }

    /// theta, from cos theta = T / (2 rho) in the form that does not cancel where it is small (many hits).
    fn angle(&self) -> f64 {
        let Self { s, q, m1, m2 } = *self;
        let part = m1 * (s.sqrt() + q.sqrt()).powi(2) - m2 * (1.0 - self.rho()).powi(2);
        2.0 * (part / (4.0 * self.rho() * (m1 + m2))).sqrt().asin()
    }

    /// Where the angle of the Chebyshev polynomials does not exist: T ≤ -2 rho, and c(1) is negative already.
    fn parts_at_once(&self) -> bool {
        self.trace() <= -2.0 * self.rho()
    }

    /// Approach speed before grain–grain hit n + 1, over v0; c(-1) = 0.
    fn approach(&self, n: i32) -> f64 {
        let (t, rho) = (self.trace(), self.rho());
        let u = if self.collapses() {
            let root = (t * t - 4.0 * rho * rho).sqrt();
            let (fast, slow) = (0.5 * (t + root), 0.5 * (t - root));
            (fast.powi(n + 1) - slow.powi(n + 1)) / root
        } else if self.parts_at_once() {
            // Only c(-1), c(0) and c(1) occur.
            [0.0, 1.0, t][(n + 1) as usize]
        } else {
            let angle = self.angle();
            rho.powi(n) * (f64::from(n + 1) * angle).sin() / angle.sin()
        };
        (1.0 + self.s) * u
    }

    /// Velocities of the two grains towards the wall after `n` grain–grain hits, over v0.
    #[must_use]
    pub fn after(&self, n: i32) -> [f64; 2] {
        let first = (self.approach(n) + self.q * self.approach(n - 1)) / (1.0 + self.s);
        [first, self.approach(n) - self.s * first]
    }

    /// Grain–grain hits; none where they never end.
    #[must_use]
    pub fn grain_hits(&self) -> Option<i32> {
        if self.collapses() {
            return None;
        }
        if self.parts_at_once() {
            return Some(1);
        }
        let hits = PI / self.angle();
        // Where it is a whole number (s = 1/4, q = 3/4, m2 = 4 m1 gives 6) the last approach speed is exactly 0 and no hit.
        Some((hits - ANGLE_ROUNDING).ceil() as i32 - 1)
    }

    /// Hits on the surface; none where they never end.
    #[must_use]
    pub fn surface_hits(&self) -> Option<i32> {
        self.grain_hits().map(|n| n + i32::from(self.after(n)[0] > 0.0))
    }

    /// Velocities at the end, towards the wall, over v0.
    #[must_use]
    pub fn last(&self) -> [f64; 2] {
        self.grain_hits().map_or([0.0, 0.0], |n| {
            let [first, second] = self.after(n);
            [if first > 0.0 { -self.s * first } else { first }, second]
        })
    }

    /// Energy over E0 of velocities over v0.
    #[must_use]
    pub fn energy(&self, [first, second]: [f64; 2]) -> f64 {
        (self.m1 * first * first + self.m2 * second * second) / (self.m1 + self.m2)
    }

    /// Energy that the first so many hits on the surface bring, over E0; all that there are where `hits` is larger.
    #[must_use]
    pub fn surface_energy(&self, hits: i32) -> f64 {
        let hits = self.surface_hits().unwrap_or(i32::MAX).min(hits);
        (0..hits).map(|n| self.energy([self.after(n)[0], 0.0])).take_while(|&energy| energy > NEGLIGIBLE).sum()
    }

    /// α over all hits: energy at the end over E0, less e_s².
    #[must_use]
    pub fn alpha_full(&self) -> f64 {
        self.energy(self.last()) - self.s * self.s
    }

    /// α* of Mukherjee & Zohdi (2015), eq. (34) and (37): grain 1 hits the wall twice, then nothing more is looked at.
    #[must_use]
    pub fn alpha_star(&self) -> f64 {
        let [first, second] = self.after(1);
        self.energy([-self.s * first, second]) - self.s * self.s
    }

    /// ᾱ of eq. (36) and (37): one hit of grain 1 on the wall and one between the grains.
    #[must_use]
    pub fn alpha_bar(&self) -> f64 {
        self.energy(self.after(1)) - self.s * self.s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eq. (35) and (36) as they stand, for equal masses, and eq. (34) for any.
    #[test]
    fn the_equations_of_the_paper_are_the_first_hits_of_the_sequence() {
        for (m1, m2) in [(1.0, 1.0), (4.0, 1.0), (1.0, 4.0)] {
            for (s, q) in [(0.2, 0.2), (0.3, 0.9), (0.9, 0.3), (0.5, 0.5), (1.0, 0.4), (1.0, 1.0)] {
                let sequence = Sequence { s, q, m1, m2 };
                let one = (q * m2 * (1.0 + s) - m1 * s + m2) / (m1 + m2);
                let two = (-q * m1 * (1.0 + s) + m2 - m1 * s) / (m1 + m2);
                let by_34 = (m1 * (s * one).powi(2) + m2 * two * two) / (m1 + m2) - s * s;
                assert!((sequence.alpha_star() - by_34).abs() < 1e-14, "{sequence:?}");
                if m1 == m2 {
                    let by_36 = ((1.0 - s).powi(2) + (q * (1.0 + s)).powi(2)) / 4.0 - s * s;
                    let by_35 = (s * (1.0 - s + q + s * q)).powi(2) / 8.0 + (1.0 - s - q - s * q).powi(2) / 8.0 - s * s;
                    assert!((sequence.alpha_bar() - by_36).abs() < 1e-14, "{sequence:?}");
                    assert!((sequence.alpha_star() - by_35).abs() < 1e-14, "{sequence:?}");
                }
            }
        }
    }

    /// N_pp ≤ N for equal masses and restitutions iff e ≥ y - √(y² - 1), y = 1 + 2 cos(π / (N + 1)).
    #[test]
    fn one_hit_more_below_each_threshold() {
        for hits in 2..=40 {
            let y = 1.0 + 2.0 * (PI / f64::from(hits + 1)).cos();
            let threshold = y - (y * y - 1.0).sqrt();
            let at = |e| Sequence { s: e, q: e, m1: 1.0, m2: 1.0 }.grain_hits();
            assert_eq!((at(threshold + 1e-9), at(threshold - 1e-9)), (Some(hits), Some(hits + 1)));
        }
        assert!(!Sequence { s: 0.17158, q: 0.17158, m1: 1.0, m2: 1.0 }.collapses());
        assert!(Sequence { s: 0.17157, q: 0.17157, m1: 1.0, m2: 1.0 }.collapses());
    }
}
