//! Does the scene make sense? Everything that can be told without building its sources and surfaces.

use toml::Value;

use super::limits::{Checked, LARGEST, in_plane, not_negative, positive};
use super::{
    Arrangement, Boundary, Contact, Distribution, Domain, Friction, Interference, Invalid, Radius, Scene, Source,
    Surface, forces, measure, stepped,
};

/// Most grains that blocks and lattices of one scene may ask for. At the 600 bytes that a grain costs they fill 60 GB; more is
/// a misplaced exponent, and is better refused than tried.
const GRAINS_MAX: u64 = 100_000_000;

/// Most rows of the time history and most frames: each frame is a file, each row a look at all grains.
const ROWS_MAX: u32 = 10_000_000;

/// The times of the scene, which may be of any magnitude.
const TIMES: [&str; 2] = ["run.until", "run.start"];

/// Smallest radius of a grain in units in the last place (2^-52) of the largest coordinate of its domain.
///
/// A position is known to half such a unit, and an overlap gathers the rounding of a few positions, four units at most; a run stops
/// at an overlap of 1e-9 radii. (A dense gas of radius 9e-4 m at 1 km showed 2.7e-10 in 5 million collisions, one of 2e-4 m stopped at
/// once.) Consequence: a domain reaches out to 1.1 million radii from the origin, and not further.
const UNITS_IN_RADIUS: f64 = 4e9;

/// Validates all of a scene that belongs to no single source or surface.
///
/// # Errors
/// The first value that cannot be used.
pub fn check(scene: &Scene) -> Checked {
    finite(scene)?;
    run(scene)?;
    domain(scene)?;
    check_radius("grain.radius", &scene.grain.radius)?;
    positive("grain.density", scene.grain.density, "kg/m³")?;
    contacts(scene)?;
    sources(scene)?;
    resolved(scene)?;
    forces::check(scene)?;
    stepped::check(scene)?;
    measure::check(scene)?;
    if scene.domain.planar { planar(scene) } else { Ok(()) }
}

/// Validates a radius that stands at `key`.
///
/// # Errors
/// A radius that is not above 0, or a spread with which radii at or below 0 could be drawn.
pub fn check_radius(key: &str, radius: &Radius) -> Checked {
    let drawn = match radius {
        Radius::Constant(radius) => return positive(key, *radius, "m"),
        Radius::Drawn(drawn) => drawn,
    };
    positive(&format!("{key}.mean"), drawn.mean, "m")?;
    let widest = match drawn.distribution {
        Distribution::Uniform => 1.0 / 3.0_f64.sqrt(),
        Distribution::Normal => 1.0 / 3.0,
        Distribution::Lognormal => f64::INFINITY,
    };
    if (0.0..widest).contains(&drawn.cv) {
        return Ok(());
    }
    let remedy = match widest.is_finite() {
        true => format!("use 0 or more and less than {widest:.4}, or `distribution = \"lognormal\"`"),
        false => "use 0 or more".to_owned(),
    };
    Err(Invalid::new(
        format!("{key}.cv"),
        format!("a coefficient of variation of {} is outside what this distribution allows", drawn.cv),
        remedy,
    ))
}

/// No number anywhere is NaN or infinite: found by walking the scene as it would be written back.
fn finite(scene: &Scene) -> Checked {
    let tree = Value::try_from(scene).map_err(|error| {
        Invalid::new("seed", format!("{} cannot stand in a file: {error}", scene.seed), "use a smaller one")
    })?;
    all_finite(&tree, "")
}

fn all_finite(value: &Value, path: &str) -> Checked {
    match value {
        Value::Float(number) if !number.is_finite() => Err(Invalid::new(
            path,
            format!("{number} is no finite number"),
            "give a finite number, or leave the key out",
        )),
        Value::Float(number) if number.abs() > LARGEST && !TIMES.contains(&path) => Err(Invalid::new(
            path,
            format!("{number:e} is too large to compute with"),
            format!("give a number of magnitude {LARGEST:e} at most, in SI units"),
        )),
        Value::Table(table) => table.iter().try_for_each(|(name, value)| match path {
            "" => all_finite(value, name),
            _ => all_finite(value, &format!("{path}.{name}")),
        }),
        Value::Array(array) => {
            array.iter().enumerate().try_for_each(|(i, value)| all_finite(value, &format!("{path}[{i}]")))
        }
        _ => Ok(()),
    }
}

