//! What happened to one half in a window, so that it can be compared, told and undone.

use impinge_events::calendar::Kind;
use impinge_events::{Encounter, Flight};
use nalgebra::Vector3;

use super::Renewal;
use crate::grains::Grain;
use crate::scheme::event_driven::collapse::Row;
use crate::scheme::{GrainCollision, Observer, Passage, SurfaceHit};

/// An encounter that has been resolved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Happened {
    pub(super) time: f64,
    kind: Kind,
    /// Whether it is for this half to tell.
    pub(super) is_ours: bool,
    /// Two grains, or one and an element of the surface, or one and 0.
    ids: [u32; 2],
    /// How much was told to observers before it.
    pub(super) told: u32,
}

const _: () = assert!(size_of::<Happened>() == 24);

/// What a grain carried before an encounter that changed it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Carried {
    pub(super) spin: Vector3<f64>,
    pub(super) hits: u32,
}

impl Carried {
    pub(super) fn by(grain: &Grain) -> Self {
        Self { spin: grain.spin, hits: grain.hits }
    }
}

/// The place of an encounter in the order of events.
pub(super) type Place = (u64, Kind, [u32; 2]);

impl Happened {
    pub(super) fn new(time: f64, encounter: Encounter, told: usize) -> Self {
        let (kind, ids) = match encounter {
            Encounter::Grains { a, b } => (Kind::Grains, [a, b]),
            Encounter::Surface { grain, element } => (Kind::Surface, [grain, element]),
            Encounter::Exit { grain } => (Kind::Exit, [grain, 0]),
        };
        Self { time, kind, is_ours: true, ids, told: told as u32 }
    }

    /// Where it stands in the order of events. Times of an epoch are not negative, so their bits are in order.
    #[inline]
    pub(super) fn place(&self) -> Place {
        (self.time.to_bits(), self.kind, self.ids)
    }

    /// The two grains that took part; twice the same where it was one.
    #[inline]
    pub(super) fn pair(&self) -> [u32; 2] {
        if self.kind == Kind::Grains { self.ids } else { [self.ids[0]; 2] }
    }

    /// Each grain that took part.
    pub(super) fn grains(&self) -> impl Iterator<Item = u32> + use<> {
        let [first, second] = self.pair();
        [first, second].into_iter().take(if first == second { 1 } else { 2 })
    }
}

/// What observers are to be told. Most of it is collisions; where the rest is, which is longer, is told by a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Record {
    Collision(GrainCollision),
    Hit(u32),
    Passage(u32),
}

/// What happened to one half, in order. It is written and read once a window, from the cache of the one core into that of the other: so it is short.
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    pub(super) events: Vec<Happened>,
    /// The flights of the grains of each event until then.
    pub(super) flights: Vec<[Flight; 2]>,
    /// What grains carried besides until an event of this number changed it, in order.
    pub(super) carried: Vec<(u32, u32, Carried)>,
    pub(super) records: Vec<Record>,
    hits: Vec<SurfaceHit>,
    passages: Vec<(Passage, f64, Flight, Grain)>,
    /// The rows of the grains of each event before it, where collapses are treated.
    pub(super) rows: Vec<[Row; 2]>,
    /// The events that have to do with grains that are known to both halves, and their numbers: side by side, since the other core reads them.
    pub(super) shared: Vec<(u32, Happened)>,
    /// Grains of this half whose copies may have to change, as they fly now.
    pub(super) to_watch: Vec<u32>,
    /// What the copies become that the other half has of grains of this one, where they have to change: as these fly now.
    pub(super) to_change: Vec<Renewal>,
    /// The moment (s, epoch time) for which these were found, unless something was undone since.
    pub(super) found_for: Option<f64>,
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
        self.records.push(Record::Hit(self.hits.len() as u32));
        self.hits.push(*hit);
    }

    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        self.records.push(Record::Passage(self.passages.len() as u32));
        self.passages.push((passage, time, *flight, *grain));
    }
}

impl Log {
    pub(super) fn clear(&mut self) {
        self.events.clear();
        self.flights.clear();
        self.carried.clear();
        self.records.clear();
        self.hits.clear();
        self.passages.clear();
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
                Record::Hit(number) => observer.surface_hit(&self.hits[*number as usize]),
                Record::Passage(number) => {
                    let (passage, time, flight, grain) = &self.passages[*number as usize];
                    observer.passage(*passage, *time, flight, grain);
                }
            }
            let passed = matches!(record, Record::Passage(..));
            collisions += u64::from(!passed);
            gone += usize::from(passed);
        }
        (collisions, gone)
    }

    /// The grains of an event of this number, and their flights until then.
    pub(super) fn flights_of(&self, number: usize) -> impl Iterator<Item = (u32, Flight)> + use<> {
        self.events[number].grains().zip(self.flights[number])
    }

    /// How many events come before the first one of which `is_late` says so. Rounding may let an event be found when its time is over, so times do not
    /// always rise.
    pub(super) fn count_before(&self, is_late: impl Fn(&Happened) -> bool) -> usize {
        self.events.iter().position(is_late).unwrap_or(self.events.len())
    }
}
