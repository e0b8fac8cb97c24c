//! What every source needs to know of its scene, and the checks that sources share.

use nalgebra::Vector3;
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;

use super::radius::Radii;
use super::{MOST_GRAINS, check_period, value};
use crate::grains::NewGrain;
use crate::scene::{Invalid, Radius, Scene, Vec3};

/// Which source of which scene.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) scene: &'a Scene,
    /// Number of the source in the scene.
    pub(super) number: usize,
    /// How many grains the sources before it have placed; the id of its first grain.
    pub(super) placed: usize,
}

impl Context<'_> {
    /// The path of one of the source's own keys in the scene file.
    pub(super) fn key(&self, name: &str) -> String {
        format!("source[{}].{name}", self.number)
    }

    pub(super) fn planar(&self) -> bool {
        self.scene.domain.planar
    }

    /// The random stream of this source: the seed and the number, mixed so that neighbours have nothing in common.
    pub(super) fn rng(&self) -> Pcg64Mcg {
        let number = (self.number as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Pcg64Mcg::seed_from_u64(mixed(self.scene.seed ^ mixed(number)))
    }

    /// Radius of the source, or of `[grain]` where it has none.
    pub(super) fn radii(&self, radius: Option<&Radius>) -> Result<Radii, Invalid> {
        let radii = match radius {
            Some(radius) => Radii::new(radius, &self.key("radius")),
            None => Radii::new(&self.scene.grain.radius, "grain.radius"),
        }?;
        // What has no upper bound is looked at grain by grain.
        let largest = radii.bounds().1;
        if largest.is_finite() {
            check_period(&self.scene.domain, largest)?;
        }
        Ok(radii)
    }

    /// Density of the source (kg/m³), or of `[grain]` where it has none.
    pub(super) fn density(&self, density: Option<f64>) -> Result<f64, Invalid> {
        match density {
            Some(density) => value::positive(&self.key("density"), density),
            None => value::positive("grain.density", self.scene.grain.density),
        }
    }

    /// Spin of the source (rad/s).
    pub(super) fn spin(&self, spin: Vec3) -> Result<Vector3<f64>, Invalid> {
        let key = self.key("spin");
        let spin = value::vector(&key, spin)?;
        if self.planar() {
            value::zero_in_plane(&key, &spin, &[0, 2])?;
        }
        Ok(spin)
    }

    /// Factor of the source in near-field forces; 1 where it gives none.
    pub(super) fn strength(&self) -> Result<f64, Invalid> {
        value::finite(&self.key("strength"), self.scene.source[self.number].strength().unwrap_or(1.0))
    }

    /// Velocity, thermal speed and spin of a block or lattice.
    pub(super) fn motion(&self, velocity: Vec3, thermal_speed: f64, spin: Vec3) -> Result<Motion, Invalid> {
        let key = self.key("velocity");
        let velocity = value::vector(&key, velocity)?;
        if self.planar() {
            value::zero_in_plane(&key, &velocity, &[1])?;
        }
        let thermal_speed = value::not_negative(&self.key("thermal_speed"), thermal_speed)?;
        let (spin, strength) = (self.spin(spin)?, self.strength()?);
        Ok(Motion { velocity, thermal_speed, spin, strength, planar: self.planar() })
    }

    /// The box of a block or lattice: finite, not inverted, inside the domain; flat, at y = 0, in a planar scene.
    pub(super) fn bounds(&self, min: Vec3, max: Vec3) -> Result<Bounds, Invalid> {
        let domain = &self.scene.domain;
        let (mut lower, mut upper) = (value::vector(&self.key("min"), min)?, value::vector(&self.key("max"), max)?);
        if self.planar() {
            (lower.y, upper.y) = (0.0, 0.0);
        }
        for axis in self.axes() {
            let name = ["x", "y", "z"][axis];
            if upper[axis] < lower[axis] {
                return Err(Invalid::new(
                    self.key("max"),
                    format!("its {name} is {}, less than that of `min`, {}", max[axis], min[axis]),
                    "exchange the two, or correct one",
                ));
            }
            let ends = [("min", min[axis]), ("max", max[axis])];
            let beyond = ends.into_iter().find(|(_, x)| !(domain.min[axis]..=domain.max[axis]).contains(x));
            if let Some((end, x)) = beyond {
                return Err(Invalid::new(
                    self.key(end),
                    format!(
                        "its {name} is {x}, outside the domain, which goes from {} to {}",
                        domain.min[axis], domain.max[axis]
                    ),
                    "make the box smaller or enlarge the domain",
                ));
            }
        }
        Ok(Bounds { lower, upper })
    }

    /// The axes along which grains can move.
    pub(super) fn axes(&self) -> impl Iterator<Item = usize> + use<> {
        self.scene.domain.axes()
    }

    /// Refuses more grains than a machine can hold, and none at all.
    pub(super) fn check_count(&self, name: &str, count: u128) -> Result<(), Invalid> {
        if count == 0 {
            return Err(Invalid::new(
                self.key(name),
                "no grains",
                "ask for at least one grain, or leave out the source",
            ));
        }
        let room = u128::from(MOST_GRAINS) - self.placed as u128;
        if count > room {
            return Err(Invalid::new(
                self.key(name),
                format!("{count} grains need about {:.0} GB of memory", count as f64 * 600.0 / 1e9),
                format!("ask for at most {room} grains"),
            ));
        }
        Ok(())
    }
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014): every bit of the input changes half of the output.
fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A valid box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) lower: Vector3<f64>,
    pub(super) upper: Vector3<f64>,
}

/// How the grains of a block or lattice move, and what they carry.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    velocity: Vector3<f64>,
    thermal_speed: f64,
    spin: Vector3<f64>,
    strength: f64,
    planar: bool,
}

impl Motion {
    /// A grain that moves so; its thermal velocity is drawn from Maxwell's distribution, in two dimensions where the
    /// scene is planar.
    pub(super) fn grain(&self, position: Vector3<f64>, radius: f64, density: f64, rng: &mut impl Rng) -> NewGrain {
        let mut velocity = self.velocity;
        if self.thermal_speed > 0.0 {
            for axis in (0..3).filter(|&axis| !(self.planar && axis == 1)) {
                velocity[axis] += self.thermal_speed * rng.sample::<f64, _>(StandardNormal);
            }
        }
        NewGrain { position, velocity, spin: self.spin, radius, density, strength: self.strength }
    }
}
