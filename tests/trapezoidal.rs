//! The phi-method (Mukherjee & Zohdi 2015, section 3) against closed forms, the event-driven scheme, and what the paper prints.

mod common;

use std::ops::ControlFlow;

use common::forced::{Scene, attraction, block, floor, mesh_floor, orders, rough};
use common::{Hit, Log, grain, smooth};
use impinge::grains::{Grain, NewGrain};
use impinge::near_field::{ForceSum, Method};
use impinge::observe::{Ledger, SurfaceEnergy};
use impinge::scene::{self, Overrides, SceneFile};
use impinge::scheme::stepped::{Crowd, Stepped, Steps};
use impinge::scheme::trapezoidal::Trapezoidal;
use impinge::scheme::{Broken, Forces, Observer as _};
use impinge::simulation::Simulation;
use impinge::surface::Surface;
use impinge_events::{Domain, Flight};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};

/// A tolerance that leaves of the iteration only rounding.
const TIGHT: f64 = 1e-14;

struct Outcome {
    states: Vec<(Flight, Grain)>,
    log: Log,
    ledger: Ledger,
}

/// `scene` in steps of `step` (s) until `until` (s).
fn try_run(scene: &Scene, phi: f64, step: f64, until: f64) -> Result<Outcome, Broken> {
    let surface = Surface::new(&scene.surface, ".".as_ref()).expect("a surface");
    let sum = |law| ForceSum::new(law, Method::Direct, &scene.domain).expect("a sum that suits the domain");
    let forces = Forces { gravity: scene.gravity, near_field: scene.near_field.map(sum), contact_time: 0.0 };
    let crowd = Crowd::new(&scene.grains, surface, scene.domain, scene.laws, forces, 0.0);
    let settings = scene::Trapezoidal { step: Some(step), phi, tolerance: TIGHT };
    let mut run = Stepped::new(crowd, Trapezoidal::new(&settings, 0.0));
    let mut observers = (Log::default(), Ledger::default());
    for end in [0.0, until] {
        assert!(run.advance(end, &mut observers, &mut |_| ControlFlow::Continue(()))?.is_continue());
        run.tell(&mut observers)?;
        run.crowd().snapshot(end, |snapshot| observers.sample(snapshot));
    }
    let states = run
        .crowd()
        .snapshot(until, |snapshot| snapshot.flights.iter().copied().zip(snapshot.grains.iter().copied()).collect());
    Ok(Outcome { states, log: observers.0, ledger: observers.1 })
}

fn run(scene: &Scene, phi: f64, step: f64, until: f64) -> Outcome {
    try_run(scene, phi, step, until).expect("no broken invariant")
}

/// One grain of radius 1/2 m at `height` (m), which falls at `speed` (m/s).
fn falling(height: f64, speed: f64, restitution: f64) -> Scene {
    let grains = vec![grain(Vector3::z() * height, Vector3::z() * -speed, 0.5, 1.0)];
    Scene { surface: vec![floor()], laws: smooth(restitution, restitution), ..Scene::of(grains) }
}

/// Largest difference of the positions (m) and of the velocities (m/s).
fn apart(one: &[(Flight, Grain)], other: &[(Flight, Grain)]) -> [f64; 2] {
    assert_eq!(one.len(), other.len());
    let pairs = || one.iter().zip(other).map(|((a, _), (b, _))| (a, b));
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    [
        largest(&mut pairs().map(|(a, b)| (a.position - b.position).norm())),
        largest(&mut pairs().map(|(a, b)| (a.velocity - b.velocity).norm())),
    ]
}

