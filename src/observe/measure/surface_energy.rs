//! Energy that grains bring to the surface over time, and the interference parameter (Mukherjee & Zohdi 2015, section 4.2).

use super::{Measurement, Results, Window};
use crate::estimate::Estimate;
use crate::grains::{Grain, Snapshot};
use crate::observe::{Ledger, OrderTally, Sum, SurfaceEnergy};
use crate::scene::{Scene, SurfaceEnergyMeasure};
use crate::scheme::{GrainCollision, Kick, Observer, Passage, Rest, SurfaceHit};
use crate::shown::{Axis, Chart, Line, Mark, Picture, Table};

/// alpha_interf = E_f/E_0 - e² (Mukherjee & Zohdi 2015, eq. 47): the part of the energy that a jet still has when all is over, less what it would
/// have if its grains hit the surface once each and never each other.
///
/// Above 0 more energy is left than without interference, below 0 less. The paper takes the first for slow grains that are trapped near the surface.
/// Jets of smooth grains of low restitution do have it, but there it is energy of motion along the surface, which is kept for good (the study
/// `002-fig16`). Where a run is stopped before all grains have hit, what they still bring counts as left.
///
/// ```
/// use impinge::observe::measure::interference_parameter;
///
/// assert_eq!(interference_parameter(0.25, 0.5), 0.0); // grains that nothing disturbs
/// assert!(interference_parameter(0.1, 0.5) < 0.0);
/// ```
#[must_use]
pub fn interference_parameter(left_over_e0: f64, restitution: f64) -> f64 {
    left_over_e0 - restitution * restitution
}

/// Energy to the surface, batch by batch, by hit order, along the normal and along the surface.
///
/// The same energy counts again each time a grain brings it back. Mean powers have the standard errors of the scatter of the batches: right where
/// the jet is steady, and too large where it comes and goes.
#[derive(Clone, Debug)]
pub struct EnergyInTime {
    window: Window,
    /// Restitution at the surface, where the interference parameter is defined: where no force acts.
    restitution: Option<f64>,
    ledger: Ledger,
    batches: Vec<SurfaceEnergy>,
    reached: f64,
}

impl EnergyInTime {
    /// The measurement that a scene asks for.
    #[must_use]
    pub fn new(measure: &SurfaceEnergyMeasure, scene: &Scene) -> Self {
        let window = Window::new(crate::scene::Measure::SurfaceEnergy(measure.clone()).span(), &scene.run);
        let law = scene.contact.surface.as_ref().filter(|_| !scene.has_forces());
        Self::over(window, law.map(|law| law.restitution))
    }

    /// Over a window; with restitution at the surface it tells the interference parameter.
    #[must_use]
    pub fn over(window: Window, restitution: Option<f64>) -> Self {
        let batches = vec![SurfaceEnergy::default(); window.batches];
        Self { window, restitution, ledger: Ledger::default(), batches, reached: f64::NEG_INFINITY }
    }

    /// The interference parameter at the last sample; none where forces act or the surface moves.
    #[must_use]
    pub fn alpha(&self) -> Option<f64> {
        let left = (self.ledger.inside().energy() + self.ledger.left().energy()) / self.ledger.energy_brought_in();
        let defined = left.is_finite() && self.ledger.work_surface() == 0.0;
        self.restitution.filter(|_| defined).map(|restitution| interference_parameter(left, restitution))
    }

    /// Mean power (W) of something that each batch has got; batches that the run was broken off in do not count.
    #[must_use]
    pub fn power(&self, of: impl Fn(&SurfaceEnergy) -> f64) -> Estimate {
        // The end of the last batch may be off the end of the run by the rounding of both.
        const ROUNDING: f64 = 1e-9;
        let length = self.window.batch_length();
        let over = (((self.reached - self.window.from) / length + ROUNDING).max(0.0) as usize).min(self.batches.len());
        Estimate::mean(&self.batches[..over].iter().map(|batch| of(batch) / length).collect::<Vec<_>>())
    }

    fn start(&self, batch: usize) -> f64 {
        self.window.from + batch as f64 * self.window.batch_length()
    }
}

