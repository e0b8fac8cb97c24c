//! The sum by a tree.

use std::f64::consts::PI;

use impinge::near_field::{Bound, ForceSum, MeasuredError, Method, Singular, Unsuitable};
use impinge_events::Domain;
use nalgebra::Vector3;

use crate::sets::{clusters, dumbbells, in_box, jet, law, line, strengths};
use crate::{assert_momentum_is_kept, assert_threads_change_nothing, forces, open};

/// Below this an error is only rounding: a tree that never expands would pass every other test.
const ROUNDING: f64 = 1e-13;

fn tree(beta1: f64, beta2: f64, tolerance: f64, bound: Bound) -> ForceSum {
    open(law(beta1, beta2), Method::Tree { tolerance, bound })
}

/// Grains whose errors are looked at, at most: each costs a plain loop over all.
const LOOKED_AT: usize = 2500;

/// The largest error of the grains, which must be within the tolerance.
fn largest_error(
    [beta1, beta2]: [f64; 2],
    tolerance: f64,
    bound: Bound,
    positions: &[Vector3<f64>],
    strengths: Option<&[f64]>,
) -> MeasuredError {
    let mut sum = tree(beta1, beta2, tolerance, bound);
    let error = sum.measured_error(positions, strengths, LOOKED_AT).expect("finite forces");
    assert!(error.of_contributions <= tolerance, "{beta1} {beta2} at {tolerance} ({bound:?}): {error:?}");
    error
}

#[test]
fn errors_in_a_jet_are_within_the_tolerance() {
    let positions = jet();
    assert_eq!(positions.len(), 8000);
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        for bound in [Bound::Proven, Bound::Measured] {
            let error = largest_error([2.0, 3.0], tolerance, bound, &positions, None);
            assert!(error.of_contributions > ROUNDING, "nothing was expanded at {tolerance}");
        }
    }
}

#[test]
fn errors_in_clusters_are_within_the_tolerance() {
    let positions = clusters(5000, 1);
    let strengths = strengths(5000, 2);
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        for strengths in [None, Some(&strengths[..])] {
            for bound in [Bound::Proven, Bound::Measured] {
                let error = largest_error([2.0, 3.0], tolerance, bound, &positions, strengths);
                assert!(error.of_contributions > ROUNDING, "nothing was expanded at {tolerance}");
            }
        }
    }
}

#[test]
fn errors_of_other_exponents_are_within_the_tolerance() {
    let positions = clusters(2000, 3);
    for betas in [[0.0, 1.0], [1.0, 2.0], [0.5, 1.5], [2.5, 4.0], [7.0, 3.0], [PI, 2.0]] {
        for bound in [Bound::Measured, Bound::Proven] {
            let error = largest_error(betas, 1e-4, bound, &positions, None);
            assert!(error.of_contributions > ROUNDING, "nothing was expanded for {betas:?}");
        }
    }
}

/// Sets for which what is usual does not hold: the bound must be a bound.
#[test]
fn the_bound_holds_for_the_worst_of_sets() {
    let lattice: Vec<_> =
        (0..2500).map(|grain| Vector3::new(f64::from(grain % 50), 0.0, f64::from(grain / 50)) * 0.02).collect();
    for positions in [line(2000), dumbbells(2000, 4), lattice, in_box(2000, Vector3::repeat(0.5), 5)] {
        for betas in [[2.0, 3.0], [0.0, 1.0], [7.0, 4.0]] {
            for tolerance in [1e-2, 1e-4] {
                largest_error(betas, tolerance, Bound::Proven, &positions, None);
                largest_error(betas, tolerance, Bound::Measured, &positions, None);
            }
        }
    }
}

/// At the tightest tolerance an error in any coefficient would show.
#[test]
fn expansions_converge() {
    for positions in [clusters(3000, 6), line(3000)] {
        let error = largest_error([2.0, 3.0], 1e-8, Bound::Measured, &positions, None);
        assert!(error.of_contributions > 1e-15, "nothing was expanded");
    }
}

#[test]
fn energies_equal_those_of_the_direct_sum() {
    let positions = clusters(3000, 7);
    let strengths = strengths(3000, 8);
    for [beta1, beta2] in [[2.0, 3.0], [1.0, 2.5], [0.0, PI]] {
        let energy = |mut sum: ForceSum| sum.potential_energy(&positions, Some(&strengths)).unwrap();
        let exact = energy(open(law(beta1, beta2), Method::Direct));
        let approximate = energy(tree(beta1, beta2, 1e-5, Bound::Measured));
        assert!((approximate - exact).abs() <= 1e-5 * exact.abs(), "{beta1} {beta2}: {approximate}, not {exact}");
        assert!(approximate != exact, "nothing was expanded");
    }
}

