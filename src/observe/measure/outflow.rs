//! What leaves through the sides of the domain, over height (Arbelaez et al. 2009, section 9).

use impinge_events::Flight;
use nalgebra::Vector3;

use super::{Measurement, Results, Window};
use crate::estimate::Estimate;
use crate::grains::{Grain, Snapshot, kinetic_energy};
use crate::observe::{Sum, VectorSum};
use crate::scene::{Domain, Measure, OutflowMeasure, Scene, Side};
use crate::scheme::{Observer, Passage};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

/// What flows out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Mass, kg.
    Mass,
    /// Momentum along the outward normal of the side, kg m/s: its rate is the force on a wall that would stop it.
    Momentum,
    /// Kinetic energy, rotation included, J.
    Energy,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Mass, Self::Momentum, Self::Energy];

    fn name(self) -> &'static str {
        match self {
            Self::Mass => "mass",
            Self::Momentum => "momentum",
            Self::Energy => "energy",
        }
    }
}

/// Resultant and moments of a profile over height (Arbelaez et al. 2009, eq. 58 to 61).
///
/// The print divides (h - h̄)ⁿ by Lⁿ, with h a length and h̄ = h/L a number; here it is (h/L - h̄)ⁿ. Moments are sums over grains, Σ ψ (h/L - h̄)ⁿ / Σ ψ, where the
/// paper integrates a profile that it joins from cell to cell: cells only blur them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileMoments<T = f64> {
    /// Its integral over height; of a flow per second.
    pub resultant: T,
    /// Height of its centroid, in lengths L.
    pub centroid: T,
    /// Spread about that, in lengths L.
    pub spread: T,
    /// Third moment over the cube of the spread: positive where the longer tail is that of large heights; 0 where there is no spread.
    pub skewness: T,
}

/// A variance that is no larger than this part of the mean square is what rounding leaves of none: a spread below a millionth of the height is called 0.
const SPREAD_ROUNDING: f64 = 1e-12;

/// Sums of ψ (h/L)ⁿ for n = 0 to 3.
type Powers = [f64; 4];

fn powers(height: f64, psi: f64) -> Powers {
    [psi, psi * height, psi * height.powi(2), psi * height.powi(3)]
}

impl ProfileMoments {
    /// Moments of a profile given by heights (in lengths L) and what is there.
    ///
    /// ```
    /// use impinge::observe::measure::ProfileMoments;
    ///
    /// let two = ProfileMoments::of([(1.0, 3.0), (2.0, 1.0)]);
    /// assert_eq!((two.resultant, two.centroid, two.spread), (4.0, 1.25, 0.1875_f64.sqrt()));
    /// assert!((two.skewness - 2.0 / 3.0_f64.sqrt()).abs() < 1e-13); // (1 - 2p) / √(p (1 - p)) for p = 1/4
    /// ```
    #[must_use]
    pub fn of(profile: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut sum = Powers::default();
        for (height, psi) in profile {
            add(&mut sum, &powers(height, psi), 1.0);
        }
        Self::from_powers(&sum)
    }

    fn from_powers(&[zeroth, first, second, third]: &Powers) -> Self {
        let (mean, square, cube) = (first / zeroth, second / zeroth, third / zeroth);
        let variance = square - mean * mean;
        let third = cube - 3.0 * mean * square + 2.0 * mean.powi(3);
        if variance <= SPREAD_ROUNDING * square {
            return Self { resultant: zeroth, centroid: mean, spread: 0.0, skewness: 0.0 };
        }
        Self { resultant: zeroth, centroid: mean, spread: variance.sqrt(), skewness: third / variance.powf(1.5) }
    }
}

fn add(sum: &mut Powers, other: &Powers, sign: f64) {
    (0..4).for_each(|n| sum[n] += sign * other[n]);
}

/// Where a profile counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Sides of the domain.
    pub sides: Vec<Side>,
    /// The z from which heights count, m.
    pub base: f64,
    /// Length L in which moments are told, m.
    pub length: f64,
    /// Height of the upper end of the cells, m.
    pub top: f64,
    /// Number of cells.
    pub cells: usize,
}

