//! Paper 002, figure 17: energy to the surface over the angle of the jet.

use super::answers::{all, falls, is_below, judge};
use super::arrivals::{Arrived, Bin, run_arrivals};
use super::{Error, Jet, Report, Settings, Study};
use crate::estimate::Estimate;
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "002-fig17",
    title: "Energy and normal energy to the surface over the angle of the jet",
    source: "Mukherjee & Zohdi (2015), section 4.2, fig. 17",
    statement: "The normal energy falls with the angle, as the wear of brittle coatings does (Nicholls et al.); with a mechanism that combines \
                normal and tangential energies, wear is greatest at some intermediate angle.",
    compute,
};

/// Angles between the jet and the normal, degrees (Table 1).
const ANGLES: [f64; 6] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0];
/// Restitution and friction; the paper says neither for this figure.
const CONTACT: (f64, f64) = (0.8, 0.4);
/// Grains and copies.
const FULL: [(u64, u64); 2] = [(2000, 8), (10_000, 3)];
const QUICK: [(u64, u64); 1] = [(2000, 8)];
/// End of the runs, s.
const UNTIL: f64 = 0.1;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let plan: &[(u64, u64)] = if settings.quick { &QUICK } else { &FULL };
    let (restitution, friction) = CONTACT;
    let jets = |&(grains, _): &(u64, u64)| {
        ANGLES.map(|angle| Jet { grains, restitution, friction, angle, until: UNTIL, ..Jet::reference() })
    };
    let all_jets: Vec<Jet> = plan.iter().rev().flat_map(jets).collect();
    let copies = |jet: &Jet| plan.iter().find(|(grains, _)| *grains == jet.grains).map_or(0, |plan| plan.1);
    let arrived = run_arrivals(&all_jets, copies, settings)?;
    let mut report = Report::default();
    for series in arrived.chunks_exact(ANGLES.len()).rev() {
        test(series, &mut report);
    }
    report.tables = vec![table(&arrived)];
    report.pictures = vec![Picture::Chart(chart(&arrived))];
    Ok(report)
}

fn all_of(bin: &Bin) -> f64 {
    bin.energy
}

fn normal_of(bin: &Bin) -> f64 {
    bin.normal
}

/// What is along the surface or in rotation.
fn other_of(bin: &Bin) -> f64 {
    bin.energy - bin.normal
}

/// Mean power over that of the same quantity `of` all energy at normal incidence, with errors of both.
fn over_normal_incidence(series: &[Arrived], of: fn(&Bin) -> f64) -> Vec<Estimate> {
    let base = series[0].regime(all_of);
    series
        .iter()
        .map(|at| {
            let power = at.regime(of);
            let value = power.value / base.value;
            Estimate { value, error: (power.error / base.value).hypot(value * base.error / base.value) }
        })
        .collect()
}

fn told(values: &[Estimate]) -> String {
    let told = values.iter().zip(ANGLES).map(|(value, angle)| format!("{value} at {angle}°"));
    told.collect::<Vec<_>>().join(", ")
}

fn test(series: &[Arrived], report: &mut Report) {
    let jet = &series[0].jet;
    let name = format!("{} grains, e = {}, mu = {}", jet.grains, jet.restitution, jet.friction);
    let of = |of: fn(&Bin) -> f64| series.iter().map(|at| at.regime(of)).collect::<Vec<_>>();
    let (normal, all_energy, along) = (of(normal_of), of(all_of), of(other_of));
    judge(
        report,
        format!("{name}: the normal energy falls with the angle"),
        format!("power over that of the jet, from 12 to 30 ms: {}", told(&normal)),
        falls(&normal),
    );
    judge(
        report,
        format!("{name}: normal and tangential energy together are greatest at an intermediate angle"),
        format!("{}; of it along the surface and in rotation {}", told(&all_energy), told(&along)),
        peak_inside(&all_energy),
    );
    let weights = (0..=200).map(|percent| f64::from(percent) / 100.0);
    let inside = weights.filter(|weight| {
        let sums: Vec<f64> = normal.iter().zip(&along).map(|(n, t)| n.value + weight * t.value).collect();
        let ends = sums[0].max(sums[sums.len() - 1]);
        sums.iter().any(|&sum| sum > ends)
    });
    let inside: Vec<f64> = inside.collect();
    report.measured(
        format!("{name}: weights w, from 0 to 2, for which normal energy plus w times the rest is greatest between 15 and 60°"),
        match inside.as_slice() {
            [] => "none".to_owned(),
            [only] => format!("{only}"),
            [first, .., last] => format!("from {first} to {last}"),
        },
    );
    let square = |angle: f64| angle.to_radians().cos().powi(2);
    let ratios: Vec<Estimate> = over_normal_incidence(series, normal_of);
    let relative = ratios.iter().zip(ANGLES).map(|(ratio, angle)| *ratio * square(angle).recip()).collect::<Vec<_>>();
    report.measured(
        format!(
            "{name}: normal energy over all energy at normal incidence, over cos² of the angle (1 for grains that never meet)"
        ),
        told(&relative),
    );
}

