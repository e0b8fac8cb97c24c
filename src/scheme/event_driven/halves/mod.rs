//! Two cores share one domain, and find what one alone would find, bit for bit.
//!
//! The domain is cut in two. Each half of the grains has an engine of its own, which also follows copies of the other half's grains near the cut. For
//! a short window both run on their own. The outer edge of the copies goes wrong meanwhile, because what lies beyond is not there; so what both saw
//! is compared ([`Sharing::disagreement`]), and where a grain may have felt a copy that went wrong the window ends early: what came later is
//! undone. Then copies are renewed. States are pure and the order of events is total, so it is the same whoever resolves an event.
//!
//! What is rare (an epoch that ends early, a broken invariant) is left to one engine alone, in which both halves are put together again.

mod cut;
mod log;
mod sharing;
mod together;
mod window;

use std::ops::ControlFlow;

use impinge_events::calendar::{Buckets, Calendar};
use impinge_events::{Flight, Surface};

use self::log::{Happened, Log};
use self::sharing::Sharing;
use self::together::{alone, beside, both};
use super::collapse::Row;
use super::{EventDriven, snapshot_of};
use crate::grains::{Grain, Snapshot};
use crate::scheme::{Broken, Observer, Progress};

/// All grains are looked at once in so many windows, at least: then the cut moves, the zone becomes thicker or thinner, and those are found whose copies
/// may have to change before the next time.
const SURVEY: f64 = 16.0;
/// First window: the time in which the fastest grain flies this part of the zone in which there are copies.
const FIRST_WINDOW: f64 = 0.05;
/// A window that went well is followed by one so many times as long, ...
const LONGER: f64 = 1.03;
/// ... or, as long as none has ended early, so many times.
const MUCH_LONGER: f64 = 1.3;
/// One that ended early is followed by one of this part of the time that it lasted, ...
const SHORTER: f64 = 0.9;
/// ... and at least this part of itself.
const SHORTEST: f64 = 0.25;

/// Grains in free flight between events, as [`EventDriven`], in two halves that run at once in the thread pool of rayon. No grain may enter.
///
/// It pays from some ten thousand grains on, and takes twice the memory. Inside the pool (`ThreadPool::install`) no thread has to be woken from outside.
///
/// ```
/// use std::ops::ControlFlow;
///
/// use impinge::grains::NewGrain;
/// use impinge::law::{ContactLaw, Friction};
/// use impinge::scene::Interference;
/// use impinge::scheme::{Collapse, EventDriven, Halves, Laws};
/// use impinge_events::{Domain, NoSurface};
/// use nalgebra::Vector3;
///
/// let ball = |x: f64, vx: f64| NewGrain {
///     position: Vector3::new(x, 0.0, 0.0),
///     velocity: Vector3::new(vx, 0.0, 0.0),
///     spin: Vector3::zeros(),
///     radius: 0.5,
///     density: 1.0,
///     strength: 1.0,
/// };
/// let law = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
/// let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
/// let balls = [ball(0.0, 1.0), ball(3.0, 0.0), ball(9.0, 0.0)];
/// let mut one: EventDriven<NoSurface> = EventDriven::new(&balls, NoSurface, Domain::unbounded(), laws, 0.0);
/// let mut two = Halves::of(one.clone());
/// let go_on = &mut |_| ControlFlow::Continue(());
/// assert!(one.advance(10.0, &mut (), go_on)?.is_continue() && two.advance(10.0, &mut (), go_on)?.is_continue());
/// assert!(one.snapshot(10.0, |one| two.snapshot(10.0, |two| one.flights == two.flights)));
/// # Ok::<(), impinge::scheme::Broken>(())
/// ```
#[derive(Clone, Debug)]
pub struct Halves<S: Surface, C: Calendar = Buckets> {
    halves: [Half<S, C>; 2],
    sharing: Sharing,
    /// Length of the next window, s.
    window: f64,
    /// Time that has been reached, s (epoch time).
    now: f64,
    /// The same as simulated time, s.
    time: f64,
    collisions: u64,
    inside: usize,
    windows: Windows,
    /// Copies that are to change before the next window.
    renewals: [Vec<Renewal>; 2],
    /// Events of each half, and windows, since all grains were looked at.
    events: [usize; 2],
    windows_surveyed: usize,
}

