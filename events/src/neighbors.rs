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
/// No grain stands so many cells from the corner when the grid is laid out: the numbers of cells (below 2^31) then last for an epoch.
const FARTHEST_CELL: f64 = (1u32 << 29) as f64;
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
    /// Cell along each axis; in a periodic domain, the one in the period.
    cell: Vector3<i32>,
    /// The next grain that shares the slot.
    next: u32,
}

const NOWHERE: Place = Place { cell: Vector3::new(0, 0, 0), next: NOBODY };

/// Adjacent cells along one axis, at most three.
struct Adjacent {
    cells: [Side; 3],
    count: usize,
}

/// One of them.
#[derive(Clone, Copy, Default)]
struct Side {
    /// Its number in the period.
    cell: i32,
    /// What it adds to the number of a slot.
    slot: u32,
    /// How many periods on it lies.
    turn: i32,
}

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
    /// Length of the period along each axis, m; 0 where there is none.
    extent: Vector3<f64>,
    /// Corner of cell (0, 0, 0) at epoch time 0, m.
    corner: Vector3<f64>,
    /// Velocity of that corner, m/s.
    drift: Vector3<f64>,
    /// By which part of its size at `born` a cell grows in a second, 1/s; never negative.
    growth: Vector3<f64>,
    /// When the cells were laid out, s (epoch time).
    born: f64,
}

/// The grid.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    layout: Layout,
    domain: Domain,
    /// The first grain in each slot.
    heads: Vec<u32>,
    places: Vec<Place>,
    /// In a periodic domain, how many periods the cell of a grain lies beyond its place in the period, seen from its stored position.
    turns: Vec<Vector3<i32>>,
}

impl Layout {
    /// Cells of about `width` (m), and at least of the size of a contact, for `flights` as they are at `now` (s, epoch time).
    ///
    /// The grid drifts with the median velocity: that makes the fewest crossings.
    fn new(domain: &Domain, largest_radius: f64, width: Option<f64>, flights: &[Flight], now: f64) -> Self {
        let contact = contact_width(largest_radius);
        let axes = domain.axes();
        let (mut corner, mut extent) = (Vector3::zeros(), Vector3::repeat(contact));
        let (mut drift, mut growth) = (Vector3::zeros(), Vector3::zeros());
        for &axis in axes {
            if domain.periodic {
                (corner[axis], extent[axis]) = (domain.min[axis], domain.max[axis] - domain.min[axis]);
            } else if !flights.is_empty() {
                let mut places: Vec<f64> = flights.iter().map(|flight| flight.position_at(now)[axis]).collect();
                // A few grains that fly ahead do not count.
                let [low, high] = [quantile(&mut places, 0.05), quantile(&mut places, 0.95)];
                let flow = Flow::along(axis, flights, now);
                (drift[axis], growth[axis]) = (flow.velocity_at(low), flow.growth);
                corner[axis] = low - drift[axis] * now;
                extent[axis] = contact.max((high - low) / 0.9);
            }
        }
        let volume: f64 = axes.iter().map(|&axis| extent[axis]).product();
        let one_in_each_slot = (volume / slots(flights.len()) as f64).powf(1.0 / axes.len() as f64);
        let reach = |flight: &Flight| (flight.position_at(now) - corner - drift * now).amax();
        let farthest = flights.iter().map(reach).fold(0.0, f64::max);
        let width = contact.max(width.unwrap_or(one_in_each_slot)).max(farthest / FARTHEST_CELL);
        let (mut size, mut period) = (Vector3::repeat(width), Vector3::zeros());
        if domain.periodic {
            for &axis in axes {
                period[axis] = ((extent[axis] / width).floor() as i32).max(FEWEST_PERIODIC_CELLS);
                size[axis] = extent[axis] / f64::from(period[axis]);
            }
        }
        let extent = if domain.periodic {
            period.zip_map(&domain.extent(), |n, length| if n > 0 { length } else { 0.0 })
        } else {
            Vector3::zeros()
        };
        Self { size, period, extent, corner, drift, growth, born: now }
    }

    /// How large cells are at `time` (s, epoch time), in units of their size.
    #[inline]
    fn scale(&self, time: f64) -> Vector3<f64> {
        (self.growth * (time - self.born)).add_scalar(1.0)
    }

    /// Velocity of side `number` of the cells along `axis`, m/s.
    #[inline]
    fn side_velocity(&self, axis: usize, number: i32) -> f64 {
        self.drift[axis] + f64::from(number) * self.size[axis] * self.growth[axis]
    }

