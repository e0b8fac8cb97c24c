//! What the time-stepped schemes share: everything but how a step is taken.
//!
//! A scheme is a [`Method`]: it takes one step of the [`Crowd`] at a time, of whatever length it likes up to the `room` that it is given.
//! [`Stepped`] paces it: steps end where the run pauses (sample, frame, entry, end), so that observers see states and nothing in between. The
//! price is that the number of samples is part of what is computed, as it is in other time-stepped codes, and not in the event-driven scheme.
//!
//! A step of impulses reads like this:
//!
//! ```
//! use impinge::law::resolve_pair;
//! use impinge::scheme::stepped::{Crowd, Method, Near, even};
//! use impinge::scheme::{Broken, Observer};
//!
//! /// Overlap first, then reverse.
//! #[derive(Clone, Debug)]
//! struct Naive {
//!     step: f64,
//!     touching: Vec<([u32; 2], Near)>,
//! }
//!
//! impl Method for Naive {
//!     fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
//!         let step = even(room, self.step);
//!         for flight in &mut crowd.flights {
//!             flight.position += flight.velocity * step;
//!         }
//!         crowd.look(step, 0.0);
//!         crowd.touching(&mut self.touching);
//!         for &(pair, near) in &self.touching {
//!             let contact = resolve_pair(&crowd.laws().grain, &crowd.body(pair[0]), &crowd.body(pair[1]), near.normal);
//!             if contact.approach_speed > 0.0 && !crowd.shields(pair) {
//!                 pair.into_iter().zip(&contact.after).for_each(|(slot, after)| crowd.put(slot, after));
//!                 crowd.tell_pair_impulse(pair, &near, &contact, step, observer);
//!             }
//!         }
//!         Ok(step)
//!     }
//! }
//! ```
//!
//! The same for the surface: for each slot in [`Crowd::at_surface`], [`Crowd::surface_contacts`] gives the contacts (a scratch vector of the
//! method holds them), the law is [`resolve_surface`](crate::law::resolve_surface), and [`Crowd::tell_surface_impulse`] counts the hit and tells it.
//!
//! * **State.** [`Crowd::flights`] and [`Crowd::grains`] are the state that a method works on. One that iterates keeps the beginning of the
//!   step in vectors of its own, puts each iterate into the flights, and looks around anew with [`Crowd::look`]. A step that is rejected
//!   puts the beginning back; nothing else has to be undone, as long as nothing was told.
//! * **Forces.** Where [`Crowd::pull`] is not zero, apply it, and [`Crowd::book`] all the momentum that it gives: with it the ledger closes.
//! * **Records.** Contacts of no duration give one record an impulse, with the overlap that is found; it may be as large as it likes and does
//!   not stop the run. Contacts that last give one record at their end: see [`Crowd::count_hit`] and [`Crowd::tell_hit`].
//! * **Interference.** `none` gives no pairs. A grain that passes through the surface is not named at it from the next look on, and
//!   [`Crowd::may_hit`] says so at once. [`Crowd::shields`] asks whether the first touch of a pair takes one of them out.
//! * **Slots** of grains change only between steps: where a method keeps something for each grain or pair beyond the step, it hears of that in
//!   [`Method::renumber`]; grains that enter come last.

mod books;
mod comparator;
mod crowd;
mod neighbours;
mod passages;
mod record;

use std::ops::ControlFlow;

pub use self::comparator::Comparator;
pub use self::crowd::{Crowd, Near};
pub use self::passages::{GONE, retain};
pub use self::record::{approaches, energies};
use super::{Broken, Observer, Progress};
use crate::grains::NewGrain;

/// Steps of single grains between two looks at the watch (progress, Ctrl-C).
const GRAIN_STEPS_PER_WATCH: usize = 100_000;
/// What a quotient of two times may have lost to rounding over many steps, relative.
const ROUNDING: f64 = 1e-9;

/// How a time-stepped scheme takes a step.
pub trait Method {
    /// Advances the flights of `crowd` by one step of at most `room` (s), tells the contacts, and says how long the step was.
    ///
    /// # Errors
    /// A state that is no number, or whatever else breaks the run.
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken>;

