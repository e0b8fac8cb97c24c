//! When may one use a first-order model? Jets with each of the four kinds of interference.

mod shown;

use super::jet::{Copies, run_copies};
use super::{Energies, Error, Jet, Report, Settings, Study};
use crate::estimate::{Estimate, crossing};
use crate::scene::Interference;

pub(super) const STUDY: Study = Study {
    name: "first-order-or-repeated",
    title: "When may one use a first-order model? Jets with four kinds of interference",
    source: "Mukherjee & Zohdi (2015), abstract and section 5",
    statement: "The influence of repeated collisions on the energy transferred to the surface is significant for high numbers of grains or \
                fluxes, and for high degrees of inelasticity.",
    compute,
};

/// What is run, and how often.
struct Plan {
    /// Restitution, friction, and the most grains: collapsing grains collide without limit, and their runs get long.
    contacts: &'static [(f64, f64, u64)],
    /// Numbers of grains.
    grains: &'static [u64],
    /// So many grains in all copies of a jet together, and the fewest and most copies.
    sample: [u64; 3],
    /// Jets of other shapes: width and length, m.
    shapes: &'static [(f64, f64)],
}

const FULL: Plan = Plan {
    contacts: &[
        (0.2, 0.0, 2000),
        (0.2, 0.4, 1000),
        (0.5, 0.0, 8000),
        (0.5, 0.4, 8000),
        (0.8, 0.0, 8000),
        (0.8, 0.4, 8000),
        (1.0, 0.0, 8000),
        (1.0, 0.4, 8000),
    ],
    grains: &[2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 4000, 8000],
    sample: [24_000, 3, 2000],
    shapes: &[(0.2, 0.5), (0.2, 2.5), (0.2, 12.5), (0.4, 2.5)],
};

const QUICK: Plan = Plan {
    contacts: &[(0.5, 0.0, 500), (0.5, 0.4, 500), (0.8, 0.0, 500), (0.8, 0.4, 500)],
    grains: &[2, 10, 50, 100, 500],
    sample: [1_500, 3, 100],
    shapes: &[(0.2, 2.5), (0.4, 2.5)],
};

/// The truth first, then models of it.
const MODELS: [Interference; 4] =
    [Interference::All, Interference::FirstOrder, Interference::RemovedOnFirstCollision, Interference::None];
/// Shapes are compared at this restitution and friction.
const SHAPE_CONTACT: (f64, f64) = (0.8, 0.0);
/// Grains may fill so much of the block that random sequential addition is quick.
const DENSEST: f64 = 0.34;
/// Errors at which a model is called wrong.
const LEVELS: [f64; 3] = [0.01, 0.05, 0.1];
/// A difference of so many standard errors is none of chance.
const DEVIATIONS: f64 = 3.0;

/// What may be wrong of it, and what that is called.
type Quantity = (&'static str, fn(&Energies) -> f64);
const CARRIED: Quantity = ("carried", |energies| energies.carried);
const LEFT: Quantity = ("left", |energies| energies.left);
const DISSIPATED: Quantity = ("dissipated_surface", |energies| energies.dissipated);

/// A jet with each kind of interference.
type Point = [Copies; MODELS.len()];

/// Jets that differ in the number of their grains only, the fewest first.
type Series = Vec<Point>;

/// Something over the number of grains.
type OverGrains = Vec<(f64, Estimate)>;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let plan = if settings.quick { &QUICK } else { &FULL };
    let (contacts, shapes) = measure(plan, settings)?;
    let mut report = Report::default();
    test_numbers(&contacts, &mut report);
    test_inelasticity(&contacts, &mut report);
    tell_limits(&contacts, &mut report);
    tell_shapes(&shapes, &mut report);
    tell_energy_left(&contacts, &mut report);
    report.tables = shown::tables(&contacts, &shapes);
    report.pictures = shown::pictures(&contacts, &shapes);
    Ok(report)
}

