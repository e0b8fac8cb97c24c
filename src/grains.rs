//! The state of all grains, shared by every scheme and every observer.

use impinge_events::Flight;
use nalgebra::Vector3;

/// Volume of a sphere of radius `radius` (m³).
#[must_use]
pub fn sphere_volume(radius: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)
}

/// A grain that is about to enter the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewGrain {
    /// Centre, m.
    pub position: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Spin (angular velocity), rad/s.
    pub spin: Vector3<f64>,
    /// Radius, m.
    pub radius: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Factor in near-field forces; the force between two grains is scaled by the product of theirs.
    pub strength: f64,
}

impl NewGrain {
    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.density * sphere_volume(self.radius)
    }
}

/// What a grain carries besides its flight: prediction does not read it, so it lives apart from [`Flight`], in a cache line of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Grain {
    /// The number the user sees: grains are numbered from 0 in the order in which they entered.
    pub id: u64,
    /// Mass, kg.
    pub mass: f64,
    /// Spin, rad/s.
    pub spin: Vector3<f64>,
    /// How many times this grain has hit the surface.
    pub hits: u32,
    /// Factor in near-field forces; the force between two grains is scaled by the product of theirs.
    pub strength: f64,
}

/// Kinetic energy of one grain (J): translation and rotation, I = 2/5 m r².
#[must_use]
pub fn kinetic_energy(flight: &Flight, grain: &Grain) -> f64 {
    0.5 * grain.mass * (flight.velocity.norm_squared() + 0.4 * flight.radius.powi(2) * grain.spin.norm_squared())
}

/// All grains that are inside at one moment, as observers and output see them.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// Simulated time, s.
    pub time: f64,
    /// The flights, all advanced to `time` (their `time` field is 0).
    pub flights: &'a [Flight],
    /// The other half of each grain, in the same order, which is that of `id`.
    pub grains: &'a [Grain],
}
