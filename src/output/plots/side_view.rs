//! The jet seen from the side at a handful of moments: grains to scale, coloured by speed.

use std::io;

use impinge_events::Flight;
use nalgebra::{Vector2, Vector3};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::raster::{Block, Raster};
use super::{
    Area, Drawn, FINE, FRAME, HEADING, INK, Palette, colour_bar, colour_of, fine, part, picture, style, tick, write,
};
use crate::grains::Snapshot;
use crate::observe::SurfaceShape;
use crate::output::summary::{Prefix, brief};
use crate::scene::Scene;
use crate::scheme::Observer;

/// Moments that are shown, evenly spaced over the run.
const MOMENTS: u32 = 6;
/// Cells of the raster per pixel: what is hidden at this resolution is not drawn.
const CELLS: f64 = 2.0;
/// Part of the grains that may lie outside the view on each side: a few stragglers shall not make the jet tiny.
const STRAGGLERS: f64 = 0.005;
/// Room for all panels together, pixels.
const ROOM: [f64; 2] = [1040.0, 720.0];
/// Room for the labels left of the panels, pixels.
const LEFT: i32 = 64;
/// Room for the labels below the panels, pixels.
const BOTTOM: i32 = 42;
/// Room for the caption over each panel, pixels.
const CAPTION: i32 = 24;
/// Room between two panels, pixels.
const GAP: i32 = 14;
/// Room for the colour bar, pixels.
const BAR: i32 = 120;
/// A grain that would be smaller than this on the screen is drawn as large as this, pixels.
const SMALLEST: f64 = 0.5;
/// Least thickness of a surface on the screen, units of drawing.
const THINNEST: i32 = 2 * FINE;
const SURFACE: RGBColor = RGBColor(0xcf, 0xcb, 0xc4);

/// One moment.
struct Still {
    time: f64,
    discs: Vec<Disc>,
}

/// A grain as far as the picture needs it: 20 bytes, for there may be many.
struct Disc {
    place: [f32; 3],
    radius: f32,
    speed: f32,
}

impl Disc {
    fn new(flight: &Flight) -> Self {
        let place = [flight.position.x as f32, flight.position.y as f32, flight.position.z as f32];
        Self { place, radius: flight.radius as f32, speed: flight.velocity.norm() as f32 }
    }

    fn place(&self) -> Vector3<f64> {
        Vector3::from(self.place).cast()
    }
}

/// Keeps the grains of a few samples to draw them at the end.
pub struct SideView {
    wanted: bool,
    planar: bool,
    start: f64,
    until: f64,
    half_interval: f64,
    stills: Vec<Still>,
    /// Sum of the velocities in all stills, m/s: where the grains fly.
    flow: Vector3<f64>,
}

impl SideView {
    /// A side view of a scene; it keeps nothing if the scene asks for no pictures.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let (start, until) = (scene.run.start, scene.run.until);
        Self {
            wanted: scene.output.pictures,
            planar: scene.domain.planar,
            start,
            until,
            half_interval: 0.5 * (until - start) / f64::from(scene.output.samples.max(1)),
            stills: Vec::new(),
            flow: Vector3::zeros(),
        }
    }

    /// Draws the moments that were seen, with the surface.
    ///
    /// # Errors
    /// None but those of drawing itself.
    pub fn picture(&self, title: &str, shape: &SurfaceShape) -> io::Result<Option<String>> {
        let Some(view) = View::of(self) else { return Ok(None) };
        let shown = if view.radius_shown < SMALLEST { ", drawn larger than they are" } else { ", to scale" };
        let shows = format!("The grains from the side{shown}, coloured by speed");
        picture(view.size(), title, &shows, |area| view.draw(area, &self.stills, shape)).map(Some)
    }
}

impl Observer for SideView {
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        let due = self.start + (self.until - self.start) * self.stills.len() as f64 / f64::from(MOMENTS - 1);
        if self.wanted && self.stills.len() < MOMENTS as usize && snapshot.time + self.half_interval >= due {
            self.flow += snapshot.flights.iter().map(|flight| flight.velocity).sum::<Vector3<f64>>();
            self.stills.push(Still { time: snapshot.time, discs: snapshot.flights.iter().map(Disc::new).collect() });
        }
    }
}

