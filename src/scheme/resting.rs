//! Contacts at rest: what carries grains that forces press against each other and against the surface.
//!
//! Between two grains that rest against each other no collision happens. At each kick the contact forces are found that keep such contacts closed
//! and do not pull (a linear complementarity problem, with Coulomb friction), by Gauss–Seidel sweeps that start from the forces of the kick
//! before: in a pile at rest they hardly change, and a sweep or two are enough. This is the method of sequential impulses (Moreau 1999;
//! Catto 2005), applied to accelerations.

use impinge_events::{Flight, Surface, SurfaceContact, Touch, YIELDING};
use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use crate::grains::Grain;
use crate::law::{ContactLaw, Friction};

/// Two grains may rest against each other when their gap is below this part of the smaller radius, and a surface and a grain when it is below
/// `SURFACE_REACH`. A wider gap of a contact at rest stays open until somebody closes it.
pub(super) const PAIR_REACH: f64 = 1e-6;
/// A grain that rests on the surface does so to rounding: a bounce, low as it be, is resolved.
const SURFACE_REACH: f64 = 1e-9;
/// Two grains are at rest against each other when they approach or part slower than this many times what the force gives in a sub-step. Their
/// energy of approach is then of the second order in the sub-step, as its other errors are; a pile comes to rest at half the cost of 1.
pub(super) const PAIR_REST: f64 = 4.0;
/// The same for a grain and the surface.
const SURFACE_REST: f64 = 1e-3;
/// Part of the gap, or of the overlap, of a contact at rest that is closed in a sub-step, so that rounding and unfinished sweeps do not add up.
const CLOSING: f64 = 0.1;
/// Closing takes no more than this part of the largest acceleration,
const CLOSING_PULL: f64 = 0.1;
/// and to end the approach of the kick before no more than this one: the rest is ended at once ([`Resting::settle`]).
const BRAKING: f64 = 0.1;
/// Sweeps stop when no contact changes its acceleration by more than would, by the time that `CLOSING` makes up for it, open or close a gap of
/// this part of what contacts yield before events look after them.
const UNNOTICED: f64 = 0.25;
/// The same as parts of the largest acceleration, between which the rule above is kept: rounding, and what is a force at all.
const ACCURACY: [f64; 2] = [1e-6, 1e-2];
/// Where much is to be changed, sweeps stop at this part of what the first one changed: among grains that still collide, nobody notices the rest.
const ENOUGH: f64 = 0.1;
/// But not above this part of the largest acceleration. Else contacts open within a sub-step farther than they may be at the next kick, their
/// load is gone there, and a deep pile shakes and creeps without end.
const SHAKING: f64 = 0.05;
/// Approach, as a part of what the strongest force gives in a sub-step, that contacts at rest may keep: what `BRAKING` ends in the next one.
const SETTLED: f64 = BRAKING;
/// Sweeps at the most, a few for each layer of a pile of some thousand grains; what is left then is closed at the kicks to come, and by events.
const SWEEPS: u32 = 60;
/// The surface in place of a first grain, whatever their number.
const SURFACE: u32 = u32::MAX;

/// One contact at rest. The normal points from the first to the second, which is always a grain.
#[derive(Clone, Debug)]
struct Contact {
    first: u32,
    second: u32,
    /// Which element of the surface; 0 between grains.
    element: u32,
    normal: Vector3<f64>,
    /// Velocity of the surface there, m/s.
    velocity: Vector3<f64>,
    /// Effective mass, kg.
    mass: f64,
    /// Distance, negative where they overlap, m.
    gap: f64,
    /// Rate at which the gap should change, m/s², so that it closes.
    closing: f64,
    /// Slip that friction should end, over the length of a sub-step, m/s².
    slipping: Vector3<f64>,
    /// Coefficients of friction.
    stick: f64,
    slip: f64,
    /// Force on the second grain, N; along the normal it never pulls.
    force: Vector3<f64>,
    /// By how much the latest sweep changed it, N.
    change: Vector3<f64>,
    /// Where sweeps are heading: what is added to the force between two of them, N.
    heading: Vector3<f64>,
}