/// PHYSICS 2.20: with h/2 of (42) and (44) as printed a grain flies half as far and gets half as fast.
#[test]
fn free_flight_is_exact_where_the_printed_equations_halve_it() {
    const STEPS: u32 = 64;
    let step = 1.0 / f64::from(STEPS);
    let printed = |phi: f64, mut v: f64, force: f64| {
        let mut x = 0.0;
        for _ in 0..STEPS {
            let before = v;
            v += step / 2.0 * (phi * force + (1.0 - phi) * force);
            x += step / 2.0 * (phi * v + (1.0 - phi) * before);
        }
        [x, v]
    };
    for phi in [0.0, 0.25, 0.5, 1.0] {
        assert_eq!(printed(phi, 1.0, 0.0), [0.5, 1.0]);
        let scene = Scene::of(vec![grain(Vector3::y(), Vector3::new(1.0, 0.0, -0.75), 0.5, 1.0)]);
        let (flight, _) = run(&scene, phi, step, 1.0).states[0];
        assert_eq!(flight.position, Vector3::new(1.0, 1.0, -0.75));
    }
    assert_eq!(printed(0.5, 0.0, 1.0), [0.125, 0.5]);
    let scene = Scene { gravity: Vector3::x(), ..Scene::of(vec![grain(Vector3::zeros(), Vector3::zeros(), 0.5, 1.0)]) };
    let (flight, _) = run(&scene, 0.5, step, 1.0).states[0];
    assert_eq!((flight.position, flight.velocity), (Vector3::x() * 0.5, Vector3::x()));
}

/// PHYSICS 2.21: with the impulse of Algorithm 1 taken from the current iterate a grain hardly rebounds, and it takes more than a hundred sweeps to say so.
#[test]
fn restitution_is_exact_where_algorithm_1_has_none() {
    for e in [0.0f64, 0.5, 0.8, 1.0] {
        let before: f64 = -1.0;
        let (mut v, mut sweeps): (f64, u32) = (before, 0);
        loop {
            let next = before + 0.5 * (-(1.0 + e) * v - (1.0 + e) * before);
            sweeps += 1;
            if (next - v).abs() < 1e-12 || sweeps > 2000 {
                break;
            }
            v = next;
        }
        match e < 1.0 {
            true => assert!((v + (1.0 - e) / (3.0 + e)).abs() < 1e-11, "{e}: {v}"),
            false => assert!(sweeps > 2000, "an elastic hit goes to and fro"),
        }
        assert!(e < 0.8 || sweeps > 100, "{sweeps}");

        for phi in [0.0, 0.3, 0.5, 1.0] {
            for phase in [0.1, 0.5, 0.9] {
                let step = 0.125;
                let outcome = run(&falling(0.5 + (3.0 + phase) * step, 1.0, e), phi, step, 1.0);
                assert!((outcome.states[0].0.velocity.z - e).abs() < 1e-15);
                let [Hit::Surface(hit)] = &outcome.log.0[..] else { panic!("{:?}", outcome.log) };
                assert!((hit.impulse_normal - (1.0 + e)).abs() < 1e-15 && hit.order == 1);
                assert!(outcome.ledger.relative_energy_residual().abs() < 1e-15);
                assert!(outcome.ledger.relative_momentum_residual() < 1e-15);
            }
        }
    }
}

/// The grain turns round where the velocities of (44) have it, (1 - phi) h into the step: that is the only error of a bounce.
#[test]
fn a_bounce_is_misplaced_by_its_distance_from_the_weighted_middle_of_the_step() {
    let (step, until) = (0.125, 1.0);
    for e in [0.0, 0.5, 1.0] {
        for phi in [0.25, 0.5, 0.75, 1.0] {
            for phase in [0.03125, 0.25, 0.5, 0.75, 0.96875] {
                let hit = (3.0 + phase) * step;
                let outcome = run(&falling(0.5 + hit, 1.0, e), phi, step, until);
                let exact = 0.5 + e * (until - hit);
                let expected = (1.0 + e) * (phase - (1.0 - phi)) * step;
                // All numbers are short binary fractions.
                assert_eq!(outcome.states[0].0.position.z - exact, expected, "e {e}, phi {phi}, phase {phase}");
            }
        }
    }
}

/// PHYSICS 2.19: by the absolute distance of (41) a grain that is past the plane at the end of the step is in no contact, or is pushed on.
#[test]
fn a_grain_past_the_plane_comes_back() {
    let (height, speed, step) = (1.2, 1.0, 2.0);
    let past: f64 = height - speed * step;
    assert!(past.abs() - 0.5 > 0.0, "no contact as printed");
    let outcome = run(&falling(height, speed, 0.8), 0.5, step, 2.0 * step);
    assert!((outcome.states[0].0.velocity.z - 0.8).abs() < 1e-15);
    assert_eq!(outcome.log.surface_hits(), 1);
    let Hit::Surface(hit) = &outcome.log.0[0] else { panic!("a hit") };
    assert_eq!(hit.normal, Vector3::z());
}

