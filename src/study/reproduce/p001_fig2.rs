//! Paper 001, figure 2: sheets of fine grains, fireworks of coarse ones; and whether elastic grains make a sheet.
//!
//! Packed planar jets (`target_jet`), as the simulations of the paper are planar, and round ones in space, as the experiment is. Friction 0.2 where
//! nothing else is said. The paper asks whether elastic, frictionless grains form a sheet; Ellowitz et al. (2013) find the opening angle insensitive to
//! dissipation. Both are looked at.

use super::target_jet::{DIAMETER, Spray, Stream, TargetJet, is_above, note_set_up, rise, rises, run_sprays};
use super::trend::all;
use super::{Error, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "001-fig2",
    title: "Figure 2: the half-mass angle over the size of the grains and restitution",
    source: "Huang, Chan & Zamankhan (2010), section III and V, fig. 2; Cheng et al. (2007)",
    statement: "tan(theta_half) grows with d / D_jet: fine grains leave as a sheet, coarse ones as fireworks. Restitution affects it. Grains that are elastic \
                and frictionless form no sheet.",
    compute,
};

/// Size of the target over the width of the jet, as in the experiment: 2.5 cm over 0.73 cm.
const TARGET: f64 = 3.42;
/// Grains across the jet; the paper has 3.65 to 29.
const ACROSS: [f64; 5] = [12.0, 9.0, 7.0, 5.5, 4.0];
const QUICK_ACROSS: [f64; 3] = [9.0, 6.0, 4.0];
const ROUND_ACROSS: [f64; 3] = [9.0, 6.0, 4.0];
const QUICK_ROUND_ACROSS: [f64; 2] = [6.0, 3.5];
/// Copies of each.
const COPIES: u64 = 6;
const QUICK_COPIES: u64 = 5;
/// Fireworks scatter at least as many times as wide as sheets.
const FIREWORKS: f64 = 1.5;
/// Elastic grains that scatter as many times as wide as those of restitution 0.8 form no such sheet.
const NO_SHEET: f64 = 2.0;

/// What is run: name, stream, restitution, friction.
const SERIES: [(&str, Stream, f64, f64); 5] = [
    ("restitution 0.8", Stream::Packed, 0.8, 0.2),
    ("restitution 0.7", Stream::Packed, 0.7, 0.2),
    ("restitution 0.9", Stream::Packed, 0.9, 0.2),
    ("elastic, frictionless", Stream::Packed, 1.0, 0.0),
    ("round jet, restitution 0.8", Stream::Round, 0.8, 0.2),
];

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (planar, round, copies) = match settings.quick {
        true => (&QUICK_ACROSS[..], &QUICK_ROUND_ACROSS[..], QUICK_COPIES),
        false => (&ACROSS[..], &ROUND_ACROSS[..], COPIES),
    };
    let of = |series: usize| if SERIES[series].1 == Stream::Round { round } else { planar };
    let jets: Vec<TargetJet> = (0..SERIES.len())
        .flat_map(|series| {
            let (_, stream, restitution, friction) = SERIES[series];
            of(series).iter().map(move |&across| TargetJet {
                stream,
                restitution,
                friction,
                ..TargetJet::of(across, TARGET)
            })
        })
        .collect();
    let sprays = run_sprays(&jets, copies, settings)?;
    let mut rest = &sprays[..];
    let series: [&[Spray]; 5] = std::array::from_fn(|number| {
        let (these, others) = rest.split_at(of(number).len());
        rest = others;
        these
    });
    let mut report = Report::default();
    note_set_up(&mut report, &jets[0], copies);
    let [reference, softer, harder, elastic, round] = series;
    grain_size("A planar jet", reference, &mut report);
    grain_size("A round jet in space", round, &mut report);
    restitution(softer, harder, &mut report);
    no_sheet(reference, elastic, &mut report);
    report.tables.push(table(&sprays));
    report.pictures.push(Picture::Chart(chart(&series)));
    Ok(report)
}

fn told(sprays: &[Spray]) -> String {
    let told: Vec<String> =
        sprays.iter().map(|spray| format!("{} at {:.3}", spray.half_mass_angle(), finesse(spray))).collect();
    format!("theta_half in degrees at d / D_jet: {}", told.join(", "))
}

/// d / D_jet.
fn finesse(spray: &Spray) -> f64 {
    DIAMETER / spray.jet.width()
}

/// How many times as wide.
fn times(wide: Estimate, narrow: Estimate) -> Estimate {
    let ratio = wide.value / narrow.value;
    Estimate { value: ratio, error: ratio * (wide.error / wide.value).hypot(narrow.error / narrow.value) }
}

