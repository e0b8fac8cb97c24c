//! Cells of grains, halved until they are small.

use std::ops::Range;

use nalgebra::Vector3;

use super::interact::MAX_ORDER;
use crate::law::NearField;
use crate::near_field::block::LANES;

/// Grains in a leaf, at most: pairs of leaves are summed at nearly the full speed of the direct sum. Smaller ones save pairs, and cost as
/// much in expansions.
const LEAF: usize = 64;

/// A grain on its way into a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grain {
    /// m.
    pub(super) place: Vector3<f64>,
    pub(super) strength: f64,
    /// Its number outside.
    pub(super) index: u32,
}

/// Grains that are close to each other.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// Its grains: a range of chunks of [`LANES`] grains in the order of the branch.
    pub(super) chunks: Range<usize>,
    /// The two cells it is divided into; none of a leaf.
    pub(super) children: Option<[usize; 2]>,
    /// Centre of the box around its grains, about which it is expanded, m.
    pub(super) centre: Vector3<f64>,
    /// Distance of the furthest grain from the centre, m.
    pub(super) radius: f64,
    /// Sum of the magnitudes of the strengths.
    pub(super) weight: f64,
    /// Means of the powers of the distances from the centre, weighted with the strengths, m^k; 0 without any strength.
    pub(super) spreads: [f64; MAX_ORDER + 1],
    /// The least, over the grains in the cell and per unit of their strength, of the sums of the magnitudes of the contributions of all grains
    /// of the set, over the sum of the magnitudes of all strengths, N; a lower bound.
    pub(super) mean_contribution: f64,
}

impl Cell {
    /// A cell of these grains, which begin with the `first` chunk. Spreads are worked out up to `order`.
    fn new(grains: &[Grain], first: usize, order: usize) -> Self {
        let [lowest, highest] = box_around(grains);
        let centre = lowest + 0.5 * (highest - lowest);
        let mut spreads = [0.0; MAX_ORDER + 1];
        let mut radius = 0.0_f64;
        for grain in grains {
            let distance = (grain.place - centre).norm();
            radius = radius.max(distance);
            let mut power = grain.strength.abs();
            for spread in &mut spreads[..=order] {
                *spread += power;
                power *= distance;
            }
        }
        let weight = spreads[0];
        if weight > 0.0 {
            spreads.iter_mut().for_each(|spread| *spread /= weight);
        }
        let chunks = first..first + grains.len().div_ceil(LANES);
        Self { chunks, children: None, centre, radius, weight, spreads, mean_contribution: 0.0 }
    }

    /// Number of pairs of a grain here and one there, at most.
    pub(super) fn pairs_with(&self, other: &Self) -> usize {
        self.chunks.len() * other.chunks.len() * LANES * LANES
    }

    /// Sum of the magnitudes of what the grains of `source` contribute to the force on a grain anywhere in this cell, per unit of its
    /// strength, at least (N): forces fade with distance and are convex, so that their mean is at least that at the mean distance.
    pub(super) fn least_contribution(&self, law: &NearField, source: &Source) -> f64 {
        let furthest = (self.centre - source.centre).norm() + self.radius + source.mean_radius;
        source.weight * law.magnitude(furthest)
    }

    pub(super) fn as_source(&self) -> Source {
        Source { centre: self.centre, mean_radius: self.spreads[1], weight: self.weight }
    }
}

/// Grains as they are seen from afar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    centre: Vector3<f64>,
    mean_radius: f64,
    pub(super) weight: f64,
}

/// Lowest and highest corner of the box around grains, m.
fn box_around(grains: &[Grain]) -> [Vector3<f64>; 2] {
    let start = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
    grains.iter().fold(start, |[lowest, highest], grain| [lowest.inf(&grain.place), highest.sup(&grain.place)])
}

/// Halves `grains` across the longest side of the box around them; the lower half fills whole chunks.
pub(super) fn halve(grains: &mut [Grain]) -> [&mut [Grain]; 2] {
    let cell = Cell::new(grains, 0, 1);
    let reach = grains
        .iter()
        .fold(Vector3::zeros(), |reach: Vector3<f64>, grain| reach.sup(&(grain.place - cell.centre).abs()));
    let axis = reach.imax();
    let middle = (grains.len() / 2).next_multiple_of(LANES);
    grains.select_nth_unstable_by(middle, |one, other| {
        one.place[axis].total_cmp(&other.place[axis]).then(one.index.cmp(&other.index))
    });
    grains.split_at_mut(middle).into()
}

/// Divides `grains` into cells and sorts them so that the grains of each are next to each other. A cell comes before the cells
/// it is divided into.
pub(super) fn divide(grains: &mut [Grain], order: usize) -> Vec<Cell> {
    let mut cells = Vec::new();
    divide_from(grains, 0, order, &mut cells);
    cells
}

fn divide_from(grains: &mut [Grain], first: usize, order: usize, cells: &mut Vec<Cell>) -> usize {
    let index = cells.len();
    cells.push(Cell::new(grains, first, order));
    if grains.len() > LEAF {
        let [lower, upper] = halve(grains);
        let middle = first + lower.len() / LANES;
        let lower = divide_from(lower, first, order, cells);
        let upper = divide_from(upper, middle, order, cells);
        cells[index].children = Some([lower, upper]);
    }
    index
}
