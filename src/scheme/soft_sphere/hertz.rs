//! The force of a Hertz contact with damping, and how long it lasts.

use std::f64::consts::PI;

/// A contact of two spheres, or of a sphere with a plane (Huang, Chan & Zamankhan 2010, eq. 1, after Tsuji, Tanaka & Ishida 1992):
/// F = K delta^(3/2) + eta delta^(1/4) d delta/dt.
///
/// Eq. (1) prints one exponent, xi = 1/2, for the overlap in both terms. With it the damping would not have the unit of a force, and restitution
/// would depend on the speed of impact and be nearly 1 (0.99 where 0.8 is asked for); with 1/4 it is what is asked for at every speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hertz {
    /// K, N/m^(3/2).
    pub stiffness: f64,
    /// eta, N s/m^(5/4).
    pub damping: f64,
    /// m_eff, kg.
    pub mass: f64,
}

/// Duration of an elastic Hertz contact over greatest overlap / speed of impact: 2 ∫ dx / √(1 - x^(5/2)) from 0 to 1.
const HERTZ_DURATION: f64 = 2.943_275_195;

impl Hertz {
    /// The contact of bodies with effective mass `mass` = (1/m_1 + 1/m_2)⁻¹ (kg) and effective radius `radius` = (1/r_1 + 1/r_2)⁻¹ (m), whose
    /// [`effective_modulus`] is `modulus` (Pa), with restitution `restitution`. For the surface, which is plane and does not move, they are mass and
    /// radius of the grain; the paper takes those of a pair, half of them.
    ///
    /// K = 4/3 Y_eff √r_eff, eta = -2 kappa √(5 k m_eff / 6) with k = 2 Y_eff √r_eff.
    #[must_use]
    pub fn new(modulus: f64, mass: f64, radius: f64, restitution: f64) -> Self {
        let root = radius.sqrt();
        let damping = -2.0 * kappa(restitution) * (5.0 / 6.0 * 2.0 * modulus * root * mass).sqrt();
        Self { stiffness: 4.0 / 3.0 * modulus * root, damping, mass }
    }

    /// Elastic force (N) at an overlap of `overlap` > 0 (m).
    #[inline]
    #[must_use]
    pub fn elastic(&self, overlap: f64) -> f64 {
        self.stiffness * overlap * overlap.sqrt()
    }

    /// Force of the damping (N) at an overlap of `overlap` > 0 (m) that grows at `rate` (m/s).
    #[inline]
    #[must_use]
    pub fn viscous(&self, overlap: f64, rate: f64) -> f64 {
        self.damping * overlap.sqrt().sqrt() * rate
    }

    /// Energy stored at an overlap of `overlap` (m), J.
    #[must_use]
    pub fn stored(&self, overlap: f64) -> f64 {
        0.4 * self.elastic(overlap) * overlap
    }

    /// Greatest overlap of an elastic contact after an approach at `speed` (m/s), m.
    #[must_use]
    pub fn deepest(&self, speed: f64) -> f64 {
        (1.25 * self.mass * speed * speed / self.stiffness).powf(0.4)
    }

    /// How long an elastic contact lasts after an approach at `speed` (m/s), s: 2.87 (m_eff² / (r_eff Y_eff² U))^(1/5), as the paper gives it for
    /// Hertz. Its table of contact times, from eq. (4) for a linear spring, is shorter by 10 and more.
    #[must_use]
    pub fn duration(&self, speed: f64) -> f64 {
        HERTZ_DURATION * self.deepest(speed) / speed
    }
}

/// Y_eff = E / (2 (1 - nu²)) (Pa) of two bodies of one material.
#[must_use]
pub fn effective_modulus(young_modulus: f64, poisson_ratio: f64) -> f64 {
    young_modulus / (2.0 * (1.0 - poisson_ratio * poisson_ratio))
}

