//! Nozzles: flow, places and directions of the grains that come out, and what happens when there is no room.

use std::f64::consts::SQRT_2;
use std::ops::ControlFlow;

use approx::assert_relative_eq;
use impinge::grains::{NewGrain, sphere_volume};
use impinge::scene::{Invalid, Scene, Source};
use impinge::simulation::Simulation;
use impinge::source::Nozzle;
use nalgebra::Vector3;

const ROOM: &str = "min = [-5.0, -5.0, -5.0], max = [5.0, 5.0, 5.0]";
const PLANAR: &str = "min = [-5.0, 0.0, -5.0], max = [5.0, 0.0, 5.0], planar = true";
const CIRCLE: &str = "shape = { circle = { diameter = 0.4 } }";
const SLOT: &str = "shape = { slot = { width = 0.2, breadth = 0.6, along = [1.0, 1.0, 3.0] } }";

fn try_nozzle(domain: &str, shape: &str, flow: &str, more: &str) -> Result<Nozzle, Invalid> {
    let axis = if more.contains("axis") { "" } else { "axis = [0.0, 0.0, -2.0]" };
    let text = format!(
        "run.until = 1.0\ndomain = {{ {domain} }}\ngrain = {{ radius = 0.01, density = 2500.0 }}\n\
         [[source]]\nkind = \"nozzle\"\ncentre = [0.5, 0.0, 1.0]\nspeed = 20.0\n{axis}\n{shape}\nflow = {{ {flow} }}\n{more}\n"
    );
    let scene: Scene = toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"));
    let Source::Nozzle(source) = &scene.source[0] else { panic!("the source is a nozzle") };
    Nozzle::new(&scene, 0, source)
}

fn nozzle(domain: &str, shape: &str, flow: &str, more: &str) -> Nozzle {
    try_nozzle(domain, shape, flow, more).unwrap_or_else(|error| panic!("{error}"))
}

/// The first `count` entries when there is always room.
fn entries(mut nozzle: Nozzle, count: usize) -> Vec<(f64, NewGrain)> {
    (0..count)
        .map(|_| {
            let time = nozzle.due().unwrap();
            (time, nozzle.enter(time, &mut |_, _| true).unwrap())
        })
        .collect()
}

/// Runs until `until` with grains that fly straight on. Gives the entered grains, moved to that time.
fn fly(nozzle: &mut Nozzle, until: f64) -> Vec<NewGrain> {
    let mut flights: Vec<(f64, NewGrain)> = Vec::new();
    // Grains leave the reach of the opening after this many seconds.
    let passed = 4.0 * 0.01 / 20.0;
    let mut near = 0;
    let mut attempts = 0;
    while let Some(time) = nozzle.due().filter(|time| *time < until) {
        attempts += 1;
        assert!(attempts < 1_000_000, "stuck at {time}");
        while near < flights.len() && flights[near].0 < time - passed {
            near += 1;
        }
        let entered = nozzle.enter(time, &mut |position, radius| {
            flights[near..].iter().all(|(entry, grain)| {
                (grain.position + (time - entry) * grain.velocity - position).norm() >= radius + grain.radius
            })
        });
        flights.extend(entered.map(|grain| (time, grain)));
    }
    let moved = |(entry, grain): (f64, NewGrain)| NewGrain {
        position: grain.position + (until - entry) * grain.velocity,
        ..grain
    };
    flights.into_iter().map(moved).collect()
}

#[test]
fn entries_are_never_more_than_one_off_the_flux() {
    let nozzle = nozzle(ROOM, CIRCLE, "number_flux = 250.0", "start = 0.5");
    let mut gaps = Vec::new();
    let mut last = 0.5;
    for (number, (time, _)) in entries(nozzle, 5000).into_iter().enumerate() {
        let expected = 0.5 + number as f64 / 250.0;
        assert!((expected..=expected + 1.0 / 250.0).contains(&time), "{number}: {time}");
        gaps.push((time - last) * 250.0);
        last = time;
    }
    // The difference of two even draws: variance 1/6, so entries are irregular.
    let variance = gaps[1..].iter().map(|gap| (gap - 1.0).powi(2)).sum::<f64>() / 4999.0;
    assert_relative_eq!(variance, 1.0 / 6.0, max_relative = 0.1);
}

