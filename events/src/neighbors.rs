//! Who can meet whom before when: cells that drift with the stream.
//!
//! A grain can only touch grains in its own cell and the cells around it until it leaves its cell. The grid of cells moves at
//! a constant velocity, so grains that fly side by side at that velocity never cross a cell. The grid has no bounds: cells
//! are hashed into slots, so memory follows the grains and not the domain; grains of another cell that share a slot are
//! passed over. In a periodic domain a whole number of cells tiles the period.
//!
//! Cells are bookkeeping: neither their size nor their drift can change a bit of a prediction.

use nalgebra::Vector3;

use crate::{Domain, Flight};

/// A cell is wider than the largest contact distance by this fraction, so that a crossing that is late by rounding cannot
/// hide a contact; the position of a grain is known to about 1e-16 of its distance from the origin.
const CELL_MARGIN: f64 = 1e-6;
/// Fewest cells along an axis of a periodic domain. With four, two grains in adjacent cells have one nearest image.
const FEWEST_PERIODIC_CELLS: i32 = 4;
/// Slots for each grain, at least: more cost memory, fewer are shared by cells.
const SLOTS_PER_GRAIN: usize = 4;
/// Steps between the slots of cells that are adjacent along x, y and z, modulo the number of slots (a power of two). Odd
/// fractions of 2^32 without a pattern (2^32 over the golden ratio, and over its square root) scatter the rows; along x cells
/// stay side by side in memory.
const STRIDES: Vector3<u32> = Vector3::new(1, 0x9E37_79B1, 0xC949_57E9);
/// A crossing costs about as much as so many looks at a neighbour (instruction counts of the jet of 8000 grains).
const LOOKS_PER_CROSSING: f64 = 10.0;
/// A new layout costs a look around for every grain: it is taken when it cuts the cost to this fraction.
const WORTH_A_NEW_LAYOUT: f64 = 0.9;
const NOBODY: u32 = u32::MAX;

/// Smallest side (m) that a periodic domain may have for grains of this radius (m): eight radii and a little, or the image that a
/// grain meets would not be clear.
#[must_use]
pub fn least_period(radius: f64) -> f64 {
    f64::from(FEWEST_PERIODIC_CELLS) * contact_width(radius)
}

fn contact_width(largest_radius: f64) -> f64 {
    2.0 * largest_radius * (1.0 + CELL_MARGIN)
}

/// Where a grain stands in the grid.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Cell along each axis; counts on beyond the period.
    cell: Vector3<i32>,
    slot: u32,
    next: u32,
    previous: u32,
}

const NOWHERE: Place = Place { cell: Vector3::new(0, 0, 0), slot: 0, next: NOBODY, previous: NOBODY };

/// A crossing: when, and into which cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) time: f64,
    /// 0, 1 or 2.
    pub(crate) axis: u8,
}

/// Size and motion of the grid.
#[derive(Clone, Debug)]
struct Layout {
    /// Size of a cell, m.
    size: Vector3<f64>,
    /// Cells in a period along each axis; 0 where there is none.
    period: Vector3<i32>,
    /// Corner of cell (0, 0, 0) at epoch time 0, m.
    corner: Vector3<f64>,
    /// Velocity, m/s.
    drift: Vector3<f64>,
}

/// The grid.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    layout: Layout,
    domain: Domain,
    heads: Vec<u32>,
    places: Vec<Place>,
}

