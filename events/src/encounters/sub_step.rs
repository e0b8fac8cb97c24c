//! Sub-steps: flights as chords of accelerated grains, neighbours that last, grains that touch.

use nalgebra::Vector3;

use super::{Encounters, Neighbors, is_vacant};
use crate::calendar::Calendar;
use crate::lists::{Lists, skin};
use crate::neighbors::{Cells, Near};
use crate::{Bend, Flight, Surface};

/// Who is near whom when a sub-step begins, while all grains stand at time 0.
#[derive(Debug)]
pub struct Vicinity<'a> {
    touches: &'a [Touch],
    neighbors: &'a Neighbors,
    /// Kept for its memory.
    near: Near,
}

impl<'a> Vicinity<'a> {
    /// All grains that are nearer to each other than the reach that was asked for, in the order of their numbers.
    #[must_use]
    pub fn touches(&self) -> &'a [Touch] {
        self.touches
    }

    /// Calls `visit` with every grain that can soon touch `grain`, and perhaps with some that cannot, and the shift (m) of the
    /// image that is meant.
    pub fn around(&mut self, grain: u32, mut visit: impl FnMut(u32, Vector3<f64>)) {
        self.near.clear();
        self.neighbors.add_each_once(grain, &mut self.near);
        self.near.iter().for_each(|(other, shift)| visit(other, shift));
    }
}

/// Two grains that touch or nearly do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The lower number.
    pub a: u32,
    /// The higher number.
    pub b: u32,
    /// From the centre of `a` to that of `b`, m.
    pub apart: Vector3<f64>,
}

impl<S: Surface, C: Calendar> Encounters<S, C> {
    /// How a grain departs from its stored flight, its chord; not at all where nothing accelerates it.
    #[inline]
    #[must_use]
    pub fn bend(&self, grain: u32) -> Bend {
        let acceleration = self.accelerations.get(grain as usize).copied().unwrap_or_else(Vector3::zeros);
        let step = if self.horizon < f64::INFINITY { self.horizon } else { 0.0 };
        Bend { acceleration, step }
    }

    /// Changes the acceleration (m/s²) of a grain that has just met something and is yet to be deflected: place and velocity stay, the chord
    /// changes.
    pub fn accelerate(&mut self, grain: u32, acceleration: Vector3<f64>) {
        let before = self.bend(grain);
        self.accelerations[grain as usize] = acceleration;
        let after = self.bend(grain);
        let flight = &mut self.flights[grain as usize];
        flight.position += before.offset(flight.time) - after.offset(flight.time);
        flight.velocity += before.velocity(flight.time) - after.velocity(flight.time);
    }

    /// How far chords depart from paths in this sub-step, m.
    #[must_use]
    pub fn sag(&self) -> f64 {
        self.sag
    }

    /// Calls `visit` with every grain that is nearer to `grain` than `reach` (m) at `time` (s, epoch time), along the chords, and the way from
    /// centre to centre (m).
    pub fn touching(&self, grain: u32, time: f64, reach: f64, mut visit: impl FnMut(u32, Vector3<f64>)) {
        let ours = self.flight(grain);
        let place = ours.position_at(time);
        let mut near = Near::default();
        self.neighbors.add_each_once(grain, &mut near);
        for (other, shift) in near.iter() {
            let theirs = self.flight(other);
            let apart = theirs.position_at(time) + shift - place;
            let within = ours.radius + theirs.radius + reach;
            if apart.norm_squared() < within * within {
                visit(other, apart);
            }
        }
    }

    /// Brings a grain to `time` (s, epoch time), before it is deflected without having met anything itself.
    pub fn bring(&mut self, grain: u32, time: f64) {
        self.advance(grain, time);
    }

    /// Starts a new sub-step like an epoch. `kick` is given the surface, who is near whom, nearer than `reach` (m) above all, and all flights,
    /// as they are at that moment, to change their velocities (m/s) to those of the chords, and their accelerations (m/s²) to set; a
    /// grain that has been taken out has the radius 0. It gives the length of the sub-step (s), and
    /// how far chords depart from paths in it (m): by so much grains that touch may overlap, beyond [`YIELDING`](crate::YIELDING), before they meet again.
    pub fn start_sub_step(
        &mut self,
        duration: f64,
        reach: f64,
        kick: impl FnOnce(&S, &mut Vicinity<'_>, &mut [Flight], &mut [Vector3<f64>]) -> (f64, f64),
    ) {
        self.halt(duration);
        self.under_force = true;
        self.accelerations.resize(self.flights.len(), Vector3::zeros());
        let touches = self.touches(reach);
        let next;
        let mut vicinity = Vicinity { touches: &touches, neighbors: &self.neighbors, near: Near::default() };
        (next, self.sag) = kick(&self.surface, &mut vicinity, &mut self.flights, &mut self.accelerations);
        self.resume(next);
    }

    /// How deep the two grains that overlap most are in each other at `time` (s, epoch time), up to which all is resolved, over the smaller radius; 0 where
    /// none overlap.
    #[must_use]
    pub fn deepest_overlap(&self, time: f64) -> f64 {
        let place = |grain: u32| self.flight(grain).position_at(time) + self.bend(grain).offset(time);
        let (mut deepest, mut near) = (0.0_f64, Near::default());
        for a in self.inside() {
            let (ours, radius) = (place(a), self.flight(a).radius);
            near.clear();
            self.neighbors.add_each_once(a, &mut near);
            for (b, shift) in near.iter().filter(|&(b, _)| a < b) {
                let other = self.flight(b).radius;
                let overlap = radius + other - (place(b) + shift - ours).norm();
                deepest = deepest.max(overlap / radius.min(other));
            }
        }
        deepest
    }

    /// All pairs of grains, standing at time 0, that are nearer to each other than `reach` (m), in the order of their numbers.
    fn touches(&self, reach: f64) -> Vec<Touch> {
        let (mut touches, mut near) = (Vec::new(), Near::default());
        for a in self.inside() {
            let ours = self.flights[a as usize];
            near.clear();
            self.neighbors.add_each_once(a, &mut near);
            for (b, shift) in near.iter() {
                let theirs = self.flights[b as usize];
                let apart = theirs.position + shift - ours.position;
                let within = ours.radius + theirs.radius + reach;
                if a < b && apart.norm_squared() < within * within {
                    touches.push(Touch { a, b, apart });
                }
            }
        }
        touches.sort_unstable_by_key(|touch| (touch.a, touch.b));
        touches
    }

    /// Makes neighbour lists for the coming sub-steps, where there are such and it pays.
    pub(super) fn make_lists(&mut self) -> bool {
        if !self.under_force {
            return false;
        }
        let stream = self.stream(0.0);
        let Some(skin) = skin(self.flights_inside(), stream.largest_radius, self.horizon) else { return false };
        let Some(mut cells) = Cells::with_skin(self.domain, skin, &stream) else { return false };
        for grain in self.inside() {
            cells.insert(grain, self.flight(grain), 0.0);
        }
        let lists = Lists::new(&cells, &self.flights, skin);
        let hold = self.inside().all(|grain| lists.holds(grain, self.flight(grain), self.horizon));
        if hold {
            self.neighbors = Neighbors::Lists(lists);
        }
        hold
    }

    /// Turns from lists to cells where a grain has become too fast for them.
    #[cold]
    pub(super) fn leave_lists(&mut self, now: f64) {
        for flight in self.flights.iter_mut().filter(|flight| !is_vacant(flight)) {
            self.domain.wrap(&mut flight.position);
        }
        self.lay_out_cells(now);
        self.predict_all(now);
    }
}
