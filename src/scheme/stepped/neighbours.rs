//! Who may touch whom: pairs that were near each other when the list was made, kept until a grain has used up half the skin.

use std::ops::Range;

use impinge_events::{Domain, Flight};
use nalgebra::Vector3;

/// Steps that a list should serve, by the fastest grain: more make longer lists.
const STEPS: f64 = 16.0;
/// Narrowest and widest skin, in radii of the largest grain: grains that hardly move get a list that lasts, and beyond a radius the lists hold
/// so many pairs that it is cheaper to make them anew.
const SKIN: [f64; 2] = [0.05, 1.0];
/// Most cells for each grain, and beside them: a spray that flies far apart gets wider cells, not more of them.
const CELLS_PER_GRAIN: f64 = 32.0;
const CELLS: f64 = 1024.0;
/// Fewest cells along a period, so that the cells on both sides of one are not the same.
const FEWEST: usize = 3;

/// Pairs of grains that may touch.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbours {
    pairs: Vec<[u32; 2]>,
    /// Where each grain was when the list was made, m.
    anchors: Vec<Vector3<f64>>,
    /// Velocity of the frame that drifts with the stream, m/s: grains that fly side by side use up no skin.
    drift: Vector3<f64>,
    /// When the list was made, s.
    made: f64,
    /// How far a grain may move in that frame, m.
    room: f64,
    /// Gaps (m) up to which pairs are named.
    reach: f64,
    bins: Bins,
}

impl Neighbours {
    /// Each pair once, the lower slot first.
    pub(super) fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }

    /// Whether the list names all pairs of `flights`, as they are at `clock` (s), with gaps below `reach` (m), as far as the grains in these slots
    /// matter: none of them has used up its room.
    pub(super) fn holds(
        &self,
        flights: &[Flight],
        slots: Range<usize>,
        domain: &Domain,
        clock: f64,
        reach: f64,
    ) -> bool {
        if self.anchors.len() != flights.len() || reach > self.reach {
            return false;
        }
        let (drifted, room) = (self.drift * (clock - self.made), self.room * self.room);
        let all = flights[slots.clone()].iter().zip(&self.anchors[slots]);
        let mut all = all.map(|(flight, anchor)| flight.position - anchor - drifted);
        match domain.periodic {
            true => all.all(|moved| domain.nearest(moved).norm_squared() < room),
            false => all.all(|moved| moved.norm_squared() < room),
        }
    }

    /// Forgets everything: grains have new slots.
    pub(super) fn clear(&mut self) {
        self.anchors.clear();
    }

    /// Makes the list anew at `clock` (s), for gaps up to `reach` (m) and steps of length `step` (s).
    pub(super) fn make(&mut self, flights: &[Flight], domain: &Domain, clock: f64, reach: f64, step: f64) {
        self.pairs.clear();
        self.anchors.clear();
        self.anchors.extend(flights.iter().map(|flight| flight.position));
        let largest = flights.iter().map(|flight| flight.radius).fold(0.0, f64::max);
        self.drift = flights.iter().map(|flight| flight.velocity).sum::<Vector3<f64>>() / flights.len().max(1) as f64;
        let relative = |flight: &Flight| (flight.velocity - self.drift).norm_squared();
        let fastest = flights.iter().map(relative).fold(0.0, f64::max).sqrt();
        let mut skin = (2.0 * fastest * step * STEPS).clamp(SKIN[0] * largest, SKIN[1] * largest);
        if domain.periodic {
            // What cells of three to a period leave.
            let period = axes(domain).map(|axis| domain.extent()[axis]).fold(f64::INFINITY, f64::min);
            skin = skin.min(period / FEWEST as f64 - 2.0 * largest - reach);
        }
        let skin = skin.max(0.0);
        (self.made, self.room, self.reach) = (clock, 0.5 * skin, reach);
        let within = reach + skin;
        let pairs = &mut self.pairs;
        let mut offer = |a: &Binned, b: &Binned| {
            let most = a.radius + b.radius + within;
            if domain.nearest(b.position - a.position).norm_squared() < most * most {
                pairs.push(if a.slot < b.slot { [a.slot, b.slot] } else { [b.slot, a.slot] });
            }
        };
        if self.bins.fill(flights, domain, 2.0 * largest + within) {
            self.bins.near(&mut offer);
        } else {
            let all: Vec<_> = (0..).zip(flights).map(|(slot, flight)| Binned::new(slot, flight)).collect();
            all.iter().enumerate().for_each(|(k, a)| all[k + 1..].iter().for_each(|b| offer(a, b)));
        }
    }
}

