//! What runs cost, counted by valgrind: a bench runs itself under it, once with and once without what is counted, and takes the difference.

use std::error::Error;
use std::io;
use std::process::Command;

use impinge::scheme::{Collapse, EventDriven};
use impinge_events::{Domain, NoSurface};

use super::advance;
use super::scenes::{JET_RESTITUTION, JET_UNTIL, gas, plane, reference_jet, smooth};

/// Tells a bench that it is counted: then come the number of the run and how much of it to run.
const COUNTED: &str = "--counted";
/// Collisions of each grain in a whole run of a gas.
const COLLISIONS: f64 = 20.0;

/// What is run.
#[derive(Clone, Copy, Debug)]
pub enum Run {
    /// A reference jet onto a plane.
    Jet { grains: u32 },
    /// An elastic gas of so many unit cells along a side, and of so many per cent of packing fraction.
    Gas { cells: u32, percent: u32 },
}

impl Run {
    pub fn name(self) -> String {
        match self {
            Self::Jet { grains } => format!("jet of {grains}"),
            Self::Gas { cells, percent } => {
                format!("gas of {}, fraction {}", 4 * cells.pow(3), f64::from(percent) / 100.0)
            }
        }
    }

    /// Runs this part of it, or only sets it up; gives the number of grain–grain collisions.
    pub fn until(self, part: f64) -> u64 {
        match self {
            Self::Jet { grains } => {
                let laws = smooth(JET_RESTITUTION, Collapse::Elastic);
                let domain = Domain::unbounded();
                let mut engine: EventDriven<_> = EventDriven::new(&reference_jet(grains), plane(), domain, laws, 0.0);
                if part > 0.0 { advance(&mut engine, part * JET_UNTIL) } else { 0 }
            }
            Self::Gas { cells, percent } => {
                let gas = gas(cells, f64::from(percent) / 100.0);
                let laws = smooth(1.0, Collapse::Elastic);
                let mut engine: EventDriven<_> = EventDriven::new(&gas.grains, NoSurface, gas.domain, laws, 0.0);
                if part > 0.0 { advance(&mut engine, part * COLLISIONS * gas.time) } else { 0 }
            }
        }
    }
}

/// What valgrind counted in a run, by the labels it was asked for, and the collisions in it.
pub struct Counted {
    pub sums: Vec<f64>,
    pub collisions: f64,
}

impl Counted {
    /// Of each sum what a collision takes, of those by which a run is longer than another one.
    pub fn each_beyond(&self, shorter: &Self) -> Vec<f64> {
        let collisions = self.collisions - shorter.collisions;
        self.sums.iter().zip(&shorter.sums).map(|(long, short)| (long - short) / collisions).collect()
    }
}

/// Runs the part of one of `runs` that the command line asks for; gives false if it asks for none.
pub fn serve(runs: &[Run]) -> bool {
    let arguments: Vec<String> = std::env::args().collect();
    let Some(at) = arguments.iter().position(|argument| argument == COUNTED) else { return false };
    let run = runs[arguments[at + 1].parse::<usize>().expect("a number")];
    eprintln!("collisions: {}", run.until(arguments[at + 2].parse().expect("a part")));
    true
}

/// The sums that a tool of valgrind finds behind `labels` when this bench runs a part of its run of this number, or `None` where there is no valgrind.
pub fn count(run: usize, part: f64, tool: &[&str], labels: &[&str]) -> Result<Option<Counted>, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(tool)
        .arg(std::env::current_exe()?)
        .args([COUNTED, &run.to_string(), &part.to_string()])
        .output();
    let output = match output {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        output => output?,
    };
    let text = String::from_utf8(output.stderr)?;
    let number = |label: &&str| -> Result<f64, Box<dyn Error>> {
        let (_, rest) = text.lines().find_map(|line| line.split_once(*label)).ok_or_else(|| text.clone())?;
        let digits = rest.split_whitespace().next().ok_or("no number")?;
        Ok(digits.replace(',', "").parse()?)
    };
    let sums = labels.iter().map(number).collect::<Result<_, _>>()?;
    Ok(Some(Counted { sums, collisions: number(&"collisions:")? }))
}
