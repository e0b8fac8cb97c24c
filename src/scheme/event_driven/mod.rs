//! From one predicted collision to the next.

use std::iter::repeat_n;
use std::ops::ControlFlow;

use impinge_events::calendar::{Buckets, Calendar};
use impinge_events::{Domain, Encounter, Encounters, Flight, Surface, Table, prefetch, table};
use nalgebra::Vector3;

mod collapse;
mod halves;
mod pressed;
mod under_force;

use self::collapse::{COLLAPSE_TIME, NO_ROW, Row, SURFACE};
pub use self::halves::{Halves, Windows};
pub(super) use self::under_force::Under;
pub use self::under_force::{AtRest, Held};
use self::under_force::{UnderForce, energy};
use super::{Broken, GrainCollision, Observer, Passage, Progress, SurfaceHit};
use crate::grains::{Grain, NewGrain, Snapshot};
use crate::law::{Body, ContactLaw, Friction, resolve_pair_under, resolve_surface_under};
use crate::scene::{Collapse, Interference};
use crate::surface::LARGEST_SLOPE;

/// Length of an epoch in the time that the fastest grain needs for its own radius (of the smallest grain).
///
/// Within an epoch a time is known to 2^-53 of the epoch, so a position to 4096 × 2^-53 = 5e-13 radii.
const EPOCH_RADII: f64 = 4096.0;
/// A grain that becomes so many times as fast as the fastest was, or enters so many times as small as the smallest, ends the epoch early:
/// resolution is lost by no more than this factor.
const OUTRUN: f64 = 8.0;
/// Exponent (of 2) of the length of an epoch in which nothing moves, s: any end is reached at once.
const LONGEST_EPOCH: f64 = 1000.0;
/// Shortest epoch over the time reached: below 2^-52 simulated time would stand still.
const LEAST_EPOCH: f64 = 1.0 / (1u64 << 50) as f64;
/// Overlap at an event, over the smaller radius, above which a run is wrong and stops. Rounding leaves about 1e-13.
pub const LARGEST_OVERLAP: f64 = 1e-9;
/// A run is jammed when so many encounters a grain, and [`JAM_ENCOUNTERS`] more, happen while time goes on by less than
/// [`JAM_TIME`] of an epoch (0.004 radii of flight of the fastest grain). A grain wedged in by a moving surface has no other future.
const JAM_ENCOUNTERS_PER_GRAIN: u64 = 1000;
const JAM_ENCOUNTERS: u64 = 1_000_000;
const JAM_TIME: f64 = 1.0 / (1u64 << 20) as f64;
/// Overlap over the smaller radius above which a run with forces is wrong and stops. Within a sub-step grains of unequal acceleration follow
/// their chords, and may overlap by ¼ of the way that the force pulls them together in half a sub-step.
pub const LARGEST_OVERLAP_WITH_FORCES: f64 = 1e-3;
/// Speed over that of the fastest grain below which a sequence of hits has collapsed.
const COLLAPSED: f64 = 1e-9;
/// Where there are up to so many times as many ids as grains inside, each grain is put into the place of its id, which is faster than to sort them.
const MOST_PLACES: u64 = 4;
/// Grains that start in a cube of their own are neighbours in memory.
const GRAINS_PER_CUBE: f64 = 8.0;
/// The law of a contact in a collapse where no force acts.
const ELASTIC: ContactLaw = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
/// Encounters between two looks at the watch (progress, Ctrl-C).
const ENCOUNTERS_PER_WATCH: u32 = 4096;

/// What happens at a contact, and which contacts count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laws {
    /// Between two grains.
    pub grain: ContactLaw,
    /// Between a grain and the surface.
    pub surface: ContactLaw,
    /// Which collisions take part.
    pub interference: Interference,
    /// What happens to grains that collide again and again in no time.
    pub collapse: Collapse,
}

