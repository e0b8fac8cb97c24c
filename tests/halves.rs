//! Two halves on two cores find what one engine finds: every record and every state, bit for bit.

mod common;

use std::ops::ControlFlow;

use common::{Log, gas, smooth};
use impinge::grains::{Grain, NewGrain};
use impinge::law::{ContactLaw, Friction};
use impinge::observe::Ledger;
use impinge::scene::{self, Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, Halves, Laws, Windows};
use impinge::simulation::Simulation;
use impinge::source;
use impinge::surface::Surface;
use impinge_events::{Domain, Flight};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

const ROUGH: Friction = Friction::Coulomb { static_: 0.4, dynamic: 0.3 };

struct Case {
    grains: Vec<NewGrain>,
    surface: Surface,
    domain: Domain,
    laws: Laws,
}

impl Case {
    fn engine(&self) -> EventDriven<Surface> {
        EventDriven::new(&self.grains, self.surface.clone(), self.domain, self.laws, 0.0)
    }

    /// Both ways until `until` (s), looked at `looks` times; they are equal, or this panics.
    fn compare(&self, until: f64, looks: u32) -> (Windows, Log) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
        pool.install(|| self.compare_here(until, looks))
    }

    fn compare_here(&self, until: f64, looks: u32) -> (Windows, Log) {
        let (mut one, mut two) = (self.engine(), Halves::of(self.engine()));
        let (mut expected, mut seen) = (Log::default(), Log::default());
        for look in 1..=looks {
            let time = until * f64::from(look) / f64::from(looks);
            let mut last = [None; 2];
            let _ = one.advance(time, &mut expected, &mut |now| keep(&mut last[0], now)).expect("one engine");
            let _ = two.advance(time, &mut seen, &mut |now| keep(&mut last[1], now)).expect("two halves");
            let differ = |k: &usize| seen.0.get(*k) != expected.0.get(*k);
            if let Some(wrong) = (0..seen.0.len().max(expected.0.len())).find(differ) {
                panic!("event {wrong}: {:?} instead of {:?}", seen.0.get(wrong), expected.0.get(wrong));
            }
            assert_eq!(last[0], last[1], "progress at {time} s");
            let all = |snapshot: &impinge::grains::Snapshot<'_>| -> (Vec<Flight>, Vec<Grain>) {
                (snapshot.flights.to_vec(), snapshot.grains.to_vec())
            };
            assert_eq!(one.snapshot(time, all), two.snapshot(time, all), "states at {time} s");
            assert_eq!((two.time(), two.epoch_start()), (one.time(), one.epoch_start()));
        }
        (two.windows(), expected)
    }
}

fn keep<T>(last: &mut Option<T>, now: T) -> ControlFlow<()> {
    *last = Some(now);
    ControlFlow::Continue(())
}

fn nothing() -> Surface {
    Surface::new(&[], ".".as_ref()).expect("no surface")
}

fn laws(e: f64, friction: Friction) -> Laws {
    let law = ContactLaw { restitution: e, friction };
    Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic }
}

/// Grains at random places of `domain` that do not overlap, half a metre inside where it is open.
fn scatter(seed: u64, domain: &Domain, count: usize, radii: std::ops::Range<f64>) -> Vec<NewGrain> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut grains: Vec<NewGrain> = Vec::new();
    let inset = if domain.periodic { 0.0 } else { 0.5 };
    while grains.len() < count {
        let radius = random.random_range(radii.clone());
        let flat = |v: Vector3<f64>| if domain.planar { Vector3::new(v.x, 0.0, v.z) } else { v };
        let position = flat(Vector3::from_fn(|axis, _| {
            let (low, high) = (domain.min[axis] + inset, domain.max[axis] - inset);
            if low < high { random.random_range(low..high) } else { 0.0 }
        }));
        if grains.iter().all(|g| domain.nearest(g.position - position).norm() > 1.001 * (g.radius + radius)) {
            let mut any = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
            let (velocity, spin) = (flat(any()), any());
            let spin = if domain.planar { Vector3::new(0.0, spin.y, 0.0) } else { spin } / radius;
            grains.push(NewGrain { position, velocity, spin, radius, density: 1.0, strength: 1.0 });
        }
    }
    grains
}

