//! Who can meet whom before when: cells that drift with the stream.
//!
//! A grain can only touch grains in its own cell and the cells around it until it leaves its cell. The grid of cells moves at
//! a constant velocity, so grains that fly side by side at that velocity never cross a cell. The grid has no bounds: cells
//! are numbered row by row and share slots far apart, so memory follows the grains and not the domain; grains of another cell that share a slot are
//! looked at in vain. In a periodic domain a whole number of cells tiles the period, and each has a slot of its own.
//!
//! Cells are bookkeeping: neither their size nor their drift can change a bit of a prediction.

mod layout;
mod slots;
mod stream;

use nalgebra::Vector3;
use wide::{f64x4, u32x4};

use self::layout::{FEWEST_PERIODIC_CELLS, Layout, contact_width};
use self::slots::{MOST_SLOTS, Slots, TURNED};
pub(crate) use self::stream::Stream;
use crate::blocks::Block;
use crate::prefetch::prefetch;
use crate::table::{Table, make_room, table};
use crate::{Domain, Flight};

/// A crossing costs about as much as so many looks at a neighbour. From 5 to 20 no jet and no gas becomes slower by more than 3 %.
const LOOKS_PER_CROSSING: f64 = 14.0;
/// The grid is laid out anew when there are so many times as many grains as it was made for, or as the fewest that are worth it.
const CROWD: usize = 4;
const FEWEST_GRAINS: usize = 16;
/// A new layout costs a look around for every grain: it is taken when it cuts the cost to this fraction.
const WORTH_A_NEW_LAYOUT: f64 = 0.9;
/// No grain. One bit is left beside the number of a grain, for [`TURNED`].
const NOBODY: u32 = u32::MAX >> 1;

/// Smallest side (m) that a periodic domain may have for grains of this radius (m): eight radii and a little, or the image that a
/// grain meets would not be clear.
#[must_use]
pub fn least_period(radius: f64) -> f64 {
    f64::from(FEWEST_PERIODIC_CELLS) * contact_width(radius)
}

/// Grains that are near another one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Near {
    /// Those that are where their stored positions say are the first so many of `here`.
    count: usize,
    here: Vec<u32>,
    /// Others, and the shift (m) that brings their periodic images there.
    pub(crate) beyond: Vec<(u32, Vector3<f64>)>,
}

impl Near {
    pub(crate) fn clear(&mut self) {
        self.count = 0;
        self.beyond.clear();
    }

    pub(crate) fn len(&self) -> usize {
        self.count + self.beyond.len()
    }

    /// Those that are where their stored positions say, by fours, and how many they are: beside the last any grains stand, to make four.
    #[inline]
    pub(crate) fn here(&self) -> (&[[u32; 4]], usize) {
        (&self.here.as_chunks().0[..self.count.div_ceil(4)], self.count)
    }

    /// All of them, with their shifts.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, Vector3<f64>)> + '_ {
        let here = self.here[..self.count].iter().map(|&other| (other, Vector3::zeros()));
        here.chain(self.beyond.iter().copied())
    }

    /// Leaves each of them only once, and `id` not at all, in the order of their numbers.
    pub(crate) fn each_once(&mut self, id: u32) {
        let here = &mut self.here[..self.count];
        here.sort_unstable();
        let mut count = 0;
        for at in 0..here.len() {
            if here[at] != id && (count == 0 || here[count - 1] != here[at]) {
                here[count] = here[at];
                count += 1;
            }
        }
        self.count = count;
    }

    /// Says that there are so many. What stands beside the last are grains, if they are looked at with it.
    #[inline]
    fn end_with(&mut self, count: usize) {
        self.here[count..count + 3].fill(0);
        self.count = count;
    }

    /// Makes room for so many.
    #[inline]
    fn make_room(&mut self, grains: usize) {
        if self.here.len() < grains {
            self.here.resize(grains.next_power_of_two(), 0);
        }
    }
}

/// Where a grain stands in the grid, in a quarter of a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
struct Place {
    /// Cell along each axis, as the stored position of the grain sees it: in a periodic domain it may lie beyond the period.
    cell: Vector3<i32>,
    /// From bit 6 on the number of the cell, modulo [`MOST_SLOTS`]; below, whether it lies beyond the period and at which ends of it.
    packed: u32,
}