#[test]
fn volume_fraction_gives_the_flux() {
    let circle = nozzle(ROOM, CIRCLE, "volume_fraction = 0.05", "");
    let expected = 0.05 * std::f64::consts::PI * 0.04 * 20.0 / sphere_volume(0.01);
    assert_relative_eq!(circle.flux(), expected, max_relative = 1e-14);
    let slot = nozzle(ROOM, SLOT, "volume_fraction = 0.05", "");
    assert_relative_eq!(slot.flux(), 0.05 * 0.12 * 20.0 / sphere_volume(0.01), max_relative = 1e-14);
    let planar = nozzle(PLANAR, CIRCLE, "volume_fraction = 0.05", "");
    assert_relative_eq!(planar.flux(), 0.05 * 0.4 * 20.0 / (std::f64::consts::PI * 1e-4), max_relative = 1e-14);
    let drawn = "radius = { mean = 0.01, cv = 0.4, distribution = \"lognormal\" }";
    let drawn = nozzle(ROOM, CIRCLE, "volume_fraction = 0.05", drawn);
    assert_relative_eq!(drawn.flux(), expected / 1.16f64.powi(3), max_relative = 1e-14);
    let volume: f64 = entries(drawn.clone(), 50_000).iter().map(|(_, grain)| sphere_volume(grain.radius)).sum();
    let rate = volume / 50_000.0 * drawn.flux();
    assert_relative_eq!(rate, 0.05 * std::f64::consts::PI * 0.04 * 20.0, max_relative = 0.04);
}

#[test]
fn a_circle_is_filled_evenly_and_diverges_from_its_axis() {
    let nozzle = nozzle(ROOM, CIRCLE, "number_flux = 100.0", "divergence = 6.0\naxis = [1.0, 2.0, -2.0]");
    let (centre, axis) = (Vector3::new(0.5, 0.0, 1.0), Vector3::new(1.0, 2.0, -2.0) / 3.0);
    let (mut sum, mut squares) = (Vector3::zeros(), 0.0);
    for (_, grain) in entries(nozzle, 20_000) {
        let offset = grain.position - centre;
        let xi = offset.norm();
        assert!(offset.dot(&axis).abs() < 1e-15 && xi <= 0.2 + 1e-15);
        assert_relative_eq!(grain.velocity.norm(), 20.0, max_relative = 1e-14);
        let (radial, axial) = (grain.velocity.dot(&offset) / xi, grain.velocity.dot(&axis));
        assert_relative_eq!(radial.atan2(axial).to_degrees(), xi / 0.2 * 6.0, epsilon = 1e-9);
        assert!(grain.velocity.dot(&axis.cross(&offset)).abs() < 1e-12, "no swirl");
        sum += offset / 0.2;
        squares += (xi / 0.2).powi(2);
    }
    assert!(sum.norm() / 20_000.0 < 0.02);
    // Even over the area: (xi / rim)² is even from 0 to 1.
    assert_relative_eq!(squares / 20_000.0, 0.5, epsilon = 0.01);
}

#[test]
fn a_slot_diverges_across_its_width_only() {
    let nozzle = nozzle(ROOM, SLOT, "number_flux = 100.0", "divergence = 10.0");
    let along = Vector3::new(1.0, 1.0, 0.0).normalize();
    let across = Vector3::new(1.0, -1.0, 0.0).normalize();
    let (mut widest, mut broadest) = (0.0f64, 0.0f64);
    for (_, grain) in entries(nozzle, 10_000) {
        let offset = grain.position - Vector3::new(0.5, 0.0, 1.0);
        let (x, y) = (offset.dot(&across), offset.dot(&along));
        widest = widest.max(x.abs());
        broadest = broadest.max(y.abs());
        let angle = grain.velocity.dot(&across).atan2(-grain.velocity.z).to_degrees();
        assert_relative_eq!(angle, x / 0.1 * 10.0, epsilon = 1e-9);
        assert!(grain.velocity.dot(&along).abs() < 1e-13);
    }
    assert!((0.0999..=0.1 + 1e-15).contains(&widest) && (0.299..=0.3 + 1e-15).contains(&broadest));
}

