//! The grains of a time-stepped scheme, and everything about them that is no matter of how they are stepped.

use impinge_events::{Domain, Flight, SurfaceContact};
use nalgebra::Vector3;

use super::books::Books;
use super::neighbours::Neighbours;
use crate::grains::{Grain, NewGrain, Snapshot};
use crate::law::Body;
use crate::scene::Interference;
use crate::scheme::event_driven::{carried, flight, side_by_side};
use crate::scheme::{Broken, Forces, GrainCollision, Laws, Observer, Passage, SurfaceHit};
use crate::surface::{LARGEST_SLOPE, Surface};

/// How far from the surface (in radii) a mesh is asked for its distance: farther, more of its index would be searched for nothing.
const SIGHT: f64 = 10.0;

/// Two grains that are near each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Unit vector from the first to the second.
    pub normal: Vector3<f64>,
    /// Distance of their surfaces, m; negative where they overlap.
    pub gap: f64,
}

/// All grains inside, with the surface, the laws, the domain and the forces.
///
/// A grain is known by its slot, its place in [`flights`](Self::flights) and [`grains`](Self::grains); slots stay what they are within a step.
/// The flights are the state that a step works on: at its beginning they stand at [`time`](Self::time), and when it returns, at its end. Their
/// `time` field is not used and stays 0.
#[derive(Clone, Debug)]
pub struct Crowd {
    /// Positions, velocities and radii.
    pub flights: Vec<Flight>,
    /// What grains carry besides: masses, spins, hits.
    pub grains: Vec<Grain>,
    pub(super) laws: Laws,
    pub(super) domain: Domain,
    pub(super) surface: Surface,
    pub(super) forces: Forces,
    pub(super) strengths: bool,
    pub(super) neighbours: Neighbours,
    /// How far each grain is from the surface.
    pub(super) clear: Vec<Clear>,
    /// Slots of the grains that are nearer to the surface than was asked.
    pub(super) at_surface: Vec<u32>,
    /// Largest speed of a part of the surface, m/s.
    pub(super) surface_speed: f64,
    /// Whether grains that have hit the surface pass through it from then on.
    pub(super) once_only: bool,
    pub(super) leaving: Vec<(u32, Passage)>,
    /// Mass of all grains, kg.
    pub(super) mass: f64,
    pub(super) start: f64,
    /// Time since the start, s: it resolves a step where simulated time does not.
    pub(super) clock: f64,
    pub(super) entered: u64,
    pub(super) collisions: u64,
    pub(super) books: Books,
    pub(super) told: Books,
}

/// A grain is clear of the surface until it has moved so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clear {
    /// Where it was, m.
    from: Vector3<f64>,
    /// When, s.
    clock: f64,
    /// How far it was from the surface, m.
    gap: f64,
    /// Whether it passes through the surface.
    passes: bool,
}

pub(super) const UNKNOWN: Clear =
    Clear { from: Vector3::new(0.0, 0.0, 0.0), clock: 0.0, gap: f64::NEG_INFINITY, passes: false };

impl Crowd {
    /// `grains` at simulated time `start` (s).
    #[must_use]
    pub fn new(grains: &[NewGrain], surface: Surface, domain: Domain, laws: Laws, forces: Forces, start: f64) -> Self {
        // Neighbours in space are neighbours in memory.
        let order = side_by_side(grains);
        Self {
            mass: grains.iter().map(NewGrain::mass).sum(),
            flights: order.iter().map(|&(_, id)| flight(&grains[id as usize])).collect(),
            grains: order.iter().map(|&(_, id)| carried(&grains[id as usize], u64::from(id))).collect(),
            laws,
            domain,
            surface_speed: impinge_events::Surface::speed(&surface) * 3f64.sqrt(),
            surface,
            forces,
            strengths: grains.iter().any(|grain| grain.strength != 1.0),
            neighbours: Neighbours::default(),
            clear: vec![UNKNOWN; grains.len()],
            at_surface: Vec::new(),
            once_only: matches!(laws.interference, Interference::FirstOrder | Interference::RemovedOnFirstCollision),
            leaving: Vec::new(),
            start,
            clock: 0.0,
            entered: grains.len() as u64,
            collisions: 0,
            books: Books::default(),
            told: Books::default(),
        }
    }

