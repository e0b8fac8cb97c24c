//! Paper 002, figures 6, 7 and 9: the block of 10 000 grains, and how it spreads on impact.

use super::jet::copies_of;
use super::stills::{Seen, Stills, View, side_view};
use super::trend::{all, is_below};
use super::{Error, Jet, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::scene::{Inside, Scene, Source};
use crate::shown::{Axis, Chart, Line, Picture, Table};
use crate::simulation::Simulation;

pub(super) const STUDY: Study = Study {
    name: "002-fig6",
    title: "Figures 6, 7 and 9: the block of 10 000 grains, and how it spreads on impact",
    source: "Mukherjee & Zohdi (2015), sections 3 and 4.1, fig. 6, 7 and 9",
    statement: "Random sequential addition puts 10 000 grains of radius 0.01 into 2.5 by 0.2 by 0.2: a loosely flowing stream. Collisions of \
                rebounding with incoming grains spread it on impact; with fewer grains there are fewer of them and no such pattern forms \
                (500 against 10 000).",
    compute,
};

/// Grains and copies.
const FULL: [(u64, u64); 4] = [(500, 16), (1000, 12), (2000, 8), (10_000, 4)];
const QUICK: [(u64, u64); 4] = [(500, 8), (1000, 6), (2000, 4), (10_000, 2)];
/// The grains of the paper's figure.
const MANY: u64 = 10_000;
const FEW: u64 = 500;
/// Restitution and friction (fig. 7).
const CONTACT: (f64, f64) = (0.8, 0.5);
/// End of the runs, s, and the frames until then, ends included; one every 10 ms.
const UNTIL: f64 = 0.05;
const FRAMES: u32 = 6;
/// Frames that are drawn.
const DRAWN: [usize; 3] = [2, 3, 5];
/// A stream in which no grain is nearer to the next one than this, on average, is loose: gaps of a diameter between surfaces. Over the diameter.
const LOOSE: f64 = 1.0;
/// A jet spreads "so" if its spread is more than this part of that of the jet of 10 000.
const SO: f64 = 0.5;

/// A grain flies in a sheet along the surface if its velocity is off it by no more than this, degrees.
const SHEET: f64 = 10.0;
/// A sheet is what most grains are in.
const MOST: f64 = 0.5;

/// Names of pictures, by frame: few grains, many grains.
const NAMES: [[&str; 3]; 2] = [["few_20ms", "few_30ms", "few_50ms"], ["many_20ms", "many_30ms", "many_50ms"]];

/// How a jet has spread at the end.
#[derive(Clone, Copy, Debug)]
struct Spread {
    /// Root mean square distance from the axis of the grains that no longer fly down as they started, m.
    distance: f64,
    /// Median angle of their velocities from the normal, degrees.
    angle: f64,
    /// Part of them that fly within [`SHEET`] of the surface.
    sheet: f64,
    /// Part of the grains that no longer fly as they started.
    met: f64,
}

/// A grain is one that has met something if its velocity is off by more than this, m/s.
const OFF: f64 = 1e-6;

fn spread(seen: &[Seen]) -> Spread {
    let start = Jet::reference().velocity();
    let met: Vec<&Seen> = seen.iter().filter(|grain| (grain.velocity - start).amax() > OFF).collect();
    let squares: f64 = met.iter().map(|grain| grain.place.xy().norm_squared()).sum();
    let mut angles: Vec<f64> =
        met.iter().map(|grain| grain.velocity.xy().norm().atan2(grain.velocity.z).to_degrees()).collect();
    angles.sort_by(f64::total_cmp);
    Spread {
        distance: (squares / met.len() as f64).sqrt(),
        angle: angles[angles.len() / 2],
        sheet: angles.iter().filter(|angle| (*angle - 90.0).abs() <= SHEET).count() as f64 / met.len() as f64,
        met: met.len() as f64 / seen.len() as f64,
    }
}

/// A jet, and the frames of its copies.
struct Seens {
    jet: Jet,
    copies: Vec<Stills>,
}

impl Seens {
    fn mean(&self, of: impl Fn(&Spread) -> f64) -> Estimate {
        let last = |stills: &Stills| spread(&stills.0[stills.0.len() - 1].1);
        Estimate::mean(&self.copies.iter().map(last).map(|spread| of(&spread)).collect::<Vec<_>>())
    }
}

fn jet(grains: u64) -> Jet {
    Jet { grains, restitution: CONTACT.0, friction: CONTACT.1, until: UNTIL, ..Jet::reference() }
}

fn scene(jet: &Jet) -> Scene {
    let mut scene = jet.scene();
    scene.run.frames = FRAMES;
    scene
}

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let plan: &[(u64, u64)] = if settings.quick { &QUICK } else { &FULL };
    let jets: Vec<Jet> = plan.iter().rev().map(|&(grains, _)| jet(grains)).collect();
    let copies = |jet: &Jet| plan.iter().find(|(grains, _)| *grains == jet.grains).map_or(0, |plan| plan.1);
    let runs = copies_of(&jets, copies, settings, scene, |stills: Stills| stills)?;
    let mut seen: Vec<Seens> = jets.iter().zip(runs).map(|(&jet, copies)| Seens { jet, copies }).collect();
    seen.reverse();
    let mut report = Report::default();
    test_block(settings, &mut report);
    test_looseness(&seen, &mut report);
    test_spread(&seen, &mut report);
    report.tables = vec![table(&seen)];
    report.pictures = pictures(&seen);
    Ok(report)
}

