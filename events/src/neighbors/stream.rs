//! The grains as a layout of cells sees them.

use nalgebra::Vector3;

use crate::Flight;

/// At most so many grains, and at least half of that where there are more, tell how a stream moves: their median is off by a twentieth of the spread.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_many_that_stands_out_is_not_overlooked() {
        let mut flights: Vec<Flight> = (0..10_000)
            .map(|number| Flight {
                position: Vector3::new(f64::from(number), 0.0, 0.0),
                time: 1.0,
                velocity: Vector3::x(),
                radius: 0.1,
            })
            .collect();
        flights[4321] = Flight { position: Vector3::new(0.0, 7.0, -7.0), radius: 0.4, ..flights[4321] };
        let stream = Stream::new(flights.iter(), 3.0);
        assert_eq!((stream.grains, stream.largest_radius), (10_000, 0.4));
        // As they are two seconds later.
        assert_eq!(stream.corners, [Vector3::new(2.0, 0.0, -7.0), Vector3::new(10_001.0, 7.0, 0.0)]);
        assert!((0..10_000).step_by(10).zip(&stream.sample).all(|(number, one)| *one == flights[number]));
        assert_eq!(stream.sample.len(), 1000);
    }
}
