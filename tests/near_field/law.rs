//! The law of one pair.

use std::f64::consts::PI;

use impinge::law::{NearField, Term};

use crate::exact::{Real, double, real};
use crate::sets::law;

/// Force and potential may be off by some roundings, relative to the larger term.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// r^-beta in 60 digits.
pub(crate) fn exact_power(r: &Real, beta: f64) -> Real {
    if beta == 0.0 { real(1.0) } else { r.powf(&real(-beta)) }
}

#[test]
fn forces_are_those_of_the_paper_for_any_exponents() {
    for (beta1, beta2) in [(0.0, 1.0), (2.0, 3.0), (1.5, 2.5), (2.5, 4.0), (7.0, 14.5), (3.0, PI), (1.0, 35.0)] {
        let law = law(beta1, beta2);
        for r in [0.0123, 0.02, 0.5, 1.0, 3.7] {
            let attraction = &real(law.attraction().alpha) * &exact_power(&real(r), beta1);
            let repulsion = &real(law.repulsion().alpha) * &exact_power(&real(r), beta2);
            let error = (law.force(r) - double(&(&attraction - &repulsion))).abs();
            let magnitude = double(&attraction) + double(&repulsion);
            // A power of 35 multiplies the rounding of r with 35.
            assert!(error <= ROUNDING * (1.0 + beta2) * magnitude, "{beta1} {beta2} at {r}: {error} of {magnitude}");
            assert!((law.magnitude(r) - magnitude).abs() <= ROUNDING * (1.0 + beta2) * magnitude);
        }
    }
}

/// Central differences in 60 digits of potentials written down by hand would test the hand: these are those of the code, with a step at
/// which their rounding and their truncation are of like size.
#[test]
fn the_force_is_the_derivative_of_the_potential() {
    const STEP: f64 = 1e-5;
    const DIFFERENCES: f64 = 1e-8;
    for (beta1, beta2) in [(0.0, 0.5), (1.0, 1.0), (1.0, 2.0), (2.0, 3.0), (2.5, PI), (7.0, 4.0)] {
        let law = law(beta1, beta2);
        for r in [0.3, 1.0, 2.0] {
            let slope = (law.potential(r * (1.0 + STEP)) - law.potential(r * (1.0 - STEP))) / (2.0 * STEP * r);
            assert!((slope - law.force(r)).abs() <= DIFFERENCES * law.magnitude(r), "{beta1} {beta2} at {r}");
        }
    }
}

#[test]
fn potentials_are_zero_where_they_should_be() {
    let single = |beta| NearField::new(Term { alpha: 3.0, beta }, Term { alpha: 0.0, beta: 0.0 }).unwrap();
    assert!(single(2.0).potential(1e9).abs() < 1e-8, "beta > 1: at infinity");
    assert_eq!(single(1.0).potential(1.0), 0.0, "beta = 1: at 1 m");
    assert!(single(0.5).potential(1e-18).abs() < 1e-8, "beta < 1: at no distance");
    assert_eq!(single(0.0).potential(2.0), 6.0, "a constant force of 3 N over 2 m");
}

#[test]
fn alpha_1_attracts_and_alpha_2_repels() {
    let law = law(2.0, 3.0);
    let balance = law.equilibrium().expect("one");
    assert!((balance - 0.02).abs() < 1e-12);
    assert!(law.force(balance * 1.01) > 0.0 && law.force(balance * 0.99) < 0.0);
    let repulsion_only = NearField::new(Term { alpha: 0.0, beta: 2.0 }, Term { alpha: 1.0, beta: 3.0 }).unwrap();
    assert_eq!(repulsion_only.equilibrium(), None);
    assert_eq!(repulsion_only.force(2.0), -0.125);
}

#[test]
fn what_is_no_law_is_refused() {
    let fine = Term { alpha: 1.0, beta: 2.0 };
    for bad in [Term { alpha: f64::NAN, ..fine }, Term { beta: -0.5, ..fine }, Term { beta: f64::INFINITY, ..fine }] {
        assert!(NearField::new(bad, fine).is_err() && NearField::new(fine, bad).is_err());
    }
}
