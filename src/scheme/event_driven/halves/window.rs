//! One half of the grains for a short time, and the way back.

use impinge_events::calendar::{Calendar, Kind};
use impinge_events::{Encounter, Flight, Surface};
use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use super::EventDriven;
use super::sharing::Sharing;
use crate::grains::Grain;
use crate::scene::Interference;
use crate::scheme::event_driven::collapse::Row;
use crate::scheme::{Broken, GrainCollision, Observer, Passage, SurfaceHit};

/// What a grain was before an encounter.
#[derive(Clone, Copy, Debug)]
struct Before {
    grain: u32,
    hits: u32,
    position: Vector3<f64>,
    time: f64,
    velocity: Vector3<f64>,
    radius: f64,
    spin: Vector3<f64>,
}

impl Before {
    fn flight(&self) -> Flight {
        Flight { position: self.position, time: self.time, velocity: self.velocity, radius: self.radius }
    }
}

/// An encounter that has been resolved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Happened {
    pub(super) time: f64,
    pub(super) encounter: Encounter,
    /// How much was told to observers before it.
    told: u32,
    before: [Before; 2],
}

/// The place of an encounter in the order of events.
pub(super) type Place = (u64, Kind, [u32; 2]);

impl Happened {
    /// Where it stands in the order of events. Times of an epoch are not negative, so their bits are in order.
    pub(super) fn place(&self) -> Place {
        let (kind, ids) = match self.encounter {
            Encounter::Grains { a, b } => (Kind::Grains, [a, b]),
            Encounter::Surface { grain, element } => (Kind::Surface, [grain, element]),
            Encounter::Exit { grain } => (Kind::Exit, [grain, 0]),
        };
        (self.time.to_bits(), kind, ids)
    }

    /// The grains that took part.
    pub(super) fn grains(&self) -> impl Iterator<Item = u32> {
        self.befores().map(|before| before.grain)
    }

    /// Their flights until then.
    pub(super) fn flights(&self) -> impl Iterator<Item = (u32, Flight)> {
        self.befores().map(|before| (before.grain, before.flight()))
    }

    fn befores(&self) -> impl Iterator<Item = &Before> {
        let count = if matches!(self.encounter, Encounter::Grains { .. }) { 2 } else { 1 };
        self.before[..count].iter()
    }
}

/// What observers are to be told.
#[derive(Clone, Copy, Debug)]
enum Record {
    Collision(GrainCollision),
    Hit(SurfaceHit),
    Passage(Passage, f64, Flight, Grain),
}

/// What happened to one half, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    pub(super) events: Vec<Happened>,
    records: Vec<Record>,
    /// The rows of the grains of each event before it, where collapses are treated.
    rows: Vec<[Row; 2]>,
    /// Which events have to do with grains that are known to both halves.
    pub(super) shared: Vec<u32>,
    /// Grains of this half whose copies may have to change, as they fly now.
    pub(super) to_watch: Vec<u32>,
    /// Grains of this half whose copies have to change.
    pub(super) to_change: Vec<u32>,
    /// Largest speed towards the cut that a grain got, m/s.
    pub(super) fastest: f64,
    /// Whether a grain became too fast for the epoch.
    pub(super) outrun: bool,
}

impl Observer for Log {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.records.push(Record::Collision(*collision));
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.records.push(Record::Hit(*hit));
    }

    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        self.records.push(Record::Passage(passage, time, *flight, *grain));
    }
}

impl Log {
    fn clear(&mut self) {
        self.events.clear();
        self.records.clear();
        self.rows.clear();
        self.shared.clear();
        self.to_watch.clear();
        (self.fastest, self.outrun) = (0.0, false);
    }

    /// Tells an observer what event number `event` has to tell; gives how many collisions that are, and how many grains went out.
    pub(super) fn tell(&self, event: usize, observer: &mut impl Observer) -> (u64, usize) {
        let end = self.events.get(event + 1).map_or(self.records.len(), |next| next.told as usize);
        let (mut collisions, mut gone) = (0, 0);
        for record in &self.records[self.events[event].told as usize..end] {
            match record {
                Record::Collision(collision) => observer.grain_collision(collision),
                Record::Hit(hit) => observer.surface_hit(hit),
                Record::Passage(passage, time, flight, grain) => observer.passage(*passage, *time, flight, grain),
            }
            let passed = matches!(record, Record::Passage(..));
            collisions += u64::from(!passed);
            gone += usize::from(passed);
        }
        (collisions, gone)
    }

