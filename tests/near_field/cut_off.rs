//! Sums within a cut-off.

use std::f64::consts::PI;

use impinge::near_field::{CutOff, ForceSum, Method, Singular, Unsuitable};
use impinge_events::Domain;
use nalgebra::Vector3;
use rand::RngExt as _;

use crate::sets::{in_box, law, random, strengths};
use crate::{assert_momentum_is_kept, assert_threads_change_nothing, forces, open};

const CUT_OFF: CutOff = CutOff { radius: 0.1, switch_width: 0.03, skin: 0.02 };
const SIZE: Vector3<f64> = Vector3::new(0.3, 0.3, 0.4);

fn periodic(planar: bool) -> Domain {
    let min = Vector3::new(-0.1, -0.05, 0.2);
    Domain { min, max: min + SIZE, periodic: true, planar }
}

fn in_domain(domain: &Domain, method: CutOff) -> ForceSum {
    ForceSum::new(law(2.0, 3.0), Method::CutOff(method), domain).expect("it suits")
}

/// The force of one pair: that of the law, times a switch that is written here once more.
fn switched(apart: Vector3<f64>) -> Vector3<f64> {
    let r = apart.norm();
    let x = ((r - (CUT_OFF.radius - CUT_OFF.switch_width)) / CUT_OFF.switch_width).clamp(0.0, 1.0);
    law(2.0, 3.0).force_on(apart) * (1.0 - x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x))
}

fn assert_close(forces: &[Vector3<f64>], expected: &[Vector3<f64>]) {
    let scale = expected.iter().map(Vector3::norm).fold(0.0, f64::max);
    for (grain, (force, expected)) in forces.iter().zip(expected).enumerate() {
        assert!((force - expected).norm() <= 1e-13 * scale, "grain {grain}: {force}, not {expected}");
    }
}

#[test]
fn lists_find_all_pairs_in_an_open_domain() {
    let positions = in_box(700, SIZE, 1);
    let expected: Vec<Vector3<f64>> = positions
        .iter()
        .map(|place| positions.iter().filter(|other| *other != place).map(|other| switched(other - place)).sum())
        .collect();
    assert_close(&forces(&mut open(law(2.0, 3.0), Method::CutOff(CUT_OFF)), &positions, None), &expected);
}

/// 27 boxes of images, searched one by one; grains may also be outside the domain.
#[test]
fn a_periodic_box_equals_all_images() {
    let mut positions = in_box(300, SIZE, 2);
    positions.iter_mut().take(50).for_each(|position| position.x -= 3.0 * SIZE.x);
    for planar in [false, true] {
        if planar {
            positions.iter_mut().for_each(|position| position.y = 0.0);
        }
        let steps = |axis: usize| if planar && axis == 1 { 0..=0 } else { -4..=4 };
        let mut images = Vec::new();
        for x in steps(0) {
            for y in steps(1) {
                for z in steps(2) {
                    images.push(SIZE.component_mul(&Vector3::new(f64::from(x), f64::from(y), f64::from(z))));
                }
            }
        }
        let expected: Vec<Vector3<f64>> = positions
            .iter()
            .map(|place| {
                let others = positions.iter().filter(|other| *other != place);
                others.flat_map(|other| images.iter().map(move |image| switched(other + image - place))).sum()
            })
            .collect();
        let forces = forces(&mut in_domain(&periodic(planar), CUT_OFF), &positions, None);
        assert_close(&forces, &expected);
        assert!(!planar || forces.iter().all(|force| force.y == 0.0));
    }
}

/// Fewer than three cells in a period: then the same cell lies on both sides.
#[test]
fn small_boxes_count_each_pair_once() {
    let positions = in_box(60, SIZE, 3);
    let wide = CutOff { radius: 0.15, switch_width: 0.05, skin: 0.1 };
    let narrow = CutOff { skin: 0.0, ..wide };
    let [wide, narrow] =
        [wide, narrow].map(|method| forces(&mut in_domain(&periodic(false), method), &positions, None));
    assert_eq!(wide, narrow);
    assert!(wide.iter().any(|force| force.norm() > 0.0));
}

#[test]
fn lists_after_motion_equal_fresh_lists() {
    for domain in [Domain::unbounded(), periodic(false)] {
        let mut positions = in_box(400, SIZE, 4);
        let mut random = random(5);
        let mut aged = in_domain(&domain, CUT_OFF);
        let mut steps_with_old_lists = 0;
        for _ in 0..40 {
            for position in &mut positions {
                *position += Vector3::from([(); 3].map(|()| random.random_range(-1e-3..2e-3)));
                domain.wrap(position);
            }
            let made = aged.lists_made();
            let from_aged = forces(&mut aged, &positions, None);
            steps_with_old_lists += u32::from(aged.lists_made() == made);
            assert_eq!(from_aged, forces(&mut in_domain(&domain, CUT_OFF), &positions, None));
        }
        assert!(aged.lists_made() > 1 && steps_with_old_lists > 20, "{} lists in 40 steps", aged.lists_made());
    }
}