/// Can the block be made at all? (PHYSICS 2.24: whole grains in the box would have a volume fraction of 0.419, beyond the 0.384 at which random
/// places run out.)
fn test_block(settings: &Settings<'_>, report: &mut Report) {
    let with = |inside: Inside| {
        let mut scene = scene(&Jet { seed: settings.seed, ..jet(MANY) });
        for source in &mut scene.source {
            if let Source::Block(block) = source {
                block.inside = inside;
            }
        }
        Simulation::new(&scene, "".as_ref())
    };
    let told = |inside| match with(inside) {
        Ok(_) => (true, format!("{MANY} grains fit")),
        Err(refusal) => (false, refusal.what),
    };
    let (grains_fit, told_of_grains) = told(Inside::Grains);
    report.put_to_the_test(
        format!("Random sequential addition puts {MANY} grains into the box of 2.5 m by 0.2 m by 0.2 m"),
        told_of_grains,
        grains_fit,
    );
    let (centres_fit, told_of_centres) = told(Inside::Centres);
    report.put_to_the_test(
        format!(
            "It does if only their centres must lie in the box (the grains then take up {:.3} of the box around them)",
            jet(MANY).solid_fraction()
        ),
        told_of_centres,
        centres_fit,
    );
}

/// Mean distance between the surfaces of a grain and the one nearest to it at the start, over the diameter, by cells a diameter wide.
fn mean_gap(seen: &[Seen], diameter: f64) -> f64 {
    // Sorted along the jet: whoever is nearer than the best so far lies within a window.
    let mut places: Vec<_> = seen.iter().map(|grain| grain.place).collect();
    places.sort_by(|a, b| a.z.total_cmp(&b.z));
    let nearest = |index: usize| {
        let here = places[index];
        let mut best = f64::INFINITY;
        let mut look = |other: &nalgebra::Vector3<f64>| {
            best = best.min((other - here).norm());
            (other.z - here.z).abs() <= best
        };
        let _ = places[index + 1..].iter().take_while(|other| look(other)).count();
        let _ = places[..index].iter().rev().take_while(|other| look(other)).count();
        best
    };
    (0..places.len()).map(nearest).sum::<f64>() / places.len() as f64 / diameter - 1.0
}

fn test_looseness(seen: &[Seens], report: &mut Report) {
    let gap = |at: &Seens| {
        let gaps = at.copies.iter().map(|stills| mean_gap(&stills.0[0].1, at.jet.diameter()));
        Estimate::mean(&gaps.collect::<Vec<_>>())
    };
    for at in seen.iter().filter(|at| [FEW, MANY].contains(&at.jet.grains)) {
        report.judge(format!(
                "{} grains are a loosely flowing stream (a gap of {LOOSE} diameter or more from a grain to the one nearest to it, on average)",
                at.jet.grains
            ),
            format!(
                "a gap of {} diameters; they take up {:.3} of the block, and {:.0} others pass within a diameter of the way of each",
                gap(at),
                at.jet.solid_fraction(),
                at.jet.crowding()
            ),
            is_below(Estimate::exact(LOOSE), gap(at)),
        );
    }
}

fn test_spread(seen: &[Seens], report: &mut Report) {
    let of = |grains: u64| seen.iter().find(|at| at.jet.grains == grains);
    let (Some(few), Some(many)) = (of(FEW), of(MANY)) else { return };
    let name = |at: &Seens| format!("{} with {} grains", at.mean(|spread| spread.distance), at.jet.grains);
    let [wide, narrow] = [many, few].map(|at| at.mean(|spread| spread.distance));
    report.judge(format!(
            "Interfering collisions spread the jet of {MANY} grains: at 50 ms grains are further from the axis than where they started (rms)"
        ),
        format!("{wide} m from the axis, from {:.3} m at the start", many.jet.width / 6.0_f64.sqrt()),
        is_below(Estimate::exact(many.jet.width / 6.0_f64.sqrt()), wide),
    );
    report.judge(
        format!(
            "{FEW} grains do not spread so (their rms distance from the axis at 50 ms is below {SO} of that of {MANY})"
        ),
        format!("in m: {}", seen.iter().map(name).collect::<Vec<_>>().join(", ")),
        is_below(narrow, wide * SO),
    );
    let [dense, thin] = [many, few].map(|at| at.mean(|spread| spread.sheet));
    report.judge(
        format!("{MANY} grains form a sheet along the surface, {FEW} do not (most of them fly within {SHEET}° of it)"),
        format!("part that does: {dense} of {MANY}, {thin} of {FEW}"),
        all([is_below(Estimate::exact(MOST), dense), is_below(thin, Estimate::exact(MOST))]),
    );
    let angles = |at: &Seens| format!("{}° with {}", at.mean(|spread| spread.angle), at.jet.grains);
    report.judge(
        "The fewer grains, the nearer to the normal they leave (median angle)",
        seen.iter().map(angles).collect::<Vec<_>>().join(", "),
        all(seen.windows(2).map(|pair| is_below(pair[0].mean(|s| s.angle), pair[1].mean(|s| s.angle)))),
    );
}

