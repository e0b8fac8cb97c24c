//! Paper 002, figures 8 and 10 to 12: damage below the surface in time, over porosity and under oblique jets.

use nalgebra::Vector3;

use super::answers::{all, falls, is_below, is_within, judge};
use super::jet::copies_of;
use super::stills::{Seen, Stills, View, side_view};
use super::{Error, Jet, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::observe::measure::{Contact, DamageCell, Grid, HalfSpace, Subsurface, Window};
use crate::scheme::{GrainCollision, Observer, SurfaceHit};
use crate::shown::{Axis, Chart, Line, Map, Mark, Picture, Table};
use crate::solid::Elastic;

pub(super) const STUDY: Study = Study {
    name: "002-fig8",
    title: "Figures 8 and 10 to 12: damage below the surface in time, over porosity and under oblique jets",
    source: "Mukherjee & Zohdi (2015), sections 2.4 to 2.6 and 4.1, fig. 8 and 10 to 12",
    statement: "Contours of damage propagate and are symmetric with some fluctuations. Pores weaken the solid, therefore stresses are higher \
                the more porous it is. Under an angle the part of the surface that the jet hits first sees more collisions, the other part loses \
                less energy, and collision zone and damage become asymmetric towards the angle of the stream.",
    compute,
};

/// Angles between the jet and the normal, degrees (fig. 12).
const ANGLES: [f64; 3] = [0.0, 30.0, 60.0];
/// Grains and copies of each angle.
const FULL: (u64, u64) = (10_000, 4);
const QUICK: (u64, u64) = (2000, 8);
/// Restitution and friction (fig. 7 and 8).
const CONTACT: (f64, f64) = (0.8, 0.5);
/// End of the runs, s, in steps of 10 ms.
const UNTIL: f64 = 0.05;
const STEPS: usize = 5;
/// Bulk modulus (Table 1), Pa, and Poisson's ratio, which the paper does not give.
const BULK: f64 = 100e9;
const POISSON_RATIO: f64 = 0.3;
/// Equivalent stress above which there is damage, Pa; the paper gives none.
const THRESHOLD: f64 = 1e8;
/// Cells as large as grains, 10 mm deep, along the slope, across it and down.
const GRID: Grid = Grid { min: [-0.4, -0.3, -0.06], max: [0.4, 0.3, 0.0], cells: [40, 30, 6] };
/// Straight below the middle of the jet.
const CENTRE_LINE: Grid = Grid { min: [-0.01, -0.01, -0.12], max: [0.01, 0.01, 0.0], cells: [1, 1, 12] };
/// Porosities (Table 1), the weight of the upper bound (fig. 10) and C.
const POROSITIES: [f64; 6] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5];
const UPPER: f64 = 1.0;
const SOFTNESS: f64 = 1e-4;
/// A centroid of damage is in the middle if it is within so many m of it: half a grain.
const MIDDLE: f64 = 0.005;
/// A rise of the stress that is worth the name.
const RISE: f64 = 1.01;

/// What is kept of a run.
#[derive(Debug, Default)]
struct Watched {
    hits: Vec<SurfaceHit>,
    /// Collisions between grains over the side that the jet hits first, and over the other one.
    collisions: [u64; 2],
    stills: Stills,
}

/// 0 for the side towards which the surface rises and which the jet hits first, 1 for the other.
fn side(place: &Vector3<f64>) -> usize {
    usize::from(place.x > 0.0)
}

impl Observer for Watched {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.hits.push(*hit);
    }

    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.collisions[side(&collision.position)] += 1;
    }

    fn frame(&mut self, number: u32, snapshot: &crate::grains::Snapshot<'_>) {
        self.stills.frame(number, snapshot);
    }
}

