//! Contacts at rest: what carries grains that forces press against each other and against the surface.
//!
//! Between two grains that rest against each other no collision happens. At each kick the contact forces are found that keep such contacts closed
//! and do not pull (a linear complementarity problem, with Coulomb friction), by Gauss–Seidel sweeps that start from the forces of the kick
//! before: in a pile at rest they hardly change, and a sweep or two are enough. This is the method of sequential impulses (Moreau 1999;
//! Catto 2005), applied to accelerations.

use impinge_events::{Flight, Surface, SurfaceContact, Touch};
use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use crate::grains::Grain;
use crate::law::{ContactLaw, Friction};

/// Two grains may rest against each other when their gap is below this part of the smaller radius, and a surface and a grain when it is below
/// [`SURFACE_REACH`]. A wider gap of a contact at rest stays open until somebody closes it.
pub(super) const PAIR_REACH: f64 = 1e-6;
/// A grain that rests on the surface does so to rounding: a bounce, low as it be, is resolved.
const SURFACE_REACH: f64 = 1e-9;
/// Two grains are at rest against each other when they approach or part slower than this part of what the force gives in a sub-step.
const PAIR_REST: f64 = 1.0;
/// The same for a grain and the surface.
const SURFACE_REST: f64 = 1e-3;
/// Sweeps stop when no contact force changes by more than this part of the largest force.
const ACCURACY: f64 = 1e-4;
/// Part of the gap, or of the overlap, of a contact at rest that is closed in a sub-step, so that rounding and unfinished sweeps do not add up.
const CLOSING: f64 = 0.1;
/// Closing takes no more than this part of the largest acceleration.
const CLOSING_PULL: f64 = 0.01;
/// Sweeps at the most; what is left then is closed by events.
const SWEEPS: u32 = 100;
/// The surface in place of a first grain.
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
    /// Force on the second grain along the normal, N; never negative.
    support: f64,
    /// Force on it across the normal, N.
    shear: Vector3<f64>,
}

/// What is pushed: inverse masses, radii, and the two fields (accelerations or velocities) of all grains.
struct Field<'a> {
    grains: &'a [Grain],
    flights: &'a [Flight],
    linear: &'a mut [Vector3<f64>],
    angular: &'a mut [Vector3<f64>],
}

/// The contacts at rest of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Resting {
    contacts: Vec<Contact>,
    /// Forces of the kick before, by first, second and element.
    before: FxHashMap<(u32, u32, u32), (f64, Vector3<f64>)>,
    angular: Vec<Vector3<f64>>,
    spins: Vec<Vector3<f64>>,
}

/// What the end of an approach at contacts at rest did.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Settled {
    /// Impulse of the surface on grains, N s.
    pub(super) impulse_surface: Vector3<f64>,
    /// Kinetic energy taken, J.
    pub(super) dissipated: f64,
}

fn friction(law: &ContactLaw) -> (f64, f64) {
    match law.friction {
        Friction::Smooth => (0.0, 0.0),
        Friction::Coulomb { static_, dynamic } => (static_, dynamic),
        Friction::Regularised { coefficient, .. } => (coefficient, coefficient),
    }
}