/// PHYSICS 2.23: two grains that fly the same way, one into the other, approach; both have v·n of the same sign.
#[test]
fn a_grain_that_is_caught_up_with_is_hit() {
    let at = |x: f64, v: f64| grain(Vector3::x() * x, Vector3::x() * v, 0.5, 1.0);
    let scene = Scene { laws: smooth(0.5, 1.0), ..Scene::of(vec![at(0.0, 3.0), at(1.5, 1.0)]) };
    let outcome = run(&scene, 0.5, 0.01, 1.0);
    assert_eq!(outcome.log.grain_hits(), 1);
    let speeds: Vec<f64> = outcome.states.iter().map(|(flight, _)| flight.velocity.x).collect();
    assert!((speeds[0] - 1.5).abs() < 1e-15 && (speeds[1] - 2.5).abs() < 1e-15, "{speeds:?}");
}

/// What rounding leaves of the approach is none: an overlap does not go away, and grains that fly on side by side would collide in every step.
#[test]
fn restitution_0_ends_a_contact_that_stays_an_overlap() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    for _ in 0..100 {
        let mut vector = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        let (normal, stream) = (vector().normalize(), vector());
        let grains = vec![grain(normal * -0.7, stream + normal, 0.5, 1.0), grain(normal * 0.7, stream, 0.5, 2.0)];
        let outcome = run(&Scene { laws: smooth(0.0, 0.0), ..Scene::of(grains) }, 0.5, 0.03, 10.0);
        assert_eq!(outcome.log.grain_hits(), 1);
        assert!(outcome.log.largest_miss() > 1e-3);
    }
}

/// Two grains of 2 kg on an ellipse about each other, which takes some 26 s.
fn ellipse() -> Scene {
    let at = |x: f64, v: f64| grain(Vector3::x() * x, Vector3::z() * v, 0.5, 2.0);
    Scene { near_field: Some(attraction(1.0)), ..Scene::of(vec![at(-1.25, -0.3), at(1.25, 0.3)]) }
}

#[test]
fn smooth_motion_is_of_second_order_at_one_half_and_of_first_elsewhere() {
    let until = 10.0;
    let reference = ellipse().run(until / 400_000.0, until);
    assert_eq!(reference.log.0.len(), 0);
    for (phi, order) in [(0.5, 2.0), (1.0, 1.0), (0.0, 1.0), (0.75, 1.0)] {
        let states = |step| run(&ellipse(), phi, step, until).states;
        let found = orders(50, until, states, Some(reference.states.clone()));
        eprintln!("phi {phi}: orders {found:.3?}");
        assert!(found.iter().all(|found| (found - order).abs() < 0.1), "phi {phi}: orders {found:?}, not {order}");
    }
}

/// Section 2.7 of the paper: velocities at the end are those of the closed form whatever the step, and places come nearer with it.
#[test]
fn two_grains_and_a_wall_converge_to_the_event_driven_answer() {
    let at = |z: f64| grain(Vector3::z() * z, Vector3::z() * -1.0, 0.5, 1.0);
    for (e, hits) in [(0.5, [2, 2]), (0.3, [2, 3]), (0.8, [2, 2])] {
        let scene = Scene { surface: vec![floor()], laws: smooth(e, e), ..Scene::of(vec![at(1.3), at(2.7)]) };
        let until = 20.0;
        let exact = scene.run(1.0, until);
        assert_eq!([exact.log.grain_hits(), exact.log.surface_hits()], hits);
        for phi in [0.0, 0.5, 1.0] {
            for steps in [997, 9973, 99_991] {
                let step = until / f64::from(steps);
                let outcome = run(&scene, phi, step, until);
                assert_eq!([outcome.log.grain_hits(), outcome.log.surface_hits()], hits);
                let [places, velocities] = apart(&outcome.states, &exact.states);
                // Of the order of a step of flight a hit, six hits in all, and two steps where phi = 0 finds them a step late.
                assert!(
                    places < 6.0 * step && velocities < 1e-14,
                    "e {e}, phi {phi}, {step}: {places:e} {velocities:e}"
                );
                assert!(outcome.ledger.relative_energy_residual().abs() < 1e-14);
            }
        }
    }
}