/// What a run comes to.
struct Outcome {
    damage: Vec<DamageCell>,
    /// Contacts at once while the jet arrives, and hits.
    hits: usize,
    collisions: [u64; 2],
    /// Mean energy of first hits on each side, J.
    first: [f64; 2],
    /// Largest equivalent stress (Pa) along the centre line, by depth from below: for each porosity with contacts that last as those of the dense solid do
    /// and as those of the porous one do, and with a Poisson's ratio of 0.2.
    stress: [Vec<Vec<f64>>; 3],
    /// The grains after 30 ms.
    still: Vec<Seen>,
}

fn solid(poisson_ratio: f64, porosity: f64) -> Elastic {
    Elastic::from_bulk(BULK, poisson_ratio).porous(porosity, UPPER, SOFTNESS)
}

/// The solid below the plane z = 0 under rigid grains.
fn below(solid: Elastic, contact: Contact) -> HalfSpace {
    HalfSpace { point: Vector3::zeros(), normal: Vector3::z(), solid, threshold: THRESHOLD, contact }
}

/// A hit in the frame of the plane: x down the slope, y across it.
fn level(hit: &SurfaceHit) -> SurfaceHit {
    let down = Vector3::new(hit.normal.z, 0.0, -hit.normal.x);
    let along = |vector: &Vector3<f64>| Vector3::new(down.dot(vector), vector.y, 0.0);
    SurfaceHit {
        position: along(&hit.position),
        normal: Vector3::z(),
        impulse_tangential: along(&hit.impulse_tangential),
        ..*hit
    }
}

fn cells(hits: &[SurfaceHit], grid: Grid, batches: usize, below: HalfSpace) -> Vec<DamageCell> {
    let mut seen = Subsurface::over(grid, Window { from: 0.0, until: UNTIL, batches }, below);
    hits.iter().for_each(|hit| seen.surface_hit(hit));
    seen.cells()
}

fn outcome(watched: Watched) -> Outcome {
    let hits: Vec<SurfaceHit> = watched.hits.iter().map(level).collect();
    let dense = solid(POISSON_RATIO, 0.0);
    let damage = cells(&hits, GRID, STEPS, below(dense, Contact::hertz(&dense, None)));
    let first = [0, 1].map(|of| {
        let of_side = watched.hits.iter().filter(|hit| hit.order == 1 && side(&hit.position) == of);
        let energies: Vec<f64> = of_side.map(SurfaceHit::energy).collect();
        Estimate::mean(&energies).value
    });
    // Only under a normal jet the centre line is in the middle of what is hit.
    let normal = hits.first().is_some_and(|_| watched.hits[0].normal == Vector3::z());
    let line = |below: HalfSpace| cells(&hits, CENTRE_LINE, 1, below).iter().map(|cell| cell.peak).collect();
    let over_porosity = |below: &dyn Fn(f64) -> HalfSpace| -> Vec<Vec<f64>> {
        let porosities = if normal { &POROSITIES[..] } else { &[] };
        porosities.iter().map(|&porosity| line(below(porosity))).collect()
    };
    let same_contact = |nu: f64, porosity| below(solid(nu, porosity), Contact::hertz(&solid(nu, 0.0), None));
    let own_contact = |porosity| {
        let solid = solid(POISSON_RATIO, porosity);
        below(solid, Contact::hertz(&solid, None))
    };
    let stress = [
        over_porosity(&|porosity| same_contact(POISSON_RATIO, porosity)),
        over_porosity(&own_contact),
        over_porosity(&|porosity| same_contact(0.2, porosity)),
    ];
    let Watched { collisions, mut stills, .. } = watched;
    let still = stills.0.swap_remove(3).1;
    Outcome { damage, hits: hits.len(), collisions, first, stress, still }
}

/// Copies of a jet that differ in where its grains are.
struct Copies {
    jet: Jet,
    outcomes: Vec<Outcome>,
}

impl Copies {
    fn mean(&self, of: impl Fn(&Outcome) -> f64) -> Estimate {
        Estimate::mean(&self.outcomes.iter().map(of).collect::<Vec<_>>())
    }