/// Entries and exits change the number of grains, or who has which number.
#[test]
fn lists_do_not_survive_other_grains() {
    let positions = in_box(200, SIZE, 6);
    let mut sum = open(law(2.0, 3.0), Method::CutOff(CUT_OFF));
    for grains in [positions.clone(), positions[..150].to_vec(), positions[50..].to_vec(), Vec::new()] {
        let fresh = forces(&mut open(law(2.0, 3.0), Method::CutOff(CUT_OFF)), &grains, None);
        assert_eq!(forces(&mut sum, &grains, None), fresh);
    }
    assert_eq!(sum.lists_made(), 4);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let positions = in_box(1000, SIZE, 7);
    let sum = in_domain(&periodic(false), CUT_OFF);
    assert_threads_change_nothing(&sum, &positions, None);
    assert_threads_change_nothing(&sum, &positions, Some(&strengths(1000, 8)));
}

#[test]
fn momentum_is_kept_to_round_off() {
    let positions = in_box(1000, SIZE, 9);
    let mut sum = in_domain(&periodic(false), CUT_OFF);
    assert_momentum_is_kept(&forces(&mut sum, &positions, None));
    assert_momentum_is_kept(&forces(&mut sum, &positions, Some(&strengths(1000, 10))));
}

/// The potential of a pair in steps small against the switch, and its continuity where the switch begins and ends.
#[test]
fn the_switched_force_is_the_derivative_of_its_potential() {
    const STEP: f64 = 1e-6;
    const DIFFERENCES: f64 = 1e-8;
    for (beta1, beta2) in [(0.0, 1.0), (2.0, 3.0), (2.5, PI), (7.0, 4.0)] {
        let sum = open(law(beta1, beta2), Method::CutOff(CUT_OFF));
        let scale = sum.law().magnitude(CUT_OFF.radius - CUT_OFF.switch_width);
        for r in [0.05, 0.069_99, 0.07, 0.070_01, 0.08, 0.09, 0.099_99, 0.1, 0.11] {
            let slope = (sum.pair_potential(r + STEP) - sum.pair_potential(r - STEP)) / (2.0 * STEP);
            let force = sum.pair_force(Vector3::new(r, 0.0, 0.0)).x;
            assert!((slope - force).abs() <= DIFFERENCES * scale.max(force.abs()), "{beta1} {beta2} at {r}");
        }
        assert_eq!(sum.pair_force(Vector3::new(0.0, 0.1, 0.0)).y, 0.0);
        assert_eq!(sum.pair_potential(0.1), 0.0);
    }
}

/// A switch that is right pair by pair is right in the sum: the energy of a set against its forces, along a random direction.
#[test]
fn forces_are_the_gradient_of_the_energy() {
    const STEP: f64 = 1e-7;
    let positions = in_box(200, SIZE, 11);
    let strengths = strengths(200, 12);
    let mut random = random(13);
    let direction: Vec<_> =
        positions.iter().map(|_| Vector3::from([(); 3].map(|()| random.random_range(-1.0..1.0)))).collect();
    for domain in [Domain::unbounded(), periodic(false)] {
        let mut sum = in_domain(&domain, CUT_OFF);
        let mut energy = |step: f64| {
            let moved: Vec<_> = positions.iter().zip(&direction).map(|(place, way)| place + way * step).collect();
            sum.potential_energy(&moved, Some(&strengths)).unwrap()
        };
        let slope = (energy(STEP) - energy(-STEP)) / (2.0 * STEP);
        let forces = forces(&mut in_domain(&domain, CUT_OFF), &positions, Some(&strengths));
        let power = |(force, way): (&Vector3<f64>, &Vector3<f64>)| force.dot(way);
        let work: f64 = forces.iter().zip(&direction).map(power).sum();
        let scale: f64 = forces.iter().map(Vector3::norm).sum();
        assert!((slope + work).abs() <= 1e-7 * scale, "{slope} and {work} of {scale}");
    }
}

#[test]
fn cut_offs_that_make_no_sense_are_refused() {
    let refused = |cut_off| ForceSum::new(law(2.0, 3.0), Method::CutOff(cut_off), &periodic(false)).err();
    let bad = [
        CutOff { radius: f64::INFINITY, ..CUT_OFF },
        CutOff { switch_width: 0.0, ..CUT_OFF },
        CutOff { switch_width: 0.06, ..CUT_OFF },
        CutOff { skin: -0.01, ..CUT_OFF },
    ];
    for cut_off in bad {
        assert_eq!(refused(cut_off), Some(Unsuitable::CutOff(cut_off)));
    }
    let long = CutOff { radius: 0.151, ..CUT_OFF };
    assert!(matches!(refused(long), Some(Unsuitable::LongCutOff { radius: 0.151, .. })));
}

#[test]
fn coincident_grains_are_named() {
    let positions = [Vector3::new(0.0, 0.0, 0.3), Vector3::new(0.05, 0.0, 0.3), Vector3::new(0.0, 0.0, 0.3)];
    let mut sum = in_domain(&periodic(false), CUT_OFF);
    assert_eq!(sum.forces(&positions, None, &mut [Vector3::zeros(); 3]), Err(Singular::Coincident(0, 2)));
}
