//! Groups of grains that are far apart, taken together.

mod acceptance;
mod branch;
mod cell;
mod expansion;
mod indices;
mod interact;
mod meeting;

use nalgebra::Vector3;
use rayon::iter::{IndexedParallelIterator as _, IntoParallelIterator as _, IntoParallelRefMutIterator as _};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};

use self::acceptance::Acceptance;
use self::branch::Branch;
use self::cell::{Grain, halve};
use self::indices::Indices;
use self::interact::MAX_ORDER;
use self::meeting::{Meeting, Quantity, worth};
use super::Bound;
use super::direct::{aside, strength};
use super::tournament::tournament;
use crate::law::NearField;

/// Grains in a branch, at least: then there is more in a branch than there is to do for it.
const BRANCH: usize = 512;

/// Branches, at most: 2016 meetings of two, which is plenty to share out.
const BRANCHES: usize = 64;

/// How much of their radii cells are taken to fill ([`Acceptance`]) where the error is measured, tried one after the other; if none will do, the
/// strict bound is left. With 0.7 the largest error of any grain in the sets of `tests/near_field/tree.rs` was 0.57 times the tolerance, with 0.65 much the
/// same, with 0.6 it was 1.3 times at a grain that the sample did not show (docs/near-field.md).
const FILLINGS: [f64; 2] = [0.7, 0.8];

/// Grains at which the error of each sum is measured.
const SAMPLE: usize = 64;

/// How many times less than the tolerance the measured error must be: others have larger errors than those that are looked at.
const MARGIN: f64 = 4.0;

/// The sum by a tree.
///
/// Grains are halved into cells of some dozens. Cells that are far apart act on each other by way of Taylor expansions of the
/// potential about both centres (Dehnen 2002), of the lowest order that keeps the error within the tolerance ([`Acceptance`]);
/// grains of cells that are close, pair by pair. Both act both ways, so that momentum is kept to round-off.
///
/// The upper cells are branches, which meet as blocks do in the direct sum: their number depends on that of the grains only.
#[derive(Clone, Debug)]
pub(super) struct TreeSum {
    /// Up to the highest order that is used for the latest number of grains.
    indices: Indices,
    tolerance: f64,
    /// Those that are tried, one after the other, until the measured error is small enough.
    tried: Vec<Acceptance>,
    /// What needs no measurement.
    strict: Acceptance,
}

/// What all branches share.
pub(super) struct Setup<'a> {
    law: &'a NearField,
    indices: &'a Indices,
    /// Pairs of grains that cost as much as an expansion, by order.
    worth: [f64; MAX_ORDER + 1],
    /// Those of the lowest order.
    least_pairs: f64,
}

impl Setup<'_> {
    fn highest_order(&self) -> usize {
        self.indices.degree
    }
}

impl TreeSum {
    pub(super) fn new(law: &NearField, tolerance: f64, bound: Bound) -> Self {
        let acceptance = |filling| Acceptance::new(law, tolerance, filling);
        let tried = match bound {
            Bound::Measured => FILLINGS.map(acceptance).to_vec(),
            Bound::Proven => Vec::new(),
        };
        Self { indices: Indices::up_to(0), tolerance, tried, strict: acceptance(1.0) }
    }

    /// Forces on all grains, N.
    pub(super) fn forces(
        &mut self,
        law: &NearField,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
        out: &mut [Vector3<f64>],
    ) {
        self.suit(positions.len());
        let setup = self.setup(law);
        let mut branches = Self::branches(&setup, positions, strengths);
        let good = self.tried.iter().any(|acceptance| {
            Self::work_out_forces(&setup, acceptance, &mut branches);
            Self::sampled_error(law, &branches) <= self.tolerance / MARGIN
        });
        if !good {
            Self::work_out_forces(&setup, &self.strict, &mut branches);
        }
        for branch in &branches {
            for (place, &grain) in branch.indices.iter().enumerate() {
                out[grain as usize] = branch.grains.force(place);
            }
        }
    }

    /// Potential energy of all pairs, J; always with the strict bound.
    pub(super) fn potential_energy(
        &mut self,
        law: &NearField,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
    ) -> f64 {
        self.suit(positions.len());
        let setup = self.setup(law);
        let mut branches = Self::branches(&setup, positions, strengths);
        Self::meet_all(&setup, &self.strict, Quantity::Energy, &mut branches);
        branches.par_iter_mut().for_each(|branch| branch.add_far_energy(&setup));
        branches.iter().map(|branch| branch.energy).sum()
    }

