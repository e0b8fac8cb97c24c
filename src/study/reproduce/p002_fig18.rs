//! Paper 002, figure 18: does the energy that reaches the surface fall exponentially with the flux?

use super::jet::{Copies, run_copies};
use super::{Error, Jet, Report, Settings, Study};
use crate::estimate::{Estimate, Slope};
use crate::scene::Interference;
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

pub(super) const STUDY: Study = Study {
    name: "002-fig18",
    title: "Energy carried to the surface over the number of grains: is it exponential?",
    source: "Anand et al. (1987), in Mukherjee & Zohdi (2015), eq. (48), fig. 18",
    statement: "If grains that collide once are removed, the energy that reaches the surface falls as exp(-C Phi) with the flux Phi. With all \
                collisions it also does for a broad range of grain numbers, and deviates where there are many.",
    compute,
};

/// Numbers of grains; as the duration of the jet is fixed, each stands for a flux.
const GRAINS: [u64; 12] = [2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 4000, 8000];
const QUICK_GRAINS: [u64; 7] = [2, 5, 10, 20, 100, 500, 1000];
/// So many grains in all copies of a jet together, and the fewest and most copies.
const SAMPLE: [u64; 3] = [40_000, 4, 4000];
const QUICK_SAMPLE: [u64; 3] = [4_000, 4, 400];
/// Up to so many grains the exponential is fitted.
const FIT: u64 = 100;
/// An exponential may miss the energy by this part of it and still be called one.
const CLOSE: f64 = 0.02;
/// Estimates that are so many standard errors apart differ.
const DEVIATIONS: f64 = 3.0;

/// A model, what it is called, and the friction of its grains.
const MODELS: [(&str, Interference, f64); 3] = [
    ("all collisions, smooth", Interference::All, 0.0),
    ("all collisions, friction 0.4", Interference::All, 0.4),
    ("removed on first collision", Interference::RemovedOnFirstCollision, 0.0),
];

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let grains = if settings.quick { &QUICK_GRAINS[..] } else { &GRAINS };
    let [sample, fewest, most] = if settings.quick { QUICK_SAMPLE } else { SAMPLE };
    // The longest runs first.
    let jets: Vec<Jet> = grains
        .iter()
        .rev()
        .flat_map(|&grains| {
            MODELS.map(|(_, interference, friction)| Jet { grains, interference, friction, ..Jet::reference() })
        })
        .collect();
    let copies = run_copies(&jets, |jet| (sample / jet.grains).clamp(fewest, most), settings)?;
    let of_model = |model: usize| -> Vec<&Copies> { copies.iter().skip(model).step_by(MODELS.len()).rev().collect() };
    let mut report = Report::default();
    let [smooth, rough, removed] = [0, 1, 2].map(of_model);
    test_removal(&removed, &mut report);
    test_all(MODELS[0].0, &smooth, &mut report);
    test_all(MODELS[1].0, &rough, &mut report);
    report.tables.push(table(&copies));
    report.pictures.push(Picture::Chart(chart(&[smooth, rough, removed])));
    Ok(report)
}

fn carried(copies: &Copies) -> Estimate {
    copies.mean(|energies| energies.carried)
}

/// ln(E / E0) = -C N, fitted up to `most` grains.
fn fit(copies: &[&Copies], most: u64) -> Slope {
    let low = copies.iter().filter(|copies| copies.jet.grains <= most);
    Slope::through_origin(&low.map(|copies| (copies.jet.grains as f64, carried(copies).ln())).collect::<Vec<_>>())
}

/// How far E is from exp(slope N) where that is the farthest, relative to E.
fn misfit(copies: &[&Copies], slope: &Slope, most: u64) -> f64 {
    let miss =
        |copies: &&Copies| ((slope.slope.value * copies.jet.grains as f64).exp() / carried(copies).value - 1.0).abs();
    copies.iter().filter(|copies| copies.jet.grains <= most).map(miss).fold(0.0, f64::max)
}

/// The chance that two grains of the block lie less than a diameter apart across the jet: two random points of a square of side 1 less than
/// r apart, π r² - 8/3 r³ + r⁴/2.
fn chance_of_meeting(jet: &Jet) -> f64 {
    let r = jet.diameter() / jet.width;
    std::f64::consts::PI * r * r - 8.0 / 3.0 * r.powi(3) + 0.5 * r.powi(4)
}

