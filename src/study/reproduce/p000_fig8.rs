//! Paper 000, figure 8: stress over the angle of attack.

use super::impinging::{DYNAMIC, Impinging, Measured, STATIC, Spot, mean, peak, run_copies};
use super::trend::{Trend, nearness};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "000-fig8",
    title: "Figure 8: stress on the surface over the angle of attack",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 7, fig. 8",
    statement: "At 0 degrees normal and shear stress are symmetric, shear being positive where grains flow in the positive direction and negative where they flow in the \
                negative one. With the angle the negative shear vanishes and the magnitudes of both grow. At 45 and 60 degrees both are those of the non-interacting jet, \
                |N| = 1 and |S| = 1, where grains are not deflected by others.",
    compute,
};

/// Angles (degrees), and how much longer each is measured than the first: steep jets pile up, and cost a hundred times as much.
const ANGLES: [(f64, f64); 5] = [(0.0, 1.0), (15.0, 1.0), (30.0, 1.5), (45.0, 8.0), (60.0, 20.0)];
/// Parts of a total that two halves of a symmetric profile may differ by.
const SYMMETRIC: f64 = 0.05;
/// Part of the shear that is negative when it has vanished.
const VANISHED: f64 = 0.02;
/// Stresses so near to those of the non-interacting jet are called equal to them.
const NEAR: f64 = 0.1;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (duration, copies) = if settings.quick { (1_500.0, 2) } else { (5_000.0, 4) };
    let jet = |(angle, longer): (f64, f64)| Impinging { angle, duration: duration * longer, ..Impinging::slot() };
    let jets = run_copies(&ANGLES.map(jet), copies, settings)?;
    let mut report = Report::default();
    test_symmetry(&jets[0], &mut report);
    let over_angle = |of: &dyn Fn(&[Spot]) -> f64| -> Vec<(f64, Estimate)> {
        jets.iter().map(|jet| (jet.jet.angle, jet.derived(of))).collect()
    };
    let negative = over_angle(&|spots| {
        let sum = |of: fn(f64) -> f64| spots.iter().map(|spot| of(spot.shear)).sum::<f64>();
        sum(|shear| (-shear).max(0.0)) / sum(f64::abs)
    });
    report.claim_trend("The part of the shear that is negative falls with the angle", &negative, Trend::Falls);
    let last = negative[negative.len() - 1].1;
    report.decide(
        format!("and vanishes: less than {:.0} % of it is left at 60 degrees", 100.0 * VANISHED),
        format!("{} %", last * 100.0),
        Estimate { value: VANISHED - last.value, error: last.error },
    );
    report.claim_trend(
        "The magnitude of the normalised normal stress grows with the angle (peak over half a width)",
        &over_angle(&|spots| peak(spots, |spot| spot.normal)),
        Trend::Rises,
    );
    report.claim_trend(
        "The magnitude of the normalised shear grows with the angle (peak over half a width)",
        &over_angle(&|spots| peak(spots, |spot| spot.shear)),
        Trend::Rises,
    );
    jets[3..].iter().for_each(|jet| test_free_region(jet, &mut report));
    report.tables.push(table(&jets));
    report.pictures.extend(pictures(&jets));
    Ok(report)
}

fn test_symmetry(jet: &Measured, report: &mut Report) {
    let halves = |of: fn(&Spot) -> f64, sign: f64| {
        jet.derived(move |spots| {
            let half = |side: f64| spots.iter().filter(|spot| side * spot.x > 0.0).map(of).sum::<f64>();
            let all: f64 = spots.iter().map(|spot| of(spot).abs()).sum();
            (half(-1.0) + sign * half(1.0)) / all
        })
    };
    for (what, of, sign) in [
        ("Normal stress is symmetric", (|spot| spot.normal) as fn(&Spot) -> f64, -1.0),
        ("Shear is antisymmetric", |spot| spot.shear, 1.0),
    ] {
        let uneven = halves(of, sign);
        report.decide(
            format!("{what} at 0 degrees: its halves differ by less than {:.0} % of the whole", 100.0 * SYMMETRIC),
            format!("{} %", uneven * 100.0),
            nearness(uneven, 0.0, SYMMETRIC),
        );
    }
    let flow = halves(|spot| spot.shear, -1.0);
    report.decide(
        "Shear at 0 degrees is positive where grains flow in the positive direction, and negative on the other side",
        format!(
            "the sum over one side less that over the other is {:.3} of the sum of magnitudes (1 where no patch has the other sign)",
            flow.value
        ),
        Estimate { value: flow.value - 0.9, error: flow.error },
    );
}

