//! Paper 002, figure 16: the interference parameter over restitution and friction.

use super::trend::{all, is_below};
use impinge_events::Flight;

use super::jet::copies_of;
use super::{Energies, Error, Jet, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::grains::{Grain, Snapshot, kinetic_energy};
use crate::observe::measure::interference_parameter;
use crate::observe::{Ledger, SurfaceEnergy};
use crate::scheme::{Observer, Passage};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "002-fig16",
    title: "The interference parameter over restitution and friction",
    source: "Mukherjee & Zohdi (2015), section 4.2, eq. (47), fig. 16",
    statement: "Negative values of alpha_interf correspond to cases where reflected grains shield and push oncoming ones away with higher \
                velocities; positive ones to slow grains that are trapped near the surface and undergo repeated collisions.",
    compute,
};

/// A series of jets: grains, friction, restitutions (rising), copies.
type Plan = (u64, f64, &'static [f64], u64);

const FULL: [Plan; 5] = [
    (2000, 0.0, &[0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0], 4),
    (2000, 0.2, &[0.4, 0.5, 0.6, 0.8, 1.0], 4),
    (2000, 0.4, &[0.4, 0.5, 0.6, 0.8, 1.0], 4),
    (10_000, 0.0, &[0.4, 0.6, 0.8], 3),
    (10_000, 0.4, &[0.8], 3),
];
const QUICK: [Plan; 2] = [(2000, 0.0, &[0.3, 0.6, 0.8], 4), (2000, 0.4, &[0.4, 0.6, 0.8], 4)];
/// Restitutions from here on are high, up to there low.
const HIGH: f64 = 0.8;
const LOW: f64 = 0.4;
/// Looks at a run, evenly from its start to its end.
const LOOKS: u32 = 101;
/// End of the history that is drawn, ms.
const SHOWN: f64 = 200.0;
/// When the last grain of the block would have hit, s.
const ARRIVED: f64 = 0.035;

/// Energy (J) of the grains that are there or have left the domain, at each look; and how much of that inside moves along the surface at the last one.
#[derive(Debug, Default)]
struct Remaining {
    energy: Vec<(f64, f64)>,
    left: f64,
    along: f64,
}

impl Observer for Remaining {
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        let pairs = || snapshot.flights.iter().zip(snapshot.grains);
        let energy: f64 = pairs().map(|(flight, grain)| kinetic_energy(flight, grain)).sum();
        let along: f64 = pairs().map(|(flight, grain)| 0.5 * grain.mass * flight.velocity.xy().norm_squared()).sum();
        self.energy.push((snapshot.time, energy + self.left));
        self.along = along / energy;
    }

    fn passage(&mut self, passage: Passage, _: f64, flight: &Flight, grain: &Grain) {
        if passage == Passage::Left {
            self.left += kinetic_energy(flight, grain);
        }
    }
}

/// What is left of a jet.
struct Left {
    energies: Energies,
    /// Over E0, in time.
    history: Vec<(f64, f64)>,
    along: f64,
}

/// Copies of a jet that differ in where its grains are.
struct Point {
    jet: Jet,
    copies: Vec<Left>,
}

impl Point {
    fn mean(&self, of: impl Fn(&Left) -> f64) -> Estimate {
        Estimate::mean(&self.copies.iter().map(of).collect::<Vec<_>>())
    }

    fn alpha(&self) -> Estimate {
        self.mean(|left| interference_parameter(left.energies.left, self.jet.restitution))
    }

    /// The same at a look.
    fn alpha_at(&self, look: usize) -> Estimate {
        self.mean(|left| interference_parameter(left.history[look].1, self.jet.restitution))
    }

    fn look(&self, time: f64) -> usize {
        self.copies[0].history.iter().take_while(|(at, _)| *at < time).count()
    }

