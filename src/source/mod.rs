//! Where grains come from: file, block, lattice and nozzle.
//!
//! [`place`] turns the sources of a scene into the grains that are there from the start, and into the [`Nozzle`]s that
//! send more of them later. Each source draws from a random stream of its own, so that adding a source at the end changes
//! no draw of the others.

mod block;
mod cells;
mod context;
mod displacement;
mod file;
mod lattice;
mod nozzle;
mod radius;
mod value;
mod voids;

use std::path::Path;

use nalgebra::Vector3;

pub use displacement::Displacement;
pub use nozzle::Nozzle;

use crate::grains::NewGrain;
use crate::scene::{Boundary, Domain, Invalid, Scene, Source, unresolved};
use cells::Cells;
use context::Context;

/// How deep two grains, or a grain and the surface, may overlap at the start, over the (smaller) radius.
///
/// Grains that just touch (Newton's cradle) overlap by the rounding of their positions, 1e-16 of the distance from the
/// origin; this lets them pass up to a million radii away from it. It is a tenth of the overlap that a run may show.
const OVERLAP_TOLERANCE: f64 = 1e-10;

/// Most grains that the sources of one scene may place: at 600 bytes each they fill 60 GB.
const MOST_GRAINS: u64 = 100_000_000;

/// What the sources of a scene place.
#[derive(Clone, Debug, Default)]
pub struct Placed {
    /// The grains that are there from the start, in the order of their ids.
    pub grains: Vec<NewGrain>,
    /// How many of them come from each source, in the order of the scene; 0 for a nozzle.
    pub counts: Vec<usize>,
    /// The nozzles, in the order of the scene.
    pub nozzles: Vec<Nozzle>,
}

/// Places the grains of all sources of `scene`; relative paths start from `folder`.
///
/// `surface_overlap` gets the centre (m) and radius (m) of a grain and says in which surface of the scene it lies the deepest
/// and how deep (m), or `None`.
///
/// # Errors
/// A value of a source that cannot be used; a table that cannot be read; grains that overlap each other or the surface, or
/// lie outside the domain, or are too large for a periodic one; a block that cannot hold its grains; more grains than any
/// machine can hold.
///
/// ```
/// let scene: impinge::scene::Scene = toml::from_str(
///     r#"
///     run.until = 1.0
///     domain = { min = [-1.0, -1.0, -1.0], max = [1.0, 1.0, 1.0] }
///     grain = { radius = 0.01, density = 2500.0 }
///     [[source]]
///     kind = "block"
///     min = [-0.5, -0.5, 0.0]
///     max = [0.5, 0.5, 0.5]
///     count = 100
///     velocity = [0.0, 0.0, -10.0]
///     "#,
/// )?;
/// let placed = impinge::source::place(&scene, ".".as_ref(), &|_, _| None)?;
/// assert_eq!(placed.grains.len(), 100);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn place(
    scene: &Scene,
    folder: &Path,
    surface_overlap: &dyn Fn(Vector3<f64>, f64) -> Option<(usize, f64)>,
) -> Result<Placed, Invalid> {
    let mut placed = Placed::default();
    let mut cells = Cells::new(&scene.domain);
    for (number, source) in scene.source.iter().enumerate() {
        let context = Context { scene, number, placed: placed.grains.len() };
        let grains = match source {
            Source::File(file) => file::read(file, folder, &context)?,
            Source::Block(block) => block::fill(block, &context, &mut cells)?,
            Source::Lattice(lattice) => lattice::fill(lattice, &context)?,
            Source::Nozzle(nozzle) => {
                placed.nozzles.push(Nozzle::new(scene, number, nozzle)?);
                Vec::new()
            }
        };
        placed.counts.push(grains.len());
        placed.grains.reserve_exact(grains.len());
        if !matches!(source, Source::Block(_)) {
            cells.make_room(grains.len());
        }
        for grain in grains {
            let id = placed.grains.len();
            let origins = Origins { scene, folder, counts: &placed.counts };
            check_alone(&origins, id, &grain, surface_overlap)?;
            if !matches!(source, Source::Block(_)) {
                check_neighbours(&origins, &placed.grains, id, &grain, &cells)?;
                cells.insert(id as u32, grain.position, grain.radius);
            }
            placed.grains.push(grain);
        }
    }
    Ok(placed)
}

/// Where grains come from, as messages say it.
struct Origins<'a> {
    scene: &'a Scene,
    folder: &'a Path,
    /// How many grains each source has placed so far.
    counts: &'a [usize],
}

impl Origins<'_> {
    /// The source of grain `id`, and the number of the grain in it.
    fn source_of(&self, id: usize) -> (usize, usize) {
        let mut first = 0;
        for (number, count) in self.counts.iter().enumerate() {
            if id < first + count {
                return (number, id - first);
            }
            first += count;
        }
        unreachable!("every grain has a source")
    }

    /// The key that a fault of grain `id` is reported under: a row of a table is to blame on the table.
    fn key(&self, id: usize) -> String {
        let (number, _) = self.source_of(id);
        match self.scene.source[number] {
            Source::File(_) => format!("source[{number}].path"),
            _ => format!("source[{number}]"),
        }
    }

    /// What messages call grain `id`.
    fn name(&self, id: usize) -> String {
        let (number, row) = self.source_of(id);
        let Source::File(table) = &self.scene.source[number] else { return format!("grain {id} of source[{number}]") };
        match file::line_of(table, self.folder, row) {
            Some(line) => format!("grain {id} ({}, line {line})", table.path),
            None => format!("grain {id} ({})", table.path),
        }
    }
}

