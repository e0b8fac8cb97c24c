//! Who is near whom, for longer than one sub-step.

use std::ops::Range;

use impinge_events::Domain;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};
use rayon::slice::ParallelSliceMut as _;
use rustc_hash::FxHashMap;

/// Share by which cells are wider than the reach of the lists: rounding must not put grains within reach two cells apart.
const CELL_MARGIN: f64 = 1e-6;

/// Grains whose neighbours are looked for in one go.
const GRAINS: usize = 256;

/// The neighbours of each grain within some reach of where it was when the lists were made (Verlet 1967).
#[derive(Clone, Debug, Default)]
pub(super) struct NeighborList {
    /// Where the grains were, m.
    positions: Vec<Vector3<f64>>,
    /// Where the neighbours of each grain begin in `neighbors`, and where the last ones end.
    starts: Vec<usize>,
    /// Neighbours by grain, in rising order.
    neighbors: Vec<u32>,
}

impl NeighborList {
    /// Lists all pairs within `reach` (m), each at both grains.
    pub(super) fn new(positions: &[Vector3<f64>], domain: &Domain, reach: f64) -> Self {
        let cells = Cells::new(positions, domain, reach);
        let chunks: Vec<Range<usize>> =
            (0..positions.len()).step_by(GRAINS).map(|start| start..(start + GRAINS).min(positions.len())).collect();
        let lists: Vec<Vec<Vec<u32>>> = chunks
            .into_par_iter()
            .map(|grains| grains.map(|grain| cells.near(grain, positions, domain, reach)).collect())
            .collect();
        let mut list = Self { positions: positions.to_vec(), starts: vec![0], neighbors: Vec::new() };
        for neighbors in lists.iter().flatten() {
            list.neighbors.extend(neighbors);
            list.starts.push(list.neighbors.len());
        }
        list
    }

    /// Neighbours of a grain.
    pub(super) fn of(&self, grain: usize) -> &[u32] {
        &self.neighbors[self.starts[grain]..self.starts[grain + 1]]
    }

    /// Whether there are as many grains as before, and none has moved further than `slack` (m).
    pub(super) fn holds(&self, positions: &[Vector3<f64>], domain: &Domain, slack: f64) -> bool {
        let near =
            |(now, then): (&Vector3<f64>, &Vector3<f64>)| domain.nearest(now - then).norm_squared() <= slack * slack;
        positions.len() == self.positions.len() && positions.iter().zip(&self.positions).all(near)
    }
}

/// Grains sorted into cubes at least as wide as the reach of the lists.
struct Cells {
    axes: [Axis; 3],
    /// Grains by cell.
    grains: Vec<u32>,
    /// Which of `grains` are in a cell.
    ranges: FxHashMap<[i64; 3], Range<usize>>,
}

/// How one coordinate is divided.
#[derive(Clone, Copy)]
struct Axis {
    /// Where cell 0 begins, m.
    origin: f64,
    /// Cells per metre.
    density: f64,
    /// Cells in a period; none without one.
    period: Option<i64>,
}

impl Axis {
    fn new(domain: &Domain, axis: usize, reach: f64) -> Self {
        let width = reach * (1.0 + CELL_MARGIN);
        if domain.periodic && !(domain.planar && axis == 1) {
            let length = domain.extent()[axis];
            let count = (length / width).floor().max(1.0);
            Self { origin: domain.min[axis], density: count / length, period: Some(count as i64) }
        } else {
            Self { origin: 0.0, density: 1.0 / width, period: None }
        }
    }

    fn cell(self, coordinate: f64) -> i64 {
        self.wrap(((coordinate - self.origin) * self.density).floor() as i64)
    }

    fn wrap(self, cell: i64) -> i64 {
        self.period.map_or(cell, |period| cell.rem_euclid(period))
    }

    /// The cells next to a cell and itself, each once.
    fn around(self, cell: i64) -> impl Iterator<Item = i64> + Clone {
        let steps = match self.period {
            Some(1) => 0..=0,
            Some(2) => 0..=1,
            _ => -1..=1,
        };
        steps.map(move |step| self.wrap(cell.wrapping_add(step)))
    }
}

impl Cells {
    fn new(positions: &[Vector3<f64>], domain: &Domain, reach: f64) -> Self {
        let axes = [0, 1, 2].map(|axis| Axis::new(domain, axis, reach));
        let cell = |position: &Vector3<f64>| [0, 1, 2].map(|axis| axes[axis].cell(position[axis]));
        let mut sorted: Vec<([i64; 3], u32)> = positions.iter().map(cell).zip(0..).collect();
        sorted.par_sort_unstable();
        let mut ranges = FxHashMap::default();
        let mut start = 0;
        for grains in sorted.chunk_by(|one, next| one.0 == next.0) {
            ranges.insert(grains[0].0, start..start + grains.len());
            start += grains.len();
        }
        Self { axes, grains: sorted.into_iter().map(|(_, grain)| grain).collect(), ranges }
    }

    /// Grains within `reach` (m) of a grain, in rising order.
    fn near(&self, grain: usize, positions: &[Vector3<f64>], domain: &Domain, reach: f64) -> Vec<u32> {
        let place = positions[grain];
        let [x, y, z] = [0, 1, 2].map(|axis| self.axes[axis].around(self.axes[axis].cell(place[axis])));
        let cells = x.flat_map(|x| y.clone().map(move |y| (x, y))).flat_map(|(x, y)| z.clone().map(move |z| [x, y, z]));
        let others = cells.filter_map(|cell| self.ranges.get(&cell)).flat_map(|range| &self.grains[range.clone()]);
        let within = |other: &u32| {
            let apart = domain.nearest(positions[*other as usize] - place);
            *other as usize != grain && apart.norm_squared() <= reach * reach
        };
        let mut near: Vec<u32> = others.copied().filter(within).collect();
        near.sort_unstable();
        near
    }
}
