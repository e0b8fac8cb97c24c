//! Flights, surface, neighbours and calendar put together: who meets whom next?

use nalgebra::Vector3;

use crate::calendar::{Buckets, Calendar, Event, Kind, NOBODY, Plan, earlier, never};
use crate::lists::Lists;
use crate::neighbors::{Cells, Near, Stream};
use crate::table::{Table, table};
use crate::{Bend, Domain, Flight, NoSurface, Outlook, Surface};

mod ahead;
mod part;
mod search;
mod sub_step;

use self::ahead::Ahead;
use self::search::Search;
pub use self::search::YIELDING;
pub use self::sub_step::{Touch, Vicinity};

/// What happens next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encounter {
    /// Two grains touch.
    Grains {
        /// The lower number.
        a: u32,
        /// The higher number.
        b: u32,
    },
    /// A grain touches the surface.
    Surface {
        /// The grain.
        grain: u32,
        /// Which plane or triangle.
        element: u32,
    },
    /// The centre of a grain reaches a side of the open domain.
    Exit {
        /// The grain.
        grain: u32,
    },
}

/// After so many crossings a grain the layout of the cells is thought over.
const CROSSINGS_PER_GRAIN: usize = 8;

/// Among whom a partner is looked for.
#[derive(Clone, Copy, Debug)]
enum Among {
    All,
    /// Those of lower numbers, while all are looked at in turn.
    Lower,
}

/// Who can meet whom.
#[derive(Clone, Debug)]
enum Neighbors {
    /// Nobody: grains pass through each other.
    Nobody,
    /// For long flights.
    Cells(Box<Cells>),
    /// For short sub-steps.
    Lists(Lists),
}

impl Neighbors {
    /// Adds every grain that can soon touch `grain` to `near`, which is empty; now and then one is there twice.
    #[inline]
    fn add(&self, grain: u32, near: &mut Near) {
        match self {
            Self::Nobody => {}
            Self::Cells(cells) => cells.add_around(grain, near),
            Self::Lists(lists) => near.beyond.extend_from_slice(lists.of(grain)),
        }
    }

    /// The same without those in the lists whose numbers are higher: in cells, these are yet to be.
    #[inline]
    fn add_lower(&self, grain: u32, near: &mut Near) {
        match self {
            Self::Lists(lists) => near.beyond.extend(lists.of(grain).iter().filter(|&&(other, _)| other < grain)),
            _ => self.add(grain, near),
        }
    }

    /// Adds every grain that can soon touch `grain` to `near`, which is empty, once.
    fn add_each_once(&self, grain: u32, near: &mut Near) {
        self.add(grain, near);
        near.each_once(grain);
    }
}

/// Grains in free flight, and the order in which they meet each other and the surface.
///
/// [`next_before`](Self::next_before) gives the next encounter with its grains advanced to it; the caller decides what it does to
/// their velocities and says so with [`deflect`](Self::deflect). Each grain keeps its own local time, and its stored state changes only
/// when its motion does; so which neighbours were looked at, which calendar was used and how often somebody looked cannot
/// change a bit of what happens.
///
/// Times are seconds since the start of the current epoch. [`start_epoch`](Self::start_epoch) advances all grains to a common
/// moment and counts from there, so that resolution in time does not fade in long runs.
///
/// ```
/// use impinge_events::{Domain, Encounter, Encounters, Flight, NoSurface};
/// use nalgebra::Vector3;
///
/// let ball = |x: f64, vx: f64| Flight { position: Vector3::new(x, 0.0, 0.0), time: 0.0, velocity: Vector3::new(vx, 0.0, 0.0), radius: 0.5 };
/// let mut balls = Encounters::<NoSurface>::new(vec![ball(0.0, 1.0), ball(3.0, 0.0)], NoSurface, Domain::unbounded(), f64::INFINITY);
/// assert_eq!(balls.next_before(10.0), Some((2.0, Encounter::Grains { a: 0, b: 1 })));
/// // Equal elastic balls exchange their velocities.
/// balls.deflect(&[(0, Vector3::zeros()), (1, Vector3::x())]);
/// assert_eq!(balls.next_before(10.0), None);
/// assert_eq!(balls.flight(1).position_at(4.0).x, 5.0);
/// ```
#[derive(Clone, Debug)]
pub struct Encounters<S: Surface = NoSurface, C: Calendar = Buckets> {
    flights: Table<Flight>,
    neighbors: Neighbors,
    calendar: C,
    surface: S,
    domain: Domain,
    /// Numbers of grains that have been taken out, free for new ones.
    vacant: Vec<u32>,
    /// How many grains are inside.
    count: usize,
    /// How many grains there are in the whole domain, where only a part of them is here.
    everywhere: usize,
    /// Who has crossed into another cell lately, where only a part of the grains is here.
    crossed: Vec<u32>,
    /// Those that the latest encounter has brought to its time, as they were before.
    before: [Flight; 2],
    /// End of the epoch: nothing beyond it is scheduled.
    horizon: f64,
    /// Whether forces act. Then the flights are chords ([`Bend`]) and the epoch is a sub-step.
    under_force: bool,
    /// Accelerations of the grains, m/s²; empty where no force acts.
    accelerations: Vec<Vector3<f64>>,
    /// How far chords depart from paths, m.
    sag: f64,
    /// Cells crossed since their layout was last thought over.
    crossings: usize,
    /// Neighbours looked at since then.
    looks: usize,
    /// The neighbours that were visited last, kept for its memory.
    near: Near,
    /// Who comes soon.
    ahead: Ahead,
}