impl Field<'_> {
    /// Rate at which the contact points move apart.
    fn rate(&self, contact: &Contact) -> Vector3<f64> {
        let at = |grain: u32, sign: f64| {
            let arm = contact.normal * (sign * self.flights[grain as usize].radius);
            self.linear[grain as usize] + self.angular[grain as usize].cross(&arm)
        };
        let second = at(contact.second, -1.0);
        if contact.first == SURFACE { second } else { second - at(contact.first, 1.0) }
    }

    /// Pushes the second grain by `push` (N, N s), and the first back.
    fn push(&mut self, contact: &Contact, push: Vector3<f64>) {
        self.push_grain(contact.second, push, -contact.normal);
        if contact.first != SURFACE {
            self.push_grain(contact.first, -push, contact.normal);
        }
    }

    fn push_grain(&mut self, grain: u32, push: Vector3<f64>, arm: Vector3<f64>) {
        let grain = grain as usize;
        let (mass, radius) = (self.grains[grain].mass, self.flights[grain].radius);
        self.linear[grain] += push / mass;
        self.angular[grain] += arm.cross(&push) / (0.4 * mass * radius);
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
        for contact in self.contacts.drain(..) {
            self.before.insert((contact.first, contact.second, contact.element), (contact.support, contact.shear));
        }
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
        let mut among_grains = vec![false; flights.len()];
        for contact in &self.contacts {
            among_grains[contact.first as usize] = true;
            among_grains[contact.second as usize] = true;
        }
        for (grain, flight) in (0..).zip(flights).filter(|(_, flight)| flight.radius > 0.0) {
            let pull = strength(grain) * step;
            let (reach, least) = if among_grains[grain as usize] {
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
        let (support, shear) = self.before.get(&(first, second, element)).copied().unwrap_or_default();
        // The normal has turned a little since.
        let shear = shear - normal * shear.dot(&normal);
        let (closing, slipping) = (0.0, Vector3::zeros());
        self.contacts.push(Contact {
            first,
            second,
            element,
            normal,
            velocity,
            mass,
            gap,
            closing,
            slipping,
            stick,
            slip,
            support,
            shear,
        });
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
        self.angular.clear();
        self.angular.resize(flights.len(), Vector3::zeros());
        let largest = pull.iter().map(|pull| pull.norm()).fold(0.0, f64::max);
        self.aim(grains, flights, step, CLOSING_PULL * largest);
        let mut field = Field { grains, flights, linear: pull, angular: &mut self.angular };
        for contact in &self.contacts {
            field.push(contact, contact.normal * contact.support + contact.shear);
        }
        sweep(&mut self.contacts, &mut field, ACCURACY * largest);
        for contact in self.contacts.iter_mut().filter(|contact| contact.first == SURFACE && contact.support > 0.0) {
            // What is left of the sweeps would be a tiny fall, and a hit.
            let push = contact.mass * (contact.closing - field.rate(contact).dot(&contact.normal));
            contact.support += push;
            field.push(contact, contact.normal * push);
        }
    }

    /// Says for all contacts at which rate the gap should close and how much slip should end, at the velocities of `flights`.
    fn aim(&mut self, grains: &[Grain], flights: &[Flight], step: f64, most: f64) {
        let mut velocities: Vec<_> = flights.iter().map(|flight| flight.velocity).collect();
        self.spins.clear();
        self.spins.extend(grains.iter().map(|grain| grain.spin));
        let field = Field { grains, flights, linear: &mut velocities, angular: &mut self.spins };
        for contact in &mut self.contacts {
            let rate = field.rate(contact) - contact.velocity;
            let along = rate.dot(&contact.normal);
            contact.closing = ((-CLOSING * contact.gap / step - along) / step).clamp(-most, most);
            contact.slipping = (rate - contact.normal * along) / step;
        }
    }

    /// Ends what contacts at rest still approach: velocities, as of now, in place. Gives what was done.
    pub(super) fn settle(&mut self, grains: &mut [Grain], flights: &mut [Flight], least: f64) -> Settled {
        let approaching = self.contacts.iter().any(|contact| {
            let first =
                if contact.first == SURFACE { contact.velocity } else { flights[contact.first as usize].velocity };
            (flights[contact.second as usize].velocity - first).dot(&contact.normal) < -least
        });
        let mut settled = Settled::default();
        if !approaching {
            return settled;
        }
        let mut velocities: Vec<_> = flights.iter().map(|flight| flight.velocity).collect();
        let mut spins: Vec<_> = grains.iter().map(|grain| grain.spin).collect();
        let mut contacts = self.contacts.clone();
        for contact in &mut contacts {
            (contact.support, contact.shear) = (0.0, Vector3::zeros());
            (contact.closing, contact.slipping) = (0.0, Vector3::zeros());
        }
        let before = energy(grains, flights);
        let mut field = Field { grains, flights, linear: &mut velocities, angular: &mut spins };
        sweep(&mut contacts, &mut field, least);
        for ((flight, grain), (velocity, spin)) in
            flights.iter_mut().zip(grains.iter_mut()).zip(velocities.iter().zip(&spins))
        {
            (flight.velocity, grain.spin) = (*velocity, *spin);
        }
        for contact in contacts.iter().filter(|contact| contact.first == SURFACE) {
            settled.impulse_surface += contact.normal * contact.support + contact.shear;
        }
        settled.dissipated = before - energy(grains, flights);
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
        let at_surface = self.contacts.iter().filter(|contact| contact.first == SURFACE);
        at_surface.map(|contact| contact.normal * contact.support + contact.shear).sum()
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

/// Gauss–Seidel sweeps over the contacts until nothing changes by more than `least`.
fn sweep(contacts: &mut [Contact], field: &mut Field<'_>, least: f64) {
    for _ in 0..SWEEPS {
        let mut change = 0f64;
        for contact in contacts.iter_mut() {
            let rate = field.rate(contact);
            let along = rate.dot(&contact.normal);
            let support = (contact.support - contact.mass * (along - contact.closing)).max(0.0);
            let mut push = contact.normal * (support - contact.support);
            contact.support = support;
            if contact.stick > 0.0 {
                let across = rate - contact.normal * along + contact.slipping;
                // 2/7 of the effective mass moves with the contact point of a sphere.
                let mut shear = contact.shear - across * (2.0 / 7.0 * contact.mass);
                let size = shear.norm();
                if size > contact.stick * support {
                    shear *= contact.slip * support / size;
                }
                push += shear - contact.shear;
                contact.shear = shear;
            }
            field.push(contact, push);
            change = change.max(push.norm() / contact.mass);
        }
        if change <= least {
            return;
        }
    }
}
