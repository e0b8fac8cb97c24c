//! What papers state, put to the test: each study computes numbers, pictures and a verdict.
//!
//! A study is a file here (named after the paper's number and its figure) and a line in [`STUDIES`]. It gets [`Settings`] and gives a [`Report`]; it reads no file and writes none.
//! What studies share: [`run_all`] (many runs on all cores, in a fixed order), [`Estimate`](crate::estimate::Estimate) (a mean and how sure it is),
//! [`shown`](crate::shown) (tables and pictures as data), [`Jet`] (the reference jet), `target_jet` (a jet on a target of about its own width), `Impinging` (the
//! jets of Arbelaez et al. 2009), `trend` (what estimates say about a claim) and [`Sequence`] (two grains and a wall, in closed form).

mod arrivals;
mod ensemble;
mod first_order_or_repeated;
mod impinging;
mod jet;
mod p000_eq50;
mod p000_fig12;
mod p000_fig17;
mod p000_fig4;
mod p000_fig7;
mod p000_fig8;
mod p000_fig9;
mod p001_fig1;
mod p001_fig2;
mod p001_fig3;
mod p001_fig7;
mod p001_fig9;
mod p002_fig13;
mod p002_fig16;
mod p002_fig17;
mod p002_fig18;
mod p002_fig4;
mod p002_fig6;
mod p002_fig8;
mod report;
mod sequence;
mod stills;
mod target_jet;
mod trend;
mod two_grains;

use std::ops::ControlFlow;

pub use ensemble::{Error, run_all, run_observed};
pub use jet::{Energies, Jet};
pub use report::{Finding, Report, Verdict};
pub use sequence::Sequence;

/// All studies, in the order in which they are listed.
#[rustfmt::skip] // a line for each
pub const STUDIES: &[&Study] = &[
    &p000_eq50::STUDY,
    &p000_fig4::STUDY,
    &p000_fig7::STUDY,
    &p000_fig8::STUDY,
    &p000_fig9::FIGURE_9,
    &p000_fig9::FIGURE_10,
    &p000_fig9::FIGURE_11,
    &p000_fig12::STUDY,
    &p000_fig17::FIGURE_17,
    &p000_fig17::FIGURE_19,
    &p001_fig1::STUDY,
    &p001_fig2::STUDY,
    &p001_fig3::STUDY,
    &p001_fig7::STUDY,
    &p001_fig9::STUDY,
    &p002_fig4::STUDY,
    &p002_fig6::STUDY,
    &p002_fig8::STUDY,
    &p002_fig13::STUDY,
    &p002_fig16::STUDY,
    &p002_fig17::STUDY,
    &p002_fig18::STUDY,
    &two_grains::STUDY,
    &first_order_or_repeated::STUDY,
];

/// Figures that studies named after another one answer for.
#[rustfmt::skip] // a line for each study
const ALSO: &[(&str, &[&str])] = &[
    ("000-fig4", &["000-fig6"]),
    ("000-fig12", &["000-fig13", "000-fig14", "000-fig15", "000-fig16"]),
    ("000-fig17", &["000-fig18"]),
    ("000-fig19", &["000-fig20", "000-fig21"]),
    ("001-fig1", &["001-fig6"]),
    ("001-fig3", &["001-fig4", "001-fig5"]),
    ("001-fig7", &["001-fig8"]),
    ("002-fig6", &["002-fig7", "002-fig9"]),
    ("002-fig8", &["002-fig10", "002-fig11", "002-fig12"]),
    ("002-fig13", &["002-fig14", "002-fig15"]),
];

/// One statement and the computation that puts it to the test.
#[derive(Debug)]
pub struct Study {
    /// What it is asked for by: the number of the paper and of its figure, or a few words.
    pub name: &'static str,
    /// What it is about, in a line.
    pub title: &'static str,
    /// Who states it, and where.
    pub source: &'static str,
    /// What is stated.
    pub statement: &'static str,
    /// Computes it.
    pub compute: fn(&Settings<'_>) -> Result<Report, Error>,
}

impl Study {
    /// The study of this name, or that answers for the figure of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        let name = ALSO.iter().find(|(_, figures)| figures.contains(&name)).map_or(name, |&(study, _)| study);
        STUDIES.iter().copied().find(|study| study.name == name)
    }

    /// The study whose name looks most like this one.
    #[must_use]
    pub fn nearest(name: &str) -> &'static Self {
        let unlike = |study: &&&Self| strsim::damerau_levenshtein(study.name, name);
        STUDIES.iter().min_by_key(unlike).unwrap_or(&STUDIES[0])
    }
}

/// How a study is computed.
pub struct Settings<'a> {
    /// Fewer and smaller runs: seconds instead of minutes, with larger uncertainties.
    pub quick: bool,
    /// Seed of the first run; the others count on from it.
    pub seed: u64,
    /// Called now and then, from any thread, with the part of the runs that are done (0 to 1); breaks the study off.
    pub watch: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_one_that_is_mistyped_is_found() {
        let mut names: Vec<_> = STUDIES.iter().map(|study| study.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), STUDIES.len());
        assert_eq!(Study::nearest("002fig4").name, "002-fig4");
        assert_eq!(Study::nearest("two-grain").name, "two-grains");
        assert!(Study::named("two-grain").is_none());
        for (study, figures) in ALSO {
            assert!(figures.iter().all(|figure| !names.contains(figure)), "{study}");
            assert!(figures.iter().all(|figure| Study::named(figure).is_some_and(|found| found.name == *study)));
        }
    }
}