/// A grain as contacts push it: with the rate (acceleration or velocity) of its centre and of its rotation at its radius.
#[derive(Clone, Copy, Debug)]
struct Mover {
    linear: Vector3<f64>,
    /// Rate of rotation times the radius.
    turning: Vector3<f64>,
    /// 1/kg; 0 for the surface, which nothing moves.
    inverse_mass: f64,
}

const UNMOVED: Mover =
    Mover { linear: Vector3::new(0.0, 0.0, 0.0), turning: Vector3::new(0.0, 0.0, 0.0), inverse_mass: 0.0 };

/// Mass over moment of inertia times radius squared, of a solid sphere.
const INERTIA: f64 = 2.5;

/// The contacts at rest of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Resting {
    contacts: Vec<Contact>,
    /// Forces of the kick before, by first, second and element.
    before: FxHashMap<(u32, u32, u32), Vector3<f64>>,
    angular: Vec<Vector3<f64>>,
    /// All grains, and the surface as the last; kept for its memory.
    movers: Vec<Mover>,
    /// The surface as a mover: the number after that of the last grain.
    surface: u32,
    /// Forces while impulses are looked for; kept for its memory.
    forces: Vec<Vector3<f64>>,
    /// Which grains rest against others; kept for its memory.
    among_grains: Vec<bool>,
}

/// What the end of an approach at contacts at rest did.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Settled {
    /// Impulse of the surface on grains, N s.
    pub(super) impulse_surface: Vector3<f64>,
    /// Work of a moving surface, J.
    pub(super) work_surface: f64,
    /// Energy taken, J.
    pub(super) dissipated: f64,
}

fn friction(law: &ContactLaw) -> (f64, f64) {
    match law.friction {
        Friction::Smooth => (0.0, 0.0),
        Friction::Coulomb { static_, dynamic } => (static_, dynamic),
        Friction::Regularised { coefficient, .. } => (coefficient, coefficient),
    }
}

impl Contact {
    /// Rate at which the contact points move apart.
    #[inline]
    fn rate(&self, movers: &[Mover]) -> Vector3<f64> {
        let (first, second) = (&movers[self.first as usize], &movers[self.second as usize]);
        second.linear - first.linear - (first.turning + second.turning).cross(&self.normal)
    }

    /// Pushes the second grain by `push` (N, N s), and the first back.
    #[inline]
    fn push(&self, movers: &mut [Mover], push: Vector3<f64>) {
        let twist = push.cross(&self.normal) * INERTIA;
        for (grain, push) in [(self.second, push), (self.first, -push)] {
            let mover = &mut movers[grain as usize];
            mover.linear += push * mover.inverse_mass;
            mover.turning += twist * mover.inverse_mass;
        }
    }

    /// The force that closes this contact as it should, while all others stay, N.
    #[inline]
    fn wanted(&self, movers: &[Mover]) -> Vector3<f64> {
        let rate = self.rate(movers);
        let (along, before) = (rate.dot(&self.normal), self.force.dot(&self.normal));
        let support = (before - self.mass * (along - self.closing)).max(0.0);
        let mut force = self.normal * support;
        if self.stick > 0.0 {
            let across = rate - self.normal * along + self.slipping;
            // 2/7 of the effective mass moves with the contact point of a sphere.
            let mut shear = self.force - self.normal * before - across * (2.0 / 7.0 * self.mass);
            let size = shear.norm();
            if size > self.stick * support {
                shear *= self.slip * support / size;
            }
            force += shear;
        }
        force
    }
}

impl Resting {
    /// How near (m) grains of this radius (m) must be to rest against each other, where chords of sub-steps of length `step` (s) depart from paths
    /// under accelerations of `acceleration` (m/s²).
    pub(super) fn reach(radius: f64, acceleration: f64, step: f64) -> f64 {
        PAIR_REACH * radius + 0.25 * acceleration * step * step
    }

