//! What a collision costs against the number of grains and against the packing fraction: elastic gases, one core, all included.
//!
//! `cargo run --release --example collision_cost -- 1e6`; the largest number of grains is 1e4 if none is given, and 1e7 takes half an hour and 5 GB.
//! Prints the tables of `docs/performance.md` and draws `collision_cost.svg` in the current folder.
#![expect(clippy::print_stdout, reason = "the figures are what this program is for")]

use std::error::Error;
use std::f64::consts::PI;
use std::ops::ControlFlow;

use cpu_time::ProcessTime;
use impinge::law::{ContactLaw, Friction};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, GrainCollision, Laws, Observer};
use impinge::{simulation, source};
use impinge_events::NoSurface;
use plotters::prelude::*;

/// Unit cells along a side; each holds four grains.
const SIDES: [u32; 8] = [6, 10, 14, 20, 29, 43, 63, 136];
/// Packing fractions at which the number of grains varies.
const FRACTIONS: [f64; 2] = [0.1, 0.4];
/// Packing fractions for the gas of 14³ unit cells.
const MORE_FRACTIONS: [f64; 7] = [0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.49];
/// Collisions a grain until the lattice has melted, of many grains fewer: they would take long, and the cost hardly changes from then on.
const MELTING: [f64; 2] = [10.0, 3.0];
const MANY: usize = 500_000;
/// Measurements of each; the median counts.
const ROUNDS: usize = 3;
/// Least CPU time of a measurement, s, and fewest collisions a grain.
const LEAST_TIME: f64 = 0.3;
const LEAST_COLLISIONS: f64 = 1.0;

/// Collisions a second of other codes, one core of a quiet machine of 2022 to 2025, at 1e4, 1e5 and 1e6 grains: Smallenburg's EDMD, the best
/// variant for each, and DynamO.
const OTHERS: [(&str, [[f64; 3]; 2]); 2] = [
    ("EDMD", [[1.11e6, 0.56e6, 0.28e6], [1.20e6, 0.63e6, 0.35e6]]),
    ("DynamO", [[0.146e6, 0.06e6, 0.044e6], [0.181e6, 0.083e6, 0.065e6]]),
];

#[derive(Default)]
struct Count(u64);

impl Observer for Count {
    fn grain_collision(&mut self, _collision: &GrainCollision) {
        self.0 += 1;
    }
}

/// Microseconds a collision in a gas of so many unit cells along a side.
fn cost(side: u32, fraction: f64) -> Result<(usize, f64), Box<dyn Error>> {
    let radius = (fraction * 3.0 / (16.0 * PI)).cbrt();
    let scene: Scene = toml::from_str(&format!(
        r#"
        run.until = 1.0
        domain = {{ min = [0, 0, 0], max = [{side}, {side}, {side}], boundary = "periodic" }}
        grain = {{ radius = {radius}, density = 1000.0 }}
        [[source]]
        kind = "lattice"
        arrangement = "face-centred"
        cells = [{side}, {side}, {side}]
        min = [0, 0, 0]
        max = [{side}, {side}, {side}]
        velocity = [0, 0, 0]
        thermal_speed = 1.0
        "#
    ))?;
    let grains = source::place(&scene, ".".as_ref(), &|_, _| None)?.grains;
    let law = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::None };
    let mut engine: EventDriven<_> = EventDriven::new(&grains, NoSurface, simulation::domain(&scene), laws, 0.0);
    let n = grains.len() as f64;
    drop(grains);
    // Carnahan & Starling with Enskog's theory.
    let chi = (1.0 - fraction / 2.0) / (1.0 - fraction).powi(3);
    let rate = 0.5 * n * 24.0 * fraction * chi / PI.sqrt() / (2.0 * radius);
    let mut collide = |collisions: f64| -> Result<f64, Box<dyn Error>> {
        let (mut count, start) = (Count::default(), ProcessTime::now());
        let until = engine.time() + collisions / rate;
        let flow = engine.advance(until, &mut count, &mut |_| ControlFlow::Continue(()))?;
        assert!(flow.is_continue());
        Ok(start.elapsed().as_secs_f64() / count.0 as f64)
    };
    let melting = MELTING[usize::from(n as usize > MANY)];
    let guess = collide(0.5 * melting * n)?;
    let collisions = (0.5 * LEAST_COLLISIONS * n).max(LEAST_TIME / guess);
    let mut each = (0..ROUNDS).map(|_| collide(collisions)).collect::<Result<Vec<_>, _>>()?;
    each.sort_by(f64::total_cmp);
    Ok((n as usize, 1e6 * each[ROUNDS / 2]))
}

