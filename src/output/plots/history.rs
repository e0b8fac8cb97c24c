//! The time history of energy (Mukherjee & Zohdi 2015, fig. 13).

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{
    BLUE, Drawn, FAINT, FINE, GREEN, HEADING, INK, MUTED, ORANGE, PURPLE, SKY, fine, part, picture, style, tick, write,
};
use crate::observe::{History, Ledger, Moment};
use crate::output::summary::{Prefix, quantity};

const SIZE: [i32; 2] = [900, 520];
/// Where the key begins, right of the curves, pixels.
const KEY: i32 = 665;

/// Name, colour and value of a curve that may be absent.
type Potential = (&'static str, RGBColor, fn(&Moment) -> Option<f64>);

/// Potential energies, less what they were at the start.
const POTENTIALS: [Potential; 2] = [
    ("near-field potential", PURPLE, |moment| moment.near_field),
    ("potential of gravity", SKY, |moment| moment.gravity),
];

struct Curve {
    name: &'static str,
    colour: RGBColor,
    points: Vec<(f64, f64)>,
}

impl Curve {
    fn last(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.1)
    }
}

/// Draws the energy brought to the surface so far, the kinetic energy inside, and potential energies where forces act, over the energy E0: what was
/// brought in, or the most there was if forces gave more.
///
/// # Errors
/// None but those of drawing itself.
pub fn energy_history(title: &str, history: &History, ledger: &Ledger) -> io::Result<Option<String>> {
    let moments = history.moments();
    let [first, .., last] = moments else { return Ok(None) };
    let e0 = ledger.energy_scale();
    if e0 <= 0.0 || last.time <= first.time {
        return Ok(None);
    }
    let time = Prefix::of(last.time.abs().max(first.time.abs()));
    let curve = |name, colour, of: fn(&Moment) -> f64| Curve {
        name,
        colour,
        points: moments.iter().map(|moment| (moment.time / time.factor, of(moment) / e0)).collect(),
    };
    let mut curves = vec![curve("kinetic energy inside", MUTED, |moment| moment.kinetic_energy)];
    let potential = if last.gravity.is_some() { ", potential energy since the start" } else { "" };
    let mut shows = "Kinetic energy";
    if last.grain_surface > 0 {
        curves.push(curve("first hits", GREEN, |moment| moment.surface_first));
        curves.push(curve("repeated hits", ORANGE, |moment| moment.surface_repeated));
        curves.push(curve("all hits", BLUE, |moment| moment.surface_all));
        shows = "Energy brought to the surface so far, and kinetic energy";
    }
    for (name, colour, of) in POTENTIALS {
        // A force that did nothing has no curve.
        if moments.iter().any(|moment| of(moment).is_some_and(|energy| energy != 0.0)) {
            let energy = |moment: &Moment| Some((moment.time / time.factor, of(moment)? / e0));
            curves.push(Curve { name, colour, points: moments.iter().filter_map(energy).collect() });
        }
    }
    let what =
        if e0 > ledger.energy_brought_in() { "is the most that forces gave" } else { "brought in until the end" };
    let shows = format!("{shows}{potential}; E0 = {} {what}", quantity(e0, "J"));
    picture(SIZE, title, &shows, |area| {
        draw_curves(area, &curves, &format!("time ({}s)", time.symbol))?;
        draw_key(area, curves)
    })
    .map(Some)
}

fn draw_curves(area: &super::Area<'_>, curves: &[Curve], time: &str) -> Drawn {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let (start, end) = points().fold((f64::MAX, f64::MIN), |range, point| (range.0.min(point.0), range.1.max(point.0)));
    let [bottom, top] = [f64::min, f64::max].map(|of| 1.05 * points().map(|point| point.1).fold(0.0, of));
    let mut chart = ChartBuilder::on(&part(area, [10, HEADING, KEY - 20, SIZE[1] - HEADING - 10]))
        .set_label_area_size(LabelAreaPosition::Left, fine(58))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(40))
        .margin_top(fine(10))
        .build_cartesian_2d(start..end, bottom..top)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT.stroke_width(fine(1)))
        .axis_style(INK.stroke_width(fine(1)))
        .label_style(style(12, INK, (HPos::Left, VPos::Top)))
        .axis_desc_style(style(13, INK, (HPos::Left, VPos::Top)))
        .set_all_tick_mark_size(fine(4))
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .x_desc(time)
        .y_desc("energy / E0")
        .draw()?;
    for curve in curves {
        chart.draw_series(LineSeries::new(curve.points.iter().copied(), curve.colour.stroke_width(fine(2))))?;
    }
    Ok(())
}

/// The key, in the order in which the curves end, and where they end.
fn draw_key(area: &super::Area<'_>, mut curves: Vec<Curve>) -> Drawn {
    curves.sort_by(|a, b| b.last().total_cmp(&a.last()));
    write(area, "at the end", [SIZE[0] - 20, HEADING + 12], 12, MUTED, (HPos::Right, VPos::Center))?;
    for (row, curve) in curves.iter().enumerate() {
        let y = HEADING + 40 + 28 * row as i32;
        let line = [(KEY * FINE, y * FINE), ((KEY + 22) * FINE, y * FINE)];
        area.draw(&PathElement::new(line, curve.colour.stroke_width(fine(3))))?;
        write(area, curve.name, [KEY + 30, y], 13, INK, (HPos::Left, VPos::Center))?;
        write(area, &format!("{:.3}", curve.last()), [SIZE[0] - 20, y], 13, INK, (HPos::Right, VPos::Center))?;
    }
    Ok(())
}