    /// Simulated time at the beginning of the step, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.start + self.clock
    }

    /// How many grains are inside.
    #[must_use]
    pub fn len(&self) -> usize {
        self.flights.len()
    }

    /// Whether there is no grain.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.flights.is_empty()
    }

    /// The laws of contact.
    #[must_use]
    pub fn laws(&self) -> &Laws {
        &self.laws
    }

    /// The region that is simulated.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The surface, where it is at the beginning of the step.
    #[must_use]
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Collisions that were told, grain–grain and grain–surface.
    #[must_use]
    pub fn collisions(&self) -> u64 {
        self.collisions
    }

    /// What a law needs to know of a grain as it is now.
    #[must_use]
    pub fn body(&self, slot: u32) -> Body {
        let (flight, grain) = (&self.flights[slot as usize], &self.grains[slot as usize]);
        Body { mass: grain.mass, radius: flight.radius, velocity: flight.velocity, spin: grain.spin }
    }

    /// Gives a grain the velocity and spin of `body`.
    pub fn put(&mut self, slot: u32, body: &Body) {
        self.flights[slot as usize].velocity = body.velocity;
        self.grains[slot as usize].spin = body.spin;
    }

    /// Looks around from where [`flights`](Self::flights) are now, `after` seconds into the step: then [`pairs`](Self::pairs) and
    /// [`at_surface`](Self::at_surface) name all that are nearer to each other than `reach` (m). Cheap as long as lists hold.
    pub fn look(&mut self, after: f64, reach: f64) {
        self.look_for_grains(self.clock + after, after, reach);
        self.look_for_surface(after, reach);
    }

    /// The same at the beginning of a step that may be as long as `step` (s), with a reach (m) of its own for the surface.
    pub fn look_ahead(&mut self, step: f64, reach: f64, surface_reach: f64) {
        self.look_for_grains(self.clock, step, reach);
        self.look_for_surface(0.0, surface_reach);
    }

    /// As [`look`](Self::look), where since the last look of the step, with the same reach, only the grains in `slots` have moved.
    pub fn look_again(&mut self, slots: &[u32], after: f64, reach: f64) {
        let now = self.clock + after;
        let holds = |slot: &u32| {
            let slot = *slot as usize..*slot as usize + 1;
            self.neighbours.holds(&self.flights, slot, &self.domain, now, reach)
        };
        if self.laws.interference != Interference::None && !slots.iter().all(holds) {
            self.neighbours.make(&self.flights, &self.domain, now, reach, after);
        }
        for &slot in slots {
            let place = self.at_surface.binary_search(&slot);
            match (self.is_near_surface(slot as usize, after, reach), place) {
                (true, Err(place)) => self.at_surface.insert(place, slot),
                (false, Ok(place)) => drop(self.at_surface.remove(place)),
                _ => {}
            }
        }
    }

    fn look_for_grains(&mut self, now: f64, step: f64, reach: f64) {
        let Self { flights, neighbours, domain, .. } = self;
        if self.laws.interference != Interference::None
            && !neighbours.holds(flights, 0..flights.len(), domain, now, reach)
        {
            neighbours.make(flights, domain, now, reach, step);
        }
    }

    fn look_for_surface(&mut self, after: f64, reach: f64) {
        self.at_surface.clear();
        if self.surface.elements() == 0 {
            return;
        }
        for slot in 0..self.len() {
            if self.is_near_surface(slot, after, reach) {
                self.at_surface.push(slot as u32);
            }
        }
    }

    /// Whether a grain is nearer to the surface than `reach` (m) `after` seconds into the step and does not pass through it.
    #[inline]
    fn is_near_surface(&mut self, slot: usize, after: f64, reach: f64) -> bool {
        let (flight, clear) = (&self.flights[slot], &mut self.clear[slot]);
        let now = self.clock + after;
        let room = clear.gap - reach - self.surface_speed * (now - clear.clock).abs();
        let moved = (flight.position - clear.from).norm_squared();
        if (room > 0.0 && moved < room * room) || clear.passes {
            return false;
        }
        let gap = self.surface.gap(&Flight { time: after, ..*flight }, reach + SIGHT * flight.radius);
        *clear = Clear { from: flight.position, clock: now, gap, ..*clear };
        gap < reach
    }

    /// Pairs of slots, the lower one first, each once: all that may be nearer to each other than asked of [`look`](Self::look), and others that
    /// are near. None where grains pass through each other.
    #[must_use]
    pub fn pairs(&self) -> &[[u32; 2]] {
        self.neighbours.pairs()
    }

    /// Slots of the grains that are nearer to the surface than asked of [`look`](Self::look), in ascending order. Grains that pass through the
    /// surface are not among them.
    #[must_use]
    pub fn at_surface(&self) -> &[u32] {
        &self.at_surface
    }

    /// Puts into `found` the [`pairs`](Self::pairs) that overlap now, and how; not those whose centres coincide.
    pub fn touching(&self, found: &mut Vec<([u32; 2], Near)>) {
        found.clear();
        for &pair in self.pairs() {
            let [a, b] = pair.map(|slot| &self.flights[slot as usize]);
            let apart = self.domain.nearest(b.position - a.position);
            let (squared, contact) = (apart.norm_squared(), a.radius + b.radius);
            // Hardly any pair gets any farther.
            if squared < contact * contact && squared > 0.0 {
                let distance = squared.sqrt();
                found.push((pair, Near { normal: apart / distance, gap: distance - contact }));
            }
        }
    }

    /// Puts into `found` how a grain stands to the surface `after` seconds into the step, with the elements: each contact nearer than `reach` (m),
    /// one a feature. The normals of a planar scene lie in its plane.
    ///
    /// # Errors
    /// A surface that would push a grain of a planar scene out of its plane.
    pub fn surface_contacts(
        &self,
        slot: u32,
        after: f64,
        reach: f64,
        found: &mut Vec<(u32, SurfaceContact)>,
    ) -> Result<(), Broken> {
        found.clear();
        let flight = Flight { time: after, ..self.flights[slot as usize] };
        self.surface.contacts(&flight, reach, found);
        if self.domain.planar {
            for (_, contact) in found.iter_mut().filter(|(_, contact)| contact.normal.y != 0.0) {
                if contact.normal.y.abs() > LARGEST_SLOPE {
                    let grain = self.grains[slot as usize].id;
                    return Err(Broken::OutOfPlane { time: self.time() + after, grain });
                }
                contact.normal = Vector3::new(contact.normal.x, 0.0, contact.normal.z).normalize();
            }
        }
        Ok(())
    }

    /// Whether the first touch of two grains takes one of them out of the run, as `interference = "removed-on-first-collision"` has it: one that
    /// has not hit the surface, touched by one that has. Then there is no contact, and the grain goes at the end of the step.
    pub fn shields(&mut self, pair: [u32; 2]) -> bool {
        if self.laws.interference != Interference::RemovedOnFirstCollision {
            return false;
        }
        let is_fresh = |slot: u32| self.grains[slot as usize].hits == 0;
        let [a, b] = pair;
        if is_fresh(a) == is_fresh(b) {
            return false;
        }
        self.leaving.push((if is_fresh(a) { a } else { b }, Passage::Removed));
        true
    }

    /// Tells of a collision of the grains in these slots. The record may have them in any order; it is turned so that the lower id is the first.
    pub fn tell_collision(&mut self, mut collision: GrainCollision, observer: &mut impl Observer) {
        self.collisions += 1;
        if collision.ids[0] > collision.ids[1] {
            collision.ids.reverse();
            collision.radii.reverse();
            collision.normal = -collision.normal;
            collision.impulse_tangential = -collision.impulse_tangential;
        }
        observer.grain_collision(&collision);
    }

    /// Whether a grain may begin a contact with the surface: where grains hit once, not after that.
    #[must_use]
    pub fn may_hit(&self, slot: u32) -> bool {
        !self.once_only || self.grains[slot as usize].hits == 0
    }

    /// Notes that the grain in `slot` hits the surface, and tells its hit order.
    pub fn count_hit(&mut self, slot: u32) -> u32 {
        let grain = &mut self.grains[slot as usize];
        grain.hits += 1;
        grain.hits
    }

    /// Tells of a hit of the grain in `slot`, which [`count_hit`](Self::count_hit) has noted. Where grains hit once, it passes through the surface
    /// from now on.
    pub fn tell_hit(&mut self, slot: u32, hit: &SurfaceHit, observer: &mut impl Observer) {
        self.collisions += 1;
        self.clear[slot as usize].passes = self.once_only;
        observer.surface_hit(hit);
    }

    /// Time (s) from the beginning of the step until simulated time `end` (s).
    pub(super) fn room(&self, end: f64) -> f64 {
        (end - self.start) - self.clock
    }

    /// Shows all grains as they are now.
    pub fn snapshot<R>(&self, time: f64, look: impl FnOnce(&Snapshot<'_>) -> R) -> R {
        let mut slots: Vec<usize> = (0..self.flights.len()).collect();
        slots.sort_unstable_by_key(|&slot| self.grains[slot].id);
        let flights: Vec<Flight> = slots.iter().map(|&slot| self.flights[slot]).collect();
        let grains: Vec<Grain> = slots.iter().map(|&slot| self.grains[slot]).collect();
        look(&Snapshot { time, flights: &flights, grains: &grains })
    }
}
