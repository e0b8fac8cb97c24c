//! Paper 001, figures 7 and 8: overlaps of soft spheres, and where grains are dense, over targets of three sizes.
//!
//! The soft-sphere scheme with the glass of the paper (6.5e10 Pa, 0.244, 2500 kg/m³), grains of 1 mm at 10 m/s; otherwise the jets of figures 3 to 5. Overlaps
//! depend on these numbers, as (U² rho / E)^(2/5).

use super::ensemble::run_observed;
use super::target_jet::{DIAMETER, TargetJet, copies, is_above, note_set_up, rise, rises};
use super::trend::all;
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::grains::Snapshot;
use crate::observe::measure::{Flow, Grid, Window};
use crate::scene::Scheme;
use crate::scheme::{GrainCollision, Observer, SurfaceHit};
use crate::shown::{Axis, Chart, Line, Map, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "001-fig7",
    title: "Figures 7 and 8: overlaps of soft spheres and volume fraction, in jet, condensed and free zone",
    source: "Huang, Chan & Zamankhan (2010), section V, fig. 7 and 8",
    statement: "Overlaps are deepest when the front of the jet arrives, delta* = delta / (2 d) being at most 0.012, and below 0.01 afterwards. By overlap, \
                stress and volume fraction there are three zones: the jet, the condensed zone on the target, and the free zone. The area of high volume \
                fraction grows with the target; jet and condensed zone link when it becomes bigger.",
    compute,
};

/// R* = D_tar / D_jet.
const TARGETS: [f64; 3] = [3.0, 2.0, 1.0];
/// Grains across the jet, length of the jet in its widths, and copies.
const SIZE: (f64, f64, u64) = (10.0, 13.0, 6);
const QUICK_SIZE: (f64, f64, u64) = (6.0, 10.0, 5);
/// Printed limits of delta*, at all times and after the condensed zone has formed.
const LIMITS: [f64; 2] = [0.012, 0.01];
/// Area fraction above which grains are called dense; the printed one is 0.9, 0.007 below that of the closest packing.
const DENSE: f64 = 0.75;
const PRINTED_DENSE: f64 = 0.9;
/// What is low in a zone is at most this part of what is high in another.
const LOW: f64 = 0.2;
/// Intervals of time in which the deepest overlap is noted, in the time in which the jet flies its width.
const INTERVAL: f64 = 0.5;
/// Up to this height jet and condensed zone may be apart, widths of the jet.
const LINK: f64 = 2.5;
const MAPS: [[&str; 3]; 3] = [
    ["overlap_3", "volume_fraction_3", "pressure_3"],
    ["overlap_2", "volume_fraction_2", "pressure_2"],
    ["overlap_1", "volume_fraction_1", "pressure_1"],
];

/// Overlaps of grains as delta* = delta / (2 d).
#[derive(Clone, Debug)]
struct Overlaps {
    grid: Grid,
    window: Window,
    /// Sum over grains and samples of the deepest overlap of each with others, and their number, in each cell.
    cells: Vec<(f64, f64)>,
    /// The deepest in each interval of so many seconds, contacts with the target included.
    interval: f64,
    deepest: Vec<f64>,
}

impl Overlaps {
    fn of(jet: &TargetJet) -> Self {
        let grid = grid(jet);
        let cells = vec![(0.0, 0.0); grid.len()];
        Self { grid, window: jet.flowing(1), cells, interval: INTERVAL * jet.time(), deepest: Vec::new() }
    }

    /// Mean delta* over grains in these cells; none where there are no grains.
    fn mean(&self, cells: &[usize]) -> Option<f64> {
        let (sum, count) = cells.iter().map(|&cell| self.cells[cell]).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        (count > 0.0).then(|| sum / count)
    }

    /// A contact that was as deep as `overlap` over the radius.
    fn note(&mut self, time: f64, overlap: f64) {
        let interval = (time / self.interval) as usize;
        if interval >= self.deepest.len() {
            self.deepest.resize(interval + 1, 0.0);
        }
        // delta / (2 d) = delta / (4 r)
        self.deepest[interval] = self.deepest[interval].max(0.25 * overlap);
    }
}

