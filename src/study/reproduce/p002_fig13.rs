//! Paper 002, figures 13 to 15: energy to the surface over time and on average, over restitution and friction.

use super::arrivals::{Arrived, Bin, run_arrivals};
use super::trend::{all, falls, is_below, is_within};
use super::{Error, Jet, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "002-fig13",
    title: "Figures 13 to 15: energy to the surface over time and on average, over restitution and friction",
    source: "Mukherjee & Zohdi (2015), section 4.2, fig. 13 to 15",
    statement: "For more elastic collisions the energy available to the surface is substantially less than for highly inelastic ones, as \
                rebounding grains shield oncoming ones; friction reduces it and changes no trend. The jet almost attains a quasi-steady state, \
                at the end of which no more energy is imparted. Its average falls mildly towards the higher restitutions and rises \
                significantly as collisions get more inelastic.",
    compute,
};

/// A series of jets: grains, friction, restitutions (rising), copies.
type Plan = (u64, f64, &'static [f64], u64);

/// The paper has 10 000 grains. The lower the restitution and the more grains, the more hits: one jet of 10 000 at 0.4 has 400 000, and takes five times
/// as long as at 0.8; it carries 5.4 E0.
const FULL: [Plan; 4] = [
    (2000, 0.0, &[0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0], 4),
    (2000, 0.4, &[0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0], 4),
    (10_000, 0.0, &[0.6, 0.8, 1.0], 3),
    (10_000, 0.4, &[0.6, 0.8, 1.0], 3),
];
const QUICK: [Plan; 2] = [(2000, 0.0, &[0.4, 0.6, 0.8, 1.0], 4), (2000, 0.4, &[0.4, 0.6, 0.8, 1.0], 4)];
/// End of the runs, s: three times as long as the jet takes to arrive.
const UNTIL: f64 = 0.1;
/// Halves of the time in which the jet arrives evenly, s.
const HALVES: [[f64; 2]; 2] = [[0.012, 0.021], [0.021, 0.030]];
/// Powers of two halves that differ by less than this part are those of a steady jet.
const STEADY: f64 = 0.1;
/// When all should be over (s), and the part of the energy that may still come after that.
const OVER: f64 = 0.06;
const REST: f64 = 0.01;
/// From this restitution on it is "higher".
const HIGH: f64 = 0.6;
/// A rise by this factor is significant.
const SIGNIFICANT: f64 = 1.2;

/// Jets that differ in restitution only, which rises.
type Series = [Arrived];

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let plan: &[Plan] = if settings.quick { &QUICK } else { &FULL };
    let jets = |&(grains, friction, restitutions, _): &Plan| -> Vec<Jet> {
        let jet = |&restitution| Jet { grains, friction, restitution, until: UNTIL, ..Jet::reference() };
        restitutions.iter().map(jet).collect()
    };
    let copies = |jet: &Jet| {
        let of = plan.iter().find(|(grains, friction, ..)| (jet.grains, jet.friction) == (*grains, *friction));
        of.map_or(0, |plan| plan.3)
    };
    // The longest runs first.
    let all_jets: Vec<Jet> = plan.iter().rev().flat_map(jets).collect();
    let mut arrived = run_arrivals(&all_jets, copies, settings)?;
    let mut series: Vec<Vec<Arrived>> = Vec::new();
    for (_, _, restitutions, _) in plan.iter().rev() {
        let rest = arrived.split_off(restitutions.len());
        series.push(std::mem::replace(&mut arrived, rest));
    }
    series.reverse();
    let mut report = Report::default();
    for series in &series {
        test_restitution(series, &mut report);
        test_shielding(series, &mut report);
        test_steadiness(series, &mut report);
        test_average(series, &mut report);
        tell_collapse(series, &mut report);
    }
    for smooth in series.iter().filter(|series| series[0].jet.friction == 0.0) {
        let rough =
            series.iter().find(|other| other[0].jet.grains == smooth[0].jet.grains && other[0].jet.friction > 0.0);
        if let Some(rough) = rough {
            test_friction(smooth, rough, &mut report);
        }
    }
    report.tables = vec![table(&series), history_table(&series)];
    report.pictures = pictures(&series);
    Ok(report)
}

fn energy(bin: &Bin) -> f64 {
    bin.energy
}

fn total(at: &Arrived) -> Estimate {
    at.mean(|copy| copy.energies.carried)
}

/// The name of a series: what its jets have in common.
fn name(series: &Series) -> String {
    let jet = &series[0].jet;
    format!("{} grains, mu = {}", jet.grains, jet.friction)
}

