//! The order in the sub-step of a scene with forces, measured by halving the sub-step.
//!
//! `cargo run --release --example substep_order` takes two grains that attract each other and bounce;
//! `cargo run --release --example substep_order -- SCENE.toml [UNTIL]` takes a scene, until UNTIL (s) where that is given.
//!
//! Each error is the largest distance of a grain from where it is in a run that is 16 times finer than the finest. It depends on where in the sub-step
//! collisions fall, so the order is the slope of a straight line through all, and errors are root mean squares over some neighbouring sub-steps. The
//! residual of the ledger, beside them, needs no finer run: without it, nobody knows that a scheme is wrong.
#![expect(clippy::print_stdout, reason = "the table is what this program is for")]

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use impinge::grains::Snapshot;
use impinge::observe::Ledger;
use impinge::scene::{Overrides, Scene, SceneFile, Substep};
use impinge::scheme::Observer;
use impinge::simulation::Simulation;
use nalgebra::Vector3;

/// Two grains of 2 kg and 1 m, at rest 2 m apart, under F = -1/x² + 0.5/x³ N: they attract each other even where they touch.
const TWO_GRAINS: &str = r#"
    run.until = 20.0
    domain = { min = [-9.0, -9.0, -9.0], max = [9.0, 9.0, 9.0] }
    grain = { radius = 0.5, density = 3.819718634205488 }
    contact = { grain = { restitution = 0.9 } }
    near_field = { alpha1 = 1.0, beta1 = 2.0, alpha2 = 0.5, beta2 = 3.0, substep = 0.05 }
    source = [{ kind = "lattice", min = [-2.0, -0.5, -0.5], max = [2.0, 0.5, 0.5], cells = [2, 1, 1], velocity = [0.0, 0.0, 0.0] }]
"#;

/// How often the sub-step is halved.
const HALVINGS: u32 = 5;
/// Neighbouring sub-steps, from the given one to 2/3 of it.
const NEIGHBOURS: u32 = 16;

/// Where the grains are.
#[derive(Default)]
struct Places(Vec<(u64, Vector3<f64>)>);

impl Observer for Places {
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        let all = snapshot.grains.iter().zip(snapshot.flights);
        self.0 = all.map(|(grain, flight)| (grain.id, flight.position)).collect();
    }
}

/// Where the grains are at the end, and the relative residual of energy, in sub-steps of `step` (s).
fn run(scene: &Scene, folder: &Path, step: f64) -> Result<(Places, f64), Box<dyn Error>> {
    let mut scene = scene.clone();
    match &mut scene.near_field {
        Some(near_field) => near_field.substep = Some(Substep::Fixed(step)),
        None => scene.run.substep = Some(step),
    }
    let mut observers = (Places::default(), Ledger::default());
    Simulation::new(&scene, folder)?.run(&mut observers, &mut |_| ControlFlow::Continue(()))?;
    Ok((observers.0, observers.1.relative_energy_residual()))
}

/// Largest distance of a grain from where it is in the other run, m.
fn distance(one: &Places, other: &Places) -> f64 {
    let apart = one.0.iter().zip(&other.0).map(|(one, other)| {
        assert_eq!(one.0, other.0, "one run has a grain that the other has not");
        (one.1 - other.1).norm()
    });
    apart.fold(0.0, f64::max)
}

/// Slope of the straight line through `points` that has the least squares of errors.
fn slope(points: &[(f64, f64)]) -> f64 {
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let covariance: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    covariance / points.iter().map(|point| (point.0 - x).powi(2)).sum::<f64>()
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let (scene, folder) = match args.next() {
        Some(path) => {
            let until = args.next().map(|until| until.parse()).transpose()?;
            let file = SceneFile::read(Path::new(&path), &Overrides { until, ..Overrides::default() })?;
            (file.scene.clone(), file.folder().to_owned())
        }
        None => (toml::from_str(TWO_GRAINS)?, Path::new(".").to_owned()),
    };
    if !scene.has_forces() {
        return Err("no force acts in this scene, so there are no sub-steps".into());
    }
    let longest = match scene.substep() {
        Substep::Fixed(step) => step,
        Substep::Chosen(_) => (scene.run.until - scene.run.start) / 256.0,
    };
    let halved = |times: u32| longest / 2f64.powi(times as i32);
    let (reference, _) = run(&scene, &folder, halved(HALVINGS + 4))?;

    println!("{:>14} {:>14} {:>8} {:>18} {:>8}", "sub-step, s", "error, m", "order", "ledger residual", "order");
    let (mut errors, mut residuals) = (Vec::<(f64, f64)>::new(), Vec::<(f64, f64)>::new());
    for halving in 0..=HALVINGS {
        let (mut error, mut residual) = (0.0, 0.0);
        for neighbour in 0..NEIGHBOURS {
            let step = halved(halving) / (1.0 + 0.5 * f64::from(neighbour) / f64::from(NEIGHBOURS));
            let (places, left) = run(&scene, &folder, step)?;
            error += distance(&places, &reference).powi(2) / f64::from(NEIGHBOURS);
            residual += left.powi(2) / f64::from(NEIGHBOURS);
        }
        let order = |before: Option<&(f64, f64)>, square: f64| {
            before.map_or(String::new(), |before| format!("{:.2}", (before.1 - 0.5 * square.ln()) / f64::ln(2.0)))
        };
        let orders = [order(errors.last(), error), order(residuals.last(), residual)];
        let [error_shown, residual_shown] = [error.sqrt(), residual.sqrt()];
        println!(
            "{:14.6e} {error_shown:14.4e} {:>8} {residual_shown:18.4e} {:>8}",
            halved(halving),
            orders[0],
            orders[1]
        );
        errors.push((halved(halving).ln(), 0.5 * error.ln()));
        residuals.push((halved(halving).ln(), 0.5 * residual.ln()));
    }
    let (order, order_of_ledger) = (slope(&errors), slope(&residuals));
    println!("{:>14} {:>14} {order:8.2} {:>18} {order_of_ledger:8.2}", "all together", "", "");
    Ok(())
}
