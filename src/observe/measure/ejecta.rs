//! Where grains fly to that have hit what they hit (Huang, Chan & Zamankhan 2010, section III).

use impinge_events::Flight;
use nalgebra::Vector3;

use super::{Measurement, Results, Window};
use crate::estimate::Estimate;
use crate::grains::{Grain, Snapshot};
use crate::scene::{EjectaMeasure, Scene};
use crate::scheme::{Observer, Passage};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

/// The directions in which mass leaves the domain, as angles from the direction of the jet: 0 goes straight on, 90° is a sheet across the jet, 180° goes
/// straight back.
///
/// All that leaves in the window counts, what nothing has deflected too: then the momentum that leaves is what comes in less what the target takes.
/// Where grains fly freely after the last collision, the domain need only be large enough to have it inside. Gravity would bend the paths.
#[derive(Clone, Debug)]
pub struct Ejecta {
    /// Unit vector along the jet.
    axis: Vector3<f64>,
    window: Window,
    bins: usize,
    /// Simulated time of the last sample, s: a run may be broken off.
    seen: f64,
    batches: Vec<Vec<Left>>,
}

/// A grain that has left.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Left {
    mass: f64,
    /// Angle from the axis, rad.
    angle: f64,
    /// Speeds along and across the axis, m/s.
    along: f64,
    across: f64,
}

/// What is known of what has left; angles in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ejected {
    /// Mass that leaves in a second, kg/s.
    pub mass_rate: Estimate,
    /// Mean velocity of the mass along the axis, m/s.
    pub along: Estimate,
    /// Mean speed of the mass across the axis, outwards, m/s.
    pub across: Estimate,
    /// Opening angle: between the axis and the momentum of what leaves, arctan of across over along (eq. 12, with U_r for its U_v). Half of the angle
    /// between opposite sides of a cone; 90° for a sheet.
    pub opening_angle: Estimate,
    /// Half of the mass leaves below this angle.
    pub median_angle: Estimate,
    /// Half-mass angle theta_half: the smallest difference of two angles between which half of the mass leaves.
    pub half_mass_angle: Estimate,
    /// These two angles.
    pub half_mass_range: [f64; 2],
}

impl Ejecta {
    /// What a scene asks for.
    #[must_use]
    pub fn new(measure: &EjectaMeasure, scene: &Scene) -> Self {
        let window = Window::new(crate::scene::Measure::Ejecta(measure.clone()).span(), &scene.run);
        Self::about(Vector3::from(measure.axis), window, measure.bins as usize)
    }

    /// Directions as angles from `axis`, any length but 0, over a window; their distribution in so many bins.
    #[must_use]
    pub fn about(axis: Vector3<f64>, window: Window, bins: usize) -> Self {
        let batches = vec![Vec::new(); window.batches];
        Self { axis: axis.normalize(), window, bins, seen: f64::NEG_INFINITY, batches }
    }

    /// Whether grains have left in two batches or more, so that there is a mean and how sure it is.
    #[must_use]
    pub fn any(&self) -> bool {
        self.filled().count() > 1
    }

    /// What is known of what has left.
    #[must_use]
    pub fn ejected(&self) -> Ejected {
        let all: Vec<Left> = self.batches.concat();
        // The best guess is that of all together; how sure it is, the scatter of the batches tells.
        let estimate = |of: fn(&[Left]) -> f64| {
            let batches: Vec<f64> = self.filled().map(|batch| of(batch)).collect();
            Estimate { value: of(&all), error: Estimate::mean(&batches).error }
        };
        let rates: Vec<f64> = self.whole().map(|(batch, duration)| mass(batch) / duration).collect();
        Ejected {
            mass_rate: Estimate::mean(&rates),
            along: estimate(|left| mean(left, |grain| grain.along)),
            across: estimate(|left| mean(left, |grain| grain.across)),
            opening_angle: estimate(opening_angle),
            median_angle: estimate(median_angle),
            half_mass_angle: estimate(|left| {
                let [low, high] = half_mass_range(left);
                high - low
            }),
            half_mass_range: half_mass_range(&all),
        }
    }

