//! What watches a run for `impinge run`: all measurements together, and the files they end in.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use impinge_events::Flight;

use super::plots::{self, SideView};
use super::tables::{write_grains, write_series, write_surface_hits};
use super::{Error, EventTable, Folder, Summary, measures, vtk};
use crate::grains::{Grain, Snapshot};
use crate::observe::measure::{Measurement, measurements};
use crate::observe::{History, Ledger, SurfaceEnergy, SurfaceMap, SurfaceShape};
use crate::scene::{Radius, Scene};
use crate::scheme::stepped::Steps;
use crate::scheme::{GrainCollision, Kick, Observer, Passage, Rest, SubSteps, SurfaceHit};

/// What the observers of a run cannot know.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Whether it was stopped before its end.
    pub interrupted: bool,
    /// Entries that had to wait because the place was taken.
    pub entries_deferred: u64,
    /// How the sub-steps went, where forces act.
    pub sub_steps: Option<SubSteps>,
    /// How the steps of a time-stepped scheme went.
    pub steps: Option<Steps>,
    /// Time of the processor, s.
    pub cpu_seconds: f64,
    /// Time on the clock, s.
    pub wall_seconds: f64,
}

/// All measurements of a run and the folder that they go to.
///
/// Frames and events are written as they come. An observer cannot return an error, so the first failed write is kept,
/// [`failed`](Self::failed) tells the run to stop, and [`finish`](Self::finish) reports it.
pub struct Recorder {
    scene: Scene,
    shape: SurfaceShape,
    folder: Folder,
    ledger: Ledger,
    surface: SurfaceEnergy,
    map: SurfaceMap,
    history: History,
    measures: Vec<(String, Box<dyn Measurement>)>,
    side_view: SideView,
    events: Option<EventTable>,
    frames: Vec<(f64, String)>,
    /// How many of them `grains.pvd` lists so far.
    listed: usize,
    last: Last,
    error: Option<Error>,
    failed: Arc<AtomicBool>,
}

/// A copy of the latest sample, which in the end is the final state.
#[derive(Default)]
struct Last {
    time: f64,
    flights: Vec<Flight>,
    grains: Vec<Grain>,
}

impl Last {
    fn snapshot(&self) -> Snapshot<'_> {
        Snapshot { time: self.time, flights: &self.flights, grains: &self.grains }
    }
}

impl Recorder {
    /// Prepares to record a run of `scene`, whose surface has the given shape, into `folder`.
    ///
    /// # Errors
    /// [`Error::Write`] if the table of events cannot be begun.
    pub fn new(scene: &Scene, shape: SurfaceShape, folder: Folder) -> Result<Self, Error> {
        const EVENTS: &str = "events.csv";
        let events = if scene.output.events {
            Some(EventTable::new(folder.create(EVENTS)?).map_err(folder.failed(EVENTS))?)
        } else {
            None
        };
        let mean_radius = match &scene.grain.radius {
            Radius::Constant(radius) => *radius,
            Radius::Drawn(drawn) => drawn.mean,
        };
        Ok(Self {
            scene: scene.clone(),
            ledger: Ledger::default(),
            surface: SurfaceEnergy::default(),
            map: SurfaceMap::new(&shape, mean_radius),
            history: History::default(),
            measures: measurements(scene, &shape),
            side_view: SideView::new(scene),
            events,
            frames: Vec::new(),
            listed: 0,
            last: Last::default(),
            error: None,
            failed: Arc::default(),
            shape,
            folder,
        })
    }

