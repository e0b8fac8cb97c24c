//! The phi-method of Mukherjee & Zohdi (2015), section 3: fixed steps, contacts found by overlap, iteration to the end of the step.
//!
//! With v(0), x(0) at the beginning of a step of length h, v and x at its end, and F the force on a grain of mass m (eq. 42 to 44):
//!
//! * v = v(0) + h/m \[phi F + (1 - phi) F(0)\]
//! * x = x(0) + h \[phi v + (1 - phi) v(0)\]
//!
//! (42) and (44) print h/2m and h/2: then a grain flies at half its speed, as the weights phi and 1 - phi add up to 1 already. Algorithm 1, which has
//! phi = 1/2 written out, is right. With phi = 1/2 the scheme is of second order, with any other of first, where the motion is smooth; across
//! contacts it is of first order, whatever phi.
//!
//! **Contacts** are where gaps are negative (40, 41) and whoever is there approaches. The distance to the surface is signed: with the absolute
//! value of (41) a grain whose centre has passed the plane would be pushed on.
//!
//! * *Approaching* is meant at the beginning of the step, v(0), and of the two relative to each other; the paper prints v_cn(t) < 0.
//! * *The impulse* J is that of the law for v(0), once a step. Algorithm 1 takes it anew from each iterate, which has been turned round
//!   already: a grain that hits the surface head-on at v goes on at (1 - e)/(3 + e) v, its fixed point, and does not rebound at all.
//! * *The force* is J/h at both ends, so that the step gives J whatever phi: the contact begins and ends within the step, for delta t < h (section 2.2).
//!   The delta t of the paper, which it gives nowhere, cancels; what forces from outside give during it is left out, as delta t is much shorter
//!   than h.
//! * *A contact that was found is kept* for the step, with the normal and the impulse that it was found with, although later iterates may have
//!   parted. To ask anew each time, as Algorithm 1 does, has no fixed point: an elastic bounce that ends without overlap undoes itself, and comes
//!   back. A grain finds its contacts with the surface once a step, so that a mesh gives one impulse where the iterates
//!   see it on one triangle, then on the next.
//! * *Several contacts of a grain* are added up (43), each from v(0). That is what the paper does, and it is not safe for energy: e = 1 between three
//!   grains in a row that meet at once stops them all. The residual of the ledger shows it.
//! * *Where they are looked for*: at the iterates, that is at the end of the step. Whoever touches and approaches at its beginning does so at the
//!   end too. With phi = 0 the end has no weight, and it is the beginning.
//!
//! Spins take part, which (38) leaves out: one sticking hit makes them as fast as the grain, and a comparison of schemes needs the same laws.
//!
//! **The iteration** begins with the state at the beginning: so its first force is F(0), and its first sweep needs no other. It ends when the change
//! of velocities and that of positions are each below the tolerance, relative to what they have changed by in this step ([`Change`]). Without a
//! near field nothing but contacts can change from one sweep to the next, and it ends when there is no new one. The near field at the end of a
//! step is taken for that at the beginning of the next, which it is up to the tolerance.
//!
//! **What it cannot do.** A grain that rests on the surface under gravity g sinks, at up to g h: nothing but an approach gives an
//! impulse, and nothing takes an overlap back. Grains that fly farther than they are large in a step pass through each other. Both go to 0 with
//! h. The paper says as much: it is for flows of short contacts.

mod change;
mod impulses;

use nalgebra::Vector3;

pub use self::change::Change;
use self::impulses::Impulses;
use super::stepped::{Crowd, Method, even};
use super::{Broken, Observer};
use crate::scene;

/// Of its radius a grain flies in a step whose length is not given, at the fastest impact of the scene: overlaps with the surface stay below that, and
/// those of grains below twice that.
const PART_OF_RADIUS: f64 = 0.05;

/// Sweeps after which a step has no hope of converging: with a near field each takes the same part off the error, and 200 bring it to 1e-9 even
/// where that part is a tenth; contacts that are found one after the other are a handful.
const MOST_SWEEPS: u32 = 1000;

/// Steps of the phi-method.
#[derive(Clone, Debug)]
pub struct Trapezoidal {
    phi: f64,
    tolerance: f64,
    /// Longest step, s; infinity until there are grains.
    step: f64,
    /// Where the step is not given, the speed of the fastest impact, m/s.
    fastest: Option<f64>,
    /// So many grains have their pull and have been asked for their step; 0 where others have taken their slots.
    known: usize,
    /// Positions at the beginning of the step, m. The velocities of the crowd stay what they were then until the step is over.
    start: Vec<Vector3<f64>>,
    /// Velocities of the iterate, m/s. Its positions are those of the crowd.
    velocity: Vec<Vector3<f64>>,
    /// Accelerations by forces from outside at the beginning of the step and at the iterate, m/s².
    pull: [Vec<Vector3<f64>>; 2],
    impulses: Impulses,
}

