//! How much memory a grain takes: a gas of a hundred thousand and one of a million grains, on one core and on two, which keep two engines; each in a
//! process of its own.
//!
//! `cargo run --release --example memory`, on Linux; a number of grains and one of cores may be given.
//!
//! The figures are those of the operating system (resident memory), so they hold everything: flights, plans, calendar, cells, what
//! the grains carry, and what the allocator keeps. The peak includes the placing of the grains.
#![expect(clippy::print_stdout, reason = "the figures are what this program is for")]

use std::error::Error;
use std::ops::ControlFlow;
use std::process::Command;

use impinge::scene::Scene;
use impinge::simulation::Simulation;

/// Volume fraction of the gas.
const FRACTION: f64 = 0.2;
/// Bytes a grain and engine that must not be exceeded at the end of the run.
const MOST: f64 = 600.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    if let (Some(grains), Some(cores)) = (arguments.next(), arguments.next()) {
        let (grains, cores) = (grains.parse()?, cores.parse()?);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(cores).build()?;
        return Ok(pool.install(|| measure(grains, cores).map_err(|error| error.to_string()))?);
    }
    println!("{:>9} {:>6} {:>17} {:>17}", "grains", "cores", "bytes a grain", "at the peak");
    for (grains, cores) in [(100_000, 1), (100_000, 2), (1_000_000, 1), (1_000_000, 2)] {
        // What the allocator kept of one gas must not serve the next.
        let status = Command::new(std::env::current_exe()?).args([grains, cores].map(|n| n.to_string())).status()?;
        if !status.success() {
            return Err(status.to_string().into());
        }
    }
    Ok(())
}

/// Runs a gas of about so many grains and says what it took.
fn measure(grains: u32, cores: usize) -> Result<(), Box<dyn Error>> {
    let cells = (f64::from(grains) / 4.0).cbrt().round() as u32;
    let grains = 4.0 * f64::from(cells).powi(3);
    let scene = gas(cells)?;
    let before = memory("VmRSS")?;
    let mut simulation = Simulation::new(&scene, ".".as_ref())?;
    simulation.run(&mut (), &mut |_| ControlFlow::Continue(()))?;
    let after = (memory("VmRSS")? - before) / grains;
    let peak = (memory("VmHWM")? - before) / grains;
    println!("{grains:9} {cores:6} {after:17.0} {peak:17.0}");
    assert!(after <= MOST * cores as f64, "{after:.0} bytes a grain");
    Ok(())
}

/// Four grains in each of `cells`³ unit cells of 1 m, for about one collision each.
fn gas(cells: u32) -> Result<Scene, toml::de::Error> {
    let radius = (FRACTION * 3.0 / (16.0 * std::f64::consts::PI)).cbrt();
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
