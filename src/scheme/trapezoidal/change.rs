//! How far an iteration still moves: eq. (45), guarded.

use nalgebra::Vector3;

/// Change that rounding alone makes in a sum of so many velocities or positions, relative to it: below it an iteration can do no better.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// By how much an iterate differs from the one before, over all grains.
///
/// (45) divides the change of each grain by what it has changed by since the initial guess, which is 0 / 0 for every grain that flies freely; and it
/// adds m/s to m. Here sums over all grains are compared, those of velocities and those of positions apart, and none is divided by.
/// The initial guess is the state at the beginning of the step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    position: Sums,
    velocity: Sums,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    /// Σ |iterate - iterate before|
    last: f64,
    /// Σ |iterate - initial guess|
    total: f64,
    /// Σ |iterate|
    size: f64,
}

impl Sums {
    fn note(&mut self, [before, now, guess]: [Vector3<f64>; 3]) {
        self.last += (now - before).norm();
        self.total += (now - guess).norm();
        self.size += now.norm();
    }

    fn is_within(&self, tolerance: f64) -> bool {
        self.last <= tolerance * self.total + ROUNDING * self.size
    }
}

impl Change {
    /// Adds a grain with its iterate before, its iterate now, and the initial guess: positions (m) and velocities (m/s).
    #[inline]
    pub fn note(&mut self, positions: [Vector3<f64>; 3], velocities: [Vector3<f64>; 3]) {
        self.position.note(positions);
        self.velocity.note(velocities);
    }

    /// Whether the change of both positions and velocities is at most `tolerance` of what they have changed by since the initial guess, or rounding.
    #[must_use]
    pub fn is_within(&self, tolerance: f64) -> bool {
        self.position.is_within(tolerance) && self.velocity.is_within(tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (45) as printed, for grains with positions and velocities [before, now, guess].
    fn as_printed(grains: &[[[Vector3<f64>; 3]; 2]]) -> f64 {
        let apart = |grain: &[[Vector3<f64>; 3]; 2], a: usize, b: usize| -> f64 {
            grain.iter().map(|of| (of[a] - of[b]).norm()).sum()
        };
        grains.iter().map(|grain| apart(grain, 1, 0) / apart(grain, 1, 2)).sum()
    }

    fn along_x(values: [f64; 3]) -> [Vector3<f64>; 3] {
        values.map(|value| Vector3::x() * value)
    }

    /// PHYSICS 2.22. A grain that a guess of free flight has got right makes the printed measure no number, and no number is not above a tolerance: the
    /// iteration of all others ends.
    #[test]
    fn a_free_grain_does_not_end_the_iteration_of_the_others() {
        let free = [along_x([3.0; 3]), along_x([2.0; 3])];
        let moving = [along_x([1.0, 1.5, 0.0]), along_x([0.5, 1.0, 0.0])];
        let printed = as_printed(&[free, moving]);
        assert!(printed.is_nan());
        let mut change = Change::default();
        for [positions, velocities] in [free, moving] {
            change.note(positions, velocities);
        }
        assert!(!change.is_within(0.33));
        // Half of 1 m/s, a third of 1.5 m.
        assert!(change.is_within(0.5));
    }

    /// Were m/s and m added up, a fast stream would hide that positions have not settled, and units of length would decide.
    #[test]
    fn positions_and_velocities_settle_each_for_itself() {
        let mut change = Change::default();
        change.note(along_x([1e-3, 2e-3, 0.0]), along_x([80.0, 80.0, 0.0]));
        assert!(!change.is_within(0.1));
        assert!(as_printed(&[[along_x([1e-3, 2e-3, 0.0]), along_x([80.0, 80.0, 0.0])]]) < 1e-4);
    }

    #[test]
    fn grains_that_have_not_moved_at_all_have_settled() {
        let mut change = Change::default();
        change.note(along_x([1.0; 3]), along_x([0.0; 3]));
        assert!(change.is_within(1e-16));
    }

    #[test]
    fn what_is_no_number_has_not_settled() {
        let mut change = Change::default();
        change.note(along_x([1.0, f64::NAN, 0.0]), along_x([0.0; 3]));
        assert!(!change.is_within(1.0));
    }
}
