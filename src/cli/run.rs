//! `impinge run`

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Instant;

use cpu_time::ProcessTime;
use impinge::output::{self, Folder, Recorder};
use impinge::scene::Scheme;
use impinge::scheme::{Broken, LARGEST_OVERLAP_WITH_FORCES};
use impinge::simulation::Simulation;
use impinge::source::Nozzle;
use miette::miette;

use super::progress::ProgressLine;
use super::{Ending, Failure, SceneArgs, catch_interrupt, print, report};

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
    let (clock, processor) = (Instant::now(), ProcessTime::now());
    let mut simulation = Simulation::new(&file.scene, file.folder()).map_err(|invalid| file.locate(invalid))?;
    let folder = Folder::begin(&args.folder(), args.force).map_err(|error| Failure::Input(report(&error)))?;
    let mut recorder = Recorder::new(&file.scene, simulation.surface().into(), folder)
        .map_err(|error| Failure::Run(report(&error)))?;

    let (interrupted, failed) = (catch_interrupt()?, recorder.failure_flag());
    let mut line = ProgressLine::new(&file.scene.run, args.quiet);
    let run = simulation.run(&mut recorder, &mut |progress| {
        line.show(&progress);
        let stop = interrupted.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed);
        if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    line.clear();

    let outcome = match run {
        Ok(outcome) => outcome,
        Err(broken) => {
            let kept = recorder.abandon().map_err(|error| Failure::Run(report(&error)))?;
            let remedy = match broken {
                Broken::Jammed { .. } => {
                    "grains that lose much in every collision gather and collide ever faster: raise `restitution` or lower `friction`"
                }
                Broken::Singular { .. } => {
                    "shorten the sub-step, or give grains that attract each other a radius that keeps them apart"
                }
                Broken::Unconverged { .. } => "shorten the step: forces change too much within it",
                Broken::OutOfPlane { .. } => "give the scene a surface that does not change along y",
                Broken::Overlap { allowed, .. } if allowed == LARGEST_OVERLAP_WITH_FORCES => {
                    "take a shorter `substep` or a smaller `run.penetration`: the overlap of grains under unequal forces goes with the square of the sub-step"
                }
                Broken::NotANumber { .. } if file.scene.run.scheme != Scheme::EventDriven => "take shorter steps",
                Broken::Overlap { .. } | Broken::NotANumber { .. } => "please report the scene",
            };
            let help = format!("{remedy}; what was measured until then is in {}", kept.display());
            return Err(Failure::Run(miette!(help = help, "{broken}")));
        }
    };
    let sub_steps = simulation.sub_steps().map_err(|broken| Failure::Run(miette!("{broken}")))?;
    let outcome = output::Outcome {
        sub_steps,
        steps: simulation.steps(),
        interrupted: outcome.interrupted,
        entries_deferred: simulation.nozzles().iter().map(Nozzle::deferred).sum(),
        cpu_seconds: processor.elapsed().as_secs_f64(),
        wall_seconds: clock.elapsed().as_secs_f64(),
    };
    let (summary, written) = recorder.finish(&outcome).map_err(|error| Failure::Run(report(&error)))?;
    print(&format!("{summary}\nwritten to {}\n", written.display()))?;
    Ok(if outcome.interrupted { Ending::Interrupted } else { Ending::Done })
}
