//! Expansions about the centres of cells, and how they are moved.
//!
//! With δ the place of a source relative to the centre of its cell, its moments are M_k = Σ s δ^k / k!. With δ the place of a target,
//! the potential there is Σ L_l δ^l / l!. (k and l are triples of exponents.)

use multiversion::multiversion;

use super::indices::Indices;
use crate::near_field::block::{LANES, Lanes, total};

/// δ^k / k! for eight grains, up to the degree that `powers` has room for.
#[inline(always)]
fn powers(indices: &Indices, apart: [Lanes; 3], powers: &mut [Lanes]) {
    powers[0] = [1.0; LANES];
    for index in 1..powers.len() {
        let step = indices.steps[index];
        let (lower, factor) = (powers[step.lower], 1.0 / step.exponent);
        for lane in 0..LANES {
            powers[index][lane] = lower[lane] * (apart[step.axis][lane] * factor);
        }
    }
}

/// Places relative to `centre` (m).
#[inline(always)]
fn relative(places: [&Lanes; 3], centre: [f64; 3]) -> [Lanes; 3] {
    [0, 1, 2].map(|axis| places[axis].map(|coordinate| coordinate - centre[axis]))
}

/// Grains of a leaf: their places (m) by axis and strengths.
#[derive(Clone, Copy)]
pub(super) struct Leaf<'a> {
    pub(super) places: [&'a [Lanes]; 3],
    pub(super) strengths: &'a [Lanes],
    pub(super) centre: [f64; 3],
}

/// Adds the moments of the grains of a leaf; `scratch` is as long as there are moments.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_moments(indices: &Indices, leaf: Leaf<'_>, scratch: &mut [Lanes], moments: &mut [f64]) {
    let [x, y, z] = leaf.places;
    for chunk in 0..leaf.strengths.len() {
        powers(indices, relative([&x[chunk], &y[chunk], &z[chunk]], leaf.centre), scratch);
        let strengths = &leaf.strengths[chunk];
        for (moment, power) in moments.iter_mut().zip(scratch.iter()) {
            let mut parts = [0.0; LANES];
            for lane in 0..LANES {
                parts[lane] = power[lane] * strengths[lane];
            }
            *moment += total(&parts);
        }
    }
}

/// Adds the forces (N) of the potential `local` on the grains of a leaf.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn add_forces(
    indices: &Indices,
    leaf: Leaf<'_>,
    scratch: &mut [Lanes],
    local: &[f64],
    forces: [&mut [Lanes]; 3],
) {
    let [x, y, z] = leaf.places;
    let [on_x, on_y, on_z] = forces;
    let below = indices.higher[0].len();
    for chunk in 0..leaf.strengths.len() {
        powers(indices, relative([&x[chunk], &y[chunk], &z[chunk]], leaf.centre), &mut scratch[..below]);
        let strengths = &leaf.strengths[chunk];
        for (force, higher) in [&mut on_x[chunk], &mut on_y[chunk], &mut on_z[chunk]].into_iter().zip(&indices.higher) {
            let mut slope = [0.0; LANES];
            for (power, &higher) in scratch.iter().zip(higher) {
                let coefficient = local[higher];
                for lane in 0..LANES {
                    slope[lane] += power[lane] * coefficient;
                }
            }
            for lane in 0..LANES {
                force[lane] -= strengths[lane] * slope[lane];
            }
        }
    }
}

/// Energy (J) of the grains of a leaf in the potential `local`.
pub(super) fn energy(indices: &Indices, leaf: Leaf<'_>, scratch: &mut [Lanes], local: &[f64]) -> f64 {
    let [x, y, z] = leaf.places;
    let mut energy = [0.0; LANES];
    for chunk in 0..leaf.strengths.len() {
        powers(indices, relative([&x[chunk], &y[chunk], &z[chunk]], leaf.centre), scratch);
        for (power, coefficient) in scratch.iter().zip(local) {
            for lane in 0..LANES {
                energy[lane] += leaf.strengths[chunk][lane] * power[lane] * coefficient;
            }
        }
    }
    total(&energy)
}

/// Adds moments about the centre of a child to those about the centre of its parent, `by` (m) = child − parent.
pub(super) fn lift_moments(indices: &Indices, child: &[f64], by: [f64; 3], shifted: &mut Vec<f64>, parent: &mut [f64]) {
    shifted.clear();
    shifted.extend(child);
    for (axis, by) in by.into_iter().enumerate() {
        // (x + d)^k / k! = Σ x^(k − j) d^j / (j! (k − j)!), from the highest degree down, so that what is still needed is still there.
        for index in (1..shifted.len()).rev() {
            let mut source = indices.lower(index, axis);
            let mut factor = by;
            let mut count = 1.0;
            while let Some(lower) = source {
                shifted[index] += shifted[lower] * factor;
                count += 1.0;
                factor *= by / count;
                source = indices.lower(lower, axis);
            }
        }
    }
    parent.iter_mut().zip(shifted.iter()).for_each(|(parent, part)| *parent += part);
}

/// Adds a potential about the centre of a parent to that about the centre of its child, `by` (m) = child − parent.
pub(super) fn lower_potential(
    indices: &Indices,
    parent: &[f64],
    by: [f64; 3],
    shifted: &mut Vec<f64>,
    child: &mut [f64],
) {
    shifted.clear();
    shifted.extend(parent);
    for (axis, by) in by.into_iter().enumerate() {
        // The derivatives of a Taylor series: L_l + L_(l+1) d + L_(l+2) d²/2 + ..., from the lowest degree up.
        for index in 0..indices.higher[axis].len() {
            let mut source = index;
            let mut factor = 1.0;
            let mut count = 0.0;
            while let Some(&higher) = indices.higher[axis].get(source) {
                count += 1.0;
                factor *= by / count;
                shifted[index] += shifted[higher] * factor;
                source = higher;
            }
        }
    }
    child.iter_mut().zip(shifted.iter()).for_each(|(child, part)| *child += part);
}