/// kappa = ln e / √(ln² e + π²); -1 at e = 0, where the damping is finite and only the contact lasts for ever.
fn kappa(restitution: f64) -> f64 {
    if restitution == 0.0 {
        return -1.0;
    }
    let log = restitution.ln();
    log / (log * log + PI * PI).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Glass of the paper.
    const GLASS: (f64, f64, f64) = (6.5e10, 0.244, 2500.0);

    /// Restitution of a contact whose damping goes with delta^`exponent`, integrated in very short steps until the overlap is 0, and its duration (s).
    fn impact(contact: &Hertz, speed: f64, exponent: f64) -> (f64, f64) {
        let step = contact.duration(speed) / 20_000.0;
        let acceleration = |(overlap, rate): (f64, f64)| {
            let overlap = overlap.max(0.0);
            -(contact.elastic(overlap) + contact.damping * overlap.powf(exponent) * rate) / contact.mass
        };
        // Classical Runge-Kutta.
        let slope = |state: (f64, f64)| (state.1, acceleration(state));
        let ahead = |state: (f64, f64), slope: (f64, f64), by: f64| (state.0 + slope.0 * by, state.1 + slope.1 * by);
        let (mut state, mut time) = ((0.0, speed), 0.0);
        loop {
            let first = slope(state);
            let second = slope(ahead(state, first, 0.5 * step));
            let third = slope(ahead(state, second, 0.5 * step));
            let fourth = slope(ahead(state, third, step));
            let mean = |of: fn((f64, f64)) -> f64| (of(first) + 2.0 * of(second) + 2.0 * of(third) + of(fourth)) / 6.0;
            let next = ahead(state, (mean(|s| s.0), mean(|s| s.1)), step);
            if next.0 <= 0.0 {
                return (-next.1 / speed, time + step * state.0 / (state.0 - next.0));
            }
            (state, time) = (next, time + step);
        }
    }

    fn glass(diameter: f64) -> Hertz {
        let (young, poisson, density) = GLASS;
        let radius = 0.5 * diameter;
        let mass = density * crate::grains::sphere_volume(radius);
        Hertz::new(effective_modulus(young, poisson), 0.5 * mass, 0.5 * radius, 0.8)
    }

    /// PHYSICS 1.2: with the exponent 1/4 e is the same at all speeds; with 1/2, as stated, contacts are nearly elastic.
    #[test]
    fn damping_with_the_fourth_root_gives_the_restitution_and_the_printed_root_does_not() {
        let contact = glass(1e-3);
        for speed in [0.1, 1.0, 10.0] {
            let (restitution, _) = impact(&contact, speed, 0.25);
            assert!((restitution - 0.8).abs() < 2e-4, "{restitution} at {speed} m/s");
        }
        for (speed, nearly) in [(0.1, 0.996), (1.0, 0.994), (10.0, 0.991)] {
            let (restitution, _) = impact(&contact, speed, 0.5);
            assert!((restitution - nearly).abs() < 2e-3, "{restitution} at {speed} m/s");
        }
    }

    #[test]
    fn an_elastic_contact_lasts_as_hertz_has_it() {
        let elastic = Hertz { damping: 0.0, ..glass(1e-3) };
        for speed in [0.1, 1.0, 10.0] {
            let (restitution, time) = impact(&elastic, speed, 0.25);
            assert!((restitution - 1.0).abs() < 1e-6, "{restitution}");
            approx::assert_relative_eq!(time, elastic.duration(speed), max_relative = 1e-4);
            // 2.87 (m_eff² / (r_eff Y_eff² U))^(1/5)
            let root = elastic.stiffness / (4.0 / 3.0);
            let printed = 2.87 * (elastic.mass.powi(2) / (root.powi(2) * speed)).powf(0.2);
            approx::assert_relative_eq!(time, printed, max_relative = 3e-3);
        }
    }

    /// PHYSICS 1.6: the contact times behind the printed steps are 10 to 16 times shorter than Hertz's at 10 m/s.
    #[test]
    fn printed_contact_times_are_far_too_short() {
        for (diameter, hertz) in [(0.25e-3, 4.87e-7), (0.5e-3, 9.73e-7), (1e-3, 1.95e-6), (2e-3, 3.89e-6)] {
            approx::assert_relative_eq!(glass(diameter).duration(10.0), hertz, max_relative = 0.01);
        }
        let printed = 2.98e-8;
        assert!(glass(0.25e-3).duration(10.0) > 10.0 * printed);
    }

    /// PHYSICS 1.8: half the mass and half the radius at the surface, as printed, would give 0.85 where 0.8 is asked for.
    #[test]
    fn the_surface_takes_mass_and_radius_of_the_grain() {
        let grain = |mass, radius| Hertz { mass: 1e-6, ..Hertz::new(1e10, mass, radius, 0.8) };
        let (right, printed) = (impact(&grain(1e-6, 1e-3), 1.0, 0.25).0, impact(&grain(0.5e-6, 0.5e-3), 1.0, 0.25).0);
        assert!((right - 0.8).abs() < 2e-4 && (printed - 0.854).abs() < 2e-3, "{right} and {printed}");
    }

    #[test]
    fn without_restitution_the_damping_is_finite() {
        let contact = Hertz::new(1e9, 1.0, 1.0, 0.0);
        approx::assert_relative_eq!(contact.damping, 2.0 * (5.0 / 6.0 * 2e9f64).sqrt(), max_relative = 1e-15);
        assert_eq!(Hertz::new(1e9, 1.0, 1.0, 1.0).damping, 0.0);
    }
}
