//! Lines and points with error bars, and colours over a plane: the pictures of studies.

use std::io;
use std::ops::Range;

use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{
    Area, BLUE, Drawn, FAINT, FINE, FRAME, GREEN, HEADING, INK, MUTED, ORANGE, PURPLE, Palette, SKY, colour_bar, fine,
    part, picture, style, tick, write,
};
use crate::estimate::Estimate;
use crate::shown::{Axis, Line, Map, Mark, Picture, Scale};

/// Of a chart with its key, pixels.
const CHART: [i32; 2] = [900, 520];
/// Where the key begins, right of the curves, pixels.
const KEY: i32 = 650;
/// Longer side of a map, pixels, and least height of its picture, for the bar of colours beside it.
const MAP: i32 = 440;
const MAP_LEAST: i32 = 300;
/// A map over lengths whose sides differ by more than this is not drawn to scale: it would be a line.
const LONGEST: f64 = 8.0;
/// Room for the labels left of and below a picture, pixels.
const LABELS: [i32; 2] = [66, 44];
const COLOURS: [RGBColor; 8] =
    [BLUE, ORANGE, GREEN, PURPLE, SKY, INK, RGBColor(0xe6, 0x9f, 0x00), RGBColor(0x99, 0x99, 0x33)];
/// Where nothing is known.
const GREY: RGBColor = RGBColor(0xbb, 0xbb, 0xbb);
/// Colours of a map: neighbours that differ by less are drawn as one.
const SHADES: f64 = 128.0;

type Plane<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Coordinate, Coordinate>>;

/// Draws a picture of a study.
///
/// # Errors
/// None but those of drawing itself.
pub fn drawn(of: &Picture) -> io::Result<String> {
    match of {
        Picture::Chart(chart) => picture(CHART, &chart.title, &chart.shows, |area| {
            let plane = part(area, [10, HEADING, KEY - 20, CHART[1] - HEADING - 10]);
            let mut plane = axes(&plane, [&chart.x, &chart.y], [8, 8], true)?;
            chart.lines.iter().try_for_each(|line| draw_line(&mut plane, line, [&chart.x, &chart.y]))?;
            draw_key(area, &chart.lines)
        }),
        Picture::Map(map) => {
            let [width, height] = sides(map);
            let size = [LABELS[0] + width + 230, HEADING + height.max(MAP_LEAST) + LABELS[1] + 30];
            picture(size, &map.title, &map.shows, |area| draw_map(area, map, [width, height]))
        }
    }
}

/// An axis as plotters needs it.
struct Coordinate {
    scale: Scale,
    range: Range<f64>,
}

impl Coordinate {
    fn of(axis: &Axis) -> Self {
        Self { scale: axis.scale, range: axis.range[0]..axis.range[1] }
    }
}

impl Ranged for Coordinate {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let along = |value: f64| if self.scale == Scale::Log { value.ln() } else { value };
        let [low, high] = [self.range.start, self.range.end].map(along);
        RangedCoordf64::from(low..high).map(&along(*value), limit)
    }

    /// Where numbers stand: round ones, or with logarithms the 1, 2 and 5 of each decade, or its 1 alone where there are many.
    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if self.scale == Scale::Linear {
            return RangedCoordf64::from(self.range.clone()).key_points(hint);
        }
        let decades = self.range.start.log10().floor() as i32..=self.range.end.log10().ceil() as i32;
        let digits: &[f64] = if decades.clone().count() > 6 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        // What rounding puts just outside still belongs there.
        let within = (1.0 - 1e-9) * self.range.start..=(1.0 + 1e-9) * self.range.end;
        let points = decades.flat_map(|decade| digits.iter().map(move |digit| digit * 10f64.powi(decade)));
        points.filter(|point| within.contains(point)).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// The axes of a picture, with about so many labels each; with `lines` across it.
fn axes<'a>(area: &Area<'a>, [x, y]: [&Axis; 2], labels: [usize; 2], lines: bool) -> Drawn<Plane<'a>> {
    let mut plane = ChartBuilder::on(area)
        .set_label_area_size(LabelAreaPosition::Left, fine(LABELS[0]))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(LABELS[1]))
        .margin_top(fine(10))
        .margin_right(fine(12))
        .build_cartesian_2d(Coordinate::of(x), Coordinate::of(y))?;
    let bold = if lines { FAINT.stroke_width(fine(1)) } else { TRANSPARENT.into() };
    plane
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(bold)
        .axis_style(INK.stroke_width(fine(1)))
        .label_style(style(12, INK, (HPos::Left, VPos::Top)))
        .axis_desc_style(style(13, INK, (HPos::Left, VPos::Top)))
        .set_all_tick_mark_size(fine(4))
        .x_labels(labels[0])
        .y_labels(labels[1])
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .x_desc(&x.label)
        .y_desc(&y.label)
        .draw()?;
    Ok(plane)
}

