//! From step to step: who goes, who comes, and where the others are counted from then on.

use impinge_events::{Domain, Flight, Surface as _};
use nalgebra::Vector3;

use super::Crowd;
use super::crowd::UNKNOWN;
use crate::grains::NewGrain;
use crate::scene::Interference;
use crate::scheme::event_driven::{carried, flight};
use crate::scheme::{Broken, Observer, Passage};

/// The new slot of a grain that is gone.
pub const GONE: u32 = u32::MAX;

impl Crowd {
    /// Goes on by a step of length `taken` (s), to the end of which the grains have been advanced, and which may reach simulated time `end` (s).
    /// Where grains go, tells the new slots of all.
    pub(super) fn end_step(&mut self, taken: f64, end: f64) -> Result<Option<Vec<u32>>, Broken> {
        self.surface.start_epoch(taken);
        // Exactly, so that rounding leaves no splinter of a step.
        self.clock = if taken >= self.room(end) { end - self.start } else { self.clock + taken };
        let Domain { min, max, .. } = self.domain;
        for slot in 0..self.flights.len() {
            let place = &self.flights[slot].position;
            // Not `<` and `>`: what is no number is not inside.
            let inside = |axis: usize| min[axis] <= place[axis] && place[axis] <= max[axis];
            if !(inside(0) && inside(1) && inside(2)) {
                self.outside(slot)?;
            }
        }
        Ok((!self.leaving.is_empty()).then(|| self.new_slots()))
    }

    fn new_slots(&self) -> Vec<u32> {
        let mut slots = vec![0; self.flights.len()];
        self.leaving.iter().for_each(|&(slot, _)| slots[slot as usize] = GONE);
        (0..).zip(slots.iter_mut().filter(|slot| **slot != GONE)).for_each(|(new, slot)| *slot = new);
        slots
    }

    /// A grain is no longer inside the domain.
    #[cold]
    fn outside(&mut self, slot: usize) -> Result<(), Broken> {
        let Flight { position, velocity, .. } = self.flights[slot];
        if !position.iter().chain(&velocity).all(|x| x.is_finite()) {
            return Err(Broken::NotANumber { time: self.time(), grains: vec![self.grains[slot].id] });
        }
        if !self.domain.periodic {
            self.leaving.push((slot as u32, Passage::Left));
            return Ok(());
        }
        let before = self.depth(&self.flights[slot], &self.grains[slot]);
        self.domain.wrap(&mut self.flights[slot].position);
        self.books.carried_away += before - self.depth(&self.flights[slot], &self.grains[slot]);
        Ok(())
    }

    /// Takes out the grains that go.
    pub(super) fn take_out(&mut self, slots: &[u32], observer: &mut impl Observer) {
        let mut leaving = std::mem::take(&mut self.leaving);
        leaving.sort_by_key(|&(slot, _)| slot);
        // One that was removed and left in the same step goes once.
        leaving.dedup_by_key(|&mut (slot, _)| slot);
        for (slot, passage) in leaving {
            let (flight, grain) = (self.flights[slot as usize], self.grains[slot as usize]);
            self.books.carried_away += self.depth(&flight, &grain);
            observer.passage(passage, self.time(), &flight, &grain);
        }
        retain(&mut self.flights, slots);
        retain(&mut self.grains, slots);
        retain(&mut self.clear, slots);
        self.mass = self.grains.iter().map(|grain| grain.mass).sum();
        self.neighbours.clear();
    }

    /// Takes a grain in now, in the last slot.
    pub(super) fn enter(&mut self, new: &NewGrain, observer: &mut impl Observer) {
        let (flight, grain) = (flight(new), carried(new, self.entered));
        self.entered += 1;
        self.strengths |= grain.strength != 1.0;
        self.mass += grain.mass;
        self.books.carried_away += -self.depth(&flight, &grain);
        self.flights.push(flight);
        self.grains.push(grain);
        self.clear.push(UNKNOWN);
        observer.passage(Passage::Entered, self.time(), &flight, &grain);
    }

    /// Whether a grain of this radius (m) at `position` (m) overlaps no other. The surface is not asked.
    #[must_use]
    pub fn is_free(&self, position: Vector3<f64>, radius: f64) -> bool {
        self.laws.interference == Interference::None
            || self
                .flights
                .iter()
                .all(|flight| self.domain.nearest(flight.position - position).norm() >= flight.radius + radius)
    }
}

/// Keeps what has a slot.
pub fn retain<T>(of: &mut Vec<T>, slots: &[u32]) {
    let mut slots = slots.iter();
    of.retain(|_| slots.next().is_some_and(|&slot| slot != GONE));
}