impl<S: Surface, C: Calendar> Encounters<S, C> {
    /// Grains that meet each other, `surface` and the sides of `domain`. Their local times count from the start of the first epoch; nothing later than `epoch`
    /// (s) is scheduled until the next one starts.
    ///
    /// # Panics
    /// Where a periodic domain is too small for the grains ([`Domain::holds`]).
    #[must_use]
    pub fn new(flights: impl IntoIterator<Item = Flight>, surface: S, domain: Domain, epoch: f64) -> Self {
        let mut encounters = Self::without_pairs(flights, surface, domain, epoch);
        encounters.lay_out_cells(0.0);
        encounters.predict_all(0.0);
        encounters
    }

    /// The same for grains that pass through each other and meet only `surface` and the sides of `domain`.
    #[must_use]
    pub fn transparent(flights: impl IntoIterator<Item = Flight>, surface: S, domain: Domain, epoch: f64) -> Self {
        let mut encounters = Self::without_pairs(flights, surface, domain, epoch);
        encounters.predict_all(0.0);
        encounters
    }

    fn without_pairs(flights: impl IntoIterator<Item = Flight>, surface: S, domain: Domain, epoch: f64) -> Self {
        let mut flights = table(flights);
        flights.iter_mut().for_each(|flight| domain.wrap(&mut flight.position));
        let mut calendar = C::default();
        calendar.reserve(flights.len());
        let count = flights.len();
        Self {
            flights,
            neighbors: Neighbors::Nobody,
            calendar,
            surface,
            domain,
            vacant: Vec::new(),
            count,
            everywhere: 0,
            crossed: Vec::new(),
            before: [VACANT; 2],
            horizon: epoch,
            under_force: false,
            accelerations: Vec::new(),
            sag: 0.0,
            crossings: 0,
            looks: 0,
            near: Near::default(),
            ahead: Ahead::default(),
        }
    }

    /// The state of a grain, at its own local time.
    #[inline]
    #[must_use]
    pub fn flight(&self, grain: u32) -> &Flight {
        &self.flights[grain as usize]
    }

