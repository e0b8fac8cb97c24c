//! A scene made ready to run.

use std::ops::{ControlFlow, RangeInclusive};
use std::path::Path;

use impinge_events::Domain;
use nalgebra::Vector3;

use crate::grains::{NewGrain, Snapshot};
use crate::law::{ContactLaw, Friction};
use crate::law::{NearField, Term};
use crate::near_field::{Bound, CutOff, ForceSum, Method};
use crate::scene::{Boundary, Interference, Invalid, Scene, Substep, Summation};
use crate::scheme::stepped::{Comparator, Crowd, Stepped, Steps};
use crate::scheme::{
    Broken, EventDriven, Forces, Halves, Laws, Length, Moments, Observer, Progress, SubSteps, Substepped,
};
use crate::source::{self, Displacement, Nozzle, Placed};
use crate::surface::Surface;

/// Skin of the neighbour lists of a near field with a cut-off, over the cut-off.
const SKIN: f64 = 0.15;

/// Two cores share the work on so many grains: fewer keep one core busy with little more than what both have to compare, and with more the memory for
/// both halves counts.
const FOR_TWO_CORES: RangeInclusive<usize> = 30_000..=3_000_000;

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
    scheme: Advance,
    counts: Vec<usize>,
    nozzles: Vec<Nozzle>,
    /// The domain, and what moves the grains that enter; none but where a start is displaced on purpose.
    displacement: Option<(Domain, Displacement)>,
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
        Self::prepare(scene, folder, None)
    }

    /// The same from a start a little aside: every grain that is there, or enters later, is displaced.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn displaced(scene: &Scene, folder: &Path, displacement: Displacement) -> Result<Self, Invalid> {
        Self::prepare(scene, folder, Some((domain(scene), displacement)))
    }

    fn prepare(
        scene: &Scene,
        folder: &Path,
        mut displacement: Option<(Domain, Displacement)>,
    ) -> Result<Self, Invalid> {
        let surface = Surface::new(&scene.surface, folder)?;
        if scene.domain.planar {
            surface.check_planar()?;
        }
        // Which surface a grain would be in, and how deep (m), after so many seconds.
        let overlap = |centre, radius, after| {
            let (element, depth) = surface.overlaps(centre, radius, after)?;
            Some((surface.number_of(element), depth))
        };
        let mut placed = source::place(scene, folder, &|centre, radius| overlap(centre, radius, 0.0))?;
        if let Some((domain, displacement)) = &mut displacement {
            placed.grains.iter_mut().for_each(|grain| displacement.apply(grain, domain));
        }
        for nozzle in &placed.nozzles {
            let after = nozzle.opens() - scene.run.start;
            nozzle.check_clear(&|centre, radius| overlap(centre, radius, after))?;
        }
        let scheme = Advance::new(scene, &placed, surface)?;
        let moments = |count| Moments::new(scene.run.start, scene.run.until, count);
        Ok(Self {
            scheme,
            counts: placed.counts,
            nozzles: placed.nozzles,
            displacement,
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
                return self.break_off(observer);
            }
            match stop {
                Stop::Sample => {
                    self.scheme.sample(time, observer)?;
                    self.samples.advance();
                }
                Stop::Frame(number) => {
                    self.scheme.snapshot(time, |snapshot| observer.frame(number, snapshot));
                    self.frames.advance();
                }
                Stop::Entry(nozzle) => {
                    let Self { scheme, nozzles, displacement, .. } = self;
                    let entering = nozzles[nozzle].enter(time, &mut |place, radius| {
                        let inside = scheme.surface().overlaps(place, radius, time - scheme.surface_time());
                        inside.is_none_or(|(_, depth)| source::just_touches(depth, radius))
                            && scheme.is_free(place, radius, time)
                    });
                    if let Some(mut grain) = entering {
                        if let Some((domain, displacement)) = displacement {
                            displacement.apply(&mut grain, domain);
                        }
                        scheme.enter(time, &grain, observer);
                    }
                }
                Stop::End => {
                    self.scheme.finish(observer);
                    return Ok(Outcome { time, interrupted: false });
                }
            }
        }
    }

    /// How many grains each source has placed at the start; 0 for a nozzle.
    #[must_use]
    pub fn counts(&self) -> &[usize] {
        &self.counts
    }

    /// How the sub-steps went; none where no force acts.
    ///
    /// # Errors
    /// Grains between which there is no finite force.
    pub fn sub_steps(&mut self) -> Result<Option<SubSteps>, Broken> {
        match &mut self.scheme {
            Advance::Freely(_) | Advance::OnTwoCores(_) | Advance::Stepped(_) => Ok(None),
            Advance::UnderForces(scheme) => scheme.report().map(Some),
        }
    }

    /// How the steps of a time-stepped scheme went; none where time goes from event to event.
    #[must_use]
    pub fn steps(&self) -> Option<Steps> {
        match &self.scheme {
            Advance::Freely(_) | Advance::OnTwoCores(_) | Advance::UnderForces(_) => None,
            Advance::Stepped(scheme) => Some(scheme.steps()),
        }
    }

    /// The length of the steps (s) of a time-stepped scheme, where it is known beforehand.
    #[must_use]
    pub fn planned_step(&self) -> Option<f64> {
        match &self.scheme {
            Advance::Freely(_) | Advance::OnTwoCores(_) | Advance::UnderForces(_) => None,
            Advance::Stepped(scheme) => scheme.method().planned_step(),
        }
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
    fn break_off(&mut self, observer: &mut impl Observer) -> Result<Outcome, Broken> {
        let time = self.scheme.time();
        self.scheme.sample(time, observer)?;
        self.scheme.finish(observer);
        Ok(Outcome { time, interrupted: true })
    }
}

