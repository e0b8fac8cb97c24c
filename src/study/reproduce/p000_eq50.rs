//! Paper 000, equations (44) to (50): the jet whose grains do not meet.

use super::impinging::{DYNAMIC, Impinging, Measured, Outline, STATIC, mean, run_copies};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "000-eq50",
    title: "Jets whose grains do not meet: pressure and shear over the angle",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 6.1, eq. (44) to (50), and their contact law, eq. (31), (32)",
    statement: "A jet whose grains do not meet each other presses on the surface with rho (1 + e) v0² cos²(theta). What follows for its shear from the contact law \
                is the smaller of sticking, 2/7 tan(theta) / (1 + e) times the pressure, and slipping, friction times the pressure.",
    compute,
};

/// The largest of a dozen deviations is beyond this (in standard errors) once in a hundred times.
const MOST: f64 = 3.5;
const ANGLES: [f64; 10] = [0.0, 10.0, 20.0, 30.0, 40.0, 45.0, 52.0, 55.0, 60.0, 70.0];
const QUICK_ANGLES: [f64; 6] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0];

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (angles, duration, copies) =
        if settings.quick { (&QUICK_ANGLES[..], 6_000.0, 2) } else { (&ANGLES[..], 60_000.0, 4) };
    let mut report = Report::default();
    let mut table =
        Table::new("stress", &["outline", "angle", "normal", "normal_error", "shear", "shear_error", "shear_expected"]);
    let mut lines = Vec::new();
    for (colour, (name, base)) in [("slot", Impinging::slot()), ("circle", Impinging::round())].into_iter().enumerate()
    {
        // Parallel grains; steep jets reach as far as their footprint.
        let jet =
            |&angle: &f64| Impinging { angle, interacting: false, divergence: 0.0, distance: 3.0, duration, ..base };
        let measured = run_copies(&angles.iter().map(jet).collect::<Vec<_>>(), copies, settings)?;
        let points: Vec<[Estimate; 2]> = measured.iter().map(inside).collect();
        for (part, what) in [(0, "pressure"), (1, "shear")] {
            let deviation = |(index, jet): (usize, &Measured)| {
                let expected = if part == 0 { 1.0 } else { shear(jet.jet.angle) };
                // Without an angle there is no shear, to round-off, and nothing to be sure of.
                if expected > 0.0 { points[index][part].deviation(Estimate::exact(expected)) } else { 0.0 }
            };
            let deviations: Vec<f64> = measured.iter().enumerate().map(deviation).collect();
            let count = deviations.iter().filter(|&&deviation| deviation > 0.0).count();
            let square = deviations.iter().map(|deviation| deviation.powi(2)).sum::<f64>() / count as f64;
            let most = deviations.iter().copied().fold(0.0, f64::max);
            let widest = points.iter().map(|point| point[part].error).fold(0.0, f64::max);
            report.put_to_the_test(
                format!("{name}: {what} is the exact one at all {} angles, within error bars", angles.len()),
                format!(
                    "deviates by {most:.1} standard errors at most, {:.2} on root mean square; errors are {:.2} % of the non-interacting pressure \
                     (of shear: of friction times that) at most",
                    square.sqrt(),
                    100.0 * widest
                ),
                most < MOST,
            );
        }
        for (jet, [normal, shear_found]) in measured.iter().zip(&points) {
            let expected = shear(jet.jet.angle);
            table.row(&[
                &name,
                &jet.jet.angle,
                &normal.value,
                &normal.error,
                &shear_found.value,
                &shear_found.error,
                &expected,
            ]);
        }
        let curve =
            |part: usize| measured.iter().zip(&points).map(|(jet, point)| (jet.jet.angle, point[part])).collect();
        lines.push(Line::measured(format!("{name}: pressure"), 2 * colour, curve(0)));
        lines.push(Line::measured(format!("{name}: shear"), 2 * colour + 1, curve(1)));
    }
    let smooth = (0..=360).map(|step| 0.2 * f64::from(step));
    lines.push(Line::curve("exact pressure", 5, Mark::Dashed, [(0.0, 1.0), (72.0, 1.0)]));
    lines.push(Line::curve("exact shear", 5, Mark::Guide, smooth.map(|angle| (angle, shear(angle)))));
    report.tables.push(table);
    report.pictures.push(Picture::Chart(Chart {
        name: "stress",
        title: "Stress of jets whose grains do not meet, restitution 0.3, friction 0.3 / 0.2".into(),
        shows: "Pressure over rho (1 + e) v0² cos²(theta); shear over dynamic friction times that".into(),
        x: Axis::linear("angle from the normal / degrees", 0.0, 72.0),
        y: Axis::linear("stress over that of eq. (50)", 0.0, 1.6),
        lines,
    }));
    Ok(report)
}

/// Shear over dynamic friction times pressure.
fn shear(angle: f64) -> f64 {
    Impinging { angle, ..Impinging::slot() }.free().shear_over_pressure(STATIC, DYNAMIC) / DYNAMIC
}

/// Mean pressure and shear on the patches that lie wholly in the footprint.
fn inside(measured: &Measured) -> [Estimate; 2] {
    let jet = measured.jet;
    // Half a patch, and half the width across of a circle, whose chord of that breadth is 0.86 of its diameter.
    let half = match jet.outline {
        Outline::Slot => jet.half_footprint().min(2.9) - 0.07,
        Outline::Circle => 0.85 * jet.half_footprint().min(2.0) - 0.07,
    };
    let region = move |spot: &super::impinging::Spot| spot.x.abs() < half && spot.y.abs() < 0.2;
    [
        measured.derived(|spots| mean(spots, region, |spot| spot.normal)),
        measured.derived(|spots| mean(spots, region, |spot| spot.shear)),
    ]
}