fn cube(half: f64, periodic: bool, planar: bool) -> Domain {
    let mut corner = Vector3::repeat(half);
    if planar {
        corner.y = 0.0;
    }
    Domain { min: -corner, max: corner, periodic, planar }
}

#[test]
fn gases() {
    for (fraction, until) in [(0.05, 30.0), (0.4, 3.0)] {
        let (grains, domain) = gas(16, fraction, 3);
        let case = Case { grains, surface: nothing(), domain, laws: smooth(1.0, 1.0) };
        let (windows, log) = case.compare(until, 3);
        assert!(log.0.len() > 20_000, "{} collisions", log.0.len());
        assert!(windows.cut_short > 1, "nothing was ever undone: {windows:?}");
    }
}

#[test]
fn gases_of_unequal_rough_grains_that_cool() {
    let domain = cube(12.0, true, false);
    let grains = scatter(1, &domain, 1500, 0.3..0.8);
    let case = Case { grains, surface: nothing(), domain, laws: laws(0.8, ROUGH) };
    let (windows, log) = case.compare(60.0, 2);
    assert!(log.0.len() > 8_000 && windows.cut_short > 1, "{} collisions, {windows:?}", log.0.len());
    assert!(windows.told <= log.0.len() as u64 && windows.told > log.0.len() as u64 / 2, "{windows:?}");
    assert!((windows.told..2 * windows.told).contains(&windows.resolved), "{windows:?}");
}

#[test]
fn planar_gases() {
    let domain = cube(40.0, true, true);
    let grains = scatter(2, &domain, 900, 0.2..0.6);
    let case = Case { grains, surface: nothing(), domain, laws: laws(0.95, ROUGH) };
    let (windows, log) = case.compare(60.0, 2);
    assert!(log.0.len() > 3_000 && windows.cut_short > 0, "{} collisions, {windows:?}", log.0.len());
}

/// Grains leave, and planes move.
#[test]
fn open_domains_with_moving_surfaces() {
    let text = r#"
        surface = [
            { kind = "sine", centre = [0, 0, -6], size = [24, 24], amplitude = 0.3, wavelength = 1.0, pieces = 8 },
            { kind = "plane", point = [9.6, 0, 0], normal = [-1, 0, 0], velocity = [-3, 0, 0] },
        ]"#;
    #[derive(serde::Deserialize)]
    struct Only {
        surface: Vec<scene::Surface>,
    }
    let surfaces = toml::from_str::<Only>(text).expect("surfaces").surface;
    for seed in 0..6 {
        let domain = cube(12.0, false, false);
        let inside = Domain { min: Vector3::new(-10.0, -10.0, -5.0), max: Vector3::new(9.0, 10.0, 10.0), ..domain };
        let grains = scatter(seed, &inside, 800, 0.1..0.5);
        let surface = Surface::new(&surfaces, ".".as_ref()).expect("a surface");
        let (_, log) = Case { grains, surface, domain, laws: laws(0.8, ROUGH) }.compare(2.0, 3);
        assert!(log.0.len() > 300 && log.surface_hits() > 50, "{} events", log.0.len());
    }
}