/// The axes along which grains move.
fn axes(domain: &Domain) -> impl Iterator<Item = usize> + use<> {
    let planar = domain.planar;
    (0..3).filter(move |&axis| !(planar && axis == 1))
}

/// A grain in its cell.
#[derive(Clone, Copy, Debug)]
struct Binned {
    position: Vector3<f64>,
    radius: f64,
    slot: u32,
    cell: u32,
}

impl Binned {
    fn new(slot: u32, flight: &Flight) -> Self {
        Self { position: flight.position, radius: flight.radius, slot, cell: 0 }
    }
}

/// Grains sorted by the cell that they are in; cells count along x first.
#[derive(Clone, Debug, Default)]
struct Bins {
    counts: [usize; 3],
    periodic: bool,
    /// The grains of cell k are from `starts[k]` to `starts[k + 1]`.
    starts: Vec<u32>,
    unsorted: Vec<Binned>,
    sorted: Vec<Binned>,
}

impl Bins {
    /// Sorts grains into cells of at least `side` (m). Not where a period has room for fewer than three: there all pairs are near.
    fn fill(&mut self, flights: &[Flight], domain: &Domain, side: f64) -> bool {
        let places = || flights.iter().map(|flight| flight.position);
        let (mut low, mut high) = (domain.min, domain.max);
        if !domain.periodic {
            low = places().fold(Vector3::repeat(f64::INFINITY), |low, place| low.inf(&place));
            high = places().fold(Vector3::repeat(f64::NEG_INFINITY), |high, place| high.sup(&place));
        }
        let extent = high - low;
        let most = CELLS_PER_GRAIN * flights.len() as f64 + CELLS;
        let count = |side: f64| extent.map(|along| (along / side).max(1.0));
        let mut side = side;
        while count(side).product() > most {
            side *= (count(side).product() / most).cbrt().max(1.01);
        }
        self.counts = count(side).map(|count| count as usize).into();
        self.periodic = domain.periodic;
        if self.periodic && axes(domain).any(|axis| self.counts[axis] < FEWEST) {
            return false;
        }
        let [along_x, along_y, along_z] = self.counts;
        let scale = Vector3::from_fn(|axis, _| self.counts[axis] as f64 / extent[axis]);
        let index = |place: Vector3<f64>| {
            let mut place = place;
            domain.wrap(&mut place);
            // An extent of 0 gives no number, which is cell 0.
            let along = |axis: usize| (((place[axis] - low[axis]) * scale[axis]) as usize).min(self.counts[axis] - 1);
            ((along(2) * along_y + along(1)) * along_x + along(0)) as u32
        };
        self.unsorted.clear();
        let binned = |(slot, flight)| {
            let binned = Binned::new(slot, flight);
            Binned { cell: index(binned.position), ..binned }
        };
        self.unsorted.extend((0..).zip(flights).map(binned));
        self.sort(along_x * along_y * along_z);
        true
    }

