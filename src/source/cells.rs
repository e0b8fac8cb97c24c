//! Which placed grains are near a point? A grid of cells, so that placing and checking N grains costs O(N).
//!
//! Grains are sorted into classes of radius, each class twice as wide as the next smaller one and with cells of its own:
//! dust between boulders does not have to be sought in cells of the size of boulders. Cells are
//! hashed into a table whose size follows the grains, not the domain. Different cells may share a slot of the table; that
//! only shows a few grains too many, and all that are shown are measured.

use nalgebra::Vector3;

use crate::scene::{Boundary, Domain};

/// A placed grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// Id of the grain.
    pub(super) id: u32,
    /// Radius, m.
    pub(super) radius: f64,
    position: Vector3<f64>,
    /// Hash of its cell.
    hash: u64,
    /// The next item of the same slot, or `NONE`.
    next: u32,
}

const NONE: u32 = u32::MAX;

/// Slots of the table per grain, at least: more of them show fewer grains of other cells, but take more memory.
const SLOTS_PER_GRAIN: usize = 4;

/// Grains whose radius lies in (reach / 2, reach].
#[derive(Debug)]
struct Class {
    exponent: i32,
    reach: f64,
    /// Start of the hashes of its cells.
    salt: u64,
    /// Sides of a cell, m; at least 2 reach, so that partners of equal size are at most one cell away.
    side: Vector3<f64>,
    /// Cells around a periodic axis; 0 along an open one.
    count: [i64; 3],
    members: Vec<u32>,
}

/// The grid.
#[derive(Debug)]
pub(super) struct Cells {
    origin: Vector3<f64>,
    /// Period along each axis, m; 0 where the domain is open.
    period: Vector3<f64>,
    planar: bool,
    /// Upper edge of class 0: the radius of the first grain.
    unit: f64,
    classes: Vec<Class>,
    /// The first item of each slot; a power of two of them.
    slots: Vec<u32>,
    items: Vec<Item>,
}

impl Cells {
    /// An empty grid over `domain`.
    pub(super) fn new(domain: &Domain) -> Self {
        let period = match domain.boundary {
            Boundary::Open => Vector3::zeros(),
            Boundary::Periodic => Vector3::from(domain.max) - Vector3::from(domain.min),
        };
        Self {
            origin: domain.min.into(),
            period: if domain.planar { Vector3::new(period.x, 0.0, period.z) } else { period },
            planar: domain.planar,
            unit: 0.0,
            classes: Vec::new(),
            slots: vec![NONE; 64],
            items: Vec::new(),
        }
    }

    /// Period along each axis, m; 0 where there is none.
    pub(super) fn period(&self) -> Vector3<f64> {
        self.period
    }

    /// Makes room for so many more grains.
    pub(super) fn make_room(&mut self, grains: usize) {
        self.items.reserve_exact(grains);
        self.make_slots(self.items.len() + grains);
    }

    /// Makes the table large enough for so many grains.
    fn make_slots(&mut self, grains: usize) {
        if grains * SLOTS_PER_GRAIN > self.slots.len() {
            self.slots = vec![NONE; (grains * SLOTS_PER_GRAIN).next_power_of_two()];
            (0..self.items.len()).for_each(|index| self.link(index));
        }
    }

    /// Adds a grain.
    pub(super) fn insert(&mut self, id: u32, position: Vector3<f64>, radius: f64) {
        let number = self.class_for(radius);
        let class = &self.classes[number];
        let cell = |axis: usize| self.cell_range(class, axis, position[axis], position[axis]).start;
        let hash = (0..3).fold(class.salt, |hash, axis| hash.wrapping_add(cell_hash(class, axis, cell(axis))));
        let index = u32::try_from(self.items.len()).expect("MOST_GRAINS is far below 2^32");
        self.classes[number].members.push(index);
        self.make_slots(self.items.len() + 1);
        self.items.push(Item { id, radius, position, hash, next: NONE });
        self.link(index as usize);
    }

    /// Puts an item at the head of its slot.
    fn link(&mut self, index: usize) {
        let slot = self.slot(self.items[index].hash);
        self.items[index].next = std::mem::replace(&mut self.slots[slot], index as u32);
    }

    /// Whether a grain of this radius overlaps nothing here.
    pub(super) fn is_free(&self, position: Vector3<f64>, radius: f64) -> bool {
        !self.any_near(position, radius, |item, offset| offset.norm_squared() < (item.radius + radius).powi(2))
    }

    /// Shows `test` every grain whose surface may lie within `radius` of `centre`, and others, until `test` says true.
    ///
    /// `test` gets the grain and the vector from `centre` to its nearest image (m).
    pub(super) fn any_near(
        &self,
        centre: Vector3<f64>,
        radius: f64,
        mut test: impl FnMut(&Item, Vector3<f64>) -> bool,
    ) -> bool {
        let mut show = |item: &Item| test(item, self.nearest_image(item.position - centre));
        self.classes.iter().any(|class| {
            let reach = radius + class.reach;
            let [x, y, z] =
                [0, 1, 2].map(|axis| self.cell_range(class, axis, centre[axis] - reach, centre[axis] + reach));
            let cells: f64 = [&x, &y, &z].map(|range| (range.end - range.start) as f64).iter().product();
            if cells >= class.members.len() as f64 {
                return class.members.iter().any(|&index| show(&self.items[index as usize]));
            }
            for i in x {
                let hash_x = class.salt.wrapping_add(cell_hash(class, 0, i));
                for j in y.clone() {
                    let hash_xy = hash_x.wrapping_add(cell_hash(class, 1, j));
                    for k in z.clone() {
                        let hash = hash_xy.wrapping_add(cell_hash(class, 2, k));
                        let mut index = self.slots[self.slot(hash)];
                        while index != NONE {
                            let item = &self.items[index as usize];
                            if item.hash == hash && show(item) {
                                return true;
                            }
                            index = item.next;
                        }
                    }
                }
            }
            false
        })
    }

