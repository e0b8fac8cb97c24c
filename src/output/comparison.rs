//! A comparison of schemes as files and on a terminal.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::PathBuf;

use serde_json::{Value, json};

use super::plots::speed_against_error;
use super::summary::{brief, grouped, quantity};
use super::tables::table;
use super::{Error, Folder};
use crate::study::compare::{
    Comparison, Curve, DEVIATIONS, Entry, Level, PROBE, QUANTITIES, Regime, Scores, Statistics,
};

/// Widest line of the text, characters.
const WIDTH: usize = 100;
/// Characters for the name of a scheme or setting.
const NAME: usize = 26;
/// Characters for each number beside it.
const COLUMN: usize = 10;
/// Errors at which the text says who is how fast.
const LEVELS_TOLD: usize = 3;

/// Writes `compare.csv`, `ensemble.csv`, `summary.json` and, unless nothing can be drawn, `speed_against_error.svg`; gives the folder.
///
/// # Errors
/// The first failed write, or that of [`Folder::finish`].
pub fn write_comparison(comparison: &Comparison, folder: Folder) -> Result<PathBuf, Error> {
    folder.write("compare.csv", |file| write_runs(file, comparison))?;
    folder.write("ensemble.csv", |file| write_ensemble(file, comparison))?;
    folder.write("summary.json", |file| {
        serde_json::to_writer_pretty(&mut *file, &summary(comparison))?;
        writeln!(file)
    })?;
    const PICTURE: &str = "speed_against_error.svg";
    if let Some(svg) = speed_against_error(comparison).map_err(folder.failed(PICTURE))? {
        folder.write(PICTURE, |file| file.write_all(svg.as_bytes()))?;
    }
    folder.finish()
}

/// `compare.csv`: one row for each setting of each scheme; what is not known is empty.
fn write_runs(out: &mut dyn Write, comparison: &Comparison) -> io::Result<()> {
    const BEFORE: [&str; 12] = [
        "scheme",
        "setting",
        "value",
        "members",
        "repeats",
        "cpu_seconds",
        "error",
        "error_floor",
        "position_error",
        "position_floor",
        "velocity_error",
        "velocity_floor",
    ];
    const AFTER: [&str; 4] = ["max_overlap_over_radius", "lost", "energy_residual", "status"];
    let of_quantities = QUANTITIES.iter().flat_map(|name| [format!("{name}_error"), format!("{name}_floor")]);
    let header = BEFORE.map(str::to_owned).into_iter().chain(of_quantities).chain(AFTER.map(str::to_owned));
    let header: Vec<String> = header.collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let floor = comparison.reference.floor;
    let rows = comparison.curves.iter().flat_map(|curve| curve.entries.iter().map(move |entry| (curve, entry)));
    let rows = rows.map(|(curve, entry)| {
        let run = (curve.scheme, curve.setting, entry.value, entry.members, entry.repeats, entry.cpu_seconds);
        let scores = entry.result.as_ref().ok();
        let distance = scores.and_then(|scores| scores.distance);
        let grains = [
            distance.map(|distance| distance.position),
            distance.map(|_| floor.position),
            distance.map(|distance| distance.velocity),
            distance.map(|_| floor.velocity),
        ];
        let quantities: Vec<_> = (0..QUANTITIES.len())
            .flat_map(|i| [scores.map(|scores| scores.deviations[i]), scores.map(|scores| scores.floors[i])])
            .collect();
        let headline = [scores.map(|scores| scores.error), scores.map(|scores| scores.floor)];
        let soundness = (
            scores.map(|scores| scores.overlap),
            scores.map(|scores| scores.lost),
            scores.map(|scores| scores.energy_residual),
            status(entry),
        );
        (run, headline, grains, quantities, soundness)
    });
    table(out, &header, rows)
}

/// `ensemble.csv`: the right value of each quantity and how well it is known.
fn write_ensemble(out: &mut dyn Write, comparison: &Comparison) -> io::Result<()> {
    let statistics = &comparison.reference.statistics;
    let rows = QUANTITIES.iter().zip(statistics).map(|(name, of)| (name, of.mean, of.deviation, of.error(), of.count));
    table(out, &["quantity", "mean", "standard_deviation", "standard_error", "members"], rows)
}

fn status(entry: &Entry) -> String {
    entry.result.as_ref().map_or_else(ToString::to_string, |_| "done".to_owned())
}

