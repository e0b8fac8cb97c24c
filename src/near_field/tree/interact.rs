//! What two distant cells do to each other.

use multiversion::multiversion;

use super::indices::Indices;
use crate::law::near_field::with_radial;
use crate::law::{NearField, Term};
use crate::near_field::block::{LANES, Lanes};

/// Eight pairs of cells that act on each other to the same order, worked on together.
#[derive(Clone, Debug, Default)]
pub(super) struct Octet {
    /// Difference of the centres of the first and the second cell of each pair, m, by axis.
    pub(super) apart: [Lanes; 3],
    /// Moments of the first cells, then the potentials about their centres.
    pub(super) first: Vec<Lanes>,
    /// The same of the second ones.
    pub(super) second: Vec<Lanes>,
    derivatives: Vec<Lanes>,
    potentials: [Vec<Lanes>; 2],
}

impl Octet {
    pub(super) fn new(indices: &Indices) -> Self {
        let lanes = || vec![[0.0; LANES]; indices.len()];
        Self {
            apart: [[0.0; LANES]; 3],
            first: lanes(),
            second: lanes(),
            derivatives: lanes(),
            potentials: [lanes(), lanes()],
        }
    }

    /// Turns the moments of each cell into the potential about the centre of its partner.
    ///
    /// With D_n the derivatives of the potential at the difference of the centres, of order |n| = |k + l| ≤ `order`: L_l = Σ (−1)^|k| D_(k+l) M_k.
    /// The same D act both ways and are cut off at the same order, so that action and reaction cancel to round-off.
    pub(super) fn exchange(&mut self, law: &NearField, indices: &Indices, order: usize) {
        let count = indices.counts[order];
        let mut radial = [[0.0; LANES]; MAX_ORDER + 1];
        radial_derivatives(law, self.apart, &mut radial[..=order]);
        derivatives(indices, self.apart, &radial[..=order], &mut self.derivatives[..count]);
        flip_odd(indices, &mut self.second[..count]);
        let [on_first, on_second] = &mut self.potentials;
        contract(indices, order, &self.derivatives, [&self.first, &self.second], [on_first, on_second]);
        flip_odd(indices, &mut self.potentials[1][..count]);
        self.first[..count].copy_from_slice(&self.potentials[0][..count]);
        self.second[..count].copy_from_slice(&self.potentials[1][..count]);
    }
}

/// The highest order of an expansion: what a million grains want at a tolerance of 1e-8.
pub(super) const MAX_ORDER: usize = 18;

/// g_m = (1/r d/dr)^m of the potential, for eight distances.
///
/// g_1 is force over distance; of a term alpha r^-(beta + 1) there each further one is −(beta + 2m − 1) / r² times the last.
fn radial_derivatives(law: &NearField, apart: [Lanes; 3], radial: &mut [Lanes]) {
    let [attraction, repulsion] = [law.attraction(), law.repulsion()].map(|term: Term| term.beta);
    for lane in 0..LANES {
        let r2 = (0..3).map(|axis| apart[axis][lane] * apart[axis][lane]).sum::<f64>();
        let (mut terms, potential) = with_radial!(law, form => {
            (crate::law::near_field::Radial::terms(form, r2), law.potential_at(form, r2))
        });
        radial[0][lane] = potential;
        for (m, radial) in radial.iter_mut().enumerate().skip(1) {
            radial[lane] = terms[0] - terms[1];
            let slope = (2 * m) as f64 - 1.0;
            terms = [-(attraction + slope) / r2 * terms[0], -(repulsion + slope) / r2 * terms[1]];
        }
    }
}

/// The derivatives D_k of the potential.
///
/// With R_0^m = g_m: R_(k+1)^m = x R_k^(m+1) + k R_(k−1)^(m+1) along each axis, and D_k = R_k^0 (McMurchie & Davidson 1978, eq. 4.6 to 4.8, where
/// it is done for 1/r; it holds for any function of r).
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn derivatives(indices: &Indices, apart: [Lanes; 3], radial: &[Lanes], derivatives: &mut [Lanes]) {
    let order = radial.len() - 1;
    for m in (0..=order).rev() {
        // From the highest down: the lower ones are still those of m + 1.
        for index in (1..indices.counts[order - m]).rev() {
            let step = indices.steps[index];
            let (lower, lowest) = (derivatives[step.lower], derivatives[step.lowest]);
            let (coordinate, factor) = (&apart[step.axis], step.exponent - 1.0);
            for lane in 0..LANES {
                derivatives[index][lane] = coordinate[lane] * lower[lane] + factor * lowest[lane];
            }
        }
        derivatives[0] = radial[m];
    }
}

/// Changes the sign of what is of odd degree.
fn flip_odd(indices: &Indices, coefficients: &mut [Lanes]) {
    for (coefficients, degree) in coefficients.iter_mut().zip(&indices.degrees) {
        if degree % 2 == 1 {
            *coefficients = coefficients.map(|coefficient| -coefficient);
        }
    }
}

/// Σ D_(k+l) M_k for all l, both ways: the potentials on the first cells come from the moments of the second ones.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn contract(
    indices: &Indices,
    order: usize,
    derivatives: &[Lanes],
    [first, second]: [&[Lanes]; 2],
    [on_first, on_second]: [&mut [Lanes]; 2],
) {
    for l in 0..indices.counts[order] {
        let count = indices.counts[order - indices.degrees[l]];
        let mut sums = [[0.0; LANES]; 2];
        for ((&sum, first), second) in indices.sums[l][..count].iter().zip(first).zip(second) {
            let derivative = &derivatives[usize::from(sum)];
            for lane in 0..LANES {
                sums[0][lane] += derivative[lane] * second[lane];
                sums[1][lane] += derivative[lane] * first[lane];
            }
        }
        on_first[l] = sums[0];
        on_second[l] = sums[1];
    }
}
