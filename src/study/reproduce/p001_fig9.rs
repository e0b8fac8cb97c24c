//! Paper 001, figure 9: two jets head-on.
//!
//! Planar jets of grains at random places, area fraction 0.4, restitution 0.8, friction 0.2. A nozzle whose mouth is full waits: its grains are not pushed on
//! by those behind, as they are in the tubes of the paper, where grains keep a uniform velocity.

use nalgebra::Vector3;

use super::ensemble::run_observed;
use super::target_jet::{DENSITY, DIAMETER, LOOSE, SPEED, copies, is_above, rise};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::observe::Ledger;
use crate::observe::measure::{Ejecta, Window};
use crate::scene::Scene;
use crate::shown::{Axis, Chart, Line, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "001-fig9",
    title: "Figure 9: two jets head-on, from nozzles near to each other and far apart",
    source: "Huang, Chan & Zamankhan (2010), section V, fig. 9",
    statement: "Where the nozzles are near to each other the jets scatter widely, because less kinetic energy is dissipated; where they are far apart they form \
                a sheet between them. The result also depends on d / D_jet and restitution.",
    compute,
};

/// Distances of the nozzles, in widths of the jets.
const DISTANCES: [f64; 5] = [8.0, 4.0, 2.0, 1.0, 0.5];
const QUICK_DISTANCES: [f64; 4] = [8.0, 4.0, 1.0, 0.5];
/// Grains across a jet, and copies.
const SIZE: (f64, u64) = (12.0, 16);
const QUICK_SIZE: (f64, u64) = (9.0, 8);
/// Coarse grains: so many across a jet.
const COARSE: f64 = 4.0;
/// Of a sheet, half of the mass at least leaves within this angle of the plane between the nozzles, degrees.
const SHEET: f64 = 15.0;
/// Duration after the jets should have met, and from when on it is looked at, in the time in which a jet flies its width.
const DURATION: f64 = 16.0;
const SETTLED: f64 = 8.0;
/// From the axis to the sides of the domain, and at least to its ends, jet widths.
const REACH: f64 = 5.0;

/// Two equal jets that fly at each other, planar, of grains at random places.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadOn {
    across: f64,
    /// Of the nozzles, in widths of the jets.
    distance: f64,
    restitution: f64,
    friction: f64,
    seed: u64,
}

impl HeadOn {
    fn width(&self) -> f64 {
        self.across * DIAMETER
    }

    fn window(&self) -> Window {
        let [from, until] = [SETTLED, DURATION].map(|time| (0.5 * self.distance + time) * self.width() / SPEED);
        Window { from, until, batches: 4 }
    }

    fn scene(&self) -> Scene {
        let Self { distance, restitution, friction, seed, .. } = self;
        let (width, window) = (self.width(), self.window());
        let (wide, high) = (REACH * width, (0.5 * distance + 2.0).max(REACH) * width);
        let nozzle = |side: f64| {
            format!(
                r#"{{ kind = "nozzle", shape = {{ slot = {{ width = {width:?}, breadth = 1.0, along = [0, 1, 0] }} }},
                centre = [0, 0, {:?}], axis = [0, 0, {:?}], speed = {SPEED:?}, flow = {{ volume_fraction = {LOOSE:?} }} }}"#,
                0.5 * side * distance * width,
                -side
            )
        };
        let text = format!(
            r#"
            seed = {seed}
            run = {{ until = {:?} }}
            domain = {{ min = [-{wide:?}, -1, -{high:?}], max = [{wide:?}, 1, {high:?}], planar = true }}
            grain = {{ radius = {:?}, density = {DENSITY:?} }}
            contact.grain = {{ restitution = {restitution:?}, friction = {friction:?} }}
            output = {{ samples = 2 }}
            source = [{}, {}]
            "#,
            window.until,
            0.5 * DIAMETER,
            nozzle(1.0),
            nozzle(-1.0)
        );
        toml::from_str(&text).unwrap_or_else(|error| panic!("{distance} widths apart: {error}"))
    }

    fn watch(&self) -> (Ejecta, Ledger) {
        (Ejecta::about(-Vector3::z(), self.window(), 60), Ledger::default())
    }
}

/// What one run gives.
#[derive(Clone, Debug)]
struct Run {
    half_mass_angle: f64,
    /// Part of the mass that leaves within [`SHEET`] of the plane between the nozzles.
    sheet: f64,
    /// Mean velocity along the axis of what leaves, over U_0, whichever way.
    lopsided: f64,
    /// Kinetic energy of what leaves over that with which it came.
    kept: f64,
    distribution: Vec<(f64, f64)>,
}

