//! Ways to advance time, and what each of them reports to its observers.

mod event_driven;
pub mod fixed_point;
mod penetration;
mod resting;
pub mod soft_sphere;
pub mod stepped;
mod substep;
mod timetable;
pub mod trapezoidal;

pub use event_driven::{
    AtRest, EventDriven, Halves, Held, LARGEST_OVERLAP, LARGEST_OVERLAP_WITH_FORCES, Laws, Windows,
};
pub use substep::{Forces, Length, STEPS_PER_CHECK, SubSteps, Substepped};
pub use timetable::Moments;

use impinge_events::Flight;
use nalgebra::Vector3;

use crate::grains::{Grain, Snapshot};
pub use crate::scene::Collapse;

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Simulated time, s.
    pub time: f64,
    /// Collisions so far, grain–grain and grain–surface.
    pub collisions: u64,
    /// Grains inside.
    pub inside: usize,
}

/// A broken invariant: the run has gone wrong and stops.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Broken {
    /// Grains overlap each other or the surface by more than rounding can explain.
    #[error("at t = {time} s {} by {overlap:.3e} radii (allowed: {allowed:.0e})", overlapping(grains))]
    Overlap {
        /// Simulated time, s.
        time: f64,
        /// Ids of the grains; one where the partner is the surface.
        grains: Vec<u64>,
        /// Overlap over the smaller radius.
        overlap: f64,
        /// The most that is allowed.
        allowed: f64,
    },
    /// Collisions without end, while time stands still.
    #[error("at t = {time} s {} jammed: {encounters} collisions and no time goes by", are(grains))]
    Jammed {
        /// Simulated time, s.
        time: f64,
        /// Ids of the grains that collided last.
        grains: Vec<u64>,
        /// Collisions at this time.
        encounters: u64,
    },
    /// The surface pushes a grain of a planar scene out of its plane.
    #[error("at t = {time} s the surface would push grain {grain} of a planar scene out of the plane y = 0")]
    OutOfPlane {
        /// Simulated time, s.
        time: f64,
        /// Id of the grain.
        grain: u64,
    },
    /// Grains between which the near field is no finite number.
    #[error("at t = {time} s the near field on {} no finite number: centres coincide", are(grains))]
    Singular {
        /// Simulated time, s.
        time: f64,
        /// Ids of the grains.
        grains: Vec<u64>,
    },
    /// A step of an implicit scheme does not converge.
    #[error("at t = {time} s a step does not converge in {iterations} iterations")]
    Unconverged {
        /// Simulated time, s.
        time: f64,
        /// Iterations that were tried.
        iterations: u32,
    },
    /// A velocity is no finite number.
    #[error("at t = {time} s the velocity of grain {} is no finite number", list(grains))]
    NotANumber {
        /// Simulated time, s.
        time: f64,
        /// Ids of the grains.
        grains: Vec<u64>,
    },
}

fn overlapping(grains: &[u64]) -> String {
    match grains {
        [grain] => format!("grain {grain} overlaps the surface"),
        _ => format!("grains {} overlap", list(grains)),
    }
}

fn are(grains: &[u64]) -> String {
    match grains {
        [grain] => format!("grain {grain} is"),
        _ => format!("grains {} are", list(grains)),
    }
}

fn list(grains: &[u64]) -> String {
    grains.iter().map(u64::to_string).collect::<Vec<_>>().join(" and ")
}

/// A collision between two grains, as observers see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrainCollision {
    /// Simulated time, s.
    pub time: f64,
    /// Ids of the two grains, the lower one first.
    pub ids: [u64; 2],
    /// Contact point, m.
    pub position: Vector3<f64>,
    /// Unit contact normal, from the first grain to the second.
    pub normal: Vector3<f64>,
    /// Their radii, m.
    pub radii: [f64; 2],
    /// Normal impulse J_n, N s; it pushes the two apart.
    pub impulse_normal: f64,
    /// Tangential impulse on the second grain, N s.
    pub impulse_tangential: Vector3<f64>,
    /// Normal speed of approach before the collision, m/s.
    pub approach_speed: f64,
    /// Kinetic energy dissipated, J.
    pub dissipated: f64,
    /// Kinetic energy that the law would have dissipated, J, where the collision was elastic as part of a collapse ([`Collapse`]).
    pub withheld: f64,
    /// Overlap at the event over the smaller radius: what rounding left (negative: a gap).
    pub overlap_over_radius: f64,
}