/// Energy along the normal, along the surface and in rotation (J) of all orders.
fn parts(energy: &SurfaceEnergy) -> [f64; 3] {
    let sum = |of: fn(&OrderTally) -> f64| energy.by_order().iter().map(of).collect::<Sum>().value();
    [sum(|tally| tally.normal.value()), sum(|tally| tally.tangential.value()), sum(|tally| tally.spin.value())]
}

impl Observer for EnergyInTime {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.ledger.surface_hit(hit);
        if let Some(batch) = self.window.batch(hit.time) {
            self.batches[batch].surface_hit(hit);
        }
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.ledger.sample(snapshot);
        self.reached = snapshot.time;
    }

    fn passage(&mut self, passage: Passage, time: f64, flight: &impinge_events::Flight, grain: &Grain) {
        self.ledger.passage(passage, time, flight, grain);
    }

    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.ledger.grain_collision(collision);
    }

    fn kick(&mut self, kick: &Kick) {
        self.ledger.kick(kick);
    }

    fn rest(&mut self, rest: &Rest) {
        self.ledger.rest(rest);
    }
}

impl Measurement for EnergyInTime {
    fn results(&self) -> Results {
        let tables = vec![self.history(), self.orders(), self.totals()];
        Results { tables, pictures: self.picture().into_iter().collect(), ..Results::default() }
    }
}

impl EnergyInTime {
    fn history(&self) -> Table {
        let columns =
            &["from", "until", "hits", "energy", "normal", "tangential", "spin", "first_hits", "repeated_hits"];
        let mut table = Table::new("history", columns);
        for (index, batch) in self.batches.iter().enumerate() {
            let hits: u64 = batch.by_order().iter().map(|tally| tally.hits).sum();
            let [normal, tangential, spin] = parts(batch);
            table.row(&[
                &self.start(index),
                &self.start(index + 1),
                &hits,
                &batch.all_hits(),
                &normal,
                &tangential,
                &spin,
                &batch.first_hits(),
                &batch.repeated_hits(),
            ]);
        }
        table
    }

    fn orders(&self) -> Table {
        let mut table = Table::new("orders", &["order", "hits", "normal", "tangential", "spin"]);
        let most = self.batches.iter().map(|batch| batch.by_order().len()).max().unwrap_or(0);
        for order in 0..most {
            let tallies = || self.batches.iter().filter_map(|batch| batch.by_order().get(order));
            let sum = |of: fn(&OrderTally) -> f64| tallies().map(of).collect::<Sum>().value();
            let hits: u64 = tallies().map(|tally| tally.hits).sum();
            table.row(&[
                &(order + 1),
                &hits,
                &sum(|tally| tally.normal.value()),
                &sum(|tally| tally.tangential.value()),
                &sum(|tally| tally.spin.value()),
            ]);
        }
        table
    }

    fn totals(&self) -> Table {
        let mut table = Table::new("totals", &["quantity", "value", "error", "unit"]);
        let mut row = |name: &str, value: Estimate, unit: &str| {
            let number = |number: f64| if number.is_finite() { number.to_string() } else { String::new() };
            table.row(&[&name, &number(value.value), &number(value.error), &unit]);
        };
        row("mean_power", self.power(SurfaceEnergy::all_hits), "W");
        row("mean_power_normal", self.power(|batch| parts(batch)[0]), "W");
        row("mean_power_tangential", self.power(|batch| parts(batch)[1]), "W");
        row("mean_power_spin", self.power(|batch| parts(batch)[2]), "W");
        row("mean_power_first_hits", self.power(SurfaceEnergy::first_hits), "W");
        row("mean_power_repeated_hits", self.power(SurfaceEnergy::repeated_hits), "W");
        // One run does not tell how sure what it ends with is.
        let once = |value| Estimate { value, error: f64::NAN };
        row("energy_brought_in", once(self.ledger.energy_brought_in()), "J");
        if let Some(alpha) = self.alpha() {
            row("interference_parameter", once(alpha), "");
        }
        table
    }