fn draw_line(plane: &mut Plane<'_>, line: &Line, [x, y]: [&Axis; 2]) -> Drawn {
    let (colour, stroke) = stroke(line);
    let clip = |value: f64| value.clamp(y.range[0], y.range[1]);
    // What lies outside is not drawn: it would lie on the frame.
    let within = |axis: &Axis, value: f64| (axis.range[0]..=axis.range[1]).contains(&value);
    let inside = |at: &(f64, Estimate)| within(x, at.0) && within(y, at.1.value);
    for piece in line.points.split(|at| !inside(at)).filter(|piece| !piece.is_empty()) {
        let path: Vec<(f64, f64)> = piece.iter().map(|(x, at)| (*x, at.value)).collect();
        if matches!(line.mark, Mark::OpenPoints | Mark::Dashed) {
            plane.draw_series(DashedLineSeries::new(path, fine(6), fine(4), stroke))?;
        } else {
            plane.draw_series(LineSeries::new(path, stroke))?;
        }
    }
    if !matches!(line.mark, Mark::Points | Mark::OpenPoints) {
        return Ok(());
    }
    for (x, at) in line.points.iter().filter(|at| inside(at)) {
        if at.error > 0.0 {
            let ends = [clip(at.value - at.error), clip(at.value + at.error)];
            plane.draw_series([PathElement::new(ends.map(|end| (*x, end)), colour.stroke_width(fine(1)))])?;
        }
        plane.draw_series([Circle::new((*x, at.value), fine(4), colour.filled())])?;
        if line.mark == Mark::OpenPoints {
            plane.draw_series([Circle::new((*x, at.value), fine(2), WHITE.filled())])?;
        }
    }
    Ok(())
}

/// Colour and stroke of a line.
fn stroke(line: &Line) -> (RGBColor, ShapeStyle) {
    match line.mark {
        Mark::Guide => (FRAME, FRAME.stroke_width(fine(1))),
        _ => (COLOURS[line.colour % COLOURS.len()], COLOURS[line.colour % COLOURS.len()].stroke_width(fine(2))),
    }
}

/// The key, in the order of the lines.
fn draw_key(area: &Area<'_>, lines: &[Line]) -> Drawn {
    for (row, line) in lines.iter().filter(|line| !line.name.is_empty()).enumerate() {
        let (x, y) = (KEY, HEADING + 24 + 24 * row as i32);
        let (colour, stroke) = stroke(line);
        let pieces: &[[i32; 2]] = match line.mark {
            Mark::Points | Mark::Curve | Mark::Guide => &[[0, 24]],
            Mark::OpenPoints | Mark::Dashed => &[[0, 6], [10, 15], [19, 24]],
        };
        for ends in pieces {
            let ends = ends.map(|end| ((x + end) * FINE, y * FINE));
            area.draw(&PathElement::new(ends, stroke))?;
        }
        if matches!(line.mark, Mark::Points | Mark::OpenPoints) {
            area.draw(&Circle::new(((x + 12) * FINE, y * FINE), fine(4), colour.filled()))?;
        }
        if line.mark == Mark::OpenPoints {
            area.draw(&Circle::new(((x + 12) * FINE, y * FINE), fine(2), WHITE.filled()))?;
        }
        write(area, &line.name, [x + 32, y], 13, INK, (HPos::Left, VPos::Center))?;
    }
    Ok(())
}

/// So far does a cell of a map reach, in cells: the next one is drawn over what is too much, and no seam is left between them.
const REACH: f64 = 1.2;

/// Width and height of a map, pixels: to scale where both are lengths.
fn sides(map: &Map) -> [i32; 2] {
    let [width, height] = [&map.x, &map.y].map(|axis| axis.range[1] - axis.range[0]);
    let ratio = height / width;
    if !(map.x.is_length && map.y.is_length && (LONGEST.recip()..=LONGEST).contains(&ratio)) {
        return [MAP, MAP];
    }
    let shorter = |ratio: f64| (f64::from(MAP) * ratio).round() as i32;
    if ratio < 1.0 { [MAP, shorter(ratio)] } else { [shorter(ratio.recip()), MAP] }
}

