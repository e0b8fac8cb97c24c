//! The ledger: mass, momentum and energy that came in, went out, changed hands and are there at the end.
//!
//! Whatever a scheme gets wrong shows up here as a residual: what came in less what can be accounted for.

use impinge_events::Flight;
use nalgebra::Vector3;

use super::{Sum, VectorSum};
use crate::grains::{Grain, Snapshot, kinetic_energy};
use crate::scheme::{GrainCollision, Observer, Passage, SurfaceHit};

/// Mass, momentum and energy of some grains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Amounts {
    count: u64,
    mass: Sum,
    momentum: VectorSum,
    momentum_magnitude: Sum,
    energy: Sum,
}

impl Amounts {
    /// How many grains.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass.value()
    }

    /// Momentum Σ m v, kg m/s.
    #[must_use]
    pub fn momentum(&self) -> Vector3<f64> {
        self.momentum.value()
    }

    /// Σ m |v|, kg m/s: what a residual of momentum is measured against.
    #[must_use]
    pub fn momentum_magnitude(&self) -> f64 {
        self.momentum_magnitude.value()
    }

    /// Kinetic energy, rotation included, J.
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.energy.value()
    }

    fn add(&mut self, flight: &Flight, grain: &Grain) {
        self.count += 1;
        self.mass += grain.mass;
        self.momentum += flight.velocity * grain.mass;
        self.momentum_magnitude += flight.velocity.norm() * grain.mass;
        self.energy += kinetic_energy(flight, grain);
    }

    fn of(snapshot: &Snapshot<'_>) -> Self {
        let mut amounts = Self::default();
        snapshot.flights.iter().zip(snapshot.grains).for_each(|(flight, grain)| amounts.add(flight, grain));
        amounts
    }
}

/// How often what happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Collisions between two grains.
    pub grain_grain: u64,
    /// Collisions between a grain and the surface.
    pub grain_surface: u64,
    /// Grains that have hit the surface.
    pub first_hits: u64,
}

/// Mass, momentum and energy of a run, in and out.
///
/// The grains of the first sample are the initial ones; those of the last sample are the final ones.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    initial: Option<Amounts>,
    entered: Amounts,
    left: Amounts,
    removed: Amounts,
    inside: Amounts,
    dissipated_grain: Sum,
    dissipated_surface: Sum,
    withheld: Sum,
    work_surface: Sum,
    surface_impulse: VectorSum,
    counts: Counts,
    max_overlap_over_radius: f64,
}

impl Ledger {
    /// The grains of the first sample.
    #[must_use]
    pub fn initial(&self) -> Amounts {
        self.initial.unwrap_or_default()
    }

    /// The grains that sources brought in after that.
    #[must_use]
    pub fn entered(&self) -> Amounts {
        self.entered
    }

    /// The grains that left the domain, as they left it.
    #[must_use]
    pub fn left(&self) -> Amounts {
        self.left
    }

    /// The grains that were taken out of the run.
    #[must_use]
    pub fn removed(&self) -> Amounts {
        self.removed
    }

    /// The grains of the latest sample.
    #[must_use]
    pub fn inside(&self) -> Amounts {
        self.inside
    }

    /// Energy dissipated in collisions between grains, J.
    #[must_use]
    pub fn dissipated_grain(&self) -> f64 {
        self.dissipated_grain.value()
    }

    /// Energy dissipated in collisions with the surface, J.
    #[must_use]
    pub fn dissipated_surface(&self) -> f64 {
        self.dissipated_surface.value()
    }

    /// Energy that the laws would have dissipated in collapses, where collisions are elastic, J. It stays in the grains.
    #[must_use]
    pub fn withheld(&self) -> f64 {
        self.withheld.value()
    }

    /// Work that moving surfaces did on grains, J.
    #[must_use]
    pub fn work_surface(&self) -> f64 {
        self.work_surface.value()
    }

    /// Momentum that the surface gave to grains, N s.
    #[must_use]
    pub fn surface_impulse(&self) -> Vector3<f64> {
        self.surface_impulse.value()
    }

    /// How often what happened.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The deepest overlap at any event, over the smaller radius; 0 where grains never overlapped.
    #[must_use]
    pub fn max_overlap_over_radius(&self) -> f64 {
        self.max_overlap_over_radius
    }

    /// Energy that came in with grains, E₀, J.
    #[must_use]
    pub fn energy_brought_in(&self) -> f64 {
        self.initial().energy() + self.entered.energy()
    }

    /// Mass that came in less mass that is accounted for, kg.
    #[must_use]
    pub fn mass_residual(&self) -> f64 {
        self.balance(Amounts::mass, 0.0).0
    }

    /// Energy that came in less energy that is accounted for, J.
    #[must_use]
    pub fn energy_residual(&self) -> f64 {
        self.energy_balance().0
    }

    /// The residual of mass over the mass brought in.
    #[must_use]
    pub fn relative_mass_residual(&self) -> f64 {
        relative(self.balance(Amounts::mass, 0.0))
    }

    /// The residual of energy over the energy brought in.
    ///
    /// Where a moving surface brought in the larger part, over what went out instead.
    #[must_use]
    pub fn relative_energy_residual(&self) -> f64 {
        relative(self.energy_balance())
    }

    /// The magnitude of the residual of momentum over Σ m |v| brought in.
    ///
    /// Where a moving surface brought in the larger part, over Σ m |v| of what went out instead.
    #[must_use]
    pub fn relative_momentum_residual(&self) -> f64 {
        let given = self.surface_impulse();
        let residual = Vector3::from_fn(|axis, _| self.balance(|amounts| amounts.momentum()[axis], given[axis]).0);
        relative((residual.norm(), self.balance(Amounts::momentum_magnitude, 0.0).1))
    }