impl Observer for Overlaps {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.note(collision.time, collision.overlap_over_radius);
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.note(hit.time, hit.overlap_over_radius);
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        if self.window.batch(snapshot.time).is_none() {
            return;
        }
        let flights = snapshot.flights;
        // Swept along z, along which the jet is long.
        let mut order: Vec<usize> = (0..flights.len()).collect();
        order.sort_unstable_by(|&a, &b| flights[a].position.z.total_cmp(&flights[b].position.z));
        let mut deepest = vec![0.0_f64; flights.len()];
        for (at, &a) in order.iter().enumerate() {
            for &b in &order[at + 1..] {
                let reach = flights[a].radius + flights[b].radius;
                let apart = flights[b].position - flights[a].position;
                if apart.z > reach {
                    break;
                }
                if apart.x.abs() < reach {
                    let overlap = 0.5 * (reach - apart.norm()) / DIAMETER;
                    deepest[a] = deepest[a].max(overlap);
                    deepest[b] = deepest[b].max(overlap);
                }
            }
        }
        for (flight, overlap) in flights.iter().zip(deepest) {
            if let Some(cell) = self.grid.cell(&flight.position) {
                self.cells[cell].0 += overlap;
                self.cells[cell].1 += 1.0;
            }
        }
    }
}

/// From a jet width under the target to three above it, and a jet width and a half beyond its rim.
fn grid(jet: &TargetJet) -> Grid {
    let cell = DIAMETER;
    let half = ((0.5 * jet.target + 1.5) * jet.width() / cell).ceil();
    let [below, above] = [1.0, 3.0].map(|widths| (widths * jet.width() / cell).ceil());
    let thick = 0.5 * DIAMETER;
    Grid {
        min: [-half * cell, -thick, -below * cell],
        max: [half * cell, thick, above * cell],
        cells: [2 * half as u32, 1, (below + above) as u32],
    }
}

/// A part of the flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Zone {
    /// Three fifths of the jet between 2 1/2 and 3 widths over the target.
    Jet,
    /// The middle of the target, up to half a width.
    Condensed,
    /// Beyond its rim, from half a width to one and a half, as high as a width over and under it.
    Free,
}

const ZONES: [(Zone, &str); 3] = [(Zone::Jet, "jet"), (Zone::Condensed, "condensed"), (Zone::Free, "free")];

/// Cells of a zone.
fn cells(jet: &TargetJet, grid: &Grid, zone: Zone) -> Vec<usize> {
    let is_in = |cell: &usize| {
        let centre = grid.centre(*cell) / jet.width();
        let (x, z) = (centre.x.abs(), centre.z);
        match zone {
            Zone::Jet => x < 0.3 && z > 2.5,
            Zone::Condensed => x < 0.25 && (0.0..0.5).contains(&z),
            Zone::Free => x > 0.5 * jet.target.max(1.0) + 0.5 && z.abs() < 1.0,
        }
    };
    (0..grid.len()).filter(is_in).collect()
}

/// What one run gives.
#[derive(Clone, Debug)]
struct Run {
    /// Deepest delta* until the stream is settled and after, and in each interval.
    early: f64,
    late: f64,
    deepest: Vec<f64>,
    /// Of each zone: mean delta*, contact pressure over ρ U², volume fraction.
    zones: [[f64; 3]; 3],
    /// Area over the jet's width squared in which grains are dense, outside of the jet, and the part of it by the printed bound.
    dense: [f64; 2],
    /// Least volume fraction along the axis between target and jet.
    link: f64,
    /// Of each cell: mean delta*, volume fraction (of all that is looked at), contact pressure.
    maps: [Vec<Option<f64>>; 3],
}

