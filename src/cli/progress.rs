//! The line that shows how far a run is.

use std::time::{Duration, Instant};

use impinge::scene::Run;
use impinge::scheme::Progress;
use indicatif::{HumanCount, HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How often the line changes: often enough to look alive, too seldom to cost the run anything.
const INTERVAL: Duration = Duration::from_millis(100);

/// Steps of the bar from start to end.
const STEPS: f64 = 1000.0;

/// Percent, simulated time, collisions, speed and time left, on standard error; nothing when that is no terminal.
pub(super) struct ProgressLine {
    bar: ProgressBar,
    start: f64,
    until: f64,
    began: Instant,
    shown: Option<Instant>,
}

impl ProgressLine {
    pub(super) fn new(run: &Run, quiet: bool) -> Self {
        Self::labelled(run, quiet, "")
    }

    /// The same with a word on what the run is for.
    pub(super) fn labelled(run: &Run, quiet: bool, label: &str) -> Self {
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let style =
            ProgressStyle::with_template("{prefix}{percent:>3} % [{bar:30}] {msg}").expect("the template is right");
        let bar = ProgressBar::with_draw_target(Some(STEPS as u64), target).with_style(style.progress_chars("=> "));
        if !label.is_empty() {
            bar.set_prefix(format!("{label}: "));
        }
        Self { bar, start: run.start, until: run.until, began: Instant::now(), shown: None }
    }

    pub(super) fn show(&mut self, progress: &Progress) {
        if self.bar.is_hidden() || self.shown.is_some_and(|shown| shown.elapsed() < INTERVAL) {
            return;
        }
        self.shown = Some(Instant::now());
        let done = ((progress.time - self.start) / (self.until - self.start)).clamp(0.0, 1.0);
        self.bar.set_message(describe(progress, done, self.began.elapsed().as_secs_f64()));
        self.bar.set_position((done * STEPS) as u64);
    }

    /// Takes the line away, so that nothing of it mixes with the results.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// How many runs of a study are done, on standard error; nothing when that is no terminal.
pub(super) struct StudyLine(ProgressBar);

impl StudyLine {
    pub(super) fn new(study: &'static str) -> Self {
        let style =
            ProgressStyle::with_template("{percent:>3} % [{bar:30}] {msg}, {elapsed}").expect("the template is right");
        let bar = ProgressBar::with_draw_target(Some(STEPS as u64), ProgressDrawTarget::stderr());
        Self(bar.with_style(style.progress_chars("=> ")).with_message(study))
    }

    /// Shows the part that is done, 0 to 1; the bar itself sees to it that it does not change too often.
    pub(super) fn show(&self, done: f64) {
        if !self.0.is_hidden() {
            self.0.set_position((done * STEPS) as u64);
        }
    }

    /// Takes the line away.
    pub(super) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// `done` is the simulated part of the run, 0 to 1; `elapsed` the time on the clock, s.
fn describe(progress: &Progress, done: f64, elapsed: f64) -> String {
    let speed = progress.collisions as f64 / elapsed.max(f64::MIN_POSITIVE);
    let left = match Duration::try_from_secs_f64(elapsed * (1.0 - done) / done) {
        Ok(left) => format!("{} left", HumanDuration(left)),
        Err(_) => "time left unknown".to_owned(),
    };
    let collisions = HumanCount(progress.collisions);
    format!("t = {:.4e} s, {collisions} collisions, {} per second, {left}", progress.time, HumanCount(speed as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_in_proportion_and_unknown_at_the_start() {
        let progress = Progress { time: 0.5, collisions: 3000, inside: 10 };
        let text = describe(&progress, 0.25, 2.0);
        assert_eq!(text, "t = 5.0000e-1 s, 3,000 collisions, 1,500 per second, 6 seconds left");
        assert!(describe(&progress, 0.0, 0.0).ends_with("time left unknown"));
        assert!(describe(&progress, 0.0, 1.0).ends_with("time left unknown"));
    }
}