#[derive(Clone, Debug)]
struct Half<S: Surface, C: Calendar> {
    engine: EventDriven<S, C>,
    log: Log,
}

/// How the windows of a run went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Windows {
    /// How many there were.
    pub count: u64,
    /// How many of them ended early, because a copy had gone wrong that a grain may have felt.
    pub cut_short: u64,
    /// How many were left to one engine.
    pub alone: u64,
    /// Events that the two halves resolved in the others, also those of copies and those that were undone.
    pub resolved: u64,
    /// Events that happened in these windows: more than half as many as were resolved, or two cores are of no use.
    pub told: u64,
}

/// What becomes of the copy of a grain.
#[derive(Clone, Debug)]
struct Renewal {
    grain: u32,
    /// The state that it gets; none where it is given up.
    state: Option<(Flight, Grain, Option<Row>)>,
}

impl<S: Surface + Clone + Send + Sync, C: Calendar + Clone + Send + Sync> Halves<S, C> {
    /// Two halves of a run on which no force acts.
    #[must_use]
    pub fn of(engine: EventDriven<S, C>) -> Self {
        let (time, collisions, inside) = (engine.time, engine.collisions, engine.encounters.count());
        let now = engine.time - engine.epoch_start;
        let sharing = Sharing::of(&engine, now);
        let window = FIRST_WINDOW * sharing.zone / engine.fastest;
        let halves = [engine.clone(), engine].map(|engine| Half { engine, log: Log::default() });
        let mut run = Self {
            halves,
            sharing,
            window,
            now,
            time,
            collisions,
            inside,
            windows: Windows::default(),
            renewals: Default::default(),
            events: [0; 2],
            windows_surveyed: 0,
        };
        run.divide();
        run
    }

    /// Simulated time that has been reached, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Simulated time at the start of the epoch, s: times of the surface count from it.
    #[must_use]
    pub fn epoch_start(&self) -> f64 {
        self.halves[0].engine.epoch_start
    }

    /// How the windows went.
    #[must_use]
    pub fn windows(&self) -> Windows {
        self.windows
    }

    /// What the grains can hit.
    #[must_use]
    pub fn surface(&self) -> &S {
        self.halves[0].engine.surface()
    }

