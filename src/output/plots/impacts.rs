//! Where the energy falls on a plane, seen along its normal.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{Area, Drawn, HEADING, INK, colour_bar, colour_of, fine, part, picture, style, tick};
use crate::observe::{PlaneMap, SurfaceMap};
use crate::output::summary::{Prefix, quantity};

/// Longer side of the map, pixels.
const SIDE: f64 = 560.0;
/// Room for the labels left of and below the map, pixels.
const LABELS: [i32; 2] = [72, 50];
/// Room for the colour bar, pixels.
const BAR: i32 = 150;

/// Draws the energy per area on the plane that was hit most often.
///
/// # Errors
/// None but those of drawing itself.
pub fn impacts(title: &str, map: &SurfaceMap) -> io::Result<Option<String>> {
    let hits = |plane: &&PlaneMap| map.element(plane.shape.element).hits;
    let Some(plane) = map.planes().iter().max_by_key(hits) else { return Ok(None) };
    let Some((low, high)) = plane.extent() else { return Ok(None) };
    // One empty cell all round shows where the hits end.
    let (low, high) = (low.map(|index| index - 1), high.map(|index| index + 2));
    let cells = [high[0] - low[0], high[1] - low[1]].map(|count| count as f64);
    let pixels = SIDE / cells[0].max(cells[1]);
    let [width, height] = cells.map(|count| (count * pixels).round().max(120.0) as i32);
    let area = plane.width().powi(2);
    let most = (low[0]..high[0]).flat_map(|x| (low[1]..high[1]).map(move |y| [x, y]));
    let most = most.map(|cell| plane.cell(cell).energy / area).fold(0.0, f64::max);
    if most <= 0.0 {
        return Ok(None);
    }
    let shows = format!("Energy of all hits per area of the surface, in cells of {}", quantity(plane.width(), "m"));
    let size = [(LABELS[0] + width + BAR + 40).max(640), HEADING + 10 + height + LABELS[1] + 20];
    picture(size, title, &shows, |root| {
        let frame = [10, HEADING + 10, LABELS[0] + width, height + LABELS[1]];
        draw_map(&part(root, frame), plane, [low, high], most)?;
        let prefix = Prefix::of(most);
        let bar = [LABELS[0] + width + 40, HEADING + 40, 16, (height - 50).clamp(100, 300)];
        colour_bar(root, bar, most / prefix.factor, &format!("{}J/m²", prefix.symbol))
    })
    .map(Some)
}

fn draw_map(area: &Area<'_>, plane: &PlaneMap, [low, high]: [[i64; 2]; 2], most: f64) -> Drawn {
    let unit = Prefix::of(plane.width() * (high[0] - low[0]).max(high[1] - low[1]) as f64 / 2.0);
    let along: [(f64, String); 2] = std::array::from_fn(|axis| coordinate(plane, axis));
    let at = |axis: usize, index: i64| (along[axis].0 + plane.width() * index as f64) / unit.factor;
    let mut chart = ChartBuilder::on(area)
        .set_label_area_size(LabelAreaPosition::Left, fine(LABELS[0]))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(LABELS[1]))
        .build_cartesian_2d(at(0, low[0])..at(0, high[0]), at(1, low[1])..at(1, high[1]))?;
    for x in low[0]..high[0] {
        for y in low[1]..high[1] {
            let tally = plane.cell([x, y]);
            if tally.hits > 0 {
                let colour = colour_of(tally.energy / plane.width().powi(2) / most);
                let corners = [(at(0, x), at(1, y)), (at(0, x + 1), at(1, y + 1))];
                chart.draw_series([Rectangle::new(corners, colour.filled())])?;
            }
        }
    }
    chart
        .configure_mesh()
        .disable_mesh()
        .axis_style(INK.stroke_width(fine(1)))
        .label_style(style(13, INK, (HPos::Left, VPos::Top)))
        .axis_desc_style(style(14, INK, (HPos::Left, VPos::Top)))
        .set_all_tick_mark_size(fine(4))
        .x_labels(7)
        .y_labels(7)
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .x_desc(format!("{} ({}m)", along[0].1, unit.symbol))
        .y_desc(format!("{} ({}m)", along[1].1, unit.symbol))
        .draw()
}

/// Where an axis of the map begins (m) and what it is called: by the axis of the scene that it follows, if it does.
fn coordinate(plane: &PlaneMap, axis: usize) -> (f64, String) {
    let direction = plane.axes()[axis];
    match ["x", "y", "z"].iter().zip(direction.iter().zip(&plane.shape.point)).find(|(_, (along, _))| **along == 1.0) {
        Some((name, (_, start))) => (*start, (*name).into()),
        None => (0.0, ["along the surface", "across it"][axis].into()),
    }
}
