//! Paper 000, figure 7: stress over the strength of the near field.

use super::impinging::{Force, Impinging, Measured, Spot, loaded_width, peak, run_copies};
use super::trend::{Trend, listed};
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "000-fig7",
    title: "Figure 7: stress on the surface over the strength of the near field",
    source: "Arbelaez, Zohdi & Dornfeld (2009), section 7, fig. 7",
    statement: "A stronger near field that spreads the jet lowers the peak stress and widens the loaded region; one that makes it agglomerate narrows it. \
                (The ratio of the coefficients and the size of grains are not told in a way that fixes which of the two the printed numbers are, so both are run.)",
    compute,
};

/// Energy of repulsion at the mean distance over kinetic energy, without and with a near field.
const STRENGTHS: [f64; 6] = [0.0, 0.002, 0.005, 0.01, 0.03, 0.06];
const QUICK_STRENGTHS: [f64; 4] = [0.0, 0.005, 0.01, 0.03];
const ATTRACTING: [f64; 4] = [0.0, 0.002, 0.005, 0.01];
const QUICK_ATTRACTING: [f64; 3] = [0.0, 0.005, 0.01];
/// Distances of equilibrium in mean distances of the grains: far outside, all that are near repel; inside, they attract.
const REPELLING_AT: f64 = 8.0;
const ATTRACTING_AT: f64 = 0.5;
/// The loaded region is what bears this part of the normal stress.
const LOADED: f64 = 0.8;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (repelling, attracting, duration, copies) = if settings.quick {
        (&QUICK_STRENGTHS[..], &QUICK_ATTRACTING[..], 400.0, 2)
    } else {
        (&STRENGTHS[..], &ATTRACTING[..], 1_500.0, 4)
    };
    let series = |strengths: &[f64], equilibrium: f64| -> Vec<Impinging> {
        let force = |&strength: &f64| (strength > 0.0).then_some(Force { strength, equilibrium });
        strengths.iter().map(|strength| Impinging { force: force(strength), duration, ..Impinging::slot() }).collect()
    };
    let jets: Vec<Impinging> = [series(attracting, ATTRACTING_AT), series(repelling, REPELLING_AT)].concat();
    let mut attracted = run_copies(&jets, copies, settings)?;
    let repelled = attracted.split_off(attracting.len());
    let mut report = Report::default();
    let over = |jets: &[Measured], of: &dyn Fn(&[Spot]) -> f64| -> Vec<(f64, Estimate)> {
        jets.iter().map(|jet| (strength(jet), jet.derived(of))).collect()
    };
    let (normal, shear) =
        (|spots: &[Spot]| peak(spots, |spot| spot.normal), |spots: &[Spot]| peak(spots, |spot| spot.shear));
    let width = |spots: &[Spot]| loaded_width(spots, LOADED);
    report.claim_trend(
        "Repelling grains: the peak of the normal stress falls with the strength",
        &over(&repelled, &normal),
        Trend::Falls,
    );
    report.claim_trend(
        "Repelling grains: the peak of the shear falls with the strength",
        &over(&repelled, &shear),
        Trend::Falls,
    );
    report.claim_trend(
        format!(
            "Repelling grains: the region that bears {:.0} % of the normal stress widens (widths L)",
            100.0 * LOADED
        ),
        &over(&repelled, &width),
        Trend::Rises,
    );
    report.claim_trend(
        format!(
            "Attracting grains: the region that bears {:.0} % of the normal stress narrows (widths L)",
            100.0 * LOADED
        ),
        &over(&attracted, &width),
        Trend::Falls,
    );
    report.measured("Attracting grains: peak of the normal stress", listed(&over(&attracted, &normal)));
    let mut table =
        Table::new("stress", &["near_field", "strength", "x", "normal", "normal_error", "shear", "shear_error"]);
    for (name, jets) in [("repelling", &repelled), ("attracting", &attracted)] {
        for jet in jets {
            for ((x, normal), (_, shear)) in
                jet.profile(|spot| spot.normal).into_iter().zip(jet.profile(|spot| spot.shear))
            {
                table.row(&[&name, &strength(jet), &x, &normal.value, &normal.error, &shear.value, &shear.error]);
            }
        }
        for (part, of) in [("normal", (|spot| spot.normal) as fn(&Spot) -> f64), ("shear", |spot| spot.shear)] {
            report.pictures.push(Picture::Chart(chart(name, part, jets, of)));
        }
    }
    report.tables.push(table);
    Ok(report)
}

fn strength(jet: &Measured) -> f64 {
    jet.jet.force.map_or(0.0, |force| force.strength)
}

fn chart(near_field: &str, part: &str, jets: &[Measured], of: fn(&Spot) -> f64) -> Chart {
    let name = match (near_field, part) {
        ("repelling", "normal") => "repelling_normal",
        ("repelling", _) => "repelling_shear",
        (_, "normal") => "attracting_normal",
        _ => "attracting_shear",
    };
    let line = |(colour, jet): (usize, &Measured)| {
        Line::measured(format!("strength {}", strength(jet)), colour, jet.profile(of))
    };
    let equilibrium = if near_field == "repelling" { REPELLING_AT } else { ATTRACTING_AT };
    Chart {
        name,
        title: format!("{} stress of {near_field} grains", if part == "normal" { "Normal" } else { "Shear" }),
        shows: format!(
            "Equilibrium at {equilibrium} mean distances; strength: energy of repulsion at the mean distance over kinetic energy"
        ),
        x: Axis::linear("x / L", -2.0, 1.5),
        y: Axis::linear("stress over that of the non-interacting jet", if part == "normal" { 0.0 } else { -0.2 }, 1.2),
        lines: jets.iter().enumerate().map(line).collect(),
    }
}
