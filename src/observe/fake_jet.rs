//! A make-believe jet for the tests of observers and output: honest impulses, made-up encounters.
//!
//! Grains fall on the plane z = 0 and bounce; near it, pairs drawn at random exchange an impulse along a normal drawn at
//! random, wherever they are. So momentum and energy are accounted for exactly and no engine is needed.

use impinge_events::Flight;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::grains::{Grain, Snapshot, kinetic_energy};
use crate::scheme::{GrainCollision, Observer, Passage, SurfaceHit};

/// A jet like that of Mukherjee & Zohdi (2015), table 1, and how it is to be watched.
pub(crate) struct FakeJet {
    /// Grains at the start.
    pub(crate) grains: u64,
    /// Grains that enter later.
    pub(crate) inflow: u64,
    pub(crate) samples: u32,
    pub(crate) frames: u32,
    /// Stop after this part of the run.
    pub(crate) part: f64,
}

impl Default for FakeJet {
    fn default() -> Self {
        Self { grains: 500, inflow: 0, samples: 50, frames: 0, part: 1.0 }
    }
}

struct State<'a, O> {
    flights: Vec<Flight>,
    grains: Vec<Grain>,
    dice: Pcg64Mcg,
    observer: &'a mut O,
    time: f64,
}

const RADIUS: f64 = 0.01;
const RESTITUTION: f64 = 0.8;
const UNTIL: f64 = 0.06;
const STEPS: u32 = 1200;

impl FakeJet {
    pub(crate) const UNTIL: f64 = UNTIL;

    /// A hit of nothing, to be filled in.
    pub(crate) fn hit(order: u32) -> SurfaceHit {
        SurfaceHit {
            time: 0.0,
            id: 0,
            mass: 1.0,
            radius: RADIUS,
            element: 0,
            position: Vector3::zeros(),
            normal: Vector3::z(),
            order,
            impulse_normal: 0.0,
            impulse_tangential: Vector3::zeros(),
            approach_speed: 0.0,
            energy_normal: 0.0,
            energy_tangential: 0.0,
            energy_spin: 0.0,
            dissipated: 0.0,
            work: 0.0,
            withheld: 0.0,
            overlap_over_radius: 0.0,
        }
    }

    pub(crate) fn run(&self, observer: &mut impl Observer) {
        let dice = Pcg64Mcg::seed_from_u64(1);
        let mut state = State { flights: Vec::new(), grains: Vec::new(), dice, observer, time: 0.0 };
        (0..self.grains).for_each(|id| state.enter(id, 0.1, 2.6));
        for step in 0..=STEPS {
            state.time = UNTIL * f64::from(step) / f64::from(STEPS);
            let last = f64::from(step) >= self.part * f64::from(STEPS);
            if step.is_multiple_of(STEPS / self.samples) || last {
                state.observer.sample(&Snapshot { time: state.time, flights: &state.flights, grains: &state.grains });
            }
            if self.frames > 1 && step.is_multiple_of(STEPS / (self.frames - 1)) {
                let snapshot = Snapshot { time: state.time, flights: &state.flights, grains: &state.grains };
                state.observer.frame(step / (STEPS / (self.frames - 1)), &snapshot);
            }
            if last {
                break;
            }
            if u64::from(step) < self.inflow {
                state.enter(self.grains + u64::from(step), 2.5, 2.6);
            }
            state.step(UNTIL / f64::from(STEPS));
        }
    }
}

impl<O: Observer> State<'_, O> {
    fn enter(&mut self, id: u64, low: f64, high: f64) {
        let dice = &mut self.dice;
        let position =
            Vector3::new(dice.random_range(-0.1..0.1), dice.random_range(-0.1..0.1), dice.random_range(low..high));
        let flight = Flight { position, time: 0.0, velocity: Vector3::new(0.0, 0.0, -80.0), radius: RADIUS };
        let grain = Grain {
            id,
            mass: 8500.0 * crate::grains::sphere_volume(RADIUS),
            spin: Vector3::zeros(),
            hits: 0,
            strength: 1.0,
        };
        self.observer.passage(Passage::Entered, self.time, &flight, &grain);
        self.flights.push(flight);
        self.grains.push(grain);
    }

    fn step(&mut self, duration: f64) {
        self.flights.iter_mut().for_each(|flight| flight.position += flight.velocity * duration);
        (0..self.flights.len()).for_each(|index| self.bounce(index));
        let near: Vec<usize> = (0..self.flights.len()).filter(|&index| self.flights[index].position.z < 0.25).collect();
        for _ in 0..near.len() / 60 {
            let [a, b] = [(); 2].map(|()| near[self.dice.random_range(0..near.len())]);
            self.collide(a.min(b), a.max(b));
        }
        for index in (0..self.flights.len()).rev() {
            let place = self.flights[index].position;
            if place.x.abs().max(place.y.abs()) > 3.0 || place.z > 3.0 {
                let (flight, grain) = (self.flights.remove(index), self.grains.remove(index));
                self.observer.passage(Passage::Left, self.time, &flight, &grain);
            }
        }
    }

    fn bounce(&mut self, index: usize) {
        let (flight, grain) = (&mut self.flights[index], &mut self.grains[index]);
        if flight.position.z > RADIUS || flight.velocity.z >= 0.0 {
            return;
        }
        let before = (*flight, kinetic_energy(flight, grain));
        grain.hits += 1;
        flight.velocity.z *= -RESTITUTION;
        flight.velocity.x *= 0.9;
        flight.velocity.y *= 0.9;
        let impulse = (flight.velocity - before.0.velocity) * grain.mass;
        let along = before.0.velocity.xy().norm_squared();
        self.observer.surface_hit(&SurfaceHit {
            time: self.time,
            id: grain.id,
            mass: grain.mass,
            position: flight.position - Vector3::z() * RADIUS,
            impulse_normal: impulse.z,
            impulse_tangential: Vector3::new(impulse.x, impulse.y, 0.0),
            approach_speed: -before.0.velocity.z,
            energy_normal: 0.5 * grain.mass * before.0.velocity.z.powi(2),
            energy_tangential: 0.5 * grain.mass * along,
            dissipated: before.1 - kinetic_energy(flight, grain),
            withheld: 0.0,
            overlap_over_radius: 1e-14,
            ..FakeJet::hit(grain.hits)
        });
    }

    fn collide(&mut self, a: usize, b: usize) {
        let normal = Vector3::from_fn(|_, _| self.dice.random_range(-1.0..1.0)).normalize();
        let approach = (self.flights[a].velocity - self.flights[b].velocity).dot(&normal);
        if a == b || approach <= 0.0 {
            return;
        }
        let energy =
            |state: &Self| [a, b].map(|i| kinetic_energy(&state.flights[i], &state.grains[i])).iter().sum::<f64>();
        let before = energy(self);
        let impulse = 0.5 * self.grains[a].mass * (1.0 + RESTITUTION) * approach;
        self.flights[a].velocity -= normal * (impulse / self.grains[a].mass);
        self.flights[b].velocity += normal * (impulse / self.grains[b].mass);
        self.observer.grain_collision(&GrainCollision {
            time: self.time,
            ids: [self.grains[a].id, self.grains[b].id],
            position: self.flights[a].position,
            normal,
            radii: [RADIUS; 2],
            impulse_normal: impulse,
            impulse_tangential: Vector3::zeros(),
            approach_speed: approach,
            dissipated: before - energy(self),
            withheld: 0.0,
            overlap_over_radius: -1e-15,
        });
    }
}
