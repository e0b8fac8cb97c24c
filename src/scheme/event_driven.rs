//! From one predicted collision to the next.

use std::ops::ControlFlow;

use impinge_events::calendar::{Calendar, Tournament};
use impinge_events::{Domain, Encounter, Encounters, Flight, Surface, SurfaceContact, Touch, YIELDING};
use nalgebra::Vector3;
use rustc_hash::FxHashSet;

use super::resting::PAIR_REST;
use super::{Broken, GrainCollision, Observer, Passage, Progress, SurfaceHit};
use crate::grains::{Grain, NewGrain, Snapshot};
use crate::near_field::Singular;
use crate::law::{NearField, Body, ContactLaw, Friction, resolve_pair_under, resolve_surface_under, External};
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
/// A caged grain, one that has hit at least three partners in a row of hits each within [`COLLAPSE_TIME`] of the one before, is part of a
/// collapse after so many. In the reference jets (restitution 0.8) no grain ever is.
const COLLAPSE_HITS: u32 = 16;
/// A grain in a line, between no more than two partners, is so after this many hits in which its approach speed has not halved. Collapses in
/// a line die out by themselves and have a closed form; it holds up to an outer grain some fifty times as heavy as the inner one.
const COLLAPSE_HITS_IN_LINE: u32 = 64;
/// Part of an epoch (0.001 radii of flight of the fastest grain) within which hits are in a row.
const COLLAPSE_TIME: f64 = 1.0 / (1u64 << 22) as f64;
/// Speed over that of the fastest grain below which a sequence of hits has collapsed.
const COLLAPSED: f64 = 1e-9;
/// Overlap over the smaller radius above which a run with forces is wrong and stops. Within a sub-step grains of unequal acceleration follow
/// their chords, and may overlap by ¼ of the way that the force pulls them together in half a sub-step.
pub const LARGEST_OVERLAP_WITH_FORCES: f64 = 1e-3;
/// A contact under force whose approach speed is below this part of what the force gives in a sub-step has come to rest. A bouncing grain then
/// comes to rest early by this part of a sub-step over 1 - e.
const STICKING: f64 = 1e-8;
/// A sub-step ends early once so many contacts a grain, and [`HOLDS`] more, have been held in it. One by one, grains that are pressed together
/// come to rest as slowly as heat spreads; at a kick that is done for all of them at once, at the price of about so many of these events.
const HOLDS_PER_GRAIN: f64 = 0.5;
const HOLDS: f64 = 16.0;
/// A sub-step that ends before this part of its length makes the next one more patient, twice as much each time: time goes on.
const HASTY: f64 = 1.0 / 64.0;
/// What is taken off an acceleration into a contact at rest, more than itself: enough that rounding leaves none of it.
const RELIEF: f64 = 1.0 + 1.0 / (1u64 << 48) as f64;
/// The law of a contact in a collapse.
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

/// Hits of one grain, each shortly after the one before.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Time of the latest hit, s (epoch time).
    latest: f64,
    /// Approach speed that is to be halved, m/s.
    speed: f64,
    /// All hits.
    hits: u32,
    /// Those since the approach speed was halved.
    not_halved: u32,
    /// The first two that were hit.
    partners: [u32; 2],
    /// Whether there was a third.
    caged: bool,
}

const NO_ROW: Row =
    Row { latest: f64::NEG_INFINITY, speed: 0.0, hits: 0, not_halved: 0, partners: [NOBODY; 2], caged: false };
/// Where there is no partner.
const NOBODY: u32 = u32::MAX;
/// The surface as a partner.
const SURFACE: u32 = u32::MAX - 1;

impl Row {
    /// Whether another grain was hit in the row.
    fn among_grains(&self) -> bool {
        self.partners.iter().any(|&partner| partner < SURFACE)
    }