    /// Whether a write has failed; then the run should stop.
    #[must_use]
    pub fn failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The same as a flag, for a callback that cannot hold the recorder while the run does.
    #[must_use]
    pub fn failure_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.failed)
    }

    /// The ledger so far.
    #[must_use]
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Writes what is still to be written, gives the folder its name and sums up the run.
    ///
    /// An interrupted run is finished like any other; its last sample says how far it came.
    ///
    /// # Errors
    /// The first failed write of the whole run, with what was written so far kept beside the folder; or that of
    /// [`Folder::finish`].
    pub fn finish(mut self, outcome: &Outcome) -> Result<(Summary, PathBuf), Error> {
        let summary = Summary::new(&self.scene, &self.ledger, &self.surface, self.last.time, outcome);
        match self.write_all(&summary) {
            Ok(()) => Ok((summary, self.folder.finish()?)),
            Err(error) => Err(Error::Stopped { kept: self.folder.keep_partial(), cause: Box::new(error) }),
        }
    }

    /// Keeps what a run wrote that stopped on a broken invariant, all but the summary; says where.
    ///
    /// # Errors
    /// [`Error::Stopped`] if not even that can be written.
    pub fn abandon(mut self) -> Result<PathBuf, Error> {
        match self.write_measurements() {
            Ok(()) => Ok(self.folder.keep_partial()),
            Err(error) => Err(Error::Stopped { kept: self.folder.keep_partial(), cause: Box::new(error) }),
        }
    }

    fn write_all(&mut self, summary: &Summary) -> Result<(), Error> {
        self.write_measurements()?;
        self.folder.write("summary.json", |file| summary.write_json(file))
    }

    fn write_measurements(&mut self) -> Result<(), Error> {
        let folder = &self.folder;
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        if let Some(events) = self.events.take() {
            events.finish().map_err(folder.failed("events.csv"))?;
        }
        folder.write("grains.csv", |file| write_grains(file, &self.last.snapshot()))?;
        folder.write("series.csv", |file| write_series(file, &self.history))?;
        if !self.frames.is_empty() {
            folder.write("grains.pvd", |file| vtk::write_collection(file, &self.frames))?;
        }
        if !self.shape.is_empty() {
            folder.write("surface_hits.csv", |file| write_surface_hits(file, &self.surface))?;
            let domain = &self.scene.domain;
            folder.write("surface.vtp", |file| vtk::write_surface(file, &self.shape, &self.map, domain))?;
        }
        for (name, measure) in &self.measures {
            measures::write(folder, name, &measure.results(), self.scene.output.pictures)?;
        }
        if self.scene.output.pictures { self.write_pictures() } else { Ok(()) }
    }

    fn write_pictures(&self) -> Result<(), Error> {
        let (title, total) = (self.scene.title.as_str(), self.ledger.energy_scale());
        let pictures = [
            ("energy_history.svg", plots::energy_history(title, &self.history, &self.ledger)),
            ("jet_side.svg", self.side_view.picture(title, &self.shape)),
            ("energy_by_hit_order.svg", plots::energy_by_hit_order(title, &self.surface, total)),
            ("impacts.svg", plots::impacts(title, &self.map)),
        ];
        for (name, picture) in pictures {
            // There is no picture of what did not happen.
            let Some(svg) = picture.map_err(self.folder.failed(name))? else { continue };
            self.folder.write(name, |file| file.write_all(svg.as_bytes()))?;
        }
        Ok(())
    }

    fn write_frame(&mut self, number: u32, snapshot: &Snapshot<'_>) -> Result<(), Error> {
        let name = format!("frames/grains_{number:04}.vtp");
        self.folder.write(&name, |file| vtk::write_grains(file, snapshot))?;
        self.frames.push((snapshot.time, name));
        // Rewritten as it grows, so that ParaView opens even a run that was killed; ever less often, so that it stays cheap.
        if self.frames.len() > self.listed + self.listed / 64 {
            self.folder.write("grains.pvd", |file| vtk::write_collection(file, &self.frames))?;
            self.listed = self.frames.len();
        }
        Ok(())
    }

    fn fail(&mut self, error: Error) {
        self.failed.store(true, Ordering::Relaxed);
        self.error.get_or_insert(error);
    }
}

