//! How much energy grains bring with their first, second, third hit on the surface.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{
    Area, BLUE, Drawn, FAINT, FINE, GREEN, HEADING, INK, MUTED, ORANGE, fine, part, picture, style, tick, write,
};
use crate::observe::SurfaceEnergy;
use crate::output::summary::{grouped, quantity};

const SIZE: [i32; 2] = [900, 520];
/// Bars that stand side by side before the rest is put into one.
const MOST_BARS: usize = 10;

struct Bar {
    name: String,
    hits: u64,
    /// Normal, tangential, spin, over E0.
    parts: [f64; 3],
}

const PARTS: [(&str, RGBColor); 3] = [("normal", BLUE), ("tangential", ORANGE), ("rotation", GREEN)];

/// Draws the energy of the hits by hit order, over the energy `brought_in` (J).
///
/// # Errors
/// None but those of drawing itself.
pub fn energy_by_hit_order(title: &str, surface: &SurfaceEnergy, brought_in: f64) -> io::Result<Option<String>> {
    if surface.by_order().is_empty() || brought_in <= 0.0 {
        return Ok(None);
    }
    let bars = bars(surface, brought_in);
    let shows = format!(
        "Energy of the hits on the surface by hit order; E0 = {}, all hits {} E0",
        quantity(brought_in, "J"),
        share(surface.all_hits() / brought_in)
    );
    picture(SIZE, title, &shows, |area| {
        draw_bars(area, &bars)?;
        draw_key(area, &bars)
    })
    .map(Some)
}

fn bars(surface: &SurfaceEnergy, brought_in: f64) -> Vec<Bar> {
    let orders = surface.by_order();
    let single = if orders.len() > MOST_BARS { MOST_BARS - 1 } else { orders.len() };
    let mut bars: Vec<Bar> = Vec::new();
    for (index, tally) in orders.iter().enumerate() {
        if index <= single {
            let name =
                if index < single { (index + 1).to_string() } else { format!("{} to {}", index + 1, orders.len()) };
            bars.push(Bar { name, hits: 0, parts: [0.0; 3] });
        }
        let bar = &mut bars[index.min(single)];
        bar.hits += tally.hits;
        let parts = [tally.normal, tally.tangential, tally.spin].map(|sum| sum.value() / brought_in);
        bar.parts.iter_mut().zip(parts).for_each(|(part, more)| *part += more);
    }
    bars
}

fn draw_bars(area: &Area<'_>, bars: &[Bar]) -> Drawn {
    let highest = bars.iter().map(|bar| bar.parts.iter().sum()).fold(0.0, f64::max);
    let top = if highest > 0.0 { 1.12 * highest } else { 1.0 };
    let mut chart = ChartBuilder::on(&part(area, [10, HEADING, SIZE[0] - 20, SIZE[1] - HEADING - 10]))
        .set_label_area_size(LabelAreaPosition::Left, fine(58))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(64))
        .margin_top(fine(10))
        .build_cartesian_2d(0.0..bars.len() as f64, 0.0..top)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .disable_x_axis()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT.stroke_width(fine(1)))
        .axis_style(INK.stroke_width(fine(1)))
        .label_style(style(12, INK, (HPos::Left, VPos::Top)))
        .axis_desc_style(style(13, INK, (HPos::Left, VPos::Top)))
        .set_all_tick_mark_size(fine(4))
        .y_labels(8)
        .y_label_formatter(&|value| tick(*value))
        .y_desc("energy / E0")
        .draw()?;
    for (index, bar) in bars.iter().enumerate() {
        let middle = index as f64 + 0.5;
        let mut level = 0.0;
        for (part, (_, colour)) in bar.parts.iter().zip(PARTS) {
            let corners = [(middle - 0.32, level), (middle + 0.32, level + part)];
            chart.draw_series([Rectangle::new(corners, colour.filled())])?;
            level += part;
        }
        let (x, y) = chart.backend_coord(&(middle, level));
        area.draw_text(&share(level), &style(12, INK, (HPos::Center, VPos::Bottom)), (x, y - 5 * FINE))?;
        let foot = chart.backend_coord(&(middle, 0.0)).1;
        area.draw_text(&bar.name, &style(13, INK, (HPos::Center, VPos::Top)), (x, foot + 6 * FINE))?;
        area.draw_text(&grouped(bar.hits), &style(12, MUTED, (HPos::Center, VPos::Top)), (x, foot + 25 * FINE))?;
    }
    write(
        area,
        "hit order; below it, how many hits",
        [SIZE[0] / 2, SIZE[1] - 14],
        13,
        INK,
        (HPos::Center, VPos::Bottom),
    )
}

/// A part of E0 in three decimals, or as little as it is.
fn share(value: f64) -> String {
    if value == 0.0 || value >= 5e-4 { format!("{value:.3}") } else { format!("{value:.0e}") }
}

/// The key, in the upper right, where bars are low; only of what there is.
fn draw_key(area: &Area<'_>, bars: &[Bar]) -> Drawn {
    let total = |index: usize| bars.iter().map(|bar| bar.parts[index]).sum::<f64>();
    let shown = PARTS.iter().enumerate().filter(|(index, _)| total(*index) > 0.0);
    for (row, (index, (name, colour))) in shown.enumerate() {
        let [x, y] = [SIZE[0] - 200, 30 + 20 * row as i32];
        area.draw(&Rectangle::new([(x * FINE, (y - 6) * FINE), ((x + 12) * FINE, (y + 6) * FINE)], colour.filled()))?;
        write(area, name, [x + 20, y], 13, INK, (HPos::Left, VPos::Center))?;
        write(area, &share(total(index)), [SIZE[0] - 20, y], 13, INK, (HPos::Right, VPos::Center))?;
    }
    Ok(())
}
