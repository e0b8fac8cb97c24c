//! One core against two ([`Halves`]): gases once they have melted, in turns, and jets from start to end, once. Elapsed time.
//!
//! `cargo bench --bench cores`; `cargo bench --bench cores -- 1e6` for gases and jets of up to a million grains.

mod support;

use std::ops::ControlFlow;
use std::time::Instant;

use impinge::scheme::{Collapse, EventDriven, Halves};
use impinge_events::{NoSurface, Surface};
use support::scenes::{Gas, JET_RESTITUTION, JET_UNTIL, gas, plane, smooth, wide_jet};
use support::{Duel, advance, duel_by, trial};

/// Unit cells along the sides of gases (four grains each), and grains of jets.
const GASES: [u32; 3] = [14, 29, 63];
const JETS: [u32; 3] = [8_000, 100_000, 1_000_000];
/// Collisions a grain in which a lattice melts.
const MELTING: f64 = 4.0;
const ROUNDS: u32 = 5;

/// Both from copies of `start`, a part of the way after the other; and how many events two cores resolved for each that happened.
fn race<S: Surface + Clone + Send + Sync>(start: &EventDriven<S>, part: f64, rounds: u32) -> (Duel, f64) {
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
    let windows = two.windows();
    (duel, windows.resolved as f64 / windows.told as f64)
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
        "{:42} {:>10} {:>10} {:>10} {:>8} {:>15}",
        "elapsed time per collision", "collisions", "one core", "two cores", "one/two", "resolved/event"
    );
    let line = |name: String, (Duel { microseconds: [one, two], ratio, collisions }, resolved): (Duel, f64)| {
        eprintln!("{name:42} {collisions:10} {one:7.3} µs {two:7.3} µs {:8.2} {resolved:15.2}", 1.0 / ratio);
    };
    for cells in GASES.into_iter().filter(|&cells| within(4.0 * f64::from(cells).powi(3))) {
        for fraction in [0.1, 0.4] {
            let Gas { grains, domain, time } = gas(cells, fraction);
            let mut start = EventDriven::new(&grains, NoSurface, domain, smooth(1.0, Collapse::Elastic), 0.0);
            advance(&mut start, MELTING * time);
            let name = format!("gas of {} grains, fraction {fraction}", 4 * cells.pow(3));
            line(name, race(&start, if trial() { 0.1 } else { 2.0 } * time, rounds));
        }
    }
    for count in JETS.into_iter().filter(|&count| within(f64::from(count))) {
        let (grains, domain) = wide_jet(count);
        let start = EventDriven::new(&grains, plane(), domain, smooth(JET_RESTITUTION, Collapse::Elastic), 0.0);
        line(format!("jet of {count} grains"), race(&start, if trial() { 0.002 } else { JET_UNTIL }, 1));
    }
}