    /// The grain that was in slot k will be in slot `slots[k]`, or is [`GONE`]; the crowd still has it in its old slot.
    fn renumber(&mut self, _crowd: &mut Crowd, _slots: &[u32], _observer: &mut impl Observer) {}

    /// The run is over: tells what has begun and not ended.
    fn finish(&mut self, _crowd: &mut Crowd, _observer: &mut impl Observer) {}
}

/// How the steps of a run went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps {
    /// How many there were.
    pub count: u64,
    /// Shortest, s.
    pub shortest: f64,
    /// Longest, s.
    pub longest: f64,
}

/// A crowd that a method advances.
#[derive(Clone, Debug)]
pub struct Stepped<M> {
    crowd: Crowd,
    method: M,
    steps: Steps,
    since_watch: usize,
}

impl<M: Method> Stepped<M> {
    /// `crowd` as it starts.
    #[must_use]
    pub fn new(crowd: Crowd, method: M) -> Self {
        Self { crowd, method, steps: Steps::default(), since_watch: 0 }
    }

    /// Advances to simulated time `end` (s).
    ///
    /// # Errors
    /// A broken invariant.
    pub fn advance(
        &mut self,
        end: f64,
        observer: &mut impl Observer,
        watch: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Broken> {
        let Self { crowd, method, steps, since_watch } = self;
        loop {
            let room = crowd.room(end);
            if room <= 0.0 {
                return Ok(watch(progress(crowd)));
            }
            let taken = method.step(crowd, room, observer)?;
            steps.note(taken);
            if let Some(slots) = crowd.end_step(taken, end)? {
                method.renumber(crowd, &slots, observer);
                crowd.take_out(&slots, observer);
            }
            *since_watch += 1 + crowd.len();
            if *since_watch > GRAIN_STEPS_PER_WATCH {
                *since_watch = 0;
                if watch(progress(crowd)).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
    }

    /// Tells what forces did since it was last told.
    ///
    /// # Errors
    /// Grains between which there is no finite force.
    pub fn tell(&mut self, observer: &mut impl Observer) -> Result<(), Broken> {
        self.crowd.tell_forces(observer)
    }

    /// Takes a grain in now.
    pub fn enter(&mut self, grain: &NewGrain, observer: &mut impl Observer) {
        self.crowd.enter(grain, observer);
    }

    /// Tells contacts that are still open at the end of the run.
    pub fn finish(&mut self, observer: &mut impl Observer) {
        self.method.finish(&mut self.crowd, observer);
    }

    /// The grains.
    #[must_use]
    pub fn crowd(&self) -> &Crowd {
        &self.crowd
    }

    /// How it takes its steps.
    #[must_use]
    pub fn method(&self) -> &M {
        &self.method
    }

    /// How the steps went.
    #[must_use]
    pub fn steps(&self) -> Steps {
        self.steps
    }
}

fn progress(crowd: &Crowd) -> Progress {
    Progress { time: crowd.time(), collisions: crowd.collisions(), inside: crowd.len() }
}

impl Steps {
    fn note(&mut self, taken: f64) {
        self.shortest = if self.count == 0 { taken } else { self.shortest.min(taken) };
        self.longest = self.longest.max(taken);
        self.count += 1;
    }
}

/// The length of the next of several steps of equal length that fill `room` (s), each at most `longest` (s): no step is much shorter than the
/// others.
#[must_use]
pub fn even(room: f64, longest: f64) -> f64 {
    // A quotient of whole steps that rounding has put just above a whole number makes no further step.
    room / (room / longest * (1.0 - ROUNDING)).ceil().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_fill_the_room_evenly() {
        assert_eq!(even(1.0, 0.3), 0.25);
        assert_eq!(even(1.0, f64::INFINITY), 1.0);
        assert_eq!(even(0.1, 0.3), 0.1);
        // Three tenths over one tenth is a little more than three.
        assert_eq!(even(0.30000000000000004, 0.1), 0.30000000000000004 / 3.0);
    }

    #[test]
    fn the_shortest_and_the_longest_step_are_kept() {
        let mut steps = Steps::default();
        [2.0, 1.0, 3.0].into_iter().for_each(|taken| steps.note(taken));
        assert_eq!(steps, Steps { count: 3, shortest: 1.0, longest: 3.0 });
    }
}