/// Mass, momentum and energy that leave through sides of the domain, over height, in the batches of a window.
///
/// What Arbelaez et al. (2009), eq. (55), print is the rate per cell; here it is divided by the height of the cell, so that its integral (eq. 58) is the whole.
/// They find the errors of moments by drawing profiles from the errors of cells; here they come from the [jackknife](Estimate::jackknife) over batches, which
/// needs no chance and knows that cells depend on each other.
#[derive(Clone, Debug)]
pub struct Outflow {
    profile: Profile,
    domain: Domain,
    window: Window,
    batches: Vec<Batch>,
    /// What left through these sides, and elsewhere, within the window.
    left: [Totals; 2],
    /// How far the run has come, s.
    reached: f64,
}

#[derive(Clone, Debug)]
struct Batch {
    grains: u64,
    /// Of each quantity.
    powers: [Powers; 3],
    /// Of each cell and quantity.
    cells: Vec<[f64; 3]>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    mass: Sum,
    momentum: VectorSum,
    energy: Sum,
}

impl Outflow {
    /// The outflow that a scene asks for.
    #[must_use]
    pub fn new(measure: &OutflowMeasure, scene: &Scene) -> Self {
        let all: &[Side] = match scene.domain.planar {
            true => &[Side::XMin, Side::XMax],
            false => &[Side::XMin, Side::XMax, Side::YMin, Side::YMax],
        };
        let profile = Profile {
            sides: measure.sides.clone().unwrap_or_else(|| all.to_vec()),
            base: measure.base,
            length: measure.length,
            top: measure.top(scene),
            cells: measure.cells as usize,
        };
        let window = Window::new(Measure::Outflow(measure.clone()).span(), &scene.run);
        Self::over(profile, scene.domain.clone(), window)
    }

    /// The outflow from a domain, over a window.
    #[must_use]
    pub fn over(profile: Profile, domain: Domain, window: Window) -> Self {
        let batch = Batch { grains: 0, powers: [Powers::default(); 3], cells: vec![[0.0; 3]; profile.cells] };
        let batches = vec![batch; window.batches];
        Self { profile, domain, window, batches, left: [Totals::default(); 2], reached: f64::NEG_INFINITY }
    }

    /// Adds the batches of a copy of the same run with another seed.
    ///
    /// # Panics
    /// If it has other cells.
    pub fn absorb(&mut self, copy: &Self) {
        assert_eq!(self.profile, copy.profile, "copies are measured alike");
        let mut batches: Vec<Batch> = self.complete().cloned().collect();
        batches.extend(copy.complete().cloned());
        self.batches = batches;
        for (totals, other) in self.left.iter_mut().zip(&copy.left) {
            totals.mass += other.mass.value();
            totals.momentum += other.momentum.value();
            totals.energy += other.energy.value();
        }
        // All that is left is complete.
        self.reached = f64::INFINITY;
    }

    /// Mass (kg), momentum (kg m/s) and energy (J) that left within the window: through these sides, and elsewhere.
    #[must_use]
    pub fn totals(&self) -> [(f64, Vector3<f64>, f64); 2] {
        self.left.map(|left| (left.mass.value(), left.momentum.value(), left.energy.value()))
    }

    /// Grains that left through these sides in batches that are over.
    #[must_use]
    pub fn grains(&self) -> u64 {
        self.complete().map(|batch| batch.grains).sum()
    }

    /// Resultant (per second) and moments of a quantity, with their standard errors.
    #[must_use]
    pub fn moments(&self, quantity: Quantity) -> ProfileMoments<Estimate> {
        let of = |part: fn(&ProfileMoments) -> f64| self.derived(quantity, part);
        ProfileMoments {
            resultant: of(|moments| moments.resultant),
            centroid: of(|moments| moments.centroid),
            spread: of(|moments| moments.spread),
            skewness: of(|moments| moments.skewness),
        }
    }