    fn energy_balance(&self) -> (f64, f64) {
        let dissipated: Sum = [self.dissipated_grain(), self.dissipated_surface()].into_iter().collect();
        self.balance(Amounts::energy, self.work_surface() - dissipated.value())
    }

    /// What came in less what went out or is still there, and the larger of the two sides.
    fn balance(&self, of: impl Fn(&Amounts) -> f64, given: f64) -> (f64, f64) {
        let came_in = [of(&self.initial()), of(&self.entered)];
        let went_out = [of(&self.left), of(&self.removed), of(&self.inside)];
        let residual: Sum = came_in.into_iter().chain([given]).chain(went_out.map(|amount| -amount)).collect();
        (residual.value(), came_in.iter().sum::<f64>().max(went_out.iter().sum()))
    }

    fn note_overlap(&mut self, overlap: f64) {
        // Not `max`: a NaN must not pass for a sound run.
        if overlap > self.max_overlap_over_radius || overlap.is_nan() {
            self.max_overlap_over_radius = overlap;
        }
    }
}

/// A residual over its scale. Where there was nothing at all the residual must be 0, and is shown as it stands.
fn relative((residual, scale): (f64, f64)) -> f64 {
    if scale > 0.0 { residual / scale } else { residual }
}

impl Observer for Ledger {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.counts.grain_grain += 1;
        self.dissipated_grain += collision.dissipated;
        self.withheld += collision.withheld;
        self.note_overlap(collision.overlap_over_radius);
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.counts.grain_surface += 1;
        self.counts.first_hits += u64::from(hit.order == 1);
        self.dissipated_surface += hit.dissipated;
        self.withheld += hit.withheld;
        self.work_surface += hit.work;
        self.surface_impulse += hit.normal * hit.impulse_normal + hit.impulse_tangential;
        self.note_overlap(hit.overlap_over_radius);
    }

    fn passage(&mut self, passage: Passage, _time: f64, flight: &Flight, grain: &Grain) {
        if self.initial.is_none() {
            return; // the first sample will report what these made of the scene
        }
        match passage {
            Passage::Entered => self.entered.add(flight, grain),
            Passage::Left => self.left.add(flight, grain),
            Passage::Removed => self.removed.add(flight, grain),
        }
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.inside = Amounts::of(snapshot);
        self.initial.get_or_insert(self.inside);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;

    fn observed(jet: &FakeJet) -> Ledger {
        let mut ledger = Ledger::default();
        jet.run(&mut ledger);
        ledger
    }

    #[test]
    fn closes_on_a_jet_that_collides_enters_and_leaves() {
        let ledger = observed(&FakeJet { grains: 2000, inflow: 200, ..FakeJet::default() });
        let counts = ledger.counts();
        assert!(counts.grain_grain > 1000 && counts.grain_surface > 2000 && counts.first_hits > 1500, "{counts:?}");
        assert_eq!((ledger.initial().count(), ledger.entered().count()), (2000, 200));
        assert!(ledger.left().count() > 100 && ledger.dissipated_surface() > 0.1 * ledger.energy_brought_in());
        assert_eq!(2200, ledger.left().count() + ledger.removed().count() + ledger.inside().count());
        assert!(ledger.relative_mass_residual().abs() < 1e-15, "{:e}", ledger.relative_mass_residual());
        assert!(ledger.relative_momentum_residual() < 1e-15, "{:e}", ledger.relative_momentum_residual());
        assert!(ledger.relative_energy_residual().abs() < 1e-15, "{:e}", ledger.relative_energy_residual());
    }

    #[test]
    fn closes_where_a_moving_surface_brings_all_the_energy() {
        let flight =
            |speed| [Flight { position: Vector3::zeros(), time: 0.0, velocity: Vector3::z() * speed, radius: 0.1 }];
        let grains = [Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0 }];
        let mut ledger = Ledger::default();
        ledger.sample(&Snapshot { time: 0.0, flights: &flight(0.0), grains: &grains });
        // A surface at 1 m/s, restitution 1/2: it leaves the grain at 1.5 m/s.
        ledger.surface_hit(&SurfaceHit { impulse_normal: 3.0, dissipated: 0.75, work: 3.0, ..FakeJet::hit(1) });
        ledger.sample(&Snapshot { time: 1.0, flights: &flight(1.5), grains: &grains });
        assert_eq!(ledger.relative_energy_residual(), 0.0);
        assert_eq!(ledger.relative_momentum_residual(), 0.0);
    }

    #[test]
    fn a_loss_that_nobody_accounts_for_is_the_residual() {
        let flight =
            |speed| [Flight { position: Vector3::zeros(), time: 0.0, velocity: Vector3::x() * speed, radius: 0.1 }];
        let grains = [Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0 }];
        let mut ledger = Ledger::default();
        ledger.sample(&Snapshot { time: 0.0, flights: &flight(2.0), grains: &grains });
        ledger.sample(&Snapshot { time: 1.0, flights: &flight(1.0), grains: &grains });
        assert_eq!((ledger.energy_residual(), ledger.relative_energy_residual()), (3.0, 0.75));
        assert_eq!(ledger.relative_momentum_residual(), 0.5);
    }

    #[test]
    fn the_deepest_overlap_is_kept_and_a_gap_is_none() {
        let mut ledger = Ledger::default();
        for overlap in [-1.0, 1e-12, 3e-12, 2e-12] {
            ledger.surface_hit(&SurfaceHit { overlap_over_radius: overlap, ..FakeJet::hit(1) });
        }
        assert_eq!(ledger.max_overlap_over_radius(), 3e-12);
        ledger.surface_hit(&SurfaceHit { overlap_over_radius: f64::NAN, ..FakeJet::hit(1) });
        assert!(ledger.max_overlap_over_radius().is_nan());
    }
}