impl Place {
    const TURNED: u32 = 1 << 5;

    #[inline]
    fn new(cell: Vector3<i32>, number: u32, edges: u8, turned: bool) -> Self {
        let turned = if turned { Self::TURNED } else { 0 };
        Self { cell, packed: number << 6 | turned | u32::from(edges) }
    }

    /// Number of the cell, to be taken modulo the number of slots.
    #[inline]
    fn number(&self) -> u32 {
        self.packed >> 6
    }

    /// At which ends of the period it lies: as the number of that of the 27 cells around a cell to which one would step there.
    #[inline]
    fn edges(&self) -> u8 {
        (self.packed % Self::TURNED) as u8
    }

    /// Whether it lies beyond the period.
    #[inline]
    fn turned(&self) -> bool {
        self.packed & Self::TURNED != 0
    }
}

const _: () = assert!(size_of::<Place>() == 16 && (u32::MAX >> 6) as usize + 1 == MOST_SLOTS);

/// Some of the 27 cells around a cell and itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    /// Number of the cell in the middle.
    number: u32,
    /// At which ends of the period it lies.
    edges: u8,
    /// The bits of the cells.
    wanted: u32,
}

/// At no end of the period.
const INSIDE: u8 = 13;
/// What a step along each axis adds to the number of one of the 27 cells around a cell.
const THREE_TO: [u8; 3] = [1, 3, 9];
const NOWHERE: Place = Place { cell: Vector3::new(0, 0, 0), packed: INSIDE as u32 };
/// The bit of a cell itself among the 27 around it.
const OWN: u32 = 1 << INSIDE;

/// A crossing: when, and into which cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) time: f64,
    /// Through which side of the cell: twice the axis, and one more for the upper side.
    pub(crate) side: u8,
}

/// The axis to which a side is normal, and the step along it that leads through the side.
#[inline]
fn axis_and_step(side: u8) -> (usize, i32) {
    (usize::from(side / 2), 2 * i32::from(side % 2) - 1)
}

/// The bits of the nine cells that lie ahead of a step through each side of a cell.
const AHEAD: [u32; 6] = {
    let mut ahead = [0; 6];
    let mut number = 0;
    while number < 27 {
        let mut axis = 0;
        while axis < 3 {
            let step = steps(number)[axis];
            if step != 0 {
                ahead[2 * axis + (step > 0) as usize] |= 1 << number;
            }
            axis += 1;
        }
        number += 1;
    }
    ahead
};

/// The bits of those of the 27 cells around a cell that are beyond the period, for each kind of edge.
const BEYOND: [u32; 27] = {
    let mut beyond = [0; 27];
    let mut number = 0;
    while number < 27 {
        let mut axis = 0;
        while axis < 3 {
            let step = steps(number)[axis];
            if step != 0 {
                beyond[number] |= AHEAD[2 * axis + (step > 0) as usize];
            }
            axis += 1;
        }
        number += 1;
    }
    beyond
};

/// For each kind of edge and each of the 27 cells around a cell: at which ends of the period one leaves it on the way there, as the number of that of these
/// cells to which one would step there.
const LEAVES: [[u8; 27]; 27] = {
    let mut leaves = [[INSIDE; 27]; 27];
    let mut edges = 0;
    while edges < 27 {
        let mut number = 0;
        while number < 27 {
            let mut axis = 0;
            while axis < 3 {
                let step = steps(number)[axis];
                if step == steps(edges)[axis] {
                    leaves[edges][number] = (leaves[edges][number] as i32 + step * THREE_TO[axis] as i32) as u8;
                }
                axis += 1;
            }
            number += 1;
        }
        edges += 1;
    }
    leaves
};

/// The steps along each axis that lead to one of the 27 cells around a cell and itself.
const fn steps(number: usize) -> [i32; 3] {
    let number = number as i32;
    [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1]
}

/// The grid.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    layout: Layout,
    domain: Domain,
    /// For so many grains.
    made_for: usize,
    /// How many grains there are in the whole domain, where only a part of them is here; else 0.
    everywhere: usize,
    /// The bits of the 27 cells around a cell that can hold grains which touch one in it.
    around: u32,
    slots: Slots,
    places: Table<Place>,
    /// What the 27 cells around a cell add to its number (and nothing more, to fill up), for each kind of edge.
    offsets: Box<[[u32; 32]; 27]>,
    /// What brings grains at the other end of a period to where their images are (m), for all ends that one may leave it at.
    shifts: [Vector3<f64>; 27],
}