/// From where, how much and how large.
struct View {
    /// The axes of the scene that run to the right and, with its sign, towards the viewer; z runs up.
    across: usize,
    towards: (usize, f32),
    low: Vector2<f64>,
    high: Vector2<f64>,
    /// Width and height of a panel, pixels.
    panel: [i32; 2],
    columns: usize,
    rows: usize,
    fastest: f64,
    radius_shown: f64,
}

impl View {
    fn of(side_view: &SideView) -> Option<Self> {
        let discs = || side_view.stills.iter().flat_map(|still| &still.discs);
        let (across, towards) = direction(&side_view.flow, side_view.planar);
        let range = |of: &dyn Fn(&Disc) -> f64, part: f64| quantile(discs().map(of).collect(), part);
        let end = |axis: usize, part: f64| range(&|disc| f64::from(disc.place[axis]), part);
        let mut low = Vector2::new(end(across, STRAGGLERS)?, end(2, STRAGGLERS)?);
        let mut high = Vector2::new(end(across, 1.0 - STRAGGLERS)?, end(2, 1.0 - STRAGGLERS)?);
        let middle = (low + high) / 2.0;
        // Room for the outermost grains and a strip of what they hit.
        let margin = 2.0 * range(&|disc| f64::from(disc.radius), 1.0)?;
        let half = (high - low) / 2.0 * 1.06 + Vector2::repeat(margin);
        // Neither a needle nor a ribbon: at most three times as long as wide.
        let half = half.map(|side| side.max(half.max() / 3.0));
        (low, high) = (middle - half, middle + half);
        let aspect = half.x / half.y;
        let count = side_view.stills.len();
        // No row but the last is short, and that by one at most.
        let shapes = (1..=count).map(|columns| (columns, count.div_ceil(columns)));
        let shapes = shapes.filter(|(columns, rows)| columns * rows <= count + 1);
        let width = |(columns, rows): (usize, usize)| (ROOM[0] / columns as f64).min(ROOM[1] / rows as f64 * aspect);
        let (columns, rows) = shapes.max_by(|a, b| width(*a).total_cmp(&width(*b)))?;
        let width = width((columns, rows));
        let mean_radius = discs().map(|disc| f64::from(disc.radius)).sum::<f64>() / discs().count() as f64;
        Some(Self {
            across,
            towards,
            low,
            high,
            panel: [width as i32, (width / aspect) as i32],
            columns,
            rows,
            fastest: range(&|disc| f64::from(disc.speed), 1.0 - STRAGGLERS)?,
            radius_shown: mean_radius * width / (2.0 * half.x),
        })
    }

    fn size(&self) -> [i32; 2] {
        let [width, height] = self.panel;
        let (columns, rows) = (self.columns as i32, self.rows as i32);
        [LEFT + columns * (width + GAP) + BAR + 20, HEADING + rows * (height + CAPTION) + BOTTOM + 10]
    }

    fn draw(&self, area: &Area<'_>, stills: &[Still], shape: &SurfaceShape) -> Drawn {
        let surface = self.surface(shape);
        for (index, still) in stills.iter().enumerate() {
            self.draw_panel(area, index, index + self.columns >= stills.len(), still, &surface)?;
        }
        let prefix = Prefix::of(self.fastest);
        let bar = [self.size()[0] - BAR, HEADING + CAPTION + 20, 16, (self.panel[1] - 20).clamp(120, 320)];
        let most = if self.fastest > 0.0 { self.fastest / prefix.factor } else { 1.0 };
        colour_bar(area, bar, Palette::Bright(most), &format!("speed ({}m/s)", prefix.symbol))
    }

