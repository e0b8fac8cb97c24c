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
/// Clusters of very different sizes, far apart from each other.
pub(crate) fn clusters(count: usize, seed: u64) -> Vec<Vector3<f64>> {
    let mut random = random(seed);
    let centres: Vec<_> = (0..7).map(|_| Vector3::from([(); 3].map(|()| random.random_range(-3.0..3.0)))).collect();
    let radii: Vec<f64> = (0..7).map(|_| 10.0_f64.powf(random.random_range(-1.5..0.0))).collect();
    (0..count)
        .map(|grain| {
            let within = Vector3::from([(); 3].map(|()| random.random_range(-1.0..1.0)));
            centres[grain % 7] + within * radii[grain % 7] * random.random_range(0.1_f64..1.0)
        })
        .collect()
}

/// The reference jet of 8000 grains: a box of 0.2 m × 0.2 m × 2.5 m.
pub(crate) fn jet() -> Vec<Vector3<f64>> {
    let table = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/jet_8000.csv");
    let mut reader = csv::Reader::from_path(table).expect("the reference jet");
    let rows = reader.deserialize::<[f64; 6]>().map(|row| row.expect("six numbers"));
    rows.map(|[x, y, z, ..]| Vector3::new(x, y, z)).collect()
}

/// Grains one behind the other: every one is where it hurts an expansion most.
pub(crate) fn line(count: usize) -> Vec<Vector3<f64>> {
    (0..count).map(|grain| Vector3::new(0.0, 0.0, 0.02 * grain as f64)).collect()
}

/// Tight pairs of clumps, far from each other: grains only at the rims of cells.
pub(crate) fn dumbbells(count: usize, seed: u64) -> Vec<Vector3<f64>> {
    let mut random = random(seed);
    (0..count)
        .map(|grain| {
            let end = Vector3::new((grain % 40 / 20) as f64, 0.0, (grain / 40) as f64 * 4.0);
            end + Vector3::from([(); 3].map(|()| random.random_range(-0.02..0.02)))
        })
        .collect()
}
