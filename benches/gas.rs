//! The elastic gas: what a collision costs once the lattice has melted, with the fast and the plain calendar. One iteration is one
//! collision.
//!
//! `cargo bench --bench gas`; the ratios of the two calendars, measured in turns, come at the end.

mod support;

use std::f64::consts::PI;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, Laws};
use impinge::{simulation, source};
use impinge_events::calendar::{Buckets, Calendar, PlainCalendar};
use impinge_events::{Domain, NoSurface};
use support::{Duel, advance, duel, trial};

/// Standard deviation of each component of the velocity, m/s. The unit cell of the lattice is 1 m.
const THERMAL_SPEED: f64 = 1.0;
/// Collisions a grain from the lattice to the gas.
const MELTING: f64 = 20.0;
const ROUNDS: u32 = 11;

/// A gas and how often its grains collide.
struct Gas<C: Calendar> {
    engine: EventDriven<NoSurface, C>,
    /// Collisions per second of simulated time.
    rate: f64,
    grains: usize,
}

impl<C: Calendar> Gas<C> {
    fn new(grains: &[NewGrain], domain: Domain, fraction: f64) -> Self {
        let law = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
        let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::None };
        let engine = EventDriven::new(grains, NoSurface, domain, laws, 0.0);
        Self { engine, rate: rate(grains, fraction), grains: grains.len() }
    }

    /// Goes on for about this many collisions and gives how many there were.
    fn collide(&mut self, collisions: f64) -> u64 {
        let until = self.engine.time() + collisions / self.rate;
        advance(&mut self.engine, until)
    }

    /// As long as `iterations` collisions take, measured on more of them where they are few.
    fn time_of(&mut self, iterations: u64) -> Duration {
        let start = Instant::now();
        let collisions = self.collide((iterations as f64).max(0.1 * self.grains as f64));
        start.elapsed().mul_f64(iterations as f64 / collisions as f64)
    }

    fn bench(&mut self, c: &mut Criterion, gas: &str, calendar: &str) {
        c.bench_function(&format!("{gas}/{calendar}"), |b| {
            b.iter_custom(|iterations| self.time_of(iterations));
        });
    }
}

/// Collisions per second between grains: Carnahan & Starling (1969) with Enskog's theory, N w / 2 with
/// w = 24 phi chi / √π × thermal speed / diameter.
fn rate(grains: &[NewGrain], fraction: f64) -> f64 {
    let chi = (1.0 - fraction / 2.0) / (1.0 - fraction).powi(3);
    let each = 24.0 * fraction * chi / PI.sqrt() * THERMAL_SPEED / (2.0 * grains[0].radius);
    grains.len() as f64 * each / 2.0
}

/// Four grains in each of `cells`³ unit cells of 1 m.
fn lattice(cells: u32, fraction: f64) -> Scene {
    let radius = (fraction * 3.0 / (16.0 * PI)).cbrt();
    let box_ = format!("min = [0, 0, 0], max = [{cells}, {cells}, {cells}]");
    toml::from_str(&format!(
        r#"
        run.until = 1.0
        domain = {{ {box_}, boundary = "periodic" }}
        grain = {{ radius = {radius}, density = 1000.0 }}
        [[source]]
        kind = "lattice"
        arrangement = "face-centred"
        cells = [{cells}, {cells}, {cells}]
        min = [0, 0, 0]
        max = [{cells}, {cells}, {cells}]
        velocity = [0, 0, 0]
        thermal_speed = {THERMAL_SPEED}
        "#
    ))
    .expect("a scene")
}

fn melted(cells: u32, fraction: f64) -> (Gas<Buckets>, Gas<PlainCalendar>) {
    let scene = lattice(cells, fraction);
    let domain = simulation::domain(&scene);
    let mut grains = source::place(&scene, ".".as_ref(), &|_, _| None).expect("a lattice").grains;
    let mut fast = Gas::<Buckets>::new(&grains, domain, fraction);
    fast.collide(MELTING / 2.0 * grains.len() as f64);
    fast.engine.snapshot(fast.engine.time(), |snapshot| {
        for (grain, flight) in grains.iter_mut().zip(snapshot.flights) {
            (grain.position, grain.velocity) = (flight.position, flight.velocity);
        }
    });
    (Gas::new(&grains, domain, fraction), Gas::new(&grains, domain, fraction))
}

fn gas(c: &mut Criterion) {
    let sizes: &[u32] = if trial() { &[4] } else { &[14, 29] };
    let rounds = if trial() { 1 } else { ROUNDS };
    let mut table = Vec::new();
    for &cells in sizes {
        for fraction in [0.1, 0.4] {
            let (mut fast, mut plain) = melted(cells, fraction);
            // The two runs are equal bit for bit, so each round is the same work for both.
            let share = (2 * fast.grains) as f64;
            let outcome = duel(rounds, || fast.collide(share), || plain.collide(share));
            let name = format!("gas of {} grains, volume fraction {fraction}", fast.grains);
            fast.bench(c, &name, "fast");
            plain.bench(c, &name, "plain");
            table.push((name, outcome));
        }
    }
    eprintln!(
        "\n{:42} {:>13} {:>14} {:>11}",
        "CPU time per collision", "fast calendar", "plain calendar", "plain/fast"
    );
    for (name, Duel { microseconds: [fast, plain], ratio, .. }) in table {
        eprintln!("{name:42} {fast:10.3} µs {plain:11.3} µs {ratio:11.2}");
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = gas }
criterion_main!(benches);