    fn name(&self) -> String {
        format!("{} grains at {}°", self.jet.grains, self.jet.angle)
    }
}

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (grains, copies) = if settings.quick { QUICK } else { FULL };
    let jets = ANGLES.map(|angle| Jet {
        grains,
        angle,
        restitution: CONTACT.0,
        friction: CONTACT.1,
        until: UNTIL,
        ..Jet::reference()
    });
    let scene = |jet: &Jet| {
        let mut scene = jet.scene();
        scene.run.frames = STEPS as u32 + 1;
        scene
    };
    let runs = copies_of(&jets, |_| copies, settings, scene, outcome)?;
    let all_copies: Vec<Copies> = jets.iter().zip(runs).map(|(&jet, outcomes)| Copies { jet, outcomes }).collect();
    let mut report = Report::default();
    let [normal, oblique @ ..] = all_copies.as_slice() else { return Ok(report) };
    test_growth(normal, &mut report);
    test_symmetry(normal, &mut report);
    test_moduli(&mut report);
    test_porosity(normal, &mut report);
    for copies in oblique {
        test_angle(copies, &mut report);
    }
    report.measured(
        "Damage over the angle: cells with damage times hits that made it, over that at normal incidence",
        all_copies
            .iter()
            .map(|copies| format!("{} at {}°", total_ratio(copies, normal), copies.jet.angle))
            .collect::<Vec<_>>()
            .join(", "),
    );
    report.tables = vec![moduli(), stresses(normal), damage_table(&all_copies), angles(&all_copies)];
    report.pictures = pictures(&all_copies);
    Ok(report)
}

/// Damage of a cell until the end of a step.
fn damage_until(cell: &DamageCell, step: usize) -> f64 {
    cell.until(step) as f64
}

/// All damage until the end of a step.
fn total(outcome: &Outcome, step: usize) -> f64 {
    outcome.damage.iter().map(|cell| damage_until(cell, step)).sum()
}

fn total_ratio(copies: &Copies, normal: &Copies) -> Estimate {
    let [here, there] = [copies, normal].map(|copies| copies.mean(|outcome| total(outcome, STEPS - 1)));
    let value = here.value / there.value;
    Estimate { value, error: value * (here.error / here.value).hypot(there.error / there.value) }
}

/// Volume in which there is damage at the end of a step, l.
fn volume(outcome: &Outcome, step: usize) -> f64 {
    1e3 * GRID.cell_volume() * outcome.damage.iter().filter(|cell| cell.until(step) > 0).count() as f64
}

/// Where damage is on average, m.
fn centroid(outcome: &Outcome, axis: usize) -> f64 {
    let moment = |(index, cell): (usize, &DamageCell)| damage_until(cell, STEPS - 1) * GRID.centre(index)[axis];
    outcome.damage.iter().enumerate().map(moment).sum::<f64>() / total(outcome, STEPS - 1)
}

fn test_growth(normal: &Copies, report: &mut Report) {
    let volumes: Vec<Estimate> = (0..STEPS).map(|step| normal.mean(|outcome| volume(outcome, step))).collect();
    let told = volumes.iter().enumerate().map(|(step, volume)| format!("{volume} l after {} ms", 10 * (step + 1)));
    // While the jet arrives, to 32 ms.
    let grows = volumes[..3].windows(2).map(|pair| is_below(pair[0], pair[1]));
    judge(
        report,
        format!("{}: damage propagates while the jet arrives", normal.name()),
        format!(
            "volume with an equivalent stress above {:.0} MPa: {} (bulk modulus {:.0} GPa, Poisson's ratio {POISSON_RATIO}, rigid grains, Hertz contacts)",
            THRESHOLD / 1e6,
            told.collect::<Vec<_>>().join(", "),
            BULK / 1e9
        ),
        all(grows),
    );
}

