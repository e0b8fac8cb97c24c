//! Pictures, in SVG: what was measured, readable at a glance.
//!
//! Each function gives the text of a picture, or none where there is nothing to show.

mod chart;
mod history;
mod hit_order;
mod impacts;
mod raster;
mod side_view;
mod speed_against_error;

use std::io;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub use chart::drawn;
pub use history::energy_history;
pub use hit_order::energy_by_hit_order;
pub use impacts::impacts;
pub use side_view::SideView;
pub use speed_against_error::speed_against_error;

/// Units of drawing per pixel. The SVG backend knows whole units only, and a grain may be smaller than a pixel.
const FINE: i32 = 10;

const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const MUTED: RGBColor = RGBColor(0x66, 0x66, 0x66);
const FRAME: RGBColor = RGBColor(0x99, 0x99, 0x99);
const FAINT: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
// Colours that colour-blind readers can tell apart (Okabe & Ito 2008).
const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xb2);
const GREEN: RGBColor = RGBColor(0x00, 0x9e, 0x73);
const ORANGE: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const PURPLE: RGBColor = RGBColor(0xcc, 0x79, 0xa7);
const SKY: RGBColor = RGBColor(0x56, 0xb4, 0xe9);

/// Characters of a title that fit the narrowest picture.
const TITLE_LENGTH: usize = 80;
/// Height taken by title and subtitle, pixels.
const HEADING: i32 = 62;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<io::Error>>;

