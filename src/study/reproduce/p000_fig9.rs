//! Paper 000, figures 9 to 11: stress over the speed, the volume fraction and the restitution of the surface.

use super::impinging::{Impinging, Measured, PER_WIDTH, Spot, mean, peak, run_copies};
use super::trend::{Trend, difference, listed};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Picture, Table};

pub(super) const FIGURE_9: Study = Study {
    name: "000-fig9",
    title: "Figure 9: stress on the surface over the speed of the jet",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 7, fig. 9",
    statement: "With a constant restitution the normalised stress is independent of the speed of the jet.",
    compute: compute_9,
};

pub(super) const FIGURE_10: Study = Study {
    name: "000-fig10",
    title: "Figure 10: stress on the surface over the volume fraction",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 7, fig. 10",
    statement: "As the volume fraction falls, normalised stresses rise and flatten out towards the square wave of the non-interacting jet.",
    compute: compute_10,
};

pub(super) const FIGURE_11: Study = Study {
    name: "000-fig11",
    title: "Figure 11: stress on the surface over the grain-surface restitution",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 7, fig. 11",
    statement: "The normalised stress rises as the restitution of the surface falls: grains that rebound with less energy shield less.",
    compute: compute_11,
};

/// Speeds differ by less than this part of the peak, or stress depends on them.
const INDEPENDENT: f64 = 0.05;

fn run(
    setting: impl Fn(Impinging, f64) -> Impinging,
    values: &[f64],
    durations: [f64; 2],
    settings: &Settings<'_>,
) -> Result<Vec<Measured>, Error> {
    let (duration, copies) = if settings.quick { (durations[0], 2) } else { (durations[1], 4) };
    let jet = |&value: &f64| setting(Impinging { duration, ..Impinging::slot() }, value);
    run_copies(&values.iter().map(jet).collect::<Vec<_>>(), copies, settings)
}

/// Mean over the footprint, which the square wave fills.
fn on_footprint(jet: &Measured, of: fn(&Spot) -> f64) -> Estimate {
    let half = jet.jet.half_footprint();
    jet.derived(|spots| mean(spots, |spot| spot.x.abs() < half, of))
}

fn compute_9(settings: &Settings<'_>) -> Result<Report, Error> {
    let speeds: &[f64] = if settings.quick { &[5.0, 20.0, 80.0] } else { &[5.0, 10.0, 20.0, 40.0, 80.0] };
    let jets = run(|jet, speed| Impinging { speed, ..jet }, speeds, [1_500.0, 5_000.0], settings)?;
    let mut report = Report::default();
    for (what, of) in [("normal stress", (|spot| spot.normal) as fn(&Spot) -> f64), ("shear", |spot| spot.shear)] {
        let means: Vec<Estimate> = jets.iter().map(|jet| on_footprint(jet, of)).collect();
        let (first, rest) = means.split_first().expect("there are speeds");
        let farthest =
            rest.iter().map(|mean| difference(*mean, *first)).max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        let farthest = farthest.unwrap_or_default();
        report.decide(
            format!("Mean normalised {what} on the footprint differs between speeds by less than {INDEPENDENT}"),
            format!("{first} at {} m/s; the largest difference to that is {farthest}", speeds[0]),
            Estimate { value: INDEPENDENT - farthest.value.abs(), error: farthest.error },
        );
        let base = jets[0].profile(of);
        let squares =
            jets[1..].iter().flat_map(|jet| jet.profile(of).into_iter().zip(&base)).filter(|((x, _), _)| x.abs() < 1.0);
        let deviations: Vec<f64> =
            squares.map(|((_, a), (_, b))| a.deviation(*b)).filter(|deviation| deviation.is_finite()).collect();
        let square = deviations.iter().map(|deviation| deviation.powi(2)).sum::<f64>() / deviations.len() as f64;
        report.measured(
            format!("Profiles of {what} at |x| < L, against the slowest, with other seeds"),
            format!("root mean square of {} deviations: {:.2} standard errors", deviations.len(), square.sqrt()),
        );
    }
    // With the same seed nothing but the unit of time changes.
    let twins: Vec<Impinging> =
        [20.0, 40.0].map(|speed| Impinging { speed, duration: 300.0, ..Impinging::slot() }).to_vec();
    let same = Settings { quick: settings.quick, seed: settings.seed, watch: settings.watch };
    let twins: Vec<f64> = twins
        .iter()
        .map(|&twin| {
            Ok(run_copies(&[twin], 1, &same)?[0]
                .derived(|spots| mean(spots, |spot| spot.x.abs() < 1.0, |spot| spot.normal))
                .value)
        })
        .collect::<Result<_, Error>>()?;
    report.put_to_the_test(
        "With the same seed, a jet that is twice as fast has the same normalised stress to 12 digits",
        format!("{:.15} and {:.15}", twins[0], twins[1]),
        (twins[0] / twins[1] - 1.0).abs() < 1e-12,
    );
    show(&mut report, &jets, "speed", speeds, "m/s");
    Ok(report)
}