/// How time is advanced.
#[derive(Clone, Debug)]
enum Advance {
    /// Nothing acts between events.
    Freely(Box<EventDriven<Surface>>),
    /// The same, and two cores share the work.
    OnTwoCores(Box<Halves<Surface>>),
    /// In sub-steps.
    UnderForces(Box<Substepped<Surface>>),
    /// In steps.
    Stepped(Box<Stepped<Comparator>>),
}

impl Advance {
    fn new(scene: &Scene, placed: &Placed, surface: Surface) -> Result<Self, Invalid> {
        let (laws, domain) = (laws(scene)?, domain(scene));
        let forces = forces(scene, placed.grains.len() as u64)?;
        if let Some(comparator) = Comparator::called(scene.run.scheme) {
            let crowd = Crowd::new(&placed.grains, surface, domain, laws, forces, scene.run.start);
            let comparator = comparator(scene, &crowd);
            return Ok(Self::Stepped(Box::new(Stepped::new(crowd, comparator))));
        }
        let engine = EventDriven::new(&placed.grains, surface, domain, laws, scene.run.start);
        if scene.has_forces() {
            let scheme = Substepped::new(engine, forces, laws, length(scene)).keeping_to(scene.penetration());
            return Ok(Self::UnderForces(Box::new(scheme)));
        }
        let pays = placed.nozzles.is_empty() && FOR_TWO_CORES.contains(&placed.grains.len());
        Ok(match pays && rayon::current_num_threads() > 1 {
            true => Self::OnTwoCores(Box::new(Halves::of(engine))),
            false => Self::Freely(Box::new(engine)),
        })
    }

