//! What an ensemble says of one number.

use crate::observe::Sum;

/// Mean and spread of some values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// How many values there are.
    pub count: u32,
    /// Their mean.
    pub mean: f64,
    /// Standard deviation of one value, estimated from the sample (over n - 1); 0 of a single value.
    pub deviation: f64,
}

impl Statistics {
    /// Of these values; all zero where there are none.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        if values.is_empty() {
            return Self::default();
        }
        let mean = values.iter().copied().collect::<Sum>().value() / n;
        let squares = values.iter().map(|value| (value - mean).powi(2)).collect::<Sum>().value();
        let deviation = if n > 1.0 { (squares / (n - 1.0)).sqrt() } else { 0.0 };
        Self { count: values.len() as u32, mean, deviation }
    }

    /// Standard error of the mean.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.deviation / f64::from(self.count.max(1)).sqrt()
    }

    /// Standard deviation of the difference between this mean and that of `others` further values of the same distribution.
    #[must_use]
    pub fn deviation_from(&self, others: u32) -> f64 {
        self.error().hypot(self.deviation / f64::from(others.max(1)).sqrt())
    }
}

/// The middle one of some values; of an even number the mean of the two in the middle.
#[must_use]
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_deviation_and_error_of_a_known_sample() {
        let known = Statistics::of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]);
        assert_eq!((known.count, known.mean), (8, 5.0));
        approx::assert_relative_eq!(known.deviation, (32.0_f64 / 7.0).sqrt(), max_relative = 1e-15);
        approx::assert_relative_eq!(known.error(), (32.0_f64 / 56.0).sqrt(), max_relative = 1e-15);
        // One more value differs from the mean of eight by its own deviation and their error.
        let one_more = (32.0_f64 / 7.0 * (1.0 + 1.0 / 8.0)).sqrt();
        approx::assert_relative_eq!(known.deviation_from(1), one_more, max_relative = 1e-15);
    }

    #[test]
    fn a_single_value_has_no_spread_and_no_value_no_mean() {
        let one = Statistics::of(&[3.0]);
        assert_eq!((one.mean, one.deviation, one.error()), (3.0, 0.0, 0.0));
        assert_eq!(Statistics::of(&[]), Statistics::default());
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![9.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 9.0, 1.0, 2.0]), Some(3.0));
        assert_eq!(median(Vec::new()), None);
    }
}
