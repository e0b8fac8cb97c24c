//! Where grains come from: file, block, lattice and nozzle.
//!
//! [`place`] turns the sources of a scene into the grains that are there from the start, and into the [`Nozzle`]s that
//! send more of them later. Each source draws from a random stream of its own, so that adding a source at the end changes
//! no draw of the others.

mod block;
mod cells;
mod context;
mod file;
mod lattice;
mod nozzle;
mod radius;
mod value;
mod voids;

use std::path::Path;

use nalgebra::Vector3;

pub use nozzle::Nozzle;

use crate::grains::NewGrain;
use crate::scene::{Domain, Invalid, Scene, Source};
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
/// `surface_overlap` gets the centre (m) and radius (m) of a grain and says how deep it lies in the surface (m), or `None`.
///
/// # Errors
/// A value of a source that cannot be used; a table that cannot be read; grains that overlap each other or the surface, or
/// lie outside the domain; a block that cannot hold its grains; more grains than any machine can hold.
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
    surface_overlap: &dyn Fn(Vector3<f64>, f64) -> Option<f64>,
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
        for grain in grains {
            let id = placed.grains.len();
            check_alone(scene, number, id, &grain, &cells, surface_overlap)?;
            if !matches!(source, Source::Block(_)) {
                check_neighbours(scene, &placed, id, &grain, &cells)?;
                cells.insert(id as u32, grain.position, grain.radius);
            }
            placed.grains.push(grain);
        }
    }
    Ok(placed)
}

/// Refuses a grain that cannot be where it is, whatever the other grains do.
fn check_alone(
    scene: &Scene,
    number: usize,
    id: usize,
    grain: &NewGrain,
    cells: &Cells,
    surface_overlap: &dyn Fn(Vector3<f64>, f64) -> Option<f64>,
) -> Result<(), Invalid> {
    let key = format!("source[{number}]");
    let [x, y, z] = grain.position.data.0[0];
    let named = format!("grain {id} at ({x}, {y}, {z}), radius {},", grain.radius);
    if !is_inside(&scene.domain, grain.position) {
        let (min, max) = (scene.domain.min, scene.domain.max);
        return Err(Invalid::new(
            key,
            format!("{named} has its centre outside the domain, which goes from {min:?} to {max:?}"),
            "move the source or enlarge the domain",
        ));
    }
    let period = cells.period();
    let depths = period.iter().filter(|period| **period > 0.0).map(|period| 2.0 * grain.radius - period);
    if let Some(depth) = depths.reduce(f64::max).filter(|depth| *depth > OVERLAP_TOLERANCE * grain.radius) {
        return Err(Invalid::new(
            key,
            format!("{named} overlaps its own periodic image by {depth:.3e} m"),
            "enlarge the domain or make the grain smaller",
        ));
    }
    match surface_overlap(grain.position, grain.radius) {
        Some(depth) if depth > OVERLAP_TOLERANCE * grain.radius => Err(Invalid::new(
            key,
            format!("{named} overlaps the surface by {depth:.3e} m"),
            "move the source away from the surface",
        )),
        _ => Ok(()),
    }
}

/// Refuses a grain that overlaps one that is there already.
fn check_neighbours(scene: &Scene, placed: &Placed, id: usize, grain: &NewGrain, cells: &Cells) -> Result<(), Invalid> {
    let mut partner = None;
    cells.any_near(grain.position, grain.radius, |item, offset| {
        let depth = grain.radius + item.radius - offset.norm();
        if depth > OVERLAP_TOLERANCE * grain.radius.min(item.radius) {
            partner = Some((item.id as usize, depth));
        }
        partner.is_some()
    });
    let Some((other, depth)) = partner else { return Ok(()) };
    let number = placed.counts.len() - 1;
    let other_number = source_of(&placed.counts, other);
    Err(Invalid::new(
        format!("source[{number}]"),
        format!(
            "grain {id} (of source[{number}]) and grain {other} (of source[{other_number}]) overlap by {depth:.3e} m; \
             their radii are {} and {}",
            grain.radius, placed.grains[other].radius
        ),
        remedy_for_overlap(scene, other_number, number),
    ))
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

/// Which source the grain `id` came from.
fn source_of(counts: &[usize], id: usize) -> usize {
    let mut end = 0;
    counts
        .iter()
        .position(|count| {
            end += count;
            id < end
        })
        .expect("every grain has a source")
}

/// Whether a centre lies in the domain; NaN does not.
fn is_inside(domain: &Domain, position: Vector3<f64>) -> bool {
    (0..3)
        .filter(|&axis| !(domain.planar && axis == 1))
        .all(|axis| domain.min[axis] <= position[axis] && position[axis] <= domain.max[axis])
}