fn test_symmetry(normal: &Copies, report: &mut Report) {
    let centroids = [0, 1].map(|axis| normal.mean(|outcome| centroid(outcome, axis)));
    judge(
        report,
        format!("{}: damage is symmetric (its centroid is within half a grain of the axis)", normal.name()),
        format!("centroid at x = {} mm, y = {} mm", centroids[0] * 1e3, centroids[1] * 1e3),
        all(centroids.map(|centroid| is_within(centroid, 0.0, MIDDLE))),
    );
    // The same for one jet: what the discrete nature of impacts leaves.
    let scatter = normal.outcomes.iter().map(|outcome| centroid(outcome, 0).powi(2)).sum::<f64>();
    report.measured(
        format!("{}: fluctuation of the centroid from jet to jet (rms)", normal.name()),
        format!("{:.2} mm", 1e3 * (scatter / normal.outcomes.len() as f64).sqrt()),
    );
}

fn test_moduli(report: &mut Report) {
    let solids = POROSITIES.map(|porosity| solid(POISSON_RATIO, porosity));
    let exact = |of: fn(&Elastic) -> f64| solids.iter().map(|solid| Estimate::exact(of(solid))).collect::<Vec<_>>();
    let [bulk, shear] = [exact(|solid| solid.bulk), exact(|solid| solid.shear)];
    let last = solids[POROSITIES.len() - 1];
    judge(
        report,
        "Pores weaken the solid: bulk and shear modulus fall with the porosity (upper bounds of Hashin & Shtrikman)",
        format!(
            "from porosity 0 to 0.5 the bulk modulus falls to {:.1} %, the shear modulus to {:.1} %, Poisson's ratio from {POISSON_RATIO} to {:.4}",
            100.0 * last.bulk / solids[0].bulk,
            100.0 * last.shear / solids[0].shear,
            last.poisson_ratio()
        ),
        all([falls(&bulk), falls(&shear)]),
    );
}

/// Largest stress at porosity 0.5 over that without pores, averaged over depths; and the extremes of that ratio over depths.
fn stress_ratio(normal: &Copies, variant: usize) -> (Estimate, [f64; 2]) {
    let last = POROSITIES.len() - 1;
    let ratios = |outcome: &Outcome| -> Vec<f64> {
        let [dense, porous] = [0, last].map(|index| &outcome.stress[variant][index]);
        porous.iter().zip(dense).map(|(porous, dense)| porous / dense).collect()
    };
    let all: Vec<f64> = normal.outcomes.iter().flat_map(ratios).collect();
    let ends = [f64::min, f64::max].map(|of| all.iter().copied().reduce(of).unwrap_or(f64::NAN));
    (normal.mean(|outcome| Estimate::mean(&ratios(outcome)).value), ends)
}

fn test_porosity(normal: &Copies, report: &mut Report) {
    let higher = |(ratio, _): (Estimate, [f64; 2])| is_below(Estimate::exact(RISE), ratio);
    let told = |(ratio, [least, most]): (Estimate, [f64; 2])| {
        let percent = |ratio: f64| 100.0 * (ratio - 1.0);
        format!(
            "{:+.2} ± {:.2} % from porosity 0 to 0.5 ({:+.2} to {:+.2} % over depths)",
            percent(ratio.value),
            100.0 * ratio.error,
            percent(least),
            percent(most)
        )
    };
    let [same, own, fifth] = [0, 1, 2].map(|variant| stress_ratio(normal, variant));
    judge(
        report,
        "The more porous the solid, the higher the stresses (by more than 1 %), if contacts last as long as on the dense solid",
        format!(
            "{}: eq. (49) to (58) know no modulus, and no impulse does, so that only Poisson's ratio counts",
            told(same)
        ),
        higher(same),
    );
    judge(
        report,
        "The more porous the solid, the higher the stresses (by more than 1 %), if contacts last as long as the porous solid makes them",
        format!("{}: softer contacts last longer, and their forces are smaller", told(own)),
        higher(own),
    );
    report.measured(
        "Stresses over porosity with a Poisson's ratio of 0.2, which pores leave as it is, and the contact times of the dense solid",
        told(fifth),
    );
}

