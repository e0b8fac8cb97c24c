//! Forces between events: sub-steps of second order.
//!
//! Half kick, event-driven drift, half kick, with the kicks synchronised at each collision: at time tau inside a sub-step of length h grains
//! collide with v + a (tau - h/2), where v is the velocity of the drift and a the acceleration, and go on with what comes out less
//! a (tau - h/2). Without that, a collision inside a step leaves an error of the first order (Houndonougbo, Laird & Leimkuhler 2000 give the
//! splitting). The engine does it as a change of frame ([`Bend`](impinge_events::Bend)): under a uniform acceleration the contacts of grains with
//! each other and with planes come out exactly, whatever the length of the sub-step.

use std::ops::ControlFlow;

use impinge_events::calendar::{Buckets, Calendar};
use impinge_events::{Domain, Flight, Surface};
use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use super::event_driven::{AtRest, Held, Under};
use super::penetration::{Bends, Bound, Parts, most_sag};
use super::resting::Resting;
use super::{Broken, EventDriven, Kick, Laws, Observer, Passage, Progress, Rest};
use crate::grains::{Grain, NewGrain, kinetic_energy};
use crate::near_field::{ForceSum, MeasuredError, Method, Singular};
use crate::scene::DEFAULT_PENETRATION;
use crate::sum::{Sum, VectorSum};

/// What acts on grains between events.
#[derive(Clone, Debug)]
pub struct Forces {
    /// Uniform acceleration, m/s².
    pub gravity: Vector3<f64>,
    /// Near field between grains.
    pub near_field: Option<ForceSum>,
    /// How long a contact lasts for the impulse that forces give to it, s; 0 where contacts are instantaneous.
    pub contact_time: f64,
}

/// How the sub-steps of a run went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubSteps {
    /// How many there were.
    pub count: u64,
    /// How many of them were split, so that grains did not go deeper into each other than they may.
    pub split: u64,
    /// Into how many parts these were split, all together.
    pub parts: u64,
    /// Length of the last one, s.
    pub length: f64,
    /// Contacts at rest at the end.
    pub resting_contacts: u32,
    /// The true error of the near field at the end, where there is one.
    pub near_field_error: Option<MeasuredError>,
}

/// Grains at which the error of the near field is measured.
const SAMPLE: usize = 100;

/// How long sub-steps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// Always the same, s.
    Fixed(f64),
    /// As long as the local error allows: the largest difference in position of any grain between one whole and two half sub-steps, over its
    /// radius, is compared with this every [`STEPS_PER_CHECK`] sub-steps.
    Within(f64),
}

/// Sub-steps between two comparisons of whole and half sub-steps. To compare costs three sub-steps.
pub const STEPS_PER_CHECK: u64 = 8;
/// Of the sub-step that would just meet the tolerance, this part is taken.
const CAUTIOUS: f64 = 0.8;
/// By how much sub-steps grow and shrink at once.
const GROWTH: [f64; 2] = [0.2, 2.0];
/// Part of the radius by which the path of a grain may depart from its chord within a sub-step, where the sub-step is chosen: the overlap that
/// grains of unequal acceleration may have.
const SAG: f64 = 1e-5;
/// Attempts to find a sub-step that meets the tolerance, before the shortest is taken.
const ATTEMPTS: u32 = 40;

/// Grains under forces, advanced in sub-steps from event to event.
#[derive(Clone, Debug)]
pub struct Substepped<S: Surface, C: Calendar = Buckets> {
    engine: EventDriven<S, C>,
    forces: Forces,
    laws: Laws,
    at_rest: AtRest,
    resting: Resting,
    length: Length,
    /// Length of a sub-step, s.
    step: f64,
    /// How they are split. What is said of a sub-step below holds of a part where there are such.
    parts: Parts,
    /// What bounds how deep grains may go into each other, as of the last kick.
    bound: Bound,
    /// Length of the sub-step that has ended, s.
    ended: f64,
    /// End of the current sub-step, simulated time, s.
    step_end: f64,
    /// What acted on each grain at the last kick, m/s², without what contacts carry.
    pull: Vec<Vector3<f64>>,
    /// Accelerations at the end of the sub-step before, contacts included, m/s²; kept for its memory.
    end: Vec<Vector3<f64>>,
    /// How each grain went into the sub-step.
    starts: Vec<Start>,
    domain: Domain,
    /// Whether any grain has a strength other than 1.
    strengths: bool,
    /// Total of what forces and contacts at rest did until the last kick.
    books: Books,
    /// The same as last told to observers.
    told: Books,
    passages: Passages,
    steps: u64,
}