/// Grains that rebound straight up remove all that come after them within a diameter: what hits is a random sequential addition of discs.
fn test_removal(removed: &[&Copies], report: &mut Report) {
    let [first, .., last] = removed else { return };
    let (measured, expected) = (carried(first), 1.0 - 0.5 * chance_of_meeting(&first.jet));
    report.put_to_the_test(
        format!("Grains removed on their first collision: of two grains, {expected:.5} of E0 arrive (half of their chance to meet is lost)"),
        format!("{measured}"),
        measured.deviation(Estimate::exact(expected)) < DEVIATIONS,
    );
    let low = fit(removed, FIT);
    let most = last.jet.grains;
    report.put_to_the_test(
        "Grains removed on their first collision: E / E0 = exp(-C N)",
        format!(
            "C = {} per grain up to {FIT} grains, but even there it misses E by up to {:.0} %. With {most} grains it gives {:.1e}, and {} of E0 \
             arrives: what has hit shields a disc for good, the number of hits rises to {} only, and E falls as 1 / N",
            low.slope * -1.0,
            100.0 * misfit(removed, &low, FIT),
            (low.slope.value * most as f64).exp(),
            carried(last),
            last.mean(|energies| energies.hit) * most as f64,
        ),
        misfit(removed, &low, FIT) < CLOSE,
    );
}

fn test_all(name: &str, copies: &[&Copies], report: &mut Report) {
    let low = fit(copies, FIT);
    report.put_to_the_test(
        format!("With {name}, few grains: exponential"),
        format!(
            "C = {} per grain up to {FIT} grains, where it misses E by up to {:.1} % (chi squared per degree of freedom {:.1})",
            low.slope * -1.0,
            100.0 * misfit(copies, &low, FIT),
            low.chi_squared
        ),
        misfit(copies, &low, FIT) < CLOSE,
    );
    let Some(least) = copies.iter().min_by(|a, b| carried(a).value.total_cmp(&carried(b).value)) else { return };
    let Some(last) = copies.last() else { return };
    let rises = carried(last).value > carried(least).value && carried(last).deviation(carried(least)) > DEVIATIONS;
    report.put_to_the_test(
        format!("With {name}, many grains: the energy deviates from the exponential"),
        format!(
            "the exponential of few grains misses E by up to {:.0} %; E / E0 falls to {} at {} grains and is {} at {}",
            100.0 * misfit(copies, &low, u64::MAX),
            carried(least),
            least.jet.grains,
            carried(last),
            last.jet.grains
        ),
        rises || misfit(copies, &low, u64::MAX) > CLOSE,
    );
}

fn table(copies: &[Copies]) -> Table {
    let mut table = Table::new(
        "carried",
        &["grains", "crowding", "interference", "friction", "copies", "carried", "carried_error", "hits", "hits_error"],
    );
    for at in copies.iter().rev() {
        let [carried, hit] = [carried(at), at.mean(|energies| energies.hit) * at.jet.grains as f64];
        table.row(&[
            &at.jet.grains,
            &at.jet.crowding(),
            &at.jet.model(),
            &at.jet.friction,
            &at.energies.len(),
            &carried.value,
            &carried.error,
            &hit.value,
            &hit.error,
        ]);
    }
    table
}

fn chart(models: &[Vec<&Copies>; 3]) -> Chart {
    let points = |copies: &[&Copies]| copies.iter().map(|at| (at.jet.grains as f64, carried(at))).collect();
    let mut lines: Vec<Line> = MODELS
        .iter()
        .zip(models)
        .enumerate()
        .map(|(colour, ((name, ..), copies))| Line::measured(*name, colour, points(copies)))
        .collect();
    for (colour, copies) in [(0, &models[0]), (2, &models[2])] {
        let slope = fit(copies, FIT).slope.value;
        let curve =
            (0..=200).map(|step| 2.0 * 4000.0_f64.powf(f64::from(step) / 200.0)).map(|n| (n, (slope * n).exp()));
        lines.push(Line::curve("  exponential fitted to few", colour, Mark::Dashed, curve));
    }
    Chart {
        name: "carried",
        title: "Energy carried to the surface by all hits, restitution 0.8".into(),
        shows: "The block of Mukherjee & Zohdi (2015), fig. 18, and the law of Anand et al. (1987)".into(),
        x: Axis::log("number of grains", 2.0, 8000.0),
        y: Axis::linear("energy / E0", 0.0, 1.1),
        lines,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::reproduce::ensemble::unwatched;

    /// Grains that collide are removed before restitution or friction can matter.
    #[test]
    fn removal_knows_no_restitution_and_no_friction() {
        let jet = Jet { grains: 300, interference: Interference::RemovedOnFirstCollision, ..Jet::reference() };
        let jets = [jet, Jet { restitution: 0.3, friction: 0.7, ..jet }];
        let copies = run_copies(&jets, |_| 4, &unwatched(true)).expect("they run");
        let hit = |copies: &Copies| copies.energies.iter().map(|energies| energies.hit).collect::<Vec<_>>();
        assert_eq!(hit(&copies[0]), hit(&copies[1]));
        // What comes first stays: discs in a square, which saturate at about 80.
        assert!(hit(&copies[0]).iter().all(|hit| (40.0..70.0).contains(&(hit * 300.0))), "{:?}", hit(&copies[0]));
    }
}