impl Run {
    fn of(jet: &TargetJet, (flow, overlaps): (Flow, Overlaps)) -> Self {
        let grid = flow.grid();
        let pressure = |cells: &[usize]| {
            let stress = flow.region(cells).contact_stress;
            0.5 * (stress[0].value + stress[2].value) / jet.momentum_flux()
        };
        let zones = ZONES.map(|(zone, _)| {
            let cells = cells(jet, &grid, zone);
            // Where there is no grain none overlaps.
            [overlaps.mean(&cells).unwrap_or(0.0), pressure(&cells), flow.region(&cells).volume_fraction.value]
        });
        let fractions: Vec<f64> = (0..grid.len()).map(|cell| flow.cell(cell).volume_fraction.value).collect();
        let outside = |cell: &usize| grid.centre(*cell).x.abs() > 0.5 * jet.width();
        let area = |bound: f64| {
            let count = (0..grid.len()).filter(outside).filter(|&cell| fractions[cell] > bound).count();
            count as f64 * grid.cell_volume() / grid.spacing()[1] / jet.width().powi(2)
        };
        // Slices of the axis, as high as a grain and a third of the jet wide.
        let slice = |row: u32| {
            let z = grid.min[2] + (f64::from(row) + 0.5) * grid.spacing()[2];
            let near = |cell: &usize| {
                let centre = grid.centre(*cell);
                (centre.z - z).abs() < 1e-3 * DIAMETER && centre.x.abs() < jet.width() / 6.0
            };
            (DIAMETER..LINK * jet.width())
                .contains(&z)
                .then(|| flow.region(&(0..grid.len()).filter(near).collect::<Vec<_>>()).volume_fraction.value)
        };
        let link = (0..grid.cells[2]).filter_map(slice).fold(f64::INFINITY, f64::min);
        let split = ((jet.flowing(1).from / overlaps.interval) as usize).min(overlaps.deepest.len());
        let most = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
        let has = |cell: usize| flow.cell(cell).velocity.is_some();
        let map = |of: &dyn Fn(usize) -> f64| (0..grid.len()).map(|cell| has(cell).then(|| of(cell))).collect();
        Self {
            early: most(&overlaps.deepest[..split]),
            late: most(&overlaps.deepest[split..]),
            zones,
            dense: [DENSE, PRINTED_DENSE].map(area),
            link,
            maps: [
                map(&|cell| overlaps.mean(&[cell]).unwrap_or(0.0)),
                map(&|cell| fractions[cell]),
                map(&|cell| pressure(&[cell])),
            ],
            deepest: overlaps.deepest,
        }
    }
}

/// Copies over one target.
struct Over {
    jet: TargetJet,
    copies: Vec<Run>,
}

impl Over {
    fn mean(&self, of: impl Fn(&Run) -> f64) -> Estimate {
        Estimate::mean(&self.copies.iter().map(of).collect::<Vec<_>>())
    }
}

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (across, length, count) = if settings.quick { QUICK_SIZE } else { SIZE };
    let jets = TARGETS.map(|target| TargetJet { length, scheme: Scheme::SoftSphere, ..TargetJet::of(across, target) });
    let tasks = copies(&jets, count, settings, |jet, seed| TargetJet { seed, ..jet });
    let watch = |jet: &TargetJet| (Flow::over(grid(jet), jet.flowing(4), true), Overlaps::of(jet));
    let all = run_observed(&tasks, settings, TargetJet::scene, watch, Run::of)?;
    let gather = |(jet, copies): (&TargetJet, &[Run])| Over { jet: *jet, copies: copies.to_vec() };
    let over: Vec<Over> = jets.iter().zip(all.chunks(count as usize)).map(gather).collect();
    let mut report = Report::default();
    note_set_up(&mut report, &jets[0], count);
    overlaps(&over, &mut report);
    zones(&over, &mut report);
    areas(&over, &mut report);
    report.tables.push(table(&over));
    report.pictures.push(Picture::Chart(chart(&over)));
    for (over, names) in over.iter().zip(MAPS) {
        report.pictures.extend((0..3).map(|field| Picture::Map(map(over, names[field], field))));
    }
    Ok(report)
}

fn overlaps(over: &[Over], report: &mut Report) {
    for over in over {
        let runs = &over.copies;
        // The largest of all copies: a limit holds for every one of them.
        let [early, late] =
            [|run: &Run| run.early, |run: &Run| run.late].map(|of| runs.iter().map(of).fold(0.0, f64::max));
        let target = over.jet.target;
        report.put_to_the_test(
            format!("D_tar / D_jet = {target}: delta* is at most {}", LIMITS[0]),
            format!("{:.5} in the {} runs, glass as in the paper", early.max(late), runs.len()),
            early.max(late) <= LIMITS[0],
        );
        report.put_to_the_test(
            format!("D_tar / D_jet = {target}: once the condensed zone has formed delta* is less than {}", LIMITS[1]),
            format!("{late:.5} in the {} runs", runs.len()),
            late < LIMITS[1],
        );
        let fall = over.mean(|run| run.early - run.late);
        report.judge(
            format!("D_tar / D_jet = {target}: overlaps are deepest when the front of the jet arrives"),
            format!("{} until the stream has settled, {} after", over.mean(|run| run.early), over.mean(|run| run.late)),
            is_above(fall, 0.0),
        );
    }
}