fn table(seen: &[Seens]) -> Table {
    let mut table = Table::new(
        "spread",
        &[
            "grains",
            "copies",
            "solid_fraction",
            "crowding",
            "gap_over_diameter",
            "distance",
            "distance_error",
            "angle",
            "angle_error",
            "sheet",
            "sheet_error",
            "met",
        ],
    );
    let all_frames = seen.iter().map(|at| {
        let gap = Estimate::mean(
            &at.copies.iter().map(|stills| mean_gap(&stills.0[0].1, at.jet.diameter())).collect::<Vec<_>>(),
        );
        (at, gap)
    });
    for (at, gap) in all_frames {
        let [distance, angle] = [at.mean(|s| s.distance), at.mean(|s| s.angle)];
        let [sheet, met] = [at.mean(|s| s.sheet), at.mean(|s| s.met)];
        table.row(&[
            &at.jet.grains,
            &at.copies.len(),
            &at.jet.solid_fraction(),
            &at.jet.crowding(),
            &gap.value,
            &distance.value,
            &distance.error,
            &angle.value,
            &angle.error,
            &sheet.value,
            &sheet.error,
            &met.value,
        ]);
    }
    table
}

fn pictures(seen: &[Seens]) -> Vec<Picture> {
    let mut pictures = Vec::new();
    for (grains, names) in [FEW, MANY].into_iter().zip(NAMES) {
        let Some(at) = seen.iter().find(|at| at.jet.grains == grains) else { continue };
        // The jet itself is as bright as can be, and so is what has a quarter of it.
        let flow = grains as f64 / (at.jet.width * at.jet.length);
        let view = View { x: [-1.5, 1.5], z: [0.0, 3.0], cells: [60, 60], most: flow / 4.0 };
        for (frame, name) in DRAWN.into_iter().zip(names) {
            let copies: Vec<&[Seen]> = at.copies.iter().map(|stills| stills.0[frame].1.as_slice()).collect();
            let time = 1e3 * at.copies[0].0[frame].0;
            let title = format!("A jet of {grains} grains after {time:.0} ms, from the side");
            let shows = format!(
                "Mean of {} jets, e = {}, mu = {}; Mukherjee & Zohdi (2015), fig. 7 and 9",
                copies.len(),
                CONTACT.0,
                CONTACT.1
            );
            pictures.push(Picture::Map(side_view(name, title, shows, &copies, view)));
        }
    }
    let line = |name: &str, colour, of: fn(&Spread) -> f64| {
        Line::measured(name, colour, seen.iter().map(|at| (at.jet.grains as f64, at.mean(of))).collect())
    };
    pictures.push(Picture::Chart(Chart {
        name: "angle",
        title: "Where grains go that have met something".into(),
        shows: format!("At 50 ms, e = {}, mu = {}", CONTACT.0, CONTACT.1),
        x: Axis::log("number of grains", 400.0, 12_000.0),
        y: Axis::linear("median angle from the normal / °", 0.0, 120.0),
        lines: vec![line("median", 0, |spread| spread.angle)],
    }));
    pictures
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn the_spread_of_grains_that_met_something_and_the_gap_between_them() {
        let grain =
            |place: [f64; 3], velocity: [f64; 3]| Seen { place: place.into(), velocity: Vector3::from(velocity) };
        let down = [0.0, 0.0, -80.0];
        let seen = [
            grain([3.0, 4.0, 1.0], [10.0, 0.0, 10.0]),
            grain([0.0, 0.0, 5.0], down),
            grain([0.0, 5.0, 2.0], [0.0, 8.0, 0.0]),
            grain([0.0, 0.0, 9.0], [0.0, 0.0, 8.0]),
        ];
        let spread = spread(&seen);
        approx::assert_relative_eq!(spread.distance, (50.0_f64 / 3.0).sqrt(), max_relative = 1e-14);
        assert_eq!((spread.angle.round(), spread.sheet, spread.met), (45.0, 1.0 / 3.0, 0.75));
        // Nearest neighbours: 4, 4 (or more), sqrt(11), 4.
        let distance = |a: usize, b: usize| (seen[a].place - seen[b].place).norm();
        let nearest = (0..4).map(|a| (0..4).filter(|&b| b != a).map(|b| distance(a, b)).fold(f64::INFINITY, f64::min));
        approx::assert_relative_eq!(mean_gap(&seen, 0.5), nearest.sum::<f64>() / 4.0 / 0.5 - 1.0, max_relative = 1e-14);
    }
}