impl Layout {
    /// Cells of about `width` (m), and at least of the size of a contact, for `flights` as they are at `now` (s, epoch time).
    ///
    /// The grid drifts with the median velocity: that makes the fewest crossings.
    fn new(domain: &Domain, largest_radius: f64, width: Option<f64>, flights: &[Flight], now: f64) -> Self {
        let contact = contact_width(largest_radius);
        let axes = domain.axes();
        let (mut corner, mut extent, mut drift) = (Vector3::zeros(), Vector3::repeat(contact), Vector3::zeros());
        for &axis in axes {
            if domain.periodic {
                (corner[axis], extent[axis]) = (domain.min[axis], domain.max[axis] - domain.min[axis]);
            } else if !flights.is_empty() {
                let mut places: Vec<f64> = flights.iter().map(|flight| flight.position_at(now)[axis]).collect();
                // A few grains that fly ahead do not count.
                let [low, high] = [quantile(&mut places, 0.05), quantile(&mut places, 0.95)];
                let mut velocities: Vec<f64> = flights.iter().map(|flight| flight.velocity[axis]).collect();
                drift[axis] = quantile(&mut velocities, 0.5);
                corner[axis] = low - drift[axis] * now;
                extent[axis] = contact.max((high - low) / 0.9);
            }
        }
        let volume: f64 = axes.iter().map(|&axis| extent[axis]).product();
        let one_in_each_slot = (volume / slots(flights.len()) as f64).powf(1.0 / axes.len() as f64);
        let width = contact.max(width.unwrap_or(one_in_each_slot));
        let (mut size, mut period) = (Vector3::repeat(width), Vector3::zeros());
        if domain.periodic {
            for &axis in axes {
                period[axis] = ((extent[axis] / width).floor() as i32).max(FEWEST_PERIODIC_CELLS);
                size[axis] = extent[axis] / f64::from(period[axis]);
            }
        }
        Self { size, period, corner, drift }
    }

    /// How many cells `flights` cross in a second.
    fn crossing_rate(&self, flights: &[Flight]) -> f64 {
        flights.iter().map(|flight| (flight.velocity - self.drift).component_div(&self.size).lp_norm(1)).sum()
    }
}

