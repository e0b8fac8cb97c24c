//! Paper 000, figures 17 to 21: what flows out, over the strength of the near field and the roughness of the surface.

use super::impinging::{Force, Impinging, Measured, run_copies};
use super::trend::{Trend, listed};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::observe::measure::{ProfileMoments, Quantity};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const FIGURE_17: Study = Study {
    name: "000-fig17",
    title: "Figures 17 and 18: outflow of momentum over the strength of the near field",
    source: "Arbelaez, Zohdi & Dornfeld (2009), sections 9 and 10, fig. 17, 18",
    statement: "The resultant of the momentum that leaves is nearly insensitive to the near field. Its centroid and spread rise at first and level off; its skewness falls, levels off, and stays \
                positive.",
    compute: compute_17,
};

pub(super) const FIGURE_19: Study = Study {
    name: "000-fig19",
    title: "Figures 19 to 21: outflow of momentum over the asperities of a sine surface",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 10, fig. 19 to 21",
    statement: "With more asperities and with higher ones the resultant of the momentum that leaves falls and levels off, centroid and spread rise, and the skewness falls. With more \
                asperities it changes sign, between 10 and 12 of them a jet's width; with higher ones spread and skewness level off.",
    compute: compute_19,
};

/// A resultant that changes by less than this part of itself is called nearly insensitive.
const INSENSITIVE: f64 = 0.1;
/// Distance of equilibrium in mean distances of the grains: all that are near repel, as where figure 7 tells of a jet that spreads.
const EQUILIBRIUM: f64 = 8.0;
/// Energy of repulsion at the mean distance over kinetic energy: up to where the centroid has levelled off. (Stronger fields blow the jet apart before it reaches the surface.)
const STRENGTHS: [f64; 8] = [0.0, 0.0002, 0.0005, 0.001, 0.002, 0.004, 0.007, 0.01];
const QUICK_STRENGTHS: [f64; 5] = [0.0, 0.0005, 0.002, 0.005, 0.01];

/// Asperities per width, at an amplitude of a fiftieth of the width; and amplitudes, at four asperities a width. (The paper does not tell what is fixed.)
const NUMBERS: [f64; 7] = [0.0, 1.0, 2.0, 4.0, 6.0, 10.0, 14.0];
const QUICK_NUMBERS: [f64; 4] = [0.0, 2.0, 4.0, 14.0];
const AMPLITUDE: f64 = 0.02;
const AMPLITUDES: [f64; 7] = [0.0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.08];
const QUICK_AMPLITUDES: [f64; 4] = [0.0, 0.01, 0.03, 0.06];
const NUMBER: f64 = 4.0;

fn compute_17(settings: &Settings<'_>) -> Result<Report, Error> {
    let (strengths, duration, copies) =
        if settings.quick { (&QUICK_STRENGTHS[..], 600.0, 2) } else { (&STRENGTHS[..], 1_500.0, 4) };
    let jet = |&strength: &f64| {
        let force = (strength > 0.0).then_some(Force { strength, equilibrium: EQUILIBRIUM });
        Impinging { force, duration, ..Impinging::slot() }
    };
    let jets = run_copies(&strengths.iter().map(jet).collect::<Vec<_>>(), copies, settings)?;
    let moments = over(&jets, |jet| jet.jet.force.map_or(0.0, |force| force.strength));
    let mut report = Report::default();
    insensitive(&moments.resultant, &mut report);
    let shares: Vec<String> = jets
        .iter()
        .zip(&moments.resultant)
        .map(|(jet, (strength, _))| {
            let [(downstream, ..), (elsewhere, ..)] = jet.outflow.totals();
            format!("{:.1} % at {strength}", 100.0 * downstream / (downstream + elsewhere))
        })
        .collect();
    report.measured("Part of the mass that leaves on the side where the resultant is taken", shares.join(", "));
    for (what, points, trend) in [
        ("centroid", &moments.centroid, Trend::Rises),
        ("spread", &moments.spread, Trend::Rises),
        ("skewness", &moments.skewness, Trend::Falls),
    ] {
        let does = if trend == Trend::Rises { "rises" } else { "falls" };
        report.claim_trend(format!("The {what} {does} with the strength"), points, trend);
        report.claim_levelling(format!("The {what} levels off"), points);
    }
    let least =
        moments.skewness.iter().map(|point| point.1).min_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or_default();
    report.decide("The skewness stays positive", format!("{least} at the least"), least);
    report.tables.push(table("strength", &moments));
    report
        .pictures
        .push(profile(&jets, |jet| format!("strength {}", jet.jet.force.map_or(0.0, |force| force.strength))));
    report.pictures.extend(charts("strength", "energy of repulsion at the mean distance / kinetic energy", &moments));
    Ok(report)
}

