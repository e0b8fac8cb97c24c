//! When a measurement looks, and how it is divided so that it can tell how sure it is.

use crate::scene::{Run, Span};

/// The part of a run in which something is measured, in batches of equal length.
///
/// Quantities of one batch are one sample: their scatter from batch to batch is what standard errors are made of. That is right where a batch
/// is longer than the memory of what is measured.
///
/// ```
/// let window = impinge::observe::measure::Window { from: 1.0, until: 3.0, batches: 4 };
/// assert_eq!([0.9, 1.0, 1.6, 3.0, 3.1].map(|time| window.batch(time)), [None, Some(0), Some(1), Some(3), None]);
/// assert_eq!(window.batch_length(), 0.5);
/// assert_eq!([1.4, 1.5, 3.0].map(|time| window.is_over(0, time)), [false, true, true]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Start, s.
    pub from: f64,
    /// End, s.
    pub until: f64,
    /// Number of batches.
    pub batches: usize,
}

impl Window {
    /// The window that a scene asks for: what is left out is the start or the end of the run.
    #[must_use]
    pub fn new(span: Span, run: &Run) -> Self {
        let [from, until] = span.within(run);
        Self { from, until, batches: span.batches as usize }
    }

    /// Number of the batch that a moment (s) belongs to; none before and after.
    #[must_use]
    pub fn batch(&self, time: f64) -> Option<usize> {
        let inside = (self.from..=self.until).contains(&time);
        // The end belongs to the last batch.
        inside.then(|| (((time - self.from) / self.batch_length()) as usize).min(self.batches - 1))
    }

    /// Whether all of a batch is over at a moment (s): what is counted per time counts no batch that a run was broken off in.
    #[must_use]
    pub fn is_over(&self, batch: usize, time: f64) -> bool {
        // The end of the last batch may be off the end of the run by the rounding of both.
        const ROUNDING: f64 = 1e-9;
        time >= self.from + (batch as f64 + 1.0 - ROUNDING) * self.batch_length()
    }

    /// Duration of a batch, s.
    #[must_use]
    pub fn batch_length(&self) -> f64 {
        (self.until - self.from) / self.batches as f64
    }
}