    /// How many events come before the first one of which `is_late` says so. Rounding may let an event be found when its time is over, so times do not
    /// always rise.
    pub(super) fn count_before(&self, is_late: impl Fn(&Happened) -> bool) -> usize {
        self.events.iter().position(is_late).unwrap_or(self.events.len())
    }
}

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// Resolves all events up to `until` (s, epoch time) into `log`.
    pub(super) fn run_window(
        &mut self,
        half: usize,
        until: f64,
        sharing: &Sharing,
        log: &mut Log,
    ) -> Result<(), Broken> {
        log.clear();
        self.encounters.forget_crossings();
        while let Some((time, encounter)) = self.encounters.next_before(until) {
            let grains = match encounter {
                Encounter::Grains { a, b } => [a, b],
                Encounter::Surface { grain, .. } | Encounter::Exit { grain } => [grain; 2],
            };
            let flights = self.encounters.before();
            let before = std::array::from_fn(|k| {
                let Flight { position, time, velocity, radius } = flights[k];
                let Grain { spin, hits, .. } = self.grains[grains[k] as usize];
                Before { grain: grains[k], hits, position, time, velocity, radius, spin }
            });
            let event = Happened { time, encounter, told: log.records.len() as u32, before };
            if event.grains().any(|grain| sharing.is_shared(grain)) {
                log.shared.push(log.events.len() as u32);
            }
            log.events.push(event);
            if !self.rows.is_empty() {
                log.rows.push(grains.map(|grain| self.rows[grain as usize]));
            }
            self.resolve(time, encounter, log)?;
            for grain in event.grains() {
                let flight = self.encounters.flight(grain);
                log.fastest = log.fastest.max(sharing.speed(flight));
                if sharing.belongs_to(half, grain) && sharing.may_change(half, grain, flight, time) {
                    log.to_watch.push(grain);
                }
            }
            if self.outrun {
                log.outrun = true;
                return Ok(());
            }
        }
        Ok(())
    }

    /// Finds the grains of this half whose copies have to change at `now` (s, epoch time).
    pub(super) fn find_changes(&self, half: usize, now: f64, sharing: &Sharing, log: &mut Log) {
        let has_to_change = |&grain: &u32| {
            sharing.belongs_to(half, grain) && sharing.has_to_change(half, grain, self.encounters.flight(grain), now)
        };
        log.to_change.clear();
        log.to_change.extend(sharing.watched[half].iter().chain(&log.to_watch).copied().filter(has_to_change));
    }

    /// Undoes the events of `log` from number `first` on, and goes back to `now` (s, epoch time), before them.
    pub(super) fn undo(&mut self, log: &mut Log, first: usize, now: f64) {
        let mut changed: FxHashMap<u32, Flight> = FxHashMap::default();
        for number in (first..log.events.len()).rev() {
            for (k, before) in log.events[number].befores().enumerate() {
                changed.insert(before.grain, before.flight());
                let grain = &mut self.grains[before.grain as usize];
                (grain.spin, grain.hits) = (before.spin, before.hits);
                if let Some(rows) = log.rows.get(number) {
                    self.rows[before.grain as usize] = rows[k];
                }
            }
        }
        changed.keys().for_each(|&grain| self.lift(grain));
        for (&grain, flight) in &changed {
            self.put_down(grain, *flight, now);
        }
        self.encounters.turn_back(now);
        if let Some(event) = log.events.get(first) {
            log.records.truncate(event.told as usize);
        }
        log.events.truncate(first);
        log.rows.truncate(first);
        self.outrun = false;
        (self.mark, self.since_mark) = (now, 0);
    }

    /// Takes a grain out, if it is there, for the other half to know.
    pub(super) fn lift(&mut self, grain: u32) {
        if self.encounters.is_inside(grain) {
            self.encounters.lift(grain);
        }
    }

    /// Puts a grain that is not there into this state at `now` (s, epoch time).
    pub(super) fn put_down(&mut self, grain: u32, flight: Flight, now: f64) {
        self.encounters.put_down(grain, flight, self.is_stopped_by_surface(grain), now);
    }

    /// Whether the surface still stops a grain.
    pub(super) fn is_stopped_by_surface(&self, grain: u32) -> bool {
        let once = matches!(self.laws.interference, Interference::FirstOrder | Interference::RemovedOnFirstCollision);
        !once || self.grains[grain as usize].hits == 0
    }
}
