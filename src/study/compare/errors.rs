//! How far a run is from the right answer.

use impinge_events::Domain;

use super::measure::{Measured, Quantities};

/// How far the grains of a run are from those of another at the end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distance {
    /// Largest difference in position of any grain, over the mean radius.
    pub position: f64,
    /// Largest difference in velocity of any grain, over the largest initial speed.
    pub velocity: f64,
}

impl Distance {
    /// The larger one of each.
    pub(super) fn max(self, other: Self) -> Self {
        Self { position: self.position.max(other.position), velocity: self.velocity.max(other.velocity) }
    }

    /// Both `factor` times.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { position: self.position * factor, velocity: self.velocity * factor }
    }

    /// Of the grains that both runs have. A grain that left the domain is taken where it would be had it flown straight on, so that
    /// leaving a moment early is a small error.
    pub(super) fn between(run: &Measured, exact: &Measured, domain: &Domain) -> Self {
        let pairs = run.ends.iter().zip(&exact.ends).filter_map(|(run, exact)| Some((run.as_ref()?, exact.as_ref()?)));
        let largest = pairs.fold(Self::default(), |largest, (run, exact)| {
            let position = domain.nearest(run.position - exact.position).norm();
            largest.max(Self { position, velocity: (run.velocity - exact.velocity).norm() })
        });
        Self { position: largest.position / exact.radius, velocity: largest.velocity / exact.speed_scale() }
    }
}

/// Grains that are there in one run and not in the other, or are behind the surface in this one and not in the other.
pub(super) fn lost(run: &Measured, exact: &Measured) -> u64 {
    let there = |measured: &Measured| measured.ends.iter().flatten().count() as u64;
    there(run).abs_diff(there(exact)) + run.behind.saturating_sub(exact.behind)
}

/// The deviation of `value` from a `reference` over the reference; 1 where there should be nothing and is something.
pub(super) fn relative(value: f64, reference: f64) -> f64 {
    match reference {
        _ if value == reference => 0.0,
        0.0 => value.signum(),
        _ => (value - reference) / reference.abs(),
    }
}

/// Root mean square over the quantities that `counts` says take part.
pub(super) fn root_mean_square(values: &Quantities, counts: &Quantities<bool>) -> f64 {
    let taking_part = values.iter().zip(counts).filter(|(_, counts)| **counts);
    let (squares, number) = taking_part.fold((0.0, 0.0), |(sum, n), (value, _)| (sum + value * value, n + 1.0));
    if number > 0.0 { f64::sqrt(squares / number) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::measure::End;
    use super::*;

    fn measured(ends: &[Option<[f64; 2]>]) -> Measured {
        let end = |[x, u]: [f64; 2]| End { position: Vector3::x() * x, velocity: Vector3::x() * u };
        Measured {
            quantities: [0.0; 7],
            ends: ends.iter().map(|of| of.map(end)).collect(),
            behind: 0,
            overlap: 0.0,
            energy_residual: 0.0,
            radius: 0.5,
            speed: 10.0,
        }
    }

    #[test]
    fn the_grain_that_is_furthest_off_is_the_error() {
        let exact = measured(&[Some([0.0, 1.0]), Some([4.0, 2.0]), None]);
        let run = measured(&[Some([0.25, 1.0]), Some([4.0, 5.0]), Some([9.0, 9.0])]);
        let distance = Distance::between(&run, &exact, &Domain::unbounded());
        assert_eq!(distance, Distance { position: 0.5, velocity: 0.3 });
        assert_eq!(Distance::between(&exact, &exact, &Domain::unbounded()), Distance::default());
        assert_eq!((lost(&run, &exact), lost(&exact, &exact)), (1, 0));
    }

    #[test]
    fn across_a_period_grains_are_near() {
        let domain = Domain { min: Vector3::zeros(), max: Vector3::repeat(10.0), periodic: true, planar: false };
        let [left, right] = [0.25, 9.75].map(|x| measured(&[Some([x, 0.0])]));
        assert_eq!(Distance::between(&left, &right, &domain).position, 1.0);
    }

    #[test]
    fn a_grain_behind_the_surface_is_lost_unless_it_belongs_there() {
        let exact = measured(&[Some([0.0, 1.0])]);
        let through = Measured { behind: 1, ..exact.clone() };
        assert_eq!((lost(&through, &exact), lost(&through, &through)), (1, 0));
    }

    #[test]
    fn deviations_are_relative_and_something_from_nothing_is_all_wrong() {
        assert_eq!([relative(9.0, 10.0), relative(0.0, 0.0), relative(3.0, 0.0)], [-0.1, 0.0, 1.0]);
        let counts = [true, true, false, false, false, false, false];
        assert_eq!(root_mean_square(&[3.0, -4.0, 9.0, 9.0, 9.0, 9.0, 9.0], &counts), 12.5_f64.sqrt());
        assert_eq!(root_mean_square(&[1.0; 7], &[false; 7]), 0.0);
    }
}
