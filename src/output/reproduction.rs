//! What a study found, as files: a verdict to read, the same for programs, tables and pictures.

use std::fmt;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::tables::table;
use super::{Error, Folder, plots};
use crate::shown::Picture;
use crate::study::reproduce::{Finding, Report, Study, Verdict};

/// The file that programs read.
const SUMMARY: &str = "summary.json";
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The verdict of a study: on the terminal, in `verdict.md` and in `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reproduction {
    /// Name of the study.
    pub study: String,
    /// What it is about.
    pub title: String,
    /// Who states it, and where.
    pub source: String,
    /// What is stated.
    pub statement: String,
    /// Version of Impinge.
    pub version: String,
    /// Whether runs were fewer and smaller.
    pub quick: bool,
    /// Seed of the first run.
    pub seed: u64,
    /// Whether all that was put to the test agrees.
    pub verdict: Verdict,
    /// Each claim and what it comes to.
    pub findings: Vec<Finding>,
    /// File and title of each picture.
    pub pictures: Vec<[String; 2]>,
}

impl Reproduction {
    /// The verdict of `report`, which `study` has given.
    #[must_use]
    pub fn new(study: &Study, quick: bool, seed: u64, report: &Report) -> Self {
        let Study { name, title, source, statement, .. } = study;
        let picture = |picture: &Picture| [format!("pictures/{}.svg", picture.name()), picture.title().to_owned()];
        let [study, title, source, statement] = [name, title, source, statement].map(|text| (*text).to_owned());
        Self {
            study,
            title,
            source,
            statement,
            version: VERSION.to_owned(),
            quick,
            seed,
            verdict: report.verdict(),
            findings: report.findings.clone(),
            pictures: report.pictures.iter().map(picture).collect(),
        }
    }

    /// What `folder` holds of this study, if it is complete and of the same version, extent and seed.
    #[must_use]
    pub fn known(study: &Study, quick: bool, seed: u64, folder: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(SUMMARY)).ok()?;
        let known: Self = serde_json::from_str(&text).ok()?;
        let same = (known.study.as_str(), known.version.as_str(), known.quick, known.seed)
            == (study.name, VERSION, quick, seed);
        same.then_some(known)
    }

    /// Writes everything into `folder` and gives it its name.
    ///
    /// # Errors
    /// What could not be written, or those of [`Folder::finish`].
    pub fn write(&self, report: &Report, folder: Folder) -> Result<PathBuf, Error> {
        folder.write("verdict.md", |file| write!(file, "{self}"))?;
        folder.write(SUMMARY, |file| {
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

/// All studies of one command on one page, beside the folder of their folders.
#[derive(Debug)]
pub struct Overview {
    page: PathBuf,
    /// The folder of their folders, as the page calls it.
    folder: String,
    studies: Vec<Reproduction>,
}

impl Overview {
    /// The page `target.md` of studies whose folders will be in `target`.
    ///
    /// # Errors
    /// [`Error::Occupied`] if there is such a page and no `force`.
    pub fn begin(target: &Path, force: bool) -> Result<Self, Error> {
        let mut page = target.as_os_str().to_owned();
        page.push(".md");
        let page = PathBuf::from(page);
        if page.exists() && !force {
            return Err(Error::Occupied { folder: page });
        }
        let folder = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { page, folder, studies: Vec::new() })
    }

    /// Adds a study whose results are written, and writes the page anew, so that it is there even if a later study is broken off.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn add(&mut self, study: Reproduction) -> Result<(), Error> {
        self.studies.push(study);
        let failed = |source| Error::Write { path: self.page.clone(), source };
        let beside = self.page.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut file = tempfile::NamedTempFile::new_in(beside).map_err(failed)?;
        file.write_all(self.to_string().as_bytes()).map_err(failed)?;
        file.persist(&self.page).map_err(|error| failed(error.error))?;
        Ok(())
    }

    /// Where the page is.
    #[must_use]
    pub fn page(&self) -> &Path {
        &self.page
    }
}

impl fmt::Display for Overview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(first) = self.studies.first() else { return Ok(()) };
        let quick = if first.quick { " --quick" } else { "" };
        writeln!(f, "# What papers state, put to the test\n")?;
        writeln!(f, "Written by `impinge reproduce all{quick} --seed {}`, Impinge {}.\n", first.seed, first.version)?;
        writeln!(f, "| study | what it is about | agrees | differs | undecided |\n|---|---|---|---|---|")?;
        for study in &self.studies {
            let count = |verdict| study.findings.iter().filter(|finding| finding.verdict == verdict).count();
            let [agrees, differs, undecided] = [Verdict::Agrees, Verdict::Differs, Verdict::Undecided].map(count);
            let (name, title) = (&study.study, cell(&study.title));
            writeln!(f, "| [{name}](#{}) | {title} | {agrees} | {differs} | {undecided} |", anchor(name))?;
        }
        for study in &self.studies {
            writeln!(f, "\n<a id=\"{}\"></a>\n\n## {}: {}\n", anchor(&study.study), study.study, study.title)?;
            writeln!(f, "{}: {}\n", study.source, study.statement)?;
            writeln!(f, "| claim | measured | verdict |\n|---|---|---|")?;
            for Finding { claim, measured, verdict } in &study.findings {
                writeln!(f, "| {} | {} | {verdict} |", cell(claim), cell(measured))?;
            }
            for [file, title] in &study.pictures {
                writeln!(f, "\n![{title}]({}/{}/{file})", self.folder, study.study)?;
            }
        }
        Ok(())
    }
}

/// A text that may stand in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

/// What links to a study call it.
fn anchor(name: &str) -> String {
    format!("study-{name}")
}