    /// Notes a hit with `partner` at `approach` (m/s) at `time` (s), in a row if it is at most `within` (s) after the one before, and tells
    /// whether the grain is part of a collapse that does not end by itself.
    #[inline]
    fn note(&mut self, time: f64, within: f64, partner: u32, approach: f64, in_line: bool) -> bool {
        if time - self.latest > within {
            *self = NO_ROW;
        }
        self.latest = time;
        self.hits = self.hits.saturating_add(1);
        self.not_halved = self.not_halved.saturating_add(1);
        if approach < 0.5 * self.speed || self.hits == 1 {
            (self.speed, self.not_halved) = (approach, 0);
        }
        if !self.partners.contains(&partner) {
            match self.partners.iter_mut().find(|known| **known == NOBODY) {
                Some(free) => *free = partner,
                None => self.caged = true,
            }
        }
        (self.caged && self.hits > COLLAPSE_HITS) || (in_line && self.not_halved > COLLAPSE_HITS_IN_LINE)
    }
}

/// What acts in a sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Under {
    /// Grains nearer to each other than this (m) may be in contact at rest.
    pub(super) reach: f64,
    /// m/s²; what a grain that enters is accelerated at until the next sub-step.
    pub(super) gravity: Vector3<f64>,
    /// The near field, as it acts between two grains that touch.
    pub(super) near_field: Option<NearField>,
    /// How long a contact lasts for the impulse that forces give to it, s.
    pub(super) contact_time: f64,
}

/// What the treatment of contacts at rest did within sub-steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Impulse of the surface on grains, N s; counted in the velocities of chords.
    pub impulse_surface: Vector3<f64>,
    /// What gravity and near field gave to grains that came or went, beyond or short of the kick before, N s.
    pub impulse_gravity: Vector3<f64>,
    /// The same of the near field.
    pub impulse_near_field: Vector3<f64>,
    /// Kinetic energy taken from grains at contacts with each other, J; negative where some was given.
    pub dissipated_grain: f64,
    /// The same at contacts with the surface.
    pub dissipated_surface: f64,
    /// How many contacts were held.
    pub contacts: u64,
}

/// Grains, what they meet, and the laws of their meetings; advanced from event to event.
#[derive(Clone, Debug)]
pub struct EventDriven<S: Surface, C: Calendar = Tournament> {
    encounters: Encounters<S, C>,
    /// What grains carry besides their flights, by the numbers of `encounters`.
    grains: Vec<Grain>,
    /// How the latest hits of each grain followed each other, by the same numbers; empty where collapses are not treated.
    rows: Vec<Row>,
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
    /// Whether forces act: then the epoch is a sub-step, and somebody else says when the next one starts.
    forces: bool,
    under: Under,
    /// Approach speed below which a contact under force has come to rest, m/s.
    resting_speed: f64,
    /// The same for two grains, and for grains among others at the surface.
    resting_speed_of_pairs: f64,
    /// Where the grains were at the last kick, m; empty without a near field.
    anchors: Vec<Vector3<f64>>,
    /// Which grains touched others at the last kick.
    touching: Vec<bool>,
    /// Pairs whose accelerations are those of their contact already.
    synchronised: FxHashSet<[u32; 2]>,
    /// What contacts at rest did since it was last asked.
    held: Held,
    /// How many may be held until the sub-step ends early.
    holds_left: u64,
    /// By how much sub-steps are more patient than usual, as a power of two.
    patience: i32,
    /// Simulated time that has been reached, s.
    time: f64,
    entered: u64,
    collisions: u64,
    since_watch: u32,
    /// Encounters since `mark` (epoch time, s).
    since_mark: u64,
    mark: f64,
}