    /// Like grains, restitution and friction.
    fn name(&self) -> String {
        let Jet { grains, restitution, friction, .. } = self.jet;
        format!("{grains} grains, e = {restitution}, mu = {friction}")
    }
}

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let plan: &[Plan] = if settings.quick { &QUICK } else { &FULL };
    let jets = |&(grains, friction, restitutions, _): &Plan| -> Vec<Jet> {
        let jet = |&restitution| Jet { grains, friction, restitution, ..Jet::reference() };
        restitutions.iter().map(jet).collect()
    };
    let copies = |jet: &Jet| {
        let of = plan.iter().find(|(grains, friction, ..)| (jet.grains, jet.friction) == (*grains, *friction));
        of.map_or(0, |plan| plan.3)
    };
    let scene = |jet: &Jet| {
        let mut scene = jet.scene();
        scene.output.samples = LOOKS;
        scene
    };
    let left = |((ledger, surface), remaining): ((Ledger, SurfaceEnergy), Remaining)| {
        let e0 = ledger.energy_brought_in();
        let history = remaining.energy.iter().map(|(time, energy)| (*time, energy / e0)).collect();
        Left { energies: Energies::of((ledger, surface)), history, along: remaining.along }
    };
    // The longest runs first.
    let all_jets: Vec<Jet> = plan.iter().rev().flat_map(jets).collect();
    let runs = copies_of(&all_jets, copies, settings, scene, left)?;
    let points: Vec<Point> = all_jets.iter().zip(runs).map(|(&jet, copies)| Point { jet, copies }).collect();
    let mut report = Report::default();
    test_signs(&points, &mut report);
    test_what_is_trapped(&points, &mut report);
    report.tables = vec![table(&points), history(&points)];
    report.pictures = vec![Picture::Chart(over_restitution(&points, plan)), Picture::Chart(over_time(&points))];
    Ok(report)
}

fn told<'a>(points: impl Iterator<Item = &'a Point>, of: impl Fn(&Point) -> Estimate) -> String {
    points.map(|point| format!("{} ({})", of(point), point.name())).collect::<Vec<_>>().join("; ")
}

fn test_signs(points: &[Point], report: &mut Report) {
    let zero = Estimate::exact(0.0);
    let high = || points.iter().filter(|point| point.jet.restitution == HIGH);
    report.judge(
        format!(
            "alpha_interf < 0 at high restitution (e = {HIGH}): there is less energy left than without interference"
        ),
        told(high(), Point::alpha),
        all(high().map(|point| is_below(point.alpha(), zero))),
    );
    for (name, rough) in [("without", false), ("with", true)] {
        let is_low = |point: &&Point| point.jet.restitution <= LOW && (point.jet.friction > 0.0) == rough;
        let low = || points.iter().filter(is_low);
        report.judge(format!(
                "alpha_interf > 0 at low restitution (up to e = {LOW}) {name} friction: there is more energy left than without interference"
            ),
            told(low(), Point::alpha),
            all(low().map(|point| is_below(zero, point.alpha()))),
        );
    }
    let elastic = points.iter().find(|point| (point.jet.restitution, point.jet.friction) == (1.0, 0.0));
    if let Some(elastic) = elastic {
        let what = "alpha_interf of elastic and smooth grains, which lose nothing (rounding)";
        report.measured(what, format!("{:.1e} ({})", elastic.alpha().value, elastic.name()));
    }
}

/// Is a positive value that of slow, trapped grains? What is trapped would be lost later on, and would not fly away along the surface.
fn test_what_is_trapped(points: &[Point], report: &mut Report) {
    let zero = Estimate::exact(0.0);
    let positive = || points.iter().filter(|point| is_below(zero, point.alpha()) == Some(true));
    if positive().next().is_none() {
        return;
    }
    let kept = |point: &Point| {
        let at = point.look(ARRIVED);
        Estimate::ratio(&point.copies.iter().map(|left| (left.energies.left, left.history[at].1)).collect::<Vec<_>>())
    };
    report.judge(format!(
            "Where alpha_interf > 0, it is that of slow grains trapped near the surface: their energy is lost in the end (most of what is \
             left at {:.0} ms is gone at 500 ms)",
            1e3 * ARRIVED
        ),
        format!("kept of the energy at {:.0} ms: {}", 1e3 * ARRIVED, told(positive(), kept)),
        all(positive().map(|point| is_below(kept(point), Estimate::exact(0.5)))),
    );
    report.measured(
        "Where alpha_interf > 0, part of the energy left that moves along the surface: grains that are pressed aside together keep what single \
         ones would lose",
        told(positive(), |point| point.mean(|left| left.along)),
    );
    report.measured(
        "Where alpha_interf > 0, the most of it that the end of collapses may have kept (energy that the laws would have dissipated, over E0)",
        told(positive(), |point| point.mean(|left| left.energies.withheld)),
    );
    report.measured(
        format!("The same, had the run been stopped when the last grain was due ({:.0} ms)", 1e3 * ARRIVED),
        told(positive(), |point| point.alpha_at(point.look(ARRIVED))),
    );
}

