//! Soft spheres: the restitution that is asked for, the misprints of the paper, and what they converge to.

use std::ops::ControlFlow;

use impinge::grains::{Grain, Snapshot};
use impinge::observe::{Ledger, SurfaceEnergy};
use impinge::scene::{Overrides, Scene, SceneFile, SoftSphere};
use impinge::scheme::soft_sphere::{Hertz, effective_modulus};
use impinge::scheme::{GrainCollision, Observer, SurfaceHit};
use impinge::simulation::Simulation;
use impinge_events::Flight;
use nalgebra::Vector3;

/// A hundred steps a contact.
const STEPS: &str = "soft_sphere.step_fraction=0.01";
const RADIUS: f64 = 0.01;
const DENSITY: f64 = 8500.0;
const MASS: f64 = DENSITY * 4.0 / 3.0 * std::f64::consts::PI * RADIUS * RADIUS * RADIUS;

/// What a run told, and how it ended.
#[derive(Default)]
struct Told {
    collisions: Vec<GrainCollision>,
    hits: Vec<SurfaceHit>,
    ledger: Ledger,
    surface: SurfaceEnergy,
    flights: Vec<Flight>,
    grains: Vec<Grain>,
}

impl Observer for Told {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.collisions.push(*collision);
        self.ledger.grain_collision(collision);
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.hits.push(*hit);
        self.ledger.surface_hit(hit);
        self.surface.surface_hit(hit);
    }

    fn kick(&mut self, kick: &impinge::scheme::Kick) {
        self.ledger.kick(kick);
    }

    fn passage(&mut self, passage: impinge::scheme::Passage, time: f64, flight: &Flight, grain: &Grain) {
        self.ledger.passage(passage, time, flight, grain);
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.ledger.sample(snapshot);
        self.flights = snapshot.flights.to_vec();
        self.grains = snapshot.grains.to_vec();
    }
}

fn scene(text: &str, set: &[String]) -> Scene {
    let overrides = Overrides { set: set.to_vec(), ..Overrides::default() };
    SceneFile::parse("scene.toml".as_ref(), text, &overrides).unwrap_or_else(|error| panic!("{error}")).scene
}

fn run(scene: &Scene) -> Told {
    let mut told = Told::default();
    let mut simulation = Simulation::new(scene, ".".as_ref()).unwrap_or_else(|error| panic!("{error}"));
    let outcome =
        simulation.run(&mut told, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(outcome.time, scene.run.until);
    told
}

/// One lattice of grains, one plane at z = 0, no friction; what differs is set.
const BASE: &str = r#"
    run = { until = 0.1, scheme = "soft-sphere" }
    domain = { min = [-10, -10, -10], max = [10, 10, 10] }
    grain = { radius = 0.01, density = 8500.0 }
    contact.grain.restitution = 0.8
    contact.surface.restitution = 0.8
    soft_sphere = { young_modulus = 1e10 }
    output.samples = 2
    surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }]
    source = []
"#;

