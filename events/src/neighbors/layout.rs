//! Size, motion and growth of the cells, chosen so that grains cross few of them.

use nalgebra::Vector3;

use super::slots::{cells_of_period, hashed_slots, slots};
use super::stream::Stream;
use crate::{Domain, Flight};

/// A cell is wider than the largest contact distance by this fraction, so that a crossing that is late by rounding cannot
/// hide a contact; the position of a grain is known to about 1e-16 of its distance from the origin.
const CELL_MARGIN: f64 = 1e-6;
/// Fewest cells along an axis of a periodic domain. With four, two grains in adjacent cells have one nearest image.
pub(super) const FEWEST_PERIODIC_CELLS: i32 = 4;
/// No grain stands so many cells from the corner when the grid is laid out: the numbers of cells (below 2^31) then last for an epoch.
const FARTHEST_CELL: f64 = (1u32 << 29) as f64;

/// Width of the smallest cells that grains up to this radius (m) may have, m.
pub(super) fn contact_width(largest_radius: f64) -> f64 {
    2.0 * largest_radius * (1.0 + CELL_MARGIN)
}

/// The box of cells with which a hashed table is full, and begins anew, is so many times as wide along x (and y) as a cube of as many cells, and flatter along z: a spray is
/// wide and flat, as a rule, and a surface across z. Others share a slot less far away.
const WIDER: f64 = std::f64::consts::SQRT_2;
/// By this part of a layer the box above is shifted: so a column of cells does not meet itself, in any of the next few boxes, for this is the golden section.
const SHIFT: f64 = 0.382;

/// Steps between the numbers of cells that are adjacent along x, y and z where there is no period, for a table of so many slots: row by row, layer by layer. So a grain
/// shares its slot with others that are as far away as can be, and not with those that a hash happens to choose: most of them are where nobody is.
fn strides_of_hash(planar: bool, slots: usize) -> [u32; 3] {
    let slots = slots as f64;
    let row = if planar { 1.0 } else { (WIDER * slots.cbrt()).round() };
    let wanted = if planar { WIDER * slots.sqrt() } else { row * row };
    let layer = (slots / ((slots / wanted).floor() + SHIFT)).round();
    [1, row as u32, layer as u32]
}

/// Size and motion of the grid.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Size of a cell, m.
    pub(super) size: Vector3<f64>,
    /// Cells in a period along each axis; 0 where there is none.
    pub(super) period: Vector3<i32>,
    /// Length of the period along each axis, m; 0 where there is none.
    pub(super) extent: Vector3<f64>,
    /// Steps between the numbers of cells that are adjacent along x, y and z.
    strides: [u32; 3],
    /// Number of cell (0, 0, 0).
    pub(super) first_number: u32,
    /// Corner of cell (0, 0, 0) at epoch time 0, m.
    pub(super) corner: Vector3<f64>,
    /// Velocity of that corner, m/s.
    pub(super) drift: Vector3<f64>,
    /// By which part of its size at `born` a cell grows in a second, 1/s; never negative.
    growth: Vector3<f64>,
    /// By how much (m/s) each side of the cells moves faster than the one below it: as much as a cell grows.
    pub(super) rise: Vector3<f64>,
    /// When the cells were laid out, s (epoch time).
    pub(super) born: f64,
}