impl GrainCollision {
    /// The centres of both as they touch, m: a radius before and behind the contact point. In a periodic domain that of the second may be outside.
    #[must_use]
    pub fn centres(&self) -> [Vector3<f64>; 2] {
        let [first, second] = self.radii;
        [self.position - self.normal * first, self.position + self.normal * second]
    }

    /// From the centre of the first grain to that of the second, m.
    #[must_use]
    pub fn branch(&self) -> Vector3<f64> {
        self.normal * (self.radii[0] + self.radii[1])
    }

    /// The impulse on the second grain, N s; that on the first is its opposite.
    #[must_use]
    pub fn impulse(&self) -> Vector3<f64> {
        self.normal * self.impulse_normal + self.impulse_tangential
    }
}

/// A collision between a grain and the surface, as observers see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// Simulated time, s.
    pub time: f64,
    /// Id of the grain.
    pub id: u64,
    /// Mass of the grain, kg.
    pub mass: f64,
    /// Radius of the grain, m.
    pub radius: f64,
    /// Number of the plane or triangle, counted over all surfaces in the order of the scene.
    pub element: u32,
    /// Contact point, m.
    pub position: Vector3<f64>,
    /// Unit contact normal, from the surface to the grain.
    pub normal: Vector3<f64>,
    /// Hit order: 1 for the first time this grain hits the surface.
    pub order: u32,
    /// Normal impulse J_n on the grain along `normal`, N s.
    pub impulse_normal: f64,
    /// Tangential impulse on the grain, N s.
    pub impulse_tangential: Vector3<f64>,
    /// Normal speed of approach before the hit, relative to the surface, m/s.
    pub approach_speed: f64,
    /// Kinetic energy that the grain brings to the surface, relative to the surface: ½ m v_n², J.
    pub energy_normal: f64,
    /// The same along the surface: ½ m v_t², J.
    pub energy_tangential: f64,
    /// The same in its rotation: ½ I ω², J.
    pub energy_spin: f64,
    /// Kinetic energy dissipated, J.
    pub dissipated: f64,
    /// Kinetic energy that the law would have dissipated, J, where the hit was elastic as part of a collapse ([`Collapse`]).
    pub withheld: f64,
    /// Work that a moving surface does on the grain, J; 0 for one at rest.
    pub work: f64,
    /// Overlap at the event over the radius: what rounding left (negative: a gap).
    pub overlap_over_radius: f64,
}

impl SurfaceHit {
    /// Kinetic energy that the grain brings to the surface (J): normal, tangential and rotational.
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.energy_normal + self.energy_tangential + self.energy_spin
    }
}

/// What forces did to all grains together since the last kick, as observers see it: one a sub-step, none where no force acts.
///
/// Impulses are those that the scheme applied, in kicks, in their synchronisation at a collision and in contacts of finite duration alike, so that
/// momentum is accounted for to round-off. The potential energy is that of the grains at their places now: against it the ledger sees what
/// the sub-stepping itself gains or loses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kick {
    /// Simulated time, s.
    pub time: f64,
    /// Work of gravity on the grains since the last kick, J.
    pub work_gravity: f64,
    /// Momentum that gravity gave them since the last kick, N s.
    pub impulse_gravity: Vector3<f64>,
    /// Potential energy of the near field at `time`, J, where it was summed. What bounds a run counts most: the first one given before or
    /// after the first sample is the initial one, the latest the final one.
    pub potential_energy: Option<f64>,
    /// Momentum that the near field gave to all grains together since the last kick, N s: zero up to round-off, as it acts in pairs (up to its
    /// tolerance where a tree sums it).
    pub impulse_near_field: Vector3<f64>,
    /// Kinetic energy that the near field gave to the grains since the last kick, J.
    pub work_near_field: f64,
}