impl Run {
    fn of(_: &HeadOn, (ejecta, ledger): (Ejecta, Ledger)) -> Self {
        let distribution: Vec<(f64, f64)> = ejecta.distribution().iter().map(|(at, part)| (*at, part.value)).collect();
        let bin = 180.0 / distribution.len() as f64;
        let sheet = distribution.iter().filter(|(at, _)| (at - 90.0).abs() < SHEET).map(|(_, part)| part * bin).sum();
        let ejected = ejecta.ejected();
        let left = ledger.left();
        Self {
            half_mass_angle: ejected.half_mass_angle.value,
            sheet,
            lopsided: ejected.along.value.abs() / SPEED,
            kept: left.energy() / (0.5 * left.mass() * SPEED.powi(2)),
            distribution,
        }
    }
}

/// Copies of two jets.
struct Copies {
    jets: HeadOn,
    runs: Vec<Run>,
}

impl Copies {
    fn mean(&self, of: impl Fn(&Run) -> f64) -> Estimate {
        Estimate::mean(&self.runs.iter().map(of).collect::<Vec<_>>())
    }
}

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (distances, (across, count)) =
        if settings.quick { (&QUICK_DISTANCES[..], QUICK_SIZE) } else { (&DISTANCES[..], SIZE) };
    let reference = HeadOn { across, distance: 4.0, restitution: 0.8, friction: 0.2, seed: 1 };
    let mut jets: Vec<HeadOn> = distances.iter().map(|&distance| HeadOn { distance, ..reference }).collect();
    jets.push(HeadOn { across: COARSE, ..reference });
    jets.push(HeadOn { restitution: 1.0, friction: 0.0, ..reference });
    let tasks = copies(&jets, count, settings, |jets, seed| HeadOn { seed, ..jets });
    let all = run_observed(&tasks, settings, HeadOn::scene, HeadOn::watch, Run::of)?;
    let gather = |(jets, runs): (&HeadOn, &[Run])| Copies { jets: *jets, runs: runs.to_vec() };
    let all: Vec<Copies> = jets.iter().zip(all.chunks(count as usize)).map(gather).collect();
    let (by_distance, others) = all.split_at(distances.len());
    let mut report = Report::default();
    report.measured(
        "What was run",
        format!(
            "two planar jets {across} grains of {} mm wide, area fraction {LOOSE} at random, from nozzles at {SPEED} m/s, restitution {} and friction {}, no \
             gravity; event-driven, {count} copies",
            1e3 * DIAMETER,
            reference.restitution,
            reference.friction
        ),
    );
    distance(by_distance, &mut report);
    if let (Some(reference), [coarse, elastic]) =
        (by_distance.iter().find(|copies| copies.jets.distance == reference.distance), others)
    {
        grains(reference, coarse, elastic, &mut report);
    }
    report.tables.push(table(&all));
    report.tables.push(angles(by_distance));
    report.pictures.push(Picture::Chart(chart(by_distance)));
    Ok(report)
}

fn told(by_distance: &[Copies], of: impl Fn(&Run) -> f64) -> String {
    let told: Vec<String> =
        by_distance.iter().rev().map(|copies| format!("{} at {}", copies.mean(&of), copies.jets.distance)).collect();
    told.join(", ")
}

fn distance(by_distance: &[Copies], report: &mut Report) {
    let (Some(far), Some(near)) = (by_distance.first(), by_distance.last()) else { return };
    let sheets = format!(
        "part of the mass that leaves within {SHEET} degrees of the plane between the nozzles, at their distance / D_jet: {}",
        told(by_distance, |run| run.sheet)
    );
    report.judge(
        format!("Far apart ({} widths) they form a sheet: half of the mass within {SHEET} degrees", far.jets.distance),
        sheets.clone(),
        is_above(far.mean(|run| run.sheet), 0.5),
    );
    report.judge(format!("Near to each other ({} widths) they form none, and scatter off the plane", near.jets.distance),
        format!(
            "{sheets}. Mean velocity along the axis / U_0, whichever way: {}: where it is large one jet has overcome the other, whose nozzle waits while \
             grains are in its mouth (the paper drives its grains on in the tube). Half of the mass leaves within so many degrees, wherever these are: {}",
            told(by_distance, |run| run.lopsided),
            told(by_distance, |run| run.half_mass_angle)
        ),
        is_above(near.mean(|run| run.sheet), 0.5).map(|above| !above),
    );
    let wider = rise(far.mean(|run| run.half_mass_angle), near.mean(|run| run.half_mass_angle));
    report.judge(
        "Near to each other the scattering (half-mass) angle is larger than far apart",
        format!("{wider} degrees larger"),
        is_above(wider, 0.0),
    );
    let kept = rise(far.mean(|run| run.kept), near.mean(|run| run.kept));
    report.judge("Near to each other less kinetic energy is dissipated",
        format!(
            "kinetic energy of what leaves over that with which it came, at the distance / D_jet: {}; the difference is {kept}",
            told(by_distance, |run| run.kept)
        ),
        is_above(kept, 0.0),
    );
}