/// Whether a series has its greatest value inside, above both ends.
fn peak_inside(series: &[Estimate]) -> Option<bool> {
    let highest = series.iter().enumerate().max_by(|a, b| a.1.value.total_cmp(&b.1.value))?;
    let ends = [series[0], series[series.len() - 1]];
    if highest.0 == 0 || highest.0 == series.len() - 1 {
        // An end is the greatest: no if it is so beyond all errors.
        let others = series.iter().enumerate().filter(|(index, _)| *index != highest.0);
        return all(others.map(|(_, other)| is_below(*other, *highest.1))).map(|certain| !certain);
    }
    all(ends.map(|end| is_below(end, *highest.1)))
}

fn table(arrived: &[Arrived]) -> Table {
    let mut table = Table::new(
        "angle",
        &["grains", "angle", "copies", "energy", "energy_error", "normal", "normal_error", "carried", "carried_error"],
    );
    for at in arrived {
        let [energy, normal] = [at.regime(all_of), at.regime(normal_of)];
        let carried = at.mean(|copy| copy.energies.carried);
        table.row(&[
            &at.jet.grains,
            &at.jet.angle,
            &at.copies.len(),
            &energy.value,
            &energy.error,
            &normal.value,
            &normal.error,
            &carried.value,
            &carried.error,
        ]);
    }
    table
}

fn chart(arrived: &[Arrived]) -> Chart {
    let mut lines = Vec::new();
    for (colour, series) in arrived.chunks_exact(ANGLES.len()).enumerate() {
        let grains = series[0].jet.grains;
        for (mark, name, of) in [
            (Mark::Points, format!("{grains} grains"), all_of as fn(&Bin) -> f64),
            (Mark::OpenPoints, "  along the normal".to_owned(), normal_of),
        ] {
            let points = ANGLES.into_iter().zip(over_normal_incidence(series, of)).collect();
            lines.push(Line { name, points, mark, colour });
        }
    }
    let cosine = (0..=75).map(|angle| (f64::from(angle), f64::from(angle).to_radians().cos().powi(2)));
    lines.push(Line::curve("cos² of the angle", 0, Mark::Guide, cosine));
    let most = lines.iter().flat_map(|line| &line.points).map(|(_, at)| at.value + at.error).fold(1.0, f64::max);
    Chart {
        name: "angle",
        title: "Energy to the surface over the angle of the jet".into(),
        shows: format!(
            "Over that at normal incidence, e = {}, mu = {}; Mukherjee & Zohdi (2015), fig. 17",
            CONTACT.0, CONTACT.1
        ),
        x: Axis::linear("angle from the normal / °", 0.0, 80.0),
        y: Axis::linear("energy / energy at 0°", 0.0, (10.0 * most).ceil() / 10.0),
        lines,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_inside_at_an_end_or_unknown() {
        let series = |values: [f64; 4], error| values.map(|value| Estimate { value, error });
        assert_eq!(peak_inside(&series([1.0, 2.0, 3.0, 1.0], 0.1)), Some(true));
        assert_eq!(peak_inside(&series([1.0, 2.0, 3.0, 4.0], 0.1)), Some(false));
        assert_eq!(peak_inside(&series([1.0, 2.0, 3.0, 3.1], 0.1)), None);
        assert_eq!(peak_inside(&series([1.0, 2.0, 3.0, 2.9], 0.1)), None);
    }
}
