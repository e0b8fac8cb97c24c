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

/// What a curve does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trend {
    Rises,
    Falls,
    /// It rises and falls beyond its errors.
    Both,
    /// No two of its points differ beyond their errors.
    NotTold,
}

impl Trend {
    /// What points do in their order: two that are [`DEVIATIONS`] apart tell.
    pub(super) fn of(points: &[(f64, Estimate)]) -> Self {
        let pairs = || points.iter().enumerate().flat_map(|(i, a)| points[i + 1..].iter().map(move |b| (a.1, b.1)));
        let told = |sign: f64| pairs().any(|(a, b)| sign * (b.value - a.value) > DEVIATIONS * a.error.hypot(b.error));
        match (told(1.0), told(-1.0)) {
            (true, false) => Self::Rises,
            (false, true) => Self::Falls,
            (true, true) => Self::Both,
            (false, false) => Self::NotTold,
        }
    }
}

/// The difference of two independent estimates.
pub(super) fn difference(a: Estimate, b: Estimate) -> Estimate {
    Estimate { value: a.value - b.value, error: a.error.hypot(b.error) }
}

/// How far an estimate is from `expected`, less than `tolerance`: positive where it is as near as that.
pub(super) fn nearness(of: Estimate, expected: f64, tolerance: f64) -> Estimate {
    Estimate { value: tolerance - (of.value - expected).abs(), error: of.error }
}

impl Report {
    /// Notes what a claim comes to.
    pub(super) fn judge(&mut self, claim: impl Into<String>, measured: impl Into<String>, holds: Option<bool>) {
        match holds {
            Some(agrees) => self.put_to_the_test(claim, measured, agrees),
            None => self.undecided(claim, measured),
        }
    }

    /// Notes a claim that holds if `margin` is above 0: neither way if that is within its errors.
    pub(super) fn decide(&mut self, claim: impl Into<String>, measured: impl Into<String>, margin: Estimate) {
        // No error at all, or none that is known, decides nothing.
        let told = margin.value.abs() > DEVIATIONS * margin.error && margin.error.is_finite();
        self.judge(claim, measured, told.then_some(margin.value > 0.0));
    }

    /// Notes a claim about what a curve does.
    pub(super) fn claim_trend(&mut self, claim: impl Into<String>, points: &[(f64, Estimate)], claimed: Trend) {
        let measured = listed(points);
        let trend = Trend::of(points);
        self.judge(claim, measured, (trend != Trend::NotTold).then_some(trend == claimed));
    }

    /// Notes the claim that a curve levels off: that its last part is less steep than its first, the middle point lying between.
    pub(super) fn claim_levelling(&mut self, claim: impl Into<String>, points: &[(f64, Estimate)]) {
        let [first, middle, last] = [0, points.len() / 2, points.len() - 1].map(|index| points[index]);
        let slope = |a: (f64, Estimate), b: (f64, Estimate)| difference(b.1, a.1) * (b.0 - a.0).recip();
        let [early, late] = [slope(first, middle), slope(middle, last)];
        let sign = early.value.signum();
        // The middle point is in both slopes.
        let shared = middle.1.error * ((middle.0 - first.0).recip() + (last.0 - middle.0).recip());
        let ends = (first.1.error / (middle.0 - first.0)).hypot(last.1.error / (last.0 - middle.0));
        let margin = Estimate { value: sign * early.value - (sign * late.value).abs(), error: shared.hypot(ends) };
        let measured = format!("slope {early} up to {}, {late} from there to {}", brief(middle.0), brief(last.0));
        self.decide(claim, measured, margin);
    }
}

/// The points of a curve in words.
pub(super) fn listed(points: &[(f64, Estimate)]) -> String {
    points.iter().map(|(x, y)| format!("{y} at {}", brief(*x))).collect::<Vec<_>>().join(", ")
}

/// A setting, without the rounding of its last digits.
fn brief(x: f64) -> String {
    let text = format!("{x:.4}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::reproduce::Verdict;

    fn curve(values: &[f64]) -> Vec<(f64, Estimate)> {
        values.iter().enumerate().map(|(i, &value)| (i as f64, Estimate { value, error: 0.1 })).collect()
    }

    #[test]
    fn only_what_is_beyond_its_errors_is_a_trend() {
        for (values, trend) in [
            (&[1.0, 1.2, 1.1, 2.0][..], Trend::Rises),
            (&[1.0, 0.9, 0.2], Trend::Falls),
            (&[1.0, 2.0, 1.0], Trend::Both),
            (&[1.0, 1.2, 1.1], Trend::NotTold),
        ] {
            assert_eq!(Trend::of(&curve(values)), trend, "{values:?}");
        }
    }

    #[test]
    fn claims_are_decided_by_their_errors() {
        let mut report = Report::default();
        let margin = |value| Estimate { value, error: 0.1 };
        report.decide("a", "", margin(0.5));
        report.decide("b", "", margin(-0.5));
        report.decide("c", "", margin(0.2));
        report.decide("d", "", Estimate { value: 1.0, error: f64::INFINITY });
        report.claim_trend("e", &curve(&[1.0, 2.0]), Trend::Falls);
        report.claim_levelling("f", &curve(&[1.0, 3.0, 5.0, 5.1, 5.2]));
        report.claim_levelling("g", &curve(&[5.0, 4.9, 5.0, 3.0, 1.0]));
        report.claim_levelling("h", &curve(&[1.0, 2.0, 3.0, 4.0, 5.0]));
        let verdicts: Vec<Verdict> = report.findings.iter().map(|finding| finding.verdict).collect();
        use Verdict::{Agrees, Differs, Undecided};
        assert_eq!(verdicts, [Agrees, Differs, Undecided, Undecided, Differs, Agrees, Differs, Undecided]);
        assert_eq!(report.findings[4].measured, "1.00 ± 0.10 at 0, 2.00 ± 0.10 at 1");
    }

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
        assert_eq!(all([Some(true), None]), None);
        assert_eq!(all([None, Some(false)]), Some(false));
    }

    #[test]
    fn an_estimate_is_within_a_margin_with_its_error() {
        let answers = [1.0, 1.25, 1.7, 2.0].map(|value| is_within(at(value), 1.0, 0.5));
        assert_eq!(answers, [Some(true), None, None, Some(false)]);
    }
}
