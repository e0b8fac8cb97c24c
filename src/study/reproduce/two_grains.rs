//! Two grains and a wall to the end: the closed form against the engine, at every point of the square of restitutions.

use std::ops::ControlFlow;

use impinge_events::Domain;
use impinge_events::contact_time::STANDSTILL;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::p002_fig4::boundary_of_collapse;
use super::{Error, Report, Sequence, Settings, Study};
use crate::grains::{NewGrain, sphere_volume};
use crate::law::{ContactLaw, Friction};
use crate::observe::{Ledger, SurfaceEnergy};
use crate::scene::{Collapse, Interference, PlaneSurface};
use crate::scheme::{EventDriven, Laws};
use crate::shown::{Axis, Map, Picture, Table};
use crate::surface::Surface;

pub(super) const STUDY: Study = Study {
    name: "two-grains",
    title: "Two grains and a wall to the end: closed form against the engine",
    source: "The sequence of Mukherjee & Zohdi (2015), section 2.7, fig. 3, continued to its end",
    statement: "Grain 1 hits the wall, then grain 2, and again, ceil(pi / theta) - 1 times, cos theta = T / (2 sqrt(e_s e_p)), T = \
                (m2 (1 + e_s e_p) - m1 (e_s + e_p)) / (m1 + m2); without end where T >= 2 sqrt(e_s e_p).",
    compute,
};

/// Mass of grain 2 over that of grain 1, what that is called, and its map.
const RATIOS: [(f64, &str, &str); 3] = [
    (1.0, "equal masses", "hits_equal"),
    (4.0, "m2 = 4 m1", "hits_heavy_outer"),
    (0.25, "m2 = m1 / 4", "hits_light_outer"),
];
/// Restitutions along each side of the square, and the same for a quick study.
const GRID: [u32; 2] = [40, 20];
/// The same for pictures, which need no engine and show what is at the middles of their cells.
const FINE_GRID: u32 = 100;
const MIDDLE: f64 = 0.5;
/// Velocities and energies may differ by so much, over v0 and E0: rounding of some hundred hits.
const ROUNDING: f64 = 1e-12;
/// How far the faster grain flies between two looks, m. It grows in time as a collapsing pair slows down, to 1e270 s and beyond.
const SPAN: f64 = 2000.0;
/// Looks after which every sequence here is over.
const SPANS: u32 = 200;
/// Radius of both grains, m; their masses differ by density.
const RADIUS: f64 = 0.5;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let count = GRID[usize::from(settings.quick)];
    let mut report = Report::default();
    let mut table = Table::new(
        "hits",
        &[
            "mass_ratio",
            "restitution_surface",
            "restitution_grains",
            "grain_hits",
            "surface_hits",
            "grain_hits_engine",
            "surface_hits_engine",
            "energy_left",
            "energy_left_engine",
            "surface_energy",
            "surface_energy_engine",
        ],
    );
    for (index, (ratio, masses, name)) in RATIOS.into_iter().enumerate() {
        if (settings.watch)(index as f64 / RATIOS.len() as f64).is_break() {
            return Err(Error::BrokenOff);
        }
        let square: Vec<Sequence> = square(count, 0.0, ratio).collect();
        let played = square.par_iter().map(play).collect::<Result<Vec<_>, _>>()?;
        put_to_the_test(masses, &square, &played, &mut report);
        square.iter().zip(&played).for_each(|(sequence, played)| row(&mut table, sequence, played));
        report.pictures.push(Picture::Map(map_of_hits(ratio, masses, name)));
    }
    report.tables.push(table);
    Ok(report)
}

/// Restitutions 1, 2 ... `count` over `count`, less so many steps.
fn square(count: u32, less: f64, ratio: f64) -> impl Iterator<Item = Sequence> {
    let at = move |index: u32| (f64::from(index) - less) / f64::from(count);
    (0..count.pow(2)).map(move |index| Sequence {
        s: at(index / count + 1),
        q: at(index % count + 1),
        m1: 1.0,
        m2: ratio,
    })
}

/// What the engine makes of a sequence.
struct Played {
    grain_hits: i32,
    surface_hits: i32,
    /// Velocities at the end, towards the wall, over v0.
    last: [f64; 2],
    /// Energy brought to the surface over E0.
    surface_energy: f64,
}

impl Played {
    /// Whether the engine hits as often as the closed form says.
    fn agrees(&self, sequence: &Sequence) -> bool {
        let (Some(pairs), Some(walls)) = (sequence.grain_hits(), sequence.surface_hits()) else { return true };
        // Grain 1 may be left at rest exactly (e_s = 1/2, e_p = 1/3): then rounding decides whether it drifts to the wall.
        let at_rest = sequence.after(pairs)[0].abs() < ROUNDING;
        self.grain_hits == pairs && (self.surface_hits == walls || at_rest)
    }

    /// How far velocities and energies are from those of the closed form.
    fn deviation(&self, sequence: &Sequence) -> f64 {
        let last = sequence.last();
        let velocities = (self.last[0] - last[0]).abs().max((self.last[1] - last[1]).abs());
        velocities.max((self.surface_energy - sequence.surface_energy(i32::MAX)).abs())
    }
}