    /// Power over time; none where nothing hits.
    fn picture(&self) -> Option<Picture> {
        let e0 = self.ledger.energy_brought_in();
        let length = self.window.batch_length();
        let curve = |name, colour, mark, of: &dyn Fn(&SurfaceEnergy) -> f64| {
            let points = self.batches.iter().enumerate();
            Line::curve(
                name,
                colour,
                mark,
                points.map(|(index, batch)| (self.start(index) + 0.5 * length, of(batch) / length / e0)),
            )
        };
        let lines = vec![
            curve("all hits", 0, Mark::Curve, &SurfaceEnergy::all_hits),
            curve("  along the normal", 0, Mark::Dashed, &|batch| parts(batch)[0]),
            curve("first hits", 1, Mark::Curve, &SurfaceEnergy::first_hits),
        ];
        let most = lines.iter().flat_map(|line| &line.points).map(|(_, at)| at.value).fold(0.0, f64::max);
        (most > 0.0 && most.is_finite()).then(|| {
            Picture::Chart(Chart {
                name: "power",
                title: "Energy to the surface over time".into(),
                shows: "Power over E0, the energy that was brought in".into(),
                x: Axis::linear("time / s", self.window.from, self.window.until),
                y: Axis::linear("power / E0 in 1/s", 0.0, 1.1 * most),
                lines,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;

    const WINDOW: Window = Window { from: 0.0, until: FakeJet::UNTIL, batches: 6 };

    fn watched(window: Window, part: f64) -> (EnergyInTime, SurfaceEnergy) {
        let mut watched = (EnergyInTime::over(window, Some(0.8)), SurfaceEnergy::default());
        FakeJet { inflow: 200, part, ..FakeJet::default() }.run(&mut watched);
        watched
    }

    #[test]
    fn batches_add_up_to_the_totals_of_the_run() {
        let (in_time, all) = watched(WINDOW, 1.0);
        let sum = |of: fn(&SurfaceEnergy) -> f64| in_time.batches.iter().map(of).sum::<f64>();
        approx::assert_relative_eq!(sum(SurfaceEnergy::all_hits), all.all_hits(), max_relative = 1e-13);
        approx::assert_relative_eq!(sum(SurfaceEnergy::first_hits), all.first_hits(), max_relative = 1e-13);
        let [normal, tangential, spin] =
            [0, 1, 2].map(|part| in_time.batches.iter().map(|b| parts(b)[part]).sum::<f64>());
        approx::assert_relative_eq!(normal + tangential + spin, all.all_hits(), max_relative = 1e-13);
        let power = in_time.power(SurfaceEnergy::all_hits);
        approx::assert_relative_eq!(power.value * FakeJet::UNTIL, all.all_hits(), max_relative = 1e-12);
        let energies: Vec<f64> = in_time.batches.iter().map(|batch| batch.all_hits() / 0.01).collect();
        approx::assert_relative_eq!(power.error, Estimate::mean(&energies).error, max_relative = 1e-9);
        assert_eq!(in_time.results().tables[1].rows.len(), all.by_order().len());
    }

    #[test]
    fn a_batch_in_which_the_run_was_broken_off_does_not_count() {
        let (whole, _) = watched(WINDOW, 1.0);
        let (half, _) = watched(WINDOW, 0.55);
        let mean = Estimate::mean(&whole.batches[..3].iter().map(|batch| batch.all_hits() / 0.01).collect::<Vec<_>>());
        approx::assert_relative_eq!(half.power(SurfaceEnergy::all_hits).value, mean.value, max_relative = 1e-9);
    }

    #[test]
    fn the_interference_parameter_is_what_is_left_less_e_squared() {
        let (in_time, _) = watched(WINDOW, 1.0);
        let left =
            (in_time.ledger.inside().energy() + in_time.ledger.left().energy()) / in_time.ledger.energy_brought_in();
        assert_eq!(in_time.alpha(), Some(left - 0.8 * 0.8));
        assert!(EnergyInTime { restitution: None, ..in_time }.alpha().is_none());
    }
}
