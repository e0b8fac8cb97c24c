//! Hard-sphere gases against theory: Carnahan & Starling (1969) for elastic grains, Haff (1983) for cooling ones.

mod common;

use std::f64::consts::PI;

use common::{gas, kinetic_energy, run, smooth, states};
use impinge::scheme::{EventDriven, GrainCollision, Observer};
use impinge_events::NoSurface;
use nalgebra::Vector3;

/// What N grains instead of infinitely many may change, relative, times N.
const FINITE: f64 = 4.4;
/// Contact distance of the grains of [`gas`], m; their mass is 1 kg.
const S: f64 = 1.0;

/// Pair correlation at contact (Carnahan & Starling).
fn chi(phi: f64) -> f64 {
    (1.0 - 0.5 * phi) / (1.0 - phi).powi(3)
}

/// Collisions of one grain per second at temperature `t` (m²/s²): w = 24 phi chi / √pi √(T/m) / s.
fn frequency(phi: f64, t: f64) -> f64 {
    24.0 * phi * chi(phi) / PI.sqrt() * t.sqrt() / S
}

/// Sums over collisions.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    collisions: u64,
    /// Σ r_ij · Δp = Σ s J_n, N s m.
    virial: f64,
}

impl Observer for Sums {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.collisions += 1;
        self.virial += S * collision.impulse_normal;
    }
}

/// Mean and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// How much is left of the lattice: |Σ exp(i k x)| / N with 2 pi / k the side of its cells.
fn order(positions: impl Iterator<Item = Vector3<f64>>, side: f64) -> f64 {
    let phases: Vec<f64> = positions.map(|r| 2.0 * PI / side * r.x).collect();
    phases.iter().map(|p| p.cos()).sum::<f64>().hypot(phases.iter().map(|p| p.sin()).sum()) / phases.len() as f64
}

/// An elastic gas of cells³ grains at packing fraction `phi`, for about `collisions` collisions after it has forgotten its lattice:
/// collision rate and compressibility over those of Carnahan & Starling, each with its standard error, and the drift of energy over
/// √(collisions).
///
/// The pressure is that of the virial theorem, PV = N T + Σ r_ij·Δp / (3 t) with Δp the momentum that a collision gives, so
/// Z = PV / (N T) = 1 + Σ s J_n / (3 N T t), and 3 (N - 1) T = Σ m v², because the total momentum is zero.
fn elastic(cells: u32, phi: f64, collisions: f64) -> [(f64, f64); 3] {
    let (grains, domain) = gas(cells, phi, 1);
    let n = grains.len() as f64;
    let energy = grains.iter().map(|grain| 0.5 * grain.mass() * grain.velocity.norm_squared()).sum::<f64>();
    let t = 2.0 * energy / (3.0 * (n - 1.0));
    let rate = 0.5 * n * frequency(phi, t);
    let z = 1.0 + 4.0 * phi * chi(phi);
    let mut scheme: EventDriven<_> = EventDriven::new(&grains, NoSurface, domain, smooth(1.0, 1.0), 0.0);
    let melted = 60.0 / frequency(phi, t);
    let mut sums = Sums::default();
    run(&mut scheme, melted, &mut sums).expect("no broken invariant");
    let left =
        order(states(&scheme, melted).iter().map(|(flight, _)| flight.position), domain.extent().x / f64::from(cells));
    assert!(left < 0.1, "phi = {phi}: {left} of the lattice is left");

    const BLOCKS: u32 = 25;
    let block = collisions / rate / f64::from(BLOCKS);
    let (mut rates, mut zs) = (Vec::new(), Vec::new());
    for k in 1..=BLOCKS {
        let before = sums;
        run(&mut scheme, melted + f64::from(k) * block, &mut sums).expect("no broken invariant");
        rates.push((sums.collisions - before.collisions) as f64 / block / rate);
        zs.push((1.0 + (sums.virial - before.virial) / (3.0 * n * t * block)) / z);
    }
    let drift = kinetic_energy(&states(&scheme, scheme.time())) / energy - 1.0;
    [mean(&rates), mean(&zs), (drift.abs() / (sums.collisions as f64).sqrt(), 0.0)]
}

/// Compressibility of Carnahan, Starling & Kolafa (Boublík & Nezbeda 1986), which is 0.3 % above Carnahan & Starling at phi = 0.3 and nearer
/// to the truth.
fn z_kolafa(phi: f64) -> f64 {
    (1.0 + phi + phi.powi(2) - 2.0 / 3.0 * phi.powi(3) * (1.0 + phi)) / (1.0 - phi).powi(3)
}

/// Rate within 1 % and Z within 0.5 % of Carnahan & Starling, both known well enough for that (three standard errors are less), and within
/// three standard errors of Carnahan, Starling & Kolafa, give or take [`FINITE`] / N.
fn assert_carnahan_starling(cells: u32, phi: f64, collisions: f64) {
    let [rate, z, drift] = elastic(cells, phi, collisions);
    eprintln!("phi = {phi}: rate {rate:?}, Z {z:?}, drift {:e}", drift.0);
    let z_simple = 1.0 + 4.0 * phi * chi(phi);
    let better = [(z_kolafa(phi) - 1.0) / (z_simple - 1.0), z_kolafa(phi) / z_simple];
    for ((what, (ratio, error), tolerance), better) in [("rate", rate, 0.01), ("Z", z, 0.005)].into_iter().zip(better) {
        assert!(
            (ratio - better).abs() < 3.0 * error + FINITE / f64::from(4 * cells.pow(3)),
            "phi = {phi}: {what} is {ratio} ± {error}, not {better}"
        );
        assert!((ratio - 1.0).abs() < tolerance, "phi = {phi}: {what} is {ratio} ± {error} of theory");
        assert!(3.0 * error < tolerance, "phi = {phi}: {what} is known to {error} only");
    }
    assert!(drift.0 < 1e-12, "phi = {phi}: energy drifts by {:e} √(collisions)", drift.0);
}

