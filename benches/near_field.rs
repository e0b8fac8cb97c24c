//! Sums of the near field: pairs a second of the direct sum, the tree against it and over the number of grains, and sums within a cut-off.
//!
//! `cargo bench --bench near_field`; everything runs in one thread. CPU times and ratios, measured in turns, come after each part.

mod support;

use std::hint::black_box;

use cpu_time::ThreadTime;
use criterion::{Criterion, criterion_group, criterion_main};
use impinge::law::{NearField, Term};
use impinge::near_field::{Bound, CutOff, ForceSum, Method};
use impinge_events::Domain;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use support::{Duel, duel, trial};

const ROUNDS: u32 = 5;
/// Bound of the relative error of the tree.
const TOLERANCE: f64 = 1e-4;
/// Grains at which the error is measured.
const SAMPLE: usize = 200;

/// The law with these exponents, balanced at 2 cm.
fn law([beta1, beta2]: [f64; 2]) -> NearField {
    let repulsion = Term { alpha: 0.02_f64.powf(beta2 - beta1), beta: beta2 };
    NearField::new(Term { alpha: 1.0, beta: beta1 }, repulsion).expect("a law")
}

fn open(betas: [f64; 2], method: Method) -> ForceSum {
    ForceSum::new(law(betas), method, &Domain::unbounded()).expect("it suits")
}

fn tree(bound: Bound) -> ForceSum {
    open([2.0, 3.0], Method::Tree { tolerance: TOLERANCE, bound })
}

/// Grains in a jet of the shape of the reference jets, 0.2 m × 0.2 m × 2.5 m.
fn jet(count: usize) -> Vec<Vector3<f64>> {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut below = |size: f64| random.random_range(0.0..size);
    (0..count).map(|_| Vector3::new(below(0.2), below(0.2), below(2.5))).collect()
}

/// Seven clusters of different sizes in a box of 6 m.
fn clusters(count: usize) -> Vec<Vector3<f64>> {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut below = |size: f64| Vector3::from([(); 3].map(|()| random.random_range(0.0..size)));
    let centres = [(); 7].map(|()| below(6.0));
    (0..count).map(|grain| centres[grain % 7] + below(0.05 * 1.6_f64.powi(grain as i32 % 7))).collect()
}

/// Sums all forces; gives the number of grains.
fn sum(way: &mut ForceSum, positions: &[Vector3<f64>], forces: &mut Vec<Vector3<f64>>) -> u64 {
    forces.resize(positions.len(), Vector3::zeros());
    way.forces(positions, None, forces).expect("finite forces");
    black_box(forces);
    positions.len() as u64
}

/// Two ways of summing in turns: CPU times per grain.
fn compare(positions: &[Vector3<f64>], [mut first, mut second]: [ForceSum; 2]) -> Duel {
    let mut forces = [Vec::new(), Vec::new()];
    let [on_first, on_second] = &mut forces;
    let rounds = if trial() { 1 } else { ROUNDS };
    duel(rounds, || sum(&mut first, positions, on_first), || sum(&mut second, positions, on_second))
}

/// Pairs a second of the direct sum.
fn direct(c: &mut Criterion) {
    let count = if trial() { 300 } else { 8000 };
    let positions = jet(count);
    eprintln!("\n{:42} {:>16}", "direct sum of one thread", "pairs a second");
    for betas in [[2.0, 3.0], [2.5, 4.0]] {
        let mut way = open(betas, Method::Direct);
        let mut forces = Vec::new();
        c.bench_function(&format!("direct/{count}/beta {betas:?}"), |b| {
            b.iter(|| sum(&mut way, &positions, &mut forces));
        });
        let start = ThreadTime::now();
        let rounds = if trial() { 1 } else { 10 };
        (0..rounds).for_each(|_| {
            sum(&mut way, &positions, &mut forces);
        });
        let pairs = f64::from(rounds) * (count * (count - 1) / 2) as f64;
        eprintln!("{:42} {:16.3e}", format!("beta = {betas:?}"), pairs / start.elapsed().as_secs_f64());
    }
}

