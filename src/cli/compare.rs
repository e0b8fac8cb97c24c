//! `impinge compare`

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::builder::PossibleValuesParser;
use impinge::output::{Folder, comparison_text, write_comparison};
use impinge::study::compare::{Failed, Options, Plan, scheme_names};
use miette::miette;

use super::progress::ProgressLine;
use super::{Ending, Failure, SceneArgs, catch_interrupt, print, report};

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results [default: the scene's name and `_compare`, in the current folder].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace the results of an earlier run in that folder.
    #[arg(long)]
    force: bool,
    /// Show no progress.
    #[arg(long)]
    quiet: bool,
    /// Schemes to compare [default: all].
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = PossibleValuesParser::new(scheme_names()))]
    schemes: Vec<String>,
    /// Event-driven runs whose means are the reference where the scene is chaotic [default: 16].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000))]
    ensemble: Option<u32>,
    /// Displaced starts from which each setting of a scheme is run where the scene is chaotic [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    members: Option<u32>,
    /// Runs whose median is the CPU time [default: 31 below 10 ms, 3 below 1 s, else 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeats: Option<u32>,
    /// CPU time after which a run of a scheme is stopped, s [default: 60].
    #[arg(long, value_name = "S", value_parser = seconds)]
    budget: Option<f64>,
    /// A first look: ensemble of 4, every second setting, no repeats, 10 s for a run.
    #[arg(long)]
    quick: bool,
}

impl Args {
    fn folder(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| {
            let mut name = self.scene.scene.file_stem().unwrap_or_default().to_owned();
            name.push("_compare");
            name.into()
        })
    }

    fn options(&self) -> Options {
        Options {
            schemes: self.schemes.clone(),
            ensemble: self.ensemble,
            members: self.members,
            repeats: self.repeats,
            budget: self.budget,
            quick: self.quick,
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("give a number of seconds above 0".to_owned()),
    }
}

/// Compares the schemes on a scene.
pub(super) fn compare(args: &Args) -> Result<Ending, Failure> {
    let file = args.scene.read()?;
    let plan = Plan::new(&file.scene, file.folder(), args.options()).map_err(|invalid| file.locate(invalid))?;
    let folder = Folder::begin(&args.folder(), args.force).map_err(|error| Failure::Input(report(&error)))?;

    let interrupted = catch_interrupt()?;
    let mut shown: Option<(String, ProgressLine)> = None;
    let comparison = plan.run(&mut |what, progress| {
        if shown.as_ref().is_none_or(|(before, _)| before != what) {
            if let Some((_, line)) = &shown {
                line.clear();
            }
            shown = Some((what.to_owned(), ProgressLine::labelled(&file.scene.run, args.quiet, what)));
        }
        if let Some((_, line)) = &mut shown {
            line.show(progress);
        }
        if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    if let Some((_, line)) = &shown {
        line.clear();
    }

    let comparison = match comparison {
        Ok(comparison) => comparison,
        Err(failed @ Failed::Interrupted) => {
            print(&format!("{failed}; nothing was written\n"))?;
            return Ok(Ending::Interrupted);
        }
        Err(Failed::Invalid(invalid)) => return Err(file.locate(invalid).into()),
        Err(failed) => return Err(Failure::Run(miette!(help = "`impinge run` tells more about it", "{failed}"))),
    };
    let written = write_comparison(&comparison, folder).map_err(|error| Failure::Run(report(&error)))?;
    print(&format!("{}\nwritten to {}\n", comparison_text(&comparison), written.display()))?;
    Ok(if comparison.interrupted { Ending::Interrupted } else { Ending::Done })
}