/// A chain of grains, each a hundred times as light as the one before, is hit by the heaviest: the fourth flies so fast that an epoch ends early.
#[test]
fn an_epoch_that_ends_early() {
    let domain = cube(12.0, true, false);
    let bath = Domain { max: Vector3::new(12.0, 12.0, 4.0), ..domain };
    let mut grains = scatter(4, &bath, 600, 0.2..0.5);
    grains.retain(|grain| grain.position.z.abs() < 4.0);
    grains.iter_mut().for_each(|grain| grain.velocity *= 0.5);
    let mut place = 6.0;
    for link in 0..6 {
        let radius = 0.5 * 0.01_f64.powf(f64::from(link) / 3.0);
        place += 1.1 * radius;
        let velocity = Vector3::z() * if link == 0 { 0.5 } else { 0.0 };
        let position = Vector3::new(0.0, 0.0, place);
        grains.push(NewGrain { position, velocity, spin: Vector3::zeros(), radius, density: 1.0, strength: 1.0 });
        place += 1.1 * radius;
    }
    let (windows, log) = Case { grains, surface: nothing(), domain, laws: smooth(1.0, 1.0) }.compare(12.0, 2);
    assert!(windows.alone > 0 && log.0.len() > 150, "{} collisions, {windows:?}", log.0.len());
}

fn jet(count: u32, domain: Domain, laws: Laws) -> Case {
    let text = format!(
        r#"
        run.until = 0.06
        domain = {{ min = [-10, -10, -1], max = [10, 10, 10] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "file", path = "tests/data/jet_{count}.csv" }}]
        surface = [{{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }}]
        "#
    );
    let scene: Scene = toml::from_str(&text).expect("a scene");
    let folder = env!("CARGO_MANIFEST_DIR").as_ref();
    let grains = source::place(&scene, folder, &|_, _| None).expect("a reference jet").grains;
    let surface = Surface::new(&scene.surface, folder).expect("a plane");
    Case { grains, surface, domain, laws }
}

#[test]
fn jets() {
    let (windows, log) = jet(2000, Domain::unbounded(), smooth(0.8, 0.8)).compare(0.06, 4);
    assert!(log.0.len() > 20_000 && windows.cut_short > 1, "{} events, {windows:?}", log.0.len());
    // Collapses in the core, and grains that leave.
    let (_, log) = jet(2000, cube(0.6, false, false), laws(0.5, ROUGH)).compare(0.06, 2);
    assert!(log.0.len() > 10_000, "{} events", log.0.len());
}

#[test]
fn jets_of_each_interference() {
    use Interference::{FirstOrder, None, RemovedOnFirstCollision};
    for interference in [None, FirstOrder, RemovedOnFirstCollision] {
        let laws = Laws { interference, ..smooth(0.8, 0.8) };
        let (_, log) = jet(2000, Domain::unbounded(), laws).compare(0.06, 3);
        assert!(log.surface_hits() > 50, "{interference:?}: {} hits", log.surface_hits());
    }
}

/// The command's way: many grains on more than one thread are shared between two cores, and what is told is the same.
#[test]
fn a_scene_of_many_grains_runs_alike_on_one_thread_and_two() {
    let text = r#"
        run.until = 0.3
        domain = { min = [0, 0, 0], max = [20, 20, 20], boundary = "periodic" }
        grain = { radius = 0.3, density = 1000.0 }
        contact.grain.restitution = 0.9
        output.samples = 4
        source = [{ kind = "lattice", arrangement = "face-centred", cells = [20, 20, 20], min = [0, 0, 0],
            max = [20, 20, 20], velocity = [0, 0, 0], thermal_speed = 1.0 }]
    "#;
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let scene: Scene = toml::from_str(text).expect("a scene");
            let mut simulation = Simulation::new(&scene, ".".as_ref()).expect("a run");
            let mut told = (Log::default(), Ledger::default());
            let mut calls = 0;
            let outcome = simulation.run(&mut told, &mut |_| {
                calls += 1;
                ControlFlow::Continue(())
            });
            assert_eq!(outcome.expect("no broken invariant").time, 0.3);
            (told.0.0, told.1.energy_residual(), calls)
        })
    });
    assert!(one.0.len() > 3000, "{} events", one.0.len());
    assert!(one.0 == two.0, "not the same events");
    assert_eq!(one.1, two.1);
    assert!(two.2 != one.2, "two threads were no two cores: {} calls", one.2);
}