fn main() -> Result<(), Box<dyn Error>> {
    let most: f64 = std::env::args().nth(1).map_or(Ok(1e4), |text| text.parse())?;
    let mut by_number = [Vec::new(), Vec::new()];
    println!("{:>10} {:>14} {:>14}", "grains", "fraction 0.1", "fraction 0.4");
    for side in SIDES.into_iter().filter(|&side| 4.0 * f64::from(side).powi(3) <= 1.1 * most) {
        let [(n, dilute), (_, dense)] = [cost(side, FRACTIONS[0])?, cost(side, FRACTIONS[1])?];
        println!("{n:10} {dilute:11.3} µs {dense:11.3} µs");
        by_number[0].push((n as f64, dilute));
        by_number[1].push((n as f64, dense));
    }
    println!("{:>10}", "fraction");
    let mut by_fraction = Vec::new();
    for fraction in MORE_FRACTIONS {
        let (_, each) = cost(14, fraction)?;
        println!("{fraction:10} {each:11.3} µs");
        by_fraction.push((fraction, each));
    }
    draw(&by_number, &by_fraction)
}

fn draw(by_number: &[Vec<(f64, f64)>; 2], by_fraction: &[(f64, f64)]) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new("collision_cost.svg", (1000, 460)).into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(600);
    let colours = [RGBColor(0, 90, 160), RGBColor(200, 90, 0)];
    let largest = by_number[0].last().map_or(1e6, |last| last.0).max(1e6);
    let mut chart = ChartBuilder::on(&left)
        .caption("against the number of grains", ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d((500.0..2.0 * largest).log_scale(), (0.3..40.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("grains")
        .y_desc("CPU time a collision, µs")
        .x_label_formatter(&|x| format!("{x:e}"))
        .label_style(("sans-serif", 14))
        .light_line_style(WHITE)
        .draw()?;
    for ((series, fraction), colour) in by_number.iter().zip(FRACTIONS).zip(colours) {
        chart
            .draw_series(LineSeries::new(series.iter().copied(), colour.stroke_width(2)).point_size(3))?
            .label(format!("this engine, fraction {fraction}"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    for (number, (name, rates)) in OTHERS.iter().enumerate() {
        for ((rates, fraction), colour) in rates.iter().zip(FRACTIONS).zip(colours) {
            let points = [1e4, 1e5, 1e6].into_iter().zip(rates.map(|rate| 1e6 / rate));
            let mark = move |at, size| match number {
                0 => (EmptyElement::at(at) + TriangleMarker::new((0, 0), size, colour.filled())).into_dyn(),
                _ => (EmptyElement::at(at) + Cross::new((0, 0), size, colour.stroke_width(2))).into_dyn(),
            };
            chart
                .draw_series(points.map(|point| mark(point, 5)))?
                .label(format!("{name}, quiet machine, {fraction}"))
                .legend(move |(x, y)| match number {
                    0 => TriangleMarker::new((x + 9, y), 5, colour.filled()).into_dyn(),
                    _ => Cross::new((x + 9, y), 5, colour.stroke_width(2)).into_dyn(),
                });
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 13))
        .draw()?;
    let top = by_fraction.iter().map(|point| point.1).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(&right)
        .caption("against the packing fraction, 10 976 grains", ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(50)
        .build_cartesian_2d(0.0..0.5, 0.0..1.2 * top)?;
    chart
        .configure_mesh()
        .x_desc("packing fraction")
        .y_desc("µs")
        .label_style(("sans-serif", 14))
        .light_line_style(WHITE)
        .draw()?;
    chart.draw_series(LineSeries::new(by_fraction.iter().copied(), colours[0].stroke_width(2)).point_size(3))?;
    root.present()?;
    Ok(())
}
