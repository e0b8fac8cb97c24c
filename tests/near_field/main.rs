//! Sums of the near field: against sums in 60 digits, against closed forms, and against each other.

#[path = "../../events/tests/exact/mod.rs"]
mod exact;

mod cut_off;
mod direct;
mod law;
mod sets;
mod tree;

use impinge::law::NearField;
use impinge::near_field::{ForceSum, Method};
use impinge_events::Domain;
use nalgebra::Vector3;

/// A sum in a domain without sides.
fn open(law: NearField, method: Method) -> ForceSum {
    ForceSum::new(law, method, &Domain::unbounded()).expect("it suits")
}

/// The forces of all grains, N.
fn forces(sum: &mut ForceSum, positions: &[Vector3<f64>], strengths: Option<&[f64]>) -> Vec<Vector3<f64>> {
    let mut forces = vec![Vector3::zeros(); positions.len()];
    sum.forces(positions, strengths, &mut forces).expect("finite forces");
    forces
}

/// What `work` gives with this number of threads.
fn with_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads").install(work)
}

/// Forces and energy with 1, 2 and 3 threads must be equal bit for bit.
fn assert_threads_change_nothing(sum: &ForceSum, positions: &[Vector3<f64>], strengths: Option<&[f64]>) {
    let [one, two, three] = [1, 2, 3].map(|count| {
        let mut sum = sum.clone();
        with_threads(count, move || {
            let forces = forces(&mut sum, positions, strengths);
            (forces, sum.potential_energy(positions, strengths).expect("a finite energy"))
        })
    });
    assert_eq!(one, two);
    assert_eq!(one, three);
}

/// What rounding may leave of the sum of all forces, over the sum of their magnitudes.
const MOMENTUM: f64 = 1e-14;

/// To each force there is a reaction.
fn assert_momentum_is_kept(forces: &[Vector3<f64>]) {
    let sum: Vector3<f64> = forces.iter().sum();
    let magnitudes: f64 = forces.iter().map(Vector3::norm).sum();
    assert!(sum.norm() <= MOMENTUM * magnitudes, "{sum} of {magnitudes}");
}
