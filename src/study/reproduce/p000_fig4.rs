//! Paper 000, figures 4 and 6: maps of density and velocity, and of normal and shear stress in three dimensions.

use super::impinging::{DYNAMIC, Impinging, Measured, PER_WIDTH, Spot, run_copies};
use super::trend::nearness;
use super::{Error, Report, Settings, Study};
use crate::observe::measure::{FlowCell, Measurement, Quantity};
use crate::shown::{Axis, Map, Picture};

pub(super) const STUDY: Study = Study {
    name: "000-fig4",
    title: "Figures 4 and 6: maps of density and velocity; normal and shear stress in three dimensions",
    source: "Arbelaez, Zohdi & Dornfeld (2009), sections 5 and 6.2, fig. 4, 6",
    statement: "Averages over snapshots and cells give maps of the density and the velocity of a jet (eq. 43); impulses over patches and time give maps of normal and shear stress on the surface \
                (eq. 51), each with its uncertainty. (What the figures show in numbers is not told.)",
    compute,
};

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (durations, copies) = if settings.quick { ([2_500.0, 800.0], 2) } else { ([20_000.0, 5_000.0], 4) };
    let slot =
        Impinging { duration: durations[0], samples: if settings.quick { 4_000 } else { 20_000 }, ..Impinging::slot() };
    let round = Impinging { duration: durations[1], ..Impinging::round() };
    let jets = run_copies(&[slot, round], copies, settings)?;
    let [slot, round] = jets.as_slice() else { return Ok(Report::default()) };
    let mut report = Report::default();
    test_flow(slot, &mut report);
    test_stress(round, &mut report);
    report.tables.extend(slot.flow.results().tables);
    report.pictures.extend(flow_maps(slot));
    report.pictures.extend(stress_maps(round));
    Ok(report)
}

/// What must be true of a map of a stationary jet: where the jet has not met anything yet it is the jet, and what it brings flows out.
fn test_flow(slot: &Measured, report: &mut Report) {
    let flow = &slot.flow;
    let width = slot.length();
    let free = slot.jet.free();
    let cells: Vec<(f64, f64, FlowCell)> = (0..flow.grid().len())
        .map(|cell| {
            let place = flow.grid().centre(cell);
            (place.x / width, place.z / width, flow.cell(cell))
        })
        .collect();
    let (sin, cos) = slot.jet.angle.to_radians().sin_cos();
    // Inside the stream, a third of its width from the axis, and as far from the nozzle as that.
    let along = |x: f64, z: f64| x * sin + z * cos;
    let aside = |x: f64, z: f64| x * cos - z * sin;
    let in_stream = |cell: &usize| {
        let (x, z, _) = cells[*cell];
        aside(x, z).abs() < 0.33 && (1.2..1.85).contains(&along(x, z))
    };
    let stream: Vec<usize> = (0..cells.len()).filter(in_stream).collect();
    let speed = |cell: &FlowCell| cell.velocity.map_or(0.0, |[x, _, z]| x.value.hypot(z.value) / free.speed);
    if !stream.is_empty() {
        let stream = flow.region(&stream);
        let density = stream.density * free.density.recip();
        report.decide(
            "Below the nozzle the map shows the density of the jet within 10 %",
            format!("{density} of the density at the nozzle, at a mean velocity of {:.4} v0", speed(&stream)),
            nearness(density, 1.0, 0.1),
        );
    }
    let densest = cells.iter().max_by(|a, b| a.2.density.value.total_cmp(&b.2.density.value));
    if let Some((x, z, cell)) = densest {
        let relative = cell.density * free.density.recip();
        report.measured(
            "Densest cell, over the density at the nozzle",
            format!("{relative} at x = {x:.2} L, z = {z:.2} L, where the speed is {:.2} v0", speed(cell)),
        );
    }
    let out = slot.outflow.moments(Quantity::Mass).resultant;
    let brought = free.density * free.speed * width;
    report.measured(
        "Mass that leaves downstream, over what the nozzle brings (the rest leaves upstream or at the top)",
        format!("{}", out * brought.recip()),
    );
}