/// 8000 grains are eight branches.
#[test]
fn the_number_of_threads_changes_no_bit() {
    let positions = jet();
    let sum = tree(2.0, 3.0, 1e-4, Bound::Measured);
    assert_threads_change_nothing(&sum, &positions, None);
    let positions = clusters(3001, 9);
    assert_threads_change_nothing(&sum, &positions, Some(&strengths(3001, 10)));
}

/// At a loose tolerance the errors of the forces are 1e11 times what is left of momentum.
#[test]
fn momentum_is_kept_to_round_off() {
    let positions = clusters(5000, 11);
    let mut sum = tree(2.0, 3.0, 1e-2, Bound::Measured);
    assert_momentum_is_kept(&forces(&mut sum, &positions, None));
    assert_momentum_is_kept(&forces(&mut sum, &positions, Some(&strengths(5000, 12))));
}

#[test]
fn a_planar_set_stays_planar() {
    let positions = in_box(5000, Vector3::new(2.0, 0.0, 2.0), 13);
    let mut sum = tree(2.0, 3.0, 1e-3, Bound::Measured);
    assert!(forces(&mut sum, &positions, None).iter().all(|force| force.y == 0.0));
}

/// Leaves, branches and empty lanes must not show at any size.
#[test]
fn sets_of_any_size_are_within_the_tolerance() {
    let mut sum = tree(2.0, 3.0, 1e-4, Bound::Measured);
    for count in [0, 1, 2, 3, 8, 63, 64, 65, 130, 1023, 1024, 1025, 2050, 4100] {
        let error = sum.measured_error(&clusters(count, 14), None, count).unwrap();
        assert!(error.of_contributions <= 1e-4, "{count}: {error:?}");
    }
    let apart = Vector3::new(0.0, 0.1, 0.2);
    let law = law(2.0, 3.0);
    assert_eq!(forces(&mut sum, &[Vector3::zeros(), apart], None), [law.force_on(apart), law.force_on(-apart)]);
}

/// Cells without any strength once made all others too close.
#[test]
fn grains_of_no_strength_do_not_disturb() {
    let positions = clusters(3000, 17);
    let strengths: Vec<f64> = positions.iter().map(|place| f64::from(u8::from(place.x > 0.0))).collect();
    for bound in [Bound::Proven, Bound::Measured] {
        let error = largest_error([2.0, 3.0], 1e-4, bound, &positions, Some(&strengths));
        assert!(error.of_contributions > ROUNDING, "nothing was expanded");
    }
    let none = vec![0.0; 3000];
    let mut sum = tree(2.0, 3.0, 1e-4, Bound::Proven);
    assert!(forces(&mut sum, &positions, Some(&none)).iter().all(|force| *force == Vector3::zeros()));
}

/// The same forces, wherever the set is, but for the rounding of the places.
#[test]
fn a_set_may_be_far_from_the_origin() {
    let positions: Vec<_> = clusters(3000, 15).iter().map(|place| place + Vector3::new(1e3, -2e3, 4e3)).collect();
    largest_error([2.0, 3.0], 1e-6, Bound::Measured, &positions, None);
}

#[test]
fn coincident_grains_are_named() {
    let mut positions = clusters(3000, 16);
    positions[2500] = positions[40];
    let mut sum = tree(2.0, 3.0, 1e-4, Bound::Measured);
    let mut out = vec![Vector3::zeros(); 3000];
    assert_eq!(sum.forces(&positions, None, &mut out), Err(Singular::Coincident(40, 2500)));
    assert_eq!(sum.potential_energy(&positions, None), Err(Singular::Coincident(40, 2500)));
    assert!(sum.forces(&[Vector3::zeros(); 500], None, &mut out[..500]).is_err());
}

#[test]
fn what_no_tree_can_keep_is_refused() {
    let refused = |tolerance| {
        let method = Method::Tree { tolerance, bound: Bound::Proven };
        ForceSum::new(law(2.0, 3.0), method, &Domain::unbounded()).err()
    };
    for tolerance in [0.0, 1e-9, 0.2, -1.0] {
        assert_eq!(refused(tolerance), Some(Unsuitable::Tolerance(tolerance)));
    }
    assert!(matches!(refused(f64::NAN), Some(Unsuitable::Tolerance(_))));
    assert_eq!(refused(1e-4), None);
}
