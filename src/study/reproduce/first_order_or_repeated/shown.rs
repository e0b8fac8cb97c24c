//! Tables and pictures of the study.

use super::{CARRIED, DISSIPATED, LEFT, LEVELS, MODELS, OverGrains, Point, Series};
use super::{contact_of, error, errors, grains, share_of_repeated};
use crate::estimate::{Estimate, crossing};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

/// Numbers of grains along the axes of charts.
const GRAINS: [f64; 2] = [2.0, 8000.0];

pub(super) fn tables(contacts: &[Series], shapes: &[Series]) -> Vec<Table> {
    let all: Vec<&Series> = contacts.iter().chain(shapes).collect();
    vec![jets(&all), table_of_errors(&all), limits(&all)]
}

pub(super) fn pictures(contacts: &[Series], shapes: &[Series]) -> Vec<Picture> {
    let charts = [
        carried(contacts),
        over_grains(
            "repeated",
            "Share of the energy carried to the surface that repeated hits bring",
            contacts,
            share_of_repeated,
        ),
        over_grains(
            "error_carried",
            "By how much a first-order run misses the energy carried to the surface",
            contacts,
            |series| errors(series, 1, CARRIED),
        ),
        over_grains(
            "error_left",
            "By how much a first-order run misses the energy left in the grains",
            contacts,
            |series| errors(series, 1, LEFT),
        ),
        error_over_crowding(shapes),
    ];
    charts.map(Picture::Chart).into()
}

fn jets(all: &[&Series]) -> Table {
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
    for at in all.iter().copied().flatten().flatten() {
        let jet = &at.jet;
        let [carried, left, dissipated] = [CARRIED, LEFT, DISSIPATED].map(|(_, of)| at.mean(of));
        let first = at.mean(|energies| energies.first_hits);
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

fn table_of_errors(all: &[&Series]) -> Table {
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
    for (point, model) in
        all.iter().copied().flatten().flat_map(|point| (1..MODELS.len()).map(move |model| (point, model)))
    {
        let [carried, left, dissipated] = [CARRIED, LEFT, DISSIPATED].map(|quantity| {
            let error = error(point, model, quantity);
            // Elastic smooth grains dissipate nothing, and nothing can be off by a part of that.
            let known = |number: f64| if error.value.is_finite() { number.to_string() } else { String::new() };
            [error.value, error.error].map(known)
        });
        let jet = &point[model].jet;
        table.row(&[
            &jet.restitution,
            &jet.friction,
            &jet.width,
            &jet.length,
            &jet.grains,
            &jet.model(),
            &carried[0],
            &carried[1],
            &left[0],
            &left[1],
            &dissipated[0],
            &dissipated[1],
        ]);
    }
    table
}

fn limits(all: &[&Series]) -> Table {
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
        let runs = (1..MODELS.len()).flat_map(|model| {
            let of = |quantity| errors(series, model, quantity);
            [CARRIED, LEFT, DISSIPATED].map(|quantity| (series[0][model].jet.model(), quantity.0, of(quantity)))
        });
        let first_hits = [("first-hits", CARRIED.0, share_of_repeated(series))];
        for (model, quantity, errors) in first_hits.into_iter().chain(runs) {
            for level in LEVELS {
                let Some(grains) = crossing(&errors, level) else { continue };
                table.row(&[
                    &jet.restitution,
                    &jet.friction,
                    &jet.width,
                    &jet.length,
                    &model,
                    &quantity,
                    &level,
                    &grains.value,
                    &grains.error,
                    &jet.crowding_of(grains.value),
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
        // Friction matters to the first two only.
        for (model, name) in names.iter().enumerate().filter(|(model, _)| !rough || *model < 2) {
            let points = series.iter().map(|point| (grains(point), point[model].mean(CARRIED.1)));
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
        x: Axis::log("number of grains", GRAINS[0], GRAINS[1]),
        y: Axis::linear("energy / E0", 0.0, 1.1),
        lines,
    }
}

/// Levels at which a model is called wrong, as lines over a chart.
fn levels(range: [f64; 2]) -> impl Iterator<Item = Line> {
    let line = move |(level, name): (f64, &str)| Line::curve(name, 0, Mark::Guide, range.map(|x| (x, 100.0 * level)));
    LEVELS.into_iter().zip(["1, 5 and 10 %", "", ""]).map(line)
}

/// Magnitudes in percent, where chance has less than half a share in them.
fn magnitudes(errors: &[(f64, Estimate)]) -> OverGrains {
    let sure = errors.iter().filter(|(_, error)| error.value.abs() > 2.0 * error.error);
    sure.map(|&(x, error)| (x, Estimate { value: error.value.abs(), ..error } * 100.0)).collect()
}

/// Something in percent over the number of grains, for every contact.
fn over_grains(name: &'static str, title: &str, contacts: &[Series], of: impl Fn(&[Point]) -> OverGrains) -> Chart {
    let mut restitutions: Vec<f64> = contacts.iter().map(|series| series[0][0].jet.restitution).collect();
    restitutions.dedup();
    let line = |series: &Series| {
        let jet = &series[0][0].jet;
        let mark = if jet.friction > 0.0 { Mark::OpenPoints } else { Mark::Points };
        let colour = restitutions.iter().position(|&e| e == jet.restitution).unwrap_or(0);
        Line { name: contact_of(series), points: magnitudes(&of(series)), mark, colour }
    };
    Chart {
        name,
        title: title.into(),
        shows: "A block of 0.2 m x 0.2 m x 2.5 m; shown where it is more than twice its standard error".into(),
        x: Axis::log("number of grains", GRAINS[0], GRAINS[1]),
        y: Axis::log("%", 0.1, 500.0),
        lines: contacts.iter().map(line).chain(levels(GRAINS)).collect(),
    }
}

fn error_over_crowding(shapes: &[Series]) -> Chart {
    let line = |(colour, series): (usize, &Series)| {
        let jet = &series[0][0].jet;
        let over_crowding = |&(grains, error): &(f64, Estimate)| (jet.crowding_of(grains), error);
        let errors: OverGrains = errors(series, 1, CARRIED).iter().map(over_crowding).collect();
        Line::measured(format!("{} m wide, {} m long", jet.width, jet.length), colour, magnitudes(&errors))
    };
    let range = [0.02, 500.0];
    Chart {
        name: "error_over_crowding",
        title: "Jets of several shapes: by how much a first-order run misses the energy carried".into(),
        shows: "Restitution 0.8, smooth; shown where it is more than twice its standard error".into(),
        x: Axis::log("crowding: others within a diameter of the way of a grain", range[0], range[1]),
        y: Axis::log("%", 0.1, 500.0),
        lines: shapes.iter().enumerate().map(line).chain(levels(range)).collect(),
    }
}
