//! A comparison of schemes as files.

mod text;

use std::io::{self, Write};
use std::path::PathBuf;

use serde_json::{Value, json};

pub use self::text::comparison_text;
use super::plots::speed_against_error;
use super::tables::table;
use super::{Error, Folder};
use crate::study::compare::{Comparison, Entry, PROBE, QUANTITIES, Regime, Statistics};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::compare::fake::comparison;

    fn rows(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Vec<std::collections::HashMap<String, String>> {
        let mut bytes = Vec::new();
        write(&mut bytes).unwrap();
        csv::Reader::from_reader(bytes.as_slice()).deserialize().map(Result::unwrap).collect()
    }

    #[test]
    fn every_run_is_a_row_and_what_failed_says_why() {
        for regime in [Regime::Pointwise, Regime::Statistical] {
            let rows = rows(|out| write_runs(out, &comparison(regime)));
            assert_eq!(rows.len(), 1 + 4 + 5 + 2);
            let step = &rows[2];
            assert_eq!([&step["scheme"], &step["setting"], &step["value"]], ["trapezoidal", "step", "0.1"]);
            assert_eq!([&step["cpu_seconds"], &step["error"], &step["status"]], ["0.01", "0.1", "done"]);
            assert_eq!([&step["energy_all_hits_error"], &step["energy_all_hits_floor"]], ["0.05", "0.002"]);
            assert_eq!(step["position_error"].is_empty(), regime == Regime::Statistical);
            let slow = &rows[8];
            assert_eq!((slow["error"].as_str(), slow["lost"].as_str()), ("", ""));
            assert_eq!(slow["status"], "stopped at t = 3.000e-2 s after 60 s of processor time");
        }
    }

    #[test]
    fn the_ensemble_has_means_deviations_and_standard_errors() {
        let rows = rows(|out| write_ensemble(out, &comparison(Regime::Statistical)));
        assert_eq!(rows.len(), QUANTITIES.len());
        let number = |name: &str| rows[1][name].parse::<f64>().unwrap();
        assert_eq!((rows[1]["quantity"].as_str(), number("mean"), number("members")), ("energy_all_hits", 1.1, 2.0));
        approx::assert_relative_eq!(number("standard_deviation"), 0.02_f64.sqrt(), max_relative = 1e-14);
        approx::assert_relative_eq!(number("standard_error"), 0.1, max_relative = 1e-14);
    }

    #[test]
    fn the_summary_names_regime_orders_and_levels() {
        let json = summary(&comparison(Regime::Statistical));
        assert_eq!(json["reference"]["regime"], "statistical");
        assert_eq!(json["reference"]["quantities"]["grain_grain"]["mean"], 1.1);
        assert_eq!(json["curves"][2]["failed"], 2);
        assert_eq!(json["levels"][0]["fastest_first"][0]["scheme"], "event-driven");
        assert!(json["curves"][0]["observed_order"].is_null());
    }
}
