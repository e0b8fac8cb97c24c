//! Paper 001, figures 1 and 6: how a jet opens on targets of different sizes.
//!
//! Planar jets (`target_jet`), as the simulations of the paper are planar; restitution 0.8, friction 0.2. The paper compares its targets of 3, 2 and 1 jet
//! widths with those of 2, 1.62 and 0.88 of the experiment; all are here.

use super::target_jet::{
    DEVIATIONS, DIAMETER, Fit, Spray, Stream, TargetJet, ideal_angle, is_above, note_set_up, rise, rises, run_sprays,
};
use super::trend::all;
use super::{Error, Report, Settings, Study};
use crate::estimate::{Estimate, Slope};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "001-fig1",
    title: "Figures 1 and 6: how wide a jet opens on targets of different sizes",
    source: "Huang, Chan & Zamankhan (2010), sections II to IV, eq. (9) and (12), fig. 1 and 6; Cheng et al. (2007)",
    statement: "The opening angle of the cone grows with the size of the target until it reaches 90 degrees, a sheet, near three widths of the jet; below, \
                linearly. The axial velocity of what leaves falls exponentially with the size of the target.",
    compute,
};

/// R* = D_tar / D_jet.
const TARGETS: [f64; 7] = [4.0, 3.0, 2.0, 1.62, 1.0, 0.88, 0.5];
const QUICK_TARGETS: [f64; 5] = [4.0, 3.0, 2.0, 1.0, 0.5];
/// Grains across the jet, and copies.
const SIZE: (f64, u64) = (12.0, 8);
const QUICK_SIZE: (f64, u64) = (9.0, 6);
/// So many times coarser are the grains from which, together with the others, the limit of fine grains is extrapolated.
const COARSER: f64 = 2.0;
/// An angle that misses 90 degrees by this part of it is near it.
const NEAR: f64 = 0.1;
/// Where the angle has reached 90 degrees the paper says it stays; the rise is judged up to there, jet widths.
const REACHED: f64 = 3.0;
/// An exponent that is as near to that of a power law is called by its name.
const EXPONENT: f64 = 0.15;
/// An exponential may miss what it is fitted to by this part and still be called one.
const CLOSE: f64 = 0.2;
/// A straight line over the targets on which the cone is open may miss the angle by so much (root mean square) and still be called one, degrees: it
/// misses the angle of an ideal jet by 1.6, and a square that reaches 60 degrees by 3.
const STRAIGHT: f64 = 2.0;
/// An angle as near to that of an ideal jet follows it, degrees. For grains of finite size a target is wider by about a grain than it is, which is worth
/// two degrees at 12 grains a width.
const IDEAL: f64 = 4.0;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let (targets, (across, copies)) =
        if settings.quick { (&QUICK_TARGETS[..], QUICK_SIZE) } else { (&TARGETS[..], SIZE) };
    let of = |stream: Stream, across: f64| {
        targets.iter().map(move |&target| TargetJet { stream, ..TargetJet::of(across, target) })
    };
    // The widest targets, which take longest, first.
    let jets: Vec<TargetJet> = of(Stream::Packed, across)
        .chain(of(Stream::Loose, across))
        .chain(of(Stream::Packed, across / COARSER))
        .collect();
    let sprays = run_sprays(&jets, copies, settings)?;
    let series = |number: usize| sprays[number * targets.len()..][..targets.len()].iter().rev().collect::<Vec<_>>();
    let [packed, loose, coarse] = [0, 1, 2].map(series);
    let mut report = Report::default();
    note_set_up(&mut report, &jets[0], copies);
    for (name, sprays) in [("packed", &packed), ("loose", &loose)] {
        opening(name, sprays, &mut report);
        velocity(name, sprays, &mut report);
    }
    fine(&packed, &coarse, &mut report);
    report.tables.push(table(&sprays));
    report.pictures.push(Picture::Chart(chart(&packed, &loose, &coarse)));
    Ok(report)
}

fn angles(sprays: &[&Spray]) -> Vec<(f64, Estimate)> {
    sprays.iter().map(|spray| (spray.jet.target, spray.opening_angle())).collect()
}

