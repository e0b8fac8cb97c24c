//! A comparison of schemes for reading on a terminal: a table and a verdict.

use std::fmt::Write as _;

use crate::output::summary::{brief, grouped, quantity};
use crate::study::compare::{Comparison, Curve, Fault, Level, PROBE, Regime, Scores};

/// Widest line of the text, characters.
const WIDTH: usize = 100;
/// Characters for the name of a scheme or setting.
const NAME: usize = 14;
/// Characters for each number beside it.
const COLUMN: usize = 9;
/// Errors at which the text says who is how fast.
const LEVELS_TOLD: usize = 3;

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
    text.push('\n');
    paragraph(&mut text, &regime(comparison));
    text.push('\n');
    write_table(&mut text, comparison);
    paragraph(&mut text, legend(comparison.reference.regime));
    text.push('\n');
    verdict(comparison).iter().for_each(|sentence| paragraph(&mut text, sentence));
    text
}

/// What the error is, and what is below it.
fn regime(comparison: &Comparison) -> String {
    let reference = &comparison.reference;
    let spread = reference.spread.position;
    let probe = format!("Starts that differ by {PROBE:e} radii end {spread:.1e} radii apart");
    match reference.regime {
        Regime::Pointwise => {
            let finer = reference.sub_step.map(|step| format!(" with sub-steps of {}", brief(step, "s")));
            format!(
                "{probe}: no chaos before the end. The error is that of the grain which is furthest off, in radii, against the \
                 event-driven scheme{}; below {:.1e} it means nothing (marked ~).",
                finer.unwrap_or_default(),
                reference.floor.position
            )
        }
        Regime::Statistical => format!(
            "{probe}: errors grow so much ({:.0e} times) that the end of a single grain says nothing of a scheme. The error is the root mean \
             square over energies, impulse and counts, against the means of {} event-driven runs from starts that differ by {:e} radii; \
             below {} a difference means nothing (marked ~).",
            spread / PROBE,
            reference.members.len(),
            reference.displacement,
            reference_floor(comparison),
        ),
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
    ("1st hits", |scores| deviation(scores, 0)),
    ("all hits", |scores| deviation(scores, 1)),
    ("final E", |scores| deviation(scores, 3)),
    ("pairs", |scores| deviation(scores, 4)),
];
const FOR_ALL: [Column; 3] = [
    ("overlap", |scores| small(scores.overlap)),
    ("lost", |scores| grouped(scores.lost)),
    ("residual", |scores| small(scores.energy_residual)),
];

/// What the headings mean.
fn legend(regime: Regime) -> &'static str {
    match regime {
        Regime::Pointwise => {
            "velocity: largest error over the largest initial speed; overlap: deepest, in radii; lost: grains that went through the surface or \
             are missing; residual: energy that is not accounted for (below 0: made) over that of the run"
        }
        Regime::Statistical => {
            "1st hits, all hits: energy to the surface; final E: kinetic energy at the end; pairs: grain–grain collisions; overlap: deepest, in \
             radii; lost: grains that went through the surface or are missing; residual: energy that is not accounted for (below 0: made) over \
             that of the run"
        }
    }
}

fn write_table(text: &mut String, comparison: &Comparison) {
    let columns: Vec<Column> = match comparison.reference.regime {
        Regime::Pointwise => FOR_GRAINS.into_iter().chain(FOR_ALL).collect(),
        Regime::Statistical => FOR_MEANS.into_iter().chain(FOR_ALL).collect(),
    };
    let row = |name: &str, cells: &mut dyn Iterator<Item = String>| {
        cells.fold(format!("{name:NAME$}"), |row, cell| format!("{row}{cell:>COLUMN$}")) + "\n"
    };
    let headings = ["CPU time"].into_iter().chain(columns.iter().map(|column| column.0));
    text.push_str(&row("", &mut headings.map(str::to_owned)));
    for curve in &comparison.curves {
        if !curve.setting.is_empty() {
            let unit = if curve.unit.is_empty() { String::new() } else { format!(" ({})", curve.unit) };
            let _ = writeln!(text, "{}, {}{unit}", curve.scheme, curve.setting);
        }
        if let Some(fault) = refused(curve) {
            let _ = writeln!(text, "  {fault}");
            continue;
        }
        for entry in &curve.entries {
            let name = entry.value.map_or_else(|| curve.scheme.to_owned(), |value| format!("  {value:e}"));
            let cpu = entry.cpu_seconds.map_or_else(|| "-".to_owned(), |seconds| quantity(seconds, "s"));
            let numbers = entry.result.as_ref().map(|scores| columns.iter().map(|column| column.1(scores)));
            match numbers {
                Ok(numbers) => text.push_str(&row(&name, &mut [cpu].into_iter().chain(numbers))),
                Err(fault) => _ = writeln!(text, "{name:NAME$}{cpu:>COLUMN$}  {fault}"),
            }
        }
    }
}

/// Why a scheme cannot run the scene, whatever its setting.
fn refused(curve: &Curve) -> Option<&Fault> {
    let mut faults = curve.entries.iter().map(|entry| entry.result.as_ref().err());
    let first = faults.next()?.filter(|fault| matches!(fault, Fault::Refused(_)))?;
    faults.all(|fault| fault == Some(first)).then_some(first)
}

