//! Sub-steps are of second order, collisions or not (PHYSICS section 5 and hard case 20): near field and gravity, grains and surfaces, with loss,
//! friction and spin, in one dimension and in three.

mod common;

use common::forced::{Scene, attraction, floor, mesh_floor, orders, rough, states};
use common::{grain, smooth};
use impinge::grains::{Grain, NewGrain};
use impinge::law::NearField;
use impinge::scheme::{Laws, Length};
use impinge_events::{Domain, Encounter, Encounters, Flight, NoSurface};
use nalgebra::Vector3;

/// Fails where an order of positions or velocities is further than `tolerance` from `expected`. The scene must have collided a few times.
fn assert_order(what: &str, found: [f64; 2], expected: f64, tolerance: f64) {
    eprintln!("{what}: orders {found:.3?}");
    assert!(found.iter().all(|order| (order - expected).abs() < tolerance), "{what}: orders {found:?}, not {expected}");
}

fn assert_second_order(what: &str, scene: &Scene, steps: u32, until: f64, collisions: [usize; 2]) {
    let outcome = scene.run(until / f64::from(steps), until);
    let found = [outcome.log.grain_hits(), outcome.log.surface_hits()];
    eprintln!("{what}: hits {found:?}");
    assert!(found[0] >= collisions[0] && found[1] >= collisions[1], "{what}: {found:?} hits only");
    assert_order(what, orders(steps, until, |step| scene.run(step, until).states, None), 2.0, 0.1);
}

/// Two grains of 2 kg, so that their distance is that of one of 1 kg from a fixed centre: PHYSICS section 5, from rest at 2 m.
fn two_in_a_line(restitution: f64) -> Scene {
    let at = |x: f64| grain(Vector3::x() * x, Vector3::zeros(), 0.5, 2.0);
    let laws = smooth(restitution, restitution);
    Scene { laws, near_field: Some(attraction(1.0)), ..Scene::of(vec![at(-1.0), at(1.0)]) }
}

#[test]
fn two_grains_in_a_line() {
    for restitution in [1.0, 0.9] {
        let what = format!("two in a line, e = {restitution}");
        assert_second_order(&what, &two_in_a_line(restitution), 400, 20.0, [3, 0]);
    }
}

/// Half kick, event-driven drift, half kick, and nothing else: the kick acts in full at both ends of a sub-step, wherever in between the grains
/// collide.
fn plain_split(scene: &Scene, step: f64, until: f64) -> Vec<(Flight, Grain)> {
    let near_field = scene.near_field.expect("a near field");
    let start: Vec<_> = states(&scene.start(Length::Fixed(step)), 0.0);
    let flights: Vec<_> = start.iter().map(|(flight, _)| *flight).collect();
    let [mass, other_mass] = [start[0].1.mass, start[1].1.mass];
    let mut grains: Encounters = Encounters::new(flights, NoSurface, Domain::unbounded(), f64::INFINITY);
    let kick = |flights: &mut [Flight], time: f64| {
        let impulse = near_field.force_on(flights[1].position - flights[0].position) * time;
        flights[0].velocity += impulse / mass;
        flights[1].velocity -= impulse / other_mass;
    };
    let steps = (until / step).round() as u32;
    let mut half_before = 0.0;
    for _ in 0..steps {
        // The half kick that ends the sub-step before, and the one that starts this one.
        grains.start_sub_step(if half_before > 0.0 { step } else { 0.0 }, 0.0, |_, _, flights, _| {
            kick(flights, half_before + 0.5 * step);
            (step, 0.0)
        });
        half_before = 0.5 * step;
        while let Some((_, encounter)) = grains.next_before(step) {
            let Encounter::Grains { a, b } = encounter else { panic!("only two grains") };
            let (v, w) = (grains.flight(a).velocity, grains.flight(b).velocity);
            // Equal grains in a line.
            let bounce = (v - w) * (0.5 * (1.0 + scene.laws.grain.restitution));
            grains.deflect(&[(a, v - bounce), (b, w + bounce)]);
        }
    }
    let mut flights = [0, 1].map(|grain| grains.flight(grain).advanced_to(step));
    kick(&mut flights, half_before);
    flights.into_iter().zip(start).map(|(flight, (_, grain))| (flight, grain)).collect()
}

