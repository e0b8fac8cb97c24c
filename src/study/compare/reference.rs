//! The right answer of a scene, and how well it can be known at all.
//!
//! Starts that differ by next to nothing tell whether a scene is chaotic before it ends: if their grains end side by side, there is one answer for each
//! grain; if not, only means over an ensemble of starts are an answer, and their scatter is the floor below which a difference means nothing.

use super::Plan;
use super::errors::Distance;
use super::ladder::{self, REFERENCE_FINER, Scales};
use super::measure::{Measured, Quantities};
use super::runner::{Failed, Runner, measured};
use super::statistics::Statistics;
use crate::scene::{Scene, Substep};
use crate::simulation::Simulation;

/// By how much the starts differ that tell whether a scene is chaotic, radii: far above the rounding of positions, far below what matters.
pub const PROBE: f64 = 1e-10;
/// How many of them there are.
const PROBES: u32 = 4;
/// If starts that are [`PROBE`] apart end within so many radii, the error of each grain means something: a cause has grown by 1e4 at the most, and
/// errors down to this size can be told from chaos.
pub const SPREAD: f64 = 1e-6;
/// By how much the starts of an ensemble differ, radii: 1e-10 m for grains of 1 cm, and no measurement of such a start could tell.
pub const ENSEMBLE: f64 = 1e-8;
/// The error of a second-order scheme falls by the square of the sub-step: that of the reference is so much smaller than that of the finest run.
const RICHARDSON: f64 = REFERENCE_FINER * REFERENCE_FINER - 1.0;

/// A difference of fewer standard deviations than this may be chance: one in twenty of normal ones is larger.
pub const DEVIATIONS: f64 = 2.0;

/// What runs are compared by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    /// Each grain at the end: the scene is over before it is chaotic.
    Pointwise,
    /// Means over an ensemble.
    Statistical,
}

/// The right answer.
#[derive(Clone, Debug)]
pub struct Reference {
    /// What runs are compared by.
    pub regime: Regime,
    /// How far starts that are [`PROBE`] radii apart are from each other at the end.
    pub spread: Distance,
    /// By how much the starts of the ensemble differ, radii.
    pub displacement: f64,
    /// The runs of the ensemble.
    pub members: Vec<Quantities>,
    /// What they say together; where the regime is pointwise, the mean is that of the one right answer.
    pub statistics: Quantities<Statistics>,
    /// How well the end of each grain is known.
    pub floor: Distance,
    /// Sub-step of the reference, s; none where no force acts.
    pub sub_step: Option<f64>,
    pub(super) exact: Measured,
    pub(super) scales: Scales,
}

impl Reference {
    /// Finds the right answer of a planned scene.
    pub(super) fn find(plan: &Plan, runner: &mut Runner<'_>) -> Result<Self, Failed> {
        let scene_step = sub_step(plan, runner)?;
        let sub_step = scene_step.map(ladder::finest_sub_step);
        // Chaos is the same with any sub-step: the finest of the ladder shows it as well as that of the reference.
        let scene = ladder::event_driven(&plan.scene, sub_step);
        let base = runner.must(plan, &scene, None, "event-driven run")?;
        let probes = displaced(plan, runner, &scene, (PROBE, PROBES), "displaced start", |run| {
            (Distance::between(&run, &base, &plan.domain), run.quantities)
        })?;
        let spread = probes.iter().map(|probe| probe.0).fold(Distance::default(), Distance::max);
        let members: Vec<_> = probes.into_iter().map(|probe| probe.1).collect();
        let scales = Scales { sub_step: scene_step, flight: base.radius / base.speed_scale() };
        let found = Self {
            regime: Regime::Pointwise,
            spread,
            displacement: PROBE,
            statistics: statistics(&members),
            members,
            floor: spread,
            sub_step,
            exact: base,
            scales,
        };
        if spread.position <= SPREAD {
            found.of_each_grain(plan, runner)
        } else {
            found.of_an_ensemble(plan, runner, &scene)
        }
    }

    /// Before chaos: one run is right, where forces act that of much finer sub-steps.
    fn of_each_grain(mut self, plan: &Plan, runner: &mut Runner<'_>) -> Result<Self, Failed> {
        if let Some(finest) = self.sub_step {
            let finer = finest / REFERENCE_FINER;
            let exact = runner.must(plan, &ladder::event_driven(&plan.scene, Some(finer)), None, "finer sub-steps")?;
            let own = Distance::between(&self.exact, &exact, &plan.domain).times(1.0 / RICHARDSON);
            (self.sub_step, self.floor, self.exact) = (Some(finer), self.floor.max(own), exact);
        }
        for (statistics, right) in self.statistics.iter_mut().zip(self.exact.quantities) {
            statistics.mean = right;
        }
        Ok(self)
    }

    /// Beyond chaos: means over starts that no measurement could tell apart.
    fn of_an_ensemble(mut self, plan: &Plan, runner: &mut Runner<'_>, scene: &Scene) -> Result<Self, Failed> {
        let size = (ENSEMBLE, plan.options.ensemble());
        self.members = displaced(plan, runner, scene, size, "ensemble", |run| run.quantities)?;
        self.statistics = statistics(&self.members);
        (self.regime, self.displacement) = (Regime::Statistical, ENSEMBLE);
        Ok(self)
    }

    /// The right values of the quantities.
    #[must_use]
    pub fn values(&self) -> Quantities {
        self.statistics.map(|statistics| statistics.mean)
    }

    /// What the deviation of the mean of `members` runs must exceed to mean something, over the right value: [`DEVIATIONS`] standard deviations of what
    /// right runs would show.
    #[must_use]
    pub fn floors(&self, members: u32) -> Quantities {
        self.statistics.map(|statistics| {
            let deviation = match self.regime {
                Regime::Pointwise => statistics.deviation,
                Regime::Statistical => statistics.deviation_from(members),
            };
            if statistics.mean == 0.0 { 0.0 } else { DEVIATIONS * deviation / statistics.mean.abs() }
        })
    }
}

/// Sub-step of the scene, s; where its tolerance chooses it, the mean of a run.
fn sub_step(plan: &Plan, runner: &mut Runner<'_>) -> Result<Option<f64>, Failed> {
    let scene = &plan.scene;
    match scene.substep() {
        _ if !scene.has_forces() => Ok(None),
        Substep::Fixed(step) => Ok(Some(step)),
        Substep::Chosen(_) => {
            let scene = ladder::event_driven(scene, None);
            let mut simulation = Simulation::new(&scene, &plan.folder)?;
            let (ended, _) = runner.run(plan, &mut simulation, &scene, f64::INFINITY, "choice of sub-steps");
            measured(ended)?;
            let count = simulation.sub_steps()?.map_or(0, |sub_steps| sub_steps.count);
            Ok(Some((scene.run.until - scene.run.start) / count.max(1) as f64))
        }
    }
}

/// What is `of` interest of so many runs from starts that are displaced by up to so many radii.
fn displaced<T>(
    plan: &Plan,
    runner: &mut Runner<'_>,
    scene: &Scene,
    (radii, count): (f64, u32),
    what: &str,
    of: impl Fn(Measured) -> T,
) -> Result<Vec<T>, Failed> {
    let run = |member| {
        let displacement = Some(plan.displacement(radii, member));
        runner.must(plan, scene, displacement, &format!("{what} {member} of {count}")).map(&of)
    };
    (1..=count).map(run).collect()
}

fn statistics(members: &[Quantities]) -> Quantities<Statistics> {
    std::array::from_fn(|quantity| Statistics::of(&members.iter().map(|member| member[quantity]).collect::<Vec<_>>()))
}