/// Refuses a grain that cannot be where it is, whatever the other grains do.
fn check_alone(
    origins: &Origins<'_>,
    id: usize,
    grain: &NewGrain,
    surface_overlap: &dyn Fn(Vector3<f64>, f64) -> Option<(usize, f64)>,
) -> Result<(), Invalid> {
    let domain = &origins.scene.domain;
    let [x, y, z] = grain.position.data.0[0];
    let refuse = |what: &str, remedy: &str| {
        let name = origins.name(id);
        let what = format!("{name} at ({x}, {y}, {z}), radius {} m, {what}", grain.radius);
        Err(Invalid::new(origins.key(id), what, remedy))
    };
    if !is_inside(domain, grain.position) {
        let what = format!("has its centre outside the domain, which goes from {:?} to {:?}", domain.min, domain.max);
        return refuse(&what, "move the grain or enlarge the domain");
    }
    check_period(domain, grain.radius)?;
    if let Some((what, remedy)) = unresolved(grain.radius, domain) {
        return Err(Invalid::new(origins.key(id), format!("{}: {what}", origins.name(id)), remedy));
    }
    match surface_overlap(grain.position, grain.radius) {
        Some((surface, depth)) if !just_touches(depth, grain.radius) => {
            refuse(&format!("overlaps surface[{surface}] by {depth:.3e} m"), "move the grain away from the surface")
        }
        _ => Ok(()),
    }
}

/// Refuses a periodic domain that is too narrow for grains of this radius (m).
fn check_period(domain: &Domain, radius: f64) -> Result<(), Invalid> {
    let least = impinge_events::least_period(radius);
    let narrow =
        domain.axes().filter(|_| domain.boundary == Boundary::Periodic).find(|&axis| domain.side(axis) < least);
    let Some(axis) = narrow else { return Ok(()) };
    let (name, side) = (["x", "y", "z"][axis], domain.side(axis));
    Err(Invalid::new(
        format!("domain.max[{axis}]"),
        format!(
            "along {name} the periodic domain is {} m wide, too narrow for grains of radius {} m",
            brief(side),
            brief(radius)
        ),
        // What stands there after rounding is enough.
        format!("make it at least {} m wide (eight radii and a little), or the grains smaller", brief(1.00001 * least)),
    ))
}

/// A number to six digits.
fn brief(number: f64) -> f64 {
    format!("{number:.5e}").parse().unwrap_or(number)
}

/// Refuses a grain that overlaps one that is there already.
fn check_neighbours(
    origins: &Origins<'_>,
    placed: &[NewGrain],
    id: usize,
    grain: &NewGrain,
    cells: &Cells,
) -> Result<(), Invalid> {
    let mut partner = None;
    cells.any_near(grain.position, grain.radius, |item, offset| {
        let depth = grain.radius + item.radius - offset.norm();
        if !just_touches(depth, grain.radius.min(item.radius)) {
            partner = Some((item.id as usize, depth));
        }
        partner.is_some()
    });
    let Some((other, depth)) = partner else { return Ok(()) };
    let what = format!(
        "{} and {} overlap by {depth:.3e} m; their radii are {} and {} m",
        origins.name(other),
        origins.name(id),
        placed[other].radius,
        grain.radius
    );
    let remedy = remedy_for_overlap(origins.scene, origins.source_of(other).0, origins.source_of(id).0);
    Err(Invalid::new(origins.key(id), what, remedy))
}

fn remedy_for_overlap(scene: &Scene, first: usize, second: usize) -> String {
    match (&scene.source[first], &scene.source[second]) {
        (_, Source::Lattice(lattice)) if first == second => {
            let largest = lattice::largest_radius(lattice, &scene.domain);
            format!(
                "the largest radius that fits this lattice is {largest}; make the grains smaller or take fewer cells"
            )
        }
        (Source::Block(_), _) => {
            format!("put source[{first}] behind source[{second}]: a block keeps clear of the sources before it")
        }
        (Source::File(_), Source::File(_)) if first == second => {
            "correct the table or make the grains smaller".to_string()
        }
        _ => "move one of the sources".to_string(),
    }
}

/// Whether an overlap of this depth (m) is no more than rounding for a grain of this radius (m).
#[must_use]
pub(crate) fn just_touches(depth: f64, radius: f64) -> bool {
    depth <= OVERLAP_TOLERANCE * radius
}

/// Whether a centre lies in the domain; NaN does not.
fn is_inside(domain: &Domain, position: Vector3<f64>) -> bool {
    domain.axes().all(|axis| domain.min[axis] <= position[axis] && position[axis] <= domain.max[axis])
}