impl Observer for Recorder {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.ledger.grain_collision(collision);
        self.measures.iter_mut().for_each(|(_, measure)| measure.grain_collision(collision));
        if let Some(events) = &mut self.events {
            events.grain_collision(collision);
        }
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.ledger.surface_hit(hit);
        self.surface.surface_hit(hit);
        self.map.surface_hit(hit);
        self.measures.iter_mut().for_each(|(_, measure)| measure.surface_hit(hit));
        if let Some(events) = &mut self.events {
            events.surface_hit(hit);
        }
    }

    fn kick(&mut self, kick: &Kick) {
        self.ledger.kick(kick);
        self.measures.iter_mut().for_each(|(_, measure)| measure.kick(kick));
    }

    fn rest(&mut self, rest: &Rest) {
        self.ledger.rest(rest);
        self.measures.iter_mut().for_each(|(_, measure)| measure.rest(rest));
    }

    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        self.ledger.passage(passage, time, flight, grain);
        self.measures.iter_mut().for_each(|(_, measure)| measure.passage(passage, time, flight, grain));
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.ledger.sample(snapshot);
        self.history.note(snapshot.time, &self.ledger, &self.surface);
        self.side_view.sample(snapshot);
        self.measures.iter_mut().for_each(|(_, measure)| measure.sample(snapshot));
        self.last.time = snapshot.time;
        self.last.flights.clear();
        self.last.flights.extend_from_slice(snapshot.flights);
        self.last.grains.clear();
        self.last.grains.extend_from_slice(snapshot.grains);
        if self.events.as_ref().is_some_and(EventTable::failed) {
            self.failed.store(true, Ordering::Relaxed); // the table itself keeps the error
        }
    }

    fn frame(&mut self, number: u32, snapshot: &Snapshot<'_>) {
        if self.error.is_none()
            && let Err(error) = self.write_frame(number, snapshot)
        {
            self.fail(error);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;
    use crate::observe::{PlaneShape, TriangleShape};
    use nalgebra::Vector3;
    use std::fs;
    use std::path::Path;

    pub(crate) fn scene() -> Scene {
        let text = r#"
            title = "Make-believe jet of 80 m/s onto a plate & two triangles"
            run = { until = 0.06, frames = 5 }
            domain = { min = [-3, -3, -0.1], max = [3, 3, 3] }
            grain = { radius = 0.01, density = 8500 }
            output = { events = true, samples = 50 }
        "#;
        let scene: Scene = toml::from_str(text).unwrap();
        assert_eq!(scene.run.until, FakeJet::UNTIL);
        scene
    }

    fn shape() -> SurfaceShape {
        let [a, b, c] = [(-1.0, 0.0, 0.1), (-0.5, 0.2, 0.3), (-0.7, -0.2, 0.6)].map(|(x, y, z)| Vector3::new(x, y, z));
        SurfaceShape {
            planes: vec![PlaneShape { element: 0, point: Vector3::zeros(), normal: Vector3::z() }],
            triangles: vec![TriangleShape { element: 1, corners: [a, b, c] }],
        }
    }

    fn recorded(target: &Path, force: bool, jet: &FakeJet) -> Recorder {
        let folder = Folder::begin(target, force).unwrap();
        let mut recorder = Recorder::new(&scene(), shape(), folder).unwrap();
        jet.run(&mut recorder);
        recorder
    }

    #[test]
    fn a_run_leaves_every_file() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        let recorder = recorded(&target, false, &FakeJet { grains: 8000, frames: 5, ..FakeJet::default() });
        assert!(!recorder.failed());
        let outcome = Outcome { cpu_seconds: 2.0, wall_seconds: 2.5, ..Outcome::default() };
        let (summary, written) = recorder.finish(&outcome).unwrap();
        assert_eq!((summary.time.reached, &written), (FakeJet::UNTIL, &target));
        for name in
            ["summary.json", "grains.csv", "events.csv", "series.csv", "surface_hits.csv", "grains.pvd", "surface.vtp"]
        {
            assert!(fs::metadata(written.join(name)).unwrap().len() > 0, "{name}");
        }
        for name in ["energy_history.svg", "jet_side.svg", "energy_by_hit_order.svg", "impacts.svg"] {
            let svg = fs::read_to_string(written.join(name)).unwrap();
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.len() < 4_000_000, "{name}");
            assert!(!svg.contains("NaN"), "{name}");
        }
        assert_eq!(fs::read_dir(written.join("frames")).unwrap().count(), 5);
        let lines = |name: &str| fs::read_to_string(written.join(name)).unwrap().lines().count() as u64 - 1;
        assert_eq!(lines("events.csv"), summary.collisions.grain_grain + summary.collisions.grain_surface);
        assert_eq!(lines("grains.csv"), summary.grains.inside);
        assert_eq!(lines("series.csv"), 51);
        // A second run may replace all of it: no name is unknown to the folder.
        Folder::begin(&written, true).unwrap();
    }

    #[test]
    fn an_interrupted_run_says_how_far_it_came() {
        let home = tempfile::tempdir().unwrap();
        let recorder = recorded(&home.path().join("jet"), false, &FakeJet { part: 0.3, ..FakeJet::default() });
        let (summary, _) = recorder.finish(&Outcome { interrupted: true, ..Outcome::default() }).unwrap();
        assert!(summary.energy.residual_relative.abs() < 1e-14);
        assert!(summary.to_string().contains("stopped at"), "{summary}");
    }

    #[test]
    fn a_failed_frame_stops_the_run_is_reported_and_spares_the_earlier_results() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        recorded(&target, false, &FakeJet::default()).finish(&Outcome::default()).unwrap();
        let before = fs::read(target.join("grains.csv")).unwrap();
        let folder = Folder::begin(&target, true).unwrap();
        folder.write("frames", |file| std::io::Write::write_all(file, b"in the way of the folder")).unwrap();
        let mut recorder = Recorder::new(&scene(), shape(), folder).unwrap();
        let flag = recorder.failure_flag();
        FakeJet { frames: 3, ..FakeJet::default() }.run(&mut recorder);
        assert!(recorder.failed() && flag.load(Ordering::Relaxed));
        let error = recorder.finish(&Outcome::default()).unwrap_err();
        assert!(error.to_string().contains("jet/frames/grains_0000.vtp"), "{error}");
        let Error::Stopped { kept, .. } = error else { panic!("{error}") };
        assert_eq!(kept, home.path().join("jet.stopped"));
        assert_eq!(fs::read(target.join("grains.csv")).unwrap(), before);
    }

    #[test]
    fn a_run_that_broke_leaves_its_measurements_beside_the_folder() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        let kept = recorded(&target, false, &FakeJet { part: 0.5, frames: 5, ..FakeJet::default() }).abandon().unwrap();
        assert!(
            kept.join("series.csv").exists() && kept.join("grains.pvd").exists() && kept.join("events.csv").exists()
        );
        assert!(!kept.join("summary.json").exists() && !target.exists());
    }

    #[test]
    fn a_run_without_grains_or_surface_has_files_too() {
        let home = tempfile::tempdir().unwrap();
        let folder = Folder::begin(&home.path().join("nothing"), false).unwrap();
        let mut recorder = Recorder::new(&scene(), SurfaceShape::default(), folder).unwrap();
        for time in [0.0, 0.06] {
            recorder.sample(&Snapshot { time, flights: &[], grains: &[] });
        }
        let (_, written) = recorder.finish(&Outcome::default()).unwrap();
        assert!(written.join("series.csv").exists() && !written.join("surface.vtp").exists());
    }
}