/// Upstream, next to the edge of the footprint, nothing has been deflected that could come in the way.
fn test_free_region(jet: &Measured, report: &mut Report) {
    let edge = jet.jet.half_footprint();
    // The patch that the edge divides is left out.
    let region = move |spot: &Spot| spot.x < edge - 0.0625 && spot.x > edge - 0.3;
    let at = |of: fn(&Spot) -> f64| jet.derived(move |spots| mean(spots, region, of));
    let (normal, shear) = (at(|spot| spot.normal), at(|spot| spot.shear));
    let angle = jet.jet.angle;
    let exact = jet.jet.free().shear_over_pressure(STATIC, DYNAMIC) / DYNAMIC;
    report.decide(
        format!("At {angle} degrees there is a region where |N| = 1 within {NEAR}"),
        format!(
            "{normal} next to the upstream edge; the peak over half a width is {}",
            jet.derived(|spots| peak(spots, |spot| spot.normal))
        ),
        nearness(normal, 1.0, NEAR),
    );
    report.decide(
        format!("At {angle} degrees |S| = 1 there within {NEAR}, if scaled by dynamic friction"),
        format!("{shear}; the exact value without interaction is {exact:.3}"),
        nearness(shear, 1.0, NEAR),
    );
    let printed = shear * (DYNAMIC / STATIC);
    report.decide(
        format!("At {angle} degrees |S| = 1 there within {NEAR}, if scaled by static friction as eq. (54) prints"),
        format!("{printed}; the exact value without interaction is {:.3}", exact * DYNAMIC / STATIC),
        nearness(printed, 1.0, NEAR),
    );
}

/// Stresses of all jets over x / L.
fn table(jets: &[Measured]) -> Table {
    let mut table = Table::new("stress", &["angle", "x", "normal", "normal_error", "shear", "shear_error"]);
    for jet in jets {
        let profiles = jet.profile(|spot| spot.normal).into_iter().zip(jet.profile(|spot| spot.shear));
        for ((x, normal), (_, shear)) in profiles {
            table.row(&[&jet.jet.angle, &x, &normal.value, &normal.error, &shear.value, &shear.error]);
        }
    }
    table
}

fn pictures(jets: &[Measured]) -> [Picture; 2] {
    let chart = |name, title: &str, of: fn(&Spot) -> f64, range: [f64; 2]| {
        let mut lines: Vec<Line> = jets
            .iter()
            .enumerate()
            .map(|(colour, jet)| Line::measured(format!("{} degrees", jet.jet.angle), colour, jet.profile(of)))
            .collect();
        lines.push(Line::curve("no interaction", 0, Mark::Guide, [(-2.0, 1.0), (1.5, 1.0)]));
        Picture::Chart(Chart {
            name,
            title: title.into(),
            shows: "Area fraction 0.1, six diameters wide, restitution 0.3; the jet flows to the left".into(),
            x: Axis::linear("x / L", -2.0, 1.5),
            y: Axis::linear("stress over that of the non-interacting jet", range[0], range[1]),
            lines,
        })
    };
    [
        chart("normal", "Normal stress over the angle of attack", |spot| spot.normal, [0.0, 1.3]),
        chart("shear", "Shear stress over the angle of attack", |spot| spot.shear, [-0.4, 1.3]),
    ]
}
