//! The grains as a layout of cells sees them.

use nalgebra::Vector3;

use crate::Flight;

/// So many grains or a few more tell how a stream moves: their median is off by a thirtieth of the spread.
const SAMPLED: usize = 1 << 10;

/// All grains at one moment: those that stand out, and some of the others.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    /// The moment, s (epoch time).
    pub(super) now: f64,
    /// How many they are.
    pub(super) grains: usize,
    /// Radius of the largest, m.
    pub(crate) largest_radius: f64,
    /// The corners of the box around their centres, m.
    pub(super) corners: [Vector3<f64>; 2],
    /// Some of them, evenly taken from all.
    pub(super) sample: Vec<Flight>,
}

impl Stream {
    /// The stream of these grains as they are at `now` (s, epoch time).
    pub(crate) fn new<'a>(flights: impl Iterator<Item = &'a Flight> + Clone, now: f64) -> Self {
        let grains = flights.clone().count();
        let step = grains.div_ceil(SAMPLED).max(1);
        let sample = flights.clone().step_by(step).copied().collect();
        let nowhere = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        let (corners, largest_radius) = flights.fold((nowhere, 0.0_f64), |([low, high], largest), flight| {
            let place = flight.position_at(now);
            ([low.inf(&place), high.sup(&place)], largest.max(flight.radius))
        });
        Self { now, grains, largest_radius, corners, sample }
    }
}