/// How a grain went into a sub-step, so that the work done on it can be booked.
#[derive(Clone, Copy, Debug)]
struct Start {
    /// The grain that was in this place.
    id: u64,
    /// m
    position: Vector3<f64>,
    /// What acted on it, m/s².
    pull: Vector3<f64>,
    /// What contacts carried, m/s².
    carried: Vector3<f64>,
}

const NOBODY: Start = Start {
    id: u64::MAX,
    position: Vector3::new(0.0, 0.0, 0.0),
    pull: Vector3::new(0.0, 0.0, 0.0),
    carried: Vector3::new(0.0, 0.0, 0.0),
};

/// Accelerations of a grain on both sides of a kick, m/s².
struct Change {
    /// At the end of the sub-step before, contacts included.
    end: Vector3<f64>,
    /// What acts now.
    pull: Vector3<f64>,
    /// What contacts carry now.
    carried: Vector3<f64>,
}

impl Start {
    /// Work of contacts and of the near field (J) on a grain that was displaced by `moved` (m) with a chord of `velocity` (m/s), until after a kick
    /// that ends a sub-step of length `step` (s): force times way within the sub-step, and what the change of forces does to the velocity at
    /// its end. Gravity does not change.
    fn work(
        &self,
        moved: Vector3<f64>,
        velocity: Vector3<f64>,
        change: &Change,
        gravity: Vector3<f64>,
        step: f64,
    ) -> (f64, f64) {
        let Change { end, pull, carried } = *change;
        let mean = velocity + (end + pull + carried) * (0.25 * step);
        // What was added within the sub-step came from contacts.
        let carried_end = end - self.pull;
        let contacts = self.carried.dot(&moved) + (carried - carried_end).dot(&mean) * (0.5 * step);
        let near_field = (self.pull - gravity).dot(&moved) + (pull - self.pull).dot(&mean) * (0.5 * step);
        (contacts, near_field)
    }
}

/// What forces and contacts at rest did, in all. The same small amounts are added many thousand times: a plain sum would lose a part of each.
#[derive(Clone, Copy, Debug, Default)]
struct Books {
    /// When observers were told, simulated time, s.
    time: Option<f64>,
    impulse_gravity: VectorSum,
    impulse_near_field: VectorSum,
    impulse_surface: VectorSum,
    dissipated_grain: Sum,
    dissipated_surface: Sum,
    work_surface: Sum,
    work_near_field: Sum,
    /// m g·x of grains that left, less that of grains that entered, J.
    carried_away: f64,
    /// m g·x of the grains inside, J.
    depth: f64,
}

impl Books {
    /// What has been added since `told`.
    fn since(&self, told: &Self) -> (Kick, Rest) {
        let kick = Kick {
            work_gravity: self.depth + self.carried_away - told.depth - told.carried_away,
            impulse_gravity: self.impulse_gravity.value() - told.impulse_gravity.value(),
            impulse_near_field: self.impulse_near_field.value() - told.impulse_near_field.value(),
            work_near_field: self.work_near_field.value() - told.work_near_field.value(),
            ..Kick::default()
        };
        let grains = self.dissipated_grain.value() - told.dissipated_grain.value();
        let surface = self.dissipated_surface.value() - told.dissipated_surface.value();
        let rest = Rest {
            impulse_surface: self.impulse_surface.value() - told.impulse_surface.value(),
            work_surface: self.work_surface.value() - told.work_surface.value(),
            dissipated_grain: grains.max(0.0),
            dissipated_surface: surface.max(0.0),
            added: (-grains).max(0.0) + (-surface).max(0.0),
            ..Rest::default()
        };
        (kick, rest)
    }

