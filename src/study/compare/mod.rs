//! Speed against error: how long each scheme takes for a scene, and how far it then is from the right answer.
//!
//! The right answer is that of the event-driven scheme, which is exact where no force acts. Before a scene is chaotic it is one for each grain; after
//! that it is a mean over an ensemble of starts, known no better than its scatter ([`Reference`]). Each scheme runs over a range of the setting by
//! which its accuracy is chosen, all of them on one thread, with the same grains, surface, laws and observers.
//!
//! ```
//! use impinge::scene::Scene;
//! use impinge::study::compare::{Options, Plan, Regime};
//!
//! let scene: Scene = toml::from_str(&std::fs::read_to_string("examples/two_grains.toml")?)?;
//! let options = Options { quick: true, ..Options::default() };
//! let comparison = Plan::new(&scene, "examples".as_ref(), options)?.run(&mut |_, _| std::ops::ControlFlow::Continue(()))?;
//! assert_eq!(comparison.reference.regime, Regime::Pointwise);
//! let exact = comparison.curves[0].entries[0].result.as_ref().expect("it ran");
//! assert_eq!((exact.error, exact.lost), (0.0, 0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod entry;
mod errors;
#[cfg(test)]
pub(crate) mod fake;
mod ladder;
mod measure;
mod reference;
mod runner;
mod statistics;
mod verdict;

use std::path::{Path, PathBuf};

use impinge_events::Domain;
use rayon::ThreadPoolBuilder;

pub use entry::{Entry, Fault, Scores};
pub use errors::Distance;
pub use ladder::scheme_names;
pub use measure::{QUANTITIES, Quantities};
pub use reference::{DEVIATIONS, ENSEMBLE, PROBE, Reference, Regime, SPREAD};
pub use runner::{Failed, Watch};
pub use statistics::Statistics;
pub use verdict::Level;

use crate::scene::{Invalid, Output, Run, Scene};
use crate::simulation::{self, Simulation};
use crate::source::Displacement;
use crate::surface::Surface;
use runner::Runner;

/// What is compared, and how carefully.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Names of the schemes; all where none is given.
    pub schemes: Vec<String>,
    /// Runs of the ensemble that is the reference beyond chaos; 16 where left out.
    pub ensemble: Option<u32>,
    /// Starts from which each setting of a scheme is run beyond chaos; 1 where left out.
    pub members: Option<u32>,
    /// Runs whose median is the time of the processor; where left out as many as the length of a run allows.
    pub repeats: Option<u32>,
    /// Longest time of the processor that one run of a scheme may take, s; 60 where left out.
    pub budget: Option<f64>,
    /// A first look: a small ensemble, every second setting, each once, and 10 s for a run.
    pub quick: bool,
}

impl Options {
    fn ensemble(&self) -> u32 {
        self.ensemble.unwrap_or(if self.quick { 4 } else { 16 })
    }

    fn members(&self) -> u32 {
        self.members.unwrap_or(1)
    }

    /// Longest time of the processor that one run of a scheme may take, s.
    #[must_use]
    pub fn budget(&self) -> f64 {
        self.budget.unwrap_or(if self.quick { 10.0 } else { 60.0 })
    }

    /// How often a run is made that takes `seconds` of the processor.
    fn repeats(&self, seconds: f64) -> u32 {
        let by_length = match seconds {
            _ if self.quick => 1,
            // So short a run is at the mercy of what else the machine does.
            ..0.01 => 31,
            0.01..1.0 => 3,
            _ => 1,
        };
        self.repeats.unwrap_or(by_length)
    }
}

/// A comparison that can be made: its scene has been found fit to run.
#[derive(Debug)]
pub struct Plan {
    scene: Scene,
    folder: PathBuf,
    options: Options,
    surface: Surface,
    domain: Domain,
}

/// All schemes over their settings.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Title of the scene.
    pub title: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// Start and end of the run, s.
    pub time: [f64; 2],
    /// Grains that came in.
    pub grains: u64,
    /// The right answer.
    pub reference: Reference,
    /// One for each setting that was varied.
    pub curves: Vec<Curve>,
    /// Whether somebody stopped it before its end.
    pub interrupted: bool,
}

/// A scheme over a range of one setting.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The scheme as the scene file calls it.
    pub scheme: &'static str,
    /// Key of the setting; empty where the scheme is exact and has none.
    pub setting: &'static str,
    /// Unit of the setting; empty for a plain number.
    pub unit: &'static str,
    /// From coarse to fine.
    pub entries: Vec<Entry>,
}

impl Plan {
    /// Plans a comparison for `scene`, whatever its scheme; relative paths start from `folder`.
    ///
    /// # Errors
    /// A value of the scene that cannot be used, by its key.
    pub fn new(scene: &Scene, folder: &Path, options: Options) -> Result<Self, Invalid> {
        let mut scene = scene.clone();
        // Two samples are all that is looked at; more would only be added to the time of every scheme.
        scene.output = Output { samples: 2, events: false, pictures: false };
        scene.run = Run { frames: 0, ..scene.run };
        let surface = Surface::new(&scene.surface, folder)?;
        let domain = simulation::domain(&scene);
        let plan = Self { scene, folder: folder.to_owned(), options, surface, domain };
        plan.simulation(&ladder::event_driven(&plan.scene, None), None)?;
        Ok(plan)
    }

    /// Makes all runs, one after the other. Broken off beyond the reference, it gives what there is.
    ///
    /// # Errors
    /// A reference that cannot be run to its end.
    pub fn run(&self, watch: &mut Watch<'_>) -> Result<Comparison, Failed> {
        // Sums of the near field use all threads of the pool in which they are called.
        let pool =
            ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| Failed::NoThread(error.to_string()))?;
        pool.install(|| self.run_here(&mut Runner::new(watch)))
    }

    fn run_here(&self, runner: &mut Runner<'_>) -> Result<Comparison, Failed> {
        let reference = Reference::find(self, runner)?;
        let mut curves = Vec::new();
        for ladder in ladder::ladders(&self.options.schemes) {
            let rungs = ladder.rungs(&self.scene, &reference.scales, self.options.quick);
            if rungs.is_empty() {
                continue;
            }
            let mut entries: Vec<Entry> = Vec::new();
            for rung in rungs {
                let what = ladder.label(rung.value);
                entries.push(Entry::make(self, runner, &reference, &rung, &what, entries.last()));
            }
            curves.push(Curve { scheme: ladder.name(), setting: ladder.setting, unit: ladder.unit, entries });
        }
        let interrupted =
            curves.iter().flat_map(|curve| &curve.entries).any(|entry| entry.result == Err(Fault::Interrupted));
        Ok(Comparison {
            title: self.scene.title.clone(),
            seed: self.scene.seed,
            time: [self.scene.run.start, self.scene.run.until],
            grains: reference.exact.ends.len() as u64,
            reference,
            curves,
            interrupted,
        })
    }

    /// A scene made ready to run, from a start that may be displaced.
    fn simulation(&self, scene: &Scene, displacement: Option<Displacement>) -> Result<Simulation, Invalid> {
        match displacement {
            Some(displacement) => Simulation::displaced(scene, &self.folder, displacement),
            None => Simulation::new(scene, &self.folder),
        }
    }

    /// The displacement of a member of an ensemble, by up to `radii`.
    fn displacement(&self, radii: f64, member: u32) -> Displacement {
        Displacement::new(radii, self.scene.seed.rotate_left(32) ^ u64::from(member))
    }
}
