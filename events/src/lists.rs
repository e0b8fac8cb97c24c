//! Who can meet whom within several sub-steps: neighbour lists that drift with the stream.
//!
//! The list of a grain names all grains that were nearer than the contact distance and a skin when it was made. As long as no grain has moved by more
//! than half the skin, seen from a frame that drifts with the stream, nobody else can touch it. So one list serves many short sub-steps, in
//! which cells would be laid out anew each time.
//!
//! Lists are bookkeeping, as cells are: they cannot change a bit of a prediction.

use nalgebra::Vector3;

use crate::Flight;
use crate::neighbors::{Cells, Near};

/// Sub-steps that a list should serve, by the fastest grain: more make longer lists.
const SUB_STEPS: f64 = 12.0;
/// Widest skin, in radii of the largest grain: beyond it a list holds so many grains that cells are better.
const WIDEST_SKIN: f64 = 1.0;

/// The lists of all grains.
#[derive(Clone, Debug)]
pub(crate) struct Lists {
    /// The list of grain k is from `starts[k]` to `starts[k + 1]`.
    starts: Vec<u32>,
    others: Vec<(u32, Vector3<f64>)>,
    /// Where each grain was, m.
    anchors: Vec<Vector3<f64>>,
    /// Velocity of the frame, m/s.
    drift: Vector3<f64>,
    /// How far a grain may move in that frame, m.
    room: f64,
    /// Since when, s.
    age: f64,
}

/// How fast a stream moves as a whole (m/s), and how fast its fastest grain moves in that frame.
fn stream<'a>(flights: impl Iterator<Item = &'a Flight> + Clone) -> (Vector3<f64>, f64) {
    let count = flights.clone().count().max(1) as f64;
    let drift = flights.clone().map(|flight| flight.velocity).sum::<Vector3<f64>>() / count;
    (drift, flights.map(|flight| (flight.velocity - drift).norm_squared()).fold(0.0, f64::max).sqrt())
}

/// The skin (m) for grains of radius `largest` at most that move so for sub-steps of length `step` (s); `None` where cells are better.
pub(crate) fn skin<'a>(flights: impl Iterator<Item = &'a Flight> + Clone, largest: f64, step: f64) -> Option<f64> {
    let (_, fastest) = stream(flights);
    // Grains that hardly move get a list that lasts.
    let skin = (2.0 * fastest * step * SUB_STEPS).max(0.1 * largest);
    let widest = WIDEST_SKIN * largest;
    // It must last a few sub-steps, or it is made in vain.
    (skin <= 4.0 * widest).then_some(skin.min(widest))
}

impl Lists {
    /// Lists with the given skin (m) for flights at time 0; vacant ones have the radius 0. `cells` are wider than contact and skin.
    pub(crate) fn new(cells: &Cells, flights: &[Flight], skin: f64) -> Self {
        let (drift, _) = stream(flights.iter().filter(|flight| flight.radius > 0.0));
        let mut lists = Self {
            starts: vec![0],
            others: Vec::new(),
            anchors: flights.iter().map(|flight| flight.position).collect(),
            drift,
            room: 0.5 * skin,
            age: 0.0,
        };
        let mut near = Near::default();
        for (grain, flight) in flights.iter().enumerate() {
            if flight.radius > 0.0 {
                near.clear();
                cells.add_around(grain as u32, &mut near);
                near.each_once(grain as u32);
                lists.others.extend(near.iter().filter(|&(other, shift)| {
                    let theirs = &flights[other as usize];
                    let reach = flight.radius + theirs.radius + skin;
                    let apart = theirs.position + shift - flight.position;
                    apart.norm_squared() < reach * reach
                }));
            }
            lists.starts.push(lists.others.len() as u32);
        }
        lists
    }

    /// Whether a flight keeps to its room until `until` (s since the start of the sub-step).
    #[inline]
    pub(crate) fn holds(&self, grain: u32, flight: &Flight, until: f64) -> bool {
        let moved = flight.position_at(until) - self.anchors[grain as usize] - self.drift * (self.age + until);
        let now = flight.position - self.anchors[grain as usize] - self.drift * (self.age + flight.time);
        // A straight line is nowhere farther away than at its ends.
        moved.norm_squared().max(now.norm_squared()) < self.room * self.room
    }

