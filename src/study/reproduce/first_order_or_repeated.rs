//! When may one use a first-order model? Jets with each of the four kinds of interference.

use super::jet::{Copies, run_copies};
use super::{
    Axis, Chart, Energies, Error, Estimate, Jet, Line, Mark, Picture, Report, Settings, Study, Table, crossing,
};
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
    sample: [24_000, 3, 4000],
    shapes: &[(0.2, 0.5), (0.2, 2.5), (0.2, 12.5), (0.4, 2.5)],
};

const QUICK: Plan = Plan {
    contacts: &[(0.5, 0.0, 500), (0.5, 0.4, 500), (0.8, 0.0, 2000), (0.8, 0.4, 2000)],
    grains: &[5, 20, 100, 500, 2000],
    sample: [2_000, 3, 400],
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

/// What may be wrong, and what it is called.
type Quantity = (&'static str, fn(&Energies) -> f64);
const QUANTITIES: [Quantity; 3] = [
    ("carried", |energies| energies.carried),
    ("left", |energies| energies.left),
    ("dissipated_surface", |energies| energies.dissipated),
];

/// A jet with each kind of interference.
type Point = [Copies; MODELS.len()];

/// Jets that differ in the number of their grains only, the fewest first.
type Series = Vec<Point>;

fn compute(settings: &Settings<'_>) -> Result<Report, Error> {
    let plan = if settings.quick { &QUICK } else { &FULL };
    let (contacts, shapes) = measure(plan, settings)?;
    let mut report = Report::default();
    test_numbers(&contacts, &mut report);
    test_inelasticity(&contacts, &mut report);
    tell_limits(&contacts, &mut report);
    tell_energy_left(&contacts, &mut report);
    tell_shapes(&shapes, &mut report);
    let all: Vec<&Point> = contacts.iter().chain(&shapes).flatten().collect();
    report.tables = vec![jets(&all), errors(&all), limits(contacts.iter().chain(&shapes))];
    report.pictures = vec![
        Picture::Chart(carried(&contacts)),
        Picture::Chart(error_of_first_order("error_carried", "carried to the surface", QUANTITIES[0], &contacts)),
        Picture::Chart(error_of_first_order("error_left", "left in the grains", QUANTITIES[1], &contacts)),
        Picture::Chart(error_over_crowding(&shapes)),
    ];
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
    let mut jets: Vec<Jet> = series.iter().flatten().flat_map(each).collect();
    // The longest runs first.
    jets.sort_by(|a, b| b.grains.cmp(&a.grains).then(a.restitution.total_cmp(&b.restitution)));
    jets.dedup(); // the reference jet is of both kinds
    let [sample, fewest, most] = plan.sample;
    let copies = run_copies(&jets, |jet| (sample / jet.grains).clamp(fewest, most), settings)?;
    let of = |jet: Jet| copies.iter().find(|copies| copies.jet == jet).expect("it was run").clone();
    let point = |jet: &Jet| each(jet).map(of);
    let mut series: Vec<Series> = series.iter().map(|jets| jets.iter().map(point).collect()).collect();
    let shapes = series.split_off(plan.contacts.len());
    Ok((series, shapes))
}

/// The error of a model over the number of grains.
fn error(series: &[Point], model: usize, of: fn(&Energies) -> f64) -> Vec<(f64, Estimate)> {
    series.iter().map(|point| (point[0].jet.grains as f64, point[0].error_of(&point[model], of))).collect()
}

fn percent(error: Estimate) -> String {
    format!("{} %", error * 100.0)
}

fn contact_of(series: &[Point]) -> String {
    let jet = &series[0][0].jet;
    format!("e = {}, mu = {}", jet.restitution, jet.friction)
}

/// More grains, larger errors?
fn test_numbers(contacts: &[Series], report: &mut Report) {
    for series in contacts {
        let errors = error(series, 1, QUANTITIES[0].1);
        let [first, .., last] = errors.as_slice() else { continue };
        report.put_to_the_test(
            format!(
                "{}: with more grains, first order is further from the energy that all hits carry to the surface",
                contact_of(series)
            ),
            format!("{} of it at {} grains, {} at {}", percent(first.1), first.0, percent(last.1), last.0),
            last.1.value.abs() > first.1.value.abs() && last.1.deviation(first.1) > DEVIATIONS,
        );
    }
}

/// The less elastic, the larger the errors?
fn test_inelasticity(contacts: &[Series], report: &mut Report) {
    let frictions = [0.0, 0.4];
    for friction in frictions {
        let series: Vec<&Series> = contacts.iter().filter(|series| series[0][0].jet.friction == friction).collect();
        for grains in [100, 500, 2000] {
            let at = |series: &&Series| {
                let point = series.iter().find(|point| point[0].jet.grains == grains)?;
                Some((point[0].jet.restitution, point[0].error_of(&point[1], QUANTITIES[0].1)))
            };
            let errors: Vec<(f64, Estimate)> = series.iter().filter_map(at).collect();
            if errors.len() < 2 {
                continue;
            }
            let told: Vec<String> = errors.iter().map(|(e, error)| format!("{} at e = {e}", percent(*error))).collect();
            report.put_to_the_test(
                format!("{grains} grains, mu = {friction}: the less elastic, the further is first order from the energy carried"),
                told.join(", "),
                errors.is_sorted_by(|a, b| a.1.value.abs() > b.1.value.abs()),
            );
        }
    }
}

/// From how many grains on is a first-order model wrong?
fn tell_limits(contacts: &[Series], report: &mut Report) {
    for series in contacts {
        for (name, of) in &QUANTITIES[..2] {
            let errors = error(series, 1, *of);
            let limits = LEVELS.map(|level| match crossing(&errors, level) {
                Some(grains) => format!("{:.0} % from {grains} grains on", 100.0 * level),
                None => format!("{:.0} % not in this range", 100.0 * level),
            });
            report.measured(
                format!("{}: first order misses the energy {name} by", contact_of(series)),
                limits.join(", "),
            );
        }
    }
}

/// Is there more or less energy left than without interference? α_interf of Mukherjee & Zohdi (2015), eq. (47).
fn tell_energy_left(contacts: &[Series], report: &mut Report) {
    for series in contacts {
        let Some(point) = series.last() else { continue };
        let jet = &point[0].jet;
        let alpha = point[0].mean(|energies| energies.left) + -jet.restitution.powi(2);
        report.measured(
            format!("{}: alpha_interf of eq. (47), {} grains", contact_of(series), jet.grains),
            format!(
                "{alpha}, with {} of E0 withheld where grains collapse",
                point[0].mean(|energies| energies.withheld)
            ),
        );
    }
}

/// What decides: grains over an area, or in a volume?
fn tell_shapes(shapes: &[Series], report: &mut Report) {
    for series in shapes {
        let jet = &series[0][0].jet;
        let limit = crossing(&error(series, 1, QUANTITIES[0].1), LEVELS[1]);
        let measured = limit.map_or_else(
            || "not in this range".to_owned(),
            |grains| {
                let per_grain = jet.crowding() / jet.grains as f64;
                let shielding = jet.shielding(0.5 * jet.width) / jet.grains as f64;
                format!(
                    "{grains} grains: crowding pi d^2 N / A = {}, shielding exponent over half the width {}",
                    grains * per_grain,
                    grains * shielding
                )
            },
        );
        report.measured(
            format!(
                "A jet of {} m by {} m: first order misses the energy carried by {:.0} % from",
                jet.width,
                jet.length,
                100.0 * LEVELS[1]
            ),
            measured,
        );
    }
}

fn jets(points: &[&Point]) -> Table {
    let mut table = Table::new(
        "jets",
        &[
            "restitution",
            "friction",
            "width",
            "length",
            "grains",
            "crowding",
            "shielding_half_width",
            "interference",
            "copies",
            "carried",
            "carried_error",
            "first_hits",
            "first_hits_error",
            "left",
            "left_error",
            "dissipated_surface",
            "dissipated_surface_error",
            "withheld",
            "grains_that_hit",
            "collisions_per_grain",
            "surface_hits_per_grain",
        ],
    );
    for at in points.iter().flat_map(|point| point.iter()) {
        let jet = &at.jet;
        let [carried, first, left, dissipated] = [
            at.mean(|energies| energies.carried),
            at.mean(|energies| energies.first_hits),
            at.mean(|energies| energies.left),
            at.mean(|energies| energies.dissipated),
        ];
        table.row(&[
            &jet.restitution,
            &jet.friction,
            &jet.width,
            &jet.length,
            &jet.grains,
            &jet.crowding(),
            &jet.shielding(0.5 * jet.width),
            &jet.model(),
            &at.energies.len(),
            &carried.value,
            &carried.error,
            &first.value,
            &first.error,
            &left.value,
            &left.error,
            &dissipated.value,
            &dissipated.error,
            &at.mean(|energies| energies.withheld).value,
            &at.mean(|energies| energies.hit).value,
            &at.mean(|energies| energies.collisions).value,
            &at.mean(|energies| energies.surface_hits).value,
        ]);
    }
    table
}

fn errors(points: &[&Point]) -> Table {
    let mut table = Table::new(
        "errors",
        &[
            "restitution",
            "friction",
            "width",
            "length",
            "grains",
            "model",
            "carried",
            "carried_error",
            "left",
            "left_error",
            "dissipated_surface",
            "dissipated_surface_error",
        ],
    );
    for [truth, models @ ..] in points {
        for model in models {
            let [carried, left, dissipated] = QUANTITIES.map(|(_, of)| truth.error_of(model, of));
            let jet = &model.jet;
            table.row(&[
                &jet.restitution,
                &jet.friction,
                &jet.width,
                &jet.length,
                &jet.grains,
                &jet.model(),
                &carried.value,
                &carried.error,
                &left.value,
                &left.error,
                &dissipated.value,
                &dissipated.error,
            ]);
        }
    }
    table
}

fn limits<'a>(all: impl Iterator<Item = &'a Series>) -> Table {
    let mut table = Table::new(
        "limits",
        &[
            "restitution",
            "friction",
            "width",
            "length",
            "model",
            "quantity",
            "level",
            "grains",
            "grains_error",
            "crowding",
        ],
    );
    for series in all {
        let jet = &series[0][0].jet;
        for (model, (name, of)) in (1..MODELS.len()).flat_map(|model| QUANTITIES.map(|quantity| (model, quantity))) {
            let errors = error(series, model, of);
            for level in LEVELS {
                let Some(grains) = crossing(&errors, level) else { continue };
                table.row(&[
                    &jet.restitution,
                    &jet.friction,
                    &jet.width,
                    &jet.length,
                    &series[0][model].jet.model(),
                    &name,
                    &level,
                    &grains.value,
                    &grains.error,
                    &(grains.value * jet.crowding() / jet.grains as f64),
                ]);
            }
        }
    }
    table
}

/// Energy carried to the surface by each model at restitution 0.8.
fn carried(contacts: &[Series]) -> Chart {
    let names = ["all hits", "first order", "removed on first collision", "no interference"];
    let mut lines = Vec::new();
    for series in contacts.iter().filter(|series| series[0][0].jet.restitution == 0.8) {
        let rough = series[0][0].jet.friction > 0.0;
        for (model, name) in names.iter().enumerate().filter(|(model, _)| !rough || *model < 2) {
            let points =
                series.iter().map(|point| (point[0].jet.grains as f64, point[model].mean(|energies| energies.carried)));
            let name = if rough { format!("  friction {}", series[0][0].jet.friction) } else { (*name).to_owned() };
            let mark = if rough { Mark::OpenPoints } else { Mark::Points };
            lines.push(Line { name, points: points.collect(), mark, colour: model });
        }
    }
    lines.sort_by_key(|line| line.colour);
    Chart {
        name: "carried",
        title: "Energy carried to the surface: four kinds of interference, restitution 0.8".into(),
        shows: "By all hits that each of them knows, over E0; a block of 0.2 m x 0.2 m x 2.5 m".into(),
        x: Axis::log("number of grains", 2.0, 8000.0),
        y: Axis::linear("energy / E0", 0.0, 1.2),
        lines,
    }
}

/// Levels at which a model is called wrong, as lines over a chart.
fn levels(range: [f64; 2]) -> impl Iterator<Item = Line> {
    LEVELS.into_iter().map(move |level| {
        let name = format!("{:.0} %", 100.0 * level);
        Line::curve(name, 5, Mark::Dashed, range.map(|x| (x, 100.0 * level)))
    })
}

/// The magnitude of errors in percent, where chance has less than half a share in them.
fn magnitudes(errors: &[(f64, Estimate)]) -> Vec<(f64, Estimate)> {
    let sure = errors.iter().filter(|(_, error)| error.value.abs() > 2.0 * error.error);
    sure.map(|&(x, error)| (x, Estimate { value: error.value.abs(), ..error } * 100.0)).collect()
}

fn error_of_first_order(name: &'static str, what: &str, (_, of): Quantity, contacts: &[Series]) -> Chart {
    let mut restitutions: Vec<f64> = contacts.iter().map(|series| series[0][0].jet.restitution).collect();
    restitutions.dedup();
    let line = |series: &Series| {
        let jet = &series[0][0].jet;
        let mark = if jet.friction > 0.0 { Mark::OpenPoints } else { Mark::Points };
        let colour = restitutions.iter().position(|&e| e == jet.restitution).unwrap_or(0);
        let name = format!("e = {}, mu = {}", jet.restitution, jet.friction);
        Line { name, points: magnitudes(&error(series, 1, of)), mark, colour }
    };
    let range = [2.0, 8000.0];
    Chart {
        name,
        title: format!("By how much a first-order model misses the energy {what}"),
        shows: "Magnitude of its error, relative; a block of 0.2 m x 0.2 m x 2.5 m; where it is twice its standard error or more".into(),
        x: Axis::log("number of grains", range[0], range[1]),
        y: Axis::log("error (%)", 0.1, 200.0),
        lines: contacts.iter().map(line).chain(levels(range)).collect(),
    }
}

fn error_over_crowding(shapes: &[Series]) -> Chart {
    let line = |(colour, series): (usize, &Series)| {
        let jet = &series[0][0].jet;
        let per_grain = jet.crowding() / jet.grains as f64;
        let errors: Vec<_> =
            error(series, 1, QUANTITIES[0].1).iter().map(|&(n, error)| (n * per_grain, error)).collect();
        Line::measured(format!("{} m wide, {} m long", jet.width, jet.length), colour, magnitudes(&errors))
    };
    let range = [0.05, 500.0];
    Chart {
        name: "error_over_crowding",
        title: "Jets of several shapes: what decides whether a first-order model will do".into(),
        shows: "Magnitude of its error in the energy carried to the surface; restitution 0.8, smooth".into(),
        x: Axis::log("crowding: grains within a diameter of a line along the jet", range[0], range[1]),
        y: Axis::log("error (%)", 0.1, 200.0),
        lines: shapes.iter().enumerate().map(line).chain(levels(range)).collect(),
    }
}