fn opening(name: &str, sprays: &[&Spray], report: &mut Report) {
    let angles = angles(sprays);
    let told: Vec<String> = angles.iter().map(|(target, angle)| format!("{angle} at {target}")).collect();
    let up_to: Vec<Estimate> = angles.iter().filter(|(at, _)| *at <= REACHED).map(|(_, angle)| *angle).collect();
    report.judge(
        format!("A {name} jet: the opening angle grows with the size of the target"),
        format!("degrees at D_tar / D_jet: {}", told.join(", ")),
        rises(&up_to),
    );
    let Some(&(target, at_three)) = angles.iter().find(|(target, _)| *target == REACHED) else { return };
    let short = rise(at_three, Estimate::exact(90.0));
    let near = is_above(short, 90.0 * NEAR).map(|above| !above);
    report.judge(
        format!("A {name} jet: the angle is near 90 degrees at {target} widths, within {:.0} % of it", 100.0 * NEAR),
        format!("{at_three} degrees; an ideal planar jet has {:.2}", ideal_angle(target)),
        near,
    );
    // A power law over the targets on which the cone is open.
    let logs: Vec<(f64, Estimate)> =
        angles.iter().filter(|(at, _)| *at <= 2.0).map(|(at, angle)| (at.ln(), angle.ln())).collect();
    let exponent = Fit::of(&logs).slope;
    let is = |power: f64| {
        all([is_above(exponent, power - EXPONENT), is_above(exponent, power + EXPONENT).map(|above| !above)])
    };
    let measured = format!(
        "up to 2 widths it grows as their power {exponent}; that of an ideal planar jet is {:.2}",
        (ideal_angle(2.0) / ideal_angle(0.5)).ln() / 4f64.ln()
    );
    let open: Vec<(f64, Estimate)> = angles.iter().copied().filter(|(at, _)| *at <= 2.0).collect();
    let line = Fit::of(&open.iter().map(|&(at, angle)| (at, Estimate { error: 1.0, ..angle })).collect::<Vec<_>>());
    let noise = open.iter().map(|(_, angle)| angle.error).fold(0.0, f64::max);
    report.put_to_the_test(
        format!("A {name} jet: below 90 degrees the angle is linear in the size, within {STRAIGHT} degrees"),
        format!(
            "up to 2 widths the line {:.1} + {:.1} D_tar / D_jet misses it by {:.1} degrees (root mean square; errors are up to {noise:.1})",
            line.intercept, line.slope.value, line.misfit
        ),
        line.misfit < STRAIGHT,
    );
    report.judge(format!("A {name} jet: it goes with the square of the size (section II)"), measured, is(2.0));
    as_ideal(&format!("A {name} jet"), &angles, report);
}

fn as_ideal(name: &str, angles: &[(f64, Estimate)], report: &mut Report) {
    let off = angles.iter().map(|&(at, angle)| (at, rise(Estimate::exact(ideal_angle(at)), angle)));
    let Some((at, off)) = off.max_by(|a, b| a.1.value.abs().total_cmp(&b.1.value.abs())) else { return };
    report.judge(
        format!(
            "{name} opens as an ideal planar jet does (Ellowitz et al. 2013: a perfect fluid), within {IDEAL} degrees"
        ),
        format!("the largest difference is {off} degrees, at {at}"),
        is_above(Estimate { value: off.value.abs(), ..off }, IDEAL).map(|above| !above),
    );
}

/// The angle of two jets, linear in d / D_jet, where that is 0.
fn extrapolated(fine: (f64, Estimate), coarse: (f64, Estimate)) -> Estimate {
    let [near, far] = [coarse.0, -fine.0].map(|part| part / (coarse.0 - fine.0));
    Estimate {
        value: near * fine.1.value + far * coarse.1.value,
        error: (near * fine.1.error).hypot(far * coarse.1.error),
    }
}

fn fine(fine: &[&Spray], coarse: &[&Spray], report: &mut Report) {
    let of = |spray: &Spray| (DIAMETER / spray.jet.width(), spray.opening_angle());
    let angles: Vec<(f64, Estimate)> =
        fine.iter().zip(coarse).map(|(fine, coarse)| (fine.jet.target, extrapolated(of(fine), of(coarse)))).collect();
    let told: Vec<String> = angles.iter().map(|(target, angle)| format!("{angle} at {target}")).collect();
    report.measured(
        "A packed jet of ever finer grains: opening angle, extrapolated linearly in d / D_jet from two widths",
        format!("degrees at D_tar / D_jet: {}", told.join(", ")),
    );
    as_ideal("A packed jet of ever finer grains", &angles, report);
}

/// Eq. (9), which follows from (6) to (8) in two dimensions only, and only if a target without end stops the jet, 2 sigma_0 R_jet / (C Q) = U_0, which the
/// paper does not say.
fn velocity(name: &str, sprays: &[&Spray], report: &mut Report) {
    let left = |spray: &Spray| spray.mean(|ejected| ejected.along) * super::target_jet::SPEED.recip();
    // Where next to nothing is left its logarithm is lost in the errors.
    let known: Vec<(f64, Estimate)> = sprays
        .iter()
        .map(|spray| (spray.jet.target, left(spray)))
        .filter(|(_, left)| left.value > DEVIATIONS * left.error)
        .collect();
    let slope = Slope::through_origin(&known.iter().map(|(at, left)| (*at, left.ln())).collect::<Vec<_>>()).slope;
    let miss = |(at, left): &(f64, Estimate)| {
        let ratio = *left * (slope.value * at).exp().recip();
        (*at, Estimate { value: (ratio.value - 1.0).abs(), ..ratio })
    };
    let Some((at, worst)) = known.iter().map(miss).max_by(|a, b| a.1.value.total_cmp(&b.1.value)) else { return };
    let told: Vec<String> = known.iter().map(|(at, left)| format!("{left} at {at}")).collect();
    report.judge(format!("A {name} jet: U_h / U_0 = exp(-C R_tar / R_jet), within {:.0} %", 100.0 * CLOSE),
        format!(
            "C = {}, which misses U_h / U_0 by up to {worst} of it, at {at}; U_h / U_0 is {}. Of an ideal planar jet it is cos psi, not exponential",
            slope * -1.0,
            told.join(", ")
        ),
        is_above(worst, CLOSE).map(|above| !above),
    );
}