/// 27 grains that fall on a floor and bounce off it and each other, with friction.
fn shower() -> Scene {
    let mut grains = block(3, 0.1, 0.5, 0.5);
    for grain in &mut grains {
        grain.position.z += 1.0;
        grain.velocity.z -= 2.0;
    }
    Scene { surface: vec![floor()], laws: rough(0.8, 0.3), ..Scene::of(grains) }
}

#[test]
fn a_shower_converges_to_the_event_driven_answer() {
    let until = 0.8;
    let exact = shower().run(0.1, until);
    let hits = |log: &Log| [log.grain_hits(), log.surface_hits()];
    let mut errors = Vec::new();
    for steps in [8_009, 64_007, 512_009] {
        let outcome = run(&shower(), 0.5, until / f64::from(steps), until);
        errors.push(apart(&outcome.states, &exact.states));
        eprintln!("{steps} steps: {:?} of {:?} hits, errors {:?}", hits(&outcome.log), hits(&exact.log), errors.last());
        assert_eq!(hits(&outcome.log), hits(&exact.log));
        assert!(outcome.ledger.relative_energy_residual().abs() < 1e-14, "no grain has two contacts in a step");
        assert!(outcome.ledger.relative_momentum_residual() < 1e-14);
    }
    assert!(hits(&exact.log)[0] > 3 && hits(&exact.log)[1] > 20);
    for pair in errors.windows(2) {
        let [coarse, fine] = [pair[0], pair[1]];
        assert!((0..2).all(|of| fine[of] < 0.3 * coarse[of]), "an eighth of the step: {errors:?}");
    }
    assert!(errors[2].iter().all(|&error| error < 2e-4), "{errors:?}");
}

/// A grain over an inner edge of a mesh gets one impulse, not one from each triangle that iterates see it on.
#[test]
fn a_mesh_is_hit_like_a_plane() {
    let on = |surface| run(&Scene { surface: vec![surface], ..shower() }, 0.5, 1e-3, 1.0);
    let (plane, mesh) = (on(floor()), on(mesh_floor(20.0)));
    assert_eq!(plane.log.surface_hits(), mesh.log.surface_hits());
    let [places, velocities] = apart(&plane.states, &mesh.states);
    assert!(places < 1e-12 && velocities < 1e-12, "{places:e} {velocities:e}");
}

/// (43) adds up what each contact asks for by itself (PHYSICS 0.21): three lossless grains that meet at once stop, and the ledger shows it.
#[test]
fn contacts_at_once_are_added_up_and_their_error_is_in_the_ledger() {
    let at = |x: f64, v: f64| grain(Vector3::x() * x, Vector3::x() * v, 0.5, 1.0);
    let outcome = run(&Scene::of(vec![at(-1.25, 1.0), at(0.0, 0.0), at(1.25, -1.0)]), 0.5, 0.5, 1.0);
    assert_eq!(outcome.log.grain_hits(), 2);
    assert!(outcome.states.iter().all(|(flight, _)| flight.velocity == Vector3::zeros()));
    assert_eq!(outcome.ledger.relative_energy_residual(), 1.0);
}

/// Impulses of forces are those that were given; the energy that steps with contacts gain or lose is of the first order.
#[test]
fn books_under_forces_close() {
    let gravity = Vector3::new(0.1, 0.0, -1.0);
    let scene = Scene { near_field: Some(attraction(1e-3)), gravity, laws: smooth(0.8, 0.8), ..shower() };
    let residuals = [2e-3, 2.5e-4].map(|step| {
        let outcome = run(&scene, 0.5, step, 1.0);
        assert!(outcome.log.surface_hits() > 20);
        assert!(
            outcome.ledger.relative_momentum_residual() < 1e-13,
            "{:e}",
            outcome.ledger.relative_momentum_residual()
        );
        outcome.ledger.relative_energy_residual().abs()
    });
    eprintln!("{residuals:?}");
    assert!(residuals[1] < 1e-3 && residuals[1] < 0.2 * residuals[0], "{residuals:?}");

    // Without a contact, the trapezoidal rule does the work of gravity exactly.
    let free = Scene { grains: shower().grains, gravity, ..Scene::of(Vec::new()) };
    assert!(run(&free, 0.5, 1e-2, 0.2).ledger.relative_energy_residual().abs() < 1e-14);
}

