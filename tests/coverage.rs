//! Error bars that are right: on synthetic data whose truth is known, intervals of one and of two standard errors hold it as often as Student's t says.

use impinge::estimate::Estimate;
use impinge::grains::{Grain, Snapshot};
use impinge::observe::measure::{Outflow, Patches, Profile, Quantity, SurfaceStress, Window};
use impinge::scene::{Boundary, Domain, PatchGrid, Side};
use impinge::scheme::{Observer, Passage, SurfaceHit};
use impinge_events::Flight;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Exp1, Poisson, StandardNormal};
use rand_pcg::Pcg64Mcg;

const TRIALS: u64 = 4000;
/// Parts of the normal distribution within one standard deviation, and within 1.96.
const WITHIN: [f64; 2] = [1.0, 1.96];

/// How often the truth is within so many standard errors.
fn coverage(mut trial: impl FnMut(&mut Pcg64Mcg) -> (Estimate, f64)) -> [f64; 2] {
    let mut dice = Pcg64Mcg::seed_from_u64(20);
    let mut held = [0_u32; 2];
    for _ in 0..TRIALS {
        let (estimate, truth) = trial(&mut dice);
        for (held, within) in held.iter_mut().zip(WITHIN) {
            *held += u32::from((estimate.value - truth).abs() <= within * estimate.error);
        }
    }
    held.map(|held| f64::from(held) / TRIALS as f64)
}

/// How often Student's t of so many degrees of freedom is within a distance of 0: with t = √ν tan φ, ∫ cos^(ν - 1) φ dφ over its share of the
/// quarter circle.
fn student(freedom: usize, within: f64) -> f64 {
    const STEPS: u32 = 10_000;
    let part = |end: f64| {
        let middle = |step: u32| (f64::from(step) + 0.5) * end / f64::from(STEPS);
        (0..STEPS).map(|step| middle(step).cos().powi(freedom as i32 - 1)).sum::<f64>() * end
    };
    part((within / (freedom as f64).sqrt()).atan()) / part(std::f64::consts::FRAC_PI_2)
}

#[test]
fn student_is_as_in_tables() {
    for (freedom, within, expected) in [(1, 1.0, 0.5), (4, 2.776, 0.95), (9, 2.262, 0.95), (100, 1.984, 0.95)] {
        approx::assert_abs_diff_eq!(student(freedom, within), expected, epsilon = 1e-4);
    }
}

/// Checks a coverage against Student's t of so many batches: within four standard deviations of the count, and `bias` for what the estimate itself is off.
fn check(name: &str, found: [f64; 2], batches: usize, bias: f64) {
    for (found, within) in found.into_iter().zip(WITHIN) {
        let expected = student(batches - 1, within);
        let allowed = 4.0 * (expected * (1.0 - expected) / TRIALS as f64).sqrt() + bias;
        assert!(
            (found - expected).abs() < allowed,
            "{name}: {found} of intervals of {within}, expected {expected:.4} ± {allowed:.4}"
        );
    }
}

fn normal(dice: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(dice)
}

#[test]
fn a_mean_is_as_sure_as_it_says_with_few_and_with_many_samples() {
    for batches in [5, 10, 100] {
        let found = coverage(|dice| {
            let samples: Vec<f64> = (0..batches).map(|_| 3.0 + 2.0 * normal(dice)).collect();
            (Estimate::mean(&samples), 3.0)
        });
        check("mean", found, batches, 0.0);
    }
    // With a hundred samples that is 68 and 95 per cent; dividing by n instead of √(n (n - 1)), as Arbelaez et al. (2009), eq. (53), print, is too
    // sure with few.
    let printed = coverage(|dice| {
        let samples: Vec<f64> = (0..3).map(|_| normal(dice)).collect();
        let Estimate { value, error } = Estimate::mean(&samples);
        (Estimate { value, error: error * (2.0_f64 / 3.0).sqrt() }, 0.0)
    });
    assert!(printed[0] < student(2, 1.0) - 0.05, "{printed:?}");
}

#[test]
fn batches_of_a_series_with_memory_are_as_sure_as_they_say() {
    // An autoregressive series of memory 10 steps: batches of 400 are nearly independent, single steps are not.
    let series = |dice: &mut Pcg64Mcg| {
        let keep: f64 = 0.9;
        let mut x = normal(dice);
        let mut step = || {
            x = keep * x + (1.0 - keep * keep).sqrt() * normal(dice);
            x
        };
        (0..4000).map(|_| step()).collect::<Vec<f64>>()
    };
    let found = coverage(|dice| (Estimate::batch_mean(&series(dice), 10), 0.0));
    // Neighbouring batches still share 1/80 of their variance.
    check("series", found, 10, 0.01);
    let naive = coverage(|dice| (Estimate::mean(&series(dice)), 0.0));
    assert!(naive[0] < 0.3, "a series is not as sure as its length: {naive:?}");
}

