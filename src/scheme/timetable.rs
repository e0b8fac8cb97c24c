//! When a run is sampled.

/// Evenly spaced moments from `start` to `until`, both included; none where `count` is 0, and `until` alone where it is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    start: f64,
    until: f64,
    count: u32,
    next: u32,
}

impl Moments {
    /// `count` moments from `start` to `until` (s).
    #[must_use]
    pub fn new(start: f64, until: f64, count: u32) -> Self {
        Self { start, until, count, next: 0 }
    }

    /// Number and time (s) of the next moment.
    #[must_use]
    pub fn peek(&self) -> Option<(u32, f64)> {
        (self.next < self.count).then(|| {
            let last = self.count - 1;
            // The last one is `until` itself, free of rounding.
            let time = if self.next == last {
                self.until
            } else {
                self.start + (self.until - self.start) * (f64::from(self.next) / f64::from(last))
            };
            (self.next, time)
        })
    }

    /// Goes on to the moment after the next one.
    pub fn advance(&mut self) {
        self.next += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(mut moments: Moments) -> Vec<f64> {
        std::iter::from_fn(|| {
            let (_, time) = moments.peek()?;
            moments.advance();
            Some(time)
        })
        .collect()
    }

    #[test]
    fn both_ends_are_met_exactly() {
        assert_eq!(all(Moments::new(1.0, 3.0, 3)), [1.0, 2.0, 3.0]);
        assert_eq!(all(Moments::new(0.0, 0.06, 61)).last(), Some(&0.06));
        assert_eq!(all(Moments::new(0.0, 0.06, 1)), [0.06]);
        assert!(all(Moments::new(0.0, 0.06, 0)).is_empty());
    }
}