fn test_stress(round: &Measured, report: &mut Report) {
    let normal =
        round.derived(|spots| spots.iter().map(|spot| spot.normal).sum::<f64>() / f64::from(PER_WIDTH).powi(2));
    let shear = round.derived(|spots| spots.iter().map(|spot| spot.shear).sum::<f64>() / f64::from(PER_WIDTH).powi(2));
    // The footprint of a circle, in units of L².
    let area = 0.25 * std::f64::consts::PI / round.jet.angle.to_radians().cos();
    report.measured(
        "Circular nozzle at 30 degrees: total normal force over that of the non-interacting jet",
        format!("{}", normal * area.recip()),
    );
    report.measured(
        "Circular nozzle at 30 degrees: total shear force over dynamic friction times that",
        format!("{} (with friction {DYNAMIC})", shear * area.recip()),
    );
    let peak = round.derived(|spots| spots.iter().map(|spot| spot.normal).fold(0.0, f64::max));
    let patch = (0..round.stress.patches().all().len()).map(|patch| round.stress.stress(patch));
    let errors: Vec<f64> = patch
        .filter(|stress| stress.normal.value > 0.3 * round.jet.free().pressure())
        .map(|stress| stress.normal.error / stress.normal.value)
        .collect();
    report.measured(
        "Standard errors of the normal stress on the loaded patches",
        format!(
            "{:.1} % on average over {} patches; the largest normal stress is {peak} of that of the non-interacting jet (noise raises it)",
            100.0 * errors.iter().sum::<f64>() / errors.len() as f64,
            errors.len()
        ),
    );
}

fn flow_maps(slot: &Measured) -> Vec<Picture> {
    let grid = slot.flow.grid();
    let width = slot.length();
    let [nx, _, nz] = grid.cells.map(|count| count as usize);
    let free = slot.jet.free();
    let map = |name, title: &str, legend: &str, most: f64, of: &dyn Fn(&FlowCell) -> Option<f64>| {
        Picture::Map(Map {
            name,
            title: title.into(),
            shows: "Slot at 30 degrees, area fraction 0.1, six diameters wide; the jet flows to the left".into(),
            x: Axis::length("x / L", grid.min[0] / width, grid.max[0] / width),
            y: Axis::length("z / L", grid.min[2] / width, grid.max[2] / width),
            columns: (0..nx).map(|x| (0..nz).map(|z| of(&slot.flow.cell(z * nx + x))).collect()).collect(),
            legend: legend.into(),
            most,
            grey: "no grain".into(),
            line: None,
        })
    };
    let there = |cell: &FlowCell, value: f64| cell.velocity.is_some().then_some(value);
    let densities = (0..grid.len()).map(|cell| slot.flow.cell(cell).density.value / free.density);
    let most = densities.fold(0.0, f64::max);
    vec![
        map("density", "Density, over that at the nozzle", "density", 0.6 * most, &|cell| {
            there(cell, cell.density.value / free.density)
        }),
        map("speed", "Speed of the mass, over that at the nozzle", "speed / v0", 1.0, &|cell| {
            let [x, _, z] = cell.velocity?;
            Some(x.value.hypot(z.value) / free.speed)
        }),
        map("velocity_x", "Velocity along the surface (red: to the right)", "vx / v0", 1.0, &|cell| {
            Some(cell.velocity?[0].value / free.speed)
        }),
        map("velocity_z", "Velocity across the surface (red: upwards)", "vz / v0", 1.0, &|cell| {
            Some(cell.velocity?[2].value / free.speed)
        }),
    ]
}

/// Normal and shear stress of a round jet on the surface.
pub(super) fn stress_maps(round: &Measured) -> Vec<Picture> {
    let names = match round.jet.angle as u32 {
        0 => ["normal_0", "shear_0"],
        10 => ["normal_10", "shear_10"],
        20 => ["normal_20", "shear_20"],
        30 => ["normal_30", "shear_30"],
        _ => ["normal_60", "shear_60"],
    };
    let (pressure, width) = (round.jet.free().pressure(), round.length());
    let columns = round.stress.patches().columns().unwrap_or_default();
    let [length, breadth] = round.stress.patches().sides().unwrap_or_default();
    let angle = round.jet.angle;
    let of = |patch: usize| {
        let stress = round.stress.stress(patch);
        let shear = DYNAMIC * pressure;
        Spot {
            x: 0.0,
            y: 0.0,
            normal: stress.normal.value / pressure,
            shear: stress.shear.value / shear,
            across: stress.across.value / shear,
        }
    };
    let map = |name, title: String, value: &dyn Fn(Spot) -> f64| {
        let columns: Vec<Vec<Option<f64>>> =
            columns.iter().map(|column| column.iter().map(|&patch| Some(value(of(patch)))).collect()).collect();
        let most = columns.iter().flatten().flatten().map(|value| value.abs()).fold(0.0, f64::max);
        Picture::Map(Map {
            name,
            title,
            shows: "Over that of the non-interacting jet; circle of six diameters, volume fraction 0.1".into(),
            x: Axis::length("x / L", -0.5 * length / width, 0.5 * length / width),
            y: Axis::length("y / L", -0.5 * breadth / width, 0.5 * breadth / width),
            columns,
            legend: "relative stress".into(),
            most,
            grey: String::new(),
            line: None,
        })
    };
    vec![
        map(names[0], format!("Normal stress at {angle} degrees"), &|spot| spot.normal),
        map(names[1], format!("Shear at {angle} degrees, positive to the left, whither the jet flows"), &|spot| {
            spot.shear
        }),
    ]
}
