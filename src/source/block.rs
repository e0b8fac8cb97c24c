//! Grains at random places in a box: random sequential addition (Widom 1966).
//!
//! One grain after the other is put at a place drawn evenly from all places that are still free. With equal radii this
//! is the classical process, draw for draw of the same distribution (see [`voids`](super::voids) for how the draws that
//! would fail are left out). Drawn radii are drawn first, all of them, and placed from the largest to the smallest:
//! the radii then have exactly the distribution that was asked for, which they have not when a radius is drawn anew
//! with each attempt, since small grains fit more often. Ids follow the draws, so they say nothing about size.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::cells::Cells;
use super::context::{Bounds, Context};
use super::radius::Radii;
use super::voids::Voids;
use crate::grains::{NewGrain, sphere_volume};
use crate::scene::{BlockSource, Inside, Invalid};

/// Fills the box with grains that keep clear of each other and of those in `cells`, and adds them there.
pub(super) fn fill(block: &BlockSource, context: &Context<'_>, cells: &mut Cells) -> Result<Vec<NewGrain>, Invalid> {
    let bounds = context.bounds(block.min, block.max)?;
    let radii = context.radii(block.radius.as_ref())?;
    let density = context.density(block.density)?;
    let motion = context.motion(block.velocity, block.thermal_speed, block.spin)?;
    let space = Space { bounds, inside: block.inside, planar: context.planar(), period: cells.period() };
    refuse_absurd_count(block.count, &radii, &space, context)?;

    let mut rng = context.rng();
    let radii: Vec<f64> = (0..block.count).map(|_| radii.draw(&mut rng)).collect();
    let mut order: Vec<usize> = (0..radii.len()).collect();
    order.sort_by(|&a, &b| radii[b].total_cmp(&radii[a]));
    let falling: Vec<f64> = order.iter().map(|&index| radii[index]).collect();
    space.check_fits(falling[0], context)?;

    let mut voids = Voids::new(space.centres(falling[falling.len() - 1]), space.walls(), falling.clone());
    let mut positions = vec![Vector3::zeros(); radii.len()];
    cells.make_room(radii.len());
    for (turn, &index) in order.iter().enumerate() {
        let Some(position) = voids.find(turn, cells, &mut rng) else {
            return Err(saturated(block, &falling[..turn], &space, context));
        };
        cells.insert((context.placed + index) as u32, position, radii[index]);
        positions[index] = position;
    }
    Ok(positions
        .iter()
        .zip(&radii)
        .map(|(&position, &radius)| motion.grain(position, radius, density, &mut rng))
        .collect())
}

/// Where the grains of a block may be.
struct Space {
    bounds: Bounds,
    inside: Inside,
    planar: bool,
    period: Vector3<f64>,
}

impl Space {
    /// Where centres of grains of this radius may be.
    fn centres(&self, radius: f64) -> Bounds {
        let margin = match self.inside {
            Inside::Centres => Vector3::zeros(),
            Inside::Grains => Vector3::new(radius, if self.planar { 0.0 } else { radius }, radius),
        };
        Bounds { lower: self.bounds.lower + margin, upper: self.bounds.upper - margin }
    }

    /// What the surfaces of the grains must not cross.
    fn walls(&self) -> Option<Bounds> {
        let far = Vector3::new(0.0, if self.planar { f64::INFINITY } else { 0.0 }, 0.0);
        let walls = Bounds { lower: self.bounds.lower - far, upper: self.bounds.upper + far };
        (self.inside == Inside::Grains).then_some(walls)
    }

    /// Volume (m³; in a planar scene the area, m²) that the grains may take up: that of the box, or where centres are
    /// inside, of the box and one radius around it.
    fn volume(&self, radius: f64) -> f64 {
        let sides = self.bounds.upper - self.bounds.lower;
        let margin = if self.inside == Inside::Centres { 2.0 * radius } else { 0.0 };
        let reach = |axis: usize| {
            let side = sides[axis] + margin;
            if self.period[axis] > 0.0 { side.min(self.period[axis]) } else { side }
        };
        (0..3).filter(|&axis| !(self.planar && axis == 1)).map(reach).product()
    }