fn test_angle(copies: &Copies, report: &mut Report) {
    let zero = Estimate::exact(0.0);
    let name = copies.name();
    let pairs: Vec<(f64, f64)> =
        copies.outcomes.iter().map(|outcome| outcome.collisions.map(|count| count as f64).into()).collect();
    let ratio = Estimate::ratio(&pairs);
    judge(
        report,
        format!("{name}: more collisions over the part of the surface that the jet hits first than over the other"),
        format!("ratio of the two: {ratio}"),
        is_below(Estimate::exact(1.0), ratio),
    );
    let energies = Estimate::ratio(&copies.outcomes.iter().map(|outcome| outcome.first.into()).collect::<Vec<_>>());
    judge(
        report,
        format!("{name}: where it arrives later, grains lose less energy before they hit for the first time"),
        format!("energy of a first hit on the part that is hit first, over that on the other: {energies}"),
        is_below(energies, Estimate::exact(1.0)),
    );
    let shift = copies.mean(|outcome| centroid(outcome, 0));
    let magnitude = Estimate { value: shift.value.abs(), ..shift };
    judge(
        report,
        format!("{name}: the damage is asymmetric along the slope"),
        format!("its centroid is {} mm down the slope from the axis of the jet", shift * 1e3),
        is_below(zero, magnitude),
    );
    let zone = is_below(Estimate::exact(1.0), ratio);
    let loads = is_below(shift, zero);
    judge(
        report,
        format!("{name}: collision zone and damage lean to the same side"),
        format!(
            "{ratio} times the collisions over the side that is hit first, and the damage {} mm up the slope, towards it: grains rebound across to the \
             side that is hit later, and shield it",
            shift * -1e3
        ),
        zone.zip(loads).map(|(zone, loads)| zone == loads),
    );
}

fn moduli() -> Table {
    let columns = &["porosity", "bulk_modulus", "shear_modulus", "poisson_ratio", "poisson_ratio_of_0.2"];
    let mut table = Table::new("moduli", columns);
    for porosity in POROSITIES {
        let (porous, other) = (solid(POISSON_RATIO, porosity), solid(0.2, porosity));
        table.row(&[&porosity, &porous.bulk, &porous.shear, &porous.poisson_ratio(), &other.poisson_ratio()]);
    }
    table
}

/// Largest equivalent stress (Pa) at a depth.
fn stress(normal: &Copies, variant: usize, porosity: usize, depth: usize) -> Estimate {
    normal.mean(|outcome| outcome.stress[variant][porosity][depth])
}

fn stresses(normal: &Copies) -> Table {
    let columns = &[
        "porosity",
        "z",
        "same_contact",
        "same_contact_error",
        "own_contact",
        "own_contact_error",
        "poisson_ratio_of_0.2",
    ];
    let mut table = Table::new("stress_over_porosity", columns);
    for (index, porosity) in POROSITIES.iter().enumerate() {
        for depth in 0..CENTRE_LINE.len() {
            let [same, own, fifth] = [0, 1, 2].map(|variant| stress(normal, variant, index, depth));
            let z = CENTRE_LINE.centre(depth).z;
            table.row(&[porosity, &z, &same.value, &same.error, &own.value, &own.error, &fifth.value]);
        }
    }
    table
}

fn damage_table(copies: &[Copies]) -> Table {
    let mut table = Table::new("damage", &["angle", "down_slope", "across", "z", "damage", "damage_error"]);
    for at in copies {
        for cell in 0..GRID.len() {
            let damage = at.mean(|outcome| damage_until(&outcome.damage[cell], STEPS - 1));
            let place = GRID.centre(cell);
            table.row(&[&at.jet.angle, &place.x, &place.y, &place.z, &damage.value, &damage.error]);
        }
    }
    table
}