    /// The part of the mass that leaves in each bin, per degree: middles of the bins (degrees) and parts (1/degree).
    #[must_use]
    pub fn distribution(&self) -> Vec<(f64, Estimate)> {
        let width = 180.0 / self.bins as f64;
        let bin = |left: &Left| ((left.angle.to_degrees() / width) as usize).min(self.bins - 1);
        let parts = |batch: &[Left]| {
            let mut parts = vec![0.0; self.bins];
            batch.iter().for_each(|left| parts[bin(left)] += left.mass);
            (parts, mass(batch))
        };
        let batches: Vec<(Vec<f64>, f64)> = self.filled().map(|batch| parts(batch)).collect();
        let at = |bin: usize| {
            let pairs: Vec<(f64, f64)> = batches.iter().map(|(parts, mass)| (parts[bin] / width, *mass)).collect();
            ((bin as f64 + 0.5) * width, Estimate::ratio(&pairs))
        };
        (0..self.bins).map(at).collect()
    }

    /// Mass (kg) and momentum along the axis (N s) of all that left in the window.
    #[must_use]
    pub fn totals(&self) -> (f64, f64) {
        let all = || self.batches.iter().flatten();
        (all().map(|left| left.mass).sum(), all().map(|left| left.mass * left.along).sum())
    }

    /// Batches in which something left.
    fn filled(&self) -> impl Iterator<Item = &Vec<Left>> {
        self.batches.iter().filter(|batch| !batch.is_empty())
    }

    /// Batches of which some has been seen, and how much, s.
    fn whole(&self) -> impl Iterator<Item = (&Vec<Left>, f64)> {
        let length = self.window.batch_length();
        let seen = move |number: usize| (self.seen - (self.window.from + number as f64 * length)).min(length);
        self.batches
            .iter()
            .enumerate()
            .map(move |(number, batch)| (batch, seen(number)))
            .filter(|&(_, seen)| seen > 0.0)
    }
}

fn mass(left: &[Left]) -> f64 {
    left.iter().map(|grain| grain.mass).sum()
}

/// Mean over the mass.
fn mean(left: &[Left], of: fn(&Left) -> f64) -> f64 {
    left.iter().map(|grain| grain.mass * of(grain)).sum::<f64>() / mass(left)
}

fn opening_angle(left: &[Left]) -> f64 {
    mean(left, |grain| grain.across).atan2(mean(left, |grain| grain.along)).to_degrees()
}

fn sorted(left: &[Left]) -> Vec<Left> {
    let mut sorted = left.to_vec();
    sorted.sort_unstable_by(|a, b| a.angle.total_cmp(&b.angle));
    sorted
}

fn median_angle(left: &[Left]) -> f64 {
    let half = 0.5 * mass(left);
    let mut below = 0.0;
    let reached = sorted(left).into_iter().find(|grain| {
        below += grain.mass;
        below >= half
    });
    reached.map_or(f64::NAN, |grain| grain.angle.to_degrees())
}

/// What rounding may take off a sum of equal masses, relative: it must not take one grain more to half of them.
const ROUNDING: f64 = 1e-12;

/// The two angles (degrees), as near to each other as can be, between which half of the mass leaves.
fn half_mass_range(left: &[Left]) -> [f64; 2] {
    let sorted = sorted(left);
    let half = 0.5 * mass(left) * (1.0 - ROUNDING);
    let mut best = [f64::NEG_INFINITY, f64::INFINITY];
    let (mut first, mut between) = (0, 0.0);
    for last in &sorted {
        between += last.mass;
        while between - sorted[first].mass >= half {
            between -= sorted[first].mass;
            first += 1;
        }
        if between >= half && last.angle - sorted[first].angle < best[1] - best[0] {
            best = [sorted[first].angle, last.angle];
        }
    }
    best.map(f64::to_degrees)
}

