//! Paper 001, figures 3 to 5: the stress over targets of three sizes.
//!
//! Hard spheres in a plane, event-driven: packed jets of area fraction 0.8, restitution 0.8, friction 0.2 (`target_jet`). Contact stress is that of
//! `[[measure]] kind = "flow"`, over the momentum flux rho U^2 of the jet, from a while after the front has arrived until the end of the jet is still four
//! widths above the target. Contacts with the target are not in it.

use std::ops::Range;

use super::ensemble::run_observed;
use super::target_jet::{DIAMETER, Fit, TargetJet, copies, is_above, note_set_up, rise};
use super::trend::all;
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::observe::measure::{Flow, Grid};
use crate::shown::{Axis, Chart, Line, Map, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "001-fig3",
    title: "Figures 3 to 5: contact stress over targets of 4, 2 and 1 jet widths",
    source: "Huang, Chan & Zamankhan (2010), section IV, eq. (6) and (10), fig. 3 to 5",
    statement: "Two diameters over the target the contact stress falls as exp(-C r / R_jet), radial and axial stress alike, with one C for all sizes of the \
                target; over a place of the target the radial stress falls linearly with height, with almost the same slope for all sizes.",
    compute,
};

/// R* = D_tar / D_jet.
const TARGETS: [f64; 3] = [4.0, 2.0, 1.0];
/// Grains across the jet, and copies.
const SIZE: (f64, u64) = (12.0, 20);
const QUICK_SIZE: (f64, u64) = (9.0, 8);
/// The layer in which the stress is looked at over the radius: from 2 to 3 diameters over the target.
const LAYER: usize = 2;
/// What differs by less than this part is alike.
const CLOSE: f64 = 0.2;
/// The constant of an exponential over the inner or the outer half, or the slope of a line over the lower or the upper one, may differ by this part from
/// that over all and still be called the same; the constants of a Gauss curve differ by twice that. A misfit alone tells little where the stress falls by a
/// factor of two only.
const BENT: f64 = 0.25;
/// Up to where the stress has fallen to this part of the largest its fall with height is looked at.
const TOP: f64 = 0.1;
/// Names and titles of the maps.
const MAPS: [[&str; 2]; 3] =
    [["stress_rr_4", "stress_hh_4"], ["stress_rr_2", "stress_hh_2"], ["stress_rr_1", "stress_hh_1"]];
/// What the two stresses are called; parts xx and zz.
const NAMES: [&str; 2] = ["radial", "axial"];

/// Contact stress over ρ U² in columns from the middle of the target outwards, each from its surface up; radial and axial.
type Profile = Vec<Vec<[f64; 2]>>;

/// Stress in a column and a row.
type At<'a> = dyn Fn(usize, usize) -> Estimate + 'a;
/// Places and values.
type Points = Vec<(f64, Estimate)>;

/// Copies over one target.
struct Over {
    jet: TargetJet,
    copies: Vec<Profile>,
}

impl Over {
    fn mean(&self, column: usize, row: usize, part: usize) -> Estimate {
        Estimate::mean(&self.copies.iter().map(|profile| profile[column][row][part]).collect::<Vec<_>>())
    }

    /// r / R_jet of a column.
    fn radius(&self, column: usize) -> f64 {
        (column as f64 + 0.5) * DIAMETER / (0.5 * self.jet.width())
    }

    /// h / R_jet of a row.
    fn height(&self, row: usize) -> f64 {
        self.radius(row)
    }

    /// Columns over the target.
    fn columns(&self) -> usize {
        (0..self.copies[0].len()).take_while(|&column| self.radius(column) < self.jet.target).count()
    }