#[test]
fn threads_do_not_change_bits() {
    let scene = Scene { near_field: Some(attraction(1e-3)), grains: block(8, 0.1, 0.3, 1.0), ..shower() };
    let [one, two, three] = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| run(&scene, 0.5, 2e-3, 0.1)).states
    });
    assert!(one == two && one == three);
}

/// With a step in which the field changes by more than itself no iteration helps, and the run says so.
#[test]
fn a_step_that_does_not_converge_stops_the_run() {
    let broken = try_run(&ellipse(), 1.0, 8.0, 80.0).err();
    assert!(matches!(broken, Some(Broken::Unconverged { .. })), "{broken:?}");
    let message = broken.map(|broken| broken.to_string());
    assert!(message.is_some_and(|message| message.contains("does not converge")));
}

/// The jet of `examples/erosive_jet.toml` with 500 grains.
fn jet(set: &[&str]) -> (Ledger, SurfaceEnergy, Steps) {
    let mut all = vec!["run.scheme=trapezoidal".to_owned(), "source[0].count=500".to_owned()];
    all.extend(set.iter().map(|&set| set.to_owned()));
    let overrides = Overrides { set: all, ..Overrides::default() };
    let file =
        SceneFile::read("examples/erosive_jet.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = Simulation::new(&file.scene, file.folder()).unwrap_or_else(|error| panic!("{error}"));
    let mut observed = (Ledger::default(), SurfaceEnergy::default());
    simulation.run(&mut observed, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"));
    let (ledger, surface) = observed;
    assert_eq!(ledger.left().count() + ledger.removed().count() + ledger.inside().count(), 500);
    assert!(ledger.relative_momentum_residual() < 1e-13 && ledger.relative_mass_residual().abs() < 1e-13);
    (ledger, surface, simulation.steps().expect("steps"))
}

/// All of what stands in the scene file, and what is left out: the step is chosen.
#[test]
fn interference_is_that_of_the_event_driven_scheme() {
    let (ledger, surface, steps) = jet(&["run.interference=all"]);
    assert!(steps.longest <= 0.05 * 0.01 / 80.0 && steps.longest > 0.049 * 0.01 / 80.0, "{steps:?}");
    assert!(steps.shortest > 0.5 * steps.longest, "samples and frames leave no splinters: {steps:?}");
    assert!(surface.by_order().len() > 2 && surface.repeated_hits() > 0.0);
    assert!(ledger.relative_energy_residual().abs() < 0.01, "{:e}", ledger.relative_energy_residual());

    let (ledger, surface, _) = jet(&["run.interference=none"]);
    assert_eq!((ledger.counts().grain_grain, ledger.counts().grain_surface, ledger.counts().first_hits), (0, 500, 500));
    assert!((surface.all_hits() / ledger.energy_brought_in() - 1.0).abs() < 1e-13);

    let (ledger, surface, _) = jet(&["run.interference=first-order"]);
    assert_eq!((surface.by_order().len(), ledger.counts().grain_surface), (1, ledger.counts().first_hits));
    assert!(ledger.counts().grain_grain > 100 && ledger.left().count() > 100);

    let (ledger, _, _) = jet(&["run.interference=removed-on-first-collision"]);
    assert_eq!((ledger.counts().grain_grain, ledger.dissipated_grain()), (0, 0.0));
    assert_eq!(ledger.counts().first_hits + ledger.removed().count(), 500);
}

/// Grains come from a nozzle into an empty scene, leave, and take their slots with them; the step is that of the nozzle.
#[test]
fn a_nozzle_feeds_the_scheme() {
    let scene: scene::Scene = toml::from_str(
        r#"
        run = { until = 0.5, scheme = "trapezoidal", gravity = [0, 0, -10] }
        domain = { min = [-1, -1, -0.5], max = [1, 1, 2] }
        grain = { radius = 0.05, density = 1000.0 }
        contact.surface.restitution = 0.8
        contact.grain.restitution = 0.8
        surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }]
        [[source]]
        kind = "nozzle"
        shape = { circle = { diameter = 0.6 } }
        centre = [0, 0, 1.9]
        axis = [0.3, 0, -1]
        speed = 10
        flow = { number_flux = 400 }
        "#,
    )
    .expect("a scene");
    let mut simulation = Simulation::new(&scene, ".".as_ref()).unwrap_or_else(|error| panic!("{error}"));
    let mut observed = (Log::default(), Ledger::default());
    simulation.run(&mut observed, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"));
    let (log, ledger) = observed;
    assert!(ledger.counts().grain_surface > 50 && ledger.left().count() > 10 && ledger.inside().count() > 10);
    assert!(ledger.relative_momentum_residual() < 1e-13 && ledger.relative_energy_residual().abs() < 1e-2);
    let steps = simulation.steps().expect("steps");
    // Before the first grain comes a step may be as long as it likes.
    assert!(steps.count > 1990 && steps.count < 2500, "{steps:?}");
    assert!(log.largest_miss() < 0.1, "{}", log.largest_miss());
}

/// In a periodic domain momentum stays to rounding, and grains find each other across its sides.
#[test]
fn a_periodic_gas_keeps_its_momentum() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(3);
    let mut grains: Vec<NewGrain> = block(4, 0.1, 0.3, 0.0);
    grains.iter_mut().for_each(|grain| grain.velocity = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0)));
    let half = Vector3::repeat(0.6);
    let domain = Domain { min: -half, max: half, periodic: true, planar: false };
    let scene = Scene { domain, laws: smooth(0.95, 1.0), ..Scene::of(grains) };
    let outcome = run(&scene, 0.5, 1e-3, 2.0);
    assert!(outcome.log.grain_hits() > 300, "{}", outcome.log.grain_hits());
    assert!(outcome.ledger.relative_momentum_residual() < 1e-13);
    assert!(outcome.states.iter().all(|(flight, _)| flight.position.amax() <= 0.6));
    assert!(outcome.log.largest_miss() < 0.05, "{}", outcome.log.largest_miss());
}