#[test]
fn planar_nozzles_stay_in_the_plane_exactly() {
    for shape in [CIRCLE, SLOT] {
        let half = if shape == CIRCLE { 0.2 } else { 0.1 };
        let more = "divergence = 8.0\naxis = [1.0, 0.0, -1.0]\nspin = [0.0, 3.0, 0.0]";
        for (_, grain) in entries(nozzle(PLANAR, shape, "number_flux = 100.0", more), 2000) {
            assert_eq!((grain.position.y.to_bits(), grain.velocity.y.to_bits()), (0, 0));
            let offset = grain.position - Vector3::new(0.5, 0.0, 1.0);
            assert!(offset.norm() <= half + 1e-15);
            let across = Vector3::new(1.0, 0.0, 1.0).normalize();
            let axial = grain.velocity.dot(&Vector3::new(1.0, 0.0, -1.0).normalize());
            let angle = grain.velocity.dot(&across).atan2(axial).to_degrees();
            assert_relative_eq!(angle, offset.dot(&across) / half * 8.0, epsilon = 1e-9);
        }
    }
}

#[test]
fn a_dense_stream_keeps_its_flow_and_its_grains_apart() {
    for (domain, fraction) in [(ROOM, 0.1), (ROOM, 0.3), (PLANAR, 0.3)] {
        let mut nozzle = nozzle(domain, CIRCLE, &format!("volume_fraction = {fraction}"), "");
        let until = 1500.0 / nozzle.flux();
        let grains = fly(&mut nozzle, until);
        assert_eq!(grains.len() as u64, nozzle.entered());
        assert!(nozzle.missing(until) < 15, "{} of 1500 missing at {fraction}", nozzle.missing(until));
        for (number, a) in grains.iter().enumerate() {
            assert!(grains[..number].iter().all(|b| (a.position - b.position).norm() >= 0.02 * (1.0 - 1e-12)));
        }
    }
}

#[test]
fn a_flow_that_finds_no_room_is_counted_and_ends() {
    // Feasible for a crystal, but not for grains that come in at random.
    let mut nozzle = nozzle(ROOM, CIRCLE, "volume_fraction = 0.7", "");
    let until = 4000.0 / nozzle.flux();
    let grains = fly(&mut nozzle, until);
    assert!(nozzle.deferred() > 500, "{}", nozzle.deferred());
    assert_eq!(grains.len() as u64, nozzle.entered());
    assert!(nozzle.missing(until) > 500, "{}", nozzle.missing(until));
    assert!(nozzle.entered() + nozzle.missing(until) >= 3999);
}

#[test]
fn a_blocked_nozzle_defers_and_time_goes_on_then_the_backlog_drains() {
    let mut nozzle = nozzle(ROOM, CIRCLE, "number_flux = 1e5", "stop = 1.0");
    let mut attempts = 0;
    let mut time = 0.0;
    while time < 0.1 {
        time = nozzle.due().unwrap();
        let before = time;
        assert!(nozzle.enter(time, &mut |_, _| false).is_none());
        assert!(nozzle.due().unwrap() > before);
        attempts += 1;
    }
    assert!(attempts < 500, "{attempts}");
    assert_eq!((nozzle.entered(), nozzle.deferred()), (0, 1));
    assert!((nozzle.missing(time) as f64 - time * 1e5).abs() < 2.0);
    // Ten thousand grains wait: once there is room they all enter, at times that never go back.
    let mut last = time;
    while nozzle.missing(last) > 1 {
        let due = nozzle.due().unwrap();
        assert!(due >= last);
        last = due;
        assert!(nozzle.enter(due, &mut |_, _| true).is_some());
    }
    assert!(last < time + 3e-4, "{last}");
    // After the stop nothing comes.
    assert!(nozzle.enter(1.0 - 1e-9, &mut |_, _| false).is_none());
    assert_eq!(nozzle.due(), None);
}

#[test]
fn late_times_still_go_on() {
    let mut nozzle = nozzle(ROOM, CIRCLE, "number_flux = 10.0", "start = 1e15\nradius = 1e-6");
    let time = nozzle.due().unwrap();
    assert!(nozzle.enter(time, &mut |_, _| false).is_none());
    assert!(nozzle.due().unwrap() > time);
}

