//! How much memory a grain takes: in an engine alone, and in a whole simulation on one core and on two, which keep two engines; each in a process of its
//! own.
//!
//! `cargo run --release --example memory`, on Linux; a number of grains, one of cores (0 for an engine alone) and a volume fraction may be given.
//!
//! The figures are those of the operating system (resident memory), so they hold everything: flights, plans, calendar, cells, what
//! the grains carry, and what the allocator keeps. The peak includes the placing of the grains.
#![expect(clippy::print_stdout, reason = "the figures are what this program is for")]

use std::error::Error;
use std::ops::ControlFlow;
use std::process::Command;

use impinge::law::{ContactLaw, Friction};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, Laws};
use impinge::simulation::{self, Simulation};
use impinge::source;
use impinge_events::NoSurface;

/// Grains, cores, and the volume fraction of the gas.
const RUNS: [(u32, usize, f64); 6] = [
    (1_000_000, 0, 0.1),
    (1_000_000, 0, 0.4),
    (100_000, 1, 0.2),
    (100_000, 2, 0.2),
    (1_000_000, 1, 0.2),
    (1_000_000, 2, 0.2),
];
/// Bytes a grain and engine that must not be exceeded at the end of the run.
const MOST: f64 = 600.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [grains, cores, fraction] = &arguments[..] {
        let number = |text: &String| {
            let number = text.parse::<f64>().ok().filter(|&number| number >= 0.0);
            number.ok_or_else(|| format!("`{text}` is not a number from 0 on"))
        };
        let (grains, cores, fraction) = (number(grains)? as u32, number(cores)? as usize, number(fraction)?);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(cores).build()?;
        return Ok(pool.install(|| measure(grains, cores, fraction).map_err(|error| error.to_string()))?);
    }
    if !arguments.is_empty() {
        return Err(
            "give a number of grains, one of cores (0 for an engine alone) and a volume fraction, or nothing".into()
        );
    }
    println!("{:>9} {:>8} {:>6} {:>17} {:>17}", "grains", "fraction", "cores", "bytes a grain", "at the peak");
    for (grains, cores, fraction) in RUNS {
        // What the allocator kept of one gas must not serve the next.
        let mut command = Command::new(std::env::current_exe()?);
        let status =
            command.args([f64::from(grains), cores as f64, fraction].map(|number| number.to_string())).status()?;
        if !status.success() {
            return Err(status.to_string().into());
        }
    }
    Ok(())
}

/// Runs a gas of about so many grains and says what it took.
fn measure(grains: u32, cores: usize, fraction: f64) -> Result<(), Box<dyn Error>> {
    let cells = (f64::from(grains) / 4.0).cbrt().round() as u32;
    let grains = 4.0 * f64::from(cells).powi(3);
    let scene = gas(cells, fraction)?;
    let before = memory("VmRSS")?;
    let (after, name) = match cores {
        0 => (engine_alone(&scene)?, "engine".to_owned()),
        _ => (whole_simulation(&scene)?, cores.to_string()),
    };
    let peak = (memory("VmHWM")? - before) / grains;
    let each = (after - before) / grains;
    println!("{grains:9} {fraction:8} {name:>6} {each:17.0} {peak:17.0}");
    let most = MOST * cores.max(1) as f64;
    if each > most {
        return Err(format!("that is more than {most:.0} bytes a grain").into());
    }
    Ok(())
}

/// The memory of the process once the scene has run, while all that ran it is there.
fn whole_simulation(scene: &Scene) -> Result<f64, Box<dyn Error>> {
    let mut simulation = Simulation::new(scene, ".".as_ref())?;
    simulation.run(&mut (), &mut |_| ControlFlow::Continue(()))?;
    memory("VmRSS")
}

/// The same of an engine that nobody looks at.
fn engine_alone(scene: &Scene) -> Result<f64, Box<dyn Error>> {
    let law = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
    let grains = source::place(scene, ".".as_ref(), &|_, _| None)?.grains;
    let mut engine: EventDriven<NoSurface> =
        EventDriven::new(&grains, NoSurface, simulation::domain(scene), laws, scene.run.start);
    drop(grains);
    let flow = engine.advance(scene.run.until, &mut (), &mut |_| ControlFlow::Continue(()))?;
    assert!(flow.is_continue());
    memory("VmRSS")
}

/// Four grains in each of `cells`³ unit cells of 1 m, for about one collision each.
fn gas(cells: u32, fraction: f64) -> Result<Scene, toml::de::Error> {
    let radius = (fraction * 3.0 / (16.0 * std::f64::consts::PI)).cbrt();
    toml::from_str(&format!(
        r#"
        run.until = 0.1
        domain = {{ min = [0, 0, 0], max = [{cells}, {cells}, {cells}], boundary = "periodic" }}
        grain = {{ radius = {radius}, density = 1000.0 }}
        contact.grain.restitution = 1.0
        output.samples = 0
        [[source]]
        kind = "lattice"
        arrangement = "face-centred"
        cells = [{cells}, {cells}, {cells}]
        min = [0, 0, 0]
        max = [{cells}, {cells}, {cells}]
        velocity = [0, 0, 0]
        thermal_speed = 1.0
        "#
    ))
}

/// A line of `/proc/self/status`, in bytes.
fn memory(name: &str) -> Result<f64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status").map_err(|error| format!("needs Linux: {error}"))?;
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    let kibibytes: f64 = line.and_then(|line| line.split_whitespace().next()).ok_or("no such line")?.parse()?;
    Ok(kibibytes * 1024.0)
}