#[test]
fn ratios_and_what_the_jackknife_knows_are_as_sure_as_they_say() {
    let pairs = |dice: &mut Pcg64Mcg| {
        let pair = |_| {
            let common = 10.0 + normal(dice);
            (2.0 * common + 0.5 * normal(dice), common)
        };
        (0..20).map(pair).collect::<Vec<(f64, f64)>>()
    };
    check("ratio", coverage(|dice| (Estimate::ratio(&pairs(dice)), 2.0)), 20, 0.005);
    let jackknife = |pairs: &[(f64, f64)]| {
        Estimate::jackknife(pairs.len(), |without| {
            let kept = || pairs.iter().enumerate().filter(|(index, _)| Some(*index) != without).map(|(_, pair)| pair);
            kept().map(|pair| pair.0).sum::<f64>() / kept().map(|pair| pair.1).sum::<f64>()
        })
    };
    check("jackknife", coverage(|dice| (jackknife(&pairs(dice)), 2.0)), 20, 0.005);
}

#[test]
fn stress_of_hits_that_come_at_random_is_as_sure_as_it_says() {
    let grid = PatchGrid {
        centre: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        along: [1.0, 0.0, 0.0],
        size: [1.0, 1.0],
        cells: [2, 1],
        within: None,
    };
    let window = Window { from: 0.0, until: 1.0, batches: 10 };
    let hits = Poisson::new(400.0).expect("a mean above 0");
    let hit = |dice: &mut Pcg64Mcg| SurfaceHit {
        mass: 1.0,
        radius: 1e-3,
        time: dice.random(),
        id: 0,
        element: 0,
        position: Vector3::new(dice.random_range(-0.5..0.5), dice.random_range(-0.5..0.5), 0.0),
        normal: Vector3::z(),
        order: 1,
        // Of mean 1 and of mean 0.3.
        impulse_normal: Exp1.sample(dice),
        impulse_tangential: Vector3::new(-0.6 * dice.random::<f64>(), 0.0, 0.0),
        approach_speed: 0.0,
        energy_normal: 0.0,
        energy_tangential: 0.0,
        energy_spin: 0.0,
        dissipated: 0.0,
        withheld: 0.0,
        work: 0.0,
        overlap_over_radius: 0.0,
    };
    let measured = |dice: &mut Pcg64Mcg| {
        let mut stress = SurfaceStress::over(Patches::grid(&grid, None, false), window);
        let count: f64 = hits.sample(dice);
        (0..count as u64).for_each(|_| stress.surface_hit(&hit(dice)));
        stress.sample(&Snapshot { time: 1.0, flights: &[], grains: &[] });
        stress
    };
    check("normal", coverage(|dice| (measured(dice).stress(1).normal, 400.0)), 10, 0.01);
    check("shear", coverage(|dice| (measured(dice).stress(0).shear, 120.0)), 10, 0.01);
    // Shear over pressure of both patches together: no mean, but the jackknife knows.
    let ratio = |dice: &mut Pcg64Mcg| {
        let stress = measured(dice);
        (stress.derived(|patches| (patches[0].shear + patches[1].shear) / (patches[0].normal + patches[1].normal)), 0.3)
    };
    check("shear over pressure", coverage(ratio), 10, 0.015);
}

#[test]
fn moments_of_an_outflow_are_as_sure_as_they_say() {
    let domain = Domain { min: [-1.0, -1.0, 0.0], max: [1.0, 1.0, 50.0], boundary: Boundary::Open, planar: false };
    let profile = Profile { sides: vec![Side::XMax], base: 0.0, length: 2.0, top: 50.0, cells: 10 };
    let window = Window { from: 0.0, until: 1.0, batches: 20 };
    let grains = Poisson::new(2000.0).expect("a mean above 0");
    let grain = Grain { id: 0, mass: 0.5, spin: Vector3::zeros(), hits: 1, strength: 1.0 };
    // Heights are exponential of mean one length: centroid 1, spread 1, skewness 2; speeds even up to 8.
    let measured = |dice: &mut Pcg64Mcg| {
        let mut outflow = Outflow::over(profile.clone(), domain.clone(), window);
        let count: f64 = grains.sample(dice);
        for _ in 0..count as u64 {
            let height: f64 = Exp1.sample(dice);
            let flight = Flight {
                position: Vector3::new(1.0, 0.0, 2.0 * height),
                time: 0.0,
                velocity: Vector3::new(8.0 * dice.random::<f64>(), 0.0, 1.0),
                radius: 0.01,
            };
            outflow.passage(Passage::Left, dice.random(), &flight, &grain);
        }
        outflow.sample(&Snapshot { time: 1.0, flights: &[], grains: &[] });
        outflow.moments(Quantity::Momentum)
    };
    check("resultant", coverage(|dice| (measured(dice).resultant, 4000.0)), 20, 0.01);
    check("centroid", coverage(|dice| (measured(dice).centroid, 1.0)), 20, 0.01);
    check("spread", coverage(|dice| (measured(dice).spread, 1.0)), 20, 0.03);
    // Of a long tail: with two thousand grains its estimate is itself low by a part of its error.
    check("skewness", coverage(|dice| (measured(dice).skewness, 2.0)), 20, 0.08);
}
