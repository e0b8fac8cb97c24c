//! Runs a scene and draws how often its grains collide over time, and their kinetic energy:
//!
//! ```console
//! $ cargo run --release --example event_rate examples/long/pile.toml docs/pile_event_rate.svg
//! ```
//!
//! Without arguments it draws those of `examples/bouncing.toml` into the folder for temporary files.
//!
//! Both axes of rates and energies are logarithmic: a pile comes to rest over many decades. Samples are those of the scene (`output.samples`).

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use impinge::grains::{Grain, Snapshot};
use impinge::observe::Ledger;
use impinge::scene::{Overrides, SceneFile};
use impinge::scheme::{GrainCollision, Kick, Observer, Passage, Rest, SurfaceHit};
use impinge::simulation::Simulation;
use impinge_events::Flight;
use plotters::coord::ranged1d::{KeyPointHint, Ranged};
use plotters::prelude::*;

const SIZE: (u32, u32) = (860, 620);
const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xb2);
const ORANGE: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const GREY: RGBColor = RGBColor(0x66, 0x66, 0x66);
const FAINT: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);

/// What had happened until one sample.
struct Row {
    /// s
    time: f64,
    grain_grain: u64,
    grain_surface: u64,
    /// Kinetic energy a grain, J.
    energy: f64,
}

#[derive(Default)]
struct Rates {
    ledger: Ledger,
    rows: Vec<Row>,
}

impl Observer for Rates {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.ledger.grain_collision(collision);
    }
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.ledger.surface_hit(hit);
    }
    fn kick(&mut self, kick: &Kick) {
        self.ledger.kick(kick);
    }
    fn rest(&mut self, rest: &Rest) {
        self.ledger.rest(rest);
    }
    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        self.ledger.passage(passage, time, flight, grain);
    }
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.ledger.sample(snapshot);
        let (counts, inside) = (self.ledger.counts(), self.ledger.inside());
        self.rows.push(Row {
            time: snapshot.time,
            grain_grain: counts.grain_grain,
            grain_surface: counts.grain_surface,
            energy: inside.energy() / inside.count().max(1) as f64,
        });
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let aside = std::env::temp_dir().join("event_rate.svg").to_string_lossy().into_owned();
    let (scene, picture) = match arguments.as_slice() {
        [scene, picture] => (scene.clone(), picture.clone()),
        [] => ("examples/bouncing.toml".to_owned(), aside),
        _ => return Err("event_rate SCENE.toml PICTURE.svg".into()),
    };
    let path = Path::new(&scene);
    let file = SceneFile::parse(path, &std::fs::read_to_string(path)?, &Overrides::default())?;
    let folder = path.parent().unwrap_or_else(|| ".".as_ref());
    let mut simulation = Simulation::new(&file.scene, folder)?;
    let mut rates = Rates::default();
    let _ = simulation.run(&mut rates, &mut |_| ControlFlow::Continue(()))?;
    draw(&file.scene.title, &rates.rows, Path::new(&picture))
}

/// Collisions a second between samples, of those that `count` counts; none stands for none.
fn rate(rows: &[Row], count: impl Fn(&Row) -> u64) -> Vec<(f64, Option<f64>)> {
    let between = |pair: &[Row]| {
        let events = count(&pair[1]) - count(&pair[0]);
        let rate = events as f64 / (pair[1].time - pair[0].time);
        (0.5 * (pair[0].time + pair[1].time), (events > 0).then_some(rate))
    };
    rows.windows(2).map(between).collect()
}

fn draw(title: &str, rows: &[Row], picture: &Path) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(picture, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(title, ("sans-serif", 19).into_font())?;
    let (upper, lower) = root.split_vertically(330);
    let end = rows.last().map_or(1.0, |row| row.time);
    let grains = rate(rows, |row| row.grain_grain);
    let surface = rate(rows, |row| row.grain_surface);
    let key = [("between grains", BLUE), ("with the surface", ORANGE)];
    panel(&upper, end, "", "collisions per second", &[grains, surface], &key)?;
    let energies = rows.iter().map(|row| (row.time, (row.energy > 0.0).then_some(row.energy))).collect();
    panel(&lower, end, "time (s)", "kinetic energy per grain (J)", &[energies], &[("", GREY)])?;
    root.present()?;
    Ok(())
}

type Curve = Vec<(f64, Option<f64>)>;

/// One panel with a logarithmic axis. Where there is no value, a curve has a gap, and a lonely value is a dot.
fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    end: f64,
    across: &str,
    up: &str,
    curves: &[Curve],
    key: &[(&str, RGBColor)],
) -> Result<(), Box<dyn Error>> {
    let values = || curves.iter().flatten().filter_map(|(_, value)| *value);
    let decade = |value: f64| 10f64.powi(value as i32);
    let low = decade(values().fold(f64::MAX, f64::min).log10().floor());
    let high = decade(values().fold(0.0, f64::max).log10().ceil());
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(if across.is_empty() { 24 } else { 42 })
        .y_label_area_size(78)
        .build_cartesian_2d(0.0..end, Decades((low..high).log_scale().into()))?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT)
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 15))
        .y_label_formatter(&|value| format!("1e{}", value.log10().round()))
        .x_desc(across)
        .y_desc(up)
        .draw()?;
    for (curve, &(name, colour)) in curves.iter().zip(key) {
        let gaps = curve.split(|(_, value)| value.is_none());
        for piece in gaps.filter(|piece| !piece.is_empty()) {
            let points: Vec<_> = piece.iter().filter_map(|&(time, value)| Some((time, value?))).collect();
            if points.len() == 1 {
                chart.draw_series(points.iter().map(|&point| Circle::new(point, 2, colour.filled())))?;
            }
            chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
        }
        if !name.is_empty() {
            chart
                .draw_series(std::iter::empty::<Circle<(f64, f64), i32>>())?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(3)));
        }
    }
    if key.iter().any(|(name, _)| !name.is_empty()) {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .border_style(TRANSPARENT)
            .background_style(WHITE)
            .label_font(("sans-serif", 15))
            .draw()?;
    }
    Ok(())
}

/// A logarithmic axis with a line at each decade, and nothing between.
struct Decades(LogCoord<f64>);

impl Ranged for Decades {
    type FormatOption = plotters::coord::ranged1d::DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.0.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        let range = self.0.range();
        (range.start.log10().round() as i32..=range.end.log10().round() as i32).map(|power| 10f64.powi(power)).collect()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.0.range()
    }
}