    /// How many cells `flights` cross in a second, as they are at `now` (s, epoch time).
    fn crossing_rate(&self, flights: &[Flight], now: f64) -> f64 {
        let scale = self.scale(now);
        let rate = |flight: &Flight| {
            let place = flight.position_at(now) - (self.corner + self.drift * now);
            let flow = self.drift + place.component_div(&scale).component_mul(&self.growth);
            (flight.velocity - flow).component_div(&self.size).component_div(&scale).lp_norm(1)
        };
        flights.iter().map(rate).sum()
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

    /// The same with cells that are wider than a contact by `skin` (m).
    pub(crate) fn with_skin(
        domain: Domain,
        largest_radius: f64,
        skin: f64,
        flights: &[Flight],
        now: f64,
    ) -> Option<Self> {
        let radius = largest_radius + 0.5 * skin;
        domain.holds(radius).then(|| Self::new(domain, radius, flights, now))
    }

    fn empty(domain: Domain, layout: Layout, grains: usize) -> Self {
        Self { layout, domain, heads: vec![NOBODY; slots(grains)], places: Vec::new(), turns: Vec::new() }
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
        let fewer = layout.crossing_rate(flights, now) / self.layout.crossing_rate(flights, now);
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
        let size = self.layout.size.component_mul(&self.layout.scale(time));
        let mut cell = self.relative(position, time).component_div(&size).map(|x| x.floor() as i32);
        if self.domain.planar {
            cell.y = 0;
        }
        cell
    }

    /// The cell in the period that stands for `cell`, and how many periods apart they are.
    fn home(&self, mut cell: Vector3<i32>) -> (Vector3<i32>, Vector3<i32>) {
        let mut turns = Vector3::zeros();
        if self.domain.periodic {
            for &axis in self.domain.axes() {
                turns[axis] = cell[axis].div_euclid(self.layout.period[axis]);
                cell[axis] -= turns[axis] * self.layout.period[axis];
            }
        }
        (cell, turns)
    }

    /// The slot of a cell in the period.
    #[inline]
    fn slot(&self, cell: Vector3<i32>) -> usize {
        let sum = cell.zip_map(&STRIDES, |k, stride| (k as u32).wrapping_mul(stride));
        (sum.x.wrapping_add(sum.y).wrapping_add(sum.z)) as usize & (self.heads.len() - 1)
    }

    /// Puts grain `id` into the cell where it is at `now` (s, epoch time).
    pub(crate) fn insert(&mut self, id: u32, flight: &Flight, now: f64) {
        if self.places.len() <= id as usize {
            self.places.resize(id as usize + 1, NOWHERE);
            if self.domain.periodic {
                self.turns.resize(id as usize + 1, Vector3::zeros());
            }
        }
        let (cell, turns) = self.home(self.cell_of(flight.position_at(now), now));
        self.places[id as usize].cell = cell;
        if self.domain.periodic {
            self.turns[id as usize] = turns;
        }
        self.link(id);
    }

    #[inline]
    fn link(&mut self, id: u32) {
        let slot = self.slot(self.places[id as usize].cell);
        self.places[id as usize].next = std::mem::replace(&mut self.heads[slot], id);
    }

    /// Takes grain `id` out.
    #[inline]
    pub(crate) fn remove(&mut self, id: u32) {
        let Place { cell, next } = self.places[id as usize];
        let slot = self.slot(cell);
        // Few grains share a slot.
        let mut other = self.heads[slot];
        if other == id {
            self.heads[slot] = next;
            return;
        }
        while self.places[other as usize].next != id {
            other = self.places[other as usize].next;
        }
        self.places[other as usize].next = next;
    }

    /// Tells the grid that a periodic wrap has moved the stored position of `id` by `shift`.
    pub(crate) fn wrapped(&mut self, id: u32, shift: Vector3<f64>) {
        self.turns[id as usize] += shift.component_div(&self.domain.extent()).map(|x| x.round() as i32);
    }

    /// The cell of grain `id` as its stored position sees it, beyond the period if need be.
    #[inline]
    fn seen(&self, id: u32) -> Vector3<i32> {
        let cell = self.places[id as usize].cell;
        if self.domain.periodic { cell + self.turns[id as usize].component_mul(&self.layout.period) } else { cell }
    }

    /// When and through which side `flight` leaves its cell.
    pub(crate) fn crossing(&self, id: u32, flight: &Flight) -> Crossing {
        let cell = self.seen(id);
        let y = self.relative(flight.position, flight.time);
        let size = self.layout.size.component_mul(&self.layout.scale(flight.time));
        let mut first = Crossing { time: f64::INFINITY, axis: 0 };
        for &axis in self.domain.axes() {
            let Some((step, speed)) = self.way_out(cell, flight, axis) else { continue };
            let side = f64::from(cell[axis] + i32::from(step > 0)) * size[axis];
            let time = flight.time + (side - y[axis]) / speed;
            if time < first.time {
                first = Crossing { time, axis: axis as u8 };
            }
        }
        first
    }

    /// Through which side along `axis` (1 or -1) a flight leaves its cell, and how fast (m/s) it approaches that side; `None` where it never
    /// does.
    #[inline]
    fn way_out(&self, cell: Vector3<i32>, flight: &Flight, axis: usize) -> Option<(i32, f64)> {
        let v = flight.velocity[axis];
        let to_upper = v - self.layout.side_velocity(axis, cell[axis] + 1);
        if to_upper > 0.0 {
            return Some((1, to_upper));
        }
        let to_lower = v - self.layout.side_velocity(axis, cell[axis]);
        (to_lower < 0.0).then_some((-1, to_lower))
    }

    /// Moves grain `id` into the next cell along `axis` and tells which way it went.
    pub(crate) fn cross(&mut self, id: u32, flight: &Flight, axis: u8) -> i32 {
        let axis = usize::from(axis);
        let step = self.way_out(self.seen(id), flight, axis).map_or(1, |(step, _)| step);
        self.remove(id);
        let Side { cell, turn, .. } = self.side(axis, self.places[id as usize].cell[axis] + step);
        self.places[id as usize].cell[axis] = cell;
        if self.domain.periodic {
            self.turns[id as usize][axis] += turn;
        }
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
        let turns = if self.domain.periodic { self.turns[id as usize] } else { Vector3::zeros() };
        self.visit_cells(self.places[id as usize].cell, turns, from, to, |other, shift| {
            if other != id {
                visit(other, shift);
            }
        });
    }

    /// Calls `visit` with every grain in the cells whose steps from `centre`, a cell in the period, lie between `from` and `to` on each axis,
    /// and with the shift (m) that brings it beside a grain in `centre` that lies `turns` periods on.
    #[inline]
    fn visit_cells(
        &self,
        centre: Vector3<i32>,
        turns: Vector3<i32>,
        from: Vector3<i32>,
        to: Vector3<i32>,
        mut visit: impl FnMut(u32, Vector3<f64>),
    ) {
        let mask = self.heads.len() - 1;
        let adjacent = |axis: usize| self.adjacent(axis, centre[axis], from[axis], to[axis]);
        let [along_x, along_y, along_z] = [adjacent(0), adjacent(1), adjacent(2)];
        for z in &along_z.cells[..along_z.count] {
            for y in &along_y.cells[..along_y.count] {
                for x in &along_x.cells[..along_x.count] {
                    let slot = x.slot.wrapping_add(y.slot).wrapping_add(z.slot) as usize & mask;
                    let cell = Vector3::new(x.cell, y.cell, z.cell);
                    let mut other = self.heads[slot];
                    while other != NOBODY {
                        let place = &self.places[other as usize];
                        if place.cell == cell {
                            visit(other, self.shift(other, turns + Vector3::new(x.turn, y.turn, z.turn)));
                        }
                        other = place.next;
                    }
                }
            }
        }
    }

    /// The cells from `centre + from` to `centre + to` along `axis`, at most three.
    #[inline]
    fn adjacent(&self, axis: usize, centre: i32, from: i32, to: i32) -> Adjacent {
        let mut cells = [Side::default(); 3];
        let mut count = 0;
        for (side, step) in cells.iter_mut().zip(from..=to) {
            *side = self.side(axis, centre.wrapping_add(step));
            count += 1;
        }
        Adjacent { cells, count }
    }

    /// The cell in the period that stands for `cell`, which is at most one step outside of it.
    #[inline]
    fn side(&self, axis: usize, cell: i32) -> Side {
        let period = self.layout.period[axis];
        let turn = if period == 0 { 0 } else { i32::from(cell >= period) - i32::from(cell < 0) };
        let cell = cell - turn * period;
        Side { cell, slot: (cell as u32).wrapping_mul(STRIDES[axis]), turn }
    }

    /// The shift (m) that brings grain `other` to where its cell is, `turns` periods on.
    #[inline]
    fn shift(&self, other: u32, turns: Vector3<i32>) -> Vector3<f64> {
        if !self.domain.periodic {
            return Vector3::zeros();
        }
        (turns - self.turns[other as usize]).map(f64::from).component_mul(&self.layout.extent)
    }

    /// Calls `visit` with every grain in the cells around `position`, where there need not be a grain.
    pub(crate) fn visit_near(&self, position: Vector3<f64>, time: f64, visit: impl FnMut(u32, Vector3<f64>)) {
        let (from, to) = self.all_around();
        let (cell, turns) = self.home(self.cell_of(position, time));
        self.visit_cells(cell, turns, from, to, visit);
    }
}