/// `summary.json`.
fn summary(comparison: &Comparison) -> Value {
    let reference = &comparison.reference;
    let statistics =
        |of: &Statistics| json!({ "mean": of.mean, "standard_deviation": of.deviation, "standard_error": of.error() });
    let quantities =
        QUANTITIES.iter().zip(&reference.statistics).map(|(name, of)| ((*name).to_owned(), statistics(of)));
    let curves = comparison.curves.iter().map(|curve| {
        let best = curve.done().min_by(|a, b| a.1.error.total_cmp(&b.1.error));
        json!({
            "scheme": curve.scheme,
            "setting": curve.setting,
            "observed_order": curve.order(),
            "runs": curve.entries.len(),
            "failed": curve.entries.len() - curve.done().count(),
            "best": best.map(|(entry, scores)| json!({
                "value": entry.value,
                "cpu_seconds": entry.cpu_seconds,
                "error": scores.error,
            })),
        })
    });
    let levels = comparison.levels().into_iter().map(|level| {
        let costs = level.costs.iter().map(|&(curve, seconds)| {
            let curve = &comparison.curves[curve];
            json!({ "scheme": curve.scheme, "setting": curve.setting, "cpu_seconds": seconds })
        });
        json!({ "error": level.error, "fastest_first": costs.collect::<Vec<_>>() })
    });
    json!({
        "title": comparison.title,
        "version": env!("CARGO_PKG_VERSION"),
        "seed": comparison.seed,
        "interrupted": comparison.interrupted,
        "time": { "start": comparison.time[0], "until": comparison.time[1] },
        "grains": comparison.grains,
        "threads": 1,
        "reference": {
            "regime": match reference.regime { Regime::Pointwise => "pointwise", Regime::Statistical => "statistical" },
            "probe_radii": PROBE,
            "spread_radii": reference.spread.position,
            "displacement_radii": reference.displacement,
            "members": reference.members.len(),
            "substep": reference.sub_step,
            "quantities": quantities.collect::<serde_json::Map<_, _>>(),
        },
        "curves": curves.collect::<Vec<_>>(),
        "levels": levels.collect::<Vec<_>>(),
    })
}

/// The table and the verdict, for a terminal.
#[must_use]
pub fn comparison_text(comparison: &Comparison) -> String {
    let mut text = String::new();
    let title = if comparison.title.is_empty() { "Untitled scene" } else { &comparison.title };
    let [start, until] = comparison.time.map(|time| brief(time, "s"));
    let grains = grouped(comparison.grains);
    let version = env!("CARGO_PKG_VERSION");
    let heading = format!(
        "{title}\n{grains} grains from {start} to {until}, seed {}, one thread, Impinge {version}\n",
        comparison.seed
    );
    text.push_str(&heading);
    paragraph(&mut text, &regime(comparison));
    text.push('\n');
    write_table(&mut text, comparison);
    text.push('\n');
    verdict(comparison).iter().for_each(|sentence| paragraph(&mut text, sentence));
    text
}

/// What the error is, and what is below it.
fn regime(comparison: &Comparison) -> String {
    let reference = &comparison.reference;
    let probe = format!("Starts that differ by {PROBE:e} radii end {:.1e} radii apart", reference.spread.position);
    match reference.regime {
        Regime::Pointwise => {
            let finer =
                reference.sub_step.map_or_else(String::new, |step| format!(" of sub-steps of {}", brief(step, "s")));
            format!(
                "{probe}: no chaos before the end. The error is that of the grain which is furthest off, against the event-driven scheme{finer}; \
                 below {:.1e} radii it means nothing.",
                reference.floor.position
            )
        }
        Regime::Statistical => {
            let floor = reference_floor(comparison);
            format!(
                "{probe}: chaos, and no grain can be told from its neighbour. The error is the root mean square over energies, impulse and counts, \
                 against the means of {} event-driven runs from starts {:e} radii apart; below {floor} a difference means nothing (marked ~).",
                reference.members.len(),
                reference.displacement,
            )
        }
    }
}

/// The floor that most entries have.
fn reference_floor(comparison: &Comparison) -> String {
    let first = comparison.curves.iter().flat_map(Curve::done).map(|(_, scores)| scores.floor).next();
    first.map_or_else(|| "it".to_owned(), percent)
}