    fn advance(
        &mut self,
        end: f64,
        observer: &mut impl Observer,
        watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Broken> {
        match self {
            Self::Freely(engine) => engine.advance(end, observer, watch),
            Self::OnTwoCores(halves) => halves.advance(end, observer, watch),
            Self::UnderForces(scheme) => scheme.advance(end, observer, watch),
            Self::Stepped(scheme) => scheme.advance(end, observer, watch),
        }
    }

    /// Tells the observer what forces did and shows it all grains.
    fn sample(&mut self, time: f64, observer: &mut impl Observer) -> Result<(), Broken> {
        match self {
            Self::Freely(_) | Self::OnTwoCores(_) => {}
            Self::UnderForces(scheme) => scheme.tell(time, observer)?,
            Self::Stepped(scheme) => scheme.tell(observer)?,
        }
        self.snapshot(time, |snapshot| observer.sample(snapshot));
        Ok(())
    }

    fn snapshot(&self, time: f64, look: impl FnOnce(&Snapshot<'_>)) {
        match self {
            Self::Freely(engine) => engine.snapshot(time, look),
            Self::OnTwoCores(halves) => halves.snapshot(time, look),
            Self::UnderForces(scheme) => scheme.engine().snapshot(time, look),
            Self::Stepped(scheme) => scheme.crowd().snapshot(time, look),
        }
    }

    fn enter(&mut self, time: f64, grain: &NewGrain, observer: &mut impl Observer) {
        match self {
            Self::Freely(engine) => engine.enter(time, grain, observer),
            Self::OnTwoCores(_) => unreachable!("no grain enters where two cores share the work"),
            Self::UnderForces(scheme) => scheme.enter(time, grain, observer),
            Self::Stepped(scheme) => scheme.enter(grain, observer),
        }
    }

    /// Whether a grain of this radius (m) at `place` (m) overlaps no other at simulated time `time` (s), to which the run has been advanced.
    fn is_free(&self, place: Vector3<f64>, radius: f64, time: f64) -> bool {
        match self {
            Self::Freely(engine) => engine.is_free(place, radius, time),
            Self::OnTwoCores(_) => unreachable!("no grain enters where two cores share the work"),
            Self::UnderForces(scheme) => scheme.engine().is_free(place, radius, time),
            Self::Stepped(scheme) => scheme.crowd().is_free(place, radius),
        }
    }

    /// Tells what has begun and not ended when the run is over.
    fn finish(&mut self, observer: &mut impl Observer) {
        if let Self::Stepped(scheme) = self {
            scheme.finish(observer);
        }
    }

    fn surface(&self) -> &Surface {
        match self {
            Self::Freely(engine) => engine.surface(),
            Self::OnTwoCores(halves) => halves.surface(),
            Self::UnderForces(scheme) => scheme.engine().surface(),
            Self::Stepped(scheme) => scheme.crowd().surface(),
        }
    }

    /// Simulated time from which the times of the surface count, s.
    fn surface_time(&self) -> f64 {
        match self {
            Self::Freely(engine) => engine.epoch_start(),
            Self::OnTwoCores(halves) => halves.epoch_start(),
            Self::UnderForces(scheme) => scheme.engine().epoch_start(),
            Self::Stepped(scheme) => scheme.crowd().time(),
        }
    }

    /// Simulated time that has been reached, s.
    fn time(&self) -> f64 {
        match self {
            Self::Freely(engine) => engine.time(),
            Self::OnTwoCores(halves) => halves.time(),
            Self::UnderForces(scheme) => scheme.engine().time(),
            Self::Stepped(scheme) => scheme.crowd().time(),
        }
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

/// The forces of a scene that starts with so many grains.
fn forces(scene: &Scene, grains: u64) -> Result<Forces, Invalid> {
    let near_field = scene.near_field.as_ref().map(|table| {
        let refuse = |what: String| Invalid::new("near_field", what, "choose other values");
        let attraction = Term { alpha: table.alpha1, beta: table.beta1 };
        let repulsion = Term { alpha: table.alpha2, beta: table.beta2 };
        let law = NearField::new(attraction, repulsion).map_err(|error| refuse(error.to_string()))?;
        let method = match (table.summation(grains), table.cutoff, table.switch_from()) {
            (Summation::CutOff, Some(radius), Some(switch)) => {
                let skin = SKIN * radius;
                Method::CutOff(CutOff { radius, switch_width: radius - switch, skin })
            }
            (Summation::Tree, ..) => Method::Tree { tolerance: table.accuracy, bound: Bound::Proven },
            _ => Method::Direct,
        };
        ForceSum::new(law, method, &domain(scene)).map_err(|error| refuse(error.to_string()))
    });
    let contact_time = scene.contact.time.unwrap_or(0.0);
    Ok(Forces { gravity: Vector3::from(scene.run.gravity), near_field: near_field.transpose()?, contact_time })
}

/// How long the sub-steps of a scene are.
fn length(scene: &Scene) -> Length {
    match scene.substep() {
        Substep::Fixed(step) => Length::Fixed(step),
        Substep::Chosen(_) => Length::Within(scene.tolerance()),
    }
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
