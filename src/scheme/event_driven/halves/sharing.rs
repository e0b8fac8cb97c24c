//! Who knows which grains, and whether both halves saw the same.

use impinge_events::calendar::Calendar;
use impinge_events::{Flight, Surface, prefetch};

use super::EventDriven;
use super::cut::Cut;
use super::log::{Happened, Log};

/// This part of all grains have copies in the other half at the most: that much more work, and that much longer windows.
const MOST_COPIES: f64 = 0.3;
/// So many events in a window are neither too few, so that to put the halves together again costs too much, nor more than it takes.
const EVENTS: [usize; 2] = [1500, 4000];
/// By how much the zone is made thinner at once.
const THINNER: f64 = 0.9;
/// Copies are given up when they are so many times as far from the cut as those that are taken in.
const LINGERING: f64 = 1.2;
/// Where one half has more to do, by which part of all, the cut moves by so many times this part of the zone, ...
const SHIFT: f64 = 10.0;
/// ... and by this part at the most.
const MOST_SHIFT: f64 = 0.25;
/// The zone in which there are copies is so many times as thick as the largest radius, at first and at least.
const LEAST_ZONE: f64 = 4.0;
/// By this part grains keep farther from the cut than they must, so that it is no matter of rounding.
const MARGIN: f64 = 1e-3;

/// Whether the half to which a grain does not belong has a copy of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InOther {
    /// It has none.
    Nothing,
    /// It has a good one.
    Good,
    /// It has one that has gone wrong.
    Wrong,
}

/// Who knows a grain. Every event asks for it, so it is kept in as few bytes as the caches can hold for all grains.
#[derive(Clone, Copy, Debug)]
struct Known {
    /// The half to which it belongs.
    by: u8,
    copy: InOther,
}

/// Each grain belongs to one half; those near the cut have a copy in the other half.
#[derive(Clone, Debug)]
pub(super) struct Sharing {
    pub(super) cut: Cut,
    /// How far from the cut grains have a copy, m.
    pub(super) zone: f64,
    most_zone: f64,
    /// The largest radius and a little, m.
    pub(super) margin: f64,
    /// Largest speed towards the cut that any grain has, or had lately, m/s.
    pub(super) fastest: f64,
    /// Until when (s, epoch time) those are known whose copies may have to change: those that are watched.
    pub(super) surveyed_until: f64,
    /// They stay listed when they go over to the other half.
    pub(super) watched: [Vec<u32>; 2],
    is_watched: Vec<[bool; 2]>,
    /// The copies that have gone wrong in this window.
    pub(super) wrong: Vec<u32>,
    /// When a grain whose copy is wrong first came to the cut, s (epoch time).
    strayed: f64,
    known: Vec<Known>,
    /// When the copy of each grain went wrong, s (epoch time), if it has.
    wrong_since: Vec<f64>,
}

impl Sharing {
    /// Gives each grain of an engine to one half, as of `now` (s, epoch time).
    pub(super) fn of<S: Surface, C: Calendar>(engine: &EventDriven<S, C>, now: f64) -> Self {
        let grains: Vec<(u32, Flight)> =
            engine.encounters.inside().map(|grain| (grain, *engine.encounters.flight(grain))).collect();
        let flights: Vec<Flight> = grains.iter().map(|&(_, flight)| flight).collect();
        let cut = Cut::through(&flights, &engine.domain, now);
        let depths = flights.iter().map(|flight| cut.depth(0, flight, now));
        let mut sorted: Vec<f64> = depths.clone().map(f64::abs).collect();
        let margin = (1.0 + MARGIN) * engine.largest_radius();
        sorted.sort_unstable_by(f64::total_cmp);
        let zone = LEAST_ZONE * margin;
        let most_zone = sorted.get((MOST_COPIES * sorted.len() as f64) as usize).copied().unwrap_or_default().max(zone);
        let slots = engine.grains.len();
        let mut known = vec![Known { by: 0, copy: InOther::Nothing }; slots];
        for (&(grain, _), depth) in grains.iter().zip(depths) {
            let copy = if depth.abs() < zone { InOther::Good } else { InOther::Nothing };
            known[grain as usize] = Known { by: u8::from(depth < 0.0), copy };
        }
        let (watched, is_watched, wrong) = (Default::default(), vec![[false; 2]; slots], Vec::new());
        let (fastest, surveyed_until, strayed) = (f64::INFINITY, now, f64::INFINITY);
        Self {
            cut,
            zone,
            most_zone,
            margin,
            fastest,
            surveyed_until,
            watched,
            is_watched,
            wrong,
            strayed,
            known,
            wrong_since: vec![f64::INFINITY; slots],
        }
    }