fn angles(copies: &[Copies]) -> Table {
    let columns =
        &["angle", "until", "hits", "damage", "damage_error", "volume", "volume_error", "centroid", "centroid_error"];
    let mut table = Table::new("growth", columns);
    for at in copies {
        let shift = at.mean(|outcome| centroid(outcome, 0));
        let hits = at.mean(|outcome| outcome.hits as f64);
        for step in 0..STEPS {
            let [damage, damaged] = [at.mean(|outcome| total(outcome, step)), at.mean(|outcome| volume(outcome, step))];
            let until = UNTIL * (step + 1) as f64 / STEPS as f64;
            table.row(&[
                &at.jet.angle,
                &until,
                &hits.value,
                &damage.value,
                &damage.error,
                &damaged.value,
                &damaged.error,
                &shift.value,
                &shift.error,
            ]);
        }
    }
    table
}

/// A layer or a section of the mean damage of all copies.
fn damage_map(name: &'static str, title: String, copies: &Copies, step: usize, plan: bool, most: f64) -> Map {
    let [nx, ny, nz] = GRID.cells.map(|count| count as usize);
    let index = |x: usize, row: usize| if plan { ((nz - 1) * ny + row) * nx + x } else { (row * ny + ny / 2) * nx + x };
    let value = |x, row| copies.mean(|outcome| damage_until(&outcome.damage[index(x, row)], step)).value;
    let shown = |value: f64| (value > 0.0).then_some(value);
    let rows = if plan { ny } else { nz };
    let (label, axis) = if plan { ("across / m", 1) } else { ("z / m", 2) };
    let x = if copies.jet.angle > 0.0 { "down the slope / m" } else { "x / m" };
    let where_it_is = if plan { "in the uppermost 10 mm" } else { "in the middle section" };
    Map {
        name,
        title,
        shows: format!("Hits above {:.0} MPa {where_it_is}, mean of {} jets", THRESHOLD / 1e6, copies.outcomes.len()),
        x: Axis::linear(x, GRID.min[0], GRID.max[0]),
        y: Axis::linear(label, GRID.min[axis], GRID.max[axis]),
        columns: (0..nx).map(|x| (0..rows).map(|row| shown(value(x, row))).collect()).collect(),
        legend: "hits".into(),
        most,
        grey: "none".into(),
        line: None,
    }
}

fn pictures(copies: &[Copies]) -> Vec<Picture> {
    let normal = &copies[0];
    let most = |at: &Copies| {
        let damage =
            (0..GRID.len()).map(|cell| at.mean(|outcome| damage_until(&outcome.damage[cell], STEPS - 1)).value);
        damage.fold(0.0, f64::max)
    };
    let sections =
        [("damage_10ms", 0), ("damage_20ms", 1), ("damage_30ms", 2), ("damage_50ms", 4)].map(|(name, step)| {
            let title = format!("Damage below a jet of {} grains after {} ms", normal.jet.grains, 10 * (step + 1));
            damage_map(name, title, normal, step, false, most(normal))
        });
    let plans = ["damage_0deg", "damage_30deg", "damage_60deg"].into_iter().zip(copies).map(|(name, at)| {
        let title = format!("Damage under a jet of {} grains at {}°", at.jet.grains, at.jet.angle);
        damage_map(name, title, at, STEPS - 1, true, most(normal))
    });
    let views = ["jet_0deg", "jet_30deg", "jet_60deg"].into_iter().zip(copies).map(|(name, at)| {
        let flow = at.jet.grains as f64 / (at.jet.width * at.jet.length);
        let view = View { x: [-1.5, 1.5], z: [-1.0, 2.0], cells: [60, 60], most: flow / 4.0 };
        let stills: Vec<&[Seen]> = at.outcomes.iter().map(|outcome| outcome.still.as_slice()).collect();
        let title = format!("A jet of {} grains at {}° after 30 ms, from the side", at.jet.grains, at.jet.angle);
        let shows = format!("Mean of {} jets; Mukherjee & Zohdi (2015), fig. 11", stills.len());
        let slope = at.jet.angle.to_radians().tan();
        let reach = 1.5_f64.min(1.0 / slope.max(1e-9));
        let line = Some(("surface".to_owned(), vec![(-reach, reach * slope), (reach, -reach * slope)]));
        Map { line, ..side_view(name, title, shows, &stills, view) }
    });
    let maps = sections.into_iter().chain(plans).chain(views).map(Picture::Map);
    maps.chain([moduli_chart(), stress_chart(normal)].map(Picture::Chart)).collect()
}

