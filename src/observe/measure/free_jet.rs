//! What a jet whose grains do not meet each other does to a plane.

use crate::scene::{self, Friction};

/// A jet whose grains do not meet each other: what stresses of jets are measured against (Arbelaez et al. 2009, section 6.1).
///
/// ```
/// use impinge::observe::measure::FreeJet;
///
/// let jet = FreeJet { density: 300.0, speed: 20.0, angle: 45.0, restitution: 0.3 };
/// assert!((jet.pressure() - 300.0 * 1.3 * 20.0 * 20.0 / 2.0).abs() < 1e-9);
/// // At 45 degrees contacts stick, at 60 degrees they slip: 0.733 and 0.667 of the static friction.
/// assert!((jet.shear_over_pressure(0.3, 0.2) / 0.3 - 0.7326).abs() < 1e-4);
/// assert_eq!(FreeJet { angle: 60.0, ..jet }.shear_over_pressure(0.3, 0.2), 0.2);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeJet {
    /// Mass of grains per volume of the jet, kg/m³; in a planar scene per area, kg/m².
    pub density: f64,
    /// Speed of its grains, m/s.
    pub speed: f64,
    /// Angle between its axis and the normal of the surface, degrees.
    pub angle: f64,
    /// Restitution of the surface.
    pub restitution: f64,
}

impl FreeJet {
    /// Pressure on the plane, ρ (1 + e) v² cos² θ (Arbelaez et al. 2009, eq. 50), Pa; in a planar scene N/m.
    #[must_use]
    pub fn pressure(&self) -> f64 {
        self.density * (1.0 + self.restitution) * (self.speed * self.angle.to_radians().cos()).powi(2)
    }

    /// Shear over pressure of grains that do not spin: 2/7 tan θ / (1 + e) where contacts stick, which static friction must bear, and dynamic
    /// friction where they slip (Arbelaez et al. 2009, eq. 31, 32; the jump between the two is theirs).
    #[must_use]
    pub fn shear_over_pressure(&self, friction_static: f64, friction_dynamic: f64) -> f64 {
        let sticking = 2.0 / 7.0 * self.angle.to_radians().tan() / (1.0 + self.restitution);
        if sticking <= friction_static { sticking } else { friction_dynamic }
    }
}

/// What stresses are shown relative to: a pressure, and friction times it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales {
    pub(super) pressure: f64,
    /// None without friction.
    pub(super) shear: Option<f64>,
}

impl Scales {
    pub(super) fn of(jet: &scene::FreeJet, scene: &scene::Scene) -> Self {
        let contact = scene.contact.surface.as_ref();
        let restitution = contact.map_or(1.0, |contact| contact.restitution);
        let pressure = FreeJet { density: jet.density, speed: jet.speed, angle: jet.angle, restitution }.pressure();
        let dynamic = contact.map_or(0.0, |contact| match contact.friction {
            Friction::Coefficient(mu) => mu,
            Friction::StaticDynamic(mu) => mu.dynamic,
            Friction::Regularised(law) => law.coefficient,
        });
        let shear = jet.friction.unwrap_or(dynamic) * pressure;
        Self { pressure, shear: (shear > 0.0).then_some(shear) }
    }
}