fn run(scene: &Scene) -> Checked {
    let run = &scene.run;
    if run.until <= run.start {
        let what = format!("{} s is not after the start at {} s", run.until, run.start);
        return Err(Invalid::new("run.until", what, "give a later end, or an earlier `run.start`"));
    }
    for (key, rows) in [("run.frames", run.frames), ("output.samples", scene.output.samples)] {
        if rows > ROWS_MAX {
            let what = format!("{rows} are more than anyone can use");
            return Err(Invalid::new(key, what, format!("use at most {ROWS_MAX}")));
        }
    }
    Ok(())
}

fn domain(scene: &Scene) -> Checked {
    let domain = &scene.domain;
    for axis in domain.axes() {
        if !domain.side(axis).is_finite() || domain.side(axis) <= 0.0 {
            let name = ["x", "y", "z"][axis];
            let what = format!("along {name} the domain reaches from {} to {} m", domain.min[axis], domain.max[axis]);
            return Err(Invalid::new(format!("domain.max[{axis}]"), what, "`min` must be below `max` on every axis"));
        }
    }
    if domain.boundary == Boundary::Periodic && !scene.surface.is_empty() {
        let what =
            "grains that leave a periodic domain come in again on the other side, but surfaces are not repeated there";
        let remedy = "take the surfaces out, or set `domain.boundary = \"open\"`";
        return Err(Invalid::new("surface[0]", what, remedy));
    }
    Ok(())
}

fn contacts(scene: &Scene) -> Checked {
    let pairs = scene.run.interference != Interference::None;
    let surface = !scene.surface.is_empty();
    let contacts = [
        (
            "grain",
            &scene.contact.grain,
            pairs,
            "grains collide with each other; without, set `run.interference = \"none\"`",
        ),
        ("surface", &scene.contact.surface, surface, "the scene has a surface"),
    ];
    for (name, contact, needed, why) in contacts {
        let key = format!("contact.{name}");
        match contact {
            Some(contact) => check_contact(&key, contact)?,
            None if needed => {
                let remedy = format!("add `[{key}]` with `restitution = ...`: {why}");
                return Err(Invalid::new(&key, format!("missing table `[{key}]`"), remedy));
            }
            None => {}
        }
    }
    Ok(())
}

fn check_contact(key: &str, contact: &Contact) -> Checked {
    let e = contact.restitution;
    if !(0.0..=1.0).contains(&e) {
        let remedy = "use a number from 0 (nothing comes back) to 1 (elastic)";
        return Err(Invalid::new(format!("{key}.restitution"), format!("{e} is outside [0, 1]"), remedy));
    }
    let key = format!("{key}.friction");
    let not_negative = |key: &str, mu: f64| not_negative(key, mu, "friction is 0 (smooth) or more");
    match contact.friction {
        Friction::Coefficient(mu) => not_negative(&key, mu),
        Friction::StaticDynamic(mu) => {
            not_negative(&format!("{key}.static"), mu.static_)?;
            not_negative(&format!("{key}.dynamic"), mu.dynamic)?;
            if mu.dynamic > mu.static_ {
                let what = format!("{} is above the static friction {}", mu.dynamic, mu.static_);
                return Err(Invalid::new(
                    format!("{key}.dynamic"),
                    what,
                    "dynamic friction is at most static friction",
                ));
            }
            Ok(())
        }
        Friction::Regularised(law) => {
            not_negative(&format!("{key}.coefficient"), law.coefficient)?;
            positive(&format!("{key}.slip_speed"), law.slip_speed, "m/s")
        }
    }
}

fn sources(scene: &Scene) -> Checked {
    if scene.source.is_empty() {
        let remedy = "add `[[source]]` with a `kind`: \"file\", \"block\", \"lattice\" or \"nozzle\"";
        return Err(Invalid::new("source", "there is no source, so there are no grains", remedy));
    }
    let mut total = 0_u64;
    for (i, source) in scene.source.iter().enumerate() {
        let (name, count) = match source {
            Source::Block(block) => ("count", block.count),
            Source::Lattice(lattice) => {
                let places = if lattice.arrangement == Arrangement::FaceCentred { 4 } else { 1 };
                let [x, y, z] = lattice.cells.map(u64::from);
                (
                    "cells",
                    x.saturating_mul(if scene.domain.planar { 1 } else { y }).saturating_mul(z).saturating_mul(places),
                )
            }
            Source::File(_) | Source::Nozzle(_) => continue,
        };
        total = total.saturating_add(count);
        if total > GRAINS_MAX {
            let what = format!("{total} grains are more than fit into memory");
            return Err(Invalid::new(format!("source[{i}].{name}"), what, format!("use at most {GRAINS_MAX} in all")));
        }
    }
    Ok(())
}