    /// How long no grain that only one half knows can come to the cut, s, where none is faster than `fastest` (m/s). On its own side it meets no grain
    /// that only the other half knows.
    pub(super) fn safe_for(&self, fastest: f64) -> f64 {
        (self.zone - self.margin) / fastest
    }

    /// Moves the cut towards the half that had more events.
    pub(super) fn balance(&mut self, events: [usize; 2]) {
        let [first, second] = events.map(|count| count as f64);
        let uneven = (second - first) / (first + second).max(1.0);
        self.cut.shift((SHIFT * uneven).clamp(-MOST_SHIFT, MOST_SHIFT) * self.zone);
    }

    /// Whether the copy of a grain that flies so at `now` (s, epoch time), or is gone, has to change, or may have to before all are looked at again.
    #[inline]
    pub(super) fn may_change(&self, half: usize, grain: u32, flight: &Flight, now: f64) -> bool {
        let (depth, way) = (self.depth(half, flight, now), self.speed(flight) * (self.surveyed_until - now));
        match self.is_shared(grain) {
            true => depth < way || depth + way > LINGERING * self.zone,
            false => depth < self.zone + way || self.is_wrong(grain),
        }
    }

    /// How far a grain is inside a half at `now` (s, epoch time), m; infinity where it is gone.
    fn depth(&self, half: usize, flight: &Flight, now: f64) -> f64 {
        if flight.radius > 0.0 { self.cut.depth(half, flight, now) } else { f64::INFINITY }
    }

    /// The copy that there should be of a grain that is so deep (m) inside its half, where there is this one.
    fn due(&self, depth: f64, copy: InOther) -> InOther {
        let reach = if copy == InOther::Good { LINGERING * self.zone } else { self.zone };
        if depth < reach { InOther::Good } else { InOther::Nothing }
    }

    /// Whether [`change`](Self::change) would do something.
    pub(super) fn has_to_change(&self, half: usize, grain: u32, flight: &Flight, now: f64) -> bool {
        let (depth, copy) = (self.depth(half, flight, now), self.known[grain as usize].copy);
        let is_crossed = copy == InOther::Good && depth < 0.0;
        is_crossed || copy != self.due(depth, copy)
    }

    /// Decides about a grain that flies so at `now` (s, epoch time), or is gone: whether the half to which it does not belong has a copy from now on,
    /// if that changes or the copy had gone wrong.
    pub(super) fn change(&mut self, grain: u32, flight: &Flight, now: f64) -> Option<bool> {
        let number = grain as usize;
        let (depth, copy) = (self.depth(self.owner_of(grain), flight, now), self.known[number].copy);
        if copy == InOther::Good && depth < 0.0 {
            self.known[number].by ^= 1;
            self.watch(self.owner_of(grain), &[grain]);
            return None;
        }
        let due = self.due(depth, copy);
        if copy == due {
            return None;
        }
        self.known[number].copy = due;
        Some(due == InOther::Good)
    }

    /// Watches these grains of each half and no others.
    pub(super) fn watch_only(&mut self, grains: [&[u32]; 2]) {
        self.is_watched.fill([false; 2]);
        for (half, grains) in grains.into_iter().enumerate() {
            self.watched[half].clear();
            self.watch(half, grains);
        }
    }

    /// Watches these grains of a half too.
    pub(super) fn watch(&mut self, half: usize, grains: &[u32]) {
        for &grain in grains {
            if !std::mem::replace(&mut self.is_watched[grain as usize][half], true) {
                self.watched[half].push(grain);
            }
        }
    }

    /// Makes the zone thicker where there are few events in a window, so that they become longer, and thinner where there are many.
    pub(super) fn adapt_zone(&mut self, events: usize) {
        let factor = if events < EVENTS[0] {
            1.0 / THINNER
        } else if events > EVENTS[1] {
            THINNER
        } else {
            1.0
        };
        self.zone = (self.zone * factor).clamp(self.least_zone(), self.most_zone);
    }

    fn least_zone(&self) -> f64 {
        LEAST_ZONE * self.margin
    }

    /// Begins a window.
    pub(super) fn begin(&mut self) {
        self.wrong.clear();
        self.strayed = f64::INFINITY;
    }

    /// Whether both halves know a grain.
    #[inline]
    pub(super) fn is_shared(&self, grain: u32) -> bool {
        self.known[grain as usize].copy == InOther::Good
    }

    /// Whether the other half has a copy of a grain that has gone wrong.
    pub(super) fn is_wrong(&self, grain: u32) -> bool {
        self.known[grain as usize].copy == InOther::Wrong
    }