impl Cells {
    /// An empty grid, laid out for a stream. Where this is only a part of the grains in the domain there are so many `everywhere`.
    pub(crate) fn new(domain: Domain, everywhere: usize, stream: &Stream) -> Self {
        let layout = Layout::new(&domain, stream.largest_radius, None, everywhere, stream);
        Self::empty(domain, layout, stream.grains, everywhere)
    }

    /// The same with cells that are wider than a contact by `skin` (m), if the domain holds such.
    pub(crate) fn with_skin(domain: Domain, skin: f64, stream: &Stream) -> Option<Self> {
        let radius = stream.largest_radius + 0.5 * skin;
        let empty = || Self::empty(domain, Layout::new(&domain, radius, None, 0, stream), stream.grains, 0);
        domain.holds(radius).then(empty)
    }

    fn empty(domain: Domain, layout: Layout, grains: usize, everywhere: usize) -> Self {
        let offsets = Box::new(std::array::from_fn(|edges| Self::offsets(&layout, edges)));
        // In a planar scene nobody is beside the plane.
        let beside = if domain.planar { AHEAD[2] | AHEAD[3] } else { 0 };
        let around = ((1 << 27) - 1) & !beside;
        let slots = Slots::new(layout.cells(), grains);
        let shifts =
            std::array::from_fn(|ends| Vector3::from(steps(ends)).map(f64::from).component_mul(&layout.extent));
        Self { layout, domain, made_for: grains, everywhere, around, slots, places: table([]), offsets, shifts }
    }

    /// An empty grid that suits a stream better, if it is worth its cost; `crossings` and `looks` are what this one took lately.
    ///
    /// Cells x times as wide as they have become by now are crossed 1/x times as often and hold x³ times as many grains to look at. The sum of both
    /// costs is least where x⁴ = cost of the crossings / (3 cost of the looks); in a planar scene x³ with 2.
    pub(crate) fn better(&self, stream: &Stream, crossings: usize, looks: usize) -> Option<Self> {
        let axes = self.domain.axes();
        let dimensions = axes.len() as f64;
        let (crossing, looking) = (LOOKS_PER_CROSSING * crossings as f64, looks.max(1) as f64);
        let wider = (crossing / (dimensions * looking)).powf(1.0 / (dimensions + 1.0)).clamp(0.5, 2.0);
        let width = self.layout.volume(axes, stream.now).powf(1.0 / dimensions) * wider;
        let layout = Layout::new(&self.domain, stream.largest_radius, Some(width), self.everywhere, stream);
        let fewer = layout.crossing_rate(stream) / self.layout.crossing_rate(stream);
        let more = layout.volume(axes, stream.now) / self.layout.volume(axes, stream.now);
        let worth_it = fewer * crossing + more * looking < WORTH_A_NEW_LAYOUT * (crossing + looking);
        worth_it.then(|| Self::empty(self.domain, layout, stream.grains, self.everywhere))
    }

    /// Whether grains of this radius fit the cells.
    pub(crate) fn fits(&self, radius: f64) -> bool {
        self.domain.axes().iter().all(|&axis| contact_width(radius) <= self.layout.size[axis])
    }