impl Layout {
    /// Cells of about `width` (m), and at least of the size of a contact of grains with `largest_radius` (m), for a stream.
    ///
    /// The grid drifts with the median velocity: that makes the fewest crossings. In a period that these fill only in part there are so many
    /// grains `everywhere`.
    pub(super) fn new(
        domain: &Domain,
        largest_radius: f64,
        width: Option<f64>,
        everywhere: usize,
        stream: &Stream,
    ) -> Self {
        let &Stream { now, ref sample, .. } = stream;
        let contact = contact_width(largest_radius);
        let axes = domain.axes();
        let (mut corner, mut extent) = (Vector3::zeros(), Vector3::repeat(contact));
        let (mut drift, mut growth) = (Vector3::zeros(), Vector3::zeros());
        for &axis in axes {
            if domain.periodic {
                (corner[axis], extent[axis]) = (domain.min[axis], domain.max[axis] - domain.min[axis]);
            } else if !sample.is_empty() {
                let mut places: Vec<f64> = sample.iter().map(|flight| flight.position_at(now)[axis]).collect();
                // A few grains that fly ahead do not count.
                let [low, high] = [quantile(&mut places, 0.05), quantile(&mut places, 0.95)];
                let flow = Flow::along(axis, sample, now);
                (drift[axis], growth[axis]) = (flow.velocity_at(low), flow.growth);
                corner[axis] = low - drift[axis] * now;
                extent[axis] = contact.max((high - low) / 0.9);
            }
        }
        let volume: f64 = axes.iter().map(|&axis| extent[axis]).product();
        let grains = if domain.periodic { stream.grains.max(everywhere) } else { stream.grains };
        let cells = if domain.periodic { cells_of_period(grains) } else { slots(grains) };
        let one_in_each_slot = (volume / cells as f64).powf(1.0 / axes.len() as f64);
        let reach = |place: Vector3<f64>| (place - corner - drift * now).amax();
        let farthest = if sample.is_empty() { 0.0 } else { stream.corners.map(reach).into_iter().fold(0.0, f64::max) };
        let width = contact.max(width.unwrap_or(one_in_each_slot)).max(farthest / FARTHEST_CELL);
        // In a period each cell has a slot of its own.
        let width = if domain.periodic { width.max(one_in_each_slot) } else { width };
        let (mut size, mut period) = (Vector3::repeat(width), Vector3::zeros());
        if domain.periodic {
            let along = |axis: usize, width: f64| ((extent[axis] / width).floor() as i32).max(FEWEST_PERIODIC_CELLS);
            let mut width = width;
            // Where an axis has the fewest the others may have too many.
            while axes.iter().map(|&axis| f64::from(along(axis, width))).product::<f64>() > cells as f64 {
                width *= 1.1;
            }
            for &axis in axes {
                period[axis] = along(axis, width);
                size[axis] = extent[axis] / f64::from(period[axis]);
            }
        }
        let extent = if domain.periodic {
            period.zip_map(&domain.extent(), |n, length| if n > 0 { length } else { 0.0 })
        } else {
            Vector3::zeros()
        };
        let strides = if domain.periodic {
            let [x, y] = [period.x as u32, period.y as u32];
            // In a planar scene there is nothing along y, and what is never looked at is in range nevertheless.
            [1, if y > 0 { x } else { 0 }, x * y.max(1)]
        } else {
            strides_of_hash(domain.planar, hashed_slots(grains))
        };
        Self {
            size,
            period,
            extent,
            strides,
            first_number: u32::from(domain.periodic),
            corner,
            drift,
            growth,
            rise: size.component_mul(&growth),
            born: now,
        }
    }

    /// How many cells are in a period, if there is one.
    pub(super) fn cells(&self) -> Option<usize> {
        let along = |axis: usize| self.period[axis].max(1) as usize;
        (self.period != Vector3::zeros()).then(|| along(0) * along(1) * along(2))
    }

    /// What `cells` along `axis` add to the number of a cell.
    #[inline]
    pub(super) fn along(&self, axis: usize, cells: i32) -> u32 {
        (cells as u32).wrapping_mul(self.strides[axis])
    }

    /// How large cells are at `time` (s, epoch time), in units of their size.
    #[inline]
    pub(super) fn scale(&self, time: f64) -> Vector3<f64> {
        (self.growth * (time - self.born)).add_scalar(1.0)
    }

    /// Extent of a cell along `axes` at `time` (s, epoch time): m³, or m² in a planar scene.
    pub(super) fn volume(&self, axes: &[usize], time: f64) -> f64 {
        let size = self.size.component_mul(&self.scale(time));
        axes.iter().map(|&axis| size[axis]).product()
    }

    /// How many cells the sample of a stream crosses in a second.
    pub(super) fn crossing_rate(&self, stream: &Stream) -> f64 {
        let now = stream.now;
        let scale = self.scale(now);
        let rate = |flight: &Flight| {
            let place = flight.position_at(now) - (self.corner + self.drift * now);
            let flow = self.drift + place.component_div(&scale).component_mul(&self.growth);
            (flight.velocity - flow).component_div(&self.size).component_div(&scale).lp_norm(1)
        };
        stream.sample.iter().map(rate).sum()
    }
}