    /// Adds the impulse `of_all` that acts on all grains (N s), of which gravity has its part and the near field, where there is one, the rest.
    fn add_impulse(&mut self, forces: &Forces, gravity: Vector3<f64>, of_all: Vector3<f64>) {
        self.impulse_gravity += gravity;
        if forces.near_field.is_some() {
            self.impulse_near_field += of_all - gravity;
        } else {
            self.impulse_surface += of_all - gravity;
        }
    }

    /// Adds what a moving surface gives to contacts at rest (J): what grains do not have of it in the end is dissipated.
    fn add_work_of_surface(&mut self, work: f64) {
        self.work_surface += work;
        self.dissipated_grain += work;
    }

    fn held(&mut self, held: &Held) {
        self.impulse_surface += held.impulse_surface;
        self.dissipated_grain += held.dissipated_grain;
        self.dissipated_surface += held.dissipated_surface;
        self.work_surface += held.work_surface;
        self.impulse_gravity += held.impulse_gravity;
        self.impulse_near_field += held.impulse_near_field;
    }
}

impl Forces {
    /// Writes what acts on each grain (m/s²) to `pull`.
    pub(super) fn pull(
        &mut self,
        grains: &[Grain],
        flights: &[Flight],
        strengths: bool,
        pull: &mut Vec<Vector3<f64>>,
    ) -> Result<(), Singular> {
        pull.clear();
        pull.resize(flights.len(), self.gravity);
        let Some(near_field) = &mut self.near_field else { return Ok(()) };
        let inside: Vec<usize> = (0..flights.len()).filter(|&slot| flights[slot].radius > 0.0).collect();
        let positions: Vec<_> = inside.iter().map(|&slot| flights[slot].position).collect();
        let mut forces = vec![Vector3::zeros(); positions.len()];
        let strengths = strengths.then(|| inside.iter().map(|&slot| grains[slot].strength).collect::<Vec<_>>());
        near_field.forces(&positions, strengths.as_deref(), &mut forces)?;
        for (&slot, force) in inside.iter().zip(&forces) {
            pull[slot] += force / grains[slot].mass;
        }
        Ok(())
    }
}

impl<S: Surface + Clone, C: Calendar + Clone> Substepped<S, C> {
    /// Grains under `forces` in sub-steps of the given length.
    #[must_use]
    pub fn new(engine: EventDriven<S, C>, forces: Forces, laws: Laws, length: Length) -> Self {
        let step_end = engine.time();
        let strengths = engine.snapshot(step_end, |snapshot| snapshot.grains.iter().any(|grain| grain.strength != 1.0));
        let mut scheme = Self {
            domain: engine.domain(),
            engine,
            forces,
            laws,
            at_rest: AtRest::default(),
            resting: Resting::default(),
            length,
            step: 0.0,
            parts: Parts::new(DEFAULT_PENETRATION),
            bound: Bound::UNKNOWN,
            ended: 0.0,
            step_end,
            pull: Vec::new(),
            end: Vec::new(),
            starts: Vec::new(),
            strengths,
            books: Books::default(),
            told: Books::default(),
            passages: Passages::default(),
            steps: 0,
        };
        scheme.step = match length {
            Length::Fixed(step) => rounded(step),
            Length::Within(_) => 0.0,
        };
        scheme
    }

    /// Lets grains go into each other by this part of the smaller radius at the most, and splits sub-steps in which they would go deeper.
    #[must_use]
    pub fn keeping_to(mut self, penetration: f64) -> Self {
        self.parts = Parts::new(penetration);
        self
    }

    /// Treats contacts that forces press together in another way, so that it can be compared.
    #[must_use]
    pub fn treating(mut self, at_rest: AtRest) -> Self {
        self.engine.treat(at_rest);
        self.at_rest = at_rest;
        self
    }