fn table(sprays: &[Spray]) -> Table {
    let mut table = Table::new(
        "opening",
        &[
            "stream",
            "target_over_jet",
            "jet_over_grain",
            "copies",
            "opening_angle",
            "opening_angle_error",
            "ideal_angle",
            "median_angle",
            "median_angle_error",
            "half_mass_angle",
            "half_mass_angle_error",
            "velocity_along",
            "velocity_along_error",
            "speed_across",
            "speed_across_error",
        ],
    );
    for spray in sprays {
        let [opening, half] = [spray.opening_angle(), spray.half_mass_angle()];
        let median = spray.mean(|ejected| ejected.median_angle);
        let [along, across] = [spray.mean(|ejected| ejected.along), spray.mean(|ejected| ejected.across)];
        table.row(&[
            &format!("{:?}", spray.jet.stream).to_lowercase(),
            &spray.jet.target,
            &(spray.jet.width() / DIAMETER),
            &spray.copies.len(),
            &opening.value,
            &opening.error,
            &ideal_angle(spray.jet.target),
            &median.value,
            &median.error,
            &half.value,
            &half.error,
            &along.value,
            &along.error,
            &across.value,
            &across.error,
        ]);
    }
    table
}

fn chart(packed: &[&Spray], loose: &[&Spray], coarse: &[&Spray]) -> Chart {
    let ideal = (1..=90).map(|step| 0.05 * f64::from(step)).map(|target| (target, ideal_angle(target)));
    Chart {
        name: "opening_angle",
        title: "Opening angle over the size of the target".into(),
        shows: "Planar jets, restitution 0.8, friction 0.2; Huang, Chan & Zamankhan (2010), fig. 6".into(),
        x: Axis::linear("size of the target / width of the jet", 0.0, 4.5),
        y: Axis::linear("opening angle / degrees", 0.0, 100.0),
        lines: vec![
            Line::measured("packed, area fraction 0.8", 0, angles(packed)),
            Line { mark: Mark::OpenPoints, ..Line::measured("  grains twice as large", 0, angles(coarse)) },
            Line::measured("loose, area fraction 0.4", 1, angles(loose)),
            Line::curve("ideal planar jet", 2, Mark::Curve, ideal),
            Line::curve("a sheet", 5, Mark::Guide, [(0.0, 90.0), (4.5, 90.0)]),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::reproduce::Verdict;

    /// A spray that leaves at one angle.
    fn cone(target: f64, angle: f64) -> Spray {
        let jet = TargetJet::of(10.0, target);
        let ejected = |off: f64| {
            let mut ejected = jet.ejecta().ejected();
            ejected.opening_angle = Estimate::exact(angle + off);
            ejected.along = Estimate::exact(10.0 * (angle + off).to_radians().cos());
            ejected
        };
        Spray { jet, copies: vec![ejected(-0.05), ejected(0.05)] }
    }

    fn verdicts(of: fn(f64) -> f64) -> Vec<Verdict> {
        let sprays: Vec<Spray> = TARGETS.iter().rev().map(|&target| cone(target, of(target))).collect();
        let mut report = Report::default();
        opening("made-up", &sprays.iter().collect::<Vec<_>>(), &mut report);
        velocity("made-up", &sprays.iter().collect::<Vec<_>>(), &mut report);
        report.findings.iter().map(|finding| finding.verdict).collect()
    }

    #[test]
    fn each_law_is_known_by_its_cones() {
        use Verdict::{Agrees, Differs};
        assert_eq!(verdicts(ideal_angle), [Agrees, Agrees, Agrees, Differs, Agrees, Differs]);
        let square = |target: f64| (15.0 * target * target).min(90.0);
        assert_eq!(verdicts(square), [Agrees, Agrees, Differs, Agrees, Differs, Differs]);
        assert_eq!(verdicts(|target| (30.0 * target).min(90.0)), [Agrees, Agrees, Agrees, Differs, Differs, Differs]);
        let exponential = |target: f64| (-0.9 * target).exp().acos().to_degrees();
        assert_eq!(verdicts(exponential)[5], Agrees);
        assert_eq!(verdicts(|target| 60.0 - target)[..2], [Differs, Differs]);
        // 70 - 100 d / D_jet, from 1/12 and 1/6.
        let at = |finesse: f64| (finesse, Estimate { value: 70.0 - 100.0 * finesse, error: 1.0 });
        let limit = extrapolated(at(1.0 / 12.0), at(1.0 / 6.0));
        approx::assert_relative_eq!(limit.value, 70.0, max_relative = 1e-13);
        approx::assert_relative_eq!(limit.error, 5f64.sqrt(), max_relative = 1e-13);
    }
}