fn insensitive(resultant: &[(f64, Estimate)], report: &mut Report) {
    let (first, rest) = (resultant[0].1, &resultant[1..]);
    let change = |point: &(f64, Estimate)| Estimate {
        value: point.1.value / first.value - 1.0,
        error: point.1.error.hypot(first.error * point.1.value / first.value) / first.value,
    };
    let most = rest.iter().map(change).max_by(|a, b| a.value.abs().total_cmp(&b.value.abs())).unwrap_or_default();
    report.decide(
        format!(
            "The resultant is nearly insensitive to the near field: it changes by less than {:.0} %",
            100.0 * INSENSITIVE
        ),
        format!("by {} % at the most", most * 100.0),
        Estimate { value: INSENSITIVE - most.value.abs(), error: most.error },
    );
}

fn compute_19(settings: &Settings<'_>) -> Result<Report, Error> {
    let (numbers, amplitudes, duration, copies) = if settings.quick {
        (&QUICK_NUMBERS[..], &QUICK_AMPLITUDES[..], 400.0, 1)
    } else {
        (&NUMBERS[..], &AMPLITUDES[..], 600.0, 2)
    };
    // Twice as wide as elsewhere at half the area fraction: so a grain meets as many others on its way, but fits between asperities.
    let base = Impinging { width: 12.0, fraction: 0.05, distance: 1.5, reach: 2.0, duration, ..Impinging::slot() };
    let rough = |number: f64, amplitude: f64| Impinging { asperities: [number, amplitude], ..base };
    let mut jets: Vec<Impinging> = numbers.iter().rev().map(|&number| rough(number, AMPLITUDE)).collect();
    jets.extend(amplitudes.iter().rev().map(|&amplitude| rough(NUMBER, amplitude)));
    let mut by_number = run_copies(&jets, copies, settings)?;
    let mut by_amplitude = by_number.split_off(numbers.len());
    by_number.reverse();
    by_amplitude.reverse();
    let mut report = Report::default();
    let number = over(&by_number, |jet| jet.jet.asperities[0]);
    let amplitude = over(&by_amplitude, |jet| jet.jet.asperities[1]);
    for (with, moments) in [("With more asperities", &number), ("With higher asperities", &amplitude)] {
        report.claim_trend(format!("{with} the resultant falls"), &moments.resultant, Trend::Falls);
        report.claim_levelling(format!("{with} the resultant levels off"), &moments.resultant);
        report.claim_trend(format!("{with} the centroid rises"), &moments.centroid, Trend::Rises);
        report.claim_trend(format!("{with} the spread rises"), &moments.spread, Trend::Rises);
        report.claim_trend(format!("{with} the skewness falls"), &moments.skewness, Trend::Falls);
    }
    report.claim_levelling("With higher asperities the spread levels off", &amplitude.spread);
    report.claim_levelling("With higher asperities the skewness levels off", &amplitude.skewness);
    let Some((most, last)) = number.skewness.last().copied() else { return Ok(report) };
    report.decide(
        "With more than 12 asperities a width the skewness is negative",
        format!(
            "{last} at {most}, where they are {:.1} diameters apart: {}",
            base.width / most,
            listed(&number.skewness)
        ),
        last * -1.0,
    );
    report.tables.push(table("asperities", &number));
    report.tables.push(table("amplitude", &amplitude));
    report.pictures.push(profile(&by_number, |jet| format!("{} asperities", jet.jet.asperities[0])));
    report.pictures.extend(charts("asperities", "asperities a width of the jet", &number));
    report.pictures.extend(charts("amplitude", "amplitude / L", &amplitude));
    Ok(report)
}

/// Moments over a parameter.
struct Curves {
    resultant: Vec<(f64, Estimate)>,
    centroid: Vec<(f64, Estimate)>,
    spread: Vec<(f64, Estimate)>,
    skewness: Vec<(f64, Estimate)>,
}