    fn nearest_image(&self, offset: Vector3<f64>) -> Vector3<f64> {
        offset.zip_map(&self.period, |d, period| if period > 0.0 { d - period * (d / period).round() } else { d })
    }

    /// The class of a radius; a new one where there is none yet.
    fn class_for(&mut self, radius: f64) -> usize {
        if self.classes.is_empty() {
            self.unit = radius;
        }
        let mut exponent = (radius / self.unit).log2().ceil() as i32;
        if self.unit * 2f64.powi(exponent) < radius {
            exponent += 1; // the logarithm was rounded down
        }
        self.classes.iter().position(|class| class.exponent == exponent).unwrap_or_else(|| {
            self.classes.push(self.new_class(exponent));
            self.classes.len() - 1
        })
    }

    fn new_class(&self, exponent: i32) -> Class {
        let reach = self.unit * 2f64.powi(exponent);
        let mut side = Vector3::repeat(2.0 * reach);
        let mut count = [0; 3];
        for axis in 0..3 {
            if self.period[axis] > 0.0 {
                count[axis] = ((self.period[axis] / side[axis]) as i64).max(1);
                side[axis] = self.period[axis] / count[axis] as f64;
            }
        }
        if self.planar {
            count[1] = 1;
        }
        let salt = (exponent as u64).wrapping_mul(MULTIPLIERS[3]);
        Class { exponent, reach, salt, side, count, members: Vec::new() }
    }

    /// The cells that the interval meets along `axis`, each once.
    fn cell_range(&self, class: &Class, axis: usize, low: f64, high: f64) -> std::ops::Range<i64> {
        let cell = |x: f64| ((x - self.origin[axis]) / class.side[axis]).floor() as i64;
        let (first, last) = (cell(low), cell(high));
        let count = class.count[axis];
        if count > 0 && last.saturating_sub(first) >= count - 1 { 0..count } else { first..last.saturating_add(1) }
    }

    fn slot(&self, hash: u64) -> usize {
        (hash >> 32) as usize & (self.slots.len() - 1)
    }
}

/// Odd numbers whose multiples differ in their upper bits, one for each axis and one for the classes.
const MULTIPLIERS: [u64; 4] =
    [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0xd6e8_feb8_6659_fd93, 0xa076_1d64_78bd_642f];

/// What a cell's number along `axis` adds to its hash. Around a periodic axis the numbers go on beyond both ends.
fn cell_hash(class: &Class, axis: usize, cell: i64) -> u64 {
    let count = class.count[axis];
    let wrapped = match cell {
        _ if count == 0 => cell,
        _ if cell < 0 => cell + count,
        _ if cell >= count => cell - count,
        _ => cell,
    };
    (wrapped as u64).wrapping_mul(MULTIPLIERS[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn domain(boundary: Boundary, planar: bool) -> Domain {
        Domain { min: [-1.0, -2.0, 0.5], max: [2.0, 1.5, 3.0], boundary, planar }
    }

    /// The slow exact twin: all pairs, all 27 images.
    fn is_free_by_brute_force(
        domain: &Domain,
        grains: &[(Vector3<f64>, f64)],
        position: Vector3<f64>,
        radius: f64,
    ) -> bool {
        let period = Vector3::from(domain.max) - Vector3::from(domain.min);
        let shifts: &[f64] = if domain.boundary == Boundary::Periodic { &[-1.0, 0.0, 1.0] } else { &[0.0] };
        let shifts_y: &[f64] = if domain.planar { &[0.0] } else { shifts };
        grains.iter().all(|(other, other_radius)| {
            shifts.iter().all(|i| {
                shifts_y.iter().all(|j| {
                    shifts.iter().all(|k| {
                        let image = other + period.component_mul(&Vector3::new(*i, *j, *k));
                        (image - position).norm() >= radius + other_radius
                    })
                })
            })
        })
    }

    #[test]
    fn finds_what_all_pairs_find() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        for (boundary, planar) in
            [(Boundary::Open, false), (Boundary::Periodic, false), (Boundary::Open, true), (Boundary::Periodic, true)]
        {
            let domain = domain(boundary, planar);
            let mut cells = Cells::new(&domain);
            let mut grains = Vec::new();
            let (mut free, mut taken) = (0, 0);
            for id in 0..600 {
                let mut position = Vector3::from_fn(|i, _| rng.random_range(domain.min[i]..=domain.max[i]));
                if planar {
                    position.y = 0.0;
                }
                // Radii over a range of 1 : 100, a few of them as large as the domain.
                let radius = 0.01 * 100f64.powf(rng.random::<f64>().powi(6));
                let expected = is_free_by_brute_force(&domain, &grains, position, radius);
                assert_eq!(cells.is_free(position, radius), expected, "{boundary:?} planar {planar} grain {id}");
                *if expected { &mut free } else { &mut taken } += 1;
                cells.insert(id, position, radius);
                grains.push((position, radius));
            }
            assert!(free > 20 && taken > 20, "the test must see both answers: {free} free, {taken} taken");
        }
    }
}
