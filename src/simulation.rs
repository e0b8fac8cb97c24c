//! A stand-in for the engine.

use std::ops::ControlFlow;
use std::path::Path;

use crate::scene::{Invalid, Scene};
use crate::scheme::Observer;

/// A run.
pub struct Simulation {
    until: f64,
}

/// How far a run is.
pub struct Progress {
    /// Simulated time, s.
    pub time: f64,
    /// Collisions so far.
    pub collisions: u64,
    /// Grains inside.
    pub inside: usize,
}

/// How a run ended.
pub struct Outcome {
    /// Whether it was interrupted.
    pub interrupted: bool,
    /// Simulated time at the end, s.
    pub time: f64,
}

/// A broken invariant.
#[derive(Debug, thiserror::Error)]
#[error("broken")]
pub struct Broken;

impl Simulation {
    /// A new run.
    pub fn new(scene: &Scene, _folder: &Path) -> Result<Self, Invalid> {
        Ok(Self { until: scene.run.until })
    }

    /// Runs.
    pub fn run(
        &mut self,
        _observer: &mut impl Observer,
        watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Outcome, Broken> {
        let interrupted = watch(Progress { time: 0.0, collisions: 0, inside: 0 }).is_break();
        Ok(Outcome { interrupted, time: self.until })
    }
}