impl<S: Surface, C: Calendar> EventDriven<S, C> {
    /// A run that starts at simulated time `start` (s) with `grains` inside.
    #[must_use]
    pub fn new(grains: &[NewGrain], surface: S, domain: Domain, laws: Laws, start: f64) -> Self {
        let flights = grains.iter().map(flight).collect();
        let encounters = match laws.interference {
            Interference::None => Encounters::transparent(flights, surface, domain),
            _ => Encounters::new(flights, surface, domain),
        };
        let carried = grains.iter().zip(0..).map(|(grain, id)| carried(grain, id)).collect();
        let entered = grains.len() as u64;
        let mut scheme = Self {
            encounters,
            rows: if laws.collapse == Collapse::Elastic { vec![NO_ROW; grains.len()] } else { Vec::new() },
            grains: carried,
            laws,
            domain,
            epoch_start: start,
            epoch: 0.0,
            fastest: 0.0,
            smallest: f64::INFINITY,
            outrun: false,
            in_a_row: 0.0,
            forces: false,
            under: Under::default(),
            resting_speed: 0.0,
            resting_speed_of_pairs: 0.0,
            anchors: Vec::new(),
            touching: Vec::new(),
            synchronised: FxHashSet::default(),
            held: Held::default(),
            holds_left: u64::MAX,
            patience: 0,
            time: start,
            entered,
            collisions: 0,
            since_watch: 0,
            since_mark: 0,
            mark: 0.0,
        };
        scheme.start_epoch(0.0);
        scheme
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

    /// Starts a sub-step at the time that has been reached. `kick` is given what [`Encounters::start_sub_step`] gives it, and what grains carry; it
    /// gives the length of the sub-step (s) and the strongest acceleration (m/s²).
    pub(super) fn start_sub_step(
        &mut self,
        under: &Under,
        kick: impl FnOnce(&S, &[Touch], &mut [Grain], &mut [Flight], &mut [Vector3<f64>]) -> (f64, f64),
    ) {
        self.under = *under;
        let after = self.time - self.epoch_start;
        self.patience = if self.forces && after < HASTY * self.epoch { self.patience + 1 } else { 0 };
        let grains = self.encounters.count() as f64;
        self.holds_left = ((HOLDS + HOLDS_PER_GRAIN * grains) * 2f64.powi(self.patience)) as u64;
        self.natural_epoch(after);
        self.forces = true;
        let (grains, mut length, mut strongest) = (&mut self.grains, 0.0, 0.0);
        let touching = &mut self.touching;
        touching.clear();
        touching.resize(grains.len(), false);
        self.encounters.start_sub_step(after, under.reach, |surface, touches, flights, accelerations| {
            for touch in touches {
                touching[touch.a as usize] = true;
                touching[touch.b as usize] = true;
            }
            (length, strongest) = kick(surface, touches, grains, flights, accelerations);
            (length, 0.125 * strongest * length * length)
        });
        self.resting_speed = STICKING * strongest * length;
        let sticks = self.laws.grain.restitution < 1.0;
        self.resting_speed_of_pairs = if sticks { PAIR_REST * strongest * length } else { self.resting_speed };
        self.anchors.clear();
        self.synchronised.clear();
        if under.near_field.is_some() {
            let slots = 0..self.grains.len() as u32;
            self.anchors.extend(slots.map(|grain| self.encounters.flight(grain).position));
        }
        self.begin(after, length);
    }

    /// Length of an epoch (s) that starts `after` seconds into the current one without forces.
    fn natural_epoch(&mut self, after: f64) -> f64 {
        self.fastest = self.encounters.surface().speed();
        self.smallest = f64::INFINITY;
        for grain in self.encounters.inside() {
            let flight = self.encounters.flight(grain);
            self.fastest = self.fastest.max(flight.velocity.amax());
            self.smallest = self.smallest.min(flight.radius);
        }
        let length = epoch_length(self.smallest, self.fastest, self.epoch_start + after);
        self.in_a_row = COLLAPSE_TIME * length;
        length
    }

    fn begin(&mut self, after: f64, length: f64) {
        self.epoch_start += after;
        self.epoch = length;
        self.outrun = false;
        for row in &mut self.rows {
            row.latest -= after;
        }
        (self.mark, self.since_mark) = (0.0, 0);
    }

    /// What contacts at rest did since it was last taken.
    #[must_use]
    pub fn held(&self) -> Held {
        self.held
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

    /// Mass of all grains (kg), their momentum beyond that of their chords at simulated time `time` (N s), and how far that is behind the middle
    /// of the sub-step (s).
    #[must_use]
    pub fn lag(&self, time: f64) -> (f64, Vector3<f64>, f64) {
        let now = time - self.epoch_start;
        let of_grain = |grain: u32| {
            let mass = self.grains[grain as usize].mass;
            (mass, self.encounters.bend(grain).velocity(now) * mass)
        };
        let add = |sum: (f64, Vector3<f64>), one: (f64, Vector3<f64>)| (sum.0 + one.0, sum.1 + one.1);
        let (mass, lag) = self.encounters.inside().map(of_grain).fold((0.0, Vector3::zeros()), add);
        (mass, lag, if self.forces { now - 0.5 * self.epoch } else { 0.0 })
    }

    /// The near field has no finite value; its grains are counted over those inside.
    #[must_use]
    pub fn singular(&self, singular: &Singular) -> Broken {
        let inside: Vec<u32> = self.encounters.inside().collect();
        let id = |number: usize| self.grains[inside[number] as usize].id;
        let grains = match *singular {
            Singular::Coincident(a, b) => vec![id(a), id(b)],
            Singular::NotFinite(grain) => vec![id(grain)],
        };
        Broken::Singular { time: self.time, grains }
    }

    /// What contacts at rest did since this was last asked.
    pub fn take_held(&mut self) -> Held {
        std::mem::take(&mut self.held)
    }

    /// Resolves all events up to simulated time `end` (s). When and how often it is called changes nothing of what happens.
    ///
    /// Under forces it stops earlier where [`is_pressed`](Self::is_pressed) says so.
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
            let Some((time, encounter)) = self.encounters.next_before(until) else {
                if end <= epoch_end || self.forces {
                    break;
                }
                self.start_epoch(self.epoch);
                continue;
            };
            self.watch_for_jam(time, encounter)?;
            match encounter {
                Encounter::Grains { a, b } => self.collide(time, a, b, observer)?,
                Encounter::Surface { grain, element } => self.hit(time, grain, element, observer)?,
                Encounter::Exit { grain } => self.take_out(Passage::Left, time, grain, observer),
            }
            let now = self.epoch_start + time;
            if self.outrun && !self.forces {
                self.start_epoch(time);
            }
            if self.is_pressed() {
                self.time = now;
                return Ok(ControlFlow::Continue(()));
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

    /// Whether so many contacts have come to rest that the sub-step should end.
    #[must_use]
    pub fn is_pressed(&self) -> bool {
        self.holds_left == 0
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
        let in_line = !self.forces;
        self.rows.get_mut(grain as usize).is_some_and(|row| row.note(time, within, partner, approach, in_line))
    }

    /// Two grains touch.
    fn collide(&mut self, time: f64, a: u32, b: u32, observer: &mut impl Observer) -> Result<(), Broken> {
        // The lower id is the first of the two: slots are used again, ids are not.
        let (a, b) = if self.grains[a as usize].id < self.grains[b as usize].id { (a, b) } else { (b, a) };
        self.synchronise(a, b);
        let (first, second) = (self.body(a), self.body(b));
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
        if self.forces && (first.velocity - second.velocity).dot(&normal) <= self.resting_speed_of_pairs {
            return self.hold_pair(time, [a, b], [first, second], normal, overlap_over_radius);
        }
        let external = self.external([a, b]);
        let mut contact = resolve_pair_under(&self.laws.grain, &first, &second, normal, &external);
        let mut withheld = 0.0;
        // Both rows go on, whatever the first says.
        let approach = contact.approach_speed;
        if self.is_collapsing(time, a, b, approach) | self.is_collapsing(time, b, a, approach) {
            withheld = contact.impulse.dissipated;
            contact = resolve_pair_under(&ELASTIC, &first, &second, normal, &external);
        }
        // Where rounding has turned the slightest graze into none, both fly on.
        if contact.impulse.normal == 0.0 {
            self.deflect(&[(a, first.velocity), (b, second.velocity)]);
            return Ok(());
        }
        let [mut after_a, mut after_b] = contact.after;
        if self.under.contact_time > 0.0 {
            // The forces have had their share in the contact, and do not act for as long after it.
            after_a.velocity -= external.on_first / after_a.mass;
            after_b.velocity -= external.on_second / after_b.mass;
            let change = energy(&first) + energy(&second) - energy(&after_a) - energy(&after_b);
            self.held.dissipated_grain += change - contact.impulse.dissipated;
        }
        self.check(time, &ids, overlap_over_radius, &[after_a.velocity, after_b.velocity])?;
        self.grains[a as usize].spin = after_a.spin;
        self.grains[b as usize].spin = after_b.spin;
        self.deflect(&[(a, after_a.velocity), (b, after_b.velocity)]);
        self.collisions += 1;
        observer.grain_collision(&GrainCollision {
            time: self.epoch_start + time,
            ids,
            position: flight_a.position + normal * first.radius,
            normal,
            impulse_normal: contact.impulse.normal,
            impulse_tangential: contact.impulse.tangential.norm(),
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
        if self.forces && -(before.velocity - contact.velocity).dot(&contact.normal) <= self.resting_speed_at_surface(grain) {
            return self.hold_on_surface(time, grain, &before, &contact);
        }
        let external = self.external([grain, grain]).on_first;
        let mut resolved =
            resolve_surface_under(&self.laws.surface, &before, contact.normal, contact.velocity, external);
        let mut withheld = 0.0;
        if self.is_collapsing(time, grain, SURFACE, resolved.approach_speed) {
            withheld = resolved.impulse.dissipated;
            resolved = resolve_surface_under(&ELASTIC, &before, contact.normal, contact.velocity, external);
        }
        if self.under.contact_time > 0.0 {
            resolved.after.velocity -= external / before.mass;
            let change = energy(&before) - energy(&resolved.after) + resolved.work;
            self.held.dissipated_surface += change - resolved.impulse.dissipated;
        }
        if resolved.impulse.normal == 0.0 {
            self.deflect(&[(grain, before.velocity)]);
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
        self.deflect(&[(grain, resolved.after.velocity)]);
        self.collisions += 1;
        let arriving = before.velocity - contact.velocity;
        let energy_normal = 0.5 * before.mass * arriving.dot(&contact.normal).powi(2);
        let along = arriving - contact.normal * arriving.dot(&contact.normal);
        observer.surface_hit(&SurfaceHit {
            time: self.epoch_start + time,
            id,
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

    /// What forces give to two grains during a contact of finite duration.
    #[inline]
    fn external(&self, grains: [u32; 2]) -> External {
        if self.under.contact_time == 0.0 {
            return External::default();
        }
        let force = |grain: u32| self.encounters.bend(grain).acceleration * self.grains[grain as usize].mass;
        External::new(grains.map(force), self.under.contact_time)
    }

    /// Gives two grains that touch the accelerations they have there: the near field between the two at contact, in place of that at the last
    /// kick. The rest of the near field hardly changes within a sub-step.
    #[inline]
    fn synchronise(&mut self, a: u32, b: u32) {
        let Some(near_field) = self.under.near_field else { return };
        let slots = self.anchors.len() as u32;
        if a < slots && b < slots && self.synchronised.insert([a, b]) {
            let [at_kick_a, at_kick_b] = [a, b].map(|grain| self.anchors[grain as usize]);
            let now = self.true_flight(b).position - self.true_flight(a).position;
            let strength = self.grains[a as usize].strength * self.grains[b as usize].strength;
            let force = (near_field.force_on(self.domain.nearest(now))
                - near_field.force_on(self.domain.nearest(at_kick_b - at_kick_a)))
                * strength;
            for (grain, force) in [(a, force), (b, -force)] {
                self.encounters.pull(grain, force / self.grains[grain as usize].mass);
            }
        }
    }

    /// Two grains at rest against each other stay so until the end of the sub-step: what their chords approach is taken away by an impulse.
    fn hold_pair(
        &mut self,
        time: f64,
        grains: [u32; 2],
        bodies: [Body; 2],
        normal: Vector3<f64>,
        overlap_over_radius: f64,
    ) -> Result<(), Broken> {
        let ids = grains.map(|grain| self.grains[grain as usize].id);
        let [first, second] = bodies;
        let chords = grains.map(|grain| self.encounters.flight(grain).velocity);
        // They part by a trifle, or their neighbours would press them together again without end.
        let parting = YIELDING * first.radius.min(second.radius) / self.epoch;
        let approach = ((chords[0] - chords[1]).dot(&normal) + parting).max(0.0);
        let impulse = normal * (approach * first.mass * second.mass / (first.mass + second.mass));
        let after = [first.velocity - impulse / first.mass, second.velocity + impulse / second.mass];
        self.check(time, &ids, overlap_over_radius, &after)?;
        self.held.dissipated_grain += impulse.dot(&(first.velocity - second.velocity + (after[0] - after[1]))) * 0.5;
        self.held.contacts += 1;
        self.holds_left = self.holds_left.saturating_sub(1);
        self.deflect(&[(grains[0], after[0]), (grains[1], after[1])]);
        Ok(())
    }

    /// Approach speed (m/s) below which a grain has come to rest against the surface.
    fn resting_speed_at_surface(&self, grain: u32) -> f64 {
        let grain = grain as usize;
        let among_grains =
            self.touching.get(grain) == Some(&true) || self.rows.get(grain).is_some_and(|row| row.among_grains());
        if among_grains { self.resting_speed_of_pairs } else { self.resting_speed }
    }

    /// A grain at rest against the surface stays so until the end of the sub-step: the surface carries what pulls it there.
    fn hold_on_surface(
        &mut self,
        time: f64,
        grain: u32,
        before: &Body,
        contact: &SurfaceContact,
    ) -> Result<(), Broken> {
        let id = self.grains[grain as usize].id;
        let rate = (before.velocity - contact.velocity).dot(&contact.normal);
        let after = before.velocity - contact.normal * rate.min(0.0);
        self.check(time, &[id], -contact.gap / before.radius, &[after])?;
        let chord = self.encounters.flight(grain).velocity;
        let acceleration = self.encounters.bend(grain).acceleration;
        let pull = acceleration.dot(&contact.normal).min(0.0);
        self.encounters.accelerate(grain, acceleration - contact.normal * (pull * RELIEF));
        self.deflect(&[(grain, after)]);
        self.held.impulse_surface += (self.encounters.flight(grain).velocity - chord) * before.mass;
        self.held.dissipated_surface += 0.5 * before.mass * (before.velocity.norm_squared() - after.norm_squared());
        self.held.contacts += 1;
        self.holds_left = self.holds_left.saturating_sub(1);
        Ok(())
    }

    /// Gives grains that have just met something their new velocities (m/s).
    #[inline]
    fn deflect<const N: usize>(&mut self, grains: &[(u32, Vector3<f64>); N]) {
        self.outrun |= grains.iter().any(|(_, velocity)| velocity.amax() > OUTRUN * self.fastest);
        if self.forces {
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

    /// The flight of a grain as it is at its local time: without forces the stored one.
    #[inline]
    fn true_flight(&self, grain: u32) -> Flight {
        let mut flight = *self.encounters.flight(grain);
        if self.forces {
            let bend = self.encounters.bend(grain);
            flight.position += bend.offset(flight.time);
            flight.velocity += bend.velocity(flight.time);
        }
        flight
    }

    fn take_out(&mut self, passage: Passage, time: f64, grain: u32, observer: &mut impl Observer) {
        let flight = self.true_flight(grain);
        self.pass(grain, 1.0);
        observer.passage(passage, self.epoch_start + time, &flight, &self.grains[grain as usize]);
        self.encounters.remove(grain);
    }

    /// Books what forces gave to a grain that goes (`sign` 1) or comes (-1) beyond the kick before.
    fn pass(&mut self, grain: u32, sign: f64) {
        if self.forces {
            let bend = self.encounters.bend(grain);
            let mass = sign * self.grains[grain as usize].mass;
            let lag = self.encounters.flight(grain).time - 0.5 * bend.step;
            self.held.impulse_gravity += self.under.gravity * (mass * lag);
            self.held.impulse_near_field += (bend.acceleration - self.under.gravity) * (mass * lag);
        }
    }

    /// Takes a grain in at simulated time `time` (s), to which the run has been advanced.
    pub fn enter(&mut self, time: f64, new: &NewGrain, observer: &mut impl Observer) {
        let flight = Flight { time: time - self.epoch_start, ..flight(new) };
        let grain = carried(new, self.entered);
        self.entered += 1;
        let slot = self.encounters.insert(flight, self.under.gravity) as usize;
        if slot == self.grains.len() {
            self.grains.push(grain);
            if self.laws.collapse == Collapse::Elastic {
                self.rows.push(NO_ROW);
            }
        } else {
            self.grains[slot] = grain;
            if let Some(row) = self.rows.get_mut(slot) {
                *row = NO_ROW;
            }
        }
        self.pass(slot as u32, -1.0);
        observer.passage(Passage::Entered, time, &flight, &grain);
        if self.forces {
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
        let mut slots: Vec<u32> = self.encounters.inside().collect();
        slots.sort_unstable_by_key(|&slot| self.grains[slot as usize].id);
        let at = |&slot: &u32| {
            let now = time - self.epoch_start;
            let mut flight = self.encounters.flight(slot).advanced_to(now);
            if self.forces {
                let bend = self.encounters.bend(slot);
                flight.position += bend.offset(now);
                flight.velocity += bend.velocity(now);
            }
            flight.time = 0.0;
            self.domain.wrap(&mut flight.position);
            flight
        };
        let flights: Vec<Flight> = slots.iter().map(at).collect();
        let grains: Vec<Grain> = slots.iter().map(|&slot| self.grains[slot as usize]).collect();
        look(&Snapshot { time, flights: &flights, grains: &grains })
    }

    #[inline]
    fn body(&self, grain: u32) -> Body {
        let flight = self.true_flight(grain);
        let Grain { mass, spin, .. } = self.grains[grain as usize];
        Body { mass, radius: flight.radius, velocity: flight.velocity, spin }
    }

    /// Stops the run where an invariant is broken.
    #[inline]
    fn check(&self, time: f64, ids: &[u64], overlap: f64, velocities: &[Vector3<f64>]) -> Result<(), Broken> {
        let numbers = velocities.iter().all(|velocity| velocity.norm_squared().is_finite());
        let allowed = if self.forces { LARGEST_OVERLAP_WITH_FORCES } else { LARGEST_OVERLAP };
        if overlap <= allowed && numbers {
            return Ok(());
        }
        Err(broken(self.epoch_start + time, ids, overlap, allowed, numbers))
    }
}

/// Kinetic energy, J.
fn energy(body: &Body) -> f64 {
    0.5 * body.mass * (body.velocity.norm_squared() + 0.4 * body.radius.powi(2) * body.spin.norm_squared())
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

fn flight(grain: &NewGrain) -> Flight {
    Flight { position: grain.position, time: 0.0, velocity: grain.velocity, radius: grain.radius }
}

fn carried(grain: &NewGrain, id: u64) -> Grain {
    Grain { id, mass: grain.mass(), spin: grain.spin, hits: 0, strength: grain.strength }
}