fn compute_10(settings: &Settings<'_>) -> Result<Report, Error> {
    let fractions: &[f64] =
        if settings.quick { &[0.15, 0.1, 0.05, 0.02] } else { &[0.15, 0.1, 0.07, 0.05, 0.02, 0.01] };
    // As many grains at each: dilute jets are measured for longer.
    let at = |jet: Impinging, fraction: f64| Impinging {
        fraction,
        duration: jet.duration * (0.1 / fraction).powi(2).clamp(0.5, 20.0),
        ..jet
    };
    let jets = run(at, fractions, [800.0, 4_000.0], settings)?;
    let mut report = Report::default();
    let over = |of: &dyn Fn(&Measured) -> Estimate| -> Vec<(f64, Estimate)> {
        jets.iter().map(|jet| (jet.jet.fraction, of(jet))).collect()
    };
    report.claim_trend(
        "Normalised normal stress rises as the volume fraction falls (mean on the footprint)",
        &over(&|jet| on_footprint(jet, |spot| spot.normal)),
        Trend::Rises,
    );
    report.claim_trend(
        "Normalised shear rises as the volume fraction falls (mean on the footprint)",
        &over(&|jet| on_footprint(jet, |spot| spot.shear)),
        Trend::Rises,
    );
    report.claim_trend(
        "Normal stress flattens: its distance from a square wave falls (sum of |N - wave| over that of the wave)",
        &over(&|jet| {
            let half = jet.jet.half_footprint();
            jet.derived(|spots| {
                // A patch that the edge divides has its part of the wave.
                let wave = |spot: &Spot| ((half - spot.x.abs()) * f64::from(PER_WIDTH) + 0.5).clamp(0.0, 1.0);
                let off: f64 = spots.iter().map(|spot| (spot.normal - wave(spot)).abs()).sum();
                off / spots.iter().map(wave).sum::<f64>()
            })
        }),
        Trend::Falls,
    );
    let half = |jet: &Measured| jet.jet.half_footprint();
    let peaks = over(&|jet| {
        let half = half(jet);
        jet.derived(|spots| {
            peak(spots, |spot| spot.normal) / mean(spots, |spot| spot.x.abs() < half, |spot| spot.normal)
        })
    });
    let (highest, lowest) = (peaks[0].1, peaks[peaks.len() - 1].1);
    // In between it need not fall all the way, and does not: the numbers tell.
    report.decide(
        "Normal stress is peaked at the highest fraction and flatter at the lowest (peak over half a width, relative to the mean on the footprint)",
        listed(&peaks),
        difference(highest, lowest),
    );
    let edges = over(&|jet| {
        let half = half(jet);
        jet.derived(|spots| {
            let of = |low: f64, high: f64| {
                mean(spots, |spot| (low * half..high * half).contains(&spot.x.abs()), |spot| spot.normal)
            };
            of(0.5, 0.9) / of(0.0, 0.5)
        })
    });
    report.measured("Normal stress on the outer parts of the footprint over that on its middle half", listed(&edges));
    show(&mut report, &jets, "area fraction", fractions, "");
    Ok(report)
}

fn compute_11(settings: &Settings<'_>) -> Result<Report, Error> {
    let restitutions: &[f64] = if settings.quick { &[0.1, 0.5, 0.9] } else { &[0.1, 0.3, 0.5, 0.7, 0.9] };
    let jets = run(|jet, restitution| Impinging { restitution, ..jet }, restitutions, [1_200.0, 5_000.0], settings)?;
    let mut report = Report::default();
    for (what, of) in [("normal stress", (|spot| spot.normal) as fn(&Spot) -> f64), ("shear", |spot| spot.shear)] {
        let points: Vec<(f64, Estimate)> =
            jets.iter().map(|jet| (jet.jet.restitution, on_footprint(jet, of))).collect();
        report.claim_trend(
            format!("Normalised {what} falls with the restitution of the surface (mean on the footprint)"),
            &points,
            Trend::Falls,
        );
    }
    show(&mut report, &jets, "restitution", restitutions, "");
    Ok(report)
}

/// Tables and pictures of profiles over a parameter.
fn show(report: &mut Report, jets: &[Measured], parameter: &str, values: &[f64], unit: &str) {
    let mut table =
        Table::new("stress", &["parameter", "value", "x", "normal", "normal_error", "shear", "shear_error"]);
    for (jet, value) in jets.iter().zip(values) {
        for ((x, normal), (_, shear)) in jet.profile(|spot| spot.normal).into_iter().zip(jet.profile(|spot| spot.shear))
        {
            table.row(&[&parameter, value, &x, &normal.value, &normal.error, &shear.value, &shear.error]);
        }
    }
    report.tables.push(table);
    for (name, title, of, top) in [
        ("normal", "Normal stress", (|spot| spot.normal) as fn(&Spot) -> f64, 1.2),
        ("shear", "Shear stress", |spot| spot.shear, 1.0),
    ] {
        let line = |(colour, (jet, value)): (usize, (&Measured, &f64))| {
            Line::measured(format!("{parameter} {value} {unit}"), colour, jet.profile(of))
        };
        report.pictures.push(Picture::Chart(Chart {
            name,
            title: format!("{title} over the {parameter}"),
            shows: "30 degrees, six diameters wide, otherwise area fraction 0.1, restitution 0.3; the jet flows to the left".into(),
            x: Axis::linear("x / L", -1.5, 1.2),
            y: Axis::linear("stress over that of the non-interacting jet", if name == "shear" { -0.1 } else { 0.0 }, top),
            lines: jets.iter().zip(values).enumerate().map(line).collect(),
        }));
    }
}