    /// Rate of a quantity per height and second in each cell: height of its middle (m), and the rate.
    #[must_use]
    pub fn profile(&self, quantity: Quantity) -> Vec<(f64, Estimate)> {
        let height = self.profile.top / self.profile.cells as f64;
        let scale = 1.0 / (height * self.window.batch_length());
        let cell = |cell: usize| {
            let rates = self.complete().map(|batch| batch.cells[cell][quantity as usize] * scale);
            ((cell as f64 + 0.5) * height, Estimate::mean(&rates.collect::<Vec<_>>()))
        };
        (0..self.profile.cells).map(cell).collect()
    }

    fn derived(&self, quantity: Quantity, of: fn(&ProfileMoments) -> f64) -> Estimate {
        let batches: Vec<Powers> = self.complete().map(|batch| batch.powers[quantity as usize]).collect();
        let mut sum = Powers::default();
        batches.iter().for_each(|batch| add(&mut sum, batch, 1.0));
        Estimate::jackknife(batches.len(), |without| {
            let mut kept = sum;
            if let Some(batch) = without {
                add(&mut kept, &batches[batch], -1.0);
            }
            let time = (batches.len() - usize::from(without.is_some())) as f64 * self.window.batch_length();
            of(&ProfileMoments::from_powers(&kept.map(|power| power / time)))
        })
    }

    /// Batches that are over.
    fn complete(&self) -> impl Iterator<Item = &Batch> {
        let is_over = |batch: usize| self.window.is_over(batch, self.reached);
        self.batches.iter().enumerate().filter(move |&(batch, _)| is_over(batch)).map(|(_, batch)| batch)
    }

    /// The outward normal of the side through which a grain at `place` (m) has left, if it is one of these: that which it is furthest beyond.
    fn outward(&self, place: &Vector3<f64>) -> Option<Vector3<f64>> {
        let Domain { min, max, .. } = self.domain;
        let beyond = self
            .domain
            .axes()
            .flat_map(|axis| [(axis, false, min[axis] - place[axis]), (axis, true, place[axis] - max[axis])]);
        let (axis, is_upper, _) = beyond.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let side = match (axis, is_upper) {
            (0, false) => Side::XMin,
            (0, true) => Side::XMax,
            (1, false) => Side::YMin,
            (1, true) => Side::YMax,
            _ => return None,
        };
        let sign = if is_upper { 1.0 } else { -1.0 };
        self.profile.sides.contains(&side).then(|| Vector3::ith(axis, sign))
    }
}

impl Observer for Outflow {
    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        let (Passage::Left, Some(batch)) = (passage, self.window.batch(time)) else { return };
        let outward = self.outward(&flight.position);
        let left = &mut self.left[usize::from(outward.is_none())];
        let energy = kinetic_energy(flight, grain);
        left.mass += grain.mass;
        left.momentum += flight.velocity * grain.mass;
        left.energy += energy;
        let Some(outward) = outward else { return };
        let batch = &mut self.batches[batch];
        batch.grains += 1;
        let psi = [grain.mass, grain.mass * flight.velocity.dot(&outward), energy];
        let height = flight.position.z - self.profile.base;
        for (sum, psi) in batch.powers.iter_mut().zip(psi) {
            add(sum, &powers(height / self.profile.length, psi), 1.0);
        }
        let cell = (height / self.profile.top * self.profile.cells as f64).floor();
        if (0.0..self.profile.cells as f64).contains(&cell) {
            batch.cells[cell as usize].iter_mut().zip(psi).for_each(|(sum, psi)| *sum += psi);
        }
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.reached = self.reached.max(snapshot.time);
    }
}

impl Measurement for Outflow {
    fn results(&self) -> Results {
        let pictures = if self.grains() > 0 { vec![Picture::Chart(self.chart())] } else { Vec::new() };
        Results { tables: vec![self.table(), self.table_of_moments()], pictures, ..Results::default() }
    }
}

impl Outflow {
    fn table(&self) -> Table {
        let mut table = Table::new(
            "profile",
            &["height", "mass", "mass_error", "momentum", "momentum_error", "energy", "energy_error"],
        );
        let [mass, momentum, energy] = Quantity::ALL.map(|quantity| self.profile(quantity));
        for ((mass, momentum), energy) in mass.iter().zip(&momentum).zip(&energy) {
            let mut row = vec![mass.0.to_string()];
            row.extend(
                [mass.1, momentum.1, energy.1].iter().flat_map(|of| [of.value.to_string(), of.error.to_string()]),
            );
            table.rows.push(row);
        }
        table
    }

