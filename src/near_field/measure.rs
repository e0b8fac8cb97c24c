//! How far a sum is from the sum of all pairs.

use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use super::direct::strength;
use super::{ForceSum, Singular};

/// The errors of a sum of forces against the plain sum over all pairs, the largest of some grains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredError {
    /// Number of grains that were looked at.
    pub grains: usize,
    /// Error over the sum of the magnitudes of all contributions to the force.
    pub of_contributions: f64,
    /// Error over the force itself, which is less: contributions cancel.
    pub of_force: f64,
}

impl ForceSum {
    /// Measures the error of [`forces`](Self::forces) at up to `sample` grains, evenly spread over their numbers, for the summary of a run.
    ///
    /// It is measured against the sum of [`pair_force`](Self::pair_force) over all pairs: with a cut-off, what lies beyond is no error.
    /// Each grain of the sample costs a pass over all grains.
    ///
    /// # Errors
    ///
    /// As [`forces`](Self::forces).
    ///
    /// # Panics
    ///
    /// When there are not as many strengths as positions.
    pub fn measured_error(
        &mut self,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
        sample: usize,
    ) -> Result<MeasuredError, Singular> {
        let mut forces = vec![Vector3::zeros(); positions.len()];
        self.forces(positions, strengths, &mut forces)?;
        let grains = sample.min(positions.len());
        let of_grain = |index: usize| {
            let grain = index * positions.len() / grains;
            let (force, magnitude) = self.plain_sum(positions, strengths, grain);
            let error = (forces[grain] - force).norm();
            MeasuredError { grains, of_contributions: share(error, magnitude), of_force: share(error, force.norm()) }
        };
        Ok((0..grains).into_par_iter().map(of_grain).reduce(MeasuredError::default, MeasuredError::larger))
    }

    /// Force on a grain and the sum of the magnitudes of what contributes to it, both N, by a plain loop.
    fn plain_sum(&self, positions: &[Vector3<f64>], strengths: Option<&[f64]>, grain: usize) -> (Vector3<f64>, f64) {
        let own = strength(strengths, grain);
        let mut force = Vector3::zeros();
        let mut magnitude = 0.0;
        for (other, position) in positions.iter().enumerate().filter(|(other, _)| *other != grain) {
            let apart = position - positions[grain];
            let weight = own * strength(strengths, other);
            force += weight * self.pair_force(apart);
            magnitude += weight.abs() * self.law().magnitude(apart.norm());
        }
        (force, magnitude)
    }
}

impl MeasuredError {
    fn larger(self, other: Self) -> Self {
        Self {
            grains: self.grains.max(other.grains),
            of_contributions: self.of_contributions.max(other.of_contributions),
            of_force: self.of_force.max(other.of_force),
        }
    }
}

/// `error` as a share of `whole`; nothing of nothing is none.
fn share(error: f64, whole: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / whole }
}