    /// Volume of a grain (m³), or in a planar scene its area (m²).
    fn grain_volume(&self, radius: f64) -> f64 {
        if self.planar { PI * radius.powi(2) } else { sphere_volume(radius) }
    }

    /// What a solid fraction is a fraction of.
    fn kind(&self) -> &'static str {
        if self.planar { "area" } else { "volume" }
    }

    fn check_fits(&self, largest: f64, context: &Context<'_>) -> Result<(), Invalid> {
        let centres = self.centres(largest);
        match (0..3).find(|&axis| centres.upper[axis] < centres.lower[axis]) {
            None => Ok(()),
            Some(axis) => Err(Invalid::new(
                context.key("max"),
                format!(
                    "a grain of radius {largest} does not fit into the box, which is {} wide along {}",
                    self.bounds.upper[axis] - self.bounds.lower[axis],
                    ["x", "y", "z"][axis]
                ),
                "make the box wider than the grain, or set `inside = \"centres\"`",
            )),
        }
    }
}

/// Solid fractions that random sequential addition does not reach in a box that is many grains wide, in space and in the
/// plane. It saturates at 0.3841 and 0.5471 (Zhang & Torquato 2013), in a box with walls a little below, and with a
/// thousand grains the saturation scatters by less than 0.01. To ask for more is refused at once; without this it would
/// be refused too, but in a large box only after the minutes that it takes to fill it.
const OUT_OF_REACH: [f64; 2] = [0.45, 0.62];

/// What "many grains wide" means, in radii.
const WIDE: f64 = 20.0;

/// Refuses at once, before anything is allocated, what cannot be placed.
fn refuse_absurd_count(count: u64, radii: &Radii, space: &Space, context: &Context<'_>) -> Result<(), Invalid> {
    let (smallest, largest) = radii.bounds();
    let volume = space.volume(largest);
    let refuse = |what: String, fewer: f64| {
        let remedy = format!("ask for fewer (about {fewer:.0} are random), enlarge the box or make the grains smaller");
        Err(Invalid::new(context.key("count"), format!("{count} grains cannot fit into the box: {what}"), remedy))
    };
    let most = radii.densest_packing(space.planar) * volume / space.grain_volume(smallest);
    // One grain always fits, whatever the rounding.
    if count as f64 > most.max(1.0) * (1.0 + 4.0 * f64::EPSILON) {
        return refuse(format!("not even the densest packing holds more than {most:.0}"), 0.5 * most);
    }
    let out_of_reach = OUT_OF_REACH[usize::from(space.planar)];
    let fraction = count as f64 * space.grain_volume(smallest) / volume;
    let is_wide = context.axes().all(|axis| space.bounds.upper[axis] - space.bounds.lower[axis] >= WIDE * largest);
    if matches!(radii, Radii::Constant(_)) && is_wide && fraction > out_of_reach {
        let saturation = if space.planar { 0.547 } else { 0.384 };
        let what = format!(
            "they would have a {} fraction of {fraction:.3}, and random places run out at about {saturation}",
            space.kind()
        );
        return refuse(what, count as f64 * 0.9 * saturation / fraction);
    }
    context.check_count("count", u128::from(count))
}

/// The box is full before all grains are in it.
fn saturated(block: &BlockSource, placed: &[f64], space: &Space, context: &Context<'_>) -> Invalid {
    let solid: f64 = placed.iter().map(|&radius| space.grain_volume(radius)).sum();
    let mean_radius = placed.iter().sum::<f64>() / placed.len().max(1) as f64;
    let fraction = solid / space.volume(mean_radius);
    let kind = space.kind();
    Invalid::new(
        context.key("count"),
        format!(
            "only {} of {} grains fit: then no place is left in the box, at a solid {kind} fraction of {fraction:.3}{}",
            placed.len(),
            block.count,
            match block.inside {
                Inside::Centres => " (of the box and the radius around it)",
                Inside::Grains => "",
            }
        ),
        format!(
            "ask for at most {} (a few fewer if the seed changes), enlarge the box, make the grains smaller, or use a \
             lattice, which packs more densely",
            placed.len()
        ),
    )
}
