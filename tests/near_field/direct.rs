//! The sum over all pairs.

use std::f64::consts::PI;

use impinge::law::NearField;
use impinge::near_field::{Method, Singular, Unsuitable};
use impinge_events::Domain;
use nalgebra::Vector3;

use crate::exact::{Exact, Real, double, real};
use crate::law::exact_power;
use crate::sets::{in_box, law, strengths};
use crate::{assert_momentum_is_kept, assert_threads_change_nothing, forces, open};

/// Rounding of a sum of some dozens of terms in eight lanes, over the sum of the magnitudes.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Forces in 60 digits, and the sums of the magnitudes of what contributes to them.
fn exact_forces(law: &NearField, positions: &[Vector3<f64>], strengths: &[f64]) -> Vec<(Exact, f64)> {
    let of_grain = |grain: usize| {
        let mut force = Exact::of(Vector3::zeros());
        let mut magnitude = 0.0;
        for other in (0..positions.len()).filter(|&other| other != grain) {
            let apart = &Exact::of(positions[other]) - &Exact::of(positions[grain]);
            let r = apart.dot(&apart).sqrt();
            let term = |alpha: f64, beta: f64| -> Real { &real(alpha) * &exact_power(&r, beta) };
            let (attraction, repulsion) = (law.attraction(), law.repulsion());
            let pull = term(attraction.alpha, attraction.beta) - term(repulsion.alpha, repulsion.beta);
            let weight = &real(strengths[grain]) * &real(strengths[other]);
            force = &force + &(&apart * &(&weight * &(&pull / &r)));
            magnitude += double(&weight).abs() * law.magnitude(double(&r));
        }
        (force, magnitude)
    };
    (0..positions.len()).map(of_grain).collect()
}

#[test]
fn sums_equal_those_in_60_digits() {
    let positions = in_box(45, Vector3::new(0.2, 0.2, 0.5), 1);
    let strengths = strengths(45, 2);
    for (beta1, beta2) in [(0.0, 1.0), (2.0, 3.0), (2.5, 4.0), (7.0, 3.0), (PI, 2.0)] {
        let law = law(beta1, beta2);
        let forces = forces(&mut open(law, Method::Direct), &positions, Some(&strengths));
        for (force, (exact, magnitude)) in forces.iter().zip(exact_forces(&law, &positions, &strengths)) {
            let error = (&Exact::of(*force) - &exact).0.map(|part| double(&part).abs());
            let worst = error.into_iter().fold(0.0, f64::max);
            assert!(worst <= ROUNDING * magnitude, "{beta1} {beta2}: {worst} of {magnitude}");
        }
    }
}

#[test]
fn energies_equal_plain_sums() {
    let positions = in_box(300, Vector3::new(0.2, 0.2, 0.5), 3);
    let strengths = strengths(300, 4);
    for (beta1, beta2) in [(0.0, 1.0), (2.0, 3.0), (2.5, 4.0), (1.0, PI)] {
        let law = law(beta1, beta2);
        let mut energy = 0.0;
        let mut magnitude = 0.0;
        for a in 0..300 {
            for b in 0..a {
                let pair = strengths[a] * strengths[b] * law.potential((positions[a] - positions[b]).norm());
                energy += pair;
                magnitude += pair.abs();
            }
        }
        let summed = open(law, Method::Direct).potential_energy(&positions, Some(&strengths)).unwrap();
        assert!((summed - energy).abs() <= 1e-12 * magnitude, "{beta1} {beta2}: {summed}, not {energy}");
    }
}

/// 1000 grains are eight blocks, the last with empty lanes.
#[test]
fn the_number_of_threads_changes_no_bit() {
    let positions = in_box(1003, Vector3::new(0.2, 0.2, 0.5), 5);
    let strengths = strengths(1003, 6);
    for (beta1, beta2) in [(2.0, 3.0), (2.5, 4.0)] {
        let sum = open(law(beta1, beta2), Method::Direct);
        assert_threads_change_nothing(&sum, &positions, None);
        assert_threads_change_nothing(&sum, &positions, Some(&strengths));
    }
}

#[test]
fn momentum_is_kept_to_round_off() {
    let positions = in_box(2000, Vector3::new(0.2, 0.2, 0.5), 7);
    let mut sum = open(law(2.0, 3.0), Method::Direct);
    assert_momentum_is_kept(&forces(&mut sum, &positions, None));
    assert_momentum_is_kept(&forces(&mut sum, &positions, Some(&strengths(2000, 8))));
}

/// Blocks, lanes and what is empty in them must not show at any size.
#[test]
fn sets_of_any_size_equal_plain_sums() {
    let law = law(2.0, 3.0);
    let mut sum = open(law, Method::Direct);
    for count in [0, 1, 2, 3, 7, 8, 9, 127, 128, 129, 257, 300, 2] {
        let positions = in_box(count, Vector3::new(0.2, 0.2, 0.5), 9);
        forces(&mut sum, &positions, None);
        let error = sum.measured_error(&positions, None, count).unwrap();
        assert_eq!(error.grains, count);
        assert!(error.of_contributions <= 1e-14, "{count}: {error:?}");
    }
    let apart = Vector3::new(0.0, 0.1, 0.2);
    let pair = forces(&mut sum, &[Vector3::zeros(), apart], None);
    assert_eq!(pair, [law.force_on(apart), law.force_on(-apart)]);
    assert_eq!(sum.pair_force(apart), pair[0]);
}

#[test]
fn a_planar_set_stays_planar() {
    let positions = in_box(500, Vector3::new(0.5, 0.0, 0.5), 10);
    let forces = forces(&mut open(law(2.5, 3.0), Method::Direct), &positions, None);
    assert!(forces.iter().all(|force| force.y == 0.0));
}

#[test]
fn strengths_multiply_forces() {
    let positions = in_box(200, Vector3::new(0.2, 0.2, 0.5), 11);
    let mut sum = open(law(2.0, 3.0), Method::Direct);
    let plain = forces(&mut sum, &positions, None);
    assert_eq!(forces(&mut sum, &positions, Some(&[1.0; 200])), plain);
    let fourfold: Vec<_> = plain.iter().map(|force| force * 4.0).collect();
    assert_eq!(forces(&mut sum, &positions, Some(&[-2.0; 200])), fourfold);
}

#[test]
fn coincident_grains_are_named() {
    let mut positions = in_box(300, Vector3::new(0.2, 0.2, 0.5), 12);
    positions[250] = positions[40];
    let mut sum = open(law(2.0, 3.0), Method::Direct);
    let mut out = vec![Vector3::zeros(); 300];
    assert_eq!(sum.forces(&positions, None, &mut out), Err(Singular::Coincident(40, 250)));
    assert_eq!(sum.potential_energy(&positions, None), Err(Singular::Coincident(40, 250)));
    positions[250].z = f64::NAN;
    assert_eq!(sum.forces(&positions, None, &mut out), Err(Singular::NotFinite(250)));
}

#[test]
fn a_periodic_domain_needs_a_cut_off() {
    let domain = Domain { min: Vector3::zeros(), max: Vector3::repeat(1.0), periodic: true, planar: false };
    let refused = impinge::near_field::ForceSum::new(law(2.0, 3.0), Method::Direct, &domain);
    assert_eq!(refused.err(), Some(Unsuitable::Periodic));
}
