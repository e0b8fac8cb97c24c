//! Sets of grains that sums are tried on.

use impinge::law::{NearField, Term};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// The law with these exponents, balanced at 2 cm: neither term is lost beside the other at the distances of the sets.
pub(crate) fn law(beta1: f64, beta2: f64) -> NearField {
    let attraction = Term { alpha: 1.0, beta: beta1 };
    let repulsion = Term { alpha: 0.02_f64.powf(beta2 - beta1), beta: beta2 };
    NearField::new(attraction, repulsion).expect("a law")
}

pub(crate) fn random(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}

/// Grains in a box with one corner at 0 (m).
pub(crate) fn in_box(count: usize, size: Vector3<f64>, seed: u64) -> Vec<Vector3<f64>> {
    let mut random = random(seed);
    let mut coordinate = |axis: usize| random.random_range(0.0..=size[axis]);
    (0..count).map(|_| Vector3::new(coordinate(0), coordinate(1), coordinate(2))).collect()
}

/// Strengths between 0.5 and 2, one in ten of them negative.
pub(crate) fn strengths(count: usize, seed: u64) -> Vec<f64> {
    let mut random = random(seed);
    (0..count).map(|_| random.random_range(0.5..2.0) * if random.random_bool(0.1) { -1.0 } else { 1.0 }).collect()
}
