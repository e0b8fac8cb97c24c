//! Means, and how sure they are.

use std::fmt;

use crate::sum::Sum;

/// A number and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The best guess.
    pub value: f64,
    /// Its standard error: two out of three guesses lie that close to the truth. 0 for what is exact.
    pub error: f64,
}

impl Estimate {
    /// What is known exactly.
    #[must_use]
    pub fn exact(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    /// Mean of independent samples, with its standard error √(Σ (x - mean)² / (n (n - 1))).
    ///
    /// Arbelaez et al. (2009), eq. (53), divide by n instead of √(n (n - 1)), which is too small for few samples.
    #[must_use]
    pub fn mean(samples: &[f64]) -> Self {
        let count = samples.len() as f64;
        let value = samples.iter().copied().collect::<Sum>().value() / count;
        let squares = samples.iter().map(|sample| (sample - value).powi(2)).collect::<Sum>().value();
        let error = if samples.len() > 1 { (squares / (count * (count - 1.0))).sqrt() } else { f64::INFINITY };
        Self { value, error }
    }

    /// Mean of a series whose neighbours depend on each other, with the standard error of the means of so many batches of it: right where
    /// a batch is longer than the memory of the series. What is left over at the start is dropped.
    #[must_use]
    pub fn batch_mean(series: &[f64], batches: usize) -> Self {
        let length = series.len() / batches;
        let means = series[series.len() - length * batches..].chunks_exact(length);
        Self::mean(&means.map(|batch| Self::mean(batch).value).collect::<Vec<_>>())
    }

    /// Ratio of the means of two quantities that were measured in the same runs: what the runs have in common cancels in its error
    /// (the deviations of x - ratio y, over the mean of y).
    #[must_use]
    pub fn ratio(pairs: &[(f64, f64)]) -> Self {
        let mean = |of: fn(&(f64, f64)) -> f64| Self::mean(&pairs.iter().map(of).collect::<Vec<_>>()).value;
        let (x, y) = (mean(|pair| pair.0), mean(|pair| pair.1));
        let value = x / y;
        let deviations: Vec<f64> = pairs.iter().map(|pair| (pair.0 - value * pair.1) / y).collect();
        Self { value, error: Self::mean(&deviations).error }
    }

    /// Any number that is computed from batches, as the jackknife knows it (Efron 1982): `of` gives it from all batches (`None`) and from all but
    /// one, and the error is √((n - 1)/n Σ (x - mean)²) over what it gives without each. For a mean that is the error of
    /// [`mean`](Self::mean); it also holds for ratios and moments, and correlations within a batch are in it.
    ///
    /// ```
    /// use impinge::estimate::Estimate;
    ///
    /// let batches = [1.0, 2.0, 3.0, 6.0_f64];
    /// let mean = |without: Option<usize>| {
    ///     let kept: Vec<f64> = (0..4).filter(|&i| Some(i) != without).map(|i| batches[i]).collect();
    ///     kept.iter().sum::<f64>() / kept.len() as f64
    /// };
    /// let [jackknife, plain] = [Estimate::jackknife(4, mean), Estimate::mean(&batches)];
    /// assert!((jackknife.error - plain.error).abs() < 1e-15 && jackknife.value == plain.value);
    /// ```
    #[must_use]
    pub fn jackknife(batches: usize, of: impl Fn(Option<usize>) -> f64) -> Self {
        let without: Vec<f64> = (0..batches).map(|batch| of(Some(batch))).collect();
        let count = batches as f64;
        let error = if batches > 1 { Self::mean(&without).error * (count - 1.0) } else { f64::INFINITY };
        Self { value: of(None), error }
    }

    /// Its natural logarithm.
    #[must_use]
    pub fn ln(self) -> Self {
        Self { value: self.value.ln(), error: self.error / self.value.abs() }
    }

    /// How far two independent estimates are apart, in standard errors of their difference.
    #[must_use]
    pub fn deviation(self, other: Self) -> f64 {
        (self.value - other.value).abs() / self.error.hypot(other.error)
    }
}

impl std::ops::Add<f64> for Estimate {
    type Output = Self;

    fn add(self, shift: f64) -> Self {
        Self { value: self.value + shift, ..self }
    }
}

impl std::ops::Mul<f64> for Estimate {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, error: self.error * factor.abs() }
    }
}

/// Two digits of the error, and the value as far as these go.
impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !(self.error.is_finite() && self.error > 0.0) {
            return write!(f, "{:.4}", self.value);
        }
        let decimals = (1 - self.error.log10().floor() as i32).max(0) as usize;
        write!(f, "{:.decimals$} ± {:.decimals$}", self.value, self.error)
    }
}

/// The straight line through the origin that fits best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// The slope.
    pub slope: Estimate,
    /// Σ (deviation / error)² over the number of points less one: about 1 where a straight line is what the points show.
    pub chi_squared: f64,
}

