//! Instructions per grain–grain collision, counted by valgrind: unlike times they are the same on a busy machine, so they tell whether a change
//! made the engine slower.
//!
//! `cargo bench --bench instructions`. A count that is more than [`LEEWAY`] above the recorded one fails; where there is no valgrind, and where
//! the bench is only tried out, nothing is counted. The bench runs itself under valgrind, once with and once without the collisions, and takes the difference.

mod support;

use std::error::Error;

use support::trial;
use support::valgrind::{Run, count, serve};

/// What is counted, and how many instructions a collision took when it was last recorded.
const RECORDED: [(Run, f64); 4] = [
    (Run::Jet { grains: 2000 }, 16_270.0),
    (Run::Jet { grains: 8000 }, 10_130.0),
    (Run::Gas { cells: 8, percent: 10 }, 8_000.0),
    (Run::Gas { cells: 8, percent: 40 }, 8_120.0),
];
/// A count may be larger than the recorded one by this fraction: compilers differ.
const LEEWAY: f64 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let runs = RECORDED.map(|(run, _)| run);
    if serve(&runs) {
        return Ok(());
    }
    if trial() {
        assert!(runs.iter().all(|run| run.until(0.0) == 0), "it is set up and does not collide");
        return Ok(());
    }
    eprintln!("{:26} {:>12} {:>10} {:>6}", "instructions", "a collision", "recorded", "ratio");
    let mut worse = Vec::new();
    for (number, (run, before)) in RECORDED.into_iter().enumerate() {
        let counted =
            |part| count(number, part, &["--tool=callgrind", "--callgrind-out-file=/dev/null"], &["Collected :"]);
        let (Some(all), Some(start)) = (counted(1.0)?, counted(0.0)?) else {
            eprintln!("no valgrind: nothing is counted");
            return Ok(());
        };
        let each = all.each_beyond(&start)[0];
        eprintln!("{:26} {each:12.0} {before:10.0} {:6.3}", run.name(), each / before);
        if each > before * (1.0 + LEEWAY) {
            worse.push(run.name());
        }
    }
    if worse.is_empty() { Ok(()) } else { Err(format!("more instructions than recorded: {}", worse.join(", ")).into()) }
}