/// Between two iterates only grains in contact move, and only at them the scheme looks again: it sees what a look at all would.
#[test]
fn a_look_at_those_that_moved_sees_what_a_look_at_all_sees() {
    const AFTER: f64 = 0.01;
    const REACH: f64 = 0.05;
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let mut within = |most: f64| Vector3::from_fn(|_, _| random.random_range(-most..most));
    let place = |at: Vector3<f64>| Vector3::new(at.x, at.y, at.z.abs() + 0.3);
    let grains: Vec<NewGrain> = (0..200).map(|_| grain(place(within(6.0)), within(1.0), 0.5, 1.0)).collect();
    for target in [floor(), mesh_floor(20.0)] {
        let surface = Surface::new(&[target], ".".as_ref()).expect("a surface");
        let forces = Forces { gravity: Vector3::zeros(), near_field: None, contact_time: 0.0 };
        let mut crowd = Crowd::new(&grains, surface, Domain::unbounded(), smooth(1.0, 1.0), forces, 0.0);
        crowd.look(AFTER, REACH);
        let mut changes = [0; 2];
        for round in 0..60 {
            let moved: Vec<u32> = (0..9).map(|k| (7 * round + 31 * k) % 200).collect();
            for &slot in &moved {
                crowd.flights[slot as usize].position += within(0.3);
            }
            let before = (crowd.pairs().to_vec(), crowd.at_surface().to_vec());
            let mut all = crowd.clone();
            all.look(AFTER, REACH);
            crowd.look_again(&moved, AFTER, REACH);
            assert_eq!((crowd.pairs(), crowd.at_surface()), (all.pairs(), all.at_surface()), "round {round}");
            changes[0] += u32::from(crowd.pairs() != before.0);
            changes[1] += u32::from(crowd.at_surface() != before.1);
        }
        assert!(changes.iter().all(|&changes| changes > 5), "the test sees nothing change: {changes:?}");
    }
}