/// What the synchronisation is for, seen by the same measurement.
#[test]
fn the_plain_split_step_is_of_first_order() {
    for restitution in [1.0, 0.9] {
        let scene = two_in_a_line(restitution);
        let exact = scene.run(20.0 / 400_000.0, 20.0).states;
        let found = orders(1600, 20.0, |step| plain_split(&scene, step, 20.0), Some(exact));
        assert_order(&format!("plain split, e = {restitution}"), found, 1.0, 0.15);
    }
}

/// Grains at these places (m) with these velocities (m/s) and spins (rad/s), of unequal sizes and masses.
fn some_grains(given: &[([f64; 3], [f64; 3], [f64; 3])]) -> Vec<NewGrain> {
    let one = |(number, given): (usize, &_)| {
        let (place, velocity, spin): &([f64; 3], [f64; 3], [f64; 3]) = given;
        let size = 1.0 + 0.1 * number as f64;
        let spin = Vector3::from(*spin);
        NewGrain { spin, ..grain((*place).into(), (*velocity).into(), 0.4 * size, size.powi(3)) }
    };
    given.iter().enumerate().map(one).collect()
}

/// Four grains that attract each other and meet off-centre.
fn four_in_space(laws: Laws) -> Scene {
    let grains = some_grains(&[
        ([-1.2, 0.1, 0.0], [0.9, 0.0, 0.1], [0.0, 2.0, 1.0]),
        ([1.1, -0.2, 0.1], [-0.8, 0.1, 0.0], [1.0, 0.0, -2.0]),
        ([0.1, 1.3, -0.3], [0.0, -0.7, 0.2], [0.0, -1.0, 0.5]),
        ([-0.2, -0.4, 1.4], [0.1, 0.2, -0.8], [-1.5, 0.0, 0.0]),
    ]);
    Scene { laws, near_field: Some(attraction(0.5)), ..Scene::of(grains) }
}

#[test]
fn four_grains_in_space() {
    let laws = [("e = 1", smooth(1.0, 1.0)), ("e = 0.9", smooth(0.9, 0.9)), ("e = 0.9, mu = 0.3", rough(0.9, 0.3))];
    for (what, laws) in laws {
        assert_second_order(&format!("four in space, {what}"), &four_in_space(laws), 200, 2.5, [3, 0]);
    }
}

/// Near field, gravity and a plane together.
#[test]
fn three_grains_above_a_plane() {
    let grains = some_grains(&[
        ([-0.9, 0.1, 1.1], [0.7, 0.0, 0.0], [0.0, 2.0, 1.0]),
        ([0.8, -0.2, 1.4], [-0.5, 0.1, 0.0], [1.0, 0.0, -2.0]),
        ([0.1, 0.8, 2.4], [0.0, -0.4, 0.2], [0.0, -1.0, 0.5]),
    ]);
    for (what, laws) in [("smooth", smooth(0.9, 0.9)), ("mu = 0.3", rough(0.9, 0.3))] {
        let gravity = Vector3::new(0.1, 0.0, -2.0);
        let near_field = Some(attraction(0.5));
        let scene = Scene { surface: vec![floor()], laws, gravity, near_field, ..Scene::of(grains.clone()) };
        assert_second_order(&format!("three above a plane, {what}"), &scene, 200, 2.5, [2, 3]);
    }
}

/// A ball that is thrown over the floor, with gravity alone.
fn thrown(surface: impinge::scene::Surface, laws: Laws) -> Scene {
    let grains = some_grains(&[([-1.3, 0.17, 1.3], [0.9, 0.3, 0.4], [0.5, -1.0, 2.0])]);
    let gravity = Vector3::new(0.0, 0.2, -4.0);
    Scene { surface: vec![surface], laws, gravity, ..Scene::of(grains) }
}