    /// A straight line through what `points` makes of the mean; how sure its slope is, those through what it makes of each copy tell.
    fn fitted(&self, points: impl Fn(&At<'_>) -> Points, part: usize) -> Fit {
        let fit = Fit::of(&points(&|column, row| self.mean(column, row, part)));
        let of_copy = |profile: &Profile| {
            let at = |column: usize, row: usize| Estimate {
                value: profile[column][row][part],
                ..self.mean(column, row, part)
            };
            Fit::of(&points(&at)).slope.value
        };
        let slopes: Vec<f64> = self.copies.iter().map(of_copy).collect();
        Fit { slope: Estimate { error: Estimate::mean(&slopes).error, ..fit.slope }, ..fit }
    }

    /// ln of the stress in the layer over r / R_jet, in some columns.
    fn exponential(&self, part: usize, columns: Range<usize>) -> Fit {
        let points = |at: &At<'_>| -> Points {
            let ln = |column| {
                let mean = self.mean(column, LAYER, part);
                // All copies weigh a column by the mean there: where one of them has no stress its logarithm would be none.
                let value = mean.value.ln() + at(column, LAYER).value / mean.value - 1.0;
                (self.radius(column), Estimate { value, error: (mean.error / mean.value).hypot(EVEN) })
            };
            columns.clone().map(ln).collect()
        };
        self.fitted(points, part)
    }

    /// The radial stress over h / R_jet in one column, over the lowest layer, part of which contacts with the target carry.
    fn rows(&self, column: usize) -> Range<usize> {
        let most = (1..self.copies[0][0].len()).map(|row| self.mean(column, row, 0).value).fold(0.0, f64::max);
        let top = (1..self.copies[0][0].len()).rev().find(|&row| self.mean(column, row, 0).value > TOP * most);
        1..top.map_or(2, |top| top + 1)
    }

    /// The radial stress in a column over h / R_jet, in some rows, which weigh alike.
    fn fall(&self, column: usize, rows: Range<usize>) -> Fit {
        let points = |at: &At<'_>| -> Points {
            rows.clone().map(|row| (self.height(row), Estimate { error: 1.0, ..at(column, row) })).collect()
        };
        self.fitted(points, 0)
    }
}

/// Added to relative errors in the weights of a fit, so that columns which happen to be known well do not fix it alone.
const EVEN: f64 = 0.1;

fn grid(jet: &TargetJet) -> Grid {
    let half = (0.5 * (jet.target + 1.0) * jet.width() / DIAMETER).ceil();
    let rows = (2.0 * jet.width() / DIAMETER).ceil();
    let [wide, high] = [half, rows].map(|count| count * DIAMETER);
    // As thick as a grain: a stress of spheres.
    let thick = 0.5 * DIAMETER;
    Grid { min: [-wide, -thick, 0.0], max: [wide, thick, high], cells: [2 * half as u32, 1, rows as u32] }
}

/// Both halves of the flow over the target are one.
fn folded(jet: &TargetJet, flow: &Flow) -> Profile {
    let [columns, _, rows] = flow.grid().cells.map(|count| count as usize);
    let middle = columns / 2;
    let at = |column: usize, row: usize| {
        let both =
            [middle + column, middle - 1 - column].map(|column| flow.cell(row * columns + column).contact_stress);
        [0, 2].map(|part| 0.5 * (both[0][part].value + both[1][part].value) / jet.momentum_flux())
    };
    (0..middle).map(|column| (0..rows).map(|row| at(column, row)).collect()).collect()
}

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (across, count) = if settings.quick { QUICK_SIZE } else { SIZE };
    let jets = TARGETS.map(|target| TargetJet { length: 16.0, ..TargetJet::of(across, target) });
    let tasks = copies(&jets, count, settings, |jet, seed| TargetJet { seed, ..jet });
    let watch = |jet: &TargetJet| Flow::over(grid(jet), jet.flowing(4), true);
    let all = run_observed(&tasks, settings, TargetJet::scene, watch, |jet, flow| folded(jet, &flow))?;
    let gather = |(jet, copies): (&TargetJet, &[Profile])| Over { jet: *jet, copies: copies.to_vec() };
    let over: Vec<Over> = jets.iter().zip(all.chunks(count as usize)).map(gather).collect();
    let mut report = Report::default();
    note_set_up(&mut report, &jets[0], count);
    exponential(&over, &mut report);
    one_constant(&over, &mut report);
    alike(&over, &mut report);
    linear(&over, &mut report);
    report.tables.push(table(&over));
    report.pictures.extend([over_radius(&over), over_height(&over)].map(Picture::Chart));
    for (over, names) in over.iter().zip(MAPS) {
        report.pictures.extend([0, 1].map(|part| Picture::Map(map(over, names[part], part))));
    }
    Ok(report)
}

