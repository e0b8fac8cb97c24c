//! The command line: what is asked for, and what the shell gets back.
//!
//! Results go to standard output, everything else (errors, progress) to standard error. Exit codes: 0 done, 1 the run failed,
//! 2 the command line or the scene is wrong, 130 interrupted by Ctrl-C.

mod check;
mod compare;
mod estimate;
mod forces;
mod progress;
mod reproduce;
mod run;
mod schema;

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Parser, Subcommand};
use impinge::output;
use impinge::scene::{Overrides, SceneError, SceneFile};
use miette::{MietteHandlerOpts, Report, miette};

/// Event-driven hard-sphere simulator for erosive jets.
#[derive(Parser)]
#[command(name = "impinge", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scene and write its results into a folder.
    Run(run::Args),
    /// Run a scene with every scheme: speed against error.
    Compare(compare::Args),
    /// Validate a scene and print what it would do.
    Check(check::Args),
    /// Put what papers state to the test: numbers, pictures and a verdict.
    Reproduce(reproduce::Args),
    /// Print the JSON schema of scene files.
    Schema,
}

/// A scene file and what the command line changes in it.
#[derive(clap::Args)]
struct SceneArgs {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Seed of every random draw.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// End of the run, s.
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    until: Option<f64>,
    /// Change one value, as in `--set contact.grain.restitution=0.5` or `--set source[0].count=10`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SceneArgs {
    fn read(&self) -> Result<SceneFile, Failure> {
        let overrides = Overrides { set: self.set.clone(), seed: self.seed, until: self.until };
        Ok(SceneFile::read(&self.scene, &overrides)?)
    }
}

/// How a command ended that did not fail.
enum Ending {
    Done,
    Interrupted,
}

/// Why a command failed.
enum Failure {
    /// The command line or the scene is wrong: nothing was run, nothing was written.
    Input(Report),
    /// The run itself failed: a broken invariant or a failed write.
    Run(Report),
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Input(error.into())
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Run(miette::miette!("cannot write to standard output: {error}"))
    }
}

/// Does what the command line says.
pub(crate) fn main() -> ExitCode {
    show_errors_plainly();
    let result = match &Cli::parse().command {
        Command::Run(args) => run::run(args),
        Command::Compare(args) => compare::compare(args),
        Command::Check(args) => check::check(args),
        Command::Reproduce(args) => reproduce::reproduce(args),
        Command::Schema => schema::schema(),
    };
    let (report, code) = match result {
        Ok(Ending::Done) => return ExitCode::SUCCESS,
        Ok(Ending::Interrupted) => return ExitCode::from(130),
        Err(Failure::Input(report)) => (report, 2),
        Err(Failure::Run(report)) => (report, 1),
    };
    // With standard error closed there is nobody left to tell; the exit code still says it.
    let _ = writeln!(io::stderr(), "Error: {report:?}");
    ExitCode::from(code)
}

/// Frames and colours only where somebody looks: a log or a script gets ASCII, and a line stays a line.
fn show_errors_plainly() {
    let set = miette::set_hook(Box::new(|_| {
        let options = MietteHandlerOpts::new().force_graphical(true);
        Box::new(match io::stderr().is_terminal() {
            true => options.build(),
            false => options.color(false).unicode(false).terminal_links(false).wrap_lines(false).build(),
        })
    }));
    set.expect("the hook is set once, before any error");
}

/// An output error with its remedy.
fn report(error: &output::Error) -> Report {
    miette!(help = error.remedy(), "{error}")
}

/// A flag that Ctrl-C raises, or the polite request of a batch system to end; what runs stops at its next look. A second one does
/// not wait for that.
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

/// Writes results to standard output. A reader that stops reading, as `head` does, is no failure.
fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => Ok(result?),
    }
}

/// A number as people write it: of many zeros in scientific form.
fn plain_or_scientific(number: f64) -> String {
    if number == 0.0 || (1e-3..1e6).contains(&number.abs()) { number.to_string() } else { format!("{number:e}") }
}

/// A number rounded to so many digits.
fn digits(number: f64, count: usize) -> f64 {
    format!("{number:.*e}", count - 1).parse().unwrap_or(number)
}
