//! The elastic gas: what a collision costs once the lattice has melted, with the fast and the plain calendar. One iteration is one
//! collision.
//!
//! `cargo bench --bench gas`; the ratios of the two calendars, measured in turns, come at the end.

mod support;

use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use impinge::scheme::{Collapse, EventDriven};
use impinge_events::NoSurface;
use impinge_events::calendar::{Buckets, Calendar, PlainCalendar};
use support::{Duel, advance, duel, scenes, trial};

/// Collisions a grain from the lattice to the gas.
const MELTING: f64 = 20.0;
const ROUNDS: u32 = 11;

/// A gas and how often its grains collide.
struct Gas<C: Calendar> {
    engine: EventDriven<NoSurface, C>,
    /// In which each grain collides once, s.
    time: f64,
    grains: usize,
}

impl<C: Calendar> Gas<C> {
    fn new(gas: &scenes::Gas) -> Self {
        let laws = scenes::smooth(1.0, Collapse::None);
        let engine = EventDriven::new(&gas.grains, NoSurface, gas.domain, laws, 0.0);
        Self { engine, time: gas.time, grains: gas.grains.len() }
    }

    /// Goes on for about this many collisions and gives how many there were.
    fn collide(&mut self, collisions: f64) -> u64 {
        let until = self.engine.time() + 2.0 * collisions / self.grains as f64 * self.time;
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

fn melted(cells: u32, fraction: f64) -> (Gas<Buckets>, Gas<PlainCalendar>) {
    let mut gas = scenes::gas(cells, fraction);
    let mut fast = Gas::<Buckets>::new(&gas);
    fast.collide(MELTING / 2.0 * gas.grains.len() as f64);
    fast.engine.snapshot(fast.engine.time(), |snapshot| {
        for (grain, flight) in gas.grains.iter_mut().zip(snapshot.flights) {
            (grain.position, grain.velocity) = (flight.position, flight.velocity);
        }
    });
    (Gas::new(&gas), Gas::new(&gas))
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