/// How a stream moves along one axis: its velocity rises with the place, as that of a spray that flies apart does.
struct Flow {
    /// Velocity at the origin, m/s.
    velocity: f64,
    /// Rise of the velocity, 1/s; never negative.
    growth: f64,
}

impl Flow {
    /// The flow along `axis` that `flights` follow as they are at `now` (s, epoch time).
    ///
    /// The rise is that of the line of least squares if that leaves less to be crossed than none; the velocity is the median of what is
    /// left, which makes the fewest crossings.
    fn along(axis: usize, flights: &[Flight], now: f64) -> Self {
        let count = flights.len() as f64;
        let state = |flight: &Flight| (flight.position_at(now)[axis], flight.velocity[axis]);
        let sums = flights.iter().map(state).fold((0.0, 0.0), |(x, v), state| (x + state.0, v + state.1));
        let (mean_x, mean_v) = (sums.0 / count, sums.1 / count);
        let (mut spread, mut rise) = (0.0, 0.0);
        for (x, v) in flights.iter().map(state) {
            spread += (x - mean_x) * (x - mean_x);
            rise += (x - mean_x) * (v - mean_v);
        }
        let with = |growth: f64| {
            let mut rests: Vec<f64> = flights.iter().map(state).map(|(x, v)| v - growth * x).collect();
            let velocity = quantile(&mut rests, 0.5);
            (Self { velocity, growth }, rests.iter().map(|rest| (rest - velocity).abs()).sum::<f64>())
        };
        let (still, to_cross) = with(0.0);
        if rise.is_nan() || rise <= 0.0 {
            return still;
        }
        let (flow, less) = with(rise / spread);
        if less < to_cross { flow } else { still }
    }

    fn velocity_at(&self, place: f64) -> f64 {
        self.velocity + self.growth * place
    }
}

/// The value below which a fraction `part` of `values` lies.
fn quantile(values: &mut [f64], part: f64) -> f64 {
    let rank = ((values.len() - 1) as f64 * part) as usize;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A period much longer than wide had as many cells along it as a cube, times the fewest across: gigabytes for a thousand grains.
    #[test]
    fn a_long_thin_period_has_no_more_cells_than_another() {
        let max = Vector3::new(1.0, 1.0, 1e9);
        let domain = Domain { min: Vector3::zeros(), max, periodic: true, planar: false };
        let flight = |number: i32| Flight {
            position: Vector3::new(0.5, 0.5, 1e6 * f64::from(number)),
            time: 0.0,
            velocity: Vector3::zeros(),
            radius: 0.01,
        };
        let flights: Vec<Flight> = (0..1000).map(flight).collect();
        let layout = Layout::new(&domain, 0.01, None, 0, &Stream::new(flights.iter(), 0.0));
        assert_eq!(layout.period.xy().as_slice(), [FEWEST_PERIODIC_CELLS; 2]);
        let cells = layout.cells().expect("a period");
        assert!((1000..=cells_of_period(1000)).contains(&cells), "{cells}");
    }

    /// A hash that scattered the cells let grains share slots with those of any other cell: a fifth of all that a jet looked at were such strangers. Now none of them is
    /// near, whatever the size of the table.
    #[test]
    fn cells_that_share_a_slot_are_far_apart() {
        for (planar, bits) in (8..22).map(|bits| (false, bits)).chain((8..22).map(|bits| (true, bits))) {
            let slots = 1i64 << bits;
            let [_, row, layer] = strides_of_hash(planar, slots as usize).map(i64::from);
            let spacing = if planar { (slots as f64).sqrt() } else { (slots as f64).cbrt() };
            let near = spacing as i64;
            for y in if planar { 0..=0 } else { -near..=near } {
                for z in -near..=near {
                    // The nearest cells along x with the slot of cell (0, 0, 0).
                    let beside = (row * y + layer * z + slots / 2).rem_euclid(slots) - slots / 2;
                    let apart = Vector3::new(beside, y, z).map(|cells| cells as f64).norm();
                    assert!(apart == 0.0 || apart > 0.6 * spacing, "2^{bits} slots: ({beside}, {y}, {z})");
                }
            }
        }
    }
}
