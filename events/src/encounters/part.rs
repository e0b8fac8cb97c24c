//! A part of the grains: others are elsewhere, and some come and go as states that somebody else knows.
//!
//! So two of these can share the work on one domain, each with the grains on its side and those beside it. Grains keep their numbers, with
//! which events of equal times are put in order.

use super::{Encounters, Neighbors, is_vacant};
use crate::calendar::{Calendar, Plan};
use crate::{Flight, Surface};

impl<S: Surface, C: Calendar> Encounters<S, C> {
    /// Whether a grain with this number is here.
    #[inline]
    #[must_use]
    pub fn is_inside(&self, grain: u32) -> bool {
        !is_vacant(&self.flights[grain as usize])
    }

    /// The states that the grains of the latest encounter had before they were advanced to it, in the order in which it names them.
    #[inline]
    #[must_use]
    pub fn before(&self) -> [Flight; 2] {
        self.before
    }

    /// Leaves only those grains inside that `keep` names, as of `now` (s, epoch time), and predicts everything anew. There are so many `everywhere`.
    pub fn keep_only(&mut self, keep: impl Fn(u32) -> bool, everywhere: usize, now: f64) {
        for grain in 0..self.flights.len() as u32 {
            if self.is_inside(grain) && !keep(grain) {
                self.flights[grain as usize] = super::VACANT;
                self.count -= 1;
            }
        }
        self.everywhere = everywhere;
        self.start_anew(now);
    }

    /// Takes grains in that were elsewhere, all there are, and predicts everything anew as of `now` (s, epoch time).
    pub fn gather(&mut self, grains: impl Iterator<Item = (u32, Flight, bool)>, now: f64) {
        for (grain, flight, stopped_by_surface) in grains {
            self.count += usize::from(!self.is_inside(grain));
            self.flights[grain as usize] = flight;
            *self.calendar.plan_mut(grain) = Plan::new(stopped_by_surface);
        }
        self.everywhere = 0;
        self.start_anew(now);
    }

    fn start_anew(&mut self, now: f64) {
        self.vacant = (0..self.flights.len() as u32).filter(|&grain| !self.is_inside(grain)).collect();
        if !matches!(self.neighbors, Neighbors::Nobody) {
            self.lay_out_cells(now);
        }
        self.predict_all(now);
    }

    /// Takes a grain out for somebody else to know.
    pub fn lift(&mut self, grain: u32) {
        self.take_out(grain);
    }

    /// Puts a grain that is not inside into this state, at `now` (s, epoch time), to which its flight goes on; the surface stops it or does not.
    pub fn put_down(&mut self, grain: u32, flight: Flight, stopped_by_surface: bool, now: f64) {
        self.count += 1;
        self.flights[grain as usize] = flight;
        *self.calendar.plan_mut(grain) = Plan::new(stopped_by_surface);
        if let Neighbors::Cells(cells) = &mut self.neighbors {
            if !cells.fits(flight.radius) {
                return self.start_anew(now);
            }
            cells.insert(grain, &flight, now);
        }
        self.predict(grain);
    }

    /// Begins to note who crosses into another cell, for [`turn_back`](Self::turn_back) not to look at all grains.
    pub fn forget_crossings(&mut self) {
        self.crossed.clear();
    }

    /// Goes back to `now` (s, epoch time), since crossings were forgotten or later, once those grains whose states have changed since have their old ones again: the others stand in the
    /// cells of a later time.
    pub fn turn_back(&mut self, now: f64) {
        match &self.neighbors {
            Neighbors::Cells(cells) if !cells.were_there(now) => self.start_anew(now),
            Neighbors::Cells(_) => {
                // They stay noted: it may go back once more, to an earlier time.
                for number in 0..self.crossed.len() {
                    let grain = self.crossed[number];
                    let Neighbors::Cells(cells) = &mut self.neighbors else { return };
                    let flight = self.flights[grain as usize];
                    if is_vacant(&flight) || cells.is_in_place(grain, &flight, now) {
                        continue;
                    }
                    cells.remove(grain);
                    cells.insert(grain, &flight, now);
                    self.release_partner(grain);
                    self.predict(grain);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{Domain, Encounter, NoSurface};

    fn ball(x: f64, y: f64, speed: f64) -> Flight {
        Flight { position: Vector3::new(x, y, 0.0), time: 0.0, velocity: Vector3::x() * speed, radius: 0.5 }
    }

    /// A window that goes back twice: who had crossed cells was forgotten after the first time, and stood where it flies later.
    #[test]
    fn going_back_twice_puts_all_where_they_are() {
        let mut flights: Vec<Flight> = (0..8).map(|number| ball(3.0 * f64::from(number), -9.0, 0.0)).collect();
        flights.extend([ball(0.0, 0.0, 2.0), ball(4.0, 6.0, 0.0)]);
        let count = flights.len();
        let mut balls = Encounters::<NoSurface>::new(flights, NoSurface, Domain::unbounded(), f64::INFINITY);
        balls.keep_only(|_| true, count, 0.0);
        balls.forget_crossings();
        assert_eq!(balls.next_before(9.0), None);
        assert!(balls.crossed.contains(&8));
        balls.turn_back(6.0);
        balls.lift(9);
        balls.put_down(9, Flight { time: 1.0, ..ball(6.0, 0.0, 0.0) }, true, 1.0);
        balls.turn_back(1.0);
        assert_eq!(balls.next_before(9.0), Some((2.5, Encounter::Grains { a: 8, b: 9 })));
    }
}