fn zones(over: &[Over], report: &mut Report) {
    for over in over {
        let zone = |number: usize, of: usize| over.mean(|run| run.zones[number][of]);
        let told = |of: usize| {
            let told: Vec<String> =
                ZONES.iter().enumerate().map(|(number, (_, name))| format!("{name} {}", zone(number, of))).collect();
            told.join(", ")
        };
        // So many times lower than in the condensed zone.
        let low = |number: usize, of: usize| {
            let excess = over.mean(|run| run.zones[number][of] - LOW * run.zones[1][of]);
            is_above(excess, 0.0).map(|above| !above)
        };
        let target = over.jet.target;
        report.judge(format!(
                "D_tar / D_jet = {target}: overlaps and stress are high in the condensed zone and low in jet and free zone, {LOW} of it at most"
            ),
            format!("1000 delta*: {}; contact pressure / rho U^2: {}", thousand(over), told(1)),
            all([low(0, 0), low(2, 0), low(0, 1), low(2, 1)]),
        );
        // Each is compared with half of the jet's area fraction.
        let half = 0.5 * super::target_jet::PACKED;
        report.judge(format!(
                "D_tar / D_jet = {target}: the jet and the condensed zone are dense, the free zone is not (area fraction above and below {half})"
            ),
            told(2),
            all([
                is_above(zone(0, 2), half),
                is_above(zone(1, 2), half),
                is_above(zone(2, 2), half).map(|above| !above),
            ]),
        );
    }
}

fn thousand(over: &Over) -> String {
    let told: Vec<String> = ZONES
        .iter()
        .enumerate()
        .map(|(number, (_, name))| format!("{name} {}", over.mean(|run| 1000.0 * run.zones[number][0])))
        .collect();
    told.join(", ")
}

fn areas(over: &[Over], report: &mut Report) {
    let series = |of: &dyn Fn(&Run) -> f64| over.iter().rev().map(|over| over.mean(of)).collect::<Vec<_>>();
    let told = |series: &[Estimate]| {
        let told: Vec<String> =
            over.iter().rev().zip(series).map(|(over, of)| format!("{of} at {}", over.jet.target)).collect();
        told.join(", ")
    };
    let [dense, printed] = [0, 1].map(|bound| series(&|run| run.dense[bound]));
    report.judge(
        format!("The area of high volume fraction, above {DENSE}, grows with the target"),
        format!("area beside the jet over the square of its width, at D_tar / D_jet: {}", told(&dense)),
        rises(&dense),
    );
    report.measured(
        format!("Area with a volume fraction above {PRINTED_DENSE}, as printed"),
        format!("{}; circles at random fill 0.82 to 0.84 at most, a crystal 0.907", told(&printed)),
    );
    let link = series(&|run| run.link);
    // As above: less and more than half as dense as the jet.
    let half = 0.5 * super::target_jet::PACKED;
    let (parted, linked) = (is_above(rise(link[0], Estimate::exact(half)), 0.0), is_above(link[2], half));
    report.judge(
        "Jet and condensed zone are apart over the smallest target and link when it becomes bigger",
        format!(
            "least volume fraction along the axis between target and jet (apart below {half}), at D_tar / D_jet: {}",
            told(&link)
        ),
        all([parted, linked]),
    );
}

fn table(over: &[Over]) -> Table {
    let mut table = Table::new(
        "zones",
        &[
            "target_over_jet",
            "zone",
            "thousand_delta_star",
            "thousand_delta_star_error",
            "pressure_over_rho_u2",
            "pressure_error",
            "volume_fraction",
            "volume_fraction_error",
        ],
    );
    for over in over {
        for (number, (_, name)) in ZONES.iter().enumerate() {
            let [overlap, pressure, fraction] =
                [(0, 1000.0), (1, 1.0), (2, 1.0)].map(|(of, unit)| over.mean(|run| unit * run.zones[number][of]));
            table.row(&[
                &over.jet.target,
                name,
                &overlap.value,
                &overlap.error,
                &pressure.value,
                &pressure.error,
                &fraction.value,
                &fraction.error,
            ]);
        }
    }
    table
}