    /// The numbers of all grains that are inside, in ascending order.
    pub fn inside(&self) -> impl Iterator<Item = u32> + Clone + '_ {
        (0..self.flights.len() as u32).filter(|&grain| !is_vacant(&self.flights[grain as usize]))
    }

    /// How many grains are inside.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// What the grains can hit.
    #[must_use]
    pub fn surface(&self) -> &S {
        &self.surface
    }

    /// The next encounter at or before `end` (s, epoch time) and its time, or `None`. Its grains have been advanced to that time; the
    /// caller now resolves it and calls [`deflect`](Self::deflect) or [`remove`](Self::remove) for each of them.
    pub fn next_before(&mut self, end: f64) -> Option<(f64, Encounter)> {
        self.ahead.meeting.clear();
        loop {
            let (owner, event) = self.calendar.next()?;
            if event.time > end {
                return None;
            }
            self.look_ahead();
            match event.kind {
                Kind::Crossing => self.cross(owner, event.time),
                Kind::Review => {
                    self.calendar.plan_mut(owner).set_pair(never(Kind::Review));
                    self.find_partner(owner, Among::All);
                    self.reschedule(owner);
                }
                Kind::Grains => {
                    let (a, b) = (owner.min(event.partner), owner.max(event.partner));
                    self.calendar.plan_mut(a).set_pair(never(Kind::Review));
                    self.calendar.plan_mut(b).set_pair(never(Kind::Review));
                    self.before = [a, b].map(|grain| self.flights[grain as usize]);
                    self.advance(a, event.time);
                    self.advance(b, event.time);
                    return Some((event.time, Encounter::Grains { a, b }));
                }
                Kind::Surface => {
                    self.before[0] = self.flights[owner as usize];
                    self.advance(owner, event.time);
                    return Some((event.time, Encounter::Surface { grain: owner, element: event.partner }));
                }
                Kind::Exit => {
                    self.before[0] = self.flights[owner as usize];
                    self.advance(owner, event.time);
                    return Some((event.time, Encounter::Exit { grain: owner }));
                }
            }
        }
    }

    /// Grains that will soon meet something, as the latest [`next_before`](Self::next_before) learnt on the way; nobody where there are so few grains that they
    /// fit the caches. For a caller who keeps more about each grain, and can [`prefetch`](crate::prefetch) it: a grain that is named may meet nothing
    /// after all, and one that is not named may.
    ///
    /// ```
    /// use impinge_events::{Domain, Encounters, Flight, NoSurface, prefetch};
    /// # let ball = |x: f64, vx: f64| Flight { position: nalgebra::Vector3::new(x, 0.0, 0.0), time: 0.0, velocity: nalgebra::Vector3::new(vx, 0.0, 0.0), radius: 0.5 };
    /// let (flights, masses) = (vec![ball(0.0, 1.0), ball(3.0, 0.0)], [1.0, 2.0]);
    /// let mut balls = Encounters::<NoSurface>::new(flights, NoSurface, Domain::unbounded(), f64::INFINITY);
    /// while let Some((_, encounter)) = balls.next_before(1.0) {
    ///     balls.soon().iter().for_each(|&grain| prefetch(&masses, grain as usize));
    ///     // ... what `encounter` does to velocities, by `masses`
    /// #   unreachable!("{encounter:?}");
    /// }
    /// ```
    #[inline]
    #[must_use]
    pub fn soon(&self) -> &[u32] {
        &self.ahead.meeting
    }

    /// Gives grains that have just met something their new velocities (m/s) and predicts what lies before them now.
    pub fn deflect(&mut self, grains: &[(u32, Vector3<f64>)]) {
        for &(grain, velocity) in grains {
            self.flights[grain as usize].velocity = velocity;
            self.release_partner(grain);
        }
        if let Neighbors::Lists(lists) = &self.neighbors {
            let keeps = |&(grain, _): &(u32, Vector3<f64>)| lists.holds(grain, self.flight(grain), self.horizon);
            if !grains.iter().all(keeps) {
                return self.leave_lists(self.flight(grains[0].0).time);
            }
        }
        for &(grain, _) in grains {
            self.predict(grain);
        }
    }

    /// Lets a grain pass through the surface from now on. Takes effect when it is next deflected.
    pub fn pass_through_surface(&mut self, grain: u32) {
        self.calendar.plan_mut(grain).pass_through_surface();
    }

    /// Takes a grain in and gives its number. Numbers of grains that have been removed are used again.
    ///
    /// It is accelerated at `acceleration` (m/s²) until the next sub-step, if there are such.
    pub fn insert(&mut self, mut flight: Flight, acceleration: Vector3<f64>) -> u32 {
        if self.under_force {
            let bend = Bend { acceleration, step: self.horizon };
            flight.position -= bend.offset(flight.time);
            flight.velocity -= bend.velocity(flight.time);
        }
        self.count += 1;
        let grain = self.vacant.pop().unwrap_or(self.flights.len() as u32);
        if grain as usize == self.flights.len() {
            self.flights.push(flight);
            self.calendar.reserve(self.flights.len());
            if self.under_force {
                self.accelerations.push(acceleration);
            }
        } else {
            self.flights[grain as usize] = flight;
            *self.calendar.plan_mut(grain) = Plan::default();
            if let Some(before) = self.accelerations.get_mut(grain as usize) {
                *before = acceleration;
            }
        }
        match &mut self.neighbors {
            Neighbors::Cells(cells) if cells.fits(flight.radius) && !cells.crowded(self.count) => {
                cells.insert(grain, &self.flights[grain as usize], flight.time);
                self.predict(grain);
            }
            Neighbors::Nobody => self.predict(grain),
            _ => {
                self.lay_out_cells(flight.time);
                self.predict_all(flight.time);
            }
        }
        grain
    }

    /// Takes a grain out.
    pub fn remove(&mut self, grain: u32) {
        self.take_out(grain);
        self.vacant.push(grain);
    }

    /// Takes a grain out and keeps its number.
    fn take_out(&mut self, grain: u32) {
        self.release_partner(grain);
        self.calendar.cancel(grain);
        if let Neighbors::Cells(cells) = &mut self.neighbors {
            cells.remove(grain);
        }
        self.flights[grain as usize] = VACANT;
        *self.calendar.plan_mut(grain) = Plan::default();
        self.count -= 1;
    }

    /// Whether a sphere at `position` with this `radius` (m) overlaps no grain at `time`.
    #[must_use]
    pub fn is_free(&self, position: Vector3<f64>, radius: f64, time: f64) -> bool {
        if matches!(self.neighbors, Neighbors::Nobody) {
            return true;
        }
        let keeps_clear = |other: u32| {
            let other = self.flight(other);
            self.domain.nearest(other.position_at(time) - position).norm() >= other.radius + radius
        };
        match &self.neighbors {
            Neighbors::Cells(cells) if cells.fits(radius) => {
                let mut near = Near::default();
                cells.add_near(position, time, &mut near);
                near.iter().all(|(other, _)| keeps_clear(other))
            }
            _ => self.inside().all(keeps_clear),
        }
    }

    /// Starts a new epoch `duration` seconds after the start of the current one: advances all grains to that moment, which is time 0
    /// from then on, and schedules nothing later than `next` seconds after it.
    ///
    /// `next_before(duration)` must have given `None`.
    pub fn start_epoch(&mut self, duration: f64, next: f64) {
        self.halt(duration);
        self.resume(next);
    }

    /// Advances all grains to a common moment, which is time 0 from then on.
    fn halt(&mut self, duration: f64) {
        self.surface.start_epoch(duration);
        if let Neighbors::Lists(lists) = &mut self.neighbors {
            lists.age(duration);
        }
        for grain in 0..self.flights.len() as u32 {
            let offset = self.bend(grain).offset(duration);
            let flight = &mut self.flights[grain as usize];
            if !is_vacant(flight) {
                *flight = flight.advanced_to(duration);
                flight.position += offset;
                flight.time = 0.0;
            }
        }
    }

    /// Predicts everything until `horizon` (s) for grains that stand at time 0.
    fn resume(&mut self, horizon: f64) {
        self.horizon = horizon;
        let lists_hold = match &self.neighbors {
            Neighbors::Nobody => false,
            Neighbors::Lists(lists) => self.inside().all(|grain| lists.holds(grain, self.flight(grain), horizon)),
            Neighbors::Cells(_) => false,
        };
        if !lists_hold {
            for flight in self.flights.iter_mut().filter(|flight| !is_vacant(flight)) {
                self.domain.wrap(&mut flight.position);
            }
            if !matches!(self.neighbors, Neighbors::Nobody) && !self.make_lists() {
                self.lay_out_cells(0.0);
            }
        }
        self.predict_all(0.0);
    }

    /// Lays out cells for the grains as they are at `now`, which are yet to enter them.
    fn lay_out_cells(&mut self, now: f64) {
        let stream = self.stream(now);
        assert!(self.domain.holds(stream.largest_radius), "the periodic domain is less than eight grain radii wide");
        self.take_cells(Cells::new(self.domain, self.everywhere, &stream));
    }

    /// Takes cells in which nobody is yet.
    fn take_cells(&mut self, mut cells: Cells) {
        // The old ones go first, so that their memory serves again.
        self.neighbors = Neighbors::Nobody;
        cells.reserve(self.flights.len());
        self.neighbors = Neighbors::Cells(Box::new(cells));
        (self.crossings, self.looks) = (0, 0);
    }

    fn flights_inside(&self) -> impl Iterator<Item = &Flight> + Clone {
        self.flights.iter().filter(|flight| !is_vacant(flight))
    }

    fn stream(&self, now: f64) -> Stream {
        Stream::new(self.flights_inside(), now)
    }

    /// Lays out the cells anew if the stream has changed so much that it pays.
    #[cold]
    fn think_over_cells(&mut self, now: f64) {
        let Neighbors::Cells(cells) = &self.neighbors else { return };
        let Some(better) = cells.better(&self.stream(now), self.crossings, self.looks) else {
            (self.crossings, self.looks) = (0, 0);
            return;
        };
        self.take_cells(better);
        for grain in 0..self.flights.len() as u32 {
            if self.enter(grain, now) {
                self.plan_crossing(grain);
                self.look_at_surface(grain);
                self.find_partner(grain, Among::Lower);
                self.reschedule(grain);
            }
        }
    }

    /// Predicts everything from `now` on, where nobody is in the cells yet, if there are such. Each pair is looked at once, for the second of the two.
    fn predict_all(&mut self, now: f64) {
        self.calendar.clear();
        for grain in 0..self.flights.len() as u32 {
            self.calendar.plan_mut(grain).set_pair(never(Kind::Review));
        }
        for grain in 0..self.flights.len() as u32 {
            if self.enter(grain, now) {
                self.predict_among(grain, Among::Lower);
            }
        }
    }

    /// Puts a grain into the cell where it is at `now`, if there are cells; gives false if it has been taken out.
    fn enter(&mut self, grain: u32, now: f64) -> bool {
        let flight = &self.flights[grain as usize];
        if let (Neighbors::Cells(cells), false) = (&mut self.neighbors, is_vacant(flight)) {
            cells.insert(grain, flight, now);
        }
        !is_vacant(flight)
    }

    /// Moves the state of a grain to `time`.
    #[inline]
    fn advance(&mut self, grain: u32, time: f64) {
        let flight = &mut self.flights[grain as usize];
        *flight = flight.advanced_to(time);
        if self.domain.periodic {
            let before = flight.position;
            match &mut self.neighbors {
                Neighbors::Nobody => self.domain.wrap(&mut flight.position),
                Neighbors::Cells(cells) => {
                    self.domain.wrap(&mut flight.position);
                    if flight.position != before {
                        cells.wrapped(grain, flight.position - before);
                    }
                }
                // The shifts in the lists are those of the positions with which they were made.
                Neighbors::Lists(_) => {}
            }
        }
    }

    /// Predicts everything that lies before a grain whose motion has changed.
    fn predict(&mut self, grain: u32) {
        self.predict_among(grain, Among::All);
    }

    // Each caller has its own, or every deflection would choose.
    #[inline(always)]
    fn predict_among(&mut self, grain: u32, others: Among) {
        self.plan_crossing(grain);
        let exit = Event { time: self.domain.exit_time(self.flight(grain)), kind: Kind::Exit, partner: NOBODY };
        let plan = self.calendar.plan_mut(grain);
        plan.set_side(exit);
        plan.set_looked_until(f64::NEG_INFINITY);
        self.look_at_surface(grain);
        self.find_partner(grain, others);
        self.reschedule(grain);
    }

    /// Plans when a grain leaves its cell.
    #[inline]
    fn plan_crossing(&mut self, grain: u32) {
        if let Neighbors::Cells(cells) = &self.neighbors {
            let crossing = cells.crossing(grain, &self.flights[grain as usize]);
            self.calendar.plan_mut(grain).set_crossing(crossing.time, crossing.side);
        } else {
            self.calendar.plan_mut(grain).set_crossing(f64::INFINITY, 0);
        }
    }

    /// Looks for the surface that a grain may hit before it leaves its cell.
    #[inline]
    fn look_at_surface(&mut self, grain: u32) {
        let plan = self.calendar.plan_mut(grain);
        let until = earlier(plan.crossing().time, self.horizon);
        if !plan.has_to_look(until) {
            return;
        }
        let flight = &self.flights[grain as usize];
        let outlook = match self.accelerations.get(grain as usize) {
            None => self.surface.first_contact(flight, until),
            Some(&acceleration) => {
                self.surface.first_contact_bent(flight, &Bend { acceleration, step: self.horizon }, until)
            }
        };
        match outlook {
            Outlook::Hit { time, element } => {
                plan.set_looked_until(f64::INFINITY);
                if time <= plan.side_time() {
                    plan.set_side(Event { time, kind: Kind::Surface, partner: element });
                }
            }
            Outlook::ClearUntil(time) => plan.set_looked_until(time),
        }
    }

    /// Finds the first grain that this one meets, among those of `others` that are near.
    #[inline]
    fn find_partner(&mut self, grain: u32, others: Among) {
        self.near.clear();
        match others {
            Among::All => self.neighbors.add(grain, &mut self.near),
            Among::Lower => self.neighbors.add_lower(grain, &mut self.near),
        }
        self.looks += self.near.len();
        let best = self.search(grain).first_among(&self.near);
        self.plan_pair(grain, best);
    }

    #[inline]
    fn search(&self, grain: u32) -> Search<'_, C> {
        let (flight, plan) = (&self.flights[grain as usize], self.calendar.plan(grain));
        let until = earlier(earlier(plan.pair().time, plan.side_time()), self.horizon);
        Search {
            grain,
            flight,
            until,
            sag: self.under_force.then_some(self.sag),
            horizon: self.horizon,
            flights: &self.flights,
            calendar: &self.calendar,
            best: plan.pair(),
        }
    }

    /// Puts a meeting into the plans of both grains, and leaves the one that `grain` or its new partner had in mind before.
    fn plan_pair(&mut self, grain: u32, event: Event) {
        if event.kind != Kind::Grains || event == self.calendar.plan(grain).pair() {
            return;
        }
        let other = event.partner;
        self.release_partner(grain);
        self.release_partner(other);
        self.calendar.plan_mut(grain).set_pair(event);
        self.calendar.plan_mut(other).set_pair(Event { partner: grain, ..event });
        self.reschedule(other);
    }

    /// Dissolves the planned meeting of a grain. The partner looks again when they would have met: until then nothing else happens to
    /// it, or it would have been planned instead.
    fn release_partner(&mut self, grain: u32) {
        let plan = self.calendar.plan_mut(grain);
        let event = plan.pair();
        plan.set_pair(never(Kind::Review));
        if event.kind == Kind::Grains {
            let review = Event { kind: Kind::Review, partner: NOBODY, ..event };
            self.calendar.plan_mut(event.partner).set_pair(review);
            self.reschedule(event.partner);
        }
    }

    /// Moves a grain into the next cell, at `now`, and looks at the neighbours that it has there.
    fn cross(&mut self, grain: u32, now: f64) {
        self.crossings += 1;
        if self.everywhere > 0 {
            self.crossed.push(grain);
        }
        if self.crossings > CROSSINGS_PER_GRAIN * self.count {
            // This crossing stays in the calendar, or is forgotten with the old cells.
            return self.think_over_cells(now);
        }
        let plan = self.calendar.plan(grain);
        let (side, mut best) = (plan.crossing().partner as u8, plan.pair());
        if let Neighbors::Cells(cells) = &mut self.neighbors {
            cells.cross(grain, side);
            self.near.clear();
            cells.add_ahead(grain, side, &mut self.near);
            if self.near.len() > 0 {
                best = self.search(grain).first_among(&self.near);
            }
        }
        self.plan_crossing(grain);
        self.look_at_surface(grain);
        self.plan_pair(grain, best);
        self.reschedule(grain);
    }

    /// Puts what comes first of the plan of a grain into the calendar.
    #[inline(never)]
    fn reschedule(&mut self, grain: u32) {
        let first = self.calendar.plan(grain).first();
        // A meeting is in the calendar once, with the lower of the two.
        let kept_by_partner = first.kind == Kind::Grains && first.partner < grain;
        if kept_by_partner || first.time > self.horizon {
            self.calendar.cancel(grain);
        } else {
            self.calendar.schedule(grain, first);
        }
    }
}

