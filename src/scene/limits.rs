//! What a single number of a scene may be.

use super::{Invalid, Vec3};

/// Largest magnitude of a number of the scene, its times apart, and smallest radius, density or width, in SI units. Energies and
/// discriminants are products of several such numbers and must be numbers too; nothing that grains do is anywhere near.
pub(crate) const LARGEST: f64 = 1e30;
pub(crate) const SMALLEST: f64 = 1e-30;

pub(super) type Checked = Result<(), Invalid>;

/// Whether a vector of a planar scene has nothing along y.
pub(super) fn in_plane(key: &str, vector: Vec3) -> Checked {
    if vector[1] == 0.0 {
        return Ok(());
    }
    let what = format!("{vector:?} points out of the plane y = 0");
    Err(Invalid::new(key, what, "the scene is planar: set the second number to 0, or `domain.planar = false`"))
}

pub(super) fn positive(key: &str, value: f64, unit: &str) -> Checked {
    if value <= 0.0 {
        return Err(Invalid::new(key, format!("{value} {unit} is not above 0"), "give a number above 0"));
    }
    if value < SMALLEST {
        let what = format!("{value:e} {unit} is too small to compute with");
        return Err(Invalid::new(key, what, format!("give {SMALLEST:e} {unit} or more")));
    }
    Ok(())
}

pub(super) fn not_negative(key: &str, value: f64, remedy: &str) -> Checked {
    if value >= 0.0 {
        return Ok(());
    }
    Err(Invalid::new(key, format!("{value} is below 0"), remedy))
}