fn table(points: &[Point]) -> Table {
    let mut table = Table::new(
        "alpha",
        &[
            "grains",
            "friction",
            "restitution",
            "copies",
            "alpha",
            "alpha_error",
            "left",
            "along_surface",
            "withheld",
            "carried",
            "grains_that_hit",
        ],
    );
    for point in points {
        let alpha = point.alpha();
        table.row(&[
            &point.jet.grains,
            &point.jet.friction,
            &point.jet.restitution,
            &point.copies.len(),
            &alpha.value,
            &alpha.error,
            &point.mean(|left| left.energies.left).value,
            &point.mean(|left| left.along).value,
            &point.mean(|left| left.energies.withheld).value,
            &point.mean(|left| left.energies.carried).value,
            &point.mean(|left| left.energies.hit).value,
        ]);
    }
    table
}

fn history(points: &[Point]) -> Table {
    let mut table = Table::new("history", &["grains", "friction", "restitution", "time", "alpha", "alpha_error"]);
    for point in points {
        for (look, (time, _)) in point.copies[0].history.iter().enumerate() {
            let alpha = point.alpha_at(look);
            let jet = &point.jet;
            table.row(&[&jet.grains, &jet.friction, &jet.restitution, time, &alpha.value, &alpha.error]);
        }
    }
    table
}

fn over_restitution(points: &[Point], plan: &[Plan]) -> Chart {
    let line = |(grains, friction, ..): &Plan| {
        let of = points.iter().filter(|point| (point.jet.grains, point.jet.friction) == (*grains, *friction));
        let points = of.map(|point| (point.jet.restitution, point.alpha())).collect();
        let mark = if *grains < 10_000 { Mark::OpenPoints } else { Mark::Points };
        Line {
            name: format!("{grains} grains, mu = {friction}"),
            points,
            mark,
            colour: (friction / 0.2).round() as usize,
        }
    };
    let mut lines: Vec<Line> = plan.iter().map(line).collect();
    lines.push(Line::curve("as without interference", 0, Mark::Guide, [(0.0, 0.0), (1.0, 0.0)]));
    Chart {
        name: "alpha",
        title: "Interference parameter over restitution".into(),
        shows: "Energy left over E0, less e², when all is over; Mukherjee & Zohdi (2015), fig. 16".into(),
        x: Axis::linear("restitution", 0.0, 1.05),
        y: Axis::linear("alpha_interf", -0.7, 0.3),
        lines,
    }
}

/// How alpha comes to its end, for the jets of fewest grains without friction.
fn over_time(points: &[Point]) -> Chart {
    let fewest = points.iter().map(|point| point.jet.grains).min().unwrap_or(0);
    let shown = points.iter().filter(|point| point.jet.grains == fewest && point.jet.friction == 0.0);
    let line = |(colour, point): (usize, &Point)| {
        let at = |(look, (time, _)): (usize, &(f64, f64))| (1e3 * time, point.alpha_at(look).value);
        let points: Vec<(f64, f64)> =
            point.copies[0].history.iter().enumerate().map(at).filter(|(time, _)| *time <= SHOWN).collect();
        Line::curve(format!("e = {}", point.jet.restitution), colour, Mark::Curve, points)
    };
    let due = [(1e3 * ARRIVED, -0.6), (1e3 * ARRIVED, 1.0)];
    let mut lines: Vec<Line> = shown.enumerate().map(line).collect();
    lines.push(Line::curve("the last grain is due", 0, Mark::Guide, due));
    Chart {
        name: "alpha_in_time",
        title: format!("Energy left over E0, less e², as time goes by: {fewest} grains without friction"),
        shows: "A run that is stopped early has more: what has not hit yet counts as left".into(),
        x: Axis::linear("time / ms", 0.0, SHOWN),
        y: Axis::linear("alpha_interf", -0.6, 1.0),
        lines,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::reproduce::ensemble::unwatched;

    #[test]
    fn elastic_and_smooth_grains_keep_their_energy_also_those_that_leave() {
        // So small a domain that many leave.
        let jet = Jet { grains: 500, restitution: 1.0, ..Jet::reference() };
        let scene = |jet: &Jet| {
            let mut scene = jet.scene();
            (scene.domain.min, scene.domain.max) = ([-3.0, -3.0, -0.1], [3.0; 3]);
            scene.output.samples = 11;
            scene
        };
        let runs =
            copies_of(&[jet], |_| 1, &unwatched(true), scene, |remaining: Remaining| remaining).expect("it runs");
        let Remaining { energy, left, .. } = &runs[0][0];
        assert!(*left > 0.5 * energy[0].1, "most leave");
        for (_, energy_then) in energy {
            approx::assert_relative_eq!(*energy_then, energy[0].1, max_relative = 1e-12);
        }
    }
}