    /// Resolves all events up to simulated time `end` (s). When and how often it is called changes nothing of what happens.
    ///
    /// # Errors
    /// A broken invariant, or grains between which there is no finite force.
    pub fn advance(
        &mut self,
        end: f64,
        observer: &mut impl Observer,
        watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Broken> {
        loop {
            if self.engine.time() >= self.step_end {
                if self.parts.are_over() {
                    self.choose_step()?;
                    self.steps += 1;
                }
                self.start_part()?;
            }
            let until = end.min(self.step_end);
            if self.engine.advance(until, &mut (&mut self.passages, &mut *observer), watch)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
            if until >= end {
                return Ok(ControlFlow::Continue(()));
            }
        }
    }

    /// Chooses the length of the next sub-steps.
    fn choose_step(&mut self) -> Result<(), Broken> {
        let Length::Within(tolerance) = self.length else { return Ok(()) };
        if !self.steps.is_multiple_of(STEPS_PER_CHECK) {
            return Ok(());
        }
        let longest = self.longest_step()?;
        if self.forces.near_field.is_none() {
            // Gravity is exact whatever the length.
            self.step = rounded(longest);
            return Ok(());
        }
        if self.step == 0.0 {
            self.step = rounded(longest);
        }
        for _ in 0..ATTEMPTS {
            let error = self.local_error()?;
            // The local error of the places goes with the cube of the length.
            let factor = (CAUTIOUS * (tolerance / error).cbrt()).clamp(GROWTH[0], GROWTH[1]);
            let met = error <= tolerance;
            self.step = rounded((self.step * factor).min(longest));
            if met {
                break;
            }
        }
        Ok(())
    }

    /// The longest sub-step (s) whose chords are near enough to the paths.
    fn longest_step(&mut self) -> Result<f64, Broken> {
        let mut strongest = self.forces.gravity.norm();
        if let Some(near_field) = &mut self.forces.near_field {
            let found = self.engine.snapshot(self.engine.time(), |snapshot| {
                let places: Vec<_> = snapshot.flights.iter().map(|flight| flight.position).collect();
                let strengths: Vec<_> = snapshot.grains.iter().map(|grain| grain.strength).collect();
                let mut forces = vec![Vector3::zeros(); places.len()];
                near_field.forces(&places, Some(&strengths), &mut forces)?;
                Ok(forces
                    .iter()
                    .zip(snapshot.grains)
                    .map(|(force, grain)| force.norm() / grain.mass)
                    .fold(0.0, f64::max))
            });
            strongest += found.map_err(|singular| self.engine.singular(&singular))?;
        }
        let smallest = self.engine.smallest_radius();
        // Nothing pulls, or there is no grain: any length will do, until something happens.
        let sag = (8.0 * SAG * smallest / strongest).sqrt();
        Ok(if sag.is_finite() && sag > 0.0 { sag } else { 1.0 })
    }

    /// Largest difference in position of any grain between one whole and two half sub-steps from now on, over its radius.
    fn local_error(&self) -> Result<f64, Broken> {
        let end = self.engine.time() + self.step;
        let run = |step: f64| {
            let mut trial = Self { length: Length::Fixed(step), step, ..self.clone() };
            let flow = trial.advance(end, &mut (), &mut |_| ControlFlow::Continue(()))?;
            debug_assert!(flow.is_continue());
            Ok(trial)
        };
        let (whole, halves) = (run(self.step)?, run(0.5 * self.step)?);
        let places = |trial: &Self| trial.engine.snapshot(end, |snapshot| snapshot.flights.to_vec());
        let apart = places(&whole)
            .iter()
            .zip(places(&halves))
            .map(|(one, other)| self.domain.nearest(one.position - other.position).norm() / one.radius)
            .fold(0.0, f64::max);
        Ok(apart)
    }

    /// Starts the next part of a sub-step, as long as it may be for nobody to go too deep.
    ///
    /// Grains that enter within it are not foreseen.
    fn start_part(&mut self) -> Result<(), Broken> {
        let (radius, penetration) = (self.engine.smallest_radius(), self.parts.penetration());
        let changes = self.forces.near_field.is_some();
        // Contact forces come and go from kick to kick.
        let needs_copy = self.at_rest == AtRest::Carried
            && (!self.resting.is_empty()
                || self.bound.is_near(changes, self.parts.longest(self.step), radius, penetration));
        let before = needs_copy.then(|| self.clone());
        self.kick(needs_copy)?;
        let Some(before) = before else { return Ok(()) };
        while self.bound.depth(self.ended, radius, penetration) > 1.0 {
            let deepest = self.engine.deepest_until(self.step_end);
            if self.parts.stands(deepest) {
                break;
            }
            let too_long = std::mem::replace(self, before.clone()).parts;
            self.parts.take_back(&too_long);
            self.kick(true)?;
        }
        Ok(())
    }

    /// Ends a sub-step and starts the next, which can be taken back or not.
    fn kick(&mut self, can_go_back: bool) -> Result<(), Broken> {
        let ended = self.ended;
        let held = self.engine.take_held();
        self.books.held(&held);
        // What carried grains ends here. `Start::work` cannot tell it from contacts between grains.
        let ends = held.power_surface * (0.5 * ended);
        self.books.dissipated_grain += -ends;
        self.books.dissipated_surface += ends;
        if !self.passages.gone.is_empty() {
            let (contacts, near_field) = self.work_on(&self.passages.gone);
            self.books.dissipated_grain += -contacts;
            self.books.work_near_field += near_field;
            self.passages.gone.clear();
        }
        let Self {
            engine,
            forces,
            laws,
            at_rest,
            resting,
            parts,
            pull,
            starts,
            end,
            domain,
            books,
            step,
            strengths,
            bound,
            ..
        } = self;
        let (whole, smallest) = (*step, engine.smallest_radius());
        let carries = *at_rest == AtRest::Carried;
        let strongest = pull.iter().map(|pull| pull.norm()).fold(forces.gravity.norm(), f64::max);
        let reach = Resting::reach(engine.largest_radius(), 2.0 * strongest, parts.longest(whole));
        let (gravity, mut outcome) = (forces.gravity, Ok(()));
        // Where contact lies within the switch of a cut-off, the force at contact is not that of the law: then that of the kick is kept.
        let plain_at_contact = |sum: &&ForceSum| sum.is_plain_within(2.0 * engine.largest_radius());
        let near_field = forces.near_field.as_ref().filter(plain_at_contact).map(|sum| *sum.law());
        // It costs a sum over all grains, and where collisions lose energy nobody sees a drift of second order.
        let lossless = laws.grain.restitution == 1.0;
        let all_pairs = lossless && forces.near_field.as_ref().is_some_and(|sum| sum.method() == Method::Direct);
        let penetration = parts.penetration();
        let most_sag = if carries { most_sag(penetration) } else { f64::INFINITY };
        let under = Under { reach, gravity, near_field, all_pairs, contact_time: forces.contact_time, most_sag };
        let mut length = whole;
        engine.start_sub_step(&under, |surface, vicinity, grains, flights, accelerations| {
            end.clear();
            end.extend_from_slice(accelerations);
            outcome = forces.pull(grains, flights, *strengths, pull);
            let strongest = pull.iter().map(|pull| pull.norm()).fold(0.0, f64::max);
            *bound = Bound { strongest, bend: strongest };
            let step = parts.next(whole, |step| {
                accelerations.copy_from_slice(pull);
                if !carries {
                    return 0.0;
                }
                resting.find(surface, vicinity.touches(), grains, flights, pull, step, [&laws.grain, &laws.surface]);
                if !resting.is_empty() {
                    resting.carry(grains, flights, accelerations, step);
                } else if forces.near_field.is_none() {
                    return 0.0;
                }
                let bends = Bends { flights, accelerations, gravity, ended, step };
                let pressing = if resting.is_empty() { 0.0 } else { strongest };
                bound.bend = bends.bend();
                let surely = if can_go_back { 0.0 } else { bound.depth(step, smallest, penetration) };
                bends.deepest(vicinity, pressing, penetration).max(surely)
            });
            length = step;
            let both = 0.5 * (ended + step);
            if !resting.is_empty() {
                books.impulse_surface += resting.force_of_surface() * both;
                books.add_work_of_surface(resting.power_of_surface() * both);
            }
            starts.resize(flights.len(), NOBODY);
            for (slot, flight) in flights.iter_mut().enumerate().filter(|(_, flight)| flight.radius > 0.0) {
                let (start, grain) = (&mut starts[slot], &mut grains[slot]);
                let (pull, carried) = (pull[slot], accelerations[slot] - pull[slot]);
                // One that has entered since was under gravity alone.
                let entered =
                    Start { id: grain.id, position: flight.position, pull: gravity, carried: Vector3::zeros() };
                let begun = if start.id == grain.id { *start } else { entered };
                let change = Change { end: end[slot], pull, carried };
                let moved = domain.nearest(flight.position - begun.position);
                let (contacts, near_field) = begun.work(moved, flight.velocity, &change, gravity, ended);
                books.dissipated_grain += -contacts * grain.mass;
                books.work_near_field += near_field * grain.mass;
                *start = Start { id: grain.id, position: flight.position, pull, carried };
                flight.velocity += accelerations[slot] * (0.5 * ended);
                books.dissipated_grain += rotate(flight, grain, resting.angular(slot) * both);
                books.impulse_gravity += gravity * (grain.mass * both);
                books.impulse_near_field += (pull - gravity) * (grain.mass * both);
            }
            let settled = resting.settle(grains, flights, strongest * step);
            books.impulse_surface += settled.impulse_surface;
            books.work_surface += settled.work_surface;
            books.dissipated_grain += settled.dissipated;
            for (flight, acceleration) in flights.iter_mut().zip(&*accelerations) {
                flight.velocity += acceleration * (0.5 * step);
            }
            (step, strongest)
        });
        outcome.map_err(|singular| self.engine.singular(&singular))?;
        self.ended = length;
        self.step_end = self.engine.time() + length;
        Ok(())
    }

    /// Tells `observer` at simulated time `time` (s), to which the run has been advanced, what forces and contacts at rest did since it was last
    /// told.
    ///
    /// # Errors
    /// Grains between which there is no finite force.
    pub fn tell(&mut self, time: f64, observer: &mut impl Observer) -> Result<(), Broken> {
        let mut books = self.books;
        let held = self.engine.held(time);
        books.held(&held);
        let (mass, lag, in_step) = self.engine.lag(time);
        books.add_work_of_surface((self.resting.power_of_surface() + held.power_surface) * in_step);
        books.add_impulse(&self.forces, self.forces.gravity * (mass * in_step), lag);
        books.carried_away = self.passages.depth(self.forces.gravity);
        let (contacts, near_field) = self.work_in_step(time);
        books.dissipated_grain += -contacts;
        books.work_near_field += near_field;
        let (depth, potential) = self.engine.snapshot(time, |snapshot| {
            let depth = snapshot
                .flights
                .iter()
                .zip(snapshot.grains)
                .map(|(flight, grain)| grain.mass * flight.position.dot(&self.forces.gravity))
                .sum();
            let potential = self.forces.near_field.as_mut().map(|near_field| {
                let positions: Vec<_> = snapshot.flights.iter().map(|flight| flight.position).collect();
                let strengths: Vec<_> = snapshot.grains.iter().map(|grain| grain.strength).collect();
                near_field.potential_energy(&positions, Some(&strengths))
            });
            (depth, potential.transpose())
        });
        books.depth = depth;
        let potential = potential.map_err(|singular| self.engine.singular(&singular))?;
        let (kick, rest) = books.since(&self.told);
        let first = self.told.time.is_none();
        let work_gravity = if first { 0.0 } else { kick.work_gravity };
        observer.kick(&Kick { time, potential_energy: potential, work_gravity, ..kick });
        observer.rest(&Rest { time, contacts: self.resting.count(), ..rest });
        self.told = Books { time: Some(time), ..books };
        Ok(())
    }

    /// Work (J) that contacts at rest and the near field have done in the current sub-step until `time` (s).
    fn work_in_step(&self, time: f64) -> (f64, f64) {
        if self.resting.is_empty() && self.forces.near_field.is_none() {
            return (0.0, 0.0);
        }
        let mut now = self.passages.gone.clone();
        self.engine.snapshot(time, |snapshot| {
            let all = snapshot.flights.iter().zip(snapshot.grains);
            now.extend(all.map(|(flight, grain)| (grain.id, flight.position, grain.mass)));
        });
        self.work_on(&now)
    }

    /// Work (J) of contacts at rest and of the near field since the sub-step began on grains of these ids, until they were in these places (m), with these
    /// masses (kg): at constant acceleration, force times way.
    fn work_on(&self, grains: &[(u64, Vector3<f64>, f64)]) -> (f64, f64) {
        let starts: FxHashMap<u64, &Start> = self.starts.iter().map(|start| (start.id, start)).collect();
        let (mut contacts, mut near_field) = (Sum::default(), Sum::default());
        for &(id, position, mass) in grains {
            let Some(start) = starts.get(&id) else { continue };
            let moved = self.domain.nearest(position - start.position);
            contacts += start.carried.dot(&moved) * mass;
            near_field += (start.pull - self.forces.gravity).dot(&moved) * mass;
        }
        (contacts.value(), near_field.value())
    }

    /// Takes a grain in at simulated time `time` (s), to which the run has been advanced. The near field acts on it from the next sub-step on.
    pub fn enter(&mut self, time: f64, new: &NewGrain, observer: &mut impl Observer) {
        self.strengths |= new.strength != 1.0;
        self.engine.enter(time, new, &mut (&mut self.passages, observer));
    }

    /// The engine below.
    #[must_use]
    pub fn engine(&self) -> &EventDriven<S, C> {
        &self.engine
    }

    /// How the sub-steps went, with the true error of the near field at some grains as they are now.
    ///
    /// # Errors
    /// Grains between which there is no finite force.
    pub fn report(&mut self) -> Result<SubSteps, Broken> {
        let Self { engine, forces, .. } = self;
        let measured = forces.near_field.as_mut().map(|near_field| {
            engine.snapshot(engine.time(), |snapshot| {
                let places: Vec<_> = snapshot.flights.iter().map(|flight| flight.position).collect();
                let strengths: Vec<_> = snapshot.grains.iter().map(|grain| grain.strength).collect();
                near_field.measured_error(&places, Some(&strengths), SAMPLE)
            })
        });
        let near_field_error = measured.transpose().map_err(|singular| self.engine.singular(&singular))?;
        let (split, parts) = self.parts.count();
        let resting_contacts = self.resting.count();
        Ok(SubSteps { count: self.steps, split, parts, length: self.step, resting_contacts, near_field_error })
    }

    /// Sub-steps so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Contacts at rest now.
    #[must_use]
    pub fn resting(&self) -> u32 {
        self.resting.count()
    }
}

/// Turns a grain by `more` (rad/s) and tells how much energy (J) that took.
fn rotate(flight: &Flight, grain: &mut Grain, more: Vector3<f64>) -> f64 {
    let before = kinetic_energy(flight, grain);
    grain.spin += more;
    before - kinetic_energy(flight, grain)
}

/// A length of sub-steps of few digits (2^-26 of itself), so that their sum is exact for a hundred million of them.
fn rounded(step: f64) -> f64 {
    let unit = 2f64.powi(step.log2().floor() as i32 - 26);
    (step / unit).round() * unit
}

/// Where grains came in and went out.
#[derive(Clone, Debug, Default)]
struct Passages {
    /// m x of those that went out less that of those that came in, kg m.
    left: Vector3<f64>,
    /// Ids, places (m) and masses (kg) of those that went out in the current sub-step.
    gone: Vec<(u64, Vector3<f64>, f64)>,
}

impl Passages {
    /// m g·x of the grains that left less that of those that entered, J.
    fn depth(&self, gravity: Vector3<f64>) -> f64 {
        self.left.dot(&gravity)
    }
}

impl Observer for Passages {
    fn passage(&mut self, passage: Passage, _time: f64, flight: &Flight, grain: &Grain) {
        let sign = if passage == Passage::Entered { -1.0 } else { 1.0 };
        if passage != Passage::Entered {
            self.gone.push((grain.id, flight.position, grain.mass));
        }
        self.left += flight.position * (sign * grain.mass);
    }
}