impl Slope {
    /// Fits y = slope x to points (x, y), each weighed by its error.
    #[must_use]
    pub fn through_origin(points: &[(f64, Estimate)]) -> Self {
        let sum = |of: &dyn Fn(f64, Estimate) -> f64| {
            points.iter().map(|&(x, y)| of(x, y) / y.error.powi(2)).collect::<Sum>().value()
        };
        let squares = sum(&|x, _| x * x);
        let slope = sum(&|x, y| x * y.value) / squares;
        let rest = sum(&|x, y| (y.value - slope * x).powi(2));
        Self {
            slope: Estimate { value: slope, error: squares.sqrt().recip() },
            chi_squared: rest / (points.len() as f64 - 1.0),
        }
    }
}

/// Where |y| first rises through `level`: between the first point that reaches it and the one before, by a straight line over ln x.
///
/// `points` are in the order of x > 0. None where |y| reaches the level at the first point already, or nowhere.
#[must_use]
pub fn crossing(points: &[(f64, Estimate)], level: f64) -> Option<Estimate> {
    let reached = points.iter().position(|(_, y)| y.value.abs() >= level)?;
    let [(x0, y0), (x1, y1)] = [*points.get(reached.checked_sub(1)?)?, points[reached]];
    let [low, high] = [y0, y1].map(|y| y.value.abs());
    let part = (level - low) / (high - low);
    let x = x0 * (x1 / x0).powf(part);
    // The line is uncertain by the errors of both ends, as near as it is to each.
    let error = (y0.error * (1.0 - part)).hypot(y1.error * part) / (high - low);
    Some(Estimate { value: x, error: x * (x1 / x0).ln() * error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_and_its_standard_error() {
        let mean = Estimate::mean(&[1.0, 2.0, 3.0, 6.0]);
        assert_eq!(mean.value, 3.0);
        // Σ dev² = 14
        approx::assert_relative_eq!(mean.error, (14.0_f64 / 12.0).sqrt(), max_relative = 1e-15);
        assert_eq!(Estimate::mean(&[5.0]).error, f64::INFINITY, "one sample says nothing of its error");
        assert_eq!([mean, Estimate::exact(0.25)].map(|estimate| estimate.to_string()), ["3.0 ± 1.1", "0.2500"]);
        assert_eq!(Estimate { value: 1234.6, error: 123.0 }.to_string(), "1235 ± 123");
    }

    #[test]
    fn batches_see_through_a_series_that_repeats_itself() {
        // Each number ten times: as many independent ones as there are batches.
        let numbers = [1.0, 4.0, 2.0, 3.0];
        let series: Vec<f64> = numbers.iter().flat_map(|&number| [number; 10]).collect();
        assert_eq!(Estimate::batch_mean(&series, 4), Estimate::mean(&numbers));
        assert!(Estimate::mean(&series).error < 0.5 * Estimate::mean(&numbers).error);
    }

    #[test]
    fn a_ratio_of_what_goes_together_is_sharp() {
        let together = Estimate::ratio(&[(1.0, 2.0), (2.0, 4.0), (5.0, 10.0)]);
        assert_eq!((together.value, together.error), (0.5, 0.0));
        let apart = Estimate::ratio(&[(1.0, 10.0), (2.0, 4.0), (5.0, 2.0)]);
        assert!(apart.error > 0.2, "{apart}");
    }

    #[test]
    fn a_line_through_the_origin() {
        let at = |x, value, error| (x, Estimate { value, error });
        let line = Slope::through_origin(&[at(1.0, -2.0, 0.1), at(2.0, -4.0, 0.1), at(4.0, -8.0, 0.1)]);
        assert_eq!((line.slope.value, line.chi_squared), (-2.0, 0.0));
        approx::assert_relative_eq!(line.slope.error, 0.1 / 21.0_f64.sqrt(), max_relative = 1e-14);
        let bent = Slope::through_origin(&[at(1.0, -2.0, 0.1), at(2.0, -4.0, 0.1), at(4.0, -7.0, 0.1)]);
        assert!(bent.chi_squared > 4.0, "{bent:?}");
    }

    #[test]
    fn a_level_is_crossed_where_the_line_says() {
        let at = |x, value| (x, Estimate { value, error: 0.001 });
        let points = [at(1.0, 0.002), at(10.0, -0.01), at(100.0, -0.03), at(1000.0, 0.5), at(10_000.0, 0.0)];
        let crossed = crossing(&points, 0.02).expect("it is");
        approx::assert_relative_eq!(crossed.value, 10.0 * 10.0_f64.sqrt(), max_relative = 1e-13);
        approx::assert_relative_eq!(
            crossed.error,
            crossed.value * 10.0_f64.ln() * 0.5e-3 * 2.0_f64.sqrt() / 0.02,
            max_relative = 1e-13
        );
        assert_eq!((crossing(&points, 0.001), crossing(&points, 0.6)), (None, None));
    }
}