fn grains(reference: &Copies, coarse: &Copies, elastic: &Copies, report: &mut Report) {
    let angle = |copies: &Copies| copies.mean(|run| run.half_mass_angle);
    for (claim, other, name) in [
        ("The half-mass angle depends on d / D_jet", coarse, format!("with {COARSE} grains across the jet")),
        ("The half-mass angle depends on restitution", elastic, "elastic and frictionless".to_owned()),
    ] {
        let difference = rise(angle(reference), angle(other));
        report.judge(
            claim,
            format!(
                "{} degrees with {} grains across and restitution 0.8, {} {name}, {} widths apart",
                angle(reference),
                reference.jets.across,
                angle(other),
                reference.jets.distance
            ),
            is_above(Estimate { value: difference.value.abs(), ..difference }, 0.0),
        );
    }
}

fn table(all: &[Copies]) -> Table {
    let mut table = Table::new(
        "head_on",
        &[
            "distance_over_jet",
            "jet_over_grain",
            "restitution",
            "friction",
            "copies",
            "half_mass_angle",
            "half_mass_angle_error",
            "sheet",
            "sheet_error",
            "lopsided",
            "lopsided_error",
            "energy_kept",
            "energy_kept_error",
        ],
    );
    for copies in all {
        let HeadOn { across, distance, restitution, friction, .. } = copies.jets;
        let [half, sheet] = [copies.mean(|run| run.half_mass_angle), copies.mean(|run| run.sheet)];
        let [lopsided, kept] = [copies.mean(|run| run.lopsided), copies.mean(|run| run.kept)];
        table.row(&[
            &distance,
            &across,
            &restitution,
            &friction,
            &copies.runs.len(),
            &half.value,
            &half.error,
            &sheet.value,
            &sheet.error,
            &lopsided.value,
            &lopsided.error,
            &kept.value,
            &kept.error,
        ]);
    }
    table
}

/// The distribution of mass over angles, folded: either jet may overcome the other.
fn folded(copies: &Copies) -> Vec<(f64, Estimate)> {
    let bins = copies.runs.first().map_or(0, |run| run.distribution.len());
    let at = |bin: usize| {
        let (angle, _) = copies.runs[0].distribution[bin];
        (angle, copies.mean(|run| run.distribution[bin].1 + run.distribution[bins - 1 - bin].1))
    };
    (0..bins / 2).map(at).collect()
}

fn angles(by_distance: &[Copies]) -> Table {
    let mut table =
        Table::new("angles", &["distance_over_jet", "angle_degrees", "part_per_degree", "part_per_degree_error"]);
    for copies in by_distance {
        for (angle, part) in folded(copies) {
            table.row(&[&copies.jets.distance, &angle, &part.value, &part.error]);
        }
    }
    table
}

fn chart(by_distance: &[Copies]) -> Chart {
    let line = |(colour, copies): (usize, &Copies)| {
        Line::measured(format!("{} widths apart", copies.jets.distance), colour, folded(copies))
    };
    let lines: Vec<Line> = by_distance.iter().enumerate().map(line).collect();
    let most = lines.iter().flat_map(|line| &line.points).map(|(_, at)| at.value + at.error).fold(0.0, f64::max);
    Chart {
        name: "angles",
        title: "Where the mass of two jets goes that meet head-on".into(),
        shows: "Planar jets, area fraction 0.4; 0 is along the axis, either way, 90 the plane between the nozzles"
            .into(),
        x: Axis::linear("angle from the axis / degrees", 0.0, 90.0),
        y: Axis::linear("part of the mass per degree", 0.0, 1.05 * most),
        lines,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::check;
    use crate::study::reproduce::ensemble::unwatched;

    #[test]
    fn two_jets_far_apart_make_a_sheet_and_lose_no_mass() {
        let jets = HeadOn { across: 6.0, distance: 4.0, restitution: 0.8, friction: 0.2, seed: 1 };
        assert!(check(&jets.scene()).is_ok());
        let tasks = copies(&[jets], 3, &unwatched(true), |jets, seed| HeadOn { seed, ..jets });
        let runs = run_observed(&tasks, &unwatched(true), HeadOn::scene, HeadOn::watch, Run::of).expect("they run");
        let total: f64 = runs[0].distribution.iter().map(|(_, part)| part * 3.0).sum();
        approx::assert_relative_eq!(total, 1.0, max_relative = 1e-12);
        let copies = Copies { jets, runs };
        assert!(copies.mean(|run| run.sheet).value > 0.5 && copies.mean(|run| run.kept).value < 0.8);
        // Folded, the parts still are all of the mass.
        let folded: f64 = folded(&copies).iter().map(|(_, part)| part.value * 3.0).sum();
        approx::assert_relative_eq!(folded, 1.0, max_relative = 1e-12);
    }
}