fn moduli_chart() -> Chart {
    let curve = |name: &str, colour, of: fn(&Elastic) -> f64| {
        let dense = of(&solid(POISSON_RATIO, 0.0));
        let porosities = (0..=50).map(|percent| f64::from(percent) / 100.0);
        Line::curve(name, colour, Mark::Curve, porosities.map(|p| (p, of(&solid(POISSON_RATIO, p)) / dense)))
    };
    Chart {
        name: "moduli",
        title: "Moduli over porosity".into(),
        shows: "Upper bounds of Hashin & Shtrikman (1963), over those of the solid; Mukherjee & Zohdi (2015), fig. 10"
            .into(),
        x: Axis::linear("porosity", 0.0, 0.5),
        y: Axis::linear("modulus / modulus without pores", 0.0, 1.1),
        lines: vec![
            curve("bulk modulus", 0, |solid| solid.bulk),
            curve("shear modulus", 1, |solid| solid.shear),
            curve("Poisson's ratio (0.3)", 2, Elastic::poisson_ratio),
        ],
    }
}

fn stress_chart(normal: &Copies) -> Chart {
    let line = |name: &str, variant, porosity, colour, mark| {
        let at = |depth| (-1e3 * CENTRE_LINE.centre(depth).z, stress(normal, variant, porosity, depth) * 1e-9);
        Line { name: name.into(), points: (0..CENTRE_LINE.len()).rev().map(at).collect(), mark, colour }
    };
    let last = POROSITIES.len() - 1;
    Chart {
        name: "stress_over_depth",
        title: "Largest equivalent stress of a hit below the middle of the jet".into(),
        shows: format!("{} grains; Mukherjee & Zohdi (2015), fig. 10", normal.jet.grains),
        x: Axis::linear("depth / mm", 0.0, 120.0),
        y: Axis::log("GPa", 0.001, 10.0),
        lines: vec![
            line("no pores", 0, 0, 0, Mark::Points),
            line("porosity 0.5, contacts as before", 0, last, 1, Mark::OpenPoints),
            line("porosity 0.5, softer contacts", 1, last, 2, Mark::Points),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;

    #[test]
    fn a_hit_on_a_slope_is_one_on_the_level_with_the_same_distances() {
        let (sin, cos) = 30.0_f64.to_radians().sin_cos();
        let hit = SurfaceHit {
            position: Vector3::new(0.2 * cos, 0.1, -0.2 * sin),
            normal: Vector3::new(sin, 0.0, cos),
            impulse_normal: 3.0,
            impulse_tangential: Vector3::new(-cos, 0.5, sin),
            ..FakeJet::hit(1)
        };
        let flat = level(&hit);
        approx::assert_relative_eq!(flat.position, Vector3::new(0.2, 0.1, 0.0), epsilon = 1e-15);
        approx::assert_relative_eq!(flat.impulse_tangential, Vector3::new(-1.0, 0.5, 0.0), epsilon = 1e-15);
        assert_eq!((flat.normal, flat.impulse_normal), (Vector3::z(), 3.0));
    }
}