/// Whether the slopes over both halves are that over all, as far as [`BENT`] goes.
fn is_straight(halves: [Estimate; 2], whole: Estimate) -> Option<bool> {
    all(halves.map(|half| {
        let bend = rise(half, whole);
        is_above(Estimate { value: bend.value.abs(), ..bend }, BENT * whole.value.abs()).map(|above| !above)
    }))
}

fn exponential(over: &[Over], report: &mut Report) {
    for over in over {
        let columns = over.columns();
        for (part, name) in NAMES.iter().enumerate() {
            let fit = over.exponential(part, 0..columns);
            let [inner, outer] =
                [0..columns / 2, columns / 2..columns].map(|half| over.exponential(part, half).slope * -1.0);
            let [first, last] = [0, columns - 1].map(|column| over.mean(column, LAYER, part));
            report.judge(format!(
                    "D_tar / D_jet = {}: the {name} stress falls exponentially with the radius, with one C inside and outside (within {:.0} %)",
                    over.jet.target,
                    100.0 * BENT
                ),
                format!(
                    "C = {inner} over the inner half of the target and {outer} over the outer one; {} over all of it, which misses the stress by {:.0} % \
                     (root mean square). The stress is {first} of rho U^2 in the middle and {last} at the rim",
                    fit.slope * -1.0,
                    100.0 * fit.misfit
                ),
                is_straight([inner, outer], fit.slope * -1.0),
            );
        }
    }
}

fn one_constant(over: &[Over], report: &mut Report) {
    for (part, name) in NAMES.iter().enumerate() {
        let constants: Vec<(f64, Estimate)> =
            over.iter().map(|over| (over.jet.target, over.exponential(part, 0..over.columns()).slope * -1.0)).collect();
        let told: Vec<String> = constants.iter().map(|(target, constant)| format!("{constant} at {target}")).collect();
        let mean = constants.iter().map(|(_, constant)| constant.value).sum::<f64>() / constants.len() as f64;
        let [wide, middle, narrow] = [0, 1, 2].map(|number| constants[number].1);
        let alike = [(wide, middle), (middle, narrow), (wide, narrow)].map(|(a, b)| {
            let difference = rise(a, b);
            is_above(Estimate { value: difference.value.abs(), ..difference }, CLOSE * mean).map(|above| !above)
        });
        report.judge(
            format!("One C of the {name} stress for all sizes of the target, within {:.0} %", 100.0 * CLOSE),
            format!("C at D_tar / D_jet: {}", told.join(", ")),
            all(alike),
        );
    }
}

fn alike(over: &[Over], report: &mut Report) {
    for over in over {
        let sums: Vec<(f64, f64)> = over
            .copies
            .iter()
            .map(|profile| {
                let sum = |part: usize| profile[..over.columns()].iter().map(|column| column[LAYER][part]).sum::<f64>();
                (sum(1), sum(0))
            })
            .collect();
        let ratio = Estimate::ratio(&sums);
        let difference = Estimate { value: (ratio.value - 1.0).abs(), ..ratio };
        report.judge(
            format!(
                "D_tar / D_jet = {}: radial and axial stress are very close, within {:.0} %",
                over.jet.target,
                100.0 * CLOSE
            ),
            format!("the axial stress is {ratio} times the radial one, summed over the target"),
            is_above(difference, CLOSE).map(|above| !above),
        );
    }
}