fn over(jets: &[Measured], parameter: impl Fn(&Measured) -> f64) -> Curves {
    let moments: Vec<(f64, ProfileMoments<Estimate>)> =
        jets.iter().map(|jet| (parameter(jet), jet.outflow.moments(Quantity::Momentum))).collect();
    let brought = |jet: &Measured| jet.brought_in();
    let curve =
        |of: fn(&ProfileMoments<Estimate>) -> Estimate| moments.iter().map(|(x, moments)| (*x, of(moments))).collect();
    let resultant = jets.iter().zip(&moments).map(|(jet, (x, moments))| (*x, moments.resultant * brought(jet).recip()));
    Curves {
        resultant: resultant.collect(),
        centroid: curve(|moments| moments.centroid),
        spread: curve(|moments| moments.spread),
        skewness: curve(|moments| moments.skewness),
    }
}

fn table(parameter: &'static str, curves: &Curves) -> Table {
    let mut table = Table::new(
        parameter,
        &[
            "parameter",
            "resultant",
            "resultant_error",
            "centroid",
            "centroid_error",
            "spread",
            "spread_error",
            "skewness",
            "skewness_error",
        ],
    );
    for (index, (x, resultant)) in curves.resultant.iter().enumerate() {
        let [centroid, spread, skewness] =
            [&curves.centroid, &curves.spread, &curves.skewness].map(|curve| curve[index].1);
        table.row(&[
            x,
            &resultant.value,
            &resultant.error,
            &centroid.value,
            &centroid.error,
            &spread.value,
            &spread.error,
            &skewness.value,
            &skewness.error,
        ]);
    }
    table
}

/// Profiles over height, each over its resultant, as figure 17 shows it.
fn profile(jets: &[Measured], name: impl Fn(&Measured) -> String) -> Picture {
    let line = |(colour, jet): (usize, &Measured)| {
        let moments = jet.outflow.moments(Quantity::Momentum);
        let length = jet.length();
        let scale = length / moments.resultant.value;
        let profile = jet.outflow.profile(Quantity::Momentum).into_iter();
        Line::measured(name(jet), colour, profile.map(|(height, rate)| (height / length, rate * scale)).collect())
    };
    let mut lines: Vec<Line> = jets.iter().enumerate().map(line).collect();
    let most = lines.iter().flat_map(|line| line.points.iter().map(|(_, rate)| rate.value)).fold(0.0, f64::max);
    for (colour, jet) in jets.iter().enumerate().take(1) {
        let centroid = jet.outflow.moments(Quantity::Momentum).centroid.value;
        lines.push(Line::curve("centroid of the first", colour, Mark::Dashed, [(centroid, 0.0), (centroid, most)]));
    }
    Picture::Chart(Chart {
        name: "profile",
        title: "Momentum that leaves downstream, over height".into(),
        shows: "Rate of momentum per height, times L over the resultant".into(),
        x: Axis::linear("height / L", 0.0, 2.0),
        y: Axis::linear("normalised rate of momentum", 0.0, 1.1 * most),
        lines,
    })
}

fn charts(parameter: &'static str, label: &str, curves: &Curves) -> [Picture; 2] {
    let names = match parameter {
        "asperities" => ["resultant_over_asperities", "moments_over_asperities"],
        "amplitude" => ["resultant_over_amplitude", "moments_over_amplitude"],
        _ => ["resultant", "moments"],
    };
    let last = curves.resultant.last().map_or(1.0, |point| point.0);
    let top = |curves: &[&Vec<(f64, Estimate)>]| {
        1.1 * curves.iter().flat_map(|curve| curve.iter()).map(|(_, at)| at.value + at.error).fold(0.0, f64::max)
    };
    let low = curves.skewness.iter().map(|(_, at)| 1.1 * (at.value - at.error)).fold(0.0, f64::min);
    let chart = |name, title: &str, label_y: &str, range: [f64; 2], lines: Vec<Line>| {
        Picture::Chart(Chart {
            name,
            title: title.into(),
            shows: "Bars: standard errors by the jackknife over batches".into(),
            x: Axis::linear(label, -0.03 * last, 1.03 * last),
            y: Axis::linear(label_y, range[0], range[1]),
            lines,
        })
    };
    [
        chart(
            names[0],
            "Resultant of the momentum that leaves downstream",
            "resultant / momentum brought in along the surface",
            [0.0, top(&[&curves.resultant])],
            vec![Line::measured("resultant", 0, curves.resultant.clone())],
        ),
        chart(
            names[1],
            "Moments of the momentum that leaves downstream",
            "centroid, spread, skewness",
            [low, top(&[&curves.centroid, &curves.spread, &curves.skewness])],
            vec![
                Line::measured("centroid / L", 0, curves.centroid.clone()),
                Line::measured("spread / L", 1, curves.spread.clone()),
                Line::measured("skewness", 2, curves.skewness.clone()),
            ],
        ),
    ]
}