    /// Finds the contacts at rest. `flights` are at their places, with the velocities of their chords of the sub-step before, and `pull` (m/s²) is
    /// what acts on each grain now.
    #[expect(clippy::too_many_arguments, reason = "all of them say where contacts can be")]
    pub(super) fn find<S: Surface>(
        &mut self,
        surface: &S,
        touches: &[Touch],
        grains: &[Grain],
        flights: &[Flight],
        pull: &[Vector3<f64>],
        step: f64,
        [grain_law, surface_law]: [&ContactLaw; 2],
    ) {
        self.before.clear();
        let surface_before = self.surface;
        for contact in self.contacts.drain(..) {
            let first = if contact.first == surface_before { SURFACE } else { contact.first };
            self.before.insert((first, contact.second, contact.element), contact.force);
        }
        self.surface = flights.len() as u32;
        let strength = |grain: u32| pull[grain as usize].norm();
        for &Touch { a, b, apart } in touches {
            let (ours, theirs) = (&flights[a as usize], &flights[b as usize]);
            let normal = apart.normalize();
            let acceleration = strength(a).max(strength(b));
            let gap = apart.norm() - ours.radius - theirs.radius;
            let near = gap < Self::reach(ours.radius.min(theirs.radius), acceleration, step);
            let rate = (theirs.velocity - ours.velocity).dot(&normal);
            if near && rate.abs() <= PAIR_REST * acceleration * step {
                let [ours, theirs] = [a, b].map(|grain| grains[grain as usize].mass);
                let mass = ours * theirs / (ours + theirs);
                self.take(a, b, 0, SurfaceContact { normal, gap, velocity: Vector3::zeros() }, mass, grain_law);
            }
        }
        self.among_grains.clear();
        self.among_grains.resize(flights.len(), false);
        for contact in &self.contacts {
            self.among_grains[contact.first as usize] = true;
            self.among_grains[contact.second as usize] = true;
        }
        for (grain, flight) in (0..).zip(flights).filter(|(_, flight)| flight.radius > 0.0) {
            let pull = strength(grain) * step;
            let (reach, least) = if self.among_grains[grain as usize] {
                (PAIR_REACH * flight.radius, PAIR_REST * pull)
            } else {
                (SURFACE_REACH * flight.radius, SURFACE_REST * pull)
            };
            surface.touches(flight, reach, &mut |element, contact| {
                if (flight.velocity - contact.velocity).dot(&contact.normal).abs() <= least {
                    let mass = grains[grain as usize].mass;
                    self.take(SURFACE, grain, element, contact, mass, surface_law);
                }
            });
        }
    }

    fn take(&mut self, first: u32, second: u32, element: u32, contact: SurfaceContact, mass: f64, law: &ContactLaw) {
        let SurfaceContact { normal, gap, velocity } = contact;
        let (stick, slip) = friction(law);
        let before = self.before.get(&(first, second, element)).copied().unwrap_or_default();
        // The normal has turned a little since.
        let along = before.dot(&normal);
        let force = if along > 0.0 { before } else { before - normal * along };
        let none = Vector3::zeros();
        let first = if first == SURFACE { self.surface } else { first };
        self.contacts.push(Contact {
            first,
            second,
            element,
            normal,
            velocity,
            mass,
            gap,
            closing: 0.0,
            slipping: none,
            stick,
            slip,
            force,
            change: none,
            heading: none,
        });
    }

    /// Puts contacts in order from the lowest upwards, where lowest is farthest along `down`: what is below carries what is above, and a sweep
    /// that begins there hands it on.
    fn order(&mut self, flights: &[Flight], down: Vector3<f64>) {
        let depth = |contact: &Contact| {
            let second = &flights[contact.second as usize];
            (second.position - contact.normal * second.radius).dot(&down)
        };
        let number = |contact: &Contact| (contact.first, contact.second, contact.element);
        self.contacts
            .sort_unstable_by(|one, other| depth(other).total_cmp(&depth(one)).then(number(one).cmp(&number(other))));
    }

