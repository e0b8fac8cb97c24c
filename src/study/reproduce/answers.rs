//! What estimates say about a claim: yes, no, or that their errors are too wide to tell.

use super::Report;
use crate::estimate::Estimate;

/// Estimates that are so many standard errors apart differ.
pub(super) const DEVIATIONS: f64 = 3.0;

/// Whether the first is below the second: none where they are too close for their errors to tell.
pub(super) fn is_below(low: Estimate, high: Estimate) -> Option<bool> {
    (low.deviation(high) > DEVIATIONS).then_some(low.value < high.value)
}

/// Whether all of it holds: one that does not is enough, and one that is not decided leaves the whole undecided.
pub(super) fn all(answers: impl IntoIterator<Item = Option<bool>>) -> Option<bool> {
    let answers: Vec<Option<bool>> = answers.into_iter().collect();
    if answers.contains(&Some(false)) {
        return Some(false);
    }
    (!answers.contains(&None)).then_some(true)
}

/// Whether a series falls from each point to the next.
pub(super) fn falls(series: &[Estimate]) -> Option<bool> {
    all(series.windows(2).map(|pair| is_below(pair[1], pair[0])))
}

/// Whether an estimate is within so much of a value: no where it is outside by more than its error may explain.
pub(super) fn is_within(estimate: Estimate, value: f64, margin: f64) -> Option<bool> {
    let (off, reach) = ((estimate.value - value).abs(), DEVIATIONS * estimate.error);
    if off - reach > margin {
        return Some(false);
    }
    (off + reach <= margin).then_some(true)
}

/// Notes what a claim comes to.
pub(super) fn judge(report: &mut Report, claim: impl Into<String>, measured: impl Into<String>, holds: Option<bool>) {
    match holds {
        Some(agrees) => report.put_to_the_test(claim, measured, agrees),
        None => report.undecided(claim, measured),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(value: f64) -> Estimate {
        Estimate { value, error: 0.1 }
    }

    #[test]
    fn a_series_falls_or_does_not_or_nobody_knows() {
        assert_eq!(falls(&[at(3.0), at(2.0), at(1.0)]), Some(true));
        assert_eq!(falls(&[at(3.0), at(2.0), at(2.1)]), None, "too close to tell");
        assert_eq!(falls(&[at(3.0), at(2.0), at(2.1), at(4.0)]), Some(false), "it rises somewhere");
        assert_eq!(falls(&[at(3.0), Estimate { value: 1.0, error: f64::INFINITY }]), None);
        assert_eq!(is_below(Estimate::exact(1.0), Estimate::exact(1.0)), None, "equal");
    }

    #[test]
    fn an_estimate_is_within_a_margin_with_its_error() {
        let answers = [1.0, 1.25, 1.7, 2.0].map(|value| is_within(at(value), 1.0, 0.5));
        assert_eq!(answers, [Some(true), None, None, Some(false)]);
    }
}
