//! The floor that memory sets: cache lines that a collision waits for, counted by valgrind, times what a line takes to come at the best, beside what a
//! collision takes.
//!
//! `cargo bench --bench memory_traffic`, two minutes. A line is at its best when the processor may ask for many at once, from a table as large as
//! what the grains take; beside it stands the line whose address is known only when the one before has come.

mod support;

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use cpu_time::ProcessTime;
use rand::seq::SliceRandom;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use support::valgrind::{Run, count, serve};
use support::{median, trial};

/// What is counted, and what its tables take: 450 bytes a grain.
const RUNS: [(Run, usize); 5] = [
    (Run::Jet { grains: 8000 }, 4 << 20),
    (Run::Gas { cells: 14, percent: 10 }, 5 << 20),
    (Run::Gas { cells: 14, percent: 40 }, 5 << 20),
    (Run::Gas { cells: 29, percent: 10 }, 44 << 20),
    (Run::Gas { cells: 29, percent: 40 }, 44 << 20),
];
/// Not in the table, since under valgrind they would take an hour: to be timed beside other programs, with `--counted`.
const LARGE_RUNS: [Run; 2] = [Run::Gas { cells: 63, percent: 10 }, Run::Gas { cells: 63, percent: 40 }];
/// The part of a run of a gas that is left out, in which its lattice melts, and the part up to which it is counted (of twenty collisions a grain).
const FROM: f64 = 0.2;
const UNTIL: f64 = 0.35;
/// The caches that are simulated: a first of 32 KB and a second of 1 MB, as cores of 2022 have (Zen 4).
const CACHES: [&str; 5] =
    ["--tool=cachegrind", "--cache-sim=yes", "--cachegrind-out-file=/dev/null", "--D1=32768,8,64", "--LL=1048576,8,64"];
const LABELS: [&str; 3] = ["I   refs:", "D1  misses:", "LLd misses:"];
const ROUNDS: usize = 5;

/// A cache line.
#[derive(Clone)]
#[repr(align(64))]
struct Line {
    next: u32,
}

/// Nanoseconds that a line of a table of so many bytes takes when each tells where the next is, and when all are known.
fn line_times(bytes: usize) -> [f64; 2] {
    let lines = bytes / size_of::<Line>();
    let mut random = Pcg64::seed_from_u64(1);
    let mut order: Vec<u32> = (0..lines as u32).collect();
    order.shuffle(&mut random);
    let mut table = vec![Line { next: 0 }; lines];
    for (&this, &next) in order.iter().zip(order.iter().cycle().skip(1)) {
        table[this as usize].next = next;
    }
    let time = |visit: &mut dyn FnMut() -> u32| {
        let each = (0..ROUNDS).map(|_| {
            let start = Instant::now();
            black_box(visit());
            start.elapsed().as_secs_f64() * 1e9 / lines as f64
        });
        each.fold(f64::INFINITY, f64::min)
    };
    let start = random.random_range(0..lines as u32);
    let chased = time(&mut || (0..lines).fold(start, |line, _| table[line as usize].next));
    let known = time(&mut || order.iter().fold(0, |sum: u32, &line| sum.wrapping_add(table[line as usize].next)));
    [chased, known]
}

/// Microseconds of CPU time that a collision of a run takes; the median.
fn cost(run: Run, from: f64, until: f64) -> f64 {
    let each = (0..ROUNDS).map(|_| {
        let timed = |part| {
            let start = ProcessTime::now();
            let collisions = run.until(part);
            (start.elapsed().as_secs_f64(), collisions)
        };
        let [short, long] = [timed(from), timed(until)];
        (long.0 - short.0) * 1e6 / (long.1 - short.1) as f64
    });
    median(each.collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let runs: Vec<Run> = RUNS.iter().map(|&(run, _)| run).chain(LARGE_RUNS).collect();
    if serve(&runs) {
        return Ok(());
    }
    if trial() {
        assert!(line_times(1 << 12).iter().all(|&time| time > 0.0));
        return Ok(());
    }
    eprintln!("{:26} {:>12} {:>8} {:>8} {:>11} {:>11} {:>8}", "", "", "not in", "not in", "a line,", "", "");
    eprintln!(
        "{:26} {:>12} {:>8} {:>8} {:>11} {:>11} {:>8} {:>9}",
        "a collision", "instructions", "32 KB", "1 MB", "chased", "known", "floor", "all"
    );
    for (number, (run, bytes)) in RUNS.into_iter().enumerate() {
        let [from, until] = if matches!(run, Run::Jet { .. }) { [0.0, 1.0] } else { [FROM, UNTIL] };
        let counted = |part| count(number, part, &CACHES, &LABELS);
        let (Some(long), Some(short)) = (counted(until)?, counted(from)?) else {
            eprintln!("no valgrind: nothing is counted");
            return Ok(());
        };
        let each = long.each_beyond(&short);
        let [chased, known] = line_times(bytes);
        // What is in the second cache comes as from a table that fits it.
        let near = line_times(1 << 19)[1];
        let floor = 1e-3 * ((each[1] - each[2]) * near + each[2] * known);
        let all = cost(run, from, until);
        eprintln!(
            "{:26} {:12.0} {:8.0} {:8.0} {chased:8.1} ns {known:8.1} ns {floor:5.2} µs {all:6.2} µs",
            run.name(),
            each[0],
            each[1],
            each[2]
        );
    }
    Ok(())
}