/// Stands where a grain has been taken out.
const VACANT: Flight = Flight {
    position: Vector3::new(f64::NAN, f64::NAN, f64::NAN),
    time: 0.0,
    velocity: Vector3::new(0.0, 0.0, 0.0),
    radius: 0.0,
};

#[inline]
fn is_vacant(flight: &Flight) -> bool {
    flight.radius == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where all was predicted anew each of two looked at the other, and their meeting stood in the calendar twice.
    #[test]
    fn two_that_will_meet_are_looked_at_once_and_stand_in_the_calendar_once() {
        let ball = |x: f64, speed: f64| Flight {
            position: Vector3::new(x, 0.0, 0.0),
            time: 0.0,
            velocity: Vector3::x() * speed,
            radius: 0.5,
        };
        let mut balls = Encounters::<NoSurface>::new(
            vec![ball(0.0, 1.0), ball(1.25, 0.0)],
            NoSurface,
            Domain::unbounded(),
            f64::INFINITY,
        );
        assert_eq!(balls.looks, 1);
        let meeting = Event { time: 0.25, kind: Kind::Grains, partner: 1 };
        assert_eq!(balls.calendar.plan(1).pair(), Event { partner: 0, ..meeting });
        assert_eq!(balls.calendar.next(), Some((0, meeting)));
        balls.calendar.cancel(0);
        assert_ne!(balls.calendar.next().map(|(_, event)| event.kind), Some(Kind::Grains));
    }
}
