//! Speed against error: one curve a scheme, and the floor below which errors mean nothing.

use std::io;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{
    Area, BLUE, Drawn, FAINT, FINE, GREEN, HEADING, INK, MUTED, ORANGE, PURPLE, SKY, fine, part, picture, style, write,
};
use crate::output::summary::{brief, quantity};
use crate::study::compare::{Comparison, Curve, Regime};

const SIZE: [i32; 2] = [900, 560];
/// Where the key begins, right of the curves, pixels.
const KEY: i32 = 640;
const COLOURS: [RGBColor; 8] =
    [BLUE, ORANGE, GREEN, PURPLE, SKY, MUTED, RGBColor(0xe6, 0x9f, 0x00), RGBColor(0x99, 0x99, 0x33)];
/// Room left around the points, a factor.
const MARGIN: f64 = 2.0;

/// A curve as it is drawn: time of the processor (s) and error, or the floor where the error is below it.
struct Drawing<'a> {
    curve: &'a Curve,
    colour: RGBColor,
    points: Vec<(f64, f64)>,
}

/// Draws the error of each scheme over its time; none where no scheme has both.
///
/// # Errors
/// None but those of drawing itself.
pub fn speed_against_error(comparison: &Comparison) -> io::Result<Option<String>> {
    let floor = comparison.curves.iter().flat_map(Curve::done).map(|(_, scores)| scores.floor).fold(0.0, f64::max);
    let drawings: Vec<_> = comparison
        .curves
        .iter()
        .zip(COLOURS.iter().cycle())
        .map(|(curve, &colour)| {
            let points = curve.done().filter_map(|(entry, scores)| Some((entry.cpu_seconds?, scores.error.max(floor))));
            let points = points.filter(|&(seconds, error)| seconds > 0.0 && error > 0.0).collect();
            Drawing { curve, colour, points }
        })
        .collect();
    let points = || drawings.iter().flat_map(|drawing| drawing.points.iter().copied());
    if points().next().is_none() {
        return Ok(None);
    }
    let times = range(points().map(|point| point.0));
    let errors = range(points().map(|point| point.1).chain((floor > 0.0).then_some(floor)));
    let what = match comparison.reference.regime {
        Regime::Pointwise => "Largest error in the position of a grain at the end",
        Regime::Statistical => "Error of energies, impulse and counts (root mean square)",
    };
    let axis = match comparison.reference.regime {
        Regime::Pointwise => "error / radius",
        Regime::Statistical => "relative error",
    };
    let shows = format!("{what} over the time of one processor; {} grains", comparison.grains);
    picture(SIZE, &comparison.title, &shows, |area| {
        draw_curves(area, &drawings, (times, errors), floor, axis)?;
        draw_key(area, &drawings)
    })
    .map(Some)
}

/// From the least to the most of positive values, with room on both sides; at least a decade, so that there is a tick.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = values.fold((f64::MAX, 0.0), |(a, b), value| (value.min(a), value.max(b)));
    let (least, most) = (least / MARGIN, most * MARGIN);
    if most < 10.0 * least { (0.5 * least, 5.0 * least) } else { (least, most) }
}