    fn table_of_moments(&self) -> Table {
        let mut table = Table::new(
            "moments",
            &[
                "quantity",
                "resultant",
                "resultant_error",
                "centroid",
                "centroid_error",
                "spread",
                "spread_error",
                "skewness",
                "skewness_error",
            ],
        );
        for quantity in Quantity::ALL {
            let ProfileMoments { resultant, centroid, spread, skewness } = self.moments(quantity);
            let mut row = vec![quantity.name().to_owned()];
            let moments = [resultant, centroid, spread, skewness];
            // Of nothing that leaves there are no moments, and of what leaves in one batch there are no errors.
            let number = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
            row.extend(moments.iter().flat_map(|of| [number(of.value), number(of.error)]));
            table.rows.push(row);
        }
        table
    }

    /// The profile of momentum over its resultant, as figure 17 of Arbelaez et al. (2009) shows it.
    fn chart(&self) -> Chart {
        let length = self.profile.length;
        let moments = self.moments(Quantity::Momentum);
        let scale = length / moments.resultant.value;
        let profile = self.profile(Quantity::Momentum).into_iter();
        let points: Vec<(f64, Estimate)> = profile.map(|(height, rate)| (height / length, rate * scale)).collect();
        let most =
            points.iter().map(|(_, rate)| rate.value + rate.error).filter(|top| top.is_finite()).fold(0.0, f64::max);
        let centroid = moments.centroid.value;
        let lines = vec![
            Line::measured("momentum", 0, points),
            Line::curve(
                format!("centroid {}", moments.centroid),
                1,
                Mark::Curve,
                [(centroid, 0.0), (centroid, 0.95 * most)],
            ),
        ];
        Chart {
            name: "profile",
            title: "Momentum that leaves through the sides, over height".into(),
            shows: format!(
                "Averaged from {} to {} s; spread {}, skewness {}",
                self.window.from, self.window.until, moments.spread, moments.skewness
            ),
            x: Axis::linear("height / L", 0.0, self.profile.top / length),
            y: Axis::linear(
                "rate of momentum per height, times L / resultant",
                0.0,
                1.05 * most.max(f64::MIN_POSITIVE),
            ),
            lines,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::Ledger;
    use crate::observe::fake_jet::FakeJet;
    use crate::scene::Boundary;

    const DOMAIN: Domain = Domain { min: [-3.0, -3.0, -0.1], max: [3.0; 3], boundary: Boundary::Open, planar: false };

    fn profile(sides: &[Side]) -> Profile {
        Profile { sides: sides.into(), base: 0.0, length: 0.5, top: 3.0, cells: 6 }
    }

    fn outflow(sides: &[Side], batches: usize) -> Outflow {
        Outflow::over(profile(sides), DOMAIN, Window { from: 0.0, until: FakeJet::UNTIL, batches })
    }

    #[test]
    fn moments_of_profiles_with_known_answers() {
        // Evenly over 0 to 1; as x over 0 to 1; exponential: midpoints of many cells.
        let even = |density: &dyn Fn(f64) -> f64, end: f64| {
            let cells = 200_000;
            let at = |i: i32| (f64::from(i) + 0.5) * end / f64::from(cells);
            ProfileMoments::of((0..cells).map(|i| (at(i), density(at(i)) * end / f64::from(cells))))
        };
        let check = |moments: ProfileMoments, expected: [f64; 4]| {
            let ProfileMoments { resultant, centroid, spread, skewness } = moments;
            for (found, expected) in [resultant, centroid, spread, skewness].into_iter().zip(expected) {
                approx::assert_abs_diff_eq!(found, expected, epsilon = 1e-7);
            }
        };
        check(even(&|_| 2.0, 1.0), [2.0, 0.5, 1.0 / 12.0_f64.sqrt(), 0.0]);
        // Triangular: skewness -2 √2 / 5.
        check(even(&|x| x, 1.0), [0.5, 2.0 / 3.0, 1.0 / 18.0_f64.sqrt(), -2.0 * 2.0_f64.sqrt() / 5.0]);
        check(even(&|x| 3.0 * (-x).exp(), 60.0), [3.0, 1.0, 1.0, 2.0]);
        check(ProfileMoments::of([(0.069, 2.0), (0.069, 1.0)]), [3.0, 0.069, 0.0, 0.0]);
    }

    #[test]
    fn the_sides_and_the_rest_hold_what_the_ledger_saw_leave() {
        let sides = [Side::XMin, Side::XMax, Side::YMin];
        let mut watched = (outflow(&sides, 4), Ledger::default());
        FakeJet { grains: 3000, ..FakeJet::default() }.run(&mut watched);
        let (outflow, ledger) = watched;
        let [through, elsewhere] = outflow.totals();
        assert!(through.0 > 0.0 && elsewhere.0 > 0.0, "one side and the top are not among them");
        approx::assert_relative_eq!(through.0 + elsewhere.0, ledger.left().mass(), max_relative = 1e-14);
        approx::assert_relative_eq!(through.1 + elsewhere.1, ledger.left().momentum(), max_relative = 1e-12);
        approx::assert_relative_eq!(through.2 + elsewhere.2, ledger.left().energy(), max_relative = 1e-14);
        // Resultants are that per second, and so are the cells, which reach up to the top.
        let [mass, _, energy] =
            Quantity::ALL.map(|quantity| outflow.moments(quantity).resultant.value * FakeJet::UNTIL);
        approx::assert_relative_eq!(mass, through.0, max_relative = 1e-13);
        approx::assert_relative_eq!(energy, through.2, max_relative = 1e-13);
        let cells: f64 =
            outflow.profile(Quantity::Mass).iter().map(|(_, rate)| rate.value * 0.5 * FakeJet::UNTIL).sum();
        approx::assert_relative_eq!(cells, through.0, max_relative = 1e-13);
    }

    #[test]
    fn what_is_not_known_is_left_empty() {
        let table = |outflow: &Outflow| outflow.results().tables[1].rows.concat();
        let mut nothing = outflow(&[Side::XMin], 2);
        nothing.sample(&Snapshot { time: FakeJet::UNTIL, flights: &[], grains: &[] });
        assert!(nothing.results().pictures.is_empty());
        assert!(!table(&nothing).iter().any(|cell| cell.contains("NaN") || cell.contains("inf")));
    }

    #[test]
    fn momentum_counts_outwards_on_every_side() {
        let grain = Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 1, strength: 1.0 };
        let flight = |position: [f64; 3], velocity: [f64; 3]| Flight {
            position: position.into(),
            time: 0.0,
            velocity: velocity.into(),
            radius: 0.01,
        };
        let mut outflow = outflow(&[Side::XMin, Side::YMax], 2);
        let mut leave = |time, flight| outflow.passage(Passage::Left, time, &flight, &grain);
        leave(0.01, flight([-3.0, 1.0, 0.5], [-4.0, 1.0, 0.0]));
        leave(0.02, flight([1.0, 3.001, 1.5], [0.0, 4.0, 1.0]));
        leave(0.04, flight([-3.0, -1.0, 0.5], [-8.0, 0.0, 0.0]));
        leave(0.05, flight([3.0, 1.0, 0.5], [4.0, 1.0, 0.0]));
        outflow.passage(Passage::Removed, 0.05, &flight([-3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), &grain);
        outflow.sample(&Snapshot { time: FakeJet::UNTIL, flights: &[], grains: &[] });
        let moments = outflow.moments(Quantity::Momentum);
        assert_eq!(outflow.grains(), 3);
        assert_eq!(moments.resultant, Estimate::mean(&[16.0 / 0.03, 16.0 / 0.03]));
        // 8, 8 and 16 at heights of 1, 3 and 1 lengths.
        approx::assert_relative_eq!(moments.centroid.value, 1.5, max_relative = 1e-15);
        // Without one batch it is 1, without the other 2.
        approx::assert_relative_eq!(moments.centroid.error, 0.5, max_relative = 1e-15);
    }
}