/// Hard case 16 in small.
#[test]
fn elastic_gas_agrees_with_carnahan_and_starling() {
    for phi in [0.1, 0.3, 0.49] {
        assert_carnahan_starling(13, phi, 2e6);
    }
}

/// Hard case 16 in the ordinary tests: 1e7 collisions at phi = 0.3.
#[test]
fn elastic_gas_agrees_with_carnahan_and_starling_over_1e7_collisions() {
    assert_carnahan_starling(13, 0.3, 1e7);
}

/// Hard case 16 in full. Found: rate 1.00283 ± 0.00004, Z 1.00199 ± 0.00004 of Carnahan & Starling (infinitely many grains after Kolafa: 1.00353,
/// 1.00264; the difference is 1.4 / N), energy drift 1.1e-14 √(collisions), 3.6e-10 in all; 38 minutes of processor time.
#[test]
#[ignore = "40 minutes: cargo test --release --test gas -- --ignored --nocapture over_1e9"]
fn elastic_gas_agrees_with_carnahan_and_starling_over_1e9_collisions() {
    // So few grains that they stay in the cache.
    assert_carnahan_starling(8, 0.3, 1e9);
}

/// Found (rate and Z over those of Carnahan & Starling, energy drift over √(collisions)):
/// phi = 0.1:  1.00070 ± 0.00011, 1.00022 ± 0.00004, 2.6e-16 (Kolafa: 1.00070, 1.00024);
/// phi = 0.3:  1.00356 ± 0.00013, 1.00266 ± 0.00011, 2.6e-16 (Kolafa: 1.00355, 1.00264);
/// phi = 0.49: 1.00139 ± 0.00028, 1.00122 ± 0.00025, 2.6e-16 (Kolafa: 1.00053, 1.00049).
#[test]
#[ignore = "about 5 minutes: cargo test --release --test gas -- --ignored --nocapture over_1e8"]
fn elastic_gas_agrees_with_carnahan_and_starling_over_1e8_collisions() {
    for phi in [0.1, 0.3, 0.49] {
        assert_carnahan_starling(16, phi, 3.4e7);
    }
}

/// Cools a gas of 216 grains from T0 to 1e-12 T0: ln(T / T0), collisions per grain, and the collisions that theory gives for the
/// temperatures on the way. In so small a box (10 diameters) grains do not cluster: shear modes grow above some 25.
fn cool(e: f64, phi: f64, seed: u64) -> (f64, f64, f64) {
    let (grains, domain) = gas(6, phi, seed);
    let n = grains.len() as f64;
    let mut scheme: EventDriven<_> = EventDriven::new(&grains, NoSurface, domain, smooth(e, e), 0.0);
    let mut sums = Sums::default();
    // First the lattice is forgotten.
    let mut time = 10.0;
    run(&mut scheme, time, &mut sums).expect("no broken invariant");
    let temperature = |scheme: &EventDriven<_>, time| 2.0 * kinetic_energy(&states(scheme, time)) / (3.0 * (n - 1.0));
    let (start, before) = (temperature(&scheme, time), sums.collisions);
    let (mut t, mut expected) = (start, 0.0);
    while t > 1e-12 * start {
        // √T = c / (time + t_H) between two looks.
        let step = 0.1 * time;
        run(&mut scheme, time + step, &mut sums).expect("no broken invariant");
        time += step;
        let (v, next) = (t.sqrt(), temperature(&scheme, time).sqrt());
        expected += frequency(phi, 1.0) * step * v * next / (v - next) * (v / next).ln();
        t = next * next;
    }
    ((t / start).ln(), 2.0 * (sums.collisions - before) as f64 / n, expected)
}

/// Hard case 17: dT/ds = -(1 - e²) T / 3 with s collisions per grain, times N / (N - 1) where the total momentum is zero. Between the first
/// and the last collision the gaps in time grow by 1e6; nothing underflows. Found: slope 0.993 ± 0.001 of it, as the velocities are not
/// quite Maxwell's.
#[test]
fn haff_cooling_over_twelve_decades() {
    let (e, n) = (0.9f64, 216.0);
    let runs: Vec<_> = (0..8).map(|seed| cool(e, 0.1, seed)).collect();
    let slopes: Vec<f64> = runs.iter().map(|(ln, s, _)| ln / s / (-(1.0 - e * e) / 3.0 * n / (n - 1.0))).collect();
    let counts: Vec<f64> = runs.iter().map(|(_, s, expected)| s / expected).collect();
    assert!((mean(&slopes).0 - 1.0).abs() < 0.02, "{:?} of Haff's slope", mean(&slopes));
    assert!((mean(&counts).0 - 1.0).abs() < 0.02, "{:?} of the collisions expected", mean(&counts));
    assert!(3.0 * mean(&slopes).1 < 0.02 && 3.0 * mean(&counts).1 < 0.02);
}