/// Values over restitution, in words.
fn told(series: &Series, of: impl Fn(&Arrived) -> Estimate) -> String {
    let told = series.iter().map(|at| format!("{} at e = {}", of(at), at.jet.restitution));
    told.collect::<Vec<_>>().join(", ")
}

fn values(series: &Series, of: impl Fn(&Arrived) -> Estimate) -> Vec<Estimate> {
    series.iter().map(of).collect()
}

fn test_restitution(series: &Series, report: &mut Report) {
    report.judge(
        format!("{}: the more elastic, the less energy all hits together carry to the surface", name(series)),
        format!("over E0: {}", told(series, total)),
        falls(&values(series, total)),
    );
}

fn test_shielding(series: &Series, report: &mut Report) {
    let first = |at: &Arrived| at.mean(|copy| copy.energies.first_hits);
    report.judge(
        format!(
            "{}: the more elastic, the less energy oncoming grains carry through those that rebound (first hits)",
            name(series)
        ),
        format!("over E0: {}", told(series, first)),
        falls(&values(series, first)),
    );
}

fn test_steadiness(series: &Series, report: &mut Report) {
    let ratio = |at: &Arrived| {
        let halves = |copy: &super::arrivals::Arrival| {
            let [first, second] = HALVES.map(|half| copy.power(&at.jet, half, energy));
            (second, first)
        };
        Estimate::ratio(&at.copies.iter().map(halves).collect::<Vec<_>>())
    };
    report.judge(
        format!(
            "{}: a quasi-steady state (power from 21 to 30 ms as from 12 to 21 ms, within {:.0} %)",
            name(series),
            100.0 * STEADY
        ),
        format!("ratio of the two: {}", told(series, ratio)),
        all(series.iter().map(|at| is_within(ratio(at), 1.0, STEADY))),
    );
    let late = |at: &Arrived| at.mean(|copy| copy.between([OVER, UNTIL], energy) / copy.total(energy));
    report.judge(
        format!(
            "{}: in the end all grains move away and impart no more energy (less than {:.0} % of it after {:.0} ms)",
            name(series),
            100.0 * REST,
            1e3 * OVER
        ),
        format!("part that comes later: {}", told(series, late)),
        all(series.iter().map(|at| is_below(late(at), Estimate::exact(REST)))),
    );
}

fn test_average(series: &Series, report: &mut Report) {
    let average = |at: &Arrived| at.regime(energy);
    let high: Vec<Estimate> = series.iter().filter(|at| at.jet.restitution >= HIGH).map(average).collect();
    report.judge(
        format!(
            "{}: the average of the quasi-steady state falls towards the higher restitutions (from {HIGH} to 1)",
            name(series)
        ),
        format!("power over that of the jet: {}", told(series, average)),
        falls(&high),
    );
    let is_high = |at: &&Arrived| at.jet.restitution == 0.8;
    let (Some(lowest), Some(high)) = (series.first(), series.iter().find(is_high)) else { return };
    let [low, high] = [lowest, high].map(average);
    report.judge(
        format!(
            "{}: it rises significantly (by {:.0} % or more) as collisions get more inelastic, from e = 0.8 to {}",
            name(series),
            100.0 * (SIGNIFICANT - 1.0),
            lowest.jet.restitution
        ),
        format!("from {high} to {low}"),
        is_below(high * SIGNIFICANT, low),
    );
}

/// What a collapse keeps elastic brings the same energy again and again, as often as the cage lasts.
fn tell_collapse(series: &Series, report: &mut Report) {
    let part = |at: &Arrived| at.mean(|copy| copy.total(|bin| bin.collapsed) / copy.energies.carried);
    let dissipated = |at: &Arrived| at.mean(|copy| copy.energies.dissipated);
    report.measured(
        format!(
            "{}: part of the energy carried that is due to hits which the end of a collapse makes elastic (where there is much of it the energy \
             carried depends on how collapses are ended)",
            name(series)
        ),
        told(series, part),
    );
    report.measured(
        format!("{}: energy dissipated in the surface, over E0, which no grain brings twice", name(series)),
        told(series, dissipated),
    );
}