/// A source of one grain.
fn one(place: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> String {
    let [min, max] = [-1e-9, 1e-9].map(|by| place.map(|x| x + by));
    format!(
        "{{ kind = 'lattice', min = {min:?}, max = {max:?}, cells = [1, 1, 1], velocity = {velocity:?}, spin = {spin:?} }}"
    )
}

fn with(sources: &[String], set: &[&str]) -> Scene {
    let sources = format!("source=[{}]", sources.join(", "));
    scene(BASE, &[sources].into_iter().chain(set.iter().map(|&text| text.to_owned())).collect::<Vec<_>>())
}

fn set(key: &str, value: f64) -> String {
    format!("{key}={value:e}")
}

/// A grain that falls on the plane, or on another grain that comes to meet it, at `speed` (m/s) in all; it touches after `before` seconds.
fn impact(speed: f64, pair: bool, more: &[&str]) -> Told {
    let before = RADIUS / speed;
    let until = set("run.until", 4.0 * before);
    let more: Vec<&str> = more.iter().copied().chain([until.as_str()]).collect();
    if pair {
        let grain = |sign: f64| one([0.0, 0.0, 5.0 + sign * 1.5 * RADIUS], [0.0, 0.0, -0.5 * sign * speed], [0.0; 3]);
        run(&with(&[grain(1.0), grain(-1.0)], &more))
    } else {
        run(&with(&[one([0.0, 0.0, 2.0 * RADIUS], [0.0, 0.0, -speed], [0.0; 3])], &more))
    }
}

/// With a hundred steps a contact; with the fifty of the default e is 0.7982 to 0.8015, as damping begins with the fourth root of the overlap.
#[test]
fn restitution_is_what_is_asked_for_over_three_decades_of_speed() {
    for speed in [0.1, 1.0, 10.0, 80.0] {
        let wall = impact(speed, false, &[STEPS]);
        let restitution = wall.flights[0].velocity.z / speed;
        assert!((restitution - 0.8).abs() < 1e-3, "{restitution} at the surface at {speed} m/s");
        let pair = impact(speed, true, &[STEPS]);
        let restitution = (pair.flights[0].velocity.z - pair.flights[1].velocity.z).abs() / speed;
        assert!((restitution - 0.8).abs() < 1e-3, "{restitution} between grains at {speed} m/s");
        assert_eq!((wall.hits.len(), pair.collisions.len()), (1, 1));
        approx::assert_relative_eq!(wall.hits[0].approach_speed, speed, max_relative = 1e-12);
        approx::assert_relative_eq!(pair.collisions[0].approach_speed, speed, max_relative = 1e-12);
        // The grain brings its energy at the first touch, and the contact dissipates 1 - e² of it.
        approx::assert_relative_eq!(wall.hits[0].energy(), 0.5 * MASS * speed * speed, max_relative = 1e-12);
        let lost = pair.collisions[0].dissipated / (0.25 * MASS * speed * speed);
        assert!((lost - 0.36).abs() < 5e-3, "{lost}");
    }
}

#[test]
fn a_contact_lasts_as_long_as_hertz_has_it_and_goes_as_deep() {
    let modulus = effective_modulus(1e10, 0.3);
    let elastic = ["contact.surface.restitution=1", "contact.grain.restitution=1", "soft_sphere.step_fraction=0.002"];
    for speed in [1.0, 10.0] {
        let told = impact(speed, false, &elastic);
        let hertz = Hertz::new(modulus, MASS, RADIUS, 1.0);
        // It touches after one radius of flight, stays, and goes on.
        let end = 4.0 * RADIUS / speed;
        let stayed = end - RADIUS / speed - (told.flights[0].position.z - RADIUS) / told.flights[0].velocity.z;
        approx::assert_relative_eq!(stayed, hertz.duration(speed), max_relative = 2e-3);
        approx::assert_relative_eq!(
            told.hits[0].overlap_over_radius * RADIUS,
            hertz.deepest(speed),
            max_relative = 1e-3
        );
    }
}

#[test]
fn overlap_goes_with_the_speed_to_four_fifths() {
    for pair in [false, true] {
        let deepest = |speed| impact(speed, pair, &[]).ledger.max_overlap_over_radius();
        approx::assert_relative_eq!(deepest(10.0) / deepest(1.0), 10f64.powf(0.8), max_relative = 5e-3);
    }
}

/// Sticking: 5/7 of the speed along the surface is left, and the contact point no longer slips; sliding: mu (1 + e) v_n is lost. (3) as printed,
/// without the arm, would give a spin that is no rate of rotation at all.
#[test]
fn friction_gives_the_impulses_of_the_law_and_turns_grains_with_its_arm() {
    for (along, sticks) in [(2.0, true), (40.0, false)] {
        let friction = "contact.surface.friction=0.3";
        let start = one([0.0, 0.0, 2.0 * RADIUS], [along, 0.0, -10.0], [0.0; 3]);
        let told = run(&with(&[start], &[friction, "run.until=0.004", "soft_sphere.step_fraction=0.005"]));
        let (velocity, spin) = (told.flights[0].velocity, told.grains[0].spin);
        let expected = if sticks { along * 5.0 / 7.0 } else { along - 0.3 * 1.8 * 10.0 };
        approx::assert_relative_eq!(velocity.x, expected, max_relative = 2e-3);
        // I w = r J_t, I = 2/5 m r²
        approx::assert_relative_eq!(spin.y * 0.4 * RADIUS, along - velocity.x, max_relative = 1e-9);
        assert_eq!((spin.x, spin.z), (0.0, 0.0));
        let tangential = told.hits[0].impulse_tangential;
        approx::assert_relative_eq!(tangential.x, MASS * (velocity.x - along), max_relative = 1e-9);
    }
}

/// Two spinning grains: what friction does between them leaves their momentum and their angular momentum about the contact as they were, and never
/// gives energy.
#[test]
fn friction_between_grains_keeps_momentum_and_angular_momentum() {
    let first = one([-1.5 * RADIUS, 0.0, 5.0], [10.0, 3.0, 0.0], [100.0, -500.0, 900.0]);
    let second = one([1.5 * RADIUS, 0.2 * RADIUS, 5.0], [-10.0, 0.0, 1.0], [0.0, 300.0, 700.0]);
    let told = run(&with(&[first, second], &["contact.grain.friction=0.4", "run.until=0.004"]));
    assert_eq!(told.collisions.len(), 1);
    assert!(told.ledger.relative_momentum_residual() < 1e-14, "{}", told.ledger.relative_momentum_residual());
    assert!(told.ledger.relative_energy_residual().abs() < 2e-3, "{}", told.ledger.relative_energy_residual());
    let collision = &told.collisions[0];
    assert!(collision.impulse_tangential.norm() > 0.1 * collision.impulse_normal);
    let [dizzy, other] = [&told.grains[0], &told.grains[1]].map(|grain| grain.spin);
    let change = dizzy - Vector3::new(100.0, -500.0, 900.0) - (other - Vector3::new(0.0, 300.0, 700.0));
    assert!(change.norm() < 1e-9 * 900.0, "equal spheres take up the same torque: {change}");
}

/// A grain hits the surface and, on its way back, another grain: both come late by their contact times, which fall as E^(-2/5).
#[test]
fn soft_spheres_converge_to_the_event_driven_answer_as_they_stiffen() {
    let sources = [
        one([0.0, 0.0, 3.0 * RADIUS], [0.0, 0.0, -20.0], [0.0; 3]),
        one([0.0, 0.0, 9.0 * RADIUS], [0.0, 0.0, -20.0], [0.0; 3]),
    ];
    // So short that only the contact time counts.
    let set = ["run.until=0.012", "soft_sphere.step_fraction=0.002"];
    let mut exact = with(&sources, &set);
    (exact.run.scheme, exact.soft_sphere) = (impinge::scene::Scheme::EventDriven, None);
    let exact = run(&exact);
    let error = |young_modulus: f64| {
        let stiffness = self::set("soft_sphere.young_modulus", young_modulus);
        let told = run(&with(&sources, &[set[0], set[1], &stiffness]));
        assert_eq!((told.collisions.len(), told.hits.len()), (exact.collisions.len(), exact.hits.len()));
        let apart = told.flights.iter().zip(&exact.flights).map(|(soft, hard)| (soft.position - hard.position).norm());
        apart.fold(0.0, f64::max) / RADIUS
    };
    let errors = [1e9, 1e10, 1e11, 1e12].map(error);
    for pair in errors.windows(2) {
        let decade = pair[0] / pair[1];
        assert!((decade / 10f64.powf(0.4) - 1.0).abs() < 0.03, "{errors:?}");
    }
    assert!(errors[3] < 0.06, "{errors:?}");
}

/// Up to the rounding of some twenty thousand additions.
#[test]
fn free_flight_is_exact() {
    let told = run(&with(&[one([1.0, 2.0, 3.0], [3.0, -2.0, 1.0], [1.0, 2.0, 3.0])], &["output.samples=7"]));
    let flight = told.flights[0];
    assert!((flight.position - Vector3::new(1.3, 1.8, 3.1)).amax() < 1e-11, "{flight:?}");
    assert_eq!((flight.velocity, told.grains[0].spin), (Vector3::new(3.0, -2.0, 1.0), Vector3::new(1.0, 2.0, 3.0)));
}

const JET: &str = r#"
    run = { until = 0.02, scheme = "soft-sphere" }
    domain = { min = [-0.3, -0.3, -0.1], max = [0.3, 0.3, 1.2] }
    grain = { radius = { mean = 0.01, cv = 0.2, distribution = "uniform" }, density = 8500.0 }
    contact.grain = { restitution = 0.8, friction = { static = 0.4, dynamic = 0.3 } }
    contact.surface = { restitution = 0.7, friction = 0.4 }
    soft_sphere = { young_modulus = 1e9 }
    source = [{ kind = "block", min = [-0.05, -0.05, 0.05], max = [0.05, 0.05, 0.8], count = 250, velocity = [10, 0, -80], spin = [0, 50, 0] }]
    surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1], velocity = [5, 0, 0] }]
