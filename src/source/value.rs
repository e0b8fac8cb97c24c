//! Checks of single values, each with the message that a wrong one gives.

use nalgebra::Vector3;

use crate::scene::{Invalid, Vec3};

/// Neither NaN nor infinite.
pub(super) fn finite(key: &str, value: f64) -> Result<f64, Invalid> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Invalid::new(key, format!("{value} is not finite"), "give a finite number"))
    }
}

/// Finite and larger than 0.
pub(super) fn positive(key: &str, value: f64) -> Result<f64, Invalid> {
    if finite(key, value)? > 0.0 {
        Ok(value)
    } else {
        Err(Invalid::new(key, format!("{value} is not larger than 0"), "give a number larger than 0"))
    }
}

/// Finite and at least 0.
pub(super) fn not_negative(key: &str, value: f64) -> Result<f64, Invalid> {
    if finite(key, value)? >= 0.0 {
        Ok(value)
    } else {
        Err(Invalid::new(key, format!("{value} is negative"), "give 0 or a positive number"))
    }
}

/// All components finite.
pub(super) fn vector(key: &str, value: Vec3) -> Result<Vector3<f64>, Invalid> {
    match value.iter().all(|component| component.is_finite()) {
        true => Ok(value.into()),
        false => Err(Invalid::new(key, format!("{value:?} is not finite"), "give three finite numbers")),
    }
}

/// Finite, and of a length that is not 0: the unit vector.
pub(super) fn direction(key: &str, value: Vec3) -> Result<Vector3<f64>, Invalid> {
    let value = vector(key, value)?;
    // Scaled first, so that the square of a tiny or huge component neither vanishes nor overflows.
    (value / value.amax())
        .try_normalize(0.0)
        .filter(|unit| unit.iter().all(|component| component.is_finite()))
        .ok_or_else(|| {
            Invalid::new(key, format!("{:?} has no direction", value.data.0[0]), "give a vector that is not zero")
        })
}

/// A vector of a planar scene whose listed components (0 for x, 1 for y, 2 for z) must be 0.
pub(super) fn zero_in_plane(key: &str, value: &Vector3<f64>, axes: &[usize]) -> Result<(), Invalid> {
    for &axis in axes {
        if value[axis] != 0.0 {
            let name = ["x", "y", "z"][axis];
            return Err(Invalid::new(
                key,
                format!("its {name} is {}, but the scene is planar", value[axis]),
                format!("set its {name} to 0, or `planar = false`: grains of a planar scene stay in the plane y = 0"),
            ));
        }
    }
    Ok(())
}