fn draw_curves(
    area: &Area<'_>,
    drawings: &[Drawing<'_>],
    (times, errors): ((f64, f64), (f64, f64)),
    floor: f64,
    axis: &str,
) -> Drawn {
    let mut chart = ChartBuilder::on(&part(area, [10, HEADING, KEY - 20, SIZE[1] - HEADING - 10]))
        .set_label_area_size(LabelAreaPosition::Left, fine(70))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(40))
        .margin_top(fine(10))
        .margin_right(fine(10))
        .build_cartesian_2d((times.0..times.1).log_scale(), (errors.0..errors.1).log_scale())?;
    if floor > errors.0 {
        chart.draw_series([Rectangle::new([(times.0, errors.0), (times.1, floor)], FAINT.mix(0.5).filled())])?;
    }
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT.stroke_width(fine(1)))
        .axis_style(INK.stroke_width(fine(1)))
        .label_style(style(12, INK, (HPos::Left, VPos::Top)))
        .axis_desc_style(style(13, INK, (HPos::Left, VPos::Top)))
        .set_all_tick_mark_size(fine(4))
        .x_labels(8)
        .y_labels(10)
        .x_label_formatter(&|seconds| brief(*seconds, "s"))
        .y_label_formatter(&|error| format!("{error:.0e}"))
        .x_desc("time of the processor")
        .y_desc(axis)
        .draw()?;
    if floor > errors.0 {
        let line = [(times.0, floor), (times.1, floor)];
        chart.draw_series([PathElement::new(line, MUTED.stroke_width(fine(1)))])?;
        let (x, y) = chart.backend_coord(&(times.1, floor));
        let place = (x - 6 * FINE, y + 6 * FINE);
        area.draw_text(
            "floor: below it a difference means nothing",
            &style(12, MUTED, (HPos::Right, VPos::Top)),
            place,
        )?;
    }
    for drawing in drawings {
        let colour = drawing.colour;
        chart.draw_series(LineSeries::new(drawing.points.iter().copied(), colour.stroke_width(fine(2))))?;
        // What stands on the floor is hollow: its error is there or below.
        chart.draw_series(drawing.points.iter().map(|&point| {
            let style = if point.1 > floor { colour.filled() } else { WHITE.filled() };
            EmptyElement::at(point)
                + Circle::new((0, 0), fine(4), style)
                + Circle::new((0, 0), fine(4), colour.stroke_width(fine(2)))
        }))?;
    }
    Ok(())
}

/// The key: each scheme with the smallest error that it reached, and the runs of it that failed.
fn draw_key(area: &Area<'_>, drawings: &[Drawing<'_>]) -> Drawn {
    for (row, drawing) in drawings.iter().enumerate() {
        let y = HEADING + 24 + 62 * row as i32;
        let Drawing { curve, colour, .. } = drawing;
        let line = [(KEY * FINE, y * FINE), ((KEY + 22) * FINE, y * FINE)];
        area.draw(&PathElement::new(line, colour.stroke_width(fine(3))))?;
        write(area, &curve.name(), [KEY + 30, y], 13, INK, (HPos::Left, VPos::Center))?;
        let best = curve.done().min_by(|a, b| a.1.error.total_cmp(&b.1.error));
        let best = best.and_then(|(entry, scores)| Some((scores, entry.cpu_seconds?)));
        let best = best.map_or_else(
            || "no run came to its end".to_owned(),
            |(scores, seconds)| {
                let at_best = if scores.is_noise() {
                    format!("≤ {:.0e}", scores.floor)
                } else {
                    format!("{:.1e}", scores.error)
                };
                format!("{at_best} in {}", quantity(seconds, "s"))
            },
        );
        write(area, &best, [KEY + 30, y + 18], 12, MUTED, (HPos::Left, VPos::Center))?;
        let failed = curve.entries.len() - curve.done().count();
        if (1..curve.entries.len()).contains(&failed) {
            let text = format!("{failed} of {} runs failed", curve.entries.len());
            write(area, &text, [KEY + 30, y + 35], 12, MUTED, (HPos::Left, VPos::Center))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::compare::fake::comparison;

    #[test]
    fn every_scheme_has_its_curve_and_the_floor_is_drawn() {
        for regime in [Regime::Pointwise, Regime::Statistical] {
            let svg = speed_against_error(&comparison(regime)).unwrap().expect("there are points");
            // Two circles a point, filled and its rim: one exact run, four steps, three of five moduli.
            assert_eq!(svg.matches("<circle").count(), 2 * (1 + 4 + 3));
            for part in [
                "trapezoidal (step)",
                "2 of 5 runs failed",
                "no run came to its end",
                "floor: below it",
                "5.0e-3 in 200.0 ms",
            ] {
                assert!(svg.contains(part), "without {part:?}");
            }
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
    }

    #[test]
    fn ranges_hold_all_values_and_a_tick() {
        assert_eq!(range([1.0, 100.0].into_iter()), (0.5, 200.0));
        let (least, most) = range([3.0].into_iter());
        assert!(least < 3.0 && 3.0 < most && most / least >= 10.0, "{least} to {most}");
    }

    #[test]
    fn there_is_no_picture_where_no_run_came_to_its_end() {
        let mut none = comparison(Regime::Statistical);
        none.curves.drain(..3);
        assert_eq!(speed_against_error(&none).unwrap(), None);
    }
}