/// What stands in a column below its heading.
type Column = (&'static str, fn(&Scores) -> String);

const FOR_GRAINS: [Column; 2] = [
    ("position", |scores| marked(scores.is_noise(), &small(scores.error))),
    ("velocity", |scores| small(scores.distance.map_or(0.0, |distance| distance.velocity))),
];
const FOR_MEANS: [Column; 5] = [
    ("error", |scores| marked(scores.is_noise(), &percent(scores.error))),
    ("first hits", |scores| deviation(scores, 0)),
    ("all hits", |scores| deviation(scores, 1)),
    ("final E", |scores| deviation(scores, 3)),
    ("collisions", |scores| deviation(scores, 4)),
];
const FOR_ALL: [Column; 3] = [
    ("overlap", |scores| small(scores.overlap)),
    ("lost", |scores| grouped(scores.lost)),
    ("residual", |scores| small(scores.energy_residual)),
];

fn write_table(text: &mut String, comparison: &Comparison) {
    let columns: Vec<Column> = match comparison.reference.regime {
        Regime::Pointwise => FOR_GRAINS.into_iter().chain(FOR_ALL).collect(),
        Regime::Statistical => FOR_MEANS.into_iter().chain(FOR_ALL).collect(),
    };
    let cells =
        |cells: &mut dyn Iterator<Item = String>| cells.map(|cell| format!("{cell:>COLUMN$}")).collect::<String>();
    let heading = cells(&mut ["CPU time"].into_iter().chain(columns.iter().map(|column| column.0)).map(str::to_owned));
    line(text, &format!("{:NAME$}{heading}", "scheme"));
    for curve in &comparison.curves {
        if !curve.setting.is_empty() {
            line(text, curve.scheme);
        }
        for entry in &curve.entries {
            let name = match entry.value {
                Some(value) => {
                    format!("  {} {value:.3e}", curve.setting)
                        + if curve.unit.is_empty() { "" } else { " " }
                        + curve.unit
                }
                None => curve.scheme.to_owned(),
            };
            let cpu = entry.cpu_seconds.map_or_else(|| "-".to_owned(), |seconds| quantity(seconds, "s"));
            match &entry.result {
                Ok(scores) => {
                    let numbers = cells(&mut [cpu].into_iter().chain(columns.iter().map(|column| column.1(scores))));
                    line(text, &format!("{name:NAME$}{numbers}"));
                }
                Err(fault) => line(text, &format!("{name:NAME$}{cpu:>COLUMN$}  {fault}")),
            }
        }
    }
}

fn line(text: &mut String, line: &str) {
    text.push_str(line.trim_end());
    text.push('\n');
}

/// Who is how fast, at what order errors fall, and what went wrong.
fn verdict(comparison: &Comparison) -> Vec<String> {
    let levels = comparison.levels();
    // The best errors are the hardest to get.
    let told = levels.len().saturating_sub(LEVELS_TOLD);
    let mut sentences: Vec<String> = levels[told..].iter().map(|level| at_level(comparison, level)).collect();
    if comparison.curves.iter().flat_map(Curve::done).count() > 0 && levels.is_empty() {
        sentences.push("No two schemes reach the same error, so their speeds cannot be compared.".to_owned());
    }
    let orders = comparison.curves.iter().filter_map(|curve| {
        let order = curve.order()?;
        Some(format!("{} {order:.2} in {}", curve.scheme, curve.setting))
    });
    let orders: Vec<_> = orders.collect();
    if !orders.is_empty() {
        sentences.push(format!("Observed order: {}.", orders.join(", ")));
    }
    let noise = comparison.curves.iter().filter(|curve| curve.done().any(|(_, scores)| scores.is_noise()));
    let noise: Vec<_> = noise.map(|curve| curve.scheme).collect();
    if comparison.reference.regime == Regime::Statistical && !noise.is_empty() {
        sentences.push(format!(
            "Not to be told from the event-driven scheme by these means ({DEVIATIONS} standard deviations): {}.",
            noise.join(", ")
        ));
    }
    if comparison.interrupted {
        sentences.push("The comparison was interrupted.".to_owned());
    }
    sentences
}

fn at_level(comparison: &Comparison, level: &Level) -> String {
    let name = |curve: usize| comparison.curves[curve].scheme;
    let (fastest, seconds) = level.costs[0];
    let mut sentence = format!("At an error of {:e}: {} {}", level.error, name(fastest), quantity(seconds, "s"));
    for &(curve, cost) in &level.costs[1..] {
        let _ =
            write!(sentence, ", {} {:.*} times that", name(curve), usize::from(cost < 10.0 * seconds), cost / seconds);
    }
    let absent = (0..comparison.curves.len()).filter(|curve| level.costs.iter().all(|cost| cost.0 != *curve));
    for curve in absent {
        let _ = write!(sentence, ", {} does not get there", name(curve));
    }
    sentence + "."
}

/// Adds a paragraph, broken where lines would become too long.
fn paragraph(text: &mut String, words: &str) {
    let mut length = 0;
    for word in words.split_whitespace() {
        let more = word.chars().count();
        if length > 0 {
            let breaks = length + 1 + more > WIDTH;
            text.push(if breaks { '\n' } else { ' ' });
            length = if breaks { 0 } else { length + 1 };
        }
        text.push_str(word);
        length += more;
    }
    text.push('\n');
}

fn small(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

/// A part in per cent, to two digits.
fn percent(value: f64) -> String {
    let parts = 100.0 * value;
    let digits = if parts == 0.0 { 0 } else { (1 - parts.abs().log10().floor() as i32).clamp(0, 3) as usize };
    format!("{parts:.digits$} %")
}

fn deviation(scores: &Scores, quantity: usize) -> String {
    let value = scores.deviations[quantity];
    let sign = if value > 0.0 { "+" } else { "" };
    marked(value.abs() <= scores.floors[quantity], &format!("{sign}{}", percent(value)))
}

fn marked(noise: bool, text: &str) -> String {
    if noise { format!("~{text}") } else { text.to_owned() }
}