fn grain_size(name: &str, sprays: &[Spray], report: &mut Report) {
    let angles: Vec<Estimate> = sprays.iter().map(Spray::half_mass_angle).collect();
    report.judge(
        format!("{name} of restitution 0.8: the half-mass angle grows with the size of the grains"),
        told(sprays),
        rises(&angles),
    );
    let (Some(&finest), Some(&coarsest)) = (angles.first(), angles.last()) else { return };
    let ratio = times(coarsest, finest);
    report.judge(
        format!("{name}: a sheet of fine grains, fireworks of coarse ones, {FIREWORKS} times as wide at least"),
        format!("{ratio} times as wide: {finest} and {coarsest} degrees"),
        is_above(ratio, FIREWORKS),
    );
}

fn restitution(softer: &[Spray], harder: &[Spray], report: &mut Report) {
    let pairs: Vec<(f64, Estimate)> = softer
        .iter()
        .zip(harder)
        .map(|(low, high)| (finesse(low), rise(low.half_mass_angle(), high.half_mass_angle())))
        .collect();
    let told: Vec<String> = pairs.iter().map(|(at, rise)| format!("{rise} at {at:.3}")).collect();
    // It matters if it does so at one size at least.
    let matters =
        pairs.iter().any(|(_, rise)| is_above(Estimate { value: rise.value.abs(), ..*rise }, 0.0) == Some(true));
    report.judge(
        "The half-mass angle depends on restitution",
        format!("from restitution 0.7 to 0.9 it rises by so many degrees at d / D_jet: {}", told.join(", ")),
        matters.then_some(true),
    );
}

/// PHYSICS 1.17.
fn no_sheet(reference: &[Spray], elastic: &[Spray], report: &mut Report) {
    let ratios: Vec<Estimate> = reference
        .iter()
        .zip(elastic)
        .map(|(lossy, elastic)| times(elastic.half_mass_angle(), lossy.half_mass_angle()))
        .collect();
    let least = |ratio: &&Estimate| ratio.value;
    let Some(worst) = ratios.iter().min_by(|a, b| least(a).total_cmp(&least(b))) else { return };
    let (Some(finest), Some(lossy)) = (elastic.first(), reference.first()) else { return };
    report.judge(format!(
            "Elastic and frictionless grains form no sheet: they scatter {NO_SHEET} times as wide as those of restitution 0.8 at least"
        ),
        format!(
            "{worst} times as wide where that is least; elastic {}; with restitution 0.8 {}. It is a fan about {} degrees",
            told(elastic),
            told(reference),
            finest.opening_angle()
        ),
        all(ratios.iter().map(|ratio| is_above(*ratio, NO_SHEET))),
    );
    let turned = rise(lossy.opening_angle(), finest.opening_angle());
    report.measured(
        "What elastic grains change in the opening angle of the finest jet (Ellowitz et al. 2013: next to nothing)",
        format!("{turned} degrees, from {} to {}", lossy.opening_angle(), finest.opening_angle()),
    );
}

fn table(sprays: &[Spray]) -> Table {
    let mut table = Table::new(
        "half_mass",
        &[
            "stream",
            "restitution",
            "friction",
            "grain_over_jet",
            "copies",
            "half_mass_angle",
            "half_mass_angle_error",
            "tan_half_mass_angle",
            "opening_angle",
            "opening_angle_error",
            "speed_across",
            "speed_across_error",
        ],
    );
    for spray in sprays {
        let [half, opening] = [spray.half_mass_angle(), spray.opening_angle()];
        let across = spray.mean(|ejected| ejected.across);
        table.row(&[
            &format!("{:?}", spray.jet.stream).to_lowercase(),
            &spray.jet.restitution,
            &spray.jet.friction,
            &finesse(spray),
            &spray.copies.len(),
            &half.value,
            &half.error,
            &half.value.to_radians().tan(),
            &opening.value,
            &opening.error,
            &across.value,
            &across.error,
        ]);
    }
    table
}

fn chart(series: &[&[Spray]; 5]) -> Chart {
    let tangent = |of: Estimate| {
        let angle = of.value.to_radians();
        Estimate { value: angle.tan(), error: of.error.to_radians() / angle.cos().powi(2) }
    };
    let points =
        |sprays: &[Spray]| sprays.iter().map(|spray| (finesse(spray), tangent(spray.half_mass_angle()))).collect();
    let lines = SERIES.iter().zip(series).enumerate();
    Chart {
        name: "half_mass_angle",
        title: "Half-mass angle over the size of the grains".into(),
        shows: format!("Target of {TARGET} jet widths; Huang, Chan & Zamankhan (2010), fig. 2(e)"),
        x: Axis::linear("d / width of the jet", 0.0, 0.32),
        y: Axis::linear("tan(theta_half)", 0.0, 0.8),
        lines: lines.map(|(colour, ((name, ..), sprays))| Line::measured(*name, colour, points(sprays))).collect(),
    }
}