    /// Whether so many grains would crowd the grid.
    pub(crate) fn crowded(&self, grains: usize) -> bool {
        grains > CROWD * self.made_for.max(FEWEST_GRAINS)
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

    /// What each of the 27 cells around a cell and itself adds to its number, where periods end at the sides that `edges` tells.
    fn offsets(layout: &Layout, edges: usize) -> [u32; 32] {
        let offset = |number: usize, axis: usize| {
            let (step, edge) = (steps(number)[axis], steps(edges)[axis]);
            layout.along(axis, if edge == step { step - layout.period[axis] * step } else { step })
        };
        let cell = |number: usize| (0..3).fold(0, |sum: u32, axis| sum.wrapping_add(offset(number, axis)));
        std::array::from_fn(|number| if number < 27 { cell(number) } else { 0 })
    }

    /// The place of a grain in a cell.
    #[inline]
    fn place(&self, cell: Vector3<i32>) -> Place {
        let (mut number, mut edges, mut turned) = (self.layout.first_number, INSIDE, false);
        for axis in 0..3 {
            let period = self.layout.period[axis];
            let mut home = cell[axis];
            if period > 0 {
                if home as u32 >= period as u32 {
                    home = home.rem_euclid(period);
                    turned = true;
                }
                edges += THREE_TO[axis] * u8::from(home + 1 == period);
                edges -= THREE_TO[axis] * u8::from(home == 0);
            }
            number = number.wrapping_add(self.layout.along(axis, home));
        }
        Place::new(cell, number, edges, turned)
    }

    /// Makes room for the places of grains 0 to `grains` - 1, and no more.
    pub(crate) fn reserve(&mut self, grains: usize) {
        make_room(&mut self.places, grains);
    }

    /// Puts grain `id` into the cell where it is at `now` (s, epoch time).
    pub(crate) fn insert(&mut self, id: u32, flight: &Flight, now: f64) {
        if self.places.len() <= id as usize {
            self.places.resize(id as usize + 1, NOWHERE);
        }
        self.enter(id, self.cell_of(flight.position_at(now), now));
    }

    #[inline]
    fn enter(&mut self, id: u32, cell: Vector3<i32>) {
        let place = self.place(cell);
        self.places[id as usize] = place;
        self.slots.insert(place.number(), if place.turned() { id | TURNED } else { id });
    }

    /// Whether grain `id` stands in the cell where it is at `now` (s, epoch time).
    pub(crate) fn is_in_place(&self, id: u32, flight: &Flight, now: f64) -> bool {
        self.cell_of(flight.position_at(now), now) == self.places[id as usize].cell
    }

    /// Whether cells were laid out until `now` (s, epoch time). Before that they are narrower than they may be.
    pub(crate) fn were_there(&self, now: f64) -> bool {
        self.layout.born <= now
    }

    /// Takes grain `id` out.
    #[inline]
    pub(crate) fn remove(&mut self, id: u32) {
        self.slots.remove(self.places[id as usize].number(), id);
    }

    /// Tells the grid that a periodic wrap has moved the stored position of `id` by `shift`.
    pub(crate) fn wrapped(&mut self, id: u32, shift: Vector3<f64>) {
        let turns = shift.component_div(&self.domain.extent()).map(|x| x.round() as i32);
        let place = self.place(self.places[id as usize].cell + turns.component_mul(&self.layout.period));
        self.places[id as usize] = place;
        self.slots.turn(place.number(), id, if place.turned() { TURNED } else { 0 });
    }

    /// When and through which side `flight` leaves its cell.
    #[inline]
    pub(crate) fn crossing(&self, id: u32, flight: &Flight) -> Crossing {
        let three = |vector: &Vector3<f64>| f64x4::from([vector.x, vector.y, vector.z, 0.0]);
        let (never, none) = (f64x4::splat(f64::INFINITY), f64x4::ZERO);
        let number = three(&self.places[id as usize].cell.map(f64::from));
        let Layout { corner, drift, rise, size, born, .. } = &self.layout;
        let [corner, drift, rise, size] = [corner, drift, rise, size].map(three);
        let size = size + rise * (flight.time - born);
        // Place and velocity as the lower side of the cell sees them.
        let place = three(&flight.position) - (corner + drift * flight.time) - number * size;
        let speed = three(&flight.velocity) - (drift + number * rise);
        // It leaves through the upper side, or else the lower, or never.
        let faster = speed - rise;
        let up = faster.simd_gt(none);
        let room = up.bitselect(size - place, place);
        let time = (speed.simd_lt(none) | up).bitselect(room / up.bitselect(faster, -speed), never);
        let ups = up.to_bitmask();
        let mut first = Crossing { time: f64::INFINITY, side: 0 };
        for (axis, time) in (0..3).zip(time.to_array()) {
            if time < first.time {
                first = Crossing { time, side: 2 * axis + (ups >> axis & 1) as u8 };
            }
        }
        first.time += flight.time;
        first
    }

    /// Moves grain `id` through a side of its cell into the next.
    #[inline]
    pub(crate) fn cross(&mut self, id: u32, side: u8) {
        let (axis, step) = axis_and_step(side);
        self.remove(id);
        let mut cell = self.places[id as usize].cell;
        cell[axis] += step;
        self.enter(id, cell);
    }

    /// Adds to `near` every grain in the cells that have become adjacent to grain `id` when it went through a `side` of its cell.
    #[inline]
    pub(crate) fn add_ahead(&self, id: u32, side: u8, near: &mut Near) {
        self.add::<false>(id, &self.places[id as usize], AHEAD[usize::from(side)] & self.around, near);
    }

    /// Adds to `near` every grain in the cells around grain `id`.
    #[inline]
    pub(crate) fn add_around(&self, id: u32, near: &mut Near) {
        self.add::<true>(id, &self.places[id as usize], self.around, near);
    }

    /// Adds to `near` every grain in the cells around `position`, where there need not be a grain.
    pub(crate) fn add_near(&self, position: Vector3<f64>, time: f64, near: &mut Near) {
        self.add::<true>(NOBODY, &self.place(self.cell_of(position, time)), self.around, near);
    }

    /// Asks the memory for the place of grain `id`.
    #[inline]
    pub(crate) fn fetch_place(&self, id: u32) {
        prefetch(&self.places, id as usize);
    }

    /// Where the next search for grain `id` will look: ahead, if it then goes through a `side` of its cell, or else all around; nowhere if it has
    /// no place. At the ends of a period that may be wrong: it serves to fetch from memory.
    #[inline]
    pub(crate) fn region_of_next_search(&self, id: u32, side: Option<u8>) -> Option<Region> {
        // Since it was said to come it may have been taken out, and cells laid out that never saw it.
        let place = self.places.get(id as usize)?;
        let (number, edges) = (place.number(), place.edges());
        let Some(side) = side else { return Some(Region { number, edges, wanted: self.around }) };
        let (axis, step) = axis_and_step(side);
        let wanted = AHEAD[usize::from(side)] & self.around;
        Some(Region { number: number.wrapping_add(self.layout.along(axis, step)), edges, wanted })
    }

    /// Asks the memory for the cell of grain `id` and the one into which it goes through a `side`.
    #[inline]
    pub(crate) fn fetch_old_and_new(&self, id: u32, side: u8) {
        let Some(place) = self.places.get(id as usize) else { return };
        let (axis, step) = axis_and_step(side);
        self.slots.fetch(place.number());
        self.slots.fetch(place.number().wrapping_add(self.layout.along(axis, step)));
    }

    /// Asks the memory for the cells of a region.
    #[inline]
    pub(crate) fn fetch_cells(&self, region: Region) {
        let offsets = &self.offsets[region.edges as usize];
        for row in 0..9 {
            if region.wanted & 0b111 << (3 * row) != 0 {
                self.slots.fetch_three(region.number.wrapping_add(offsets[3 * row + 1]));
            }
        }
    }

    /// Visits the grains in each cell of a region, but for those beyond the first few.
    #[inline]
    pub(crate) fn visit_first_in_cells(&self, region: Region, mut visit: impl FnMut(u32)) {
        let offsets = &self.offsets[region.edges as usize];
        let mut occupied = 0;
        for row in 0..9 {
            if region.wanted & 0b111 << (3 * row) != 0 {
                let number = region.number.wrapping_add(offsets[3 * row + 1]);
                occupied |= u32::from(self.slots.glance(number).1) << (3 * row);
            }
        }
        occupied &= region.wanted;
        while occupied != 0 {
            let around = occupied.trailing_zeros() as usize;
            occupied &= occupied - 1;
            self.slots.glance(region.number.wrapping_add(offsets[around])).0.grains().for_each(&mut visit);
        }
    }

    /// Adds to `near`, which is empty, the grains in those of the 27 cells around a place whose bits are set, but for `id`: the cell in the middle is among
    /// them if they are all `AROUND`.
    ///
    /// In which cells there are grains, and how many, cannot be foretold, and a wrong guess costs a processor as much as a look: so whole blocks are
    /// written down, and what does not count is overwritten. Grains of other cells that share a slot are among them, and now and then a grain is
    /// twice, or `id` is: that costs a look, and changes nothing.
    fn add<const AROUND: bool>(&self, id: u32, place: &Place, wanted: u32, near: &mut Near) {
        let (number, edges) = (place.number(), usize::from(place.edges()));
        let offsets = &self.offsets[edges];
        let mut occupied = 0;
        for row in 0..9 {
            let number = number.wrapping_add(offsets[3 * row + 1]);
            occupied |= u32::from(self.slots.occupied(number)) << (3 * row);
        }
        let beyond = BEYOND[edges];
        // Where a row goes on at the other end of the period nobody has looked: that depends on the edges along x only.
        let unseen = BEYOND[edges % 3 + usize::from(INSIDE) - usize::from(INSIDE) % 3];
        occupied = (occupied | unseen) & wanted;
        let mut here = if place.turned() { 0 } else { occupied & !beyond };
        if here != 0 && !self.add_here::<AROUND>(id, offsets, number, here, near) {
            (here, near.count) = (0, 0);
        }
        if occupied != here {
            self.add_beyond(id, place, occupied & !here, near);
        }
    }

    /// Adds the grains in those cells around the cell with the number `centre` whose bits are set, but for `id`. Gives false, and what it has added is
    /// wrong, if one of them is [`TURNED`].
    #[inline]
    fn add_here<const AROUND: bool>(
        &self,
        id: u32,
        offsets: &[u32; 32],
        centre: u32,
        occupied: u32,
        near: &mut Near,
    ) -> bool {
        // A full block of each of the 27 cells, and what is written beside the last grain.
        near.make_room(Block::ROOM * 28);
        let (here, mut count, mut seen) = (&mut near.here[..], 0, u32x4::ZERO);
        let mut cells = occupied & !OWN;
        while cells != 0 {
            let around = cells.trailing_zeros() as usize;
            cells &= cells - 1;
            let block = self.slots.first_block(centre.wrapping_add(offsets[around % 32]));
            here[count..count + 4].copy_from_slice(&block.words);
            count += block.count();
            seen |= u32x4::from(block.words);
        }
        if AROUND {
            let block = self.slots.first_block(centre);
            for (place, &other) in block.words[..Block::ROOM].iter().enumerate() {
                here[count] = other;
                count += usize::from((place < block.count()) & (other != id));
            }
            seen |= u32x4::from(block.words);
        }
        near.end_with(count);
        let seen = seen.to_array();
        if seen[Block::ROOM] > Block::ROOM as u32 {
            return self.add_more(id, offsets, centre, occupied, near);
        }
        (seen[0] | seen[1] | seen[2]) & TURNED == 0
    }

    /// The same, once the first block of each cell has been added.
    #[cold]
    fn add_more(&self, id: u32, offsets: &[u32; 32], centre: u32, mut occupied: u32, near: &mut Near) -> bool {
        let mut turned = 0;
        while occupied != 0 {
            let around = occupied.trailing_zeros() as usize;
            occupied &= occupied - 1;
            let mut block = self.slots.first_block(centre.wrapping_add(offsets[around]));
            turned |= block.turned();
            while let Some(next) = self.slots.next_block(block) {
                near.make_room(near.count + Block::ROOM + 3);
                for other in next.grains().filter(|&other| other != id) {
                    near.here[near.count] = other;
                    near.end_with(near.count + 1);
                }
                turned |= next.turned();
                block = next;
            }
        }
        turned == 0
    }

    /// Adds the grains in those cells around a place whose bits are set, but for `id`, with their shifts. There may be none in some of these cells.
    fn add_beyond(&self, id: u32, place: &Place, mut wanted: u32, near: &mut Near) {
        let edges = usize::from(place.edges());
        let (offsets, leaves) = (&self.offsets[edges], &LEAVES[edges]);
        while wanted != 0 {
            let around = wanted.trailing_zeros() as usize;
            wanted &= wanted - 1;
            let first = self.slots.first_block(place.number().wrapping_add(offsets[around]));
            for block in std::iter::successors(Some(first), |block| self.slots.next_block(block)) {
                let stored_there = !place.turned() && block.turned() == 0;
                for other in block.grains().filter(|&other| other != id) {
                    let shift = match stored_there {
                        true => self.shifts[leaves[around] as usize],
                        false => self.shift(other, place.cell, around),
                    };
                    near.beyond.push((other, shift));
                }
            }
        }
    }

    /// The shift (m) that brings `grain` to where its image is in the cell with this number around `centre`.
    #[inline(never)]
    fn shift(&self, grain: u32, centre: Vector3<i32>, around: usize) -> Vector3<f64> {
        let Layout { period, extent, .. } = &self.layout;
        let apart = centre + Vector3::from(steps(around)) - self.places[grain as usize].cell;
        Vector3::from_fn(|axis, _| f64::from(apart[axis] / period[axis].max(1)) * extent[axis])
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    #[test]
    fn each_once_is_each_once_and_without_oneself() {
        let mut near = Near { count: 6, here: vec![3, 1, 2, 3, 2, 2, 1, 1], ..Near::default() };
        near.each_once(2);
        assert_eq!(near.iter().map(|(other, _)| other).collect::<Vec<_>>(), [1, 3]);
    }

    /// Crowded and empty cells, in a period and without: whoever is near is found, and what stands beside an odd last one is a grain (it was the number of a
    /// block, and the search for partners went where no grain is).
    #[test]
    fn whoever_is_near_is_found_once_and_beside_the_last_stands_a_grain() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let (count, side, radius) = (1500, 8.0, 0.4);
        for periodic in [true, false] {
            let (min, max) = (Vector3::zeros(), Vector3::repeat(side));
            let domain = if periodic { Domain { min, max, periodic, planar: false } } else { Domain::unbounded() };
            let mut flights: Vec<Flight> = (0..count)
                .map(|number| {
                    // Every second one in a corner, and some out of the period.
                    let within = if number % 2 == 0 { 0.25 * side } else { 1.1 * side };
                    let position = Vector3::from_fn(|_, _| random.random_range(0.0..within));
                    Flight { position, time: 0.0, velocity: Vector3::zeros(), radius }
                })
                .collect();
            let mut cells = Cells::new(domain, 0, &Stream::new(flights.iter(), 0.0));
            (0..).zip(&flights).for_each(|(id, flight)| cells.insert(id, flight, 0.0));
            // It keeps what was written for others.
            let mut near = Near::default();
            for round in 0..4 {
                for id in 0..count {
                    let grains_only = |near: &Near| near.here().0.as_flattened().iter().all(|&other| other < count);
                    for side in 0..6 {
                        near.clear();
                        cells.add_ahead(id, side, &mut near);
                        assert!(grains_only(&near), "round {round}, grain {id}, side {side}");
                    }
                    near.clear();
                    cells.add_around(id, &mut near);
                    assert!(grains_only(&near), "round {round}, grain {id}");
                    near.each_once(id);
                    let touching = |place: Vector3<f64>| place.norm() < 2.0 * radius;
                    let ours = flights[id as usize].position;
                    let mut found: Vec<u32> = near
                        .iter()
                        .filter(|&(other, shift)| touching(flights[other as usize].position + shift - ours))
                        .map(|(other, _)| other)
                        .collect();
                    found.sort_unstable();
                    let all = (0..count).filter(|&other| {
                        other != id && touching(domain.nearest(flights[other as usize].position - ours))
                    });
                    assert_eq!(found, all.collect::<Vec<_>>(), "round {round}, grain {id}");
                }
                // Some come back elsewhere.
                for id in (0..count).filter(|id| id % 4 == round) {
                    cells.remove(id);
                    let position = Vector3::from_fn(|_, _| random.random_range(0.0..side));
                    flights[id as usize].position = position;
                    cells.insert(id, &flights[id as usize], 0.0);
                }
            }
        }
    }

    /// Cells that had grown with a spray were taken for as narrow as they were laid out: however many looks they cost, they stayed.
    #[test]
    fn cells_that_have_grown_are_as_wide_as_they_are() {
        let flights: Vec<Flight> = (0..1000)
            .map(|number| {
                let place = Vector3::new(number % 10, number / 10 % 10, number / 100).map(|x| f64::from(x) - 4.5);
                let velocity = place.add_scalar(f64::from(number % 7) * 0.01);
                Flight { position: place, time: 0.0, velocity, radius: 0.4 }
            })
            .collect();
        let cells = Cells::new(Domain::unbounded(), 0, &Stream::new(flights.iter(), 0.0));
        let width = |cells: &Cells| cells.layout.volume(&[0, 1, 2], 3.0).cbrt();
        let (crossings, looks) = (1, 1_000_000);
        let later = Stream::new(flights.iter(), 3.0);
        let better = cells.better(&later, crossings, looks).expect("looks cost more than all else");
        assert!(width(&cells) > 3.0 && width(&better) < 0.51 * width(&cells), "{} {}", width(&cells), width(&better));
    }
}
