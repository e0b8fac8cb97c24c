//! What happened to one half in a window, so that it can be compared, told and undone.

use impinge_events::calendar::Kind;
use impinge_events::{Encounter, Flight};
use nalgebra::Vector3;

use crate::grains::Grain;
use crate::scheme::event_driven::collapse::Row;
use crate::scheme::{GrainCollision, Observer, Passage, SurfaceHit};

/// What a grain was before an encounter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    pub(super) grain: u32,
    pub(super) hits: u32,
    pub(super) position: Vector3<f64>,
    pub(super) time: f64,
    pub(super) velocity: Vector3<f64>,
    pub(super) radius: f64,
    pub(super) spin: Vector3<f64>,
}

impl Before {
    pub(super) fn flight(&self) -> Flight {
        Flight { position: self.position, time: self.time, velocity: self.velocity, radius: self.radius }
    }
}

/// An encounter that has been resolved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Happened {
    pub(super) time: f64,
    pub(super) encounter: Encounter,
    /// How much was told to observers before it.
    pub(super) told: u32,
    pub(super) before: [Before; 2],
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

    pub(super) fn befores(&self) -> impl Iterator<Item = &Before> {
        let count = if matches!(self.encounter, Encounter::Grains { .. }) { 2 } else { 1 };
        self.before[..count].iter()
    }
}

/// What observers are to be told.
#[derive(Clone, Copy, Debug)]
pub(super) enum Record {
    Collision(GrainCollision),
    Hit(SurfaceHit),
    Passage(Passage, f64, Flight, Grain),
}

/// What happened to one half, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    pub(super) events: Vec<Happened>,
    pub(super) records: Vec<Record>,
    /// The rows of the grains of each event before it, where collapses are treated.
    pub(super) rows: Vec<[Row; 2]>,
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
    pub(super) fn clear(&mut self) {
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