fn chart(over: &[Over]) -> Chart {
    let line = |(colour, over): (usize, &Over)| {
        let intervals = over.copies.iter().map(|run| run.deepest.len()).min().unwrap_or(0);
        let point = |interval: usize| {
            let time = (interval as f64 + 0.5) * INTERVAL;
            (time, over.mean(|run| 1000.0 * run.deepest[interval]))
        };
        let points = (0..intervals).map(point).collect();
        Line::measured(format!("D_tar / D_jet = {}", over.jet.target), colour, points)
    };
    let mut lines: Vec<Line> = over.iter().enumerate().map(line).collect();
    let end = lines.iter().flat_map(|line| &line.points).map(|(time, _)| *time).fold(1.0, f64::max).ceil();
    for (limit, name) in LIMITS.into_iter().zip(["limit of the paper", "  after the start"]) {
        lines.push(Line::curve(name, 5, Mark::Guide, [(0.0, 1000.0 * limit), (end, 1000.0 * limit)]));
    }
    Chart {
        name: "deepest",
        title: "Deepest overlap over time".into(),
        shows: "Soft spheres of glass, 10 m/s; contacts by the time at which they end".into(),
        x: Axis::linear("time / (width of the jet / speed)", 0.0, end),
        y: Axis::linear("1000 delta / (2 d)", 0.0, 14.0),
        lines,
    }
}

fn map(over: &Over, name: &'static str, field: usize) -> Map {
    let grid = grid(&over.jet);
    let [columns, _, rows] = grid.cells.map(|count| count as usize);
    let unit = if field == 0 { 1000.0 } else { 1.0 };
    let at = |column: usize, row: usize| {
        let known: Vec<f64> =
            over.copies.iter().filter_map(|run| run.maps[field][row * columns + column]).map(|of| unit * of).collect();
        (!known.is_empty()).then(|| (known.iter().sum::<f64>() / known.len() as f64).max(0.0))
    };
    let scaled = |length: f64| length / over.jet.width();
    let (what, legend) =
        [("Mean overlap", "1000 delta*"), ("Volume fraction", "area fraction"), ("Contact pressure", "p / rho U^2")]
            [field];
    let columns: Vec<Vec<Option<f64>>> =
        (0..columns).map(|column| (0..rows).map(|row| at(column, row)).collect()).collect();
    Map {
        name,
        title: format!("{what}, D_tar / D_jet = {}", over.jet.target),
        shows: format!("Soft spheres, averaged over time; the target is at h = 0, |x| < {:.1}", 0.5 * over.jet.target),
        x: Axis::length("x / D_jet", scaled(grid.min[0]), scaled(grid.max[0])),
        y: Axis::length("h / D_jet", scaled(grid.min[2]), scaled(grid.max[2])),
        // The area fraction has a scale of its own.
        most: if field == 1 { 1.0 } else { columns.iter().flatten().flatten().copied().fold(0.0, f64::max) },
        columns,
        legend: legend.into(),
        grey: "no grain".into(),
        line: Some(("target".into(), vec![(-0.5 * over.jet.target, 0.0), (0.5 * over.jet.target, 0.0)])),
    }
}

#[cfg(test)]
mod tests {
    use impinge_events::Flight;
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn overlaps_of_grains_are_found_whatever_their_order() {
        let jet = TargetJet::of(8.0, 2.0);
        let mut overlaps = Overlaps::of(&jet);
        let flight = |x: f64, z: f64| Flight {
            position: Vector3::new(x, 0.0, z) * DIAMETER,
            time: 0.0,
            velocity: Vector3::zeros(),
            radius: 0.5 * DIAMETER,
        };
        let flights = [flight(0.5, 2.45), flight(2.5, 0.5), flight(0.5, 1.5), flight(0.5, 0.52)];
        let grain = crate::grains::Grain { id: 0, mass: 1.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 };
        let time = overlaps.window.from;
        overlaps.sample(&Snapshot { time, flights: &flights, grains: &[grain; 4] });
        let grid = overlaps.grid;
        let at = |flight: &Flight| overlaps.mean(&[grid.cell(&flight.position).expect("inside")]);
        let [high, alone, between, low] = [0, 1, 2, 3].map(|number| at(&flights[number]).expect("a grain"));
        approx::assert_relative_eq!(high, 0.025, max_relative = 1e-9);
        approx::assert_relative_eq!(low, 0.01, max_relative = 1e-9);
        assert_eq!((alone, between), (0.0, high));
        overlaps.note(0.0, 0.04);
        assert_eq!(overlaps.deepest, [0.01]);
    }

    #[test]
    fn zones_do_not_meet() {
        let jet = TargetJet::of(8.0, 2.0);
        let zones = ZONES.map(|(zone, _)| cells(&jet, &grid(&jet), zone));
        assert!(zones.iter().all(|cells| cells.len() > 4), "{zones:?}");
        assert!(zones[0].iter().chain(&zones[1]).all(|cell| !zones[2].contains(cell)));
        assert!(zones[0].iter().all(|cell| !zones[1].contains(cell)));
    }
}
