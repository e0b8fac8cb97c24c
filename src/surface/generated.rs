//! Surfaces that are made rather than read: disc, rectangle, sine wave.

use nalgebra::Vector3;
use std::f64::consts::TAU;

use super::{Triangle, unit};
use crate::scene::{DiscSurface, Invalid, RectangleSurface, SineSurface};

/// More triangles than this are a slip of the pen rather than a surface: they would take gigabytes.
const MOST_TRIANGLES: u64 = 5_000_000;

/// A flat disc, as a fan about its centre.
pub(super) fn disc(disc: &DiscSurface, key: &str) -> Result<Vec<Triangle>, Invalid> {
    let normal = unit(disc.normal, &format!("{key}.normal"))?;
    positive(disc.radius, &format!("{key}.radius"))?;
    if disc.segments < 3 {
        let what = format!("{} corners do not make a disc", disc.segments);
        return Err(Invalid::new(format!("{key}.segments"), what, "give 3 or more"));
    }
    few_enough(u64::from(disc.segments), &format!("{key}.segments"))?;
    let centre = Vector3::from(disc.centre);
    let across = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let along = across.cross(&normal);
    let rim = |i: u32| {
        // The last corner is the first one, bit for bit.
        let (sin, cos) = (TAU * f64::from(i % disc.segments) / f64::from(disc.segments)).sin_cos();
        centre + (across * cos + along * sin) * disc.radius
    };
    Ok((0..disc.segments).map(|i| [centre, rim(i), rim(i + 1)]).collect())
}

/// A flat rectangle in cells of two triangles.
pub(super) fn rectangle(rectangle: &RectangleSurface, key: &str) -> Result<Vec<Triangle>, Invalid> {
    let normal = unit(rectangle.normal, &format!("{key}.normal"))?;
    let along = unit(rectangle.along, &format!("{key}.along"))?;
    let along = along - normal * along.dot(&normal);
    // Nearer to parallel than this, what is left of `along` is its rounding.
    if along.norm() < 1e-9 {
        let what = format!("{:?} is parallel to the normal", rectangle.along);
        return Err(Invalid::new(format!("{key}.along"), what, "give the direction of one side"));
    }
    let along = along.normalize();
    let across = normal.cross(&along);
    let [length, breadth] = rectangle.size;
    positive(length.min(breadth), &format!("{key}.size"))?;
    let centre = Vector3::from(rectangle.centre);
    grid(rectangle.divisions, &format!("{key}.divisions"), |s, t| {
        centre + along * ((s - 0.5) * length) + across * ((t - 0.5) * breadth)
    })
}

/// A sine wave over a rectangle: straight pieces along x, one strip along y (Arbelaez et al. 2009, fig. 19).
pub(super) fn sine(sine: &SineSurface, key: &str) -> Result<Vec<Triangle>, Invalid> {
    let [length, breadth] = sine.size;
    positive(length.min(breadth), &format!("{key}.size"))?;
    positive(sine.wavelength, &format!("{key}.wavelength"))?;
    positive(f64::from(sine.pieces), &format!("{key}.pieces"))?;
    if !sine.amplitude.is_finite() {
        return Err(Invalid::new(
            format!("{key}.amplitude"),
            format!("{} is not finite", sine.amplitude),
            "give a height",
        ));
    }
    // The conversion saturates, and is then refused as too many.
    let pieces = (length / sine.wavelength * f64::from(sine.pieces)).round().max(1.0) as u32;
    let centre = Vector3::from(sine.centre);
    grid([pieces, 1], &format!("{key}.pieces"), |s, t| {
        let [x, y] = [(s - 0.5) * length, (t - 0.5) * breadth];
        centre + Vector3::new(x, y, sine.amplitude * (TAU * x / sine.wavelength).sin())
    })
}

/// Cells of two triangles over the unit square, carried to where `place` puts them.
fn grid([m, n]: [u32; 2], key: &str, place: impl Fn(f64, f64) -> Vector3<f64>) -> Result<Vec<Triangle>, Invalid> {
    positive(f64::from(m.min(n)), key)?;
    few_enough(u64::from(m).saturating_mul(u64::from(n)).saturating_mul(2), key)?;
    let at = |i: u32, j: u32| place(f64::from(i) / f64::from(m), f64::from(j) / f64::from(n));
    let cell = |i: u32, j: u32| {
        let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
    };
    let cells = (0..m).flat_map(|i| (0..n).map(move |j| (i, j)));
    Ok(cells.flat_map(|(i, j)| cell(i, j)).collect())
}

fn positive(value: f64, key: &str) -> Result<(), Invalid> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Invalid::new(key, format!("{value} is not a size"), "give a value above 0"))
}

fn few_enough(triangles: u64, key: &str) -> Result<(), Invalid> {
    if triangles <= MOST_TRIANGLES {
        return Ok(());
    }
    let what = format!("would make {triangles} triangles");
    Err(Invalid::new(key, what, format!("stay below {MOST_TRIANGLES} triangles")))
}
