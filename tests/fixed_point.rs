//! The fixed-point scheme of Arbelaez, Zohdi & Dornfeld (2009), section 4, against exact answers and the event-driven scheme, and what it costs
//! that impulses of one step are added (PHYSICS 0.21).

mod common;

use std::ops::ControlFlow;

use common::forced::{Scene, attraction, block, floor, mesh_floor, orders, rough, slope};
use common::{Hit, Log, grain, smooth};
use impinge::grains::Grain;
use impinge::law::{Body, resolve_surface};
use impinge::near_field::{ForceSum, Method};
use impinge::observe::Ledger;
use impinge::scene::{FixedPoint as Settings, Interference};
use impinge::scheme::fixed_point::FixedPoint;
use impinge::scheme::stepped::{Crowd, Stepped, Steps};
use impinge::scheme::{Forces, Observer as _};
use impinge::surface::Surface;
use impinge_events::{Domain, Flight};
use nalgebra::Vector3;

struct Outcome {
    states: Vec<(Flight, Grain)>,
    log: Log,
    ledger: Ledger,
    steps: Steps,
}

/// The scene in steps until `until` (s), looked at in `looks` equal intervals.
fn run_looking(scene: &Scene, settings: Settings, until: f64, looks: u32) -> Outcome {
    let surface = Surface::new(&scene.surface, ".".as_ref()).expect("a surface");
    let sum = |law| ForceSum::new(law, Method::Direct, &scene.domain).expect("a sum that suits the domain");
    let forces = Forces { gravity: scene.gravity, near_field: scene.near_field.map(sum), contact_time: 0.0 };
    let crowd = Crowd::new(&scene.grains, surface, scene.domain, scene.laws, forces, 0.0);
    let mut run = Stepped::new(crowd, FixedPoint::new(settings));
    let mut observers = (Log::default(), Ledger::default());
    for look in 0..=looks {
        let time = until * f64::from(look) / f64::from(looks);
        let flow = run.advance(time, &mut observers, &mut |_| ControlFlow::Continue(())).expect("nothing breaks");
        assert!(flow.is_continue());
        run.tell(&mut observers).expect("finite forces");
        run.crowd().snapshot(time, |snapshot| observers.sample(snapshot));
    }
    let states = run
        .crowd()
        .snapshot(until, |snapshot| snapshot.flights.iter().copied().zip(snapshot.grains.iter().copied()).collect());
    Outcome { states, log: observers.0, ledger: observers.1, steps: run.steps() }
}

fn run(scene: &Scene, settings: Settings, until: f64) -> Outcome {
    run_looking(scene, settings, until, 1)
}

/// Steps of at most `step` (s) that iterate until nothing changes.
fn fixed(step: f64) -> Settings {
    Settings { largest_step: Some(step), tolerance: 1e-12, iterations: 100, ..Settings::default() }
}

fn overlap(overlap: f64) -> Settings {
    Settings { overlap, ..Settings::default() }
}

/// Largest distance of two positions, over all grains (m).
fn apart(one: &[(Flight, Grain)], other: &[(Flight, Grain)]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).map(|(a, b)| (a.0.position - b.0.position).norm()).fold(0.0, f64::max)
}

/// 27 grains of radius 0.1 m that fall on a floor, bounce off it and meet each other, until 0.6 s.
fn jet() -> Scene {
    let mut grains = block(3, 0.1, 0.24, 0.4);
    grains.iter_mut().for_each(|grain| {
        grain.position.z += 0.8;
        grain.velocity.z -= 2.0;
    });
    Scene { surface: vec![floor()], laws: rough(0.8, 0.3), ..Scene::of(grains) }
}

const END: f64 = 0.6;

#[test]
fn free_flight_is_exact_and_its_steps_grow() {
    let mut scene = jet();
    scene.surface.clear();
    scene.grains.iter_mut().for_each(|grain| grain.velocity = Vector3::new(1.0, 2.0, -2.0));
    let outcome = run(&scene, Settings::default(), 100.0);
    let Steps { count, shortest, longest } = outcome.steps;
    assert!(count <= 15 && longest > 100.0 * shortest, "{:?}", outcome.steps);
    for (start, (flight, _)) in scene.grains.iter().zip(&outcome.states) {
        assert_eq!(flight.velocity, start.velocity);
        assert!((flight.position - start.position - start.velocity * 100.0).amax() < 1e-12);
    }
    assert_eq!(outcome.ledger.energy_residual(), 0.0);
}