impl Trapezoidal {
    /// The scheme for grains that hit each other at up to `fastest` (m/s), which matters only if the settings give no step.
    #[must_use]
    pub fn new(settings: &scene::Trapezoidal, fastest: f64) -> Self {
        let scene::Trapezoidal { step, phi, tolerance } = *settings;
        Self {
            phi,
            tolerance,
            step: step.unwrap_or(f64::INFINITY),
            fastest: step.is_none().then_some(fastest),
            known: 0,
            start: Vec::new(),
            velocity: Vec::new(),
            pull: [Vec::new(), Vec::new()],
            impulses: Impulses::default(),
        }
    }

    /// Takes note of grains that have come or have new slots.
    fn take_in(&mut self, crowd: &mut Crowd) -> Result<(), Broken> {
        if self.known == crowd.len() {
            return Ok(());
        }
        if let Some(fastest) = self.fastest {
            let crossing = crowd.flights.iter().map(|flight| PART_OF_RADIUS * flight.radius / fastest);
            self.step = crossing.fold(self.step, f64::min);
        }
        self.known = crowd.len();
        self.velocity.resize(self.known, Vector3::zeros());
        self.impulses.resize(self.known);
        self.pull_at_start(crowd)
    }

    fn pull_at_start(&mut self, crowd: &mut Crowd) -> Result<(), Broken> {
        let [start, end] = &mut self.pull;
        crowd.pull(start)?;
        end.clone_from(start);
        Ok(())
    }

    /// The next iterate of a grain by (42) and (44).
    #[inline]
    fn place(&mut self, crowd: &mut Crowd, slot: usize, step: f64) {
        let flight = &mut crowd.flights[slot];
        let [start, end] = &self.pull;
        let pull = start[slot] + (end[slot] - start[slot]) * self.phi;
        let velocity = flight.velocity + self.impulses.jump(slot) + pull * step;
        // Not phi v + (1 - phi) v(0), whose rounding a free flight would feel.
        flight.position = self.start[slot] + (flight.velocity + (velocity - flight.velocity) * self.phi) * step;
        self.velocity[slot] = velocity;
    }

    /// The next iterate of all grains, and how it differs from the last one.
    fn sweep(&mut self, crowd: &mut Crowd, step: f64) -> Change {
        let mut change = Change::default();
        for slot in 0..crowd.len() {
            let before = (crowd.flights[slot].position, self.velocity[slot]);
            self.place(crowd, slot, step);
            let flight = &crowd.flights[slot];
            change
                .note([before.0, flight.position, self.start[slot]], [before.1, self.velocity[slot], flight.velocity]);
        }
        change
    }

    /// Iterates to the end of the step, from the first iterate.
    fn iterate(&mut self, crowd: &mut Crowd, step: f64, observer: &mut impl Observer) -> Result<(), Broken> {
        for _ in 0..MOST_SWEEPS {
            let found = self.impulses.find(crowd, step, observer)?;
            if crowd.has_near_field() {
                crowd.pull(&mut self.pull[1])?;
                if self.sweep(crowd, step).is_within(self.tolerance) {
                    return Ok(());
                }
            } else if found {
                for k in 0..self.impulses.touched().len() {
                    self.place(crowd, self.impulses.touched()[k] as usize, step);
                }
            } else {
                return Ok(());
            }
        }
        Err(Broken::Unconverged { time: crowd.time(), iterations: MOST_SWEEPS })
    }

    /// Gives the grains what the step has made of them, and books what forces have done.
    fn finish_step(&mut self, crowd: &mut Crowd, step: f64) {
        let [pull, end] = &mut self.pull;
        if crowd.has_near_field() {
            // Work is impulse times mean velocity, with the impulses of contacts given before.
            for (slot, (pull, end)) in pull.iter_mut().zip(&*end).enumerate() {
                *pull += (end - *pull) * self.phi;
                crowd.flights[slot].velocity = self.velocity[slot] - *pull * (0.5 * step);
            }
        }
        crowd.book(pull, step);
        if crowd.has_near_field() {
            pull.clone_from(end);
        }
        for (flight, velocity) in crowd.flights.iter_mut().zip(&self.velocity) {
            flight.velocity = *velocity;
        }
        self.impulses.finish(crowd);
    }
}

impl Method for Trapezoidal {
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
        self.take_in(crowd)?;
        let step = even(room, self.step);
        self.start.clear();
        self.start.extend(crowd.flights.iter().map(|flight| flight.position));
        let is_explicit = self.phi == 0.0;
        if is_explicit {
            self.impulses.find(crowd, 0.0, observer)?;
        }
        (0..crowd.len()).for_each(|slot| self.place(crowd, slot, step));
        if !is_explicit {
            self.iterate(crowd, step, observer)?;
        }
        self.finish_step(crowd, step);
        if is_explicit && crowd.has_near_field() {
            self.pull_at_start(crowd)?;
        }
        Ok(step)
    }

    fn renumber(&mut self, _crowd: &mut Crowd, _slots: &[u32], _observer: &mut impl Observer) {
        self.known = 0;
    }
}
