//! A scene made ready to run.

use std::ops::ControlFlow;
use std::path::Path;

use impinge_events::Domain;
use nalgebra::Vector3;

use crate::law::{ContactLaw, Friction};
use crate::scene::{Boundary, Interference, Invalid, Scene};
use crate::scheme::{Broken, EventDriven, Laws, Moments, Observer, Progress};
use crate::source::{self, Nozzle};
use crate::surface::Surface;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Simulated time that was reached, s.
    pub time: f64,
    /// Whether somebody stopped it before its end.
    pub interrupted: bool,
}

/// A scene made ready to run: its grains placed, its surfaces loaded.
///
/// ```
/// use impinge::scene::Scene;
/// use impinge::simulation::Simulation;
///
/// let scene: Scene = toml::from_str(
///     r#"
///     run = { until = 1.0 }
///     domain = { min = [-1, -1, -1], max = [1, 1, 3] }
///     grain = { radius = 0.1, density = 1000.0 }
///     contact.surface.restitution = 0.5
///     contact.grain.restitution = 1.0
///     source = [{ kind = "lattice", min = [0, 0, 1], max = [0.5, 0.5, 2], cells = [1, 1, 2], velocity = [0, 0, -4] }]
///     surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }]
///     "#,
/// )?;
/// let mut simulation = Simulation::new(&scene, ".".as_ref())?;
/// let outcome = simulation.run(&mut (), &mut |_| std::ops::ControlFlow::Continue(()))?;
/// assert_eq!(outcome.time, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Simulation {
    scheme: EventDriven<Surface>,
    counts: Vec<usize>,
    nozzles: Vec<Nozzle>,
    samples: Moments,
    frames: Moments,
    until: f64,
}

impl Simulation {
    /// Loads the surfaces and places the grains of `scene`; relative paths start from `folder`.
    ///
    /// # Errors
    /// A value of the scene that cannot be used, by its key.
    pub fn new(scene: &Scene, folder: &Path) -> Result<Self, Invalid> {
        let surface = Surface::new(&scene.surface, folder)?;
        if scene.domain.planar {
            surface.check_planar()?;
        }
        // Which surface a grain would be in, and how deep (m), after so many seconds.
        let overlap = |centre, radius, after| {
            let (element, depth) = surface.overlaps(centre, radius, after)?;
            Some((surface.number_of(element), depth))
        };
        let placed = source::place(scene, folder, &|centre, radius| overlap(centre, radius, 0.0))?;
        for nozzle in &placed.nozzles {
            let after = nozzle.opens() - scene.run.start;
            nozzle.check_clear(&|centre, radius| overlap(centre, radius, after))?;
        }
        let scheme = EventDriven::new(&placed.grains, surface, domain(scene), laws(scene)?, scene.run.start);
        let moments = |count| Moments::new(scene.run.start, scene.run.until, count);
        Ok(Self {
            scheme,
            counts: placed.counts,
            nozzles: placed.nozzles,
            samples: moments(scene.output.samples.max(2)),
            frames: moments(scene.run.frames),
            until: scene.run.until,
        })
    }

    /// Runs to the end of the scene, or until `watch`, which is called now and then, breaks off.
    ///
    /// # Errors
    /// A broken invariant, with the time and the grains.
    pub fn run(
        &mut self,
        observer: &mut impl Observer,
        watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Outcome, Broken> {
        loop {
            let (time, stop) = self.next_stop();
            if self.scheme.advance(time, observer, watch)?.is_break() {
                return Ok(self.break_off(observer));
            }
            match stop {
                Stop::Sample => {
                    self.scheme.snapshot(time, |snapshot| observer.sample(snapshot));
                    self.samples.advance();
                }
                Stop::Frame(number) => {
                    self.scheme.snapshot(time, |snapshot| observer.frame(number, snapshot));
                    self.frames.advance();
                }
                Stop::Entry(nozzle) => {
                    let Self { scheme, nozzles, .. } = self;
                    let entering = nozzles[nozzle].enter(time, &mut |place, radius| {
                        let inside = scheme.surface().overlaps(place, radius, time - scheme.epoch_start());
                        inside.is_none_or(|(_, depth)| source::just_touches(depth, radius))
                            && scheme.is_free(place, radius, time)
                    });
                    if let Some(grain) = entering {
                        scheme.enter(time, &grain, observer);
                    }
                }
                Stop::End => return Ok(Outcome { time, interrupted: false }),
            }
        }
    }

    /// How many grains each source has placed at the start; 0 for a nozzle.
    #[must_use]
    pub fn counts(&self) -> &[usize] {
        &self.counts
    }

    /// The nozzles, with what they have sent and deferred so far.
    #[must_use]
    pub fn nozzles(&self) -> &[Nozzle] {
        &self.nozzles
    }

    /// The surface.
    #[must_use]
    pub fn surface(&self) -> &Surface {
        self.scheme.surface()
    }

    /// Whatever comes first; at equal times in the order in which they stand here, so that a sample at the end sees the end.
    fn next_stop(&self) -> (f64, Stop) {
        let entries = self.nozzles.iter().enumerate();
        let entries = entries.filter_map(|(number, nozzle)| Some((nozzle.due()?, Stop::Entry(number))));
        let sample = self.samples.peek().map(|(_, time)| (time, Stop::Sample));
        let frame = self.frames.peek().map(|(number, time)| (time, Stop::Frame(number)));
        let before_end = entries.chain(sample).chain(frame);
        let end = (self.until, Stop::End);
        // Of equal times the first wins.
        before_end.chain([end]).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(end)
    }

    /// Shows observers the moment at which a run was broken off as its last sample.
    fn break_off(&mut self, observer: &mut impl Observer) -> Outcome {
        let time = self.scheme.time();
        self.scheme.snapshot(time, |snapshot| observer.sample(snapshot));
        Outcome { time, interrupted: true }
    }
}

/// Why the run pauses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    Sample,
    Frame(u32),
    Entry(usize),
    End,
}

/// The laws of a scene. A law that is not needed may be missing.
///
/// # Errors
/// A law that is needed and missing.
fn laws(scene: &Scene) -> Result<Laws, Invalid> {
    let missing = |key: &str, when: &str| {
        Invalid::new(key, format!("missing, but {when}"), format!("add [{key}] with restitution = 0.8, for example"))
    };
    let unused = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
    let grain = match &scene.contact.grain {
        Some(contact) => contact.into(),
        None if scene.run.interference == Interference::None => unused,
        None => return Err(missing("contact.grain", "grains collide with each other")),
    };
    let surface = match &scene.contact.surface {
        Some(contact) => contact.into(),
        None if scene.surface.is_empty() => unused,
        None => return Err(missing("contact.surface", "the scene has a surface")),
    };
    let (interference, collapse) = (scene.run.interference, scene.contact.collapse);
    Ok(Laws { grain, surface, interference, collapse })
}

/// The domain as the engine needs it.
#[must_use]
pub fn domain(scene: &Scene) -> Domain {
    let mut domain = Domain {
        min: Vector3::from(scene.domain.min),
        max: Vector3::from(scene.domain.max),
        periodic: scene.domain.boundary == Boundary::Periodic,
        planar: scene.domain.planar,
    };
    if domain.planar {
        (domain.min.y, domain.max.y) = (0.0, 0.0);
    }
    domain
}
