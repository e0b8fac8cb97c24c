//! What a study found, as files: a verdict to read, the same for programs, tables and pictures.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use super::tables::table;
use super::{Error, Folder, plots};
use crate::study::reproduce::{Finding, Report, Study, Verdict};

/// The verdict of a study: on the terminal, in `verdict.md` and in `summary.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Reproduction {
    /// Name of the study.
    pub study: &'static str,
    /// What it is about.
    pub title: &'static str,
    /// Who states it, and where.
    pub source: &'static str,
    /// What is stated.
    pub statement: &'static str,
    /// Version of Impinge.
    pub version: &'static str,
    /// Whether runs were fewer and smaller.
    pub quick: bool,
    /// Seed of the first run.
    pub seed: u64,
    /// Whether all that was put to the test agrees.
    pub verdict: Verdict,
    /// Each claim and what it comes to.
    pub findings: Vec<Finding>,
}

impl Reproduction {
    /// The verdict of `report`, which `study` has given.
    #[must_use]
    pub fn new(study: &Study, quick: bool, seed: u64, report: &Report) -> Self {
        let Study { name, title, source, statement, .. } = study;
        Self {
            study: name,
            title,
            source,
            statement,
            version: env!("CARGO_PKG_VERSION"),
            quick,
            seed,
            verdict: report.verdict(),
            findings: report.findings.clone(),
        }
    }

    /// Writes everything into `folder` and gives it its name.
    ///
    /// # Errors
    /// What could not be written, or those of [`Folder::finish`].
    pub fn write(&self, report: &Report, folder: Folder) -> Result<PathBuf, Error> {
        folder.write("verdict.md", |file| write!(file, "{self}"))?;
        folder.write("summary.json", |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)
        })?;
        for numbers in &report.tables {
            let rows = || numbers.rows.iter();
            folder.write(&format!("tables/{}.csv", numbers.name), |file| table(file, numbers.columns, rows()))?;
        }
        for picture in &report.pictures {
            let name = format!("pictures/{}.svg", picture.name());
            let svg = plots::drawn(picture).map_err(folder.failed(&name))?;
            folder.write(&name, |file| file.write_all(svg.as_bytes()))?;
        }
        folder.finish()
    }
}

impl fmt::Display for Reproduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "# {}: {}\n", self.study, self.title)?;
        writeln!(f, "{}:\n{}\n", self.source, self.statement)?;
        for Finding { claim, measured, verdict } in &self.findings {
            match verdict {
                Verdict::Measured => writeln!(f, "* {claim}:\n  {measured}")?,
                _ => writeln!(f, "* {claim}:\n  {measured}: **{verdict}**")?,
            }
        }
        let extent = if self.quick { "quick" } else { "full" };
        writeln!(f, "\nVerdict: **{}** ({extent} study, seed {}, impinge {})", self.verdict, self.seed, self.version)
    }
}