/// Grains, what they meet, and the laws of their meetings; advanced from event to event.
#[derive(Clone, Debug)]
pub struct EventDriven<S: Surface, C: Calendar = Buckets> {
    encounters: Encounters<S, C>,
    /// What grains carry besides their flights, by the numbers of `encounters`.
    grains: Table<Grain>,
    /// How the latest hits of each grain followed each other, by the same numbers; empty where collapses are not treated.
    rows: Table<Row>,
    laws: Laws,
    domain: Domain,
    /// Simulated time at the start of the epoch, s.
    epoch_start: f64,
    /// Length of the epoch, s: a power of two, so that `epoch_start` stays exact unless an epoch ends early.
    epoch: f64,
    /// Largest speed (along any axis) at the start of the epoch, m/s.
    fastest: f64,
    /// Smallest radius at the start of the epoch, m; infinity where there were no grains.
    smallest: f64,
    /// Whether a grain has become too fast for the epoch.
    outrun: bool,
    /// Hits within this time (s) are in a row.
    in_a_row: f64,
    /// What forces need, where they act.
    force: UnderForce,
    /// Simulated time that has been reached, s.
    time: f64,
    entered: u64,
    collisions: u64,
    since_watch: u32,
    /// Encounters since `mark` (epoch time, s).
    since_mark: u64,
    /// How deep anybody has gone into anything, over the radius.
    deepest: f64,
    mark: f64,
}

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// A run that starts at simulated time `start` (s) with `grains` inside.
    #[must_use]
    pub fn new(grains: &[NewGrain], surface: S, domain: Domain, laws: Laws, start: f64) -> Self {
        let order = side_by_side(grains);
        let flights = order.iter().map(|&(_, id)| flight(&grains[id as usize]));
        let (fastest, smallest) = extremes(flights.clone(), surface.speed());
        let epoch = epoch_length(smallest, fastest, start);
        let encounters = match laws.interference {
            Interference::None => Encounters::transparent(flights, surface, domain, epoch),
            _ => Encounters::new(flights, surface, domain, epoch),
        };
        let carried = table(order.iter().map(|&(_, id)| carried(&grains[id as usize], u64::from(id))));
        let entered = grains.len() as u64;
        Self {
            encounters,
            rows: if laws.collapse == Collapse::Elastic { table(repeat_n(NO_ROW, grains.len())) } else { table([]) },
            grains: carried,
            laws,
            domain,
            epoch_start: start,
            epoch,
            fastest,
            smallest,
            outrun: false,
            in_a_row: COLLAPSE_TIME * epoch,
            force: UnderForce::default(),
            time: start,
            entered,
            collisions: 0,
            since_watch: 0,
            since_mark: 0,
            deepest: 0.0,
            mark: 0.0,
        }
    }

    /// Simulated time that has been reached, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Simulated time at the start of the epoch, s: times of the surface count from it.
    #[must_use]
    pub fn epoch_start(&self) -> f64 {
        self.epoch_start
    }

    /// The region that is simulated.
    #[must_use]
    pub fn domain(&self) -> Domain {
        self.domain
    }

    /// What the grains can hit.
    #[must_use]
    pub fn surface(&self) -> &S {
        self.encounters.surface()
    }

    /// Starts an epoch `after` seconds into the current one, and chooses its length by the fastest and the smallest grain.
    fn start_epoch(&mut self, after: f64) {
        let length = self.natural_epoch(after);
        self.encounters.start_epoch(after, length);
        self.begin(after, length);
    }

    /// Length of an epoch (s) that starts `after` seconds into the current one without forces.
    fn natural_epoch(&mut self, after: f64) -> f64 {
        (self.fastest, self.smallest) = self.extremes();
        self.epoch_of_extremes(after)
    }

    fn extremes(&self) -> (f64, f64) {
        let flights = self.encounters.inside().map(|grain| *self.encounters.flight(grain));
        extremes(flights, self.encounters.surface().speed())
    }

    fn epoch_of_extremes(&mut self, after: f64) -> f64 {
        let length = epoch_length(self.smallest, self.fastest, self.epoch_start + after);
        self.in_a_row = COLLAPSE_TIME * length;
        length
    }

    fn begin(&mut self, after: f64, length: f64) {
        self.epoch_start += after;
        self.epoch = length;
        self.outrun = false;
        for row in self.rows.iter_mut() {
            row.start_epoch(after);
        }
        (self.mark, self.since_mark) = (0.0, 0);
    }

    /// Smallest radius of the grains inside, m; infinity where there are none.
    #[must_use]
    pub fn smallest_radius(&self) -> f64 {
        self.encounters.inside().map(|grain| self.encounters.flight(grain).radius).fold(f64::INFINITY, f64::min)
    }

    /// Largest radius of the grains inside, m.
    #[must_use]
    pub fn largest_radius(&self) -> f64 {
        self.encounters.inside().map(|grain| self.encounters.flight(grain).radius).fold(0.0, f64::max)
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
            let epoch_end = self.epoch_start + self.epoch;
            // The end of the epoch as it is known to `encounters`, free of the rounding of `epoch_end`.
            let until = if end < epoch_end { end - self.epoch_start } else { self.epoch };
            let Some((time, encounter)) = self.next_before(until) else {
                if end <= epoch_end || self.force.acts {
                    break;
                }
                self.start_epoch(self.epoch);
                self.time = self.epoch_start;
                // Where hardly anything collides an epoch may be all there is to watch.
                if watch(self.progress()).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                continue;
            };
            self.resolve(time, encounter, observer)?;
            let now = self.epoch_start + time;
            if self.outrun && !self.force.acts {
                self.start_epoch(time);
            }
            self.since_watch += 1;
            if self.since_watch == ENCOUNTERS_PER_WATCH {
                self.since_watch = 0;
                self.time = now;
                if watch(self.progress()).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        self.time = end;
        Ok(watch(self.progress()))
    }

    /// The next encounter at or before `until` (s, epoch time). What its grains carry is asked for at once, not when each is needed, and what those carry
    /// who come soon, ahead.
    #[inline]
    fn next_before(&mut self, until: f64) -> Option<(f64, Encounter)> {
        let next = self.encounters.next_before(until)?;
        let fetch = |grain: u32| {
            prefetch(&self.grains, grain as usize);
            prefetch(&self.rows, grain as usize);
        };
        match next.1 {
            Encounter::Grains { a, b } => [a, b].map(fetch),
            Encounter::Surface { grain, .. } | Encounter::Exit { grain } => [fetch(grain), ()],
        };
        self.encounters.soon().iter().copied().for_each(fetch);
        Some(next)
    }

    #[inline]
    fn resolve(&mut self, time: f64, encounter: Encounter, observer: &mut impl Observer) -> Result<(), Broken> {
        self.watch_for_jam(time, encounter)?;
        match encounter {
            Encounter::Grains { a, b } => self.collide(time, a, b, observer)?,
            Encounter::Surface { grain, element } => self.hit(time, grain, element, observer)?,
            Encounter::Exit { grain } => self.take_out(Passage::Left, time, grain, observer),
        }
        Ok(())
    }

    /// Stops a run in which time no longer goes on.
    #[inline]
    fn watch_for_jam(&mut self, time: f64, encounter: Encounter) -> Result<(), Broken> {
        self.since_mark += 1;
        if time > self.mark + JAM_TIME * self.epoch {
            (self.mark, self.since_mark) = (time, 0);
        } else if self.since_mark > JAM_ENCOUNTERS + JAM_ENCOUNTERS_PER_GRAIN * self.grains.len() as u64 {
            let slots = match encounter {
                Encounter::Grains { a, b } => vec![a, b],
                Encounter::Surface { grain, .. } | Encounter::Exit { grain } => vec![grain],
            };
            // A collapse of very unequal grains takes as many hits, but all but stands still: it ends by itself.
            let speed = |&slot: &u32| self.encounters.flight(slot).velocity.amax();
            if slots.iter().map(speed).fold(0.0, f64::max) < COLLAPSED * self.fastest {
                self.since_mark = 0;
                return Ok(());
            }
            let grains = slots.iter().map(|&slot| self.grains[slot as usize].id).collect();
            return Err(Broken::Jammed { time: self.epoch_start + time, grains, encounters: self.since_mark });
        }
        Ok(())
    }

    fn progress(&self) -> Progress {
        Progress { time: self.time, collisions: self.collisions, inside: self.encounters.count() }
    }

    /// Notes a hit of a grain with `partner` at `approach` (m/s) and tells whether the grain is part of a collapse.
    #[inline]
    fn is_collapsing(&mut self, time: f64, grain: u32, partner: u32, approach: f64) -> bool {
        let within = self.in_a_row;
        // Under force, a line comes to rest.
        let in_line = !self.carries();
        let at_once = self.force.acts && self.force.at_rest == AtRest::Colliding;
        self.rows.get_mut(grain as usize).is_some_and(|row| {
            let again = at_once && row.goes_on(time, within);
            row.note(time, within, partner, approach, in_line) || again
        })
    }

    /// Whether forces act, and contacts that they press together come to rest.
    #[inline]
    fn carries(&self) -> bool {
        self.force.acts && self.force.at_rest == AtRest::Carried
    }

    /// The law of a contact in a collapse: elastic where grains fly apart after it, plastic where forces press them together until they rest. What
    /// loses nothing by its law loses nothing here.
    fn law_in_collapse(&self, law: &ContactLaw) -> ContactLaw {
        if self.carries() && law.restitution < 1.0 { ContactLaw { restitution: 0.0, ..*law } } else { ELASTIC }
    }

    /// Two grains touch.
    fn collide(&mut self, time: f64, a: u32, b: u32, observer: &mut impl Observer) -> Result<(), Broken> {
        // The lower id is the first of the two: slots are used again, ids are not.
        let (a, b) = if self.grains[a as usize].id < self.grains[b as usize].id { (a, b) } else { (b, a) };
        let (mut first, mut second) = (self.body(a), self.body(b));
        let (flight_a, flight_b) = (self.true_flight(a), self.true_flight(b));
        // The chords touch, and the normal is theirs: whoever resolves a contact sees the approach that the prediction saw.
        let chords = self.encounters.flight(b).position - self.encounters.flight(a).position;
        let normal = self.domain.nearest(chords).normalize();
        let distance = self.domain.nearest(flight_b.position - flight_a.position).norm();
        let ids = [self.grains[a as usize].id, self.grains[b as usize].id];
        let overlap_over_radius = (first.radius + second.radius - distance) / first.radius.min(second.radius);
        let shielded = self.laws.interference == Interference::RemovedOnFirstCollision
            && (self.grains[a as usize].hits == 0) != (self.grains[b as usize].hits == 0);
        if shielded {
            let (fresh, other) = if self.grains[a as usize].hits == 0 { (a, b) } else { (b, a) };
            self.take_out(Passage::Removed, time, fresh, observer);
            let onwards = self.true_flight(other).velocity;
            self.deflect(&[(other, onwards)]);
            return Ok(());
        }
        let elastic = normal * (2.0 * (first.velocity - second.velocity).dot(&normal) / (first.mass + second.mass));
        let late = self.synchronisation(time, [a, b], [-elastic * second.mass, elastic * first.mass]);
        let approach = (first.velocity - second.velocity + late[0] - late[1]).dot(&normal);
        let slow = self.force.acts && approach <= self.force.resting_speed_of_pairs;
        if slow && self.carries() {
            self.check(time, &ids, overlap_over_radius, &[])?;
            self.hand_on(time, [a, b], normal);
            return Ok(());
        }
        first.velocity += late[0];
        second.velocity += late[1];
        let external = self.external([a, b]);
        let mut contact = resolve_pair_under(&self.laws.grain, &first, &second, normal, &external);
        let mut withheld = 0.0;
        // Both rows go on, whatever the first says.
        let approach = contact.approach_speed;
        if slow | self.is_collapsing(time, a, b, approach) | self.is_collapsing(time, b, a, approach) {
            let lawful = contact.impulse.dissipated;
            contact = resolve_pair_under(&self.law_in_collapse(&self.laws.grain), &first, &second, normal, &external);
            withheld = (lawful - contact.impulse.dissipated).max(0.0);
        }
        // Where rounding has turned the slightest graze into none, both fly on.
        if contact.impulse.normal == 0.0 {
            self.deflect(&[(a, first.velocity - late[0]), (b, second.velocity - late[1])]);
            return Ok(());
        }
        let [mut after_a, mut after_b] = contact.after;
        if self.force.under.contact_time > 0.0 {
            // The forces have had their share in the contact, and do not act for as long after it.
            after_a.velocity -= external.on_first / after_a.mass;
            after_b.velocity -= external.on_second / after_b.mass;
            let change = energy(&first) + energy(&second) - energy(&after_a) - energy(&after_b);
            self.force.held.dissipated_grain += change - contact.impulse.dissipated;
        }
        self.check(time, &ids, overlap_over_radius, &[after_a.velocity, after_b.velocity])?;
        self.grains[a as usize].spin = after_a.spin;
        self.grains[b as usize].spin = after_b.spin;
        self.deflect(&[(a, after_a.velocity - late[0]), (b, after_b.velocity - late[1])]);
        self.collisions += 1;
        observer.grain_collision(&GrainCollision {
            time: self.epoch_start + time,
            ids,
            position: flight_a.position + normal * first.radius,
            normal,
            radii: [first.radius, second.radius],
            impulse_normal: contact.impulse.normal,
            impulse_tangential: -contact.impulse.tangential,
            approach_speed: contact.approach_speed,
            dissipated: contact.impulse.dissipated,
            withheld,
            overlap_over_radius,
        });
        Ok(())
    }

    /// A grain touches the surface.
    fn hit(&mut self, time: f64, grain: u32, element: u32, observer: &mut impl Observer) -> Result<(), Broken> {
        let before = self.body(grain);
        let flight = self.true_flight(grain);
        let mut contact = self.encounters.surface().contact(element, &flight);
        let id = self.grains[grain as usize].id;
        if self.domain.planar && contact.normal.y != 0.0 {
            if contact.normal.y.abs() > LARGEST_SLOPE {
                return Err(Broken::OutOfPlane { time: self.epoch_start + time, grain: id });
            }
            contact.normal = Vector3::new(contact.normal.x, 0.0, contact.normal.z).normalize();
        }
        let slow = self.force.acts
            && -(before.velocity - contact.velocity).dot(&contact.normal) <= self.resting_speed_at_surface(grain);
        if slow && self.carries() {
            return self.hold_on_surface(time, grain, &before, &contact);
        }
        let elastic = contact.normal * (2.0 * (before.velocity - contact.velocity).dot(&contact.normal));
        let [late] = self.synchronisation(time, [grain], [-elastic]);
        let before = Body { velocity: before.velocity + late, ..before };
        let external = self.external([grain, grain]).on_first;
        let mut resolved =
            resolve_surface_under(&self.laws.surface, &before, contact.normal, contact.velocity, external);
        let mut withheld = 0.0;
        if slow | self.is_collapsing(time, grain, SURFACE, resolved.approach_speed) {
            let (lawful, law) = (resolved.impulse.dissipated, self.law_in_collapse(&self.laws.surface));
            resolved = resolve_surface_under(&law, &before, contact.normal, contact.velocity, external);
            withheld = (lawful - resolved.impulse.dissipated).max(0.0);
        }
        if self.force.under.contact_time > 0.0 {
            resolved.after.velocity -= external / before.mass;
            let change = energy(&before) - energy(&resolved.after) + resolved.work;
            self.force.held.dissipated_surface += change - resolved.impulse.dissipated;
        }
        if resolved.impulse.normal == 0.0 {
            self.deflect(&[(grain, before.velocity - late)]);
            return Ok(());
        }
        let overlap_over_radius = -contact.gap / before.radius;
        self.check(time, &[id], overlap_over_radius, &[resolved.after.velocity])?;
        let carried = &mut self.grains[grain as usize];
        carried.spin = resolved.after.spin;
        carried.hits += 1;
        let order = carried.hits;
        if matches!(self.laws.interference, Interference::FirstOrder | Interference::RemovedOnFirstCollision) {
            self.encounters.pass_through_surface(grain);
        }
        self.deflect(&[(grain, resolved.after.velocity - late)]);
        self.collisions += 1;
        let arriving = before.velocity - contact.velocity;
        let energy_normal = 0.5 * before.mass * arriving.dot(&contact.normal).powi(2);
        let along = arriving - contact.normal * arriving.dot(&contact.normal);
        observer.surface_hit(&SurfaceHit {
            time: self.epoch_start + time,
            id,
            mass: before.mass,
            radius: before.radius,
            element,
            position: flight.position - contact.normal * (before.radius + contact.gap),
            normal: contact.normal,
            order,
            impulse_normal: resolved.impulse.normal,
            impulse_tangential: -resolved.impulse.tangential,
            approach_speed: resolved.approach_speed,
            energy_normal,
            energy_tangential: 0.5 * before.mass * along.norm_squared(),
            energy_spin: 0.2 * before.mass * before.radius.powi(2) * before.spin.norm_squared(),
            dissipated: resolved.impulse.dissipated,
            withheld,
            work: resolved.work,
            overlap_over_radius,
        });
        Ok(())
    }

    /// Gives grains that have just met something their new velocities (m/s).
    #[inline]
    fn deflect<const N: usize>(&mut self, grains: &[(u32, Vector3<f64>); N]) {
        if !self.force.supported.is_empty() {
            grains.iter().for_each(|&(grain, velocity)| self.let_go(grain, velocity));
        }
        self.redirect(grains);
    }

    /// The same for grains that stay where they are supported.
    #[inline]
    fn redirect<const N: usize>(&mut self, grains: &[(u32, Vector3<f64>); N]) {
        self.outrun |= grains.iter().any(|(_, velocity)| velocity.amax() > OUTRUN * self.fastest);
        if self.force.acts {
            let chord = |&(grain, velocity): &(u32, Vector3<f64>)| {
                let time = self.encounters.flight(grain).time;
                (grain, velocity - self.encounters.bend(grain).velocity(time))
            };
            let chords = grains.each_ref().map(chord);
            self.encounters.deflect(&chords);
        } else {
            self.encounters.deflect(grains);
        }
    }

    fn take_out(&mut self, passage: Passage, time: f64, grain: u32, observer: &mut impl Observer) {
        let flight = self.true_flight(grain);
        self.pass(grain, 1.0);
        observer.passage(passage, self.epoch_start + time, &flight, &self.grains[grain as usize]);
        self.release(grain);
        self.encounters.remove(grain);
    }

    /// Takes a grain in at simulated time `time` (s), to which the run has been advanced.
    pub fn enter(&mut self, time: f64, new: &NewGrain, observer: &mut impl Observer) {
        let flight = Flight { time: time - self.epoch_start, ..flight(new) };
        let grain = carried(new, self.entered);
        self.entered += 1;
        let slot = self.encounters.insert(flight, self.force.under.gravity) as usize;
        if slot == self.grains.len() {
            self.grains.push(grain);
            if self.laws.collapse == Collapse::Elastic {
                self.rows.push(NO_ROW);
            }
        } else {
            self.grains[slot] = grain;
            if let Some(anchor) = self.force.anchors.get_mut(slot) {
                *anchor = None;
            }
            if let Some(row) = self.rows.get_mut(slot) {
                *row = NO_ROW;
            }
        }
        self.pass(slot as u32, -1.0);
        observer.passage(Passage::Entered, time, &flight, &grain);
        if self.force.acts {
            return;
        }
        if flight.velocity.amax() > OUTRUN * self.fastest || OUTRUN * flight.radius < self.smallest {
            self.start_epoch(flight.time);
        }
    }

    /// Whether a grain of this radius (m) at `position` (m) overlaps no other at simulated time `time` (s). The surface is not asked.
    pub fn is_free(&self, position: Vector3<f64>, radius: f64, time: f64) -> bool {
        self.encounters.is_free(position, radius, time - self.epoch_start)
    }

    /// Shows all grains at simulated time `time` (s), to which the run has been advanced.
    pub fn snapshot<R>(&self, time: f64, look: impl FnOnce(&Snapshot<'_>) -> R) -> R {
        snapshot_of(time, self.encounters.inside().map(|slot| (self, slot)), look)
    }

    /// A grain at simulated time `time` (s), as a snapshot shows it.
    fn flight_in_snapshot(&self, slot: u32, time: f64) -> Flight {
        let now = time - self.epoch_start;
        let mut flight = self.encounters.flight(slot).advanced_to(now);
        if self.force.acts {
            let bend = self.encounters.bend(slot);
            flight.position += bend.offset(now);
            flight.velocity += bend.velocity(now);
        }
        flight.time = 0.0;
        self.domain.wrap(&mut flight.position);
        flight
    }

    #[inline]
    fn body(&self, grain: u32) -> Body {
        let flight = self.true_flight(grain);
        let Grain { mass, spin, .. } = self.grains[grain as usize];
        Body { mass, radius: flight.radius, velocity: flight.velocity, spin }
    }

    /// Stops the run where an invariant is broken.
    #[inline]
    fn check(&mut self, time: f64, ids: &[u64], overlap: f64, velocities: &[Vector3<f64>]) -> Result<(), Broken> {
        self.deepest = self.deepest.max(overlap);
        let numbers = velocities.iter().all(|velocity| velocity.norm_squared().is_finite());
        let allowed = if self.force.acts { LARGEST_OVERLAP_WITH_FORCES } else { LARGEST_OVERLAP };
        if overlap <= allowed && numbers {
            return Ok(());
        }
        Err(broken(self.epoch_start + time, ids, overlap, allowed, numbers))
    }
}

/// Shows the grains in these slots of engines at simulated time `time` (s), in the order of their ids.
fn snapshot_of<'a, S: Surface + 'a, C: Calendar + 'a, R>(
    time: f64,
    slots: impl Iterator<Item = (&'a EventDriven<S, C>, u32)> + Clone,
    look: impl FnOnce(&Snapshot<'_>) -> R,
) -> R {
    let slots = in_order(slots, |&(engine, slot)| engine.grains[slot as usize].id);
    let flights = table(slots.iter().map(|&(engine, slot)| engine.flight_in_snapshot(slot, time)));
    let grains = table(slots.iter().map(|&(engine, slot)| engine.grains[slot as usize]));
    look(&Snapshot { time, flights: &flights, grains: &grains })
}

/// Items in the order of their ids, all of which differ.
fn in_order<T: Copy>(items: impl Iterator<Item = T> + Clone, id: impl Fn(&T) -> u64) -> Table<T> {
    let Some(any) = items.clone().next() else { return table([]) };
    let (count, places) = items.clone().fold((0, 0), |(count, places), item| (count + 1, id(&item).max(places)));
    if places >= MOST_PLACES * count {
        let mut items = table(items);
        items.sort_unstable_by_key(id);
        return items;
    }
    // Where nobody belongs, somebody stands who belongs elsewhere.
    let mut by_id = table(repeat_n(any, places as usize + 1));
    items.for_each(|item| by_id[id(&item) as usize] = item);
    let mut ids = 0..;
    by_id.retain(|item| Some(id(item)) == ids.next());
    by_id
}

/// Largest speed along any axis, that of the surface included (m/s), and smallest radius (m).
fn extremes(flights: impl Iterator<Item = Flight>, surface_speed: f64) -> (f64, f64) {
    flights.fold((surface_speed, f64::INFINITY), |(fastest, smallest), flight| {
        (fastest.max(flight.velocity.amax()), smallest.min(flight.radius))
    })
}

/// Length of an epoch that starts at simulated time `start` (s), for grains of this radius (m) and speed (m/s): a power of two.
fn epoch_length(radius: f64, speed: f64, start: f64) -> f64 {
    let exponent = (EPOCH_RADII * radius / speed).log2().min(LONGEST_EPOCH);
    let least = (start.abs() * LEAST_EPOCH).log2();
    2f64.powi(exponent.max(least).floor() as i32)
}

#[cold]
fn broken(time: f64, ids: &[u64], overlap: f64, allowed: f64, numbers: bool) -> Broken {
    let grains = ids.to_vec();
    if numbers { Broken::Overlap { time, grains, overlap, allowed } } else { Broken::NotANumber { time, grains } }
}

/// The grains in an order in which those that are near in space are near in memory, row by row of cubes that hold a few of them; each with its cube.
pub(super) fn side_by_side(grains: &[NewGrain]) -> Table<([u32; 3], u32)> {
    let low = grains.iter().fold(Vector3::repeat(f64::INFINITY), |low, grain| low.inf(&grain.position));
    let high = grains.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |high, grain| high.sup(&grain.position));
    let extent = high - low;
    let axes = extent.iter().filter(|&&along| along > 0.0);
    let cubes = grains.len() as f64 / GRAINS_PER_CUBE;
    let side = (axes.clone().product::<f64>() / cubes).powf(1.0 / axes.count().max(1) as f64);
    let in_cube = |(id, grain): (u32, &NewGrain)| {
        let cube = ((grain.position - low) / side).map(|x| x as u32);
        ([cube.z, cube.y, cube.x], id)
    };
    let mut order = table((0..).zip(grains).map(in_cube));
    order.sort_unstable();
    order
}

pub(super) fn flight(grain: &NewGrain) -> Flight {
    Flight { position: grain.position, time: 0.0, velocity: grain.velocity, radius: grain.radius }
}

pub(super) fn carried(grain: &NewGrain, id: u64) -> Grain {
    Grain { id, mass: grain.mass(), spin: grain.spin, hits: 0, strength: grain.strength }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_come_in_the_order_of_their_ids_however_many_ids_there_are() {
        for step in [1, 3, 1_000_000_000_000] {
            let shuffled: Vec<u64> = (0..101).map(|number| number * 37 % 101 * step).collect();
            let sorted: Vec<u64> = (0..101).map(|number| number * step).collect();
            assert_eq!(in_order(shuffled.into_iter(), |&id| id)[..], sorted, "step {step}");
        }
        assert!(in_order([].into_iter(), |&id| id).is_empty());
    }
}
