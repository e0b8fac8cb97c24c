//! Instructions per grain–grain collision, counted by valgrind: unlike times they are the same on a busy machine, so they tell whether a change
//! made the engine slower.
//!
//! `cargo bench --bench instructions`. A count that is more than [`LEEWAY`] above the recorded one fails; where there is no valgrind, and where
//! the bench is only tried out, nothing is counted. The bench runs itself under valgrind, once with and once without the collisions, and takes the difference.

mod support;

use std::error::Error;
use std::f64::consts::PI;
use std::io;
use std::process::Command;

use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::scene::{self, Interference, PlaneSurface, Scene};
use impinge::scheme::{Collapse, EventDriven, Laws};
use impinge::surface::Surface;
use impinge::{simulation, source};
use impinge_events::{Domain, NoSurface};
use support::{advance, trial};

/// What is counted, and how many instructions a collision took when it was last recorded.
const RECORDED: [(&str, f64); 4] = [
    ("jet of 2000", 20_950.0),
    ("jet of 8000", 13_900.0),
    ("gas, fraction 0.1", 9_800.0),
    ("gas, fraction 0.4", 11_150.0),
];
/// A count may be larger than the recorded one by this fraction: compilers differ.
const LEEWAY: f64 = 0.05;
/// Tells the bench that it is counted: then comes what to run, and whether it collides.
const COUNTED: &str = "--counted";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|argument| argument == COUNTED) {
        eprintln!("collisions: {}", run(&arguments[at + 1], arguments[at + 2] == "yes"));
        return Ok(());
    }
    if trial() {
        assert!(RECORDED.iter().all(|(name, _)| run(name, false) == 0), "it is set up and does not collide");
        return Ok(());
    }
    eprintln!("{:20} {:>12} {:>10} {:>6}", "instructions", "a collision", "recorded", "ratio");
    let mut worse = Vec::new();
    for (name, before) in RECORDED {
        let Some((all, collisions)) = count(name, true)? else {
            eprintln!("no valgrind: nothing is counted");
            return Ok(());
        };
        let Some((start, _)) = count(name, false)? else { return Ok(()) };
        let each = (all - start) / collisions;
        eprintln!("{name:20} {each:12.0} {before:10.0} {:6.3}", each / before);
        if each > before * (1.0 + LEEWAY) {
            worse.push(name);
        }
    }
    if worse.is_empty() { Ok(()) } else { Err(format!("more instructions than recorded: {}", worse.join(", ")).into()) }
}

/// Instructions and collisions of a run, or `None` where there is no valgrind.
fn count(name: &str, collides: bool) -> Result<Option<(f64, f64)>, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args([COUNTED, name, if collides { "yes" } else { "no" }])
        .output();
    let output = match output {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        output => output?,
    };
    let text = String::from_utf8(output.stderr)?;
    let number = |label: &str| -> Result<f64, Box<dyn Error>> {
        let line = text.lines().find_map(|line| line.split_once(label)).ok_or_else(|| text.clone())?;
        Ok(line.1.trim().parse()?)
    };
    Ok(Some((number("Collected :")?, number("collisions:")?)))
}

/// Runs what has this name, or only sets it up; gives the number of collisions.
fn run(name: &str, collides: bool) -> u64 {
    let count = |engine_until: &mut dyn FnMut() -> u64| if collides { engine_until() } else { 0 };
    match name.rsplit_once("fraction ") {
        Some((_, fraction)) => {
            let (grains, domain) = gas(fraction.parse().expect("a fraction"));
            let mut engine: EventDriven<_> = EventDriven::new(&grains, NoSurface, domain, smooth(1.0), 0.0);
            count(&mut || advance(&mut engine, 4.0))
        }
        None => {
            let plane = PlaneSurface { point: [0.0; 3], normal: [0.0, 0.0, 1.0], velocity: [0.0; 3] };
            let plane = Surface::new(&[scene::Surface::Plane(plane)], ".".as_ref()).expect("a plane");
            let grains = jet(name.rsplit(' ').next().expect("a number"));
            let mut engine: EventDriven<_> = EventDriven::new(&grains, plane, Domain::unbounded(), smooth(0.8), 0.0);
            count(&mut || advance(&mut engine, 0.06))
        }
    }
}

fn smooth(restitution: f64) -> Laws {
    let law = ContactLaw { restitution, friction: Friction::Smooth };
    Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic }
}

fn placed(text: &str) -> (Vec<NewGrain>, Domain) {
    let scene: Scene = toml::from_str(text).expect("a scene");
    let folder = env!("CARGO_MANIFEST_DIR").as_ref();
    (source::place(&scene, folder, &|_, _| None).expect("grains").grains, simulation::domain(&scene))
}

/// The reference jet of so many grains.
fn jet(count: &str) -> Vec<NewGrain> {
    placed(&format!(
        r#"
        run.until = 1.0
        domain = {{ min = [-10, -10, -1], max = [10, 10, 10] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "file", path = "tests/data/jet_{count}.csv" }}]
        "#
    ))
    .0
}

/// A gas of 2048 grains, at first on a lattice whose cell is 1 m.
fn gas(fraction: f64) -> (Vec<NewGrain>, Domain) {
    let radius = (fraction * 3.0 / (16.0 * PI)).cbrt();
    placed(&format!(
        r#"
        run.until = 1.0
        domain = {{ min = [0, 0, 0], max = [8, 8, 8], boundary = "periodic" }}
        grain = {{ radius = {radius}, density = 1000.0 }}
        [[source]]
        kind = "lattice"
        arrangement = "face-centred"
        cells = [8, 8, 8]
        min = [0, 0, 0]
        max = [8, 8, 8]
        velocity = [0, 0, 0]
        thermal_speed = 1.0
        "#
    ))
}