#[test]
fn stop_gives_the_number_that_was_asked_for() {
    let mut nozzle = nozzle(ROOM, CIRCLE, "number_flux = 100.0", "start = 1.0\nstop = 3.0");
    while let Some(time) = nozzle.due() {
        assert!((1.0..3.0).contains(&time));
        nozzle.enter(time, &mut |_, _| true);
    }
    assert_eq!((nozzle.entered(), nozzle.deferred()), (200, 0));
}

#[test]
fn a_nozzle_does_not_make_up_for_the_time_before_the_run() {
    let nozzle = nozzle(ROOM, CIRCLE, "number_flux = 100.0", "start = -5.0");
    assert!(nozzle.due().unwrap() >= 0.0);
}

#[test]
fn same_seed_same_stream() {
    let of = || entries(nozzle(ROOM, CIRCLE, "number_flux = 10.0", "divergence = 1.0"), 100);
    assert_eq!(of(), of());
}

#[test]
fn deferral_does_not_favour_small_grains() {
    let drawn = "radius = { mean = 0.01, cv = 0.5, distribution = \"uniform\" }";
    let mut nozzle = nozzle(ROOM, CIRCLE, "volume_fraction = 0.25", drawn);
    let until = 3000.0 / nozzle.flux();
    let grains = fly(&mut nozzle, until);
    assert!(nozzle.deferred() > 10, "the test must see deferrals: {}", nozzle.deferred());
    let mean = grains.iter().map(|grain| grain.radius).sum::<f64>() / grains.len() as f64;
    assert_relative_eq!(mean, 0.01, max_relative = 0.03);
}

/// A nozzle of 0.4 m by 0.4 m (or round) that blows grains of radius 0.01 m down from z = 1 m, and a surface.
fn beside(shape: &str, start: f64, surface: &str) -> Result<Simulation, Invalid> {
    let text = format!(
        "run.until = 1.0\ndomain = {{ {ROOM} }}\ngrain = {{ radius = 0.01, density = 2500.0 }}\n\
         contact = {{ grain = {{ restitution = 0.8 }}, surface = {{ restitution = 0.8, friction = 0.4 }} }}\n\
         [[source]]\nkind = \"nozzle\"\ncentre = [0.0, 0.0, 1.0]\naxis = [0.0, 0.0, -1.0]\nspeed = 20.0\n{shape}\n\
         flow = {{ number_flux = 500.0 }}\nstart = {start}\n[[surface]]\n{surface}\n"
    );
    let scene: Scene = toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(&scene, ".".as_ref())
}

const SQUARE: &str = "shape = { slot = { width = 0.4, breadth = 0.4, along = [1.0, 0.0, 0.0] } }";

/// Grains that entered inside the surface stopped the run with a request to report the scene.
#[test]
fn a_mouth_in_the_surface_was_not_seen() {
    let floor = |z: f64| format!("kind = \"plane\"\npoint = [0, 0, {z}]\nnormal = [0, 0, 1]");
    let tilted = |z: f64| format!("kind = \"plane\"\npoint = [0, 0, {z}]\nnormal = [1, 0, 1]");
    let plate = |z: f64| {
        format!("kind = \"rectangle\"\ncentre = [0, 0, {z}]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [3, 3]")
    };
    // A blade of height 0.2 that stands upright beside the mouth, or in it, as wide as a grain.
    let blade = |x: f64| {
        format!("kind = \"rectangle\"\ncentre = [{x}, 0, 1]\nnormal = [1, 0, 0]\nalong = [0, 1, 0]\nsize = [0.02, 0.2]")
    };
    // A plate that falls past the mouth at 10 m/s, from 1 m above it.
    let falling = || format!("{}\nvelocity = [0, 0, -10]", plate(2.0));
    // Where the tilted plane touches grains at the rim.
    let touch = 1.0 - 0.2 - 0.01 * SQRT_2;
    for (shape, start, surface, clear) in [
        (CIRCLE, 0.0, floor(0.99), true),
        (CIRCLE, 0.0, floor(0.9901), false),
        (CIRCLE, 0.0, floor(3.0), false),
        (CIRCLE, 0.0, tilted(touch - 1e-6), true),
        (CIRCLE, 0.0, tilted(touch + 1e-3), false),
        (SQUARE, 0.0, plate(0.9899), true),
        (SQUARE, 0.0, plate(1.0101), true),
        (SQUARE, 0.0, plate(1.0), false),
        (SQUARE, 0.0, plate(0.995), false),
        (SQUARE, 0.0, blade(0.2101), true),
        (SQUARE, 0.0, blade(0.209), false),
        (SQUARE, 0.0, blade(0.1234), false),
        (CIRCLE, 0.0, blade(-0.2101), true),
        (CIRCLE, 0.0, blade(-0.209), false),
        (SQUARE, 0.0, falling(), true),
        (SQUARE, 0.1, falling(), false),
        (SQUARE, 0.2, falling(), true),
    ] {
        let made = beside(shape, start, &surface);
        assert_eq!(made.is_ok(), clear, "{shape}, start {start}, {surface}: {:?}", made.err());
        if let Err(invalid) = made {
            assert_eq!(invalid.key, "source[0].centre");
            assert!(invalid.what.contains("overlaps surface[0] by"), "{}", invalid.what);
        }
    }
}

