//! The fixed-point iteration (34), and how its convergence sets the length of steps: equation (35).

use impinge_events::Flight;
use nalgebra::Vector3;

use crate::scene;
use crate::scheme::Broken;
use crate::scheme::stepped::Crowd;

/// p: the contraction of the iteration is proportional to Δt^p.
const P: f64 = 2.0;
/// How much shorter a step is that is tried again: at the most, where the iterates are no numbers, and at the least, where the error was all but within
/// the tolerance.
const SHORTER: [f64; 2] = [0.1, 0.9];
/// Changes below this part of the displacement are rounding and tell only that the step may be longer.
const ROUNDING: f64 = 1e-13;

/// The iteration of a step.
#[derive(Clone, Debug)]
pub(super) struct Iteration {
    /// The grains at r^L, with their velocities after the impulses of the step.
    before: Vec<Flight>,
    /// Acceleration of each grain at r^L, m/s²; empty where no force acts.
    first_pull: Vec<Vector3<f64>>,
    /// The same at the latest iterate.
    pull: Vec<Vector3<f64>>,
    /// From r^L to the latest iterate, m: in differences of these there is no rounding of positions.
    moves: Vec<Vector3<f64>>,
    /// Step that will take k_d iterations, times the safety factor, s: without it every other step would miss the tolerance by a hair.
    expected: f64,
    count: u64,
}

impl Default for Iteration {
    fn default() -> Self {
        let (before, moves) = (Vec::new(), Vec::new());
        let (first_pull, pull) = (Vec::new(), Vec::new());
        Self { before, first_pull, pull, moves, expected: f64::INFINITY, count: 0 }
    }
}

impl Iteration {
    /// Length that the next step should have (s), as far as the iteration is concerned.
    pub(super) fn expected(&self) -> f64 {
        self.expected
    }

    /// Iterations so far.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Begins a step, and gives the grains the velocities that they would fly with in a step of length `offered` (s).
    pub(super) fn begin(&mut self, crowd: &mut Crowd, offered: f64) -> Result<(), Broken> {
        self.before.clear();
        self.first_pull.clear();
        if !crowd.has_forces() {
            return Ok(());
        }
        crowd.pull(&mut self.first_pull)?;
        self.before.extend_from_slice(&crowd.flights);
        for (flight, pull) in crowd.flights.iter_mut().zip(&self.first_pull) {
            flight.velocity += pull * offered;
        }
        Ok(())
    }

    /// Iterates with this step (s): nothing where that converges, or else a shorter step to try.
    pub(super) fn shorter_than(&mut self, crowd: &mut Crowd, settings: &scene::FixedPoint, step: f64) -> Option<f64> {
        self.pull.clone_from(&self.first_pull);
        if !crowd.has_near_field() {
            return None;
        }
        self.moves.clear();
        self.moves.resize(self.before.len(), Vector3::zeros());
        self.advance(crowd, step);
        let (mut error, mut factor) = (1.0, SHORTER[0]);
        for k in 1..=settings.iterations {
            self.count += 1;
            let Ok(()) = crowd.pull(&mut self.pull) else { return Some(SHORTER[0] * step) };
            let last = std::mem::replace(&mut error, self.advance(crowd, step));
            if error.is_nan() {
                return Some(SHORTER[0] * step);
            }
            factor = change_of_step(settings, error.max(ROUNDING), k);
            if error <= settings.tolerance {
                let longer = settings.safety * factor * step;
                self.expected = if error > ROUNDING { longer } else { longer.max(self.expected) };
                return None;
            }
            // What does not contract will not do so later.
            if error >= last {
                break;
            }
        }
        Some(step * factor.clamp(SHORTER[0], SHORTER[1]))
    }

    /// Equation (34): the next iterate. Gives how much it changed, over how far it is from r^L.
    fn advance(&mut self, crowd: &mut Crowd, step: f64) -> f64 {
        let (mut changed, mut moved) = (0.0, 0.0);
        let pulled = self.before.iter().zip(&self.pull);
        for ((flight, (before, pull)), last) in crowd.flights.iter_mut().zip(pulled).zip(&mut self.moves) {
            let next = (before.velocity + pull * step) * step;
            changed += (next - *last).norm();
            moved += next.norm();
            *last = next;
            flight.position = before.position + next;
        }
        // Grains that rest where no force acts have converged.
        if changed == 0.0 { 0.0 } else { changed / moved }
    }

    /// Leaves the grains at the end of a step of this length (s), and books what forces gave.
    pub(super) fn accept(&mut self, crowd: &mut Crowd, step: f64) {
        if self.pull.is_empty() {
            for flight in &mut crowd.flights {
                flight.position += flight.velocity * step;
            }
            return;
        }
        // Work is done at the mean of the velocities before and after.
        self.set(crowd, |before, pull| (before.position, before.velocity + pull * (0.5 * step)));
        crowd.book(&self.pull, step);
        self.set(crowd, |before, pull| {
            let velocity = before.velocity + pull * step;
            (before.position + velocity * step, velocity)
        });
    }

    fn set(&self, crowd: &mut Crowd, state: impl Fn(&Flight, &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>)) {
        for ((flight, before), pull) in crowd.flights.iter_mut().zip(&self.before).zip(&self.pull) {
            (flight.position, flight.velocity) = state(before, pull);
        }
    }
}

/// Equation (35) with e^0 = 1: by what a step that left the relative change `error` after `k` iterations should change so that k_d of them meet
/// the tolerance.
///
/// As e^k = (c Δt^p)^k, it is TOL^(1/(p k_d)) / (e^k)^(1/(p k)). Step 3(b) of the paper's list prints k for k_d; a step that converges in fewer than k_d
/// iterations would then hardly grow.
pub(super) fn change_of_step(settings: &scene::FixedPoint, error: f64, k: u32) -> f64 {
    let root = |value: f64, k: u32| value.powf(1.0 / (P * f64::from(k)));
    root(settings.tolerance, settings.iterations) / root(error, k)
}