impl Observer for Ejecta {
    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        if passage != Passage::Left {
            return;
        }
        let Some(batch) = self.window.batch(time) else { return };
        let along = flight.velocity.dot(&self.axis);
        let across = (flight.velocity - self.axis * along).norm();
        self.batches[batch].push(Left { mass: grain.mass, angle: across.atan2(along), along, across });
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.seen = snapshot.time;
    }
}

impl Measurement for Ejecta {
    fn results(&self) -> Results {
        if !self.any() {
            return Results::default();
        }
        let ejected = self.ejected();
        let mut table = Table::new("ejecta", &["quantity", "unit", "value", "error"]);
        let [low, high] = ejected.half_mass_range;
        for (name, unit, of) in [
            ("mass_rate", "kg/s", ejected.mass_rate),
            ("velocity_along", "m/s", ejected.along),
            ("speed_across", "m/s", ejected.across),
            ("opening_angle", "degrees", ejected.opening_angle),
            ("median_angle", "degrees", ejected.median_angle),
            ("half_mass_angle", "degrees", ejected.half_mass_angle),
        ] {
            table.row(&[&name, &unit, &of.value, &of.error]);
        }
        table.row(&[&"half_mass_from", &"degrees", &low, &""]);
        table.row(&[&"half_mass_to", &"degrees", &high, &""]);
        let distribution = self.distribution();
        let mut angles = Table::new("angles", &["angle_degrees", "part_per_degree", "part_per_degree_error"]);
        distribution.iter().for_each(|(angle, part)| angles.row(&[angle, &part.value, &part.error]));
        let most = distribution.iter().map(|(_, part)| part.value + part.error).fold(0.0, f64::max);
        let guide = |name: &str, at: f64, mark, colour| Line::curve(name, colour, mark, [(at, 0.0), (at, most)]);
        let chart = Chart {
            name: "angles",
            title: "Where the mass goes".into(),
            shows: format!("What left the domain from {} to {} s", self.window.from, self.window.until),
            x: Axis::linear("angle from the direction of the jet / degrees", 0.0, 180.0),
            y: Axis::linear("part of the mass per degree", 0.0, 1.05 * most),
            lines: vec![
                Line::measured("part of the mass", 0, distribution),
                guide(
                    &format!("opening angle {} degrees", ejected.opening_angle),
                    ejected.opening_angle.value,
                    Mark::Curve,
                    1,
                ),
                guide(&format!("half within {} degrees", ejected.half_mass_angle), low, Mark::Dashed, 2),
                guide("", high, Mark::Dashed, 2),
            ],
        };
        Results { tables: vec![table, angles], pictures: vec![Picture::Chart(chart)], ..Results::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::Ledger;
    use crate::observe::fake_jet::FakeJet;

    const WINDOW: Window = Window { from: 0.0, until: 2.0, batches: 2 };

    fn leaves(ejecta: &mut Ejecta, time: f64, degrees: f64, speed: f64, mass: f64) {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let velocity = Vector3::new(0.0, sine, -cosine) * speed;
        let flight = Flight { position: Vector3::zeros(), time: 0.0, velocity, radius: 0.1 };
        let grain = Grain { id: 0, mass, spin: Vector3::zeros(), hits: 0, strength: 1.0 };
        ejecta.passage(Passage::Left, time, &flight, &grain);
        ejecta.sample(&Snapshot { time, flights: &[], grains: &[] });
    }

    #[test]
    fn a_cone_has_its_angle_and_no_width() {
        let mut ejecta = Ejecta::about(-Vector3::z() * 3.0, WINDOW, 90);
        assert!(!ejecta.any());
        for time in [0.25, 0.75, 1.25, 1.75, 2.0] {
            leaves(&mut ejecta, time, 60.0, 2.0, 3.0);
        }
        let ejected = ejecta.ejected();
        approx::assert_relative_eq!(ejected.opening_angle.value, 60.0, max_relative = 1e-13);
        approx::assert_relative_eq!(ejected.median_angle.value, 60.0, max_relative = 1e-13);
        approx::assert_relative_eq!(ejected.along.value, 1.0, max_relative = 1e-13);
        approx::assert_relative_eq!(ejected.across.value, 3.0f64.sqrt(), max_relative = 1e-13);
        assert!(ejected.half_mass_angle.value.abs() < 1e-12 && ejected.opening_angle.error < 1e-12);
        // 6 kg in the first second and 9 kg in the other.
        assert_eq!(ejected.mass_rate, Estimate::mean(&[6.0, 9.0]));
    }

    #[test]
    fn the_half_mass_range_is_the_narrowest_whatever_the_masses() {
        let mut ejecta = Ejecta::about(-Vector3::z(), WINDOW, 90);
        for (degrees, mass) in [(10.0, 1.0), (50.0, 1.0), (58.0, 1.0), (70.0, 2.0), (73.0, 1.0), (150.0, 2.0)] {
            leaves(&mut ejecta, 0.5, degrees, 1.0, mass);
            leaves(&mut ejecta, 1.5, degrees, 1.0, mass);
        }
        // 4 of 8 kg between 58° and 73°, each twice.
        let [low, high] = ejecta.ejected().half_mass_range;
        approx::assert_relative_eq!([low, high][..], [58.0, 73.0], max_relative = 1e-13);
        assert_eq!(ejecta.ejected().half_mass_angle.error, 0.0);
        approx::assert_relative_eq!(ejecta.ejected().median_angle.value, 70.0, max_relative = 1e-13);
    }

    /// Directions without preference in space: cos of the angle is even, so half the mass lies within arcsin(1/2) of 90°.
    #[test]
    fn directions_without_preference_are_known() {
        let window = Window { from: 0.0, until: 1.0, batches: 10 };
        let mut ejecta = Ejecta::about(-Vector3::z(), window, 36);
        let count = 20_000;
        for number in 0..count {
            let even = (f64::from(number) * 0.618_033_988_749_894_9).fract();
            leaves(
                &mut ejecta,
                (f64::from(number) + 0.5) / f64::from(count),
                (2.0 * even - 1.0).acos().to_degrees(),
                1.0,
                1.0,
            );
        }
        let ejected = ejecta.ejected();
        approx::assert_abs_diff_eq!(ejected.opening_angle.value, 90.0, epsilon = 0.05);
        approx::assert_abs_diff_eq!(ejected.half_mass_angle.value, 60.0, epsilon = 0.5);
        let parts = ejecta.distribution();
        let total: f64 = parts.iter().map(|(_, part)| part.value * 5.0).sum();
        approx::assert_relative_eq!(total, 1.0, max_relative = 1e-12);
        let (angle, part) = parts[17];
        approx::assert_relative_eq!(
            part.value,
            0.5 * angle.to_radians().sin() * 1f64.to_radians(),
            max_relative = 0.01
        );
    }

    #[test]
    fn what_has_left_is_what_the_ledger_has() {
        let window = Window { from: 0.0, until: FakeJet::UNTIL, batches: 4 };
        let mut watched = (Ejecta::about(-Vector3::z(), window, 90), Ledger::default());
        FakeJet { grains: 2000, ..FakeJet::default() }.run(&mut watched);
        let (ejecta, ledger) = watched;
        let (mass, along) = ejecta.totals();
        assert!(ledger.left().count() > 100);
        approx::assert_relative_eq!(mass, ledger.left().mass(), max_relative = 1e-12);
        approx::assert_relative_eq!(along, -ledger.left().momentum().z, max_relative = 1e-10);
    }

    #[test]
    fn nothing_is_told_where_nothing_leaves() {
        let results = Ejecta::about(-Vector3::z(), WINDOW, 90).results();
        assert!(results.tables.is_empty() && results.pictures.is_empty());
    }
}
