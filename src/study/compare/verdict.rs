//! What a comparison comes to: the time that each scheme takes for a given error.

use super::{Comparison, Curve, Entry, Scores};

/// Who is how fast at one error.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The error.
    pub error: f64,
    /// Number of the curve, and the time of the processor that it takes (s), the fastest first; only those that get there.
    pub costs: Vec<(usize, f64)>,
}

impl Comparison {
    /// The errors that some runs reach and others do not: powers of ten from the worst to the best, none of them below the
    /// floor or above 1.
    #[must_use]
    pub fn levels(&self) -> Vec<Level> {
        let scores = || self.curves.iter().flat_map(Curve::done).map(|(_, scores)| scores);
        let worst = scores().map(|scores| scores.error).fold(0.0, f64::max);
        // What is exact gets everywhere: the errors of the others say how far it is worth going.
        let best =
            scores().map(|scores| scores.error.max(scores.floor)).filter(|&error| error > 0.0).fold(worst, f64::min);
        if worst <= 0.0 {
            return Vec::new();
        }
        let powers = best.log10().ceil() as i32..=worst.min(1.0).log10().floor() as i32;
        powers.rev().map(|power| self.level(10.0_f64.powi(power))).filter(|level| self.compares(level)).collect()
    }

    /// Whether a level is reached by more than one scheme.
    fn compares(&self, level: &Level) -> bool {
        let schemes: Vec<_> = level.costs.iter().map(|cost| self.curves[cost.0].scheme).collect();
        schemes.windows(2).any(|pair| pair[0] != pair[1])
    }

    fn level(&self, error: f64) -> Level {
        let costs = self.curves.iter().enumerate().filter_map(|(number, curve)| Some((number, curve.cost_of(error)?)));
        let mut costs: Vec<_> = costs.collect();
        costs.sort_by(|a, b| a.1.total_cmp(&b.1));
        Level { error, costs }
    }
}

impl Curve {
    /// The scheme, with the setting that is varied where it has one.
    #[must_use]
    pub fn name(&self) -> String {
        if self.setting.is_empty() { self.scheme.to_owned() } else { format!("{} ({})", self.scheme, self.setting) }
    }

    /// The entries that came to their end.
    pub fn done(&self) -> impl Iterator<Item = (&Entry, &Scores)> {
        self.entries.iter().filter_map(|entry| Some((entry, entry.result.as_ref().ok()?)))
    }

    /// Time of the processor (s) for an error: between two settings as if both were powers of the setting; none where the error stays larger.
    #[must_use]
    pub fn cost_of(&self, error: f64) -> Option<f64> {
        let point = |(entry, scores): (&Entry, &Scores)| Some((entry.cpu_seconds?, scores.error.max(scores.floor)));
        let points: Vec<_> = self.done().filter_map(point).collect();
        let reaches = points.iter().position(|&(_, reached)| reached <= error)?;
        let (cost, reached) = points[reaches];
        match reaches.checked_sub(1).map(|before| points[before]) {
            Some((cheaper, larger)) if reached > 0.0 => {
                let part = (larger / error).ln() / (larger / reached).ln();
                Some((cheaper.ln() + part * (cost / cheaper).ln()).exp())
            }
            _ => Some(cost),
        }
    }

    /// Observed order: the power p in error ~ setting^p that fits the runs best whose errors are above the floor and below 1, beyond which
    /// errors no longer grow. None where fewer than two are left.
    #[must_use]
    pub fn order(&self) -> Option<f64> {
        let telling = self.done().filter(|(_, scores)| !scores.is_noise() && scores.error < 1.0);
        let points: Vec<_> =
            telling.filter_map(|(entry, scores)| Some((entry.value?.ln(), scores.error.ln()))).collect();
        slope(&points)
    }
}

/// Slope of the straight line through some points, by least squares; none through fewer than two.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let spread = points.iter().map(|point| (point.0 - x).powi(2)).sum::<f64>();
    (points.len() > 1).then(|| points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum::<f64>() / spread)
}

#[cfg(test)]
mod tests {
    use super::super::Regime;
    use super::super::fake::{FLOOR, comparison};
    use super::*;

    #[test]
    fn the_time_for_an_error_lies_between_those_of_two_settings() {
        let comparison = comparison(Regime::Statistical);
        let [exact, steps, moduli, refused] = comparison.curves.as_slice() else { panic!("four curves") };
        // Time 1e-3 / step, error = step.
        for error in [0.4, 0.3, 0.1, 0.03, 0.005] {
            approx::assert_relative_eq!(
                steps.cost_of(error).expect("it gets there"),
                1e-3 / error,
                max_relative = 1e-12
            );
        }
        assert_eq!(steps.cost_of(1.0), Some(2.5e-3), "the coarsest is better than that");
        assert_eq!([steps.cost_of(1e-3), moduli.cost_of(0.01), refused.cost_of(1.0)], [None; 3]);
        assert_eq!([exact.cost_of(0.1), exact.cost_of(FLOOR), exact.cost_of(1e-3)], [Some(0.01), Some(0.01), None]);
    }

    #[test]
    fn levels_are_powers_of_ten_that_several_schemes_reach() {
        let levels = comparison(Regime::Statistical).levels();
        let told: Vec<_> =
            levels.iter().map(|level| (level.error, level.costs.iter().map(|cost| cost.0).collect())).collect();
        assert_eq!(told, [(0.1, vec![0, 1, 2]), (0.01, vec![0, 1])]);
    }

    #[test]
    fn the_observed_order_leaves_out_what_is_below_the_floor() {
        let mut comparison = comparison(Regime::Pointwise);
        approx::assert_relative_eq!(comparison.curves[1].order().expect("a power law"), 1.0, max_relative = 1e-12);
        assert_eq!(comparison.curves[0].order(), None);
        let Ok(scores) = &mut comparison.curves[1].entries[3].result else { panic!("it has a result") };
        scores.error = 0.5 * FLOOR;
        approx::assert_relative_eq!(comparison.curves[1].order().expect("a power law"), 1.0, max_relative = 1e-12);
        assert_eq!(slope(&[(0.0, 1.0), (1.0, 2.5), (2.0, 5.0)]), Some(2.0));
        assert_eq!(slope(&[(0.0, 1.0)]), None);
    }
}