/// The value below which a fraction `part` of `values` lies.
fn quantile(values: &mut [f64], part: f64) -> f64 {
    let rank = ((values.len() - 1) as f64 * part) as usize;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// How many slots so many grains get.
fn slots(grains: usize) -> usize {
    (SLOTS_PER_GRAIN * grains).max(64).next_power_of_two()
}

impl Cells {
    /// An empty grid for grains of radius `largest_radius` at most, laid out for `flights` as they are at `now` (s, epoch time).
    pub(crate) fn new(domain: Domain, largest_radius: f64, flights: &[Flight], now: f64) -> Self {
        let layout = Layout::new(&domain, largest_radius, None, flights, now);
        Self::empty(domain, layout, flights.len())
    }

    fn empty(domain: Domain, layout: Layout, grains: usize) -> Self {
        Self { layout, domain, heads: vec![NOBODY; slots(grains)], places: Vec::new() }
    }

    /// An empty grid that suits `flights` better, if it is worth its cost; `crossings` and `looks` are what this one took lately.
    ///
    /// Cells x times as wide are crossed 1/x times as often and hold x³ times as many grains to look at. The sum of both costs is
    /// least where x⁴ = cost of the crossings / (3 cost of the looks); in a planar scene x³ with 2.
    pub(crate) fn better(
        &self,
        largest_radius: f64,
        flights: &[Flight],
        now: f64,
        crossings: usize,
        looks: usize,
    ) -> Option<Self> {
        let dimensions = self.domain.axes().len() as f64;
        let (crossing, looking) = (LOOKS_PER_CROSSING * crossings as f64, looks.max(1) as f64);
        let wider = (crossing / (dimensions * looking)).powf(1.0 / (dimensions + 1.0)).clamp(0.5, 2.0);
        let width = self.layout.size.x * wider;
        let layout = Layout::new(&self.domain, largest_radius, Some(width), flights, now);
        let fewer = layout.crossing_rate(flights) / self.layout.crossing_rate(flights);
        let more = (layout.size.x / self.layout.size.x).powf(dimensions);
        let worth_it = fewer * crossing + more * looking < WORTH_A_NEW_LAYOUT * (crossing + looking);
        worth_it.then(|| Self::empty(self.domain, layout, flights.len()))
    }

    /// Whether grains of this radius fit the cells.
    pub(crate) fn fits(&self, radius: f64) -> bool {
        self.domain.axes().iter().all(|&axis| contact_width(radius) <= self.layout.size[axis])
    }

    /// Whether so many grains would crowd the slots.
    pub(crate) fn crowded(&self, grains: usize) -> bool {
        grains > self.heads.len()
    }

    /// Position relative to the corner of the grid, in the frame that drifts with it.
    fn relative(&self, position: Vector3<f64>, time: f64) -> Vector3<f64> {
        position - (self.layout.corner + self.layout.drift * time)
    }

    fn cell_of(&self, position: Vector3<f64>, time: f64) -> Vector3<i32> {
        let mut cell = self.relative(position, time).component_div(&self.layout.size).map(|x| x.floor() as i32);
        if self.domain.planar {
            cell.y = 0;
        }
        cell
    }

    /// Coordinate along `axis` of the cell in the period that stands for `cell`.
    #[inline]
    fn home(&self, cell: Vector3<i32>, axis: usize) -> i32 {
        if self.layout.period[axis] == 0 { cell[axis] } else { cell[axis].rem_euclid(self.layout.period[axis]) }
    }

    /// The slot of a cell in the period.
    #[inline]
    fn slot(&self, home: Vector3<i32>) -> usize {
        let sum = home.zip_map(&STRIDES, |k, stride| (k as u32).wrapping_mul(stride));
        (sum.x.wrapping_add(sum.y).wrapping_add(sum.z)) as usize & (self.heads.len() - 1)
    }

    fn slot_of(&self, cell: Vector3<i32>) -> usize {
        self.slot(Vector3::from_fn(|axis, _| self.home(cell, axis)))
    }

    /// Puts grain `id` into the cell where it is at `now` (s, epoch time).
    pub(crate) fn insert(&mut self, id: u32, flight: &Flight, now: f64) {
        if self.places.len() <= id as usize {
            self.places.resize(id as usize + 1, NOWHERE);
        }
        self.places[id as usize].cell = self.cell_of(flight.position_at(now), now);
        self.link(id);
    }

    fn link(&mut self, id: u32) {
        let slot = self.slot_of(self.places[id as usize].cell);
        let first = std::mem::replace(&mut self.heads[slot], id);
        let place = &mut self.places[id as usize];
        (place.slot, place.next, place.previous) = (slot as u32, first, NOBODY);
        if first != NOBODY {
            self.places[first as usize].previous = id;
        }
    }

    /// Takes grain `id` out.
    pub(crate) fn remove(&mut self, id: u32) {
        let Place { slot, next, previous, .. } = self.places[id as usize];
        if previous == NOBODY {
            self.heads[slot as usize] = next;
        } else {
            self.places[previous as usize].next = next;
        }
        if next != NOBODY {
            self.places[next as usize].previous = previous;
        }
    }

    /// Tells the grid that a periodic wrap has moved the stored position of `id` by `shift`.
    pub(crate) fn wrapped(&mut self, id: u32, shift: Vector3<f64>) {
        let periods = shift.component_div(&self.domain.extent()).map(|x| x.round() as i32);
        self.places[id as usize].cell += periods.component_mul(&self.layout.period);
    }

    /// When and through which side `flight` leaves its cell.
    pub(crate) fn crossing(&self, id: u32, flight: &Flight) -> Crossing {
        let cell = self.places[id as usize].cell;
        let y = self.relative(flight.position, flight.time);
        let v = flight.velocity - self.layout.drift;
        let mut first = Crossing { time: f64::INFINITY, axis: 0 };
        for &axis in self.domain.axes() {
            if v[axis] != 0.0 {
                let side = f64::from(cell[axis] + i32::from(v[axis] > 0.0)) * self.layout.size[axis];
                let time = flight.time + (side - y[axis]) / v[axis];
                if time < first.time {
                    first = Crossing { time, axis: axis as u8 };
                }
            }
        }
        first
    }

    /// Moves grain `id` into the next cell along `axis` and tells which way it went.
    pub(crate) fn cross(&mut self, id: u32, flight: &Flight, axis: u8) -> i32 {
        let axis = usize::from(axis);
        let step = if flight.velocity[axis] > self.layout.drift[axis] { 1 } else { -1 };
        self.remove(id);
        self.places[id as usize].cell[axis] += step;
        self.link(id);
        step
    }

    /// Calls `visit` with every grain in the cells that have become adjacent to grain `id` by its last `step` along `axis`.
    #[inline]
    pub(crate) fn visit_ahead(&self, id: u32, axis: u8, step: i32, visit: impl FnMut(u32, Vector3<f64>)) {
        let axis = usize::from(axis);
        let (mut from, mut to) = self.all_around();
        (from[axis], to[axis]) = (step, step);
        self.visit_others(id, from, to, visit);
    }

    /// Calls `visit` with every grain in the cells around grain `id`, itself left out, and with the shift (m) of the periodic
    /// image that is near.
    #[inline]
    pub(crate) fn visit_around(&self, id: u32, visit: impl FnMut(u32, Vector3<f64>)) {
        let (from, to) = self.all_around();
        self.visit_others(id, from, to, visit);
    }

    fn all_around(&self) -> (Vector3<i32>, Vector3<i32>) {
        let deep = i32::from(!self.domain.planar);
        (Vector3::new(-1, -deep, -1), Vector3::new(1, deep, 1))
    }

    #[inline]
    fn visit_others(&self, id: u32, from: Vector3<i32>, to: Vector3<i32>, mut visit: impl FnMut(u32, Vector3<f64>)) {
        self.visit_cells(self.places[id as usize].cell, from, to, |other, shift| {
            if other != id {
                visit(other, shift);
            }
        });
    }

    /// Calls `visit` with every grain in the cells whose steps from `centre` lie between `from` and `to` on each axis.
    #[inline]
    fn visit_cells(
        &self,
        centre: Vector3<i32>,
        from: Vector3<i32>,
        to: Vector3<i32>,
        mut visit: impl FnMut(u32, Vector3<f64>),
    ) {
        let mask = self.heads.len() - 1;
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                let row = centre + Vector3::new(0, y, z);
                let start = self.slot(Vector3::new(0, self.home(row, 1), self.home(row, 2)));
                for x in from.x..=to.x {
                    let cell = row + Vector3::new(x, 0, 0);
                    let mut other = self.heads[(start + self.home(cell, 0) as usize) & mask];
                    while other != NOBODY {
                        let place = &self.places[other as usize];
                        if let Some(shift) = self.image(cell, place.cell) {
                            visit(other, shift);
                        }
                        other = place.next;
                    }
                }
            }
        }
    }

    /// The shift (m) that brings what is stored as being in `stored` to `cell`; `None` if the two are different cells.
    #[inline]
    fn image(&self, cell: Vector3<i32>, stored: Vector3<i32>) -> Option<Vector3<f64>> {
        if cell == stored {
            return Some(Vector3::zeros());
        }
        if !self.domain.periodic {
            return None;
        }
        let mut shift = Vector3::zeros();
        for &axis in self.domain.axes() {
            let (steps, period) = (cell[axis] - stored[axis], self.layout.period[axis]);
            if steps % period != 0 {
                return None;
            }
            shift[axis] = f64::from(steps / period) * (self.domain.max[axis] - self.domain.min[axis]);
        }
        Some(shift)
    }

    /// Calls `visit` with every grain in the cells around `position`, where there need not be a grain.
    pub(crate) fn visit_near(&self, position: Vector3<f64>, time: f64, visit: impl FnMut(u32, Vector3<f64>)) {
        let (from, to) = self.all_around();
        self.visit_cells(self.cell_of(position, time), from, to, visit);
    }
}