/// Draws a picture of `size` pixels with a title and what it shows.
fn picture(size: [i32; 2], title: &str, shows: &str, draw: impl FnOnce(&Area<'_>) -> Drawn) -> io::Result<String> {
    let mut svg = String::new();
    let [width, height] = size.map(fine);
    compose(&mut svg, (width, height), title, shows, draw).map_err(io::Error::other)?;
    // Shown at its size in pixels; and without what is the default anyway, which is half of a picture of many grains.
    let sized = |[width, height]: [i32; 2]| format!(r#"width="{width}" height="{height}""#);
    let shown = svg.replacen(&sized(size.map(|length| length * FINE)), &sized(size), 1);
    // Rectangles that touch must not show the paper between them.
    let shown = shown.replacen('>', "><style>rect{shape-rendering:crispEdges}</style>", 1);
    Ok(shown
        .replace(r#" opacity="1""#, "")
        .replace(r#" stroke="none" stroke-width="1""#, "")
        .replace(r#" stroke="none""#, ""))
}

fn compose(
    svg: &mut String,
    size: (u32, u32),
    title: &str,
    shows: &str,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Drawn {
    let root = SVGBackend::with_string(svg, size).into_drawing_area();
    root.fill(&WHITE)?;
    let mut title: String = title.chars().collect();
    if title.chars().count() > TITLE_LENGTH {
        title = title.chars().take(TITLE_LENGTH - 1).chain(['…']).collect();
    }
    write(&root, &title, [20, 14], 17, INK, (HPos::Left, VPos::Top))?;
    write(&root, shows, [20, 38], 13, MUTED, (HPos::Left, VPos::Top))?;
    draw(&root)?;
    root.present()
}

/// A length in pixels as units of drawing.
fn fine(pixels: i32) -> u32 {
    (pixels * FINE).unsigned_abs()
}

fn style(size: i32, colour: RGBColor, (across, up): (HPos, VPos)) -> TextStyle<'static> {
    /// Plotters divides the size of a font by this on its way into SVG.
    const SHRINK: f64 = 1.24;
    let font = ("sans-serif", f64::from(size * FINE) * SHRINK).into_font();
    TextStyle { font, color: colour.to_backend_color(), pos: Pos::new(across, up) }
}

/// Writes `text` at a place in pixels.
fn write(area: &Area<'_>, text: &str, place: [i32; 2], size: i32, colour: RGBColor, anchor: (HPos, VPos)) -> Drawn {
    area.draw_text(text, &style(size, colour, anchor), (place[0] * FINE, place[1] * FINE))
}

/// A rectangle of an area, in pixels: left, top, width, height.
fn part<'a>(area: &Area<'a>, [left, top, width, height]: [i32; 4]) -> Area<'a> {
    area.clone().shrink((left * FINE, top * FINE), (fine(width), fine(height)))
}

/// A number at a tick, with no more digits than it needs.
fn tick(value: f64) -> String {
    // Ticks are round; what is beyond nine digits of them is rounding.
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// The colour of `value` in 0..1: dark is little, bright is much, but never too bright for white paper.
fn colour_of(value: f64) -> RGBColor {
    const BRIGHTEST: f64 = 0.92;
    let colorous::Color { r, g, b } = colorous::VIRIDIS.eval_continuous(value.clamp(0.0, 1.0) * BRIGHTEST);
    RGBColor(r, g, b)
}

/// The colour of `value` in -1..1: white is 0, red is above, blue is below.
fn diverging(value: f64) -> RGBColor {
    let colorous::Color { r, g, b } = colorous::RED_BLUE.eval_continuous(0.5 - 0.5 * value.clamp(-1.0, 1.0));
    RGBColor(r, g, b)
}

/// Which colours stand for numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Palette {
    /// From dark at 0 to bright at this number.
    Bright(f64),
    /// From blue at less than 0 by this number to red at more than 0 by it.
    Diverging(f64),
}

impl Palette {
    /// From where to where it reaches.
    fn range(self) -> [f64; 2] {
        match self {
            Self::Bright(most) => [0.0, most],
            Self::Diverging(most) => [-most, most],
        }
    }

    /// The colour of a part of the range, 0 to 1.
    fn colour(self, part: f64) -> RGBColor {
        match self {
            Self::Bright(_) => colour_of(part),
            Self::Diverging(_) => diverging(2.0 * part - 1.0),
        }
    }
}

/// A colour bar in a rectangle (pixels: left, top, width, height), with its numbers on the right and its label above.
fn colour_bar(area: &Area<'_>, [left, top, width, height]: [i32; 4], palette: Palette, label: &str) -> Drawn {
    const SHADES: i32 = 64;
    for shade in 0..SHADES {
        let level = |step: i32| (top + height) * FINE - height * FINE * step / SHADES;
        let colour = palette.colour((f64::from(shade) + 0.5) / f64::from(SHADES));
        area.draw(&Rectangle::new(
            [(left * FINE, level(SHADES)), ((left + width) * FINE, level(shade))], // up to the end: no seams
            colour.filled(),
        ))?;
    }
    let [low, high] = palette.range();
    let upwards = ticks(high, if low < 0.0 { 3 } else { 5 });
    let downwards = upwards.iter().filter(|&&value| low < 0.0 && value > 0.0).map(|value| -value);
    for value in downwards.chain(upwards.iter().copied()) {
        let y = (top + height) * FINE - (f64::from(height * FINE) * (value - low) / (high - low)).round() as i32;
        let right = (left + width) * FINE;
        area.draw(&PathElement::new([(right, y), (right + 4 * FINE, y)], INK.stroke_width(FINE as u32)))?;
        area.draw_text(&tick(value), &style(12, INK, (HPos::Left, VPos::Center)), (right + 8 * FINE, y))?;
    }
    write(area, label, [left, top - 12], 13, INK, (HPos::Left, VPos::Bottom))
}

/// Round numbers from 0 to `most`, about `count` of them.
fn ticks(most: f64, count: u32) -> Vec<f64> {
    let rough = most / f64::from(count);
    let decade = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].map(|nice| nice * decade).into_iter().find(|&nice| nice >= rough);
    let step = step.unwrap_or(rough);
    // A tick that rounding puts just past the end still belongs there.
    (0..).map(|index| f64::from(index) * step).take_while(|&value| value <= most * (1.0 + 1e-9)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_end_within_the_range() {
        assert_eq!(ticks(80.0, 5), [0.0, 20.0, 40.0, 60.0, 80.0]);
        assert_eq!(ticks(0.3, 3).iter().map(|&value| tick(value)).collect::<Vec<_>>(), ["0", "0.1", "0.2", "0.3"]);
        assert_eq!([0.0, -0.0, 1.5, 1e6, -0.25].map(tick), ["0", "0", "1.5", "1000000", "-0.25"]);
    }

    #[test]
    fn a_picture_is_shown_at_its_size_and_its_text_is_escaped() {
        let svg = picture([300, 200], "a < b & c", "x", |_| Ok(())).unwrap();
        assert!(svg.starts_with(r#"<svg width="300" height="200" viewBox="0 0 3000 2000""#), "{}", &svg[..90]);
        assert!(svg.contains("a &lt; b &amp; c") && svg.contains("sans-serif"));
    }
}