"#;

/// Momentum is what contacts gave, to rounding; what energy does not close is the error of the integration, and falls with the step.
#[test]
fn ledgers_close() {
    let residual = |fraction: f64| {
        let told = run(&scene(JET, &[set("soft_sphere.step_fraction", fraction)]));
        let ledger = &told.ledger;
        assert_eq!(ledger.initial().count(), ledger.left().count() + ledger.inside().count());
        assert!(ledger.left().count() > 10 && ledger.counts().grain_grain > 300, "{:?}", ledger.counts());
        assert!(ledger.relative_momentum_residual() < 1e-13, "{}", ledger.relative_momentum_residual());
        assert!(ledger.relative_mass_residual().abs() < 1e-14, "{}", ledger.relative_mass_residual());
        ledger.relative_energy_residual().abs()
    };
    let [coarse, fine] = [0.02, 0.002].map(residual);
    assert!(coarse < 2e-3 && fine < 0.2 * coarse, "{coarse} and {fine}");
}

/// Contacts that are open when the run ends are told as far as they have got.
#[test]
fn a_contact_that_is_open_at_the_end_is_told() {
    let told = run(&with(&[one([0.0, 0.0, 1.5 * RADIUS], [0.0, 0.0, -10.0], [0.0; 3])], &["run.until=0.00053"]));
    assert!(told.flights[0].position.z < RADIUS, "{:?}", told.flights[0]);
    assert_eq!((told.hits.len(), told.hits[0].order), (1, 1));
    assert!(told.ledger.relative_momentum_residual() < 1e-14 && told.ledger.relative_energy_residual().abs() < 1e-3);
}