/// Runs all jets: the series of each contact, and those of each shape.
fn measure(plan: &Plan, settings: &Settings<'_>) -> Result<(Vec<Series>, Vec<Series>), Error> {
    let reference = Jet::reference();
    let contact = |&(restitution, friction, most): &(f64, f64, u64)| -> Vec<Jet> {
        let grains = plan.grains.iter().filter(|&&grains| grains <= most);
        grains.map(|&grains| Jet { grains, restitution, friction, ..reference }).collect()
    };
    let shape = |&(width, length): &(f64, f64)| -> Vec<Jet> {
        let (restitution, friction) = SHAPE_CONTACT;
        // As many grains over the same area.
        let area = (width / reference.width).powi(2);
        let grains = plan.grains.iter().map(|&grains| (grains as f64 * area).round() as u64);
        let jets = grains.map(|grains| Jet { grains, restitution, friction, width, length, ..reference });
        jets.filter(|jet| jet.grains <= reference.grains && jet.solid_fraction() <= DENSEST).collect()
    };
    let series: Vec<Vec<Jet>> = plan.contacts.iter().map(contact).chain(plan.shapes.iter().map(shape)).collect();
    let each = |jet: &Jet| MODELS.map(|interference| Jet { interference, ..*jet });
    let mut jets: Vec<Jet> = Vec::new();
    for jet in series.iter().flatten().flat_map(each) {
        // The jets of one shape are also those of one contact.
        if !jets.contains(&jet) {
            jets.push(jet);
        }
    }
    // The longest runs first.
    jets.sort_by(|a, b| b.grains.cmp(&a.grains).then(a.restitution.total_cmp(&b.restitution)));
    let [sample, fewest, most] = plan.sample;
    let copies = run_copies(&jets, |jet| (sample / jet.grains).clamp(fewest, most), settings)?;
    let of = |jet: Jet| copies.iter().find(|copies| copies.jet == jet).expect("it was run").clone();
    let point = |jet: &Jet| each(jet).map(of);
    let mut series: Vec<Series> = series.iter().map(|jets| jets.iter().map(point).collect()).collect();
    let shapes = series.split_off(plan.contacts.len());
    Ok((series, shapes))
}

/// Number of grains of a point.
fn grains(point: &Point) -> f64 {
    point[0].jet.grains as f64
}

/// Relative error of a model in a quantity.
fn error(point: &Point, model: usize, (_, of): Quantity) -> Estimate {
    point[0].ratio_of(&point[model], of, of) + -1.0
}

/// The same over the number of grains.
fn errors(series: &[Point], model: usize, quantity: Quantity) -> OverGrains {
    series.iter().map(|point| (grains(point), error(point, model, quantity))).collect()
}

/// The part of the energy carried to the surface that repeated hits bring.
fn repeated(point: &Point) -> Estimate {
    point[0].ratio_of(&point[0], |energies| energies.carried - energies.first_hits, |energies| energies.carried)
}

/// The same over the number of grains.
fn share_of_repeated(series: &[Point]) -> OverGrains {
    series.iter().map(|point| (grains(point), repeated(point))).collect()
}

fn percent(error: Estimate) -> String {
    format!("{} %", error * 100.0)
}

fn contact_of(series: &[Point]) -> String {
    let jet = &series[0][0].jet;
    format!("e = {}, mu = {}", jet.restitution, jet.friction)
}

/// The more grains, the more comes by repeated hits?
fn test_numbers(contacts: &[Series], report: &mut Report) {
    for series in contacts {
        let shares = share_of_repeated(series);
        let [first, .., last] = shares.as_slice() else { continue };
        report.put_to_the_test(
            format!("{}: repeated hits matter where there are many grains", contact_of(series)),
            format!(
                "they bring {} of the energy at {} grains and {} at {}",
                percent(first.1),
                first.0,
                percent(last.1),
                last.0
            ),
            last.1.value > first.1.value && last.1.deviation(first.1) > DEVIATIONS,
        );
    }
}

/// The less elastic, the more comes by repeated hits?
fn test_inelasticity(contacts: &[Series], report: &mut Report) {
    let pairs = [0.0, 0.4].into_iter().flat_map(|friction| [100, 500, 2000].map(|grains| (friction, grains)));
    for (friction, grains) in pairs {
        let is = |point: &&Point| (point[0].jet.friction, point[0].jet.grains) == (friction, grains);
        let points: Vec<&Point> = contacts.iter().flatten().filter(is).collect();
        if points.len() < 2 {
            continue;
        }
        let tell = |of: &dyn Fn(&Point) -> Estimate| {
            let told = points.iter().map(|point| format!("{} at e = {}", percent(of(point)), point[0].jet.restitution));
            told.collect::<Vec<_>>().join(", ")
        };
        report.put_to_the_test(
            format!(
                "{grains} grains, mu = {friction}: the less elastic, the more of the energy comes by repeated hits"
            ),
            tell(&repeated),
            points.is_sorted_by(|a, b| repeated(a).value > repeated(b).value),
        );
        report.measured(
            format!(
                "{grains} grains, mu = {friction}: a run in which each grain may hit once misses the energy carried by"
            ),
            tell(&|point| error(point, 1, CARRIED)),
        );
    }
}