/// An impulse is exact in velocity and spin, whatever the step: its force and moment are averaged over the step (33), not over a contact (PHYSICS
/// 0.13). It comes late, when grain and surface overlap, so that the place errs by the overlap and by what the rebound misses.
#[test]
fn one_bounce_is_exact_in_velocity_and_spin_and_late_by_the_overlap() {
    let start = grain(Vector3::new(0.0, 0.0, 1.1), Vector3::new(1.0, 0.0, -2.0), 0.1, 1.0);
    let scene = Scene { surface: vec![floor()], laws: rough(0.5, 0.3), ..Scene::of(vec![start]) };
    let before = Body { mass: 1.0, radius: 0.1, velocity: start.velocity, spin: Vector3::zeros() };
    let after = resolve_surface(&scene.laws.surface, &before, Vector3::z(), Vector3::zeros()).after;
    for gamma in [1e-2, 1e-5, 1e-8] {
        let outcome = run(&scene, overlap(gamma), 1.0);
        let (flight, grain) = outcome.states[0];
        assert!((flight.velocity - after.velocity).amax() < 1e-15);
        assert!((grain.spin - after.spin).amax() < 1e-14);
        let exact = Vector3::new(0.5 + 0.5 * after.velocity.x, 0.0, 0.1 + 0.5 * after.velocity.z);
        let late = (flight.position - exact).norm() / 0.1;
        // The two velocities differ by 3 m/s along the normal and less across it, at 2 m/s.
        assert!(late < 2.0 * gamma + 1e-13 && late > 0.01 * gamma, "{late:e} radii of {gamma:e}");
        assert!(outcome.ledger.max_overlap_over_radius() <= gamma);
        assert!(outcome.ledger.relative_energy_residual().abs() < 1e-15);
    }
}

#[test]
fn no_step_leaves_more_than_the_overlap_that_is_allowed() {
    for gamma in [5e-2, 1e-3, 1e-6] {
        let outcome = run(&jet(), overlap(gamma), END);
        assert!(outcome.log.grain_hits() > 20 && outcome.log.surface_hits() > 20);
        let overlap = outcome.ledger.max_overlap_over_radius();
        assert!(overlap <= gamma && overlap > 0.3 * gamma, "{overlap:e} of {gamma:e}");
    }
}

/// The error of a jet without forces comes from late contacts only.
#[test]
fn a_jet_comes_to_the_event_driven_answer_as_the_overlap_goes_to_zero() {
    let exact = jet().run(END, END);
    let mut points = Vec::new();
    for gamma in [1e-5, 1e-6, 1e-7, 1e-8] {
        let outcome = run(&jet(), overlap(gamma), END);
        assert_eq!(outcome.log.grain_hits(), exact.log.grain_hits());
        assert_eq!(outcome.log.surface_hits(), exact.log.surface_hits());
        points.push((gamma.ln(), apart(&outcome.states, &exact.states).ln()));
    }
    let order = slope(&points);
    eprintln!("errors {:?}, order {order}", points.iter().map(|point| point.1.exp()).collect::<Vec<_>>());
    assert!((order - 1.0).abs() < 0.15, "order {order}");
    assert!(points[3].1.exp() < 1e-4 * END);
}

/// Eight grains that attract each other and do not collide.
fn cluster() -> Scene {
    Scene { near_field: Some(attraction(0.05)), ..Scene::of(block(2, 0.1, 1.0, 0.3)) }
}

#[test]
fn steps_are_of_first_order_in_a_smooth_near_field() {
    let exact = cluster().run(2e-4, 0.8);
    assert!(exact.log.0.is_empty());
    let states = |step: f64| run(&cluster(), fixed(step), 0.8).states;
    let [places, velocities] = orders(8, 0.8, states, Some(exact.states));
    assert!((places - 1.0).abs() < 0.05, "positions: order {places}");
    assert!((velocities - 1.0).abs() < 0.05, "velocities: order {velocities}");
}

#[test]
fn a_looser_tolerance_gives_a_larger_error() {
    let exact = cluster().run(2e-4, 0.8).states;
    // The step is that of TOL^(1/(2 k_d)), so the error too.
    let errors = [1e-4, 1e-8, 1e-12].map(|tolerance| {
        let outcome = run(&cluster(), Settings { tolerance, iterations: 2, ..Settings::default() }, 0.8);
        (apart(&outcome.states, &exact), outcome.steps.count)
    });
    eprintln!("{errors:?}");
    assert!(errors.is_sorted_by(|one, next| one.0 > 4.0 * next.0 && one.1 < next.1), "{errors:?}");
}