#[test]
fn grains_meet_across_the_sides_of_a_periodic_domain() {
    let at = |x: f64| {
        let domain = [
            "domain.boundary=periodic",
            "domain.min=[0,0,0]",
            "domain.max=[0.2,0.2,0.2]",
            "surface=[]",
            "run.until=0.01",
        ];
        let grains =
            [one([x, 0.1, 0.1], [5.0, 0.0, 0.0], [0.0; 3]), one([x + 0.03, 0.101, 0.1], [-5.0, 0.0, 1.0], [0.0; 3])];
        run(&with(&grains, &domain))
    };
    let (inside, across) = (at(0.05), at(0.165));
    assert_eq!((inside.collisions.len(), across.collisions.len()), (1, 1));
    for (a, b) in inside.flights.iter().zip(&across.flights) {
        assert!((a.velocity - b.velocity).amax() < 1e-9, "{a:?} {b:?}");
        let apart = b.position - a.position;
        assert!(((apart.x - 0.115) / 0.2 - ((apart.x - 0.115) / 0.2).round()).abs() < 1e-9);
        assert!((0.0..0.2).contains(&b.position.x));
    }
}

/// A flat mesh is the plane, wherever its edges are: also for a grain that slides and rolls over them under gravity.
#[test]
fn a_flat_mesh_is_the_plane() {
    let set =
        ["run.gravity=[0,0,-9.81]", "contact.surface.friction=0.3", "run.until=0.1", "soft_sphere.young_modulus=1e8"];
    let mesh =
        "surface=[{kind='rectangle', centre=[0,0,0], normal=[0,0,1], along=[1,0.3,0], size=[1,1], divisions=[40,40]}]";
    let sources = [
        one([0.0, 0.0, 1.001 * RADIUS], [1.0, 0.2, 0.0], [0.0; 3]),
        one([0.1, 0.1, 2.0 * RADIUS], [0.0, 1.0, -3.0], [0.0; 3]),
        one([-0.1, -0.1, 1.5 * RADIUS], [0.0, 0.0, -2.0], [0.0; 3]),
    ];
    let plane = run(&with(&sources, &set));
    let mesh = run(&with(&sources, &[&set[..], &[mesh]].concat()));
    assert_eq!(plane.hits.len(), mesh.hits.len());
    for (a, b) in plane.flights.iter().zip(&mesh.flights) {
        assert!((a.position - b.position).amax() < 1e-9 * RADIUS, "{a:?} {b:?}");
    }
    for (a, b) in plane.hits.iter().zip(&mesh.hits) {
        assert_eq!((a.id, a.order), (b.id, b.order));
        approx::assert_relative_eq!(a.impulse_normal, b.impulse_normal, max_relative = 1e-7);
    }
}