/// The grains of every source can be told from the rounding of their positions. Tables say their radii themselves, and what has no lower
/// bound is drawn first: those are looked at grain by grain.
fn resolved(scene: &Scene) -> Checked {
    for (i, source) in scene.source.iter().enumerate() {
        let radius = match source {
            Source::File(_) => continue,
            Source::Block(block) => &block.radius,
            Source::Lattice(lattice) => &lattice.radius,
            Source::Nozzle(nozzle) => &nozzle.radius,
        };
        let (key, radius) = match radius {
            Some(radius) => (format!("source[{i}].radius"), radius),
            None => ("grain.radius".to_owned(), &scene.grain.radius),
        };
        check_radius(&key, radius)?;
        let (key, smallest) = match radius {
            Radius::Constant(radius) => (key, *radius),
            Radius::Drawn(drawn) => {
                let widest = match drawn.distribution {
                    Distribution::Uniform => 3f64.sqrt(),
                    Distribution::Normal => 3.0,
                    Distribution::Lognormal => 0.0,
                };
                (format!("{key}.mean"), drawn.mean * (1.0 - widest * drawn.cv))
            }
        };
        if let Some((what, remedy)) = unresolved(smallest, &scene.domain) {
            return Err(Invalid::new(key, what, remedy));
        }
    }
    Ok(())
}

/// What is wrong with a radius (m) that is lost in the rounding of positions somewhere in the domain, and what to do about it.
pub(crate) fn unresolved(radius: f64, domain: &Domain) -> Option<(String, String)> {
    let furthest = domain.axes().map(|axis| domain.min[axis].abs().max(domain.max[axis].abs())).fold(0.0, f64::max);
    let unit = f64::EPSILON * furthest;
    let least = UNITS_IN_RADIUS * unit;
    if radius >= least {
        return None;
    }
    let what = format!(
        "a radius of {radius:e} m is lost in the rounding of positions, {unit:.1e} m in a domain that reaches out to {furthest} m"
    );
    let furthest = radius / (UNITS_IN_RADIUS * f64::EPSILON);
    let remedy = format!(
        "put the origin among the grains and end the domain {furthest:.3e} m from it, or use radii of {least:.3e} m and more"
    );
    Some((what, remedy))
}

/// In a planar scene nothing points out of the plane y = 0, and spins point nowhere else.
fn planar(scene: &Scene) -> Checked {
    for (i, source) in scene.source.iter().enumerate() {
        let key = |name: &str| format!("source[{i}].{name}");
        let (velocity, spin) = match source {
            Source::File(_) => continue,
            Source::Block(block) => (block.velocity, block.spin),
            Source::Lattice(lattice) => (lattice.velocity, lattice.spin),
            Source::Nozzle(nozzle) => {
                in_plane(&key("centre"), nozzle.centre)?;
                in_plane(&key("axis"), nozzle.axis)?;
                ([0.0; 3], nozzle.spin)
            }
        };
        in_plane(&key("velocity"), velocity)?;
        if spin[0] != 0.0 || spin[2] != 0.0 {
            let what = format!("{spin:?} turns out of the plane y = 0");
            return Err(Invalid::new(key("spin"), what, "in a planar scene grains spin about y only: [0, w, 0]"));
        }
    }
    for (i, surface) in scene.surface.iter().enumerate() {
        let key = |name: &str| format!("surface[{i}].{name}");
        let (normal, velocity) = match surface {
            Surface::Plane(plane) => (plane.normal, plane.velocity),
            Surface::Disc(disc) => (disc.normal, disc.velocity),
            Surface::Rectangle(rectangle) => (rectangle.normal, rectangle.velocity),
            Surface::Mesh(mesh) => ([0.0; 3], mesh.velocity),
            Surface::Sine(sine) => ([0.0; 3], sine.velocity),
        };
        in_plane(&key("normal"), normal)?;
        in_plane(&key("velocity"), velocity)?;
    }
    Ok(())
}