/// A plate slides over the mouth, 10 m/s fast and 2 m long, and on: what is due meanwhile waits, and enters after it.
#[test]
fn grains_entered_inside_a_surface_that_had_moved_into_the_mouth() {
    let plate = "kind = \"rectangle\"\ncentre = [-2.0, 0, 1]\nnormal = [0, 0, 1]\nalong = [1, 0, 0]\nsize = [2, 2]\nvelocity = [10, 0, 0]";
    let mut simulation = beside(CIRCLE, 0.0, plate).unwrap_or_else(|invalid| panic!("{invalid}"));
    let outcome =
        simulation.run(&mut (), &mut |_| ControlFlow::Continue(())).unwrap_or_else(|broken| panic!("{broken}"));
    assert_eq!(outcome.time, 1.0);
    let nozzle = &simulation.nozzles()[0];
    // The mouth is covered for at least the 0.16 s between the arrival of the plate at its far rim and at its near rim.
    assert!(nozzle.deferred() >= 79, "{}", nozzle.deferred());
    assert!(nozzle.missing(1.0) <= 1, "{}", nozzle.missing(1.0));
}

#[test]
fn every_value_of_a_nozzle_is_checked() {
    let flow = "number_flux = 10.0";
    for (domain, shape, flow, more, key, value) in [
        (ROOM, "shape = { circle = { diameter = 0.0 } }", flow, "", "source[0].shape.circle.diameter", "0"),
        (ROOM, "shape = { circle = { diameter = 20.0 } }", flow, "", "source[0].centre", "beyond the domain"),
        (ROOM, CIRCLE, "number_flux = -1.0", "", "source[0].flow.number_flux", "-1"),
        (ROOM, CIRCLE, "number_flux = 1e30", "", "source[0].flow.number_flux", "densest packing"),
        (ROOM, CIRCLE, "volume_fraction = 0.9", "", "source[0].flow.volume_fraction", "0.9"),
        (ROOM, CIRCLE, "volume_fraction = nan", "", "source[0].flow.volume_fraction", "NaN"),
        (ROOM, CIRCLE, flow, "axis = [0.0, 0.0, 0.0]", "source[0].axis", "has no direction"),
        (ROOM, CIRCLE, flow, "divergence = 90.0", "source[0].divergence", "90"),
        (ROOM, CIRCLE, flow, "divergence = -1.0", "source[0].divergence", "-1"),
        (ROOM, CIRCLE, flow, "start = 2.0\nstop = 1.0", "source[0].stop", "1 is not after `start`, 2"),
        (ROOM, CIRCLE, flow, "density = -5.0", "source[0].density", "-5"),
        (ROOM, CIRCLE, flow, "radius = inf", "source[0].radius", "inf"),
        (ROOM, SLOT, flow, "axis = [-1.0, -1.0, -3.0]", "source[0].shape.slot.along", "parallel"),
        (PLANAR, CIRCLE, flow, "axis = [0.0, 1.0, -3.0]", "source[0].axis", "planar"),
        (PLANAR, CIRCLE, flow, "spin = [0.0, 1.0, -3.0]", "source[0].spin", "its z is -3"),
    ] {
        let refused = try_nozzle(domain, shape, flow, more).unwrap_err();
        assert_eq!(refused.key, key, "{}", refused.what);
        assert!(refused.what.contains(value), "{key}: {}", refused.what);
        assert!(!refused.remedy.is_empty());
    }
}