/// Lets the engine play a sequence with v0 = 1 m/s.
fn play(sequence: &Sequence) -> Result<Played, Error> {
    let grain = |height: f64, mass: f64| NewGrain {
        position: Vector3::z() * height,
        velocity: -Vector3::z(),
        spin: Vector3::zeros(),
        radius: RADIUS,
        density: mass / sphere_volume(RADIUS),
        strength: 1.0,
    };
    let grains = [grain(RADIUS + 0.3, sequence.m1), grain(3.0 * RADIUS + 0.5, sequence.m2)];
    let wall = PlaneSurface { point: [0.0; 3], normal: [0.0, 0.0, 1.0], velocity: [0.0; 3] };
    let surface = Surface::new(&[crate::scene::Surface::Plane(wall)], "".as_ref())?;
    let law = |restitution| ContactLaw { restitution, friction: Friction::Smooth };
    let laws = Laws {
        grain: law(sequence.q),
        surface: law(sequence.s),
        interference: Interference::All,
        collapse: Collapse::Elastic,
    };
    let mut engine: EventDriven<Surface> = EventDriven::new(&grains, surface, Domain::unbounded(), laws, 0.0);
    let mut observed = (Ledger::default(), SurfaceEnergy::default());
    let mut last = [1.0_f64; 2];
    for _ in 0..SPANS {
        let fastest = last[0].abs().max(last[1].abs());
        if fastest < STANDSTILL {
            break;
        }
        let until = engine.time() + SPAN / fastest;
        // Nobody breaks off a millisecond.
        let _ = engine.advance(until, &mut observed, &mut |_| ControlFlow::Continue(()))?;
        last = engine.snapshot(until, |grains| [0, 1].map(|index| -grains.flights[index].velocity.z));
    }
    let (ledger, surface) = observed;
    let counts = ledger.counts();
    Ok(Played {
        grain_hits: counts.grain_grain as i32,
        surface_hits: counts.grain_surface as i32,
        last,
        surface_energy: surface.all_hits() / (0.5 * (sequence.m1 + sequence.m2)),
    })
}

fn put_to_the_test(masses: &str, square: &[Sequence], played: &[Played], report: &mut Report) {
    let pairs = || square.iter().zip(played);
    let mismatches = pairs().filter(|(sequence, played)| !played.agrees(sequence)).count();
    let collapses = square.iter().filter(|sequence| sequence.collapses()).count();
    let deviation = pairs().map(|(sequence, played)| played.deviation(sequence)).fold(0.0, f64::max);
    let most = square.iter().filter_map(Sequence::grain_hits).max().unwrap_or(0);
    report.put_to_the_test(
        format!(
            "{masses}: the engine hits as often as the closed form, at all {} points that do not collapse",
            square.len() - collapses
        ),
        format!("{mismatches} mismatches; up to {most} grain-grain hits; {collapses} points collapse"),
        mismatches == 0,
    );
    report.put_to_the_test(
        format!("{masses}: final velocities and energy to the surface are those of the closed form, collapse included"),
        format!("largest difference {deviation:.1e} of v0 or E0 at {} points", square.len()),
        deviation < ROUNDING,
    );
}

fn row(table: &mut Table, sequence: &Sequence, played: &Played) {
    let hits = |count: Option<i32>| count.map_or("inf".to_owned(), |count| count.to_string());
    table.row(&[
        &(sequence.m2 / sequence.m1),
        &sequence.s,
        &sequence.q,
        &hits(sequence.grain_hits()),
        &hits(sequence.surface_hits()),
        &played.grain_hits,
        &played.surface_hits,
        &sequence.energy(sequence.last()),
        &sequence.energy(played.last),
        &sequence.surface_energy(i32::MAX),
        &played.surface_energy,
    ]);
}

fn map_of_hits(ratio: f64, masses: &str, name: &'static str) -> Map {
    let hits: Vec<Option<f64>> = square(FINE_GRID, MIDDLE, ratio).map(|at| at.grain_hits().map(f64::from)).collect();
    Map {
        name,
        title: format!("How often two grains in front of a wall hit each other: {masses}"),
        shows: "Grain-grain hits until the end; 10 stands for more too".into(),
        x: Axis::linear("restitution of the surface", 0.0, 1.0),
        y: Axis::linear("restitution between grains", 0.0, 1.0),
        columns: hits.chunks(FINE_GRID as usize).map(<[_]>::to_vec).collect(),
        legend: "hits".into(),
        most: 10.0,
        grey: "without end".into(),
        line: Some(("T = 2 sqrt(e_s e_p)".into(), boundary_of_collapse(ratio))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Verdict;
    use super::super::ensemble::unwatched;
    use super::*;

    #[test]
    fn the_engine_plays_the_closed_form_on_a_coarse_square() {
        for (ratio, ..) in RATIOS {
            for sequence in square(10, 0.0, ratio) {
                let played = play(&sequence).expect("it runs");
                assert!(played.agrees(&sequence) && played.deviation(&sequence) < ROUNDING, "{sequence:?}");
            }
        }
    }

    #[test]
    fn a_wrong_count_is_noticed() {
        let sequence = Sequence { s: 0.2, q: 0.2, m1: 1.0, m2: 1.0 };
        let played = play(&sequence).expect("it runs");
        assert!(played.agrees(&sequence));
        assert!(!Played { grain_hits: 3, ..played }.agrees(&sequence));
        assert!(Played { last: [0.0; 2], ..played }.deviation(&sequence) > 1e3 * ROUNDING);
    }

    #[test]
    fn the_quick_study_agrees() {
        let report = compute(&unwatched(true)).expect("it runs");
        assert_eq!(report.verdict(), Verdict::Agrees);
        assert_eq!((report.tables[0].rows.len(), report.pictures.len()), (1200, 3));
    }
}