/// A mesh is met by the chord, which errs by the square of the sub-step.
#[test]
fn a_ball_on_a_mesh() {
    for (what, laws) in [("smooth", smooth(0.9, 0.9)), ("mu = 0.3", rough(0.9, 0.3))] {
        assert_second_order(&format!("on a mesh, {what}"), &thrown(mesh_floor(6.0), laws), 200, 3.0, [0, 2]);
    }
}

/// A plane is met by the parabola itself: sub-steps of any length give the same up to rounding.
#[test]
fn a_ball_on_a_plane_is_exact() {
    let scene = thrown(floor(), rough(0.9, 0.3));
    let fine = scene.run(1e-3, 3.0);
    assert!(fine.log.surface_hits() >= 2);
    for step in [3e-3, 0.04, 0.3, 1.7, 3.0] {
        for ((flight, grain), (exact, exact_grain)) in scene.run(step, 3.0).states.iter().zip(&fine.states) {
            let error = (flight.position - exact.position).amax() + (flight.velocity - exact.velocity).amax();
            assert!(error < 1e-12, "sub-step {step}: {error:e}");
            assert!((grain.spin - exact_grain.spin).amax() < 1e-12, "sub-step {step}");
        }
    }
}

/// Time (s) in which two grains of reduced mass 1 kg fall from rest at distance `from` (m) to `to` (m), and their speed of approach there (m/s).
///
/// With x = from - s², from which the integrand loses its pole, t = ∫ 2 s / v ds and v² = 2 (U(from) - U(x)), by Gauss–Legendre quadrature.
fn fall(law: &NearField, from: f64, to: f64) -> (f64, f64) {
    // Nodes and weights of five points on [-1, 1].
    let root = f64::sqrt(10.0 / 7.0);
    let [inner, outer] = [(5.0 - 2.0 * root).sqrt() / 3.0, (5.0 + 2.0 * root).sqrt() / 3.0];
    let [heavy, light] = [13.0, -13.0].map(|sign| (322.0 + sign * f64::sqrt(70.0)) / 900.0);
    let rule = [(0.0, 128.0 / 225.0), (inner, heavy), (-inner, heavy), (outer, light), (-outer, light)];
    let speed = |x: f64| (2.0 * (law.potential(from) - law.potential(x))).sqrt();
    const PIECES: u32 = 256;
    let width = (from - to).sqrt() / f64::from(PIECES);
    let integrand = |s: f64| 2.0 * s / speed(from - s * s);
    let piece = |k: u32| {
        let middle = (f64::from(k) + 0.5) * width;
        rule.iter().map(|(node, weight)| 0.5 * width * weight * integrand(middle + 0.5 * width * node)).sum::<f64>()
    };
    ((0..PIECES).map(piece).sum(), speed(to))
}

/// Two grains that attract each other, from rest: when they touch and how fast, against quadrature.
#[test]
fn two_attracting_grains_against_quadrature() {
    let law = attraction(1.0);
    let (time, speed) = fall(&law, 2.0, 1.0);
    let scene = two_in_a_line(1.0);
    let errors = |step: f64| {
        let outcome = scene.run(step, 1.01 * time);
        let [common::Hit::Grains(hit)] = &outcome.log.0[..] else { panic!("one hit") };
        [(hit.time - time).abs() / time, (hit.approach_speed - speed).abs() / speed]
    };
    let coarse = errors(time / 1000.3);
    let fine = errors(time / 64_000.3);
    eprintln!("errors {coarse:?}, {fine:?}");
    // Halved six times, an error of second order falls by 4096; the contact is a little into the step each time.
    for (coarse, fine) in coarse.iter().zip(&fine) {
        assert!(*coarse < 1e-5 && *fine < 1e-8, "{coarse:e}, {fine:e}");
        assert!(*fine < coarse / 2000.0, "{coarse:e}, {fine:e}");
    }
}