    /// Works out the forces anew.
    fn work_out_forces(setup: &Setup<'_>, acceptance: &Acceptance, branches: &mut Vec<Branch>) {
        branches.par_iter_mut().for_each(Branch::clear);
        Self::meet_all(setup, acceptance, Quantity::Forces, branches);
        branches.par_iter_mut().for_each(|branch| branch.add_far_forces(setup));
    }

    /// Prepares for so many grains.
    fn suit(&mut self, grains: usize) {
        let highest = highest_order(self.tolerance, grains);
        if self.indices.degree != highest {
            self.indices = Indices::up_to(highest);
        }
    }

    fn setup<'a>(&'a self, law: &'a NearField) -> Setup<'a> {
        let worth = std::array::from_fn(worth);
        Setup { law, indices: &self.indices, least_pairs: worth[1], worth }
    }

    /// The upper cells.
    fn branches(setup: &Setup<'_>, positions: &[Vector3<f64>], strengths: Option<&[f64]>) -> Vec<Branch> {
        let grain = |(index, place): (usize, &Vector3<f64>)| Grain {
            place: *place,
            strength: strength(strengths, index),
            index: index as u32,
        };
        let mut grains: Vec<Grain> = positions.iter().enumerate().map(grain).collect();
        if grains.is_empty() {
            return Vec::new();
        }
        let mut parts: Vec<&mut [Grain]> = vec![&mut grains];
        while parts.len() < BRANCHES && positions.len() >= 2 * BRANCH * parts.len() {
            parts = parts.into_iter().flat_map(halve).collect();
        }
        let aside = aside(positions);
        let mut branches: Vec<Branch> = parts.into_par_iter().map(|part| Branch::new(setup, part, aside)).collect();
        let outlines: Vec<_> = branches.par_iter().map(Branch::outline).collect();
        branches.par_iter_mut().enumerate().for_each(|(own, branch)| {
            branch.find_mean_contributions(setup, own, &outlines);
        });
        branches
    }

    /// The largest error of the force, over the sum of the magnitudes of what contributes to it, of grains spread evenly over the
    /// cells.
    fn sampled_error(law: &NearField, branches: &[Branch]) -> f64 {
        let count: usize = branches.iter().map(|branch| branch.grains.count).sum();
        let places =
            branches.iter().enumerate().flat_map(|(own, branch)| (0..branch.grains.count).map(move |it| (own, it)));
        let sample: Vec<(usize, usize)> = places.step_by(count.div_ceil(SAMPLE).max(1)).collect();
        let error = |&(own, index): &(usize, usize)| {
            let block = &branches[own].grains;
            let parts = branches
                .iter()
                .enumerate()
                .map(|(other, branch)| branch.grains.force_on(law, block, index, own == other));
            let (force, magnitude) = parts.fold((Vector3::zeros(), 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
            (block.force(index) - force).norm() / magnitude
        };
        sample.par_iter().map(error).reduce(|| 0.0, f64::max)
    }

    fn meet_all(setup: &Setup<'_>, acceptance: &Acceptance, quantity: Quantity, branches: &mut Vec<Branch>) {
        branches.par_iter_mut().for_each(|branch| Meeting::within(setup, acceptance, quantity, branch));
        tournament(branches, |one, other| Meeting::between(setup, acceptance, quantity, one, other));
    }
}

/// Grains, log2, from which on orders rise above those that suit a tolerance.
const MANY: f64 = 14.0;

/// The highest order that is used for a tolerance and a number of grains.
///
/// Higher ones take in cells that are closer, which saves pairs of grains, the more the more neighbours there are; but they cost more for each pair of cells
/// and each grain. The formula fits the orders that were fastest from 4000 to 1 000 000 grains and from 1e-2 to 1e-8 (docs/near-field.md).
fn highest_order(tolerance: f64, grains: usize) -> usize {
    let digits = -tolerance.log10();
    let doublings = (grains.max(1) as f64).log2() - MANY;
    ((6.0 + 0.75 * (digits + doublings.max(0.0))).round() as usize).clamp(2, MAX_ORDER)
}
