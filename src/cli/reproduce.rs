//! `impinge reproduce`

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use impinge::output::{Folder, Overview, Reproduction};
use impinge::study::reproduce::{Error, Report, STUDIES, Settings, Study};
use miette::miette;

use super::progress::StudyLine;
use super::{Ending, Failure, catch_interrupt, print, report};

/// The name that stands for all studies.
const ALL: &str = "all";

#[derive(clap::Args)]
pub(super) struct Args {
    /// Name of a study, or `all`.
    #[arg(required_unless_present = "list")]
    name: Option<String>,
    /// List the studies.
    #[arg(long, conflicts_with = "name")]
    list: bool,
    /// Folder for the results; with `all` a folder of their folders, and a page on all of them beside it [default: the name, in the current folder].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Fewer and smaller runs: seconds instead of minutes, with larger uncertainties.
    #[arg(long)]
    quick: bool,
    /// Replace the results of an earlier study in that folder.
    #[arg(long)]
    force: bool,
    /// With `all`: keep the results of studies that the folder has already, of this version, extent and seed, as after Ctrl-C.
    #[arg(long)]
    resume: bool,
    /// Seed of the first run; the others count on from it.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=u64::from(u32::MAX)))]
    seed: u64,
}

/// Lists the studies, or computes them one after another; each has its results written before the next begins.
pub(super) fn reproduce(args: &Args) -> Result<Ending, Failure> {
    let Some(name) = &args.name else { return list() };
    let target = args.output.clone().unwrap_or_else(|| PathBuf::from(name));
    let overview =
        || Overview::begin(&target, args.force || args.resume).map_err(|error| Failure::Input(report(&error)));
    let mut overview = if name == ALL { Some(overview()?) } else { None };
    let studies: Vec<(&Study, PathBuf)> = match Study::named(name) {
        Some(study) => vec![(study, target)],
        None if name == ALL => STUDIES.iter().map(|&study| (study, target.join(study.name))).collect(),
        None => {
            let help = format!("did you mean `{}`? `impinge reproduce --list` lists all", Study::nearest(name).name);
            return Err(Failure::Input(miette!(help = help, "there is no study `{name}`")));
        }
    };
    // Whatever must not be replaced is found before the first study has taken its minutes.
    let begin = |(study, target): (&'static Study, PathBuf)| {
        let known = if args.resume { Reproduction::known(study, args.quick, args.seed, &target) } else { None };
        Ok((
            study,
            match known {
                Some(known) => Task::Known(known),
                None => Task::New(begin(&target, args.force)?),
            },
        ))
    };
    let begun = studies.into_iter().map(begin).collect::<Result<Vec<_>, Failure>>()?;
    let interrupted = catch_interrupt()?;
    for (study, task) in begun {
        let verdict = match task {
            Task::Known(known) => known,
            Task::New(folder) => {
                let Some((found, verdict)) = compute(study, args, &interrupted)? else {
                    return Ok(Ending::Interrupted);
                };
                let written = verdict.write(&found, folder).map_err(|error| Failure::Run(report(&error)))?;
                print(&format!("{verdict}written to {}\n\n", written.display()))?;
                verdict
            }
        };
        if let Some(overview) = &mut overview {
            overview.add(verdict).map_err(|error| Failure::Run(report(&error)))?;
        }
    }
    if let Some(overview) = overview {
        print(&format!("all of them: {}\n", overview.page().display()))?;
    }
    Ok(Ending::Done)
}

/// A study of a command.
enum Task {
    /// Its results are there.
    Known(Reproduction),
    /// It is to be computed, into this folder.
    New(Folder),
}

/// Computes a study; nothing where it was broken off.
fn compute(study: &Study, args: &Args, interrupted: &AtomicBool) -> Result<Option<(Report, Reproduction)>, Failure> {
    let line = StudyLine::new(study.name);
    let watch = |done| {
        line.show(done);
        if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let found = (study.compute)(&Settings { quick: args.quick, seed: args.seed, watch: &watch });
    line.clear();
    match found {
        Ok(found) => {
            let verdict = Reproduction::new(study, args.quick, args.seed, &found);
            Ok(Some((found, verdict)))
        }
        Err(Error::BrokenOff) => Ok(None),
        Err(error) => Err(Failure::Run(miette!("{}: {error}", study.name))),
    }
}

fn begin(target: &Path, force: bool) -> Result<Folder, Failure> {
    Folder::begin(target, force).map_err(|error| Failure::Input(report(&error)))
}

/// Prints the name of each study and what it is about.
fn list() -> Result<Ending, Failure> {
    let widest = STUDIES.iter().map(|study| study.name.len()).max().unwrap_or(0);
    let lines = STUDIES.iter().map(|study| format!("{:widest$}  {}\n", study.name, study.title));
    print(&lines.collect::<String>())?;
    Ok(Ending::Done)
}