fn draw_map(area: &Area<'_>, map: &Map, [width, height]: [i32; 2]) -> Drawn {
    // So many pixels does a label need.
    let labels = [width / 55, height / 40].map(|count| count.clamp(2, 8) as usize);
    let place = part(area, [10, HEADING, LABELS[0] + width + 12, height + LABELS[1] + 10]);
    let mut plane = axes(&place, [&map.x, &map.y], labels, false)?;
    let at = |axis: &Axis, index: f64, count: usize| {
        axis.range[0] + (axis.range[1] - axis.range[0]) * (index / count as f64).min(1.0)
    };
    let is_signed = map.columns.iter().flatten().flatten().any(|&value| value < 0.0);
    let palette = if is_signed { Palette::Diverging(map.most) } else { Palette::Bright(map.most) };
    let [low, high] = palette.range();
    let shade = |value: &Option<f64>| {
        value.map(|value| ((value - low) / (high - low) * SHADES).round().clamp(0.0, SHADES) as u32)
    };
    for (column, values) in map.columns.iter().enumerate() {
        let [left, right] = [column as f64, column as f64 + REACH].map(|index| at(&map.x, index, map.columns.len()));
        let mut row = 0;
        for run in values.chunk_by(|a, b| shade(a) == shade(b)) {
            let end = row + run.len();
            let [bottom, top] = [row as f64, end as f64 + REACH - 1.0].map(|index| at(&map.y, index, values.len()));
            row = end;
            let colour = shade(&run[0]).map_or(GREY, |shade| palette.colour(f64::from(shade) / SHADES));
            plane.draw_series([Rectangle::new([(left, bottom), (right, top)], colour.filled())])?;
        }
    }
    let key = LABELS[0] + width + 50;
    if let Some((name, points)) = &map.line {
        plane.draw_series(LineSeries::new(points.iter().copied(), ORANGE.stroke_width(fine(2))))?;
        let ends = [(key * FINE, (HEADING + 290) * FINE), ((key + 16) * FINE, (HEADING + 290) * FINE)];
        area.draw(&PathElement::new(ends, ORANGE.stroke_width(fine(2))))?;
        write(area, name, [key + 24, HEADING + 290], 13, INK, (HPos::Left, VPos::Center))?;
    }
    if map.columns.iter().flatten().any(Option::is_none) {
        let corners = [(key * FINE, (HEADING + 312) * FINE), ((key + 16) * FINE, (HEADING + 328) * FINE)];
        area.draw(&Rectangle::new(corners, GREY.filled()))?;
        write(area, &map.grey, [key + 24, HEADING + 320], 13, MUTED, (HPos::Left, VPos::Center))?;
    }
    colour_bar(area, [key, HEADING + 44, 16, 210], palette, &map.legend)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shown::Chart;

    #[test]
    fn a_chart_shows_its_error_bars_and_leaves_out_what_is_outside() {
        let points =
            [(0.1, 0.5), (1.0, 0.5), (10.0, 0.7), (100.0, 2.0)].map(|(x, value)| (x, Estimate { value, error: 0.1 }));
        let chart = |mark| {
            Picture::Chart(Chart {
                name: "chart",
                title: "T".into(),
                shows: "S".into(),
                x: Axis::log("number of grains", 1.0, 100.0),
                y: Axis::linear("energy / E0", 0.0, 1.0),
                lines: vec![Line { name: "all hits".into(), points: points.into(), mark, colour: 0 }],
            })
        };
        let count = |svg: &str, what| svg.matches(what).count();
        let svg = drawn(&chart(Mark::Points)).unwrap();
        for text in ["number of grains", "energy / E0", "all hits", ">1<", ">10<", ">100<", ">0.4<"] {
            assert!(svg.contains(text) || svg.contains(&format!("\n{}\n", text.trim_matches(['<', '>']))), "{text}");
        }
        // Two points within the range and one in the key.
        assert_eq!(count(&svg, "<circle"), 3);
        assert_eq!(count(&drawn(&chart(Mark::OpenPoints)).unwrap(), "<circle"), 6);
        assert_eq!(count(&drawn(&chart(Mark::Curve)).unwrap(), "<circle"), 0);
    }

    #[test]
    fn a_map_is_grey_where_nothing_is_known() {
        let map = |columns| {
            Picture::Map(Map {
                name: "map",
                title: "T".into(),
                shows: "S".into(),
                x: Axis::linear("x", 0.0, 1.0),
                y: Axis::linear("y", 0.0, 1.0),
                columns,
                legend: "hits".into(),
                most: 4.0,
                grey: "never ends".into(),
                line: None,
            })
        };
        let grey = "#BBBBBB";
        let svg = drawn(&map(vec![vec![Some(1.0), None, None], vec![Some(2.0); 3]])).unwrap();
        // The two grey cells are one, and so is that of the key.
        assert_eq!((svg.matches(grey).count(), svg.contains("never ends")), (2, true));
        assert!(!drawn(&map(vec![vec![Some(1.0)]])).unwrap().contains(grey));
        // Where a value is below 0, the most and the least have the ends of the diverging colours.
        let signed = drawn(&map(vec![vec![Some(4.0)], vec![Some(-4.0)]])).unwrap();
        for end in [1.0, -1.0] {
            let RGBColor(r, g, b) = crate::output::plots::diverging(end);
            assert!(signed.contains(&format!("#{r:02X}{g:02X}{b:02X}")), "{end}");
        }
        assert!(signed.contains("-4") && !svg.contains("-4"));
    }

    #[test]
    fn a_map_over_lengths_is_drawn_to_scale() {
        let map = |x: Axis, y: Axis| Map {
            name: "map",
            title: String::new(),
            shows: String::new(),
            x,
            y,
            columns: vec![vec![Some(1.0)]],
            legend: String::new(),
            most: 1.0,
            grey: String::new(),
            line: None,
        };
        let length = |to| Axis::length("x / m", 1.0, 1.0 + to);
        assert_eq!(sides(&map(length(2.0), length(1.0))), [MAP, MAP / 2]);
        assert_eq!(sides(&map(length(1.0), length(4.0))), [MAP / 4, MAP]);
        assert_eq!(sides(&map(length(1.0), length(100.0))), [MAP, MAP], "a line");
        assert_eq!(sides(&map(length(2.0), Axis::linear("angle", 0.0, 1.0))), [MAP, MAP]);
    }
}