    /// Resolves all events up to simulated time `end` (s). When and how often it is called changes nothing of what happens.
    ///
    /// # Errors
    /// A broken invariant: grains that overlap, or a state that is no number.
    pub fn advance(
        &mut self,
        end: f64,
        observer: &mut impl Observer,
        watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Broken> {
        loop {
            let EventDriven { epoch_start, epoch, .. } = self.halves[0].engine;
            let epoch_end = epoch_start + epoch;
            let limit = if end < epoch_end { end - epoch_start } else { epoch };
            self.run_window(limit, observer)?;
            if self.epoch_start() == epoch_start && self.now >= limit {
                if end <= epoch_end {
                    break;
                }
                self.start_epoch();
            }
            self.time = self.epoch_start() + self.now;
            if watch(self.progress()).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        self.time = end;
        Ok(watch(self.progress()))
    }

    fn progress(&self) -> Progress {
        Progress { time: self.time, collisions: self.collisions, inside: self.inside }
    }

    /// Goes on for a window, not beyond `limit` (s, epoch time).
    fn run_window(&mut self, limit: f64, observer: &mut impl Observer) -> Result<(), Broken> {
        let from = self.now;
        let sharing = &mut self.sharing;
        let until = limit.min(sharing.surveyed_until).min(from + self.window.min(sharing.safe_for(sharing.fastest)));
        self.windows.count += 1;
        sharing.begin();
        let sharing = &self.sharing;
        let run = |half: usize, Half { engine, log }: &mut Half<S, C>, renewals: &mut Vec<Renewal>| {
            engine.renew(renewals, from);
            engine.run_window(half, until, sharing, log)?;
            engine.find_changes(half, until, sharing, log);
            Ok::<(), Broken>(())
        };
        let ([first, second], [for_first, for_second]) = (&mut self.halves, &mut self.renewals);
        let (ours, theirs) = both(|| run(0, first, for_first), || run(1, second, for_second));
        if ours.is_err() || theirs.is_err() || self.halves.iter().any(|half| half.log.outrun) {
            return self.run_alone(until, observer);
        }
        self.now = until;
        for half in &self.halves {
            self.windows.resolved += half.log.events.len() as u64;
            self.sharing.fastest = self.sharing.fastest.max(half.log.fastest);
        }
        self.turn_back(from + self.sharing.safe_for(self.sharing.fastest));
        let [first, second] = &self.halves;
        if let Some((counts, time)) = alone(|| self.sharing.disagreement([&first.log, &second.log])) {
            self.undo(counts, time);
        }
        let halves = &self.halves;
        let strayed = self.sharing.first_stray(|half, grain| halves[half].engine.encounters.flight(grain), self.now);
        self.turn_back(strayed);
        let events = self.halves.iter().map(|half| half.log.events.len()).sum::<usize>();
        if self.now == from && events == 0 && until > from {
            return self.run_alone(until, observer);
        }
        self.windows_surveyed += 1;
        for (half, Half { log, .. }) in self.halves.iter().enumerate() {
            self.events[half] += log.events.len();
            self.sharing.watch(half, &log.to_watch);
        }
        self.prepare_renewal();
        self.tell_and_renew(observer);
        if self.now < until {
            self.windows.cut_short += 1;
            self.window *= (SHORTER * (self.now - from) / self.window).max(SHORTEST);
        } else if until < limit {
            self.window *= if self.windows.cut_short == 0 { MUCH_LONGER } else { LONGER };
        }
        Ok(())
    }

    /// Undoes what happened at `time` (s, epoch time) or later.
    fn turn_back(&mut self, time: f64) {
        if time < self.now {
            let counts = self.halves.each_ref().map(|half| half.log.count_before(|event| event.time >= time));
            self.undo(counts, time);
        }
    }

    /// Undoes all events but so many of each half, and goes back to `now` (s, epoch time), between the two.
    fn undo(&mut self, counts: [usize; 2], now: f64) {
        let [first, second] = &mut self.halves;
        let back = |Half { engine, log }: &mut Half<S, C>, count| engine.undo(log, count, now);
        both(|| back(first, counts[0]), || back(second, counts[1]));
        self.now = now;
    }

    /// Tells an observer what happened, while the other core prepares that both halves get copies of what is near the cut.
    fn tell_and_renew(&mut self, observer: &mut impl Observer) {
        let Self { halves, sharing, renewals, now, .. } = self;
        let told = beside(
            || tell(halves.each_ref().map(|half| &half.log), observer),
            || renew_found(halves, sharing, renewals, *now),
        );
        self.windows.told += told.events;
        self.collisions += told.collisions;
        self.inside -= told.gone;
    }

    /// Looks at all grains: moves the cut towards the half that has more to do, makes the zone thicker or thinner, and finds all grains whose copies have
    /// to change, or may have to until the next time.
    fn survey(&mut self) {
        let (events, windows) = (std::mem::take(&mut self.events), std::mem::take(&mut self.windows_surveyed));
        if let Some(mean) = (events[0] + events[1]).checked_div(windows) {
            self.sharing.balance(events);
            self.sharing.adapt_zone(mean);
        }
        self.sharing.surveyed_until = self.now + SURVEY * self.window;
        let of = |half: usize| {
            let (engine, sharing) = (&self.halves[half].engine, &self.sharing);
            let (mut watched, mut fastest) = (Vec::new(), 0.0_f64);
            for grain in (0..sharing.slots() as u32).filter(|&grain| sharing.belongs_to(half, grain)) {
                let flight = engine.encounters.flight(grain);
                fastest = fastest.max(sharing.speed(flight));
                if sharing.may_change(half, grain, flight, self.now) {
                    watched.push(grain);
                }
            }
            (watched, fastest)
        };
        let ((ours, our_fastest), (theirs, their_fastest)) = both(|| of(0), || of(1));
        self.sharing.fastest = our_fastest.max(their_fastest);
        self.sharing.watch_only([&ours, &theirs]);
    }

    /// Looks at all grains if it is time, and finds out whose copies have to change, unless that was found for this very moment.
    fn prepare_renewal(&mut self) {
        let is_time = self.now >= self.sharing.surveyed_until;
        if is_time {
            self.survey();
        }
        if is_time || self.halves.iter().any(|half| half.log.found_for != Some(self.now)) {
            let ([first, second], sharing, now) = (&mut self.halves, &self.sharing, self.now);
            let find = |half, Half { engine, log }: &mut Half<S, C>| engine.find_changes(half, now, sharing, log);
            both(|| find(0, first), || find(1, second));
        }
    }

    /// Starts a new epoch for both halves, of the length that one engine would choose.
    fn start_epoch(&mut self) {
        let (after, extremes) = (self.now, self.halves.each_ref().map(|half| half.engine.extremes()));
        let (fastest, smallest) = (extremes[0].0.max(extremes[1].0), extremes[0].1.min(extremes[1].1));
        let start = |Half { engine, .. }: &mut Half<S, C>, renewals: &mut Vec<Renewal>| {
            engine.renew(renewals, after);
            (engine.fastest, engine.smallest) = (fastest, smallest);
            let length = engine.epoch_of_extremes(after);
            engine.encounters.start_epoch(after, length);
            engine.begin(after, length);
        };
        let ([first, second], [for_first, for_second]) = (&mut self.halves, &mut self.renewals);
        both(|| start(first, for_first), || start(second, for_second));
        self.now = 0.0;
        self.sharing.surveyed_until = 0.0;
        self.prepare_renewal();
        renew_found(&self.halves, &mut self.sharing, &mut self.renewals, self.now);
    }

    /// Starts the window again and goes on until `until` (s, epoch time) with one engine that has all grains.
    #[cold]
    fn run_alone(&mut self, until: f64, observer: &mut impl Observer) -> Result<(), Broken> {
        self.windows.alone += 1;
        self.undo([0, 0], self.now);
        let [whole, other] = &mut self.halves;
        let theirs = (0..self.sharing.slots() as u32).filter(|&grain| self.sharing.belongs_to(1, grain));
        let theirs: Vec<u32> = theirs.filter(|&grain| other.engine.encounters.is_inside(grain)).collect();
        for &grain in &theirs {
            whole.engine.grains[grain as usize] = other.engine.grains[grain as usize];
            if let Some(row) = whole.engine.rows.get_mut(grain as usize) {
                *row = other.engine.rows[grain as usize];
            }
        }
        let states = theirs.iter().map(|&grain| {
            let stopped = other.engine.is_stopped_by_surface(grain);
            (grain, *other.engine.encounters.flight(grain), stopped)
        });
        whole.engine.encounters.gather(states, self.now);
        let before = whole.engine.collisions;
        let end = whole.engine.epoch_start + until;
        whole.engine.advance(end, observer, &mut |_| ControlFlow::Continue(()))?.is_continue();
        self.collisions += whole.engine.collisions - before;
        self.inside = whole.engine.encounters.count();
        self.now = end - whole.engine.epoch_start;
        other.engine = whole.engine.clone();
        self.sharing = Sharing::of(&whole.engine, self.now);
        self.divide();
        Ok(())
    }

    /// Leaves each engine its grains, when both have all of them.
    fn divide(&mut self) {
        let (sharing, everywhere, now) = (&self.sharing, self.inside, self.now);
        let keep = |half: usize, engine: &mut EventDriven<S, C>| {
            let known = |grain| sharing.belongs_to(half, grain) || sharing.is_shared(grain);
            engine.encounters.keep_only(known, everywhere, now);
        };
        let [first, second] = &mut self.halves;
        both(|| keep(0, &mut first.engine), || keep(1, &mut second.engine));
        self.survey();
    }

    /// The grains inside, each in the half to which it belongs.
    fn own(&self) -> impl Iterator<Item = (&EventDriven<S, C>, u32)> + Clone {
        (0..self.sharing.slots() as u32).filter_map(|grain| {
            let engine = &self.halves[self.sharing.owner_of(grain)].engine;
            engine.encounters.is_inside(grain).then_some((engine, grain))
        })
    }

    /// Shows all grains at simulated time `time` (s), to which the run has been advanced.
    pub fn snapshot<R>(&self, time: f64, look: impl FnOnce(&Snapshot<'_>) -> R) -> R {
        snapshot_of(time, self.own(), look)
    }
}

/// What observers were told.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    events: u64,
    collisions: u64,
    gone: usize,
}

/// Tells an observer what happened, each event once, in their order.
fn tell(logs: [&Log; 2], observer: &mut impl Observer) -> Told {
    let (mut next, mut told) = ([0, 0], Told::default());
    loop {
        let heads: [_; 2] = std::array::from_fn(|half| logs[half].events.get(next[half]));
        let places = heads.map(|head| head.map(Happened::place));
        let Some(first) = places.iter().flatten().min() else { break told };
        for half in 0..2 {
            let Some(event) = heads[half].filter(|_| places[half] == Some(*first)) else { continue };
            if event.is_ours {
                let (collisions, gone) = logs[half].tell(next[half], observer);
                told.events += 1;
                told.collisions += collisions;
                told.gone += gone;
            }
            next[half] += 1;
        }
    }
}

/// Hands grains over that have crossed the cut, and renews those copies that have to change, as of `now` (s, epoch time).
fn renew_found<S: Surface, C: Calendar>(
    halves: &[Half<S, C>; 2],
    sharing: &mut Sharing,
    renewals: &mut [Vec<Renewal>; 2],
    now: f64,
) {
    let mut renew = |sharing: &mut Sharing, renewal: &Renewal| {
        let Renewal { grain, state: Some((flight, ..)) } = renewal else { return };
        let other = 1 - sharing.owner_of(*grain);
        if let Some(there_is_one) = sharing.change(*grain, flight, now) {
            renewals[other].push(Renewal { grain: *grain, state: renewal.state.filter(|_| there_is_one) });
        }
    };
    for renewal in halves.iter().flat_map(|half| &half.log.to_change) {
        if !sharing.is_wrong(renewal.grain) {
            renew(sharing, renewal);
        }
    }
    for grain in std::mem::take(&mut sharing.wrong) {
        let owner = &halves[sharing.owner_of(grain)].engine;
        renew(sharing, &owner.as_it_is(grain));
    }
}

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// Gives copies their new states, or gives them up, at `now` (s, epoch time).
    fn renew(&mut self, renewals: &mut Vec<Renewal>, now: f64) {
        for renewal in renewals.iter() {
            self.lift(renewal.grain);
        }
        for Renewal { grain, state } in renewals.drain(..) {
            let Some((flight, carried, row)) = state else { continue };
            self.grains[grain as usize] = carried;
            if let Some(row) = row {
                self.rows[grain as usize] = row;
            }
            self.put_down(grain, flight, now);
        }
    }
}