/// From how many grains on is a first-order model wrong?
fn tell_limits(contacts: &[Series], report: &mut Report) {
    for series in contacts {
        let errors = [
            ("first hits alone are short of the energy carried by", share_of_repeated(series)),
            ("a first-order run misses the energy carried by", errors(series, 1, CARRIED)),
            ("a first-order run misses the energy left by", errors(series, 1, LEFT)),
        ];
        for (what, errors) in errors {
            let limits = LEVELS.map(|level| limit(&errors, level));
            report.measured(format!("{}: {what}", contact_of(series)), limits.join(", "));
        }
    }
}

/// From how many grains on errors reach a level, in words.
fn limit(errors: &[(f64, Estimate)], level: f64) -> String {
    let percent = 100.0 * level;
    match (crossing(errors, level), errors.first()) {
        (Some(grains), _) => format!("{percent:.0} % from {grains} grains on"),
        (None, Some((fewest, error))) if error.value.abs() >= level => {
            format!("{percent:.0} % with {fewest} grains already")
        }
        (None, _) => format!("{percent:.0} % nowhere"),
    }
}

/// What decides: grains over an area, or in a volume?
fn tell_shapes(shapes: &[Series], report: &mut Report) {
    for series in shapes {
        let jet = &series[0][0].jet;
        let shielding = jet.shielding(0.5 * jet.width) / jet.grains as f64;
        let limit = |level: f64| {
            let percent = 100.0 * level;
            crossing(&errors(series, 1, CARRIED), level).map_or_else(
                || format!("{percent:.0} % nowhere"),
                |grains| {
                    let crowding = Estimate { value: jet.crowding_of(grains.value), ..grains * jet.crowding_of(2.0) };
                    format!("{percent:.0} % from {crowding} ({:.2}) on", grains.value * shielding)
                },
            )
        };
        report.measured(
            format!(
                "A jet {} m wide and {} m long: a first-order run misses the energy carried, by crowding pi d^2 (N - 1) / A (in brackets the \
                 shielding exponent over half the width), by",
                jet.width, jet.length
            ),
            LEVELS.map(limit).join(", "),
        );
    }
}

/// Is there more or less energy left than without interference? α_interf of Mukherjee & Zohdi (2015), eq. (47).
fn tell_energy_left(contacts: &[Series], report: &mut Report) {
    for series in contacts {
        let Some(point) = series.last() else { continue };
        let jet = &point[0].jet;
        let alpha = point[0].mean(LEFT.1) + -jet.restitution.powi(2);
        let withheld = point[0].mean(|energies| energies.withheld).value;
        let kept =
            if withheld > 0.0 { format!(", {withheld:.0e} of it kept by the end of collapses") } else { String::new() };
        report.measured(
            format!("{}: alpha_interf of eq. (47), {} grains", contact_of(series), jet.grains),
            format!("{alpha}{kept}"),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::ensemble::unwatched;
    use super::*;

    /// The jets of a plan of one contact.
    fn measured() -> Vec<Series> {
        let plan = Plan { contacts: &[(0.8, 0.0, 500)], grains: &[2, 50, 500], sample: [2000, 4, 100], shapes: &[] };
        measure(&plan, &unwatched(true)).expect("they run").0
    }

    #[test]
    fn first_order_knows_what_is_rare_and_not_what_is_common() {
        let contacts = measured();
        let [few, .., many] = contacts[0].as_slice() else { panic!("three points") };
        let wrong = error(many, 1, CARRIED);
        assert!(wrong.value < -0.15 && wrong.error < 0.03, "{wrong}");
        assert!(error(few, 1, CARRIED).value.abs() < 0.02);
        assert!(repeated(many).value > repeated(few).value + 0.1);
        // Whoever has the grains pass through each other knows what is left to the bit.
        assert!((many[3].mean(LEFT.1).value - 0.64).abs() < 1e-14);
    }

    #[test]
    fn limits_say_where_they_are() {
        let at = |x, value| (x, Estimate { value, error: 1e-4 });
        let errors = [at(2.0, -0.02), at(20.0, -0.06), at(200.0, -0.08)];
        let told = LEVELS.map(|level| limit(&errors, level));
        assert_eq!(told[0], "1 % with 2 grains already");
        assert!(told[1].starts_with("5 % from 11.2") && told[1].ends_with("grains on"), "{}", told[1]);
        assert_eq!(told[2], "10 % nowhere");
    }
}
