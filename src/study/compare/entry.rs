//! One setting of one scheme: its time and its errors.

use super::Plan;
use super::errors::{Distance, lost, relative, root_mean_square};
use super::ladder::Rung;
use super::measure::{Ended, Measured, Quantities};
use super::reference::{ENSEMBLE, Reference, Regime};
use super::runner::Runner;
use super::statistics::median;
use crate::scene::{Invalid, check};
use crate::scheme::Broken;
use crate::simulation::Simulation;

/// Why a run has no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The scheme cannot run this scene.
    #[error("refused: {0}")]
    Refused(#[from] Invalid),
    /// A broken invariant.
    #[error("broke off: {0}")]
    Broken(#[from] Broken),
    /// It used up its time of the processor.
    #[error("stopped at t = {time:.3e} s after {budget} s of processor time")]
    OverBudget {
        /// Simulated time, s.
        time: f64,
        /// Time of the processor that it had, s.
        budget: f64,
    },
    /// A coarser one did.
    #[error("not run: the one before took too long")]
    TooSlow,
    /// Somebody stopped the comparison.
    #[error("not run: interrupted")]
    Interrupted,
}

/// One setting of one scheme.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Value of the setting; none where there is none.
    pub value: Option<f64>,
    /// Median time of the processor of a run, set-up not included, s; none where it was not run.
    pub cpu_seconds: Option<f64>,
    /// How often that was measured.
    pub repeats: u32,
    /// Starts from which it was run.
    pub members: u32,
    /// How far it is from the right answer, or why that is not known.
    pub result: Result<Scores, Fault>,
}

/// How far a run is from the right answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Scores {
    /// The error: before chaos that of the position of the grain that is furthest off, over the mean radius; beyond, the root mean square of
    /// [`deviations`](Self::deviations) over the quantities that there are in the scene.
    pub error: f64,
    /// Below this an error means nothing.
    pub floor: f64,
    /// How far the grains are off; none beyond chaos.
    pub distance: Option<Distance>,
    /// Deviation of each quantity over its right value: above 0 where it is too large.
    pub deviations: Quantities,
    /// Below this a deviation means nothing.
    pub floors: Quantities,
    /// Deepest overlap at any event, over the smaller radius.
    pub overlap: f64,
    /// Grains that are missing, too many, or behind the surface.
    pub lost: u64,
    /// Energy that is not accounted for, over that of the run; below 0 where the scheme made it.
    pub energy_residual: f64,
}

impl Scores {
    /// Whether the error cannot be told from that of a right run.
    #[must_use]
    pub fn is_noise(&self) -> bool {
        self.error <= self.floor
    }
}

impl Entry {
    /// Makes the runs of a rung, unless the one `before` it shows that they would take too long.
    pub(super) fn make(
        plan: &Plan,
        runner: &mut Runner<'_>,
        reference: &Reference,
        rung: &Rung,
        what: &str,
        before: Option<&Entry>,
    ) -> Self {
        let mut entry =
            Self { value: rung.value, cpu_seconds: None, repeats: 0, members: 0, result: Err(Fault::TooSlow) };
        match before.map(|before| &before.result) {
            Some(Err(Fault::OverBudget { .. } | Fault::TooSlow)) => return entry,
            Some(Err(Fault::Interrupted)) => return Self { result: Err(Fault::Interrupted), ..entry },
            _ => {}
        }
        entry.result = entry.runs(plan, runner, reference, rung, what).map(|runs| {
            entry.members = runs.len() as u32;
            Scores::new(&runs, reference, plan)
        });
        entry
    }

    /// Makes the runs, and takes the time of the first. Beyond chaos all of them start displaced, as the ensemble does: the small grains of a
    /// displaced start shift its means by a little.
    fn runs(
        &mut self,
        plan: &Plan,
        runner: &mut Runner<'_>,
        reference: &Reference,
        rung: &Rung,
        what: &str,
    ) -> Result<Vec<Measured>, Fault> {
        check(&rung.scene)?;
        let mut run = |mut simulation: Simulation| {
            let (ended, seconds) = runner.run(plan, &mut simulation, &rung.scene, plan.options.budget(), what);
            (result(ended, plan.options.budget()), seconds)
        };
        // Numbers of their own: no start of the ensemble is compared with itself.
        let displacement = |member| plan.displacement(ENSEMBLE, u32::MAX - member);
        let (members, displaced) = match reference.regime {
            Regime::Pointwise => (1, false),
            Regime::Statistical => (plan.options.members(), true),
        };
        let start = |member| plan.simulation(&rung.scene, displaced.then(|| displacement(member)));
        let ready = start(0)?;
        let (first, seconds) = run(ready.clone());
        self.repeats = 1;
        self.cpu_seconds = Some(seconds);
        let mut runs = vec![first?];
        let mut times = vec![seconds];
        for _ in 1..plan.options.repeats(seconds) {
            let (again, seconds) = run(ready.clone());
            if again == Err(Fault::Interrupted) {
                return Err(Fault::Interrupted);
            }
            times.push(seconds);
        }
        self.repeats = times.len() as u32;
        self.cpu_seconds = median(times);
        for member in 1..members {
            runs.push(run(start(member)?).0?);
        }
        Ok(runs)
    }
}

fn result(ended: Ended, budget: f64) -> Result<Measured, Fault> {
    match ended {
        Ended::Done(measured) => Ok(*measured),
        Ended::Broken(broken) => Err(broken.into()),
        Ended::OverBudget { time } => Err(Fault::OverBudget { time, budget }),
        Ended::Interrupted => Err(Fault::Interrupted),
    }
}

impl Scores {
    /// Compares runs of one setting.
    fn new(runs: &[Measured], reference: &Reference, plan: &Plan) -> Self {
        let right = reference.values();
        let mean = |quantity: usize| runs.iter().map(|run| run.quantities[quantity]).sum::<f64>() / runs.len() as f64;
        let deviations: Quantities = std::array::from_fn(|quantity| relative(mean(quantity), right[quantity]));
        let floors = reference.floors(runs.len() as u32);
        let take_part = std::array::from_fn(|quantity| right[quantity] != 0.0 || deviations[quantity] != 0.0);
        let distance = (reference.regime == Regime::Pointwise)
            .then(|| Distance::between(&runs[0], &reference.exact, &plan.domain));
        let (error, floor) = match distance {
            Some(distance) => (distance.position, reference.floor.position),
            None => (root_mean_square(&deviations, &take_part), root_mean_square(&floors, &take_part)),
        };
        let worst = |of: fn(&Measured) -> f64| {
            runs.iter()
                .map(of)
                .reduce(|worst, other| if other.abs() > worst.abs() { other } else { worst })
                .unwrap_or(0.0)
        };
        Self {
            error,
            floor,
            distance,
            deviations,
            floors,
            overlap: worst(|run| run.overlap),
            lost: runs.iter().map(|run| lost(run, &reference.exact)).max().unwrap_or(0),
            energy_residual: worst(|run| run.energy_residual),
        }
    }
}