    fn draw_panel(&self, area: &Area<'_>, index: usize, lowest: bool, still: &Still, surface: &Surface) -> Drawn {
        let [width, height] = self.panel;
        let (column, row) = ((index % self.columns) as i32, (index / self.columns) as i32);
        let (left, top) = (LEFT + column * (width + GAP), HEADING + row * (height + CAPTION) + CAPTION);
        let caption =
            format!("{}, {} grains", brief(still.time, "s"), crate::output::summary::grouped(still.discs.len() as u64));
        write(area, &caption, [left, top - 5], 13, INK, (HPos::Left, VPos::Bottom))?;
        let panel = part(area, [left, top, width, height]);
        for corners in &surface.polygons {
            panel.draw(&Polygon::new(
                corners.iter().map(|&place| self.units(place)).collect::<Vec<_>>(),
                SURFACE.filled(),
            ))?;
        }
        for &[left, bottom, right, top] in &surface.blocks {
            let unit = |cell: usize| (cell as f64 * f64::from(FINE) / CELLS).round() as i32;
            // A sheet seen edge on is as thin as a cell, and would be lost between the pixels.
            let (low, high) = (unit(bottom), unit(top).max(unit(bottom) + THINNEST));
            let ends =
                [(unit(left), height * FINE - high), (unit(right).max(unit(left) + THINNEST), height * FINE - low)];
            panel.draw(&Rectangle::new(ends, SURFACE.filled()))?;
        }
        self.draw_grains(&panel, &still.discs)?;
        self.draw_frame(area, [left, top], column == 0, lowest)
    }

    /// Draws the grains that can be seen, the farthest first.
    fn draw_grains(&self, panel: &Area<'_>, discs: &[Disc]) -> Drawn {
        let mut nearest_first: Vec<&Disc> = discs.iter().collect();
        let nearness = |disc: &Disc| disc.place[self.towards.0] * self.towards.1;
        nearest_first.sort_by(|a, b| nearness(b).total_cmp(&nearness(a)));
        let mut raster = self.raster();
        let seen = nearest_first.into_iter().filter(|disc| {
            let place = self.flat(&disc.place());
            self.contains(place) && raster.cover_disc(self.cells(place), self.radius(disc) * CELLS)
        });
        let seen: Vec<&Disc> = seen.collect();
        for disc in seen.into_iter().rev() {
            let colour = colour_of(if self.fastest > 0.0 { f64::from(disc.speed) / self.fastest } else { 0.0 });
            let radius = (self.radius(disc) * f64::from(FINE)).round() as i32;
            panel.draw(&Circle::new(self.units(self.flat(&disc.place())), radius, colour.filled()))?;
        }
        Ok(())
    }

