//! One core against two ([`Halves`]): gases once they have melted, in turns, and jets from start to end, once. Elapsed time.
//!
//! `cargo bench --bench cores`; `cargo bench --bench cores -- 1e6` for gases and jets of up to a million grains.

mod support;

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::time::Instant;

use impinge::law::{ContactLaw, Friction};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, Halves, Laws};
use impinge::surface::Surface;
use impinge::{simulation, source};
use support::{Duel, advance, duel_by, trial};

/// Unit cells along the sides of gases (four grains each), and grains of jets.
const GASES: [u32; 3] = [14, 29, 63];
const JETS: [u32; 3] = [8_000, 100_000, 1_000_000];
/// Collisions a grain in which a lattice melts.
const MELTING: f64 = 4.0;
const ROUNDS: u32 = 5;

fn engine(scene: &Scene, restitution: f64) -> EventDriven<Surface> {
    let law = ContactLaw { restitution, friction: Friction::Smooth };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
    let grains = source::place(scene, ".".as_ref(), &|_, _| None).expect("grains").grains;
    let surface = Surface::new(&scene.surface, ".".as_ref()).expect("a surface");
    EventDriven::new(&grains, surface, simulation::domain(scene), laws, 0.0)
}

/// Four grains in each of `cells`³ unit cells of 1 m, of thermal speed 1 m/s, and the time in which each collides once (Enskog).
fn gas(cells: u32, fraction: f64) -> (EventDriven<Surface>, f64) {
    let radius = (fraction * 3.0 / (16.0 * PI)).cbrt();
    let chi = (1.0 - fraction / 2.0) / (1.0 - fraction).powi(3);
    let text = format!(
        r#"
        run.until = 1.0
        domain = {{ min = [0, 0, 0], max = [{cells}, {cells}, {cells}], boundary = "periodic" }}
        grain = {{ radius = {radius}, density = 1000.0 }}
        source = [{{ kind = "lattice", arrangement = "face-centred", cells = [{cells}, {cells}, {cells}], min = [0, 0, 0],
            max = [{cells}, {cells}, {cells}], velocity = [0, 0, 0], thermal_speed = 1.0 }}]
        "#
    );
    let time = PI.sqrt() * 2.0 * radius / (24.0 * fraction * chi);
    (engine(&toml::from_str(&text).expect("a scene"), 1.0), time)
}

/// A jet as dense and as long as the reference jet of 8000 grains, onto a plane; it ends at 0.06 s.
fn jet(count: u32) -> EventDriven<Surface> {
    let half = 0.1 * (f64::from(count) / 8000.0).sqrt();
    let text = format!(
        r#"
        run.until = 0.06
        domain = {{ min = [-100, -100, -1], max = [100, 100, 100] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "block", min = [-{half}, -{half}, 0.1], max = [{half}, {half}, 2.6], count = {count},
            velocity = [0, 0, -80] }}]
        surface = [{{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }}]
        "#
    );
    engine(&toml::from_str(&text).expect("a scene"), 0.8)
}

/// Both from copies of `start`, a part of the way after the other.
fn race(start: &EventDriven<Surface>, part: f64, rounds: u32) -> Duel {
    let (mut one, mut two) = (start.clone(), Halves::of(start.clone()));
    let clock = Instant::now();
    let duel = duel_by(
        || clock.elapsed(),
        rounds,
        || {
            let until = one.time() + part;
            advance(&mut one, until)
        },
        || {
            let until = two.time() + part;
            let mut count = support::Count::default();
            let flow = two.advance(until, &mut count, &mut |_| ControlFlow::Continue(())).expect("a sound run");
            assert!(flow.is_continue());
            count.0
        },
    );
    let states = |snapshot: &impinge::grains::Snapshot<'_>| snapshot.flights.to_vec();
    assert!(one.snapshot(one.time(), states) == two.snapshot(two.time(), states), "not the same bits");
    duel
}

fn main() {
    // Both cores wait for work here, so none has to be woken from outside.
    rayon::ThreadPoolBuilder::new().build().expect("threads").install(race_all);
}

fn race_all() {
    let largest = std::env::args().find_map(|argument| argument.parse::<f64>().ok()).unwrap_or(1e5);
    let within = |grains: f64| grains <= 1.01 * if trial() { 1e4 } else { largest };
    let rounds = if trial() { 1 } else { ROUNDS };
    eprintln!(
        "{:42} {:>10} {:>10} {:>10} {:>8}",
        "elapsed time per collision", "collisions", "one core", "two cores", "one/two"
    );
    let line = |name: String, Duel { microseconds: [one, two], ratio, collisions }| {
        eprintln!("{name:42} {collisions:10} {one:7.3} µs {two:7.3} µs {:8.2}", 1.0 / ratio);
    };
    for cells in GASES.into_iter().filter(|&cells| within(4.0 * f64::from(cells).powi(3))) {
        for fraction in [0.1, 0.4] {
            let (mut start, time) = gas(cells, fraction);
            advance(&mut start, MELTING * time);
            let name = format!("gas of {} grains, fraction {fraction}", 4 * cells.pow(3));
            line(name, race(&start, if trial() { 0.1 } else { 2.0 } * time, rounds));
        }
    }
    for count in JETS.into_iter().filter(|&count| within(f64::from(count))) {
        line(format!("jet of {count} grains"), race(&jet(count), if trial() { 0.002 } else { 0.06 }, 1));
    }
}
