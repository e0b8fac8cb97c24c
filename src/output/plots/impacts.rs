//! Where the energy falls on a plane, seen along its normal.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{Area, Drawn, HEADING, INK, Palette, colour_bar, colour_of, fine, part, picture, style, tick};
use crate::observe::{PlaneMap, SurfaceMap};
use crate::output::summary::{Prefix, brief};

/// Longer side of the map, pixels.
const SIDE: f64 = 560.0;
/// Shorter side of the map at least, pixels.
const SHORTEST: f64 = 160.0;
/// Squares along each side at most: more would be smaller than the eye cares for.
const SQUARES: i64 = 112;
/// Part of the energy that may fall outside the map on each side: far stragglers shall not make the footprint tiny.
const STRAGGLERS: f64 = 0.005;
/// Room for the labels left of and below the map, pixels.
const LABELS: [i32; 2] = [72, 42];
/// Room for the colour bar, pixels.
const BAR: i32 = 130;

/// Draws the energy per area on the plane that was hit most often.
///
/// # Errors
/// None but those of drawing itself.
pub fn impacts(title: &str, map: &SurfaceMap) -> io::Result<Option<String>> {
    let hits = |plane: &&PlaneMap| map.element(plane.shape.element).hits;
    let Some(squares) = map.planes().iter().max_by_key(hits).and_then(Squares::of) else { return Ok(None) };
    let shows =
        format!("Energy of all hits per area where 98 % of it falls, in squares of {}", brief(squares.width, "m"));
    let pixels = SIDE / squares.columns().max(squares.rows()) as f64;
    let [width, height] = [squares.columns(), squares.rows()].map(|count| (count as f64 * pixels).max(SHORTEST) as i32);
    let size = [(LABELS[0] + width + BAR + 50).max(720), HEADING + height.max(200) + LABELS[1] + 30];
    picture(size, title, &shows, |root| {
        squares.draw(&part(root, [10, HEADING + 10, LABELS[0] + width, height + LABELS[1]]))?;
        let prefix = Prefix::of(squares.most());
        let bar = [LABELS[0] + width + 40, HEADING + 40, 16, (height - 50).clamp(120, 300)];
        colour_bar(root, bar, Palette::Bright(squares.most() / prefix.factor), &format!("{}J/m²", prefix.symbol))
    })
    .map(Some)
}

/// Energy per area on a part of a plane, in squares of one or more cells.
struct Squares {
    /// Width of a square, m.
    width: f64,
    /// Lower left corner, m.
    low: [f64; 2],
    /// What the two coordinates are called.
    names: [String; 2],
    /// Columns of energy per area, J/m².
    columns: Vec<Vec<f64>>,
}

impl Squares {
    /// The part of a plane on which the energy falls; none where there is none.
    fn of(plane: &PlaneMap) -> Option<Self> {
        let [columns, rows]: [(i64, i64); 2] = [middle(plane, 0)?, middle(plane, 1)?];
        let longest = (columns.1 - columns.0).max(rows.1 - rows.0) + 1;
        let cells = (longest + SQUARES - 1) / SQUARES;
        // One square more all round shows where the footprint ends.
        let range = |(low, high): (i64, i64)| (low.div_euclid(cells) - 1, high.div_euclid(cells) + 1);
        let (columns, rows) = (range(columns), range(rows));
        let width = plane.width() * cells as f64;
        let mut grid = vec![vec![0.0; (rows.1 - rows.0 + 1) as usize]; (columns.1 - columns.0 + 1) as usize];
        for (cell, tally) in plane.cells() {
            let [x, y] = cell.map(|index| index.div_euclid(cells));
            if (columns.0..=columns.1).contains(&x) && (rows.0..=rows.1).contains(&y) {
                grid[(x - columns.0) as usize][(y - rows.0) as usize] += tally.energy / width.powi(2);
            }
        }
        let axes: [(f64, String); 2] = std::array::from_fn(|axis| coordinate(plane, axis));
        let low = [axes[0].0 + columns.0 as f64 * width, axes[1].0 + rows.0 as f64 * width];
        Some(Self { width, low, names: axes.map(|axis| axis.1), columns: grid })
    }

    fn columns(&self) -> usize {
        self.columns.len()
    }

    fn rows(&self) -> usize {
        self.columns[0].len()
    }

    fn most(&self) -> f64 {
        self.columns.iter().flatten().copied().fold(0.0, f64::max)
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let unit = Prefix::of(self.width * self.columns().max(self.rows()) as f64 / 2.0);
        let at = |axis: usize, index: usize| (self.low[axis] + self.width * index as f64) / unit.factor;
        let mut chart = ChartBuilder::on(area)
            .set_label_area_size(LabelAreaPosition::Left, fine(LABELS[0]))
            .set_label_area_size(LabelAreaPosition::Bottom, fine(LABELS[1]))
            .build_cartesian_2d(at(0, 0)..at(0, self.columns()), at(1, 0)..at(1, self.rows()))?;
        let most = self.most();
        chart.plotting_area().fill(&colour_of(0.0))?;
        for (x, column) in self.columns.iter().enumerate() {
            for (y, &energy) in column.iter().enumerate().filter(|(_, energy)| **energy > 0.0) {
                let corners = [(at(0, x), at(1, y)), (at(0, x + 1), at(1, y + 1))];
                chart.draw_series([Rectangle::new(corners, colour_of(energy / most).filled())])?;
            }
        }
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(INK.stroke_width(fine(1)))
            .label_style(style(12, INK, (HPos::Left, VPos::Top)))
            .axis_desc_style(style(13, INK, (HPos::Left, VPos::Top)))
            .set_all_tick_mark_size(fine(4))
            .x_labels(7)
            .y_labels(7)
            .x_label_formatter(&|value| tick(*value))
            .y_label_formatter(&|value| tick(*value))
            .x_desc(format!("{} ({}m)", self.names[0], unit.symbol))
            .y_desc(format!("{} ({}m)", self.names[1], unit.symbol))
            .draw()
    }
}

/// The cells along an axis between which all but the stragglers of the energy falls; none where there is no energy.
fn middle(plane: &PlaneMap, axis: usize) -> Option<(i64, i64)> {
    let mut cells: Vec<(i64, f64)> = plane.cells().map(|(cell, tally)| (cell[axis], tally.energy)).collect();
    cells.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    let total: f64 = cells.iter().map(|cell| cell.1).sum();
    let mut below = 0.0;
    let inside = cells.iter().filter(|cell| {
        below += cell.1;
        below > STRAGGLERS * total && below - cell.1 < (1.0 - STRAGGLERS) * total
    });
    let inside: Vec<i64> = inside.map(|cell| cell.0).collect();
    Some((*inside.first()?, *inside.last()?))
}

/// Where an axis of the map begins (m) and what it is called: by the axis of the scene that it follows, if it does.
fn coordinate(plane: &PlaneMap, axis: usize) -> (f64, String) {
    let direction = plane.axes()[axis];
    match ["x", "y", "z"].iter().zip(direction.iter().zip(&plane.shape.point)).find(|(_, (along, _))| **along == 1.0) {
        Some((name, (_, start))) => (*start, (*name).into()),
        None => (0.0, ["along the surface", "across it"][axis].into()),
    }
}