/// The tree against the direct sum.
fn against_direct(_: &mut Criterion) {
    let counts: &[usize] = if trial() { &[300] } else { &[2000, 4000, 8000, 16000] };
    eprintln!(
        "\n{:42} {:>12} {:>12} {:>12} {:>12} {:>12}",
        "tree at 1e-4 against the direct sum", "direct", "tree", "direct/tree", "error/sum", "error/force"
    );
    for &count in counts {
        for (name, positions) in [("jet", jet(count)), ("clusters", clusters(count))] {
            for bound in [Bound::Proven, Bound::Measured] {
                let Duel { microseconds, ratio, .. } =
                    compare(&positions, [open([2.0, 3.0], Method::Direct), tree(bound)]);
                let error = tree(bound).measured_error(&positions, None, SAMPLE).expect("finite forces");
                eprintln!(
                    "{:42} {:9.3} µs {:9.3} µs {:12.2} {:12.1e} {:12.1e}",
                    format!("{name} of {count}, {bound:?}"),
                    microseconds[0],
                    microseconds[1],
                    1.0 / ratio,
                    error.of_contributions,
                    error.of_force
                );
            }
        }
    }
}

/// The cost of the tree over the number of grains.
fn growth(_: &mut Criterion) {
    let counts: &[usize] = if trial() { &[300] } else { &[16_000, 64_000, 256_000, 1_000_000] };
    eprintln!(
        "\n{:42} {:>12} {:>18} {:>12}",
        "tree at 1e-4: CPU time per grain", "tree", "over log2(grains)", "error/sum"
    );
    for bound in [Bound::Measured, Bound::Proven] {
        for &count in counts {
            let positions = jet(count);
            let mut way = tree(bound);
            let mut forces = Vec::new();
            let start = ThreadTime::now();
            sum(&mut way, &positions, &mut forces);
            let microseconds = start.elapsed().as_secs_f64() * 1e6 / count as f64;
            let error = way.measured_error(&positions, None, if count > 500_000 { 8 } else { SAMPLE });
            eprintln!(
                "{:42} {:9.3} µs {:15.4} µs {:12.1e}",
                format!("jet of {count}, {bound:?}"),
                microseconds,
                microseconds / (count as f64).log2(),
                error.expect("finite forces").of_contributions
            );
        }
    }
}

/// Sums within a cut-off, with lists that last and lists that are made each time, against the direct sum.
fn cut_off(c: &mut Criterion) {
    let count = if trial() { 300 } else { 8000 };
    let positions = jet(count);
    let method = |skin| Method::CutOff(CutOff { radius: 0.06, switch_width: 0.015, skin });
    let lasting = || open([2.0, 3.0], method(0.015));
    let mut way = lasting();
    let mut forces = Vec::new();
    c.bench_function(&format!("cut-off/{count}/lists that last"), |b| {
        b.iter(|| sum(&mut way, &positions, &mut forces));
    });
    let against_direct = compare(&positions, [lasting(), open([2.0, 3.0], Method::Direct)]);
    let mut old = lasting();
    let mut rounds = [Vec::new(), Vec::new()];
    let [on_old, on_new] = &mut rounds;
    let making = duel(
        if trial() { 1 } else { ROUNDS },
        || sum(&mut old, &positions, on_old),
        || sum(&mut lasting(), &positions, on_new),
    );
    eprintln!("\n{:42} {:>12} {:>12} {:>12}", "cut-off at 6 cm: CPU time per grain", "cut-off", "this", "this/cut-off");
    for (name, Duel { microseconds: [cut_off, this], ratio, .. }) in
        [("direct sum", against_direct), ("cut-off with new lists", making)]
    {
        eprintln!("{:42} {cut_off:9.3} µs {this:9.3} µs {ratio:12.2}", format!("jet of {count}, {name}"));
    }
}

/// Everything in one thread, on which CPU times are taken.
fn in_one_thread(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().expect("the first pool");
    [direct, against_direct, growth, cut_off].into_iter().for_each(|part| part(c));
}

criterion_group! { name = benches; config = support::criterion(); targets = in_one_thread }
criterion_main!(benches);