fn test_friction(smooth: &Series, rough: &Series, report: &mut Report) {
    for high in [true, false] {
        let pairs = || {
            rough.iter().filter(|rough| (rough.jet.restitution >= HIGH) == high).filter_map(|rough| {
                let smooth = smooth.iter().find(|smooth| smooth.jet.restitution == rough.jet.restitution)?;
                Some((smooth, rough))
            })
        };
        if pairs().next().is_none() {
            continue;
        }
        let told = pairs().map(|(smooth, rough)| {
            let e = rough.jet.restitution;
            format!("{} becomes {} at e = {e}", total(smooth), total(rough))
        });
        let Jet { grains, friction, .. } = rough[0].jet;
        report.judge(format!(
                "{grains} grains, restitution {} {HIGH}: friction of {friction} reduces the energy carried to the surface",
                if high { "from" } else { "below" }
            ),
            format!("over E0: {}", told.collect::<Vec<_>>().join(", ")),
            all(pairs().map(|(smooth, rough)| is_below(total(rough), total(smooth)))),
        );
    }
}

fn table(series: &[Vec<Arrived>]) -> Table {
    let mut table = Table::new(
        "average",
        &[
            "grains",
            "friction",
            "restitution",
            "copies",
            "carried",
            "carried_error",
            "regime",
            "regime_error",
            "first_hits",
            "first_hits_error",
            "dissipated_surface",
            "collapsed",
        ],
    );
    for at in series.iter().flatten() {
        let (carried, regime) = (total(at), at.regime(energy));
        let first = at.mean(|copy| copy.energies.first_hits);
        table.row(&[
            &at.jet.grains,
            &at.jet.friction,
            &at.jet.restitution,
            &at.copies.len(),
            &carried.value,
            &carried.error,
            &regime.value,
            &regime.error,
            &first.value,
            &first.error,
            &at.mean(|copy| copy.energies.dissipated).value,
            &at.mean(|copy| copy.total(|bin| bin.collapsed)).value,
        ]);
    }
    table
}

fn history_table(series: &[Vec<Arrived>]) -> Table {
    let mut table = Table::new("history", &["grains", "friction", "restitution", "time", "power", "power_error"]);
    for at in series.iter().flatten() {
        for (time, power) in at.history(1, UNTIL, energy) {
            table.row(&[&at.jet.grains, &at.jet.friction, &at.jet.restitution, &time, &power.value, &power.error]);
        }
    }
    table
}

fn pictures(series: &[Vec<Arrived>]) -> Vec<Picture> {
    let most = series.iter().map(|series| series[0].jet.grains).max().unwrap_or(0);
    let histories = series.iter().filter(|series| series[0].jet.grains == most).map(|series| {
        let smooth = series[0].jet.friction == 0.0;
        let (name, figure) = if smooth { ("history_smooth", 13) } else { ("history_rough", 14) };
        let line = |(colour, at): (usize, &Arrived)| {
            let points = at.history(2, OVER, energy).into_iter().map(|(time, power)| (1e3 * time, power.value));
            Line::curve(format!("e = {}", at.jet.restitution), colour, Mark::Curve, points)
        };
        let lines: Vec<Line> = series.iter().rev().step_by(series.len().div_ceil(6)).enumerate().map(line).collect();
        Chart {
            name,
            title: format!("Energy to the surface over time, {most} grains, friction {}", series[0].jet.friction),
            shows: format!(
                "Power over that at which the jet brings its energy; Mukherjee & Zohdi (2015), fig. {figure}"
            ),
            x: Axis::linear("time / ms", 0.0, 1e3 * OVER),
            y: Axis::linear("power / power of the jet", 0.0, ceiling(&lines)),
            lines,
        }
    });
    let average = Chart {
        name: "average",
        title: "Energy to the surface while the jet arrives evenly".into(),
        shows: "Mean power from 12 to 30 ms over that of the jet; Mukherjee & Zohdi (2015), fig. 15".into(),
        x: Axis::linear("restitution", 0.2, 1.0),
        y: Axis::log("power / power of the jet", 0.2, 20.0),
        lines: series
            .iter()
            .map(|series| {
                let points = series.iter().map(|at| (at.jet.restitution, at.regime(energy))).collect();
                let jet = &series[0].jet;
                let mark = if jet.friction > 0.0 { Mark::OpenPoints } else { Mark::Points };
                Line { name: name(series), points, mark, colour: usize::from(jet.grains != 10_000) }
            })
            .collect(),
    };
    histories.chain([average]).map(Picture::Chart).collect()
}

/// A round number above all that lines show.
fn ceiling(lines: &[Line]) -> f64 {
    let most = lines.iter().flat_map(|line| &line.points).map(|(_, at)| at.value).fold(0.0, f64::max);
    (most * 1.05 / 0.5).ceil() * 0.5
}