/// The columns over the middle of the target and over the rim of the jet.
fn places(over: &Over) -> [(usize, &'static str); 2] {
    let rim = (0..over.columns()).take_while(|&column| over.radius(column) < 1.0).count().saturating_sub(1);
    [(0, "0"), (rim, "1")]
}

fn linear(over: &[Over], report: &mut Report) {
    let mut slopes: [Vec<(f64, Estimate)>; 2] = Default::default();
    for over in over {
        for (number, (column, name)) in places(over).into_iter().enumerate() {
            let rows = over.rows(column);
            let middle = (rows.start + rows.end) / 2;
            let fit = over.fall(column, rows.clone());
            let [low, high] = [rows.start..middle, middle..rows.end].map(|half| over.fall(column, half).slope);
            let most = rows.clone().map(|row| over.mean(column, row, 0).value).fold(0.0, f64::max);
            slopes[number].push((over.jet.target, fit.slope));
            report.judge(format!(
                    "D_tar / D_jet = {}: at r / R_jet = {name} the radial stress falls linearly with height, with one slope low and high (within {:.0} %)",
                    over.jet.target,
                    100.0 * BENT
                ),
                format!(
                    "slope {low} rho U^2 / R_jet in the lower half and {high} in the upper one; {} over all, up to h / R_jet = {:.1}, which misses the \
                     stress by {:.0} % of the largest (root mean square)",
                    fit.slope,
                    over.height(rows.end - 1),
                    100.0 * fit.misfit / most
                ),
                is_straight([low, high], fit.slope),
            );
        }
    }
    for (slopes, name) in slopes.iter().zip(["0", "1"]) {
        let told: Vec<String> = slopes.iter().map(|(target, slope)| format!("{slope} at {target}")).collect();
        let mean = slopes.iter().map(|(_, slope)| slope.value.abs()).sum::<f64>() / slopes.len() as f64;
        let steps = slopes.windows(2).map(|pair| {
            let difference = rise(pair[0].1, pair[1].1);
            is_above(Estimate { value: difference.value.abs(), ..difference }, CLOSE * mean).map(|above| !above)
        });
        report.judge(
            format!("At r / R_jet = {name} the slope is almost the same for all sizes, within {:.0} %", 100.0 * CLOSE),
            format!("rho U^2 / R_jet at D_tar / D_jet: {}", told.join(", ")),
            all(steps),
        );
    }
}

fn table(over: &[Over]) -> Table {
    let mut table = Table::new(
        "contact_stress",
        &[
            "target_over_jet",
            "radius_over_jet_radius",
            "height_over_jet_radius",
            "radial_over_rho_u2",
            "radial_error",
            "axial_over_rho_u2",
            "axial_error",
        ],
    );
    for over in over {
        for column in 0..over.copies[0].len() {
            for row in 0..over.copies[0][column].len() {
                let [radial, axial] = [0, 1].map(|part| over.mean(column, row, part));
                table.row(&[
                    &over.jet.target,
                    &over.radius(column),
                    &over.height(row),
                    &radial.value,
                    &radial.error,
                    &axial.value,
                    &axial.error,
                ]);
            }
        }
    }
    table
}

fn over_radius(over: &[Over]) -> Chart {
    let mut lines = Vec::new();
    for (colour, over) in over.iter().enumerate() {
        for (part, mark) in [(1, Mark::Points), (0, Mark::OpenPoints)] {
            let points =
                (0..over.columns()).map(|column| (over.radius(column), over.mean(column, LAYER, part))).collect();
            let name = format!("D_tar / D_jet = {}, {}", over.jet.target, NAMES[part]);
            lines.push(Line { name, points, mark, colour });
        }
        let fit = over.exponential(1, 0..over.columns());
        let curve = (0..over.columns()).map(|column| over.radius(column)).map(|radius| (radius, fit.at(radius).exp()));
        lines.push(Line::curve("  exponential, axial", colour, Mark::Dashed, curve));
    }
    Chart {
        name: "over_radius",
        title: "Contact stress over the radius, 2 to 3 diameters over the target".into(),
        shows: "Huang, Chan & Zamankhan (2010), fig. 3(c), 4(c), 5(c)".into(),
        x: Axis::linear("r / R_jet", 0.0, 4.0),
        y: Axis::log("stress / rho U^2", 0.003, 1.0),
        lines,
    }
}

fn over_height(over: &[Over]) -> Chart {
    let mut lines = Vec::new();
    for (colour, over) in over.iter().enumerate() {
        for ((column, name), mark) in places(over).into_iter().zip([Mark::Points, Mark::OpenPoints]) {
            let rows = over.copies[0][column].len();
            let points = (0..rows).map(|row| (over.height(row), over.mean(column, row, 0))).collect();
            lines.push(Line {
                name: format!("D_tar / D_jet = {}, r / R_jet = {name}", over.jet.target),
                points,
                mark,
                colour,
            });
        }
    }
    let most = lines.iter().flat_map(|line| &line.points).map(|(_, at)| at.value + at.error).fold(0.0, f64::max);
    Chart {
        name: "over_height",
        title: "Radial contact stress over the height".into(),
        shows: "Huang, Chan & Zamankhan (2010), fig. 3(d), 4(d), 5(d)".into(),
        x: Axis::linear("h / R_jet", 0.0, 4.0),
        y: Axis::linear("stress / rho U^2", 0.0, 1.05 * most),
        lines,
    }
}

fn map(over: &Over, name: &'static str, part: usize) -> Map {
    let (columns, rows) = (over.copies[0].len(), over.copies[0][0].len());
    let column =
        |column: usize| (0..rows).map(|row| Some(over.mean(column, row, part).value.max(0.0))).collect::<Vec<_>>();
    let half: Vec<Vec<Option<f64>>> = (0..columns).map(column).collect();
    let [wide, high] = [columns, rows].map(|count| count as f64 * DIAMETER / (0.5 * over.jet.width()));
    Map {
        name,
        title: format!("{} contact stress, D_tar / D_jet = {}", ["Radial", "Axial"][part], over.jet.target),
        shows: "Averaged over both halves, time and copies; Huang, Chan & Zamankhan (2010), fig. 3 to 5".into(),
        x: Axis::length("x / R_jet", -wide, wide),
        y: Axis::length("h / R_jet", 0.0, high),
        columns: half.iter().rev().chain(&half).cloned().collect(),
        legend: "stress / rho U^2".into(),
        most: [0.25, 0.6][part],
        grey: String::new(),
        line: Some(("target".into(), vec![(-over.jet.target, 0.0), (over.jet.target, 0.0)])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made-up stresses: exp(-of(r / R_jet)), linear with height, known to 1 %.
    fn made_up(target: f64, of: impl Fn(f64) -> f64) -> Over {
        let jet = TargetJet::of(12.0, target);
        let [columns, _, rows] = grid(&jet).cells.map(|count| count as usize);
        let over = Over { jet, copies: vec![vec![vec![[0.0; 2]; rows]; columns / 2]; 4] };
        let stress = |column: usize, row: usize, copy: usize| {
            let noise = 1.0 + 0.01 * (copy as f64 - 1.5);
            [noise * 0.4 * (-of(over.radius(column))).exp() * (1.0 - over.height(row) / 4.0); 2]
        };
        let copy = |copy: usize| {
            (0..columns / 2).map(|column| (0..rows).map(|row| stress(column, row, copy)).collect()).collect()
        };
        let copies = (0..4).map(copy).collect();
        Over { copies, jet }
    }

    #[test]
    fn an_exponential_stress_has_its_constant() {
        let over = made_up(4.0, |radius| 0.9 * radius);
        let fit = over.exponential(1, 0..over.columns());
        approx::assert_relative_eq!(fit.slope.value, -0.9, max_relative = 1e-3);
        assert!(fit.misfit < 1e-3);
        let over = made_up(2.0, |radius| 0.9 * radius);
        let fit = over.fall(0, over.rows(0));
        assert!(fit.misfit < 1e-12 && fit.slope.value < 0.0);
    }

    #[test]
    fn the_claims_hold_where_they_hold_and_one_constant_that_differs_is_seen() {
        let verdicts = |constants: [f64; 3]| {
            let over: Vec<Over> =
                TARGETS.iter().zip(constants).map(|(&target, c)| made_up(target, move |radius| c * radius)).collect();
            let mut report = Report::default();
            exponential(&over, &mut report);
            one_constant(&over, &mut report);
            alike(&over, &mut report);
            linear(&over, &mut report);
            report.verdict()
        };
        assert_eq!(verdicts([0.9; 3]), super::super::Verdict::Agrees);
        assert_eq!(verdicts([0.9, 0.9, 1.4]), super::super::Verdict::Differs);
        let mut report = Report::default();
        exponential(&[made_up(2.0, |radius| 0.5 * radius * radius)], &mut report);
        assert_eq!(
            report.findings.iter().filter(|finding| finding.verdict == super::super::Verdict::Differs).count(),
            2
        );
    }
}