/// Who is how fast, at what order errors fall, and what went wrong.
fn verdict(comparison: &Comparison) -> Vec<String> {
    let levels = comparison.levels();
    // The best errors are the hardest to get.
    let told = levels.len().saturating_sub(LEVELS_TOLD);
    let mut sentences: Vec<String> = levels[told..].iter().map(|level| at_level(comparison, level)).collect();
    let ended = comparison.curves.iter().filter(|curve| curve.done().next().is_some()).count();
    if ended > 1 && levels.is_empty() {
        sentences.push("No two schemes reach the same error, so their speeds cannot be compared.".to_owned());
    }
    let orders = comparison.curves.iter().filter_map(|curve| {
        // Never "-0.00".
        let order = (100.0 * curve.order()?).round() / 100.0 + 0.0;
        Some(format!("{} as {}^{order:.2}", curve.scheme, curve.setting))
    });
    let orders: Vec<_> = orders.collect();
    if !orders.is_empty() {
        sentences.push(format!("Above the floor errors go {}.", orders.join(", ")));
    }
    // What is exact shows the noise itself.
    let noise = comparison.curves.iter().filter(|curve| !curve.setting.is_empty());
    let noise: Vec<_> =
        noise.filter(|curve| curve.done().any(|(_, scores)| scores.is_noise())).map(Curve::name).collect();
    if !noise.is_empty() {
        sentences.push(format!("At their best not to be told from the right answer: {}.", noise.join("; ")));
    }
    if comparison.interrupted {
        sentences.push("The comparison was interrupted.".to_owned());
    }
    sentences
}

/// Of a scheme with several settings the fastest counts.
fn at_level(comparison: &Comparison, level: &Level) -> String {
    let mut costs: Vec<(&str, f64)> = Vec::new();
    for &(curve, seconds) in &level.costs {
        let scheme = comparison.curves[curve].scheme;
        if costs.iter().all(|known| known.0 != scheme) {
            costs.push((scheme, seconds));
        }
    }
    let (fastest, seconds) = costs[0];
    let mut sentence = format!("At an error of {:e}: {fastest} {}", level.error, quantity(seconds, "s"));
    for (scheme, cost) in &costs[1..] {
        let ratio = cost / seconds;
        let _ = write!(sentence, ", {scheme} {ratio:.*} times that", usize::from(ratio < 10.0));
    }
    let ran = comparison.curves.iter().filter(|curve| refused(curve).is_none()).map(|curve| curve.scheme);
    let mut absent: Vec<_> = ran.filter(|scheme| costs.iter().all(|known| known.0 != *scheme)).collect();
    absent.dedup();
    if !absent.is_empty() {
        let _ = write!(sentence, "; not reached by {}", absent.join(", "));
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
    match parts.abs() {
        0.0 => "0 %".to_owned(),
        size if !(0.01..1e3).contains(&size) => format!("{parts:.0e} %"),
        size => format!("{parts:.*} %", (1 - size.log10().floor() as i32).clamp(0, 3) as usize),
    }
}

fn deviation(scores: &Scores, quantity: usize) -> String {
    let value = scores.deviations[quantity];
    let sign = if value > 0.0 { "+" } else { "" };
    marked(value.abs() <= scores.floors[quantity], &format!("{sign}{}", percent(value)))
}

/// What needs no mark.
const EXACT: [&str; 2] = ["0", "0 %"];

fn marked(noise: bool, text: &str) -> String {
    if noise && !EXACT.contains(&text) { format!("~{text}") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::compare::fake::{FLOOR, comparison};

    #[test]
    fn the_text_fits_a_terminal_and_says_who_is_faster() {
        for regime in [Regime::Pointwise, Regime::Statistical] {
            let text = comparison_text(&comparison(regime));
            let table_or_words = |line: &&str| !line.contains("stopped at") && !line.contains("refused");
            assert!(text.lines().filter(table_or_words).all(|line| line.chars().count() <= WIDTH), "{text}");
            let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
            for part in [
                "At an error of 1e-2: event-driven 10.00 ms, trapezoidal 10 times that; not reached by soft-sphere.",
                "trapezoidal as step^1.00",
                "refused: run.scheme: it cannot do this",
            ] {
                assert!(words.contains(part), "without {part:?}:\n{text}");
            }
            assert_eq!(words.matches("it cannot do this").count(), 1, "{text}");
        }
    }

    #[test]
    fn what_is_below_the_floor_is_marked() {
        assert_eq!([marked(true, "0.80 %"), marked(false, "3 %"), marked(true, "0 %")], ["~0.80 %", "3 %", "0 %"]);
        let scores = |error: f64| Scores {
            error,
            floor: FLOOR,
            distance: None,
            deviations: [error; 7],
            floors: [FLOOR; 7],
            overlap: 0.0,
            lost: 0,
            energy_residual: 0.0,
        };
        let shown = [0.5 * FLOOR, -0.22, 1e-7, 0.0, 2e5].map(|error| deviation(&scores(error), 0));
        assert_eq!(shown, ["~+0.10 %", "-22 %", "~+1e-5 %", "0 %", "+2e7 %"]);
    }
}