/// Under gravity a grain comes to rest on the surface where K delta^(3/2) = m g.
#[test]
fn a_grain_at_rest_sinks_in_by_its_weight() {
    let set = [
        "run.gravity=[0,0,-9.81]",
        "contact.surface.restitution=0.2",
        "run.until=0.2",
        "soft_sphere.young_modulus=1e7",
    ];
    let told = run(&with(&[one([0.0, 0.0, 1.2 * RADIUS], [0.0; 3], [0.0; 3])], &set));
    let sunk = RADIUS - told.flights[0].position.z;
    let hertz = Hertz::new(effective_modulus(1e7, 0.3), MASS, RADIUS, 0.2);
    approx::assert_relative_eq!(hertz.elastic(sunk), MASS * 9.81, max_relative = 1e-3);
    assert!(told.ledger.relative_momentum_residual() < 1e-12, "{}", told.ledger.relative_momentum_residual());
    assert!(told.ledger.relative_energy_residual().abs() < 5e-3, "{}", told.ledger.relative_energy_residual());
}

/// Two grains that attract each other swing together and apart, and keep their energy.
#[test]
fn a_near_field_acts_between_contacts() {
    let grains = [one([-0.03, 0.0, 5.0], [0.0; 3], [0.0; 3]), one([0.03, 0.0, 5.0], [0.0; 3], [0.0; 3])];
    let set = [
        "near_field={alpha1=1e-2, beta1=2, alpha2=0, beta2=3}",
        "contact.grain.restitution=1",
        "run.until=0.3",
        "surface=[]",
        "soft_sphere.young_modulus=1e8",
    ];
    let told = run(&with(&grains, &set));
    assert!(told.collisions.len() > 1, "{} collisions", told.collisions.len());
    assert!(told.ledger.relative_energy_residual().abs() < 1e-3, "{}", told.ledger.relative_energy_residual());
    assert!(told.ledger.relative_momentum_residual() < 1e-12);
}

/// The four kinds of interference mean the same as for hard spheres.
#[test]
fn interference_means_what_it_means_for_hard_spheres() {
    let with = |interference: &str| run(&scene(JET, &[format!("run.interference={interference}")]));
    let none = with("none");
    assert_eq!((none.collisions.len(), none.hits.len()), (0, 250));
    assert!(none.hits.iter().all(|hit| hit.order == 1));
    let first = with("first-order");
    assert!(first.collisions.len() > 100 && first.hits.iter().all(|hit| hit.order == 1));
    let removed = with("removed-on-first-collision");
    let counts = removed.ledger.counts();
    assert!(removed.ledger.removed().count() > 50, "{}", removed.ledger.removed().count());
    assert_eq!(counts.grain_surface, counts.first_hits);
    assert_eq!(removed.surface.by_order().len(), 1);
    assert!(removed.ledger.relative_momentum_residual() < 1e-13);
}

/// Grains that a nozzle sends are taken in between steps, and leave through the sides.
#[test]
fn a_nozzle_feeds_soft_spheres() {
    let nozzle = "source=[{kind='nozzle', shape={circle={diameter=0.08}}, centre=[0,0,0.5], axis=[0,0,-1], speed=50, flow={volume_fraction=0.02}}]";
    let told = run(&scene(JET, &[nozzle.to_owned()]));
    let ledger = &told.ledger;
    assert_eq!(ledger.initial().count(), 0);
    assert!(ledger.entered().count() > 15 && ledger.counts().first_hits > 5, "{:?}", ledger.counts());
    assert_eq!(ledger.entered().count(), ledger.left().count() + ledger.inside().count());
    assert!(ledger.relative_momentum_residual() < 1e-13 && ledger.relative_energy_residual().abs() < 2e-3);
}

/// What the scene leaves out has the documented value.
#[test]
fn settings_have_defaults() {
    let settings: SoftSphere = toml::from_str("step_fraction = 0.01").expect("it is valid");
    assert_eq!((settings.young_modulus, settings.poisson_ratio, settings.step_fraction), (1e9, 0.3, 0.01));
}
