//! What a study found: tables, pictures as data, and what each statement comes to.

use std::fmt::Display;

use crate::shown::{Picture, Table};

/// All that a study found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// What is stated and what was measured.
    pub findings: Vec<Finding>,
    /// The numbers.
    pub tables: Vec<Table>,
    /// The pictures.
    pub pictures: Vec<Picture>,
}

impl Report {
    /// Notes what a claim comes to: agrees if `agrees`.
    pub fn put_to_the_test(&mut self, claim: impl Into<String>, measured: impl Into<String>, agrees: bool) {
        let verdict = if agrees { Verdict::Agrees } else { Verdict::Differs };
        self.findings.push(Finding { claim: claim.into(), measured: measured.into(), verdict });
    }

    /// Notes a claim that the errors are too wide to decide.
    pub fn undecided(&mut self, claim: impl Into<String>, measured: impl Into<String>) {
        self.findings.push(Finding { claim: claim.into(), measured: measured.into(), verdict: Verdict::Undecided });
    }

    /// Notes what was measured where nobody claims anything.
    pub fn measured(&mut self, what: impl Into<String>, measured: impl Into<String>) {
        self.findings.push(Finding { claim: what.into(), measured: measured.into(), verdict: Verdict::Measured });
    }

    /// Whether all that was put to the test agrees: one claim that differs is enough, and one that is not decided leaves the whole undecided.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let is = |verdict| self.findings.iter().any(|finding| finding.verdict == verdict);
        let heaviest = [Verdict::Differs, Verdict::Undecided, Verdict::Agrees].into_iter().find(|&verdict| is(verdict));
        heaviest.unwrap_or(Verdict::Measured)
    }
}

/// A claim, and what was measured, with its uncertainty.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Finding {
    /// What is claimed; or what was measured, where nothing is.
    pub claim: String,
    /// What was measured.
    pub measured: String,
    /// What that comes to.
    pub verdict: Verdict,
}

/// What a claim comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It is as claimed.
    Agrees,
    /// It is not.
    Differs,
    /// The errors are too wide to tell.
    Undecided,
    /// Nothing is claimed.
    Measured,
}

impl Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Agrees => "agrees",
            Self::Differs => "differs",
            Self::Undecided => "undecided",
            Self::Measured => "measured",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_claim_that_fails_is_enough() {
        let mut report = Report::default();
        report.measured("a", "1");
        assert_eq!(report.verdict(), Verdict::Measured);
        report.put_to_the_test("b", "2", true);
        assert_eq!(report.verdict(), Verdict::Agrees);
        report.undecided("e", "5");
        assert_eq!(report.verdict(), Verdict::Undecided);
        report.put_to_the_test("c", "3", false);
        report.put_to_the_test("d", "4", true);
        assert_eq!(report.verdict(), Verdict::Differs);
    }
}