/// What resting contacts did since the last kick, as observers see it; nothing is reported where no grain rests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rest {
    /// Simulated time, s.
    pub time: f64,
    /// Momentum that grains at rest on the surface got from it since the last kick, N s.
    pub impulse_surface: Vector3<f64>,
    /// Work of a moving surface on grains at rest on it since the last kick, J.
    pub work_surface: f64,
    /// Kinetic energy dissipated in resting contacts between grains since the last kick, J.
    pub dissipated_grain: f64,
    /// The same in those with the surface, J.
    pub dissipated_surface: f64,
    /// Energy ≥ 0 that the treatment of resting contacts itself added since the last kick, J.
    pub added: f64,
    /// Resting contacts at `time`.
    pub contacts: u32,
}

/// How a grain came in or went out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Passage {
    /// It entered from a source.
    Entered,
    /// Its centre left the domain.
    Left,
    /// It was taken out by `interference = "removed-on-first-collision"`.
    Removed,
}

/// What watches a run. Every method has an empty default, so an observer costs only what it asks for.
pub trait Observer {
    /// Two grains collided.
    fn grain_collision(&mut self, _collision: &GrainCollision) {}
    /// A grain hit the surface.
    fn surface_hit(&mut self, _hit: &SurfaceHit) {}
    /// Forces acted on the grains: the end of a sub-step.
    fn kick(&mut self, _kick: &Kick) {}
    /// Grains rested on each other or on the surface during a sub-step.
    fn rest(&mut self, _rest: &Rest) {}
    /// A grain entered, left or was removed at `time` (s). The flight stands at that moment.
    fn passage(&mut self, _passage: Passage, _time: f64, _flight: &Flight, _grain: &Grain) {}
    /// A regular sample for time histories: the first at the start, the last at the end of the run.
    fn sample(&mut self, _snapshot: &Snapshot<'_>) {}
    /// A regular sample for pictures and ParaView, `number` counting from 0; as many as the scene asks for.
    fn frame(&mut self, _number: u32, _snapshot: &Snapshot<'_>) {}
}

/// Nobody watches.
impl Observer for () {}

/// Somebody else's observer watches.
impl<O: Observer> Observer for &mut O {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        (**self).grain_collision(collision);
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        (**self).surface_hit(hit);
    }

    fn kick(&mut self, kick: &Kick) {
        (**self).kick(kick);
    }

    fn rest(&mut self, rest: &Rest) {
        (**self).rest(rest);
    }

    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        (**self).passage(passage, time, flight, grain);
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        (**self).sample(snapshot);
    }

    fn frame(&mut self, number: u32, snapshot: &Snapshot<'_>) {
        (**self).frame(number, snapshot);
    }
}

/// Two observers watch.
impl<A: Observer, B: Observer> Observer for (A, B) {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.0.grain_collision(collision);
        self.1.grain_collision(collision);
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.0.surface_hit(hit);
        self.1.surface_hit(hit);
    }

    fn kick(&mut self, kick: &Kick) {
        self.0.kick(kick);
        self.1.kick(kick);
    }

    fn rest(&mut self, rest: &Rest) {
        self.0.rest(rest);
        self.1.rest(rest);
    }

    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        self.0.passage(passage, time, flight, grain);
        self.1.passage(passage, time, flight, grain);
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.0.sample(snapshot);
        self.1.sample(snapshot);
    }

    fn frame(&mut self, number: u32, snapshot: &Snapshot<'_>) {
        self.0.frame(number, snapshot);
        self.1.frame(number, snapshot);
    }
}
