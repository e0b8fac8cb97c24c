//! The staggered scheme of Arbelaez, Zohdi & Dornfeld (2009), section 4: implicit Euler steps solved by fixed-point iteration, shortened at two
//! levels, by how the iteration converges and so that no collision is passed over.
//!
//! A step from time level L, with positions r^L and velocities v^L, goes like this:
//!
//! 1. Grains that overlap and approach, each other or the surface, get the impulses of the shared laws, all of them from v^L and added. Over the step
//!    they act as the average forces and moments J / Δt of (13), (20), (27), (32) and (33), so positions see all of an impulse: it is exact in velocity
//!    and spin, and it acts where the grains were found, up to an overlap of gamma radii late (`contacts.rs`).
//! 2. The step is as long as (35) expected and no longer than (40) and (42) allow for any two things that are near (`collisions.rs`).
//! 3. Equation (34) is iterated, r^(k+1) = r^L + Δt v^L + Δt² Ψ(r^k) / m, until what it changes is less than TOL of what it moves. If that takes more
//!    than k_d iterations, the step is tried again with the length that (35) gives; so is the next one (`iteration.rs`).
//!
//! What the paper prints and what is done where it cannot be done, or not be meant:
//!
//! * **(34), contacts.** With Ψ^c(r^(L+1,k)), contacts found anew in each iterate, there is no fixed point where a contact begins: the impulse parts the
//!   grains, so the next iterate has no contact and lets them overlap again, however short the step. Contacts are those at r^L and hold for the
//!   step, as (33) says of the moments; what overlaps at the end of a step collides in the next one. That is what the overlap of (40) and (42) is for.
//! * **(10), (19), (26), (31), external impulses.** They act for the time δt of a contact, which the paper takes to be much shorter than a step and
//!   never gives: here it is none. The force itself acts for the whole step in (1) and would be counted twice, as (11) is printed.
//! * **(33), moments.** Averaged over Δt like the forces; averaged over δt, as the text has it, spins would be Δt / δt too large.
//! * **Step 3(a).** Changes are compared with the displacement Σ ‖r^(k+1) − r^L‖. Printed is Σ ‖r‖, which depends on the origin: a
//!   jet far from it would converge at once. Iterates start from r^L, so e^0 = 1.
//! * **Step 3(b).** Printed is (TOL / e^0)^(1/(p k)); (35) has k_d and is right.
//! * **Steps 4 and 5.** A step is also accepted at k = k_d, time goes on by the step that converged and not by the next one, and an iteration that
//!   does not contract is given up at once.
//! * **(35).** The length for the next step is multiplied by eta, or every other step would fail by a hair.
//! * **(39), (41).** Printed are the root of a quadratic divided by ‖r_ii‖², and the time at which the centre of a grain reaches a face; here they are the
//!   contact times of the event-driven scheme, edges and corners included. What overlaps already and approaches meets at once.
//! * **(40), (42), velocities.** Predictions take the velocities that the step will fly with, impulses and forces included, and not v^L.
//! * **Binning.** Pairs beyond the reach of the lists are not looked at; a step is no longer than they need to close their gap.
//!
//! What stays, as it is the scheme: impulses that are found at the same time are added, so a grain between two others may gain or lose energy,
//! as far as to 7/4 or none of it; the residual of the ledger tells how much. Steps are of first order. All grains take the step
//! that the nearest collision allows. Implicit Euler damps what oscillates. And what should rest under a force sinks, by Δt g / (1 + e) a second.

mod collisions;
mod contacts;
mod iteration;

use self::collisions::{Lookout, Speeds};
use self::contacts::Contacts;
use self::iteration::Iteration;
use super::stepped::{Crowd, Method, even};
use super::{Broken, Observer};
use crate::scene;

/// How much of the horizon is kept where steps are much shorter: after a contact they soon are as long as before.
const HORIZON_KEPT: f64 = 0.95;

/// How steps are taken, and what is kept from one to the next.
#[derive(Clone, Debug)]
pub struct FixedPoint {
    settings: scene::FixedPoint,
    contacts: Contacts,
    lookout: Lookout,
    iteration: Iteration,
    /// How far ahead collisions are looked for, s; nothing before the first step.
    horizon: Option<f64>,
}

impl FixedPoint {
    /// A scheme with these settings.
    #[must_use]
    pub fn new(settings: scene::FixedPoint) -> Self {
        Self {
            settings,
            contacts: Contacts::default(),
            lookout: Lookout::default(),
            iteration: Iteration::default(),
            horizon: None,
        }
    }

    /// Iterations so far, those of steps that were tried again included; without a near field there are none.
    #[must_use]
    pub fn iterations(&self) -> u64 {
        self.iteration.count()
    }
}

impl Method for FixedPoint {
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
        let Self { settings, contacts, lookout, iteration, horizon } = self;
        let speeds = Speeds::of(&crowd.flights);
        // At first as far as grains fly in the time of a radius; with no grain or no speed this is no number, or no bound.
        let horizon = horizon.get_or_insert((speeds.largest_radius / speeds.fastest).min(room));
        let longest = settings.largest_step.unwrap_or(f64::INFINITY).min(iteration.expected()).min(*horizon);
        let offered = even(room, longest);

        lookout.look(crowd, settings, &speeds, offered);
        contacts.act(crowd, observer)?;
        iteration.begin(crowd, offered)?;
        let mut step = lookout.longest_step(crowd, settings, offered);
        *horizon = (2.0 * step).max(HORIZON_KEPT * *horizon);
        while let Some(shorter) = iteration.shorter_than(crowd, settings, step) {
            step = shorter;
        }
        iteration.accept(crowd, step);
        Ok(step)
    }
}

#[cfg(test)]
mod tests;