    /// How many contacts are at rest.
    pub(super) fn count(&self) -> u32 {
        self.contacts.len() as u32
    }

    /// Whether no contact is at rest.
    pub(super) fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// Adds what contacts carry to the accelerations `pull` (m/s²), so that no contact at rest is pressed together, and slip ends within `step`
    /// (s) where friction can end it. Gives angular accelerations to [`angular`](Self::angular).
    pub(super) fn carry(&mut self, grains: &[Grain], flights: &[Flight], pull: &mut [Vector3<f64>], step: f64) {
        let largest = pull.iter().map(|pull| pull.norm()).fold(0.0, f64::max);
        let smallest =
            flights.iter().map(|flight| flight.radius).filter(|&radius| radius > 0.0).fold(f64::INFINITY, f64::min);
        self.order(flights, pull.iter().sum());
        self.aim(grains, flights, step, largest);
        self.move_with(grains, flights, |slot| (pull[slot], Vector3::zeros()));
        for contact in &self.contacts {
            contact.push(&mut self.movers, contact.force);
        }
        let yielded = YIELDING * smallest / (step * step) + 0.125 * largest;
        let least = (CLOSING * UNNOTICED * yielded).clamp(ACCURACY[0] * largest, ACCURACY[1] * largest);
        sweep(&mut self.contacts, &mut self.movers, [least, SHAKING * largest]);
        for contact in self.contacts.iter_mut().filter(|contact| contact.first == self.surface) {
            // What is left of the sweeps would be a tiny fall, and a hit.
            let along = contact.rate(&self.movers).dot(&contact.normal);
            let push = contact.mass * (contact.closing - along);
            if push > -contact.force.dot(&contact.normal) {
                contact.force += contact.normal * push;
                contact.push(&mut self.movers, contact.normal * push);
            }
        }
        self.angular.clear();
        for ((pull, flight), mover) in pull.iter_mut().zip(flights).zip(&self.movers) {
            *pull = mover.linear;
            self.angular.push(if flight.radius > 0.0 { mover.turning / flight.radius } else { mover.turning });
        }
    }

    /// Sets all grains in motion as `rates` says of each: rate of its centre, and of its rotation times its radius.
    fn move_with(
        &mut self,
        grains: &[Grain],
        flights: &[Flight],
        rates: impl Fn(usize) -> (Vector3<f64>, Vector3<f64>),
    ) {
        self.movers.clear();
        self.movers.extend(grains.iter().enumerate().take(flights.len()).map(|(slot, grain)| {
            let (linear, turning) = rates(slot);
            Mover { linear, turning, inverse_mass: 1.0 / grain.mass }
        }));
        self.movers.push(UNMOVED);
    }

    /// Says for all contacts at which rate the gap should close and how much slip should end, at the velocities of `flights`.
    fn aim(&mut self, grains: &[Grain], flights: &[Flight], step: f64, largest: f64) {
        let (most_closing, most) = (CLOSING_PULL * largest * step, BRAKING * largest);
        self.move_with(grains, flights, |slot| (flights[slot].velocity, grains[slot].spin * flights[slot].radius));
        for contact in &mut self.contacts {
            let rate = contact.rate(&self.movers) - contact.velocity;
            let along = rate.dot(&contact.normal);
            let closing = (-CLOSING * contact.gap / step).clamp(-most_closing, most_closing);
            contact.closing = ((closing - along) / step).clamp(-most, most);
            contact.slipping = (rate - contact.normal * along) / step;
        }
    }