    #[inline]
    pub(super) fn owner_of(&self, grain: u32) -> usize {
        usize::from(self.known[grain as usize].by)
    }

    /// How many numbers of grains there are.
    pub(super) fn slots(&self) -> usize {
        self.known.len()
    }

    /// Asks the memory for who knows a grain.
    #[inline]
    pub(super) fn fetch(&self, grain: u32) {
        prefetch(&self.known, grain as usize);
    }

    #[inline]
    pub(super) fn belongs_to(&self, half: usize, grain: u32) -> bool {
        self.owner_of(grain) == half
    }

    /// Speed of a flight towards the cut or away from it, m/s.
    #[inline]
    pub(super) fn speed(&self, flight: &Flight) -> f64 {
        flight.velocity[self.cut.axis].abs()
    }

    /// Notes where a grain whose copy is wrong has flown until `until` (s, epoch time).
    fn follow(&mut self, grain: u32, flight: &Flight, until: f64) {
        let (owner, since) = (self.owner_of(grain), self.wrong_since[grain as usize]);
        let between = [flight.time.max(since), until];
        self.strayed =
            self.cut.stray(owner, flight, between, self.margin).map_or(self.strayed, |at| at.min(self.strayed));
    }

    /// When a grain whose copy is wrong first came to the cut until `now` (s, epoch time), as `flight` tells what it does since its latest event; infinity
    /// where none did.
    pub(super) fn first_stray<'a>(&mut self, flight: impl Fn(usize, u32) -> &'a Flight, now: f64) -> f64 {
        let wrong = std::mem::take(&mut self.wrong);
        for &grain in &wrong {
            let flight = flight(self.owner_of(grain), grain);
            if flight.radius > 0.0 {
                self.follow(grain, flight, now);
            }
        }
        self.wrong = wrong;
        self.strayed
    }

    /// Looks through what the two halves saw, in the order of events, as long as grains that belong to a half have not felt a copy that went
    /// wrong. Where that can no longer be said it gives how many events of each half come before, and the time (s, epoch time). Copies that went wrong
    /// are noted.
    ///
    /// All states of grains in the half to which they belong are true until then. For let an event be the first that is wrong or missing there. If both
    /// grains belong to that half it is right. If one is a copy, either the copy was wrong, and its history differs from the true one, which
    /// the other half saw, or the other half saw the event and this one did not; both are found here. If neither half has a good copy of the other's
    /// grain then each of the two has stayed on its side of the cut, and they did not meet.
    pub(super) fn disagreement(&mut self, logs: [&Log; 2]) -> Option<([usize; 2], f64)> {
        let mut next = [0, 0];
        loop {
            let heads: [Option<&(u32, Happened)>; 2] = std::array::from_fn(|half| {
                logs[half].shared.get(next[half]).filter(|(number, _)| (*number as usize) < logs[half].events.len())
            });
            let places = heads.map(|head| head.map(|(_, event)| event.place()));
            let first = places.iter().flatten().min().copied()?;
            let seen = places.map(|place| place == Some(first));
            for half in 0..2 {
                let Some((number, event)) = heads[half].filter(|_| seen[half]) else { continue };
                next[half] += 1;
                if !self.is_agreed(half, logs[half], *number as usize, event, seen[1 - half]) {
                    let counts = [0, 1].map(|half| logs[half].count_before(|event| event.place() >= first));
                    return Some((counts, event.time));
                }
            }
        }
    }

    /// Whether the event of this number that `half` saw, and the other half too or not, leaves the grains of both halves as they truly are.
    fn is_agreed(&mut self, half: usize, log: &Log, number: usize, event: &Happened, by_both: bool) -> bool {
        let ours = |sharing: &Self, grain: u32| sharing.belongs_to(half, grain);
        let is_true = event.grains().all(|grain| ours(self, grain) || self.is_shared(grain));
        for (k, grain) in event.grains().enumerate() {
            let ours = ours(self, grain);
            let flight = || &log.flights[number][k];
            // The other half did not see what happened to its grain, or ours felt what was not so.
            if if is_true { !by_both && !ours } else { ours } {
                return false;
            }
            if self.is_shared(grain) {
                if !is_true || !by_both {
                    self.known[grain as usize].copy = InOther::Wrong;
                    self.wrong_since[grain as usize] = event.time;
                    self.wrong.push(grain);
                    self.follow(grain, flight(), event.time);
                }
            } else if ours && self.is_wrong(grain) {
                self.follow(grain, flight(), event.time);
            }
        }
        true
    }
}