    /// Counting sort by cell.
    fn sort(&mut self, cells: usize) {
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for binned in &self.unsorted {
            self.starts[binned.cell as usize] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.sorted.clear();
        self.sorted.extend_from_slice(&self.unsorted);
        // From the back, so that grains of a cell keep their order.
        for binned in self.unsorted.iter().rev() {
            let start = &mut self.starts[binned.cell as usize];
            *start -= 1;
            self.sorted[*start as usize] = *binned;
        }
    }

    /// Offers each pair of grains in one cell or in cells side by side, once.
    fn near(&self, offer: &mut impl FnMut(&Binned, &Binned)) {
        let [along_x, along_y, along_z] = self.counts;
        for z in 0..along_z {
            for y in 0..along_y {
                let row = (z * along_y + y) * along_x;
                let others = self.rows_ahead(y, z);
                for x in 0..along_x {
                    let here = self.cells(row + x, row + x);
                    if here.is_empty() {
                        continue;
                    }
                    for (k, a) in here.iter().enumerate() {
                        here[k + 1..].iter().for_each(|b| offer(a, b));
                        if let Some(next) = self.neighbour(x, 1, along_x) {
                            self.cells(row + next, row + next).iter().for_each(|b| offer(a, b));
                        }
                        for &other in others.iter().flatten() {
                            for (from, to) in self.around(x) {
                                self.cells(other + from, other + to).iter().for_each(|b| offer(a, b));
                            }
                        }
                    }
                }
            }
        }
    }

    /// First cells of the four rows beside row (y, z) that come after it.
    fn rows_ahead(&self, y: usize, z: usize) -> [Option<usize>; 4] {
        let [along_x, along_y, along_z] = self.counts;
        [(1, 0), (-1, 1), (0, 1), (1, 1)].map(|(dy, dz)| {
            let (y, z) = (self.neighbour(y, dy, along_y)?, self.neighbour(z, dz, along_z)?);
            Some((z * along_y + y) * along_x)
        })
    }

    /// The cell `by` cells beside `at` of `count` along an axis; a single layer has none beside it.
    #[inline]
    fn neighbour(&self, at: usize, by: isize, count: usize) -> Option<usize> {
        let beside = at as isize + by;
        match (0..count as isize).contains(&beside) {
            true => Some(beside as usize),
            false if self.periodic && count > 1 => Some(beside.rem_euclid(count as isize) as usize),
            false => None,
        }
    }

    /// The cells from one before `x` to one after it, as stretches of a row.
    #[inline]
    fn around(&self, x: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let last = self.counts[0] - 1;
        let middle = (x.saturating_sub(1), (x + 1).min(last));
        let wraps = self.periodic && last > 0;
        let beyond = match x {
            0 if wraps => Some((last, last)),
            _ if wraps && x == last => Some((0, 0)),
            _ => None,
        };
        [Some(middle), beyond].into_iter().flatten()
    }

    #[inline]
    fn cells(&self, first: usize, last: usize) -> &[Binned] {
        &self.sorted[self.starts[first] as usize..self.starts[last + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::SeedableRng as _;

    use super::*;

    fn flights(seed: u64, count: usize, size: Vector3<f64>) -> Vec<Flight> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut vector =
            |size: Vector3<f64>| size.map(|most| if most > 0.0 { random.random_range(0.0..most) } else { 0.0 });
        let one = |k| {
            let (position, velocity) = (vector(size), vector(Vector3::repeat(3.0)));
            Flight { position, time: 0.0, velocity, radius: 0.5 - 0.1 * (k % 4) as f64 }
        };
        (0..count).map(one).collect()
    }

    proptest! {
        /// As long as the list holds, whoever is near enough is named, once; and nobody who was far off.
        #[test]
        fn pairs_are_those_of_a_look_at_all(
            seed: u64, count in 0..80usize, long in 4.1..30.0f64, wide in 4.1..12.0f64, periodic: bool, planar: bool, reach in 0.0..0.2f64,
        ) {
            let size = Vector3::new(long, if planar { 0.0 } else { wide }, wide);
            let domain = Domain { min: Vector3::zeros(), max: size, periodic, planar };
            let mut flights = flights(seed, count, size);
            let mut neighbours = Neighbours::default();
            neighbours.make(&flights, &domain, 0.0, reach, 0.002);
            let made = flights.clone();
            let step = 0.002;
            for clock in (0..20).map(|steps| f64::from(steps) * step) {
                let mut named = neighbours.pairs().to_vec();
                named.sort_unstable();
                let all = named.len();
                named.dedup();
                prop_assert_eq!(named.len(), all);
                let gap = |of: &[Flight], a: usize, b: usize| {
                    domain.nearest(of[b].position - of[a].position).norm() - of[a].radius - of[b].radius
                };
                let holds = neighbours.holds(&flights, 0..count, &domain, clock, reach);
                prop_assert!(holds || clock > 0.0 || neighbours.room == 0.0);
                for a in 0..count {
                    for b in a + 1..count {
                        let listed = named.binary_search(&[a as u32, b as u32]).is_ok();
                        prop_assert!(listed || !holds || gap(&flights, a, b) >= reach - 1e-12);
                        prop_assert!(!listed || gap(&made, a, b) < reach + 0.5 + 1e-12);
                    }
                }
                flights.iter_mut().for_each(|flight| flight.position += flight.velocity * step);
            }
        }
    }

    /// A spray that has flown apart gets wider cells, and no pair is lost.
    #[test]
    fn cells_of_a_wide_spray_are_bounded() {
        let size = Vector3::repeat(1000.0);
        let domain = Domain { min: -size, max: size, periodic: false, planar: false };
        let mut flights = flights(1, 100, size);
        flights[7].position = flights[93].position + Vector3::x() * 0.55;
        let mut neighbours = Neighbours::default();
        neighbours.make(&flights, &domain, 0.0, 0.0, 1e-3);
        assert_eq!(neighbours.pairs(), [[7, 93]]);
        assert!(neighbours.bins.starts.len() as f64 <= CELLS_PER_GRAIN * 100.0 + CELLS + 1.0);
    }
}