    /// Ends what contacts at rest still approach: velocities, as of now, in place. `given` (m/s) is what the strongest force gives in a sub-step.
    /// Gives what was done.
    pub(super) fn settle(&mut self, grains: &mut [Grain], flights: &mut [Flight], given: f64) -> Settled {
        let mut settled = Settled::default();
        let surface = self.surface;
        let approaching = self.contacts.iter().any(|contact| {
            let first =
                if contact.first == surface { contact.velocity } else { flights[contact.first as usize].velocity };
            (flights[contact.second as usize].velocity - first).dot(&contact.normal) < -SETTLED * given
        });
        if !approaching {
            return settled;
        }
        self.move_with(grains, flights, |slot| (flights[slot].velocity, grains[slot].spin * flights[slot].radius));
        let mut forces = std::mem::take(&mut self.forces);
        forces.clear();
        for contact in &mut self.contacts {
            forces.push(contact.force);
            contact.force = Vector3::zeros();
            contact.closing = contact.velocity.dot(&contact.normal);
            contact.slipping = contact.normal * contact.closing - contact.velocity;
        }
        let before = energy(grains, flights);
        sweep(&mut self.contacts, &mut self.movers, [0.1 * SETTLED * given, SHAKING * given]);
        for ((flight, grain), mover) in flights.iter_mut().zip(grains.iter_mut()).zip(&self.movers) {
            if flight.radius > 0.0 {
                (flight.velocity, grain.spin) = (mover.linear, mover.turning / flight.radius);
            }
        }
        settled.impulse_surface = self.force_of_surface();
        settled.work_surface = self.power_of_surface();
        settled.dissipated = before + settled.work_surface - energy(grains, flights);
        for (contact, force) in self.contacts.iter_mut().zip(&forces) {
            contact.force = *force;
        }
        self.forces = forces;
        settled
    }

    /// Angular acceleration of a grain, rad/s².
    pub(super) fn angular(&self, grain: usize) -> Vector3<f64> {
        if self.contacts.is_empty() {
            return Vector3::zeros();
        }
        self.angular.get(grain).copied().unwrap_or_else(Vector3::zeros)
    }

    /// Force of the surface on all grains at rest, N.
    pub(super) fn force_of_surface(&self) -> Vector3<f64> {
        self.at_surface().map(|contact| contact.force).sum()
    }

    /// Power of a moving surface on all grains at rest, W.
    pub(super) fn power_of_surface(&self) -> f64 {
        self.at_surface().map(|contact| contact.force.dot(&contact.velocity)).sum()
    }

    fn at_surface(&self) -> impl Iterator<Item = &Contact> {
        self.contacts.iter().filter(|contact| contact.first == self.surface)
    }
}

/// Kinetic energy of all grains, J.
fn energy(grains: &[Grain], flights: &[Flight]) -> f64 {
    grains
        .iter()
        .zip(flights)
        .filter(|(_, flight)| flight.radius > 0.0)
        .map(|(grain, flight)| crate::grains::kinetic_energy(flight, grain))
        .sum()
}

/// Gauss–Seidel sweeps over the contacts until nothing changes by more than `least`, or, where much changes, up to `most`.
///
/// By themselves sweeps hand a load down a pile as slowly as diffusion does. Their changes are taken for the gradient of a nonlinear conjugate
/// gradient method (Silcowitz, Niebe & Erleben 2010), which needs about as many sweeps as the pile has layers; each sweep ends with forces
/// that are allowed.
fn sweep(contacts: &mut [Contact], movers: &mut [Mover], [least, most]: [f64; 2]) {
    let (mut before, mut least) = (0.0, least);
    for number in 0..SWEEPS {
        let (mut largest, mut sum) = (0f64, 0.0);
        for contact in contacts.iter_mut() {
            let change = contact.wanted(movers) - contact.force;
            contact.push(movers, change);
            contact.force += change;
            contact.change = change;
            let size = change.norm_squared();
            largest = largest.max(size / (contact.mass * contact.mass));
            sum += size;
        }
        if number == 0 {
            least = least.max((ENOUGH * largest.sqrt()).min(most));
        }
        if largest <= least * least || number + 1 == SWEEPS {
            return;
        }
        // Where changes grow, the direction was no good: start over.
        let part = if before > 0.0 && sum <= before { sum / before } else { 0.0 };
        before = sum;
        for contact in contacts.iter_mut() {
            let onwards = contact.heading * part;
            contact.heading = onwards + contact.change;
            if part > 0.0 {
                contact.force += onwards;
                contact.push(movers, onwards);
            }
        }
    }
}
