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
    /// The errors that some runs reach and others do not: powers of ten from the worst to the best, none of them below the floor.
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
        let powers = best.log10().ceil() as i32..=worst.log10().floor() as i32;
        powers.rev().map(|power| self.level(10.0_f64.powi(power))).filter(|level| level.costs.len() > 1).collect()
    }

    fn level(&self, error: f64) -> Level {
        let costs = self.curves.iter().enumerate().filter_map(|(number, curve)| Some((number, curve.cost_of(error)?)));
        let mut costs: Vec<_> = costs.collect();
        costs.sort_by(|a, b| a.1.total_cmp(&b.1));
        Level { error, costs }
    }
}

impl Curve {
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

    /// Observed order: how the error falls with the setting, from the two finest runs whose errors are above the floor.
    #[must_use]
    pub fn order(&self) -> Option<f64> {
        let above: Vec<_> = self
            .done()
            .filter(|(_, scores)| !scores.is_noise())
            .filter_map(|(entry, scores)| Some((entry.value?, scores.error)))
            .collect();
        let [.., coarse, fine] = above.as_slice() else { return None };
        Some(order(*coarse, *fine))
    }
}

/// The power p in error ~ setting^p, from two pairs of setting and error.
#[must_use]
pub fn order(coarse: (f64, f64), fine: (f64, f64)) -> f64 {
    (coarse.1 / fine.1).ln() / (coarse.0 / fine.0).ln()
}
