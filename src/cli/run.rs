//! `impinge run`

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use impinge::simulation::Simulation;
use miette::miette;

use super::progress::ProgressLine;
use super::{Ending, Failure, SceneArgs};

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the results [default: the scene's name, in the current folder].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace the results of an earlier run in that folder.
    #[arg(long)]
    force: bool,
    /// Show no progress.
    #[arg(long)]
    quiet: bool,
}

impl Args {
    fn folder(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| PathBuf::from(self.scene.scene.file_stem().unwrap_or_default()))
    }
}

/// Runs a scene.
pub(super) fn run(args: &Args) -> Result<Ending, Failure> {
    let file = args.scene.read()?;
    let mut simulation = Simulation::new(&file.scene, file.folder()).map_err(|invalid| file.locate(invalid))?;

    // Here the output folder (args.folder(), args.force) is opened and the observers are made.
    let _ = (args.folder(), args.force);
    let mut observer = ();

    let interrupted = catch_interrupt()?;
    let mut line = ProgressLine::new(&file.scene.run, args.quiet);
    let outcome = simulation
        .run(&mut observer, &mut |progress| {
            line.show(&progress);
            if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .map_err(|broken| Failure::Run(miette!("{broken}")))?;
    line.clear();

    // Here the results are closed and the summary is printed (super::print).
    Ok(if outcome.interrupted { Ending::Interrupted } else { Ending::Done })
}

/// A flag that Ctrl-C raises; the run stops at its next look. A second Ctrl-C does not wait for that.
fn catch_interrupt() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|error| Failure::Run(miette!("cannot listen for Ctrl-C: {error}")))?;
    Ok(flag)
}
