//! Does it rise, does it level off? Claims about signs and curves, decided by their errors.

use super::Report;
use crate::estimate::Estimate;

/// Estimates that are so many standard errors apart differ.
pub(super) const DEVIATIONS: f64 = 3.0;

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
    /// Notes a claim that holds if `margin` is above 0: neither way if that is within its errors.
    pub(super) fn decide(&mut self, claim: impl Into<String>, measured: impl Into<String>, margin: Estimate) {
        // No error at all, or none that is known, decides nothing.
        if margin.value.abs() > DEVIATIONS * margin.error && margin.error.is_finite() {
            self.put_to_the_test(claim, measured, margin.value > 0.0);
        } else {
            self.undecided(claim, measured);
        }
    }

    /// Notes a claim about what a curve does.
    pub(super) fn claim_trend(&mut self, claim: impl Into<String>, points: &[(f64, Estimate)], claimed: Trend) {
        let measured = listed(points);
        match Trend::of(points) {
            Trend::NotTold => self.undecided(claim, measured),
            trend => self.put_to_the_test(claim, measured, trend == claimed),
        }
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
}
