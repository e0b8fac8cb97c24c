//! Hits in a row: when is a grain part of a collapse that does not end by itself?

/// A caged grain, one that has hit at least three partners in a row of hits each within [`COLLAPSE_TIME`] of the one before, is part of a
/// collapse after so many. In the reference jets (restitution 0.8) no grain ever is.
const COLLAPSE_HITS: u8 = 16;
/// A grain in a line, between no more than two partners, is so after this many hits in which its approach speed has not halved. Collapses in
/// a line die out by themselves and have a closed form; it holds up to an outer grain some fifty times as heavy as the inner one.
const COLLAPSE_HITS_IN_LINE: u8 = 64;
/// Part of an epoch (0.001 radii of flight of the fastest grain) within which hits are in a row.
pub(super) const COLLAPSE_TIME: f64 = 1.0 / (1u64 << 22) as f64;

/// Hits of one grain, each shortly after the one before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Time of the latest hit, s (epoch time).
    latest: f64,
    /// Approach speed that is to be halved.
    speed: ShortSpeed,
    /// The first two that were hit.
    partners: [u32; 2],
    /// All hits, or very many.
    hits: u8,
    /// Those since the approach speed was halved, or very many.
    not_halved: u8,
    /// Whether there was a third.
    caged: bool,
}

const _: () = assert!(size_of::<Row>() == 24 && COLLAPSE_HITS_IN_LINE < u8::MAX && COLLAPSE_HITS < u8::MAX);

/// A speed (m/s) to a millionth, rounded down, of 1e-300 m/s and more: the upper half of its bits. A short float would lose the speeds at the end of a collapse.
#[derive(Clone, Copy, Debug)]
struct ShortSpeed(u32);

impl ShortSpeed {
    fn of(speed: f64) -> Self {
        Self((speed.to_bits() >> 32) as u32)
    }

    fn value(self) -> f64 {
        f64::from_bits(u64::from(self.0) << 32)
    }
}

pub(super) const NO_ROW: Row = Row {
    latest: f64::NEG_INFINITY,
    speed: ShortSpeed(0),
    partners: [NOBODY; 2],
    hits: 0,
    not_halved: 0,
    caged: false,
};
/// Where there is no partner.
const NOBODY: u32 = u32::MAX;
/// The surface as a partner.
pub(super) const SURFACE: u32 = u32::MAX - 1;

impl Row {
    /// Counts time from `after` (s) on.
    pub(super) fn start_epoch(&mut self, after: f64) {
        self.latest -= after;
    }

    /// Whether a hit at `time` (s) comes within `within` (s) of the latest.
    pub(super) fn goes_on(&self, time: f64, within: f64) -> bool {
        time - self.latest <= within
    }

    /// Whether another grain was hit in the row.
    pub(super) fn among_grains(&self) -> bool {
        self.partners.iter().any(|&partner| partner < SURFACE)
    }

    /// Notes a hit with `partner` at `approach` (m/s) at `time` (s), in a row if it is at most `within` (s) after the one before, and tells
    /// whether the grain is part of a collapse that does not end by itself.
    #[inline]
    pub(super) fn note(&mut self, time: f64, within: f64, partner: u32, approach: f64, in_line: bool) -> bool {
        if time - self.latest > within {
            *self = NO_ROW;
        }
        self.latest = time;
        self.hits = self.hits.saturating_add(1);
        self.not_halved = self.not_halved.saturating_add(1);
        if approach < 0.5 * self.speed.value() || self.hits == 1 {
            (self.speed, self.not_halved) = (ShortSpeed::of(approach), 0);
        }
        if !self.partners.contains(&partner) {
            match self.partners.iter_mut().find(|known| **known == NOBODY) {
                Some(free) => *free = partner,
                None => self.caged = true,
            }
        }
        (self.caged && self.hits > COLLAPSE_HITS) || (in_line && self.not_halved > COLLAPSE_HITS_IN_LINE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_speeds_are_known_to_a_millionth_down_to_the_end_of_a_collapse() {
        for exponent in -300..=300 {
            let speed = 1.999_999_9 * 10f64.powi(exponent);
            let off = 1.0 - ShortSpeed::of(speed).value() / speed;
            assert!((0.0..1e-6).contains(&off), "{speed} m/s: {off}");
        }
    }
}