/// A jet whose grains attract each other, collide and hit the floor.
fn near_field_jet() -> Scene {
    let gravity = Vector3::z() * -2.0;
    Scene { near_field: Some(attraction(0.01)), gravity, ..jet() }
}

#[test]
fn a_jet_with_near_field_comes_to_the_event_driven_answer_with_step_and_overlap() {
    let exact = near_field_jet().run(2e-5, END);
    let mut points = Vec::new();
    for step in [4e-5, 2e-5, 1e-5, 5e-6] {
        let settings = Settings { overlap: 1e-3 * step, ..fixed(step) };
        let outcome = run(&near_field_jet(), settings, END);
        points.push((step.ln(), apart(&outcome.states, &exact.states).ln()));
        assert!(outcome.ledger.relative_momentum_residual() < 1e-12);
    }
    let order = slope(&points);
    eprintln!("errors {:?}, order {order}", points.iter().map(|point| point.1.exp()).collect::<Vec<_>>());
    assert!((order - 1.0).abs() < 0.3, "order {order}");
}

/// Impulses found in one step add up (PHYSICS 0.21): a ball that comes between two that touch, at 30 degrees to either side, leaves with all three
/// having 7/4 of its energy; one between two that squeeze it stops, and so do they. The ledger names it.
#[test]
fn added_impulses_gain_three_quarters_of_the_energy_or_lose_all_of_it() {
    let law = smooth(1.0, 1.0);
    let (side, ahead) = (0.1, 0.1 * 3f64.sqrt());
    let at = |x: f64, y: f64, speed: f64| grain(Vector3::new(x, y, 0.0), Vector3::x() * speed, 0.1, 1.0);
    let wedge = [at(-0.05, 0.0, 1.0), at(ahead, side, 0.0), at(ahead, -side, 0.0)];
    let squeeze = [at(-0.3, 0.0, 1.0), at(0.0, 0.0, 0.0), at(0.3, 0.0, -1.0)];
    for (grains, energies) in [(wedge, [0.5, 0.875]), (squeeze, [1.0, 0.0])] {
        let outcome = run(&Scene { laws: law, ..Scene::of(grains.to_vec()) }, overlap(1e-9), 0.5);
        assert_eq!(outcome.log.grain_hits(), 2);
        let after = outcome.ledger.inside().energy();
        assert!((after - energies[1]).abs() < 1e-8, "{after} J of {} J", energies[0]);
        let residual = outcome.ledger.energy_residual();
        assert!((residual - (energies[0] - energies[1])).abs() < 1e-8, "{residual} J");
        assert!(outcome.ledger.relative_momentum_residual() < 1e-14);
    }
    // One after the other they keep it.
    let exact = Scene { laws: law, ..Scene::of(wedge.to_vec()) }.run(0.5, 0.5);
    assert!((exact.ledger.inside().energy() - 0.5).abs() < 1e-14);
}

/// What a grain loses on the way that would come back in an orbit: implicit Euler damps, to first order in the step.
#[test]
fn the_ledger_tells_what_implicit_steps_damp() {
    let residuals = [2e-2, 1e-2, 5e-3].map(|step| {
        let ledger = run(&cluster(), fixed(step), 0.8).ledger;
        assert!(ledger.relative_momentum_residual() < 1e-13);
        ledger.relative_energy_residual()
    });
    eprintln!("{residuals:?}");
    for pair in residuals.windows(2) {
        assert!(pair[1] > 0.0 && (pair[0] / pair[1] - 2.0).abs() < 0.2, "{residuals:?}");
    }
}

/// Nothing bears a force in a step but impulses, and they are worked out before it acts.
#[test]
fn what_should_rest_under_gravity_sinks() {
    let rest = grain(Vector3::z() * (0.1 - 1e-6), Vector3::zeros(), 0.1, 1.0);
    let (step, g, e) = (1e-3, 9.81, 0.5);
    let gravity = Vector3::z() * -g;
    let scene = Scene { surface: vec![floor()], laws: smooth(1.0, e), gravity, ..Scene::of(vec![rest]) };
    let outcome = run(&scene, Settings { overlap: 1.0, ..fixed(step) }, 0.1);
    let sunk = 0.1 - outcome.states[0].0.position.z;
    let expected = 0.1 * step * g / (1.0 + e);
    assert!((sunk / expected - 1.0).abs() < 0.05, "{sunk} m, {expected} m");
}