    /// Draws the axes of a panel: numbers on the left of the first column and under the last row only.
    fn draw_frame(&self, area: &Area<'_>, [left, top]: [i32; 2], first: bool, lowest: bool) -> Drawn {
        let [width, height] = self.panel;
        let unit = Prefix::of((self.high - self.low).max());
        let [low, high] = [self.low, self.high].map(|end| end / unit.factor);
        let [left_room, bottom_room] = [if first { LEFT - 10 } else { 0 }, if lowest { BOTTOM } else { 0 }];
        let around = [left - left_room, top, width + left_room, height + bottom_room];
        let mut chart = ChartBuilder::on(&part(area, around))
            .set_label_area_size(LabelAreaPosition::Left, fine(left_room))
            .set_label_area_size(LabelAreaPosition::Bottom, fine(bottom_room))
            .build_cartesian_2d(low.x..high.x, low.y..high.y)?;
        // A number at the very end of a panel would run into that of the next panel.
        let clear_of_ends = |x: f64| (x - low.x).min(high.x - x) > 0.05 * (high.x - low.x);
        let across = |x: &f64| if clear_of_ends(*x) { tick(*x) } else { String::new() };
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh()
            .axis_style(FRAME.stroke_width(fine(1)))
            .label_style(style(12, INK, (HPos::Left, VPos::Top)))
            .axis_desc_style(style(13, INK, (HPos::Left, VPos::Top)))
            .set_all_tick_mark_size(fine(4))
            .x_labels(5)
            .y_labels(5)
            .x_label_formatter(&across)
            .y_label_formatter(&|value| tick(*value));
        if first {
            mesh.y_desc(format!("z ({}m)", unit.symbol));
        }
        if lowest {
            mesh.x_desc(format!("{} ({}m)", ["x", "y"][self.across], unit.symbol));
        }
        mesh.draw()?;
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)];
        let frame = corners.map(|(x, y)| ((left + x * width) * FINE, (top + y * height) * FINE));
        area.draw(&PathElement::new(frame, FRAME.stroke_width(fine(1))))
    }

    /// What of the surface is in view.
    fn surface(&self, shape: &SurfaceShape) -> Surface {
        let mut raster = self.raster();
        for triangle in &shape.triangles {
            raster.cover_triangle(triangle.corners.map(|corner| self.cells(self.flat(&corner))));
        }
        let planes = shape.planes.iter().map(|plane| self.behind(&plane.point, &plane.normal));
        Surface { polygons: planes.filter(|corners| corners.len() > 2).collect(), blocks: raster.blocks() }
    }

    /// The part of the view that is behind a plane, where the plane is seen edge on; none else.
    fn behind(&self, point: &Vector3<f64>, normal: &Vector3<f64>) -> Vec<Vector2<f64>> {
        /// Sine of the angle within which a plane counts as seen edge on.
        const EDGE_ON: f64 = 1e-6;
        if normal[self.towards.0].abs() > EDGE_ON {
            return Vec::new();
        }
        let (point, normal) = (self.flat(point), self.flat(normal));
        let height = |place: Vector2<f64>| (place - point).dot(&normal);
        let corners =
            [self.low, Vector2::new(self.high.x, self.low.y), self.high, Vector2::new(self.low.x, self.high.y)];
        let mut behind = Vec::new();
        for (from, to) in corners.into_iter().zip(corners.into_iter().cycle().skip(1)) {
            let (start, end) = (height(from), height(to));
            if start <= 0.0 {
                behind.push(from);
            }
            if start * end < 0.0 {
                behind.push(from + (to - from) * (start / (start - end)));
            }
        }
        behind
    }

    fn raster(&self) -> Raster {
        let [width, height] = self.panel.map(|side| (f64::from(side) * CELLS).ceil() as usize);
        Raster::new(width, height)
    }

    /// A place of the scene as it lies in the view, m.
    fn flat(&self, place: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(place[self.across], place.z)
    }

    fn contains(&self, place: Vector2<f64>) -> bool {
        (0..2).all(|axis| self.low[axis] <= place[axis] && place[axis] <= self.high[axis])
    }

    /// Pixels from the lower left corner of the panel.
    fn pixels(&self, place: Vector2<f64>) -> Vector2<f64> {
        let part = (place - self.low).component_div(&(self.high - self.low));
        Vector2::new(part.x * f64::from(self.panel[0]), part.y * f64::from(self.panel[1]))
    }

    fn cells(&self, place: Vector2<f64>) -> Vector2<f64> {
        self.pixels(place) * CELLS
    }

    /// Units of drawing from the upper left corner of the panel.
    fn units(&self, place: Vector2<f64>) -> (i32, i32) {
        let place = self.pixels(place) * f64::from(FINE);
        (place.x.round() as i32, self.panel[1] * FINE - place.y.round() as i32)
    }

    /// The radius on the screen, pixels.
    fn radius(&self, disc: &Disc) -> f64 {
        (f64::from(disc.radius) * f64::from(self.panel[0]) / (self.high.x - self.low.x)).max(SMALLEST)
    }
}

/// The surface in the view: what is behind planes, and the outline of triangles.
struct Surface {
    polygons: Vec<Vec<Vector2<f64>>>,
    blocks: Vec<Block>,
}

/// From where to look: along y, unless the grains fly that way.
fn direction(flow: &Vector3<f64>, planar: bool) -> (usize, (usize, f32)) {
    if !planar && flow.y.abs() > flow.x.abs().max(flow.z.abs()) { (1, (0, 1.0)) } else { (0, (1, -1.0)) }
}

/// The value below which a part of `values` lies; none where there are no values.
fn quantile(mut values: Vec<f64>, part: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(((values.len().max(1) - 1) as f64 * part).round() as usize).copied()
}