    /// Goes on by a sub-step of this length (s).
    pub(crate) fn age(&mut self, step: f64) {
        self.age += step;
    }

    /// The grains that `grain` can touch, and the shift (m) of their images.
    #[inline]
    pub(crate) fn of(&self, grain: u32) -> &[(u32, Vector3<f64>)] {
        let grain = grain as usize;
        &self.others[self.starts[grain] as usize..self.starts[grain + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::SeedableRng as _;

    use super::*;
    use crate::Domain;
    use crate::neighbors::Stream;

    /// Grains of radii up to 1 m in a box of `side` (m), in a stream of `drift` (m/s).
    fn scene(seed: u64, count: usize, side: f64, drift: Vector3<f64>) -> Vec<Flight> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut within = |most: f64| Vector3::from_fn(|_, _| random.random_range(-most..most));
        (0..count)
            .map(|k| {
                let position = within(0.5 * side).add_scalar(0.5 * side);
                let radius = 1.0 - 0.6 * (k % 5) as f64 / 4.0;
                Flight { position, time: 0.0, velocity: drift + within(1.0), radius }
            })
            .collect()
    }

    proptest! {
        /// Whoever touches while lists hold, in any of several sub-steps, is in them, with the image that it touches.
        #[test]
        fn lists_name_all_who_touch(
            seed: u64, count in 2..60usize, side in 9.0..20.0f64, periodic: bool, skin in 0.05..1.0f64, drift in -50.0..50.0f64,
        ) {
            let (min, max) = (Vector3::zeros(), Vector3::repeat(side));
            let domain = if periodic { Domain { min, max, periodic, planar: false } } else { Domain::unbounded() };
            let mut flights = scene(seed, count, side, Vector3::new(drift, 0.3 * drift, 0.0));
            let Some(mut cells) = Cells::with_skin(domain, skin, &Stream::new(flights.iter(), 0.0)) else {
                // The periodic domain is too small for the skin.
                prop_assert!(periodic && side < 4.0 * (2.0 + skin) * 1.001);
                return Ok(());
            };
            (0..).zip(&flights).for_each(|(grain, flight)| cells.insert(grain, flight, 0.0));
            let mut lists = Lists::new(&cells, &flights, skin);
            let step = skin / 16.0;
            for _ in 0..8 {
                let held: Vec<bool> = (0..).zip(&flights).map(|(k, flight)| lists.holds(k, flight, step)).collect();
                for (a, ours) in flights.iter().enumerate() {
                    for (b, theirs) in flights.iter().enumerate().filter(|&(b, _)| b != a && held[a] && held[b]) {
                        for part in 0..=4 {
                            let time = step * f64::from(part) / 4.0;
                            let apart = theirs.position_at(time) - ours.position_at(time);
                            let nearest = domain.nearest(apart);
                            if nearest.norm() <= ours.radius + theirs.radius {
                                let listed = lists.of(a as u32).iter().find(|&&(other, _)| other as usize == b);
                                let Some((_, shift)) = listed else { panic!("{b} is not in the list of {a}") };
                                prop_assert!((apart + shift - nearest).norm() < 1e-9, "another image of {b}");
                            }
                        }
                    }
                }
                flights.iter_mut().for_each(|flight| {
                    *flight = flight.advanced_to(step);
                    flight.time = 0.0;
                });
                lists.age(step);
            }
        }
    }

    /// A grain that leaves its room, or has left it, is not held.
    #[test]
    fn a_list_holds_as_long_as_its_grain_keeps_to_its_room() {
        let flights = scene(1, 2, 9.0, Vector3::zeros());
        let mut cells = Cells::with_skin(Domain::unbounded(), 0.5, &Stream::new(flights.iter(), 0.0)).expect("cells");
        (0..).zip(&flights).for_each(|(grain, flight)| cells.insert(grain, flight, 0.0));
        let lists = Lists::new(&cells, &flights, 0.5);
        let drift = 0.5 * (flights[0].velocity + flights[1].velocity);
        let with = |speed: f64| Flight { velocity: drift + Vector3::x() * speed, ..flights[0] };
        assert!(lists.holds(0, &with(0.24), 1.0) && !lists.holds(0, &with(0.26), 1.0));
        let astray = Flight { position: flights[0].position + Vector3::x() * 0.3, ..with(-0.3) };
        assert!(!lists.holds(0, &astray, 1.0));
    }
}
