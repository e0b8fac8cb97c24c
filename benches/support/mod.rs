//! What the benches of the engine share: running it, and holding two ways of doing the same against each other.

// Each bench is a crate of its own and uses its share of this one.
#![allow(dead_code, unreachable_pub)]

pub mod scenes;
pub mod valgrind;

use std::ops::ControlFlow;
use std::time::Duration;

use cpu_time::ProcessTime;
use criterion::Criterion;
use impinge::scheme::{EventDriven, GrainCollision, Observer};
use impinge_events::Surface;
use impinge_events::calendar::Calendar;

/// Whether the benches are only tried out (`cargo test --benches`, `cargo bench -- --test`): then once, with few grains.
pub fn trial() -> bool {
    let asked_for = |flag| std::env::args().any(|argument| argument == flag);
    asked_for("--test") || !asked_for("--bench")
}

/// Few samples and short times, so that all benches together take some minutes.
pub fn criterion() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1500))
}

/// Counts grain–grain collisions.
#[derive(Default)]
pub struct Count(pub u64);

impl Observer for Count {
    fn grain_collision(&mut self, _collision: &GrainCollision) {
        self.0 += 1;
    }
}

/// Runs to simulated time `until` (s) and gives the number of grain–grain collisions on the way.
pub fn advance<S: Surface, C: Calendar>(engine: &mut EventDriven<S, C>, until: f64) -> u64 {
    let mut count = Count::default();
    let flow = engine.advance(until, &mut count, &mut |_| ControlFlow::Continue(())).expect("a sound run");
    assert!(flow.is_continue());
    count.0
}

/// Two ways of doing the same, held against each other.
pub struct Duel {
    /// CPU time per collision of each (median), µs.
    pub microseconds: [f64; 2],
    /// CPU time per collision of the second over that of the first: the median of the ratios in each round.
    pub ratio: f64,
    /// Collisions of the first in one round.
    pub collisions: u64,
}

/// Lets two ways take turns, so that whatever else the machine does troubles both; each gives the number of its collisions. CPU time.
pub fn duel(rounds: u32, first: impl FnMut() -> u64, second: impl FnMut() -> u64) -> Duel {
    duel_by(|| ProcessTime::now().as_duration(), rounds, first, second)
}

/// The same by another clock.
pub fn duel_by(
    clock: impl Fn() -> Duration,
    rounds: u32,
    mut first: impl FnMut() -> u64,
    mut second: impl FnMut() -> u64,
) -> Duel {
    let mut times = [Vec::new(), Vec::new()];
    let mut collisions = [0; 2];
    for round in 0..rounds {
        // Neither is always the one that finds the caches cold.
        let order = if round % 2 == 0 { [0, 1] } else { [1, 0] };
        for side in order {
            let start = clock();
            collisions[side] = if side == 0 { first() } else { second() };
            times[side].push((clock() - start).as_secs_f64() * 1e6 / collisions[side] as f64);
        }
    }
    let ratios = times[0].iter().zip(&times[1]).map(|(first, second)| second / first).collect();
    Duel { microseconds: times.map(median), ratio: median(ratios), collisions: collisions[0] }
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
