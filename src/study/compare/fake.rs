//! A comparison of schemes that obey power laws, for the tests of what is made of comparisons.

use nalgebra::Vector3;

use super::ladder::Scales;
use super::measure::{End, Measured};
use super::{Comparison, Curve, Distance, ENSEMBLE, Entry, Fault, PROBE, Reference, Regime, Scores, Statistics};

/// Floor of the error of all entries.
pub(crate) const FLOOR: f64 = 2e-3;

/// An exact scheme of 10 ms, one whose error is its step, one that fails at times, and one that is always refused.
pub(crate) fn comparison(regime: Regime) -> Comparison {
    let scores = |error: f64| Scores {
        error,
        floor: FLOOR,
        distance: (regime == Regime::Pointwise).then_some(Distance { position: error, velocity: 0.1 * error }),
        deviations: [-error, 0.5 * error, error, -2.0 * error, error, 0.0, 1e-7],
        floors: [FLOOR; 7],
        overlap: 1e-3 * error,
        lost: u64::from(error > 0.1),
        energy_residual: -0.01 * error,
    };
    let entry = |value: Option<f64>, seconds: f64, error: f64| Entry {
        value,
        cpu_seconds: Some(seconds),
        repeats: 3,
        members: 1,
        result: Ok(scores(error)),
    };
    let failed = |value: f64, fault: Fault| Entry {
        value: Some(value),
        cpu_seconds: None,
        repeats: 0,
        members: 0,
        result: Err(fault),
    };
    let refused = crate::scene::Invalid::new("run.scheme", "it cannot do this", "take another");
    let curve = |scheme, setting, unit, entries| Curve { scheme, setting, unit, entries };
    let steps = [0.4, 0.1, 0.02, 0.005].map(|step| entry(Some(step), 1e-3 / step, step));
    let moduli = [(1e8, 0.5), (1e9, 0.2), (1e10, 0.08)].map(|(e, error)| entry(Some(e), 1e-5 * f64::sqrt(e), error));
    let slow = [failed(1e11, Fault::OverBudget { time: 0.03, budget: 60.0 }), failed(1e12, Fault::TooSlow)];
    let curves = vec![
        curve("event-driven", "", "", vec![entry(None, 0.01, 1e-3)]),
        curve("trapezoidal", "step", "s", steps.to_vec()),
        curve("soft-sphere", "young_modulus", "Pa", moduli.into_iter().chain(slow).collect()),
        curve("fixed-point", "tolerance", "", vec![failed(1e-3, refused.clone().into()), failed(1e-4, refused.into())]),
    ];
    let exact = Measured {
        quantities: [1.0; 7],
        ends: vec![Some(End { position: Vector3::zeros(), velocity: Vector3::x() }); 3],
        behind: 0,
        overlap: 0.0,
        energy_residual: 0.0,
        radius: 1.0,
        speed: 1.0,
    };
    let distance = Distance { position: FLOOR, velocity: FLOOR };
    let reference = Reference {
        regime,
        spread: distance,
        displacement: if regime == Regime::Pointwise { PROBE } else { ENSEMBLE },
        members: vec![[1.0; 7], [1.2; 7]],
        statistics: [Statistics::of(&[1.0, 1.2]); 7],
        floor: distance,
        sub_step: None,
        exact,
        scales: Scales { sub_step: None, flight: 1.0 },
    };
    Comparison { title: "A fake".into(), seed: 1, time: [0.0, 0.06], grains: 3, reference, curves, interrupted: false }
}
