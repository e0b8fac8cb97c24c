//! Where a domain is cut in two.

use impinge_events::{Domain, Flight};

/// The first half is the grains between two planes across an axis, of which the lower one is at minus infinity where the domain is open.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    pub(super) axis: usize,
    low: f64,
    high: f64,
    /// Length of the period, m.
    period: Option<f64>,
}

/// Quantiles of the places of grains between which their extent is measured: a few that fly ahead do not count.
const EXTENT: [f64; 2] = [0.05, 0.95];

impl Cut {
    /// Through the middle of grains as they are at `now` (s, epoch time): across the axis along which they extend farthest, among those along which
    /// they do not stream.
    pub(super) fn through(flights: &[Flight], domain: &Domain, now: f64) -> Self {
        let across = |axis: usize| {
            let velocities = flights.iter().map(|flight| flight.velocity[axis]);
            let count = flights.len() as f64;
            let mean = velocities.clone().sum::<f64>() / count;
            let streams = mean * mean > velocities.map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
            let mut places: Vec<f64> = flights.iter().map(|flight| flight.position_at(now)[axis]).collect();
            places.sort_unstable_by(f64::total_cmp);
            let at = |part: f64| {
                places.get((part * places.len().saturating_sub(1) as f64) as usize).copied().unwrap_or_default()
            };
            (streams, at(EXTENT[1]) - at(EXTENT[0]), at(0.5))
        };
        let axes = if domain.planar { [0, 2, 2] } else { [0, 1, 2] };
        let [first, others @ ..] = axes.map(|axis| (axis, across(axis)));
        let better = |best: (usize, (bool, f64, f64)), other: (usize, (bool, f64, f64))| {
            let (ours, theirs) = (best.1, other.1);
            if (!theirs.0, theirs.1) > (!ours.0, ours.1) { other } else { best }
        };
        let (axis, (_, _, middle)) = others.into_iter().fold(first, better);
        let extent = domain.extent()[axis];
        match domain.periodic {
            true => Self { axis, low: domain.min[axis], high: domain.min[axis] + 0.5 * extent, period: Some(extent) },
            false => Self { axis, low: f64::NEG_INFINITY, high: middle, period: None },
        }
    }

    /// How far `x` is inside a half from its two sides, m; negative where it is in the other one.
    fn inside(&self, half: usize, x: f64) -> [f64; 2] {
        let Some(period) = self.period else {
            return if half == 0 { [f64::INFINITY, self.high - x] } else { [x - self.high, f64::INFINITY] };
        };
        let (x, width) = (x - self.low, self.high - self.low);
        let place = x - (x / period).floor() * period;
        let (in_first, in_second) = ([place, width - place], [place - width, period - place]);
        match (half == 0, place < width) {
            (true, true) => in_first,
            (false, false) => in_second,
            (true, false) => [-in_second[0].min(in_second[1]); 2],
            (false, true) => [-in_first[0].min(in_first[1]); 2],
        }
    }

    /// How far a flight is inside a half at `now` (s, epoch time), m; negative where it is in the other one.
    pub(super) fn depth(&self, half: usize, flight: &Flight, now: f64) -> f64 {
        let [lower, upper] = self.inside(half, flight.position_at(now)[self.axis]);
        lower.min(upper)
    }

    /// When between two times (s, epoch time) a flight is first less than `margin` (m) inside a half.
    pub(super) fn stray(&self, half: usize, flight: &Flight, between: [f64; 2], margin: f64) -> Option<f64> {
        let [from, until] = between;
        let [lower, upper] = self.inside(half, flight.position_at(from)[self.axis]).map(|inside| inside - margin);
        if lower < 0.0 || upper < 0.0 {
            return Some(from);
        }
        let v = flight.velocity[self.axis];
        let room = if v > 0.0 { upper } else { lower };
        (room < v.abs() * (until - from)).then(|| (from + room / v.abs()).min(until))
    }

    /// Moves the upper plane by `way` (m) into the second half.
    pub(super) fn shift(&mut self, way: f64) {
        self.high += way;
    }
}
