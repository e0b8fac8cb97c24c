//! Makes the runs, one after the other and on one thread.

use std::ops::ControlFlow;

use super::Plan;
use super::measure::{Ended, Measured, run};
use crate::scene::{Invalid, Scene};
use crate::scheme::{Broken, Progress};
use crate::simulation::Simulation;
use crate::source::Displacement;

/// What is told of the run that is going on: what it is for, and how far it is; it may break off.
pub type Watch<'a> = dyn FnMut(&str, &Progress) -> ControlFlow<()> + Send + 'a;

/// Why there is no comparison.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Failed {
    /// The scene cannot be run.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// The reference itself breaks off.
    #[error("the event-driven reference broke off: {0}")]
    Broken(#[from] Broken),
    /// Somebody stopped it before there was a reference.
    #[error("interrupted before there was a reference to compare with")]
    Interrupted,
    /// The system gives no thread.
    #[error("no thread to run on: {0}")]
    NoThread(String),
}

/// Makes runs and tells about them.
pub(super) struct Runner<'a> {
    watch: &'a mut Watch<'a>,
}

impl<'a> Runner<'a> {
    pub(super) fn new(watch: &'a mut Watch<'a>) -> Self {
        Self { watch }
    }

    /// Runs for `budget` seconds of the processor at the most; gives how it ended and the seconds that it took.
    pub(super) fn run(
        &mut self,
        plan: &Plan,
        simulation: &mut Simulation,
        scene: &Scene,
        budget: f64,
        what: &str,
    ) -> (Ended, f64) {
        run(simulation, scene, &plan.surface, budget, &mut |progress| (self.watch)(what, progress))
    }

    /// A run that the rest depends on, however long it takes.
    pub(super) fn must(
        &mut self,
        plan: &Plan,
        scene: &Scene,
        displacement: Option<Displacement>,
        what: &str,
    ) -> Result<Measured, Failed> {
        let mut simulation = plan.simulation(scene, displacement)?;
        measured(self.run(plan, &mut simulation, scene, f64::INFINITY, what).0)
    }
}

/// What a run measured that had to come to its end.
pub(super) fn measured(ended: Ended) -> Result<Measured, Failed> {
    match ended {
        Ended::Done(measured) => Ok(*measured),
        Ended::Broken(broken) => Err(broken.into()),
        Ended::OverBudget { .. } | Ended::Interrupted => Err(Failed::Interrupted),
    }
}