/// Predictions see what gravity adds within the step: from rest, (41) alone would let it fall as far as the run goes on.
#[test]
fn a_fall_from_rest_does_not_pass_the_floor() {
    let high = grain(Vector3::z() * 20.0, Vector3::zeros(), 0.1, 1.0);
    let gravity = Vector3::z() * -10.0;
    let scene = Scene { surface: vec![floor()], laws: smooth(1.0, 0.5), gravity, ..Scene::of(vec![high]) };
    let outcome = run(&scene, Settings::default(), 3.0);
    let Some(Hit::Surface(first)) = outcome.log.0.first() else { panic!("no hit: {:?}", outcome.states) };
    assert!(first.overlap_over_radius <= 2.0 * Settings::default().overlap, "{first:?}");
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let mut grains = block(7, 0.1, 0.24, 1.0);
    grains.iter_mut().for_each(|grain| grain.position.z += 1.0);
    let scene = Scene {
        surface: vec![floor()],
        laws: rough(0.9, 0.3),
        near_field: Some(attraction(1e-3)),
        gravity: Vector3::z() * -2.0,
        ..Scene::of(grains)
    };
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| run(&scene, Settings::default(), 0.5))
    });
    assert!(one.log.grain_hits() > 100 && one.log.surface_hits() > 10);
    assert_eq!(one.states, two.states);
    assert_eq!(one.log.0, two.log.0);
}

#[test]
fn a_mesh_is_hit_where_the_plane_is() {
    let plane = run(&jet(), overlap(1e-8), END);
    let mesh = run(&Scene { surface: vec![mesh_floor(20.0)], ..jet() }, overlap(1e-8), END);
    assert_eq!(plane.log.0.len(), mesh.log.0.len());
    assert!(apart(&plane.states, &mesh.states) < 1e-5);
}

#[test]
fn each_interference_has_the_collisions_of_the_event_driven_scheme() {
    use Interference::{All, FirstOrder, None, RemovedOnFirstCollision};
    let mut counts = Vec::new();
    for interference in [All, FirstOrder, RemovedOnFirstCollision, None] {
        let mut scene = jet();
        scene.laws.interference = interference;
        let (outcome, exact) = (run(&scene, overlap(1e-8), END), scene.run(END, END));
        assert_eq!(outcome.log.grain_hits(), exact.log.grain_hits(), "{interference:?}");
        assert_eq!(outcome.log.surface_hits(), exact.log.surface_hits(), "{interference:?}");
        assert_eq!(outcome.states.len(), exact.states.len());
        assert!(apart(&outcome.states, &exact.states) < 1e-4);
        counts.push(outcome.log.0.len());
    }
    counts.dedup();
    assert_eq!(counts.len(), 4, "{counts:?}");
}

/// The hits of an elastic gas are pairs, so it keeps its energy but for the few that share a grain in one step.
#[test]
fn a_periodic_gas_keeps_momentum_and_nearly_its_energy() {
    let (grains, domain) = common::gas(6, 0.2, 1);
    let scene = Scene { domain, ..Scene::of(grains) };
    let outcome = run(&scene, overlap(1e-6), 2.0);
    assert!(outcome.log.grain_hits() > 500, "{}", outcome.log.grain_hits());
    assert!(outcome.ledger.relative_momentum_residual() < 1e-13);
    assert!(outcome.ledger.relative_energy_residual().abs() < 1e-3);
}

/// Looking cuts steps short, so it changes a run, but no more than its errors.
#[test]
fn looks_change_a_run_by_no_more_than_its_error() {
    let plain = run(&jet(), overlap(1e-8), END);
    let looked = run_looking(&jet(), overlap(1e-8), END, 100);
    assert!(looked.steps.count > plain.steps.count);
    assert!(apart(&plain.states, &looked.states) < 1e-5);
    let kinds = |log: &Log| log.0.iter().map(|hit| matches!(hit, Hit::Grains(_))).collect::<Vec<_>>();
    assert_eq!(kinds(&plain.log), kinds(&looked.log));
}

#[test]
fn grains_that_leave_an_open_domain_are_gone() {
    let mut scene = jet();
    scene.domain = Domain { min: Vector3::repeat(-0.6), max: Vector3::new(0.6, 0.6, 2.0), ..Domain::unbounded() };
    let outcome = run(&scene, Settings::default(), 5.0);
    assert!(outcome.ledger.left().count() > 10);
    assert!(outcome.ledger.relative_mass_residual().abs() < 1e-14);
    assert!(outcome.ledger.relative_momentum_residual() < 1e-12);
}
