//! The ledger: mass, momentum and energy that came in, went out, changed hands and are there at the end.
//!
//! Whatever a scheme gets wrong shows up here as a residual: what came in less what can be accounted for.

use impinge_events::Flight;
use nalgebra::Vector3;

use super::{Forces, Sum, VectorSum};
use crate::grains::{Grain, Snapshot, kinetic_energy};
use crate::scheme::{GrainCollision, Kick, Observer, Passage, Rest, SurfaceHit};

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
    /// None until forces act.
    forces: Option<Forces>,
    /// The largest Σ m |v| and the largest kinetic energy (J) that any sample showed.
    peak: (f64, f64),
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

    /// Energy dissipated between grains, in collisions and in resting contacts, J.
    #[must_use]
    pub fn dissipated_grain(&self) -> f64 {
        self.dissipated_grain.value() + self.of_forces(Forces::rest_dissipated_grain)
    }

    /// Energy dissipated at the surface, in collisions and in resting contacts, J.
    #[must_use]
    pub fn dissipated_surface(&self) -> f64 {
        self.dissipated_surface.value() + self.of_forces(Forces::rest_dissipated_surface)
    }

    /// Energy that the laws would have dissipated in collapses, where collisions are elastic, J. It stays in the grains.
    #[must_use]
    pub fn withheld(&self) -> f64 {
        self.withheld.value()
    }

    /// Work that moving surfaces did on grains, on those that hit them and on those that rest on them, J.
    #[must_use]
    pub fn work_surface(&self) -> f64 {
        self.work_surface.value() + self.of_forces(Forces::rest_work_surface)
    }

    /// Momentum that the surface gave to grains, to those that hit it and to those that rest on it, N s.
    #[must_use]
    pub fn surface_impulse(&self) -> Vector3<f64> {
        self.surface_impulse.value() + self.of_forces(Forces::rest_impulse)
    }

    /// What forces and resting contacts did; none where no force acts.
    #[must_use]
    pub fn forces(&self) -> Option<&Forces> {
        self.forces.as_ref()
    }

    /// Energy that the near field gave to grains, J, as the residual counts it.
    ///
    /// Where the potential energy was summed and no grain came or went, what it fell by: then the residual shows what the sub-steps gain or
    /// lose. Otherwise the work that was done in kicks, as a grain that leaves takes with it potential energy that nobody has summed.
    #[must_use]
    pub fn given_by_near_field(&self) -> f64 {
        let Some(forces) = &self.forces else { return 0.0 };
        let passages = self.entered.count + self.left.count + self.removed.count;
        match (forces.potential_initial(), forces.potential_final()) {
            (Some(initial), Some(latest)) if passages == 0 => initial - latest,
            _ => forces.work_near_field(),
        }
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

    /// What energies of this run are measured by, J: E₀, or, where forces gave more than twice that, the largest energy that grains had at a sample or
    /// got from a force.
    #[must_use]
    pub fn energy_scale(&self) -> f64 {
        let brought_in = self.energy_brought_in();
        let largest = self.forces.as_ref().map_or(0.0, |forces| self.peak.1.max(forces.exchanged()));
        if largest > 2.0 * brought_in { largest } else { brought_in }
    }

    /// Mass that came in less mass that is accounted for, kg.
    #[must_use]
    pub fn mass_residual(&self) -> f64 {
        self.balance(Amounts::mass, 0.0).0
    }

    /// Energy that came in less energy that is accounted for, J:
    /// initial + entered + work of gravity + [given by the near field](Self::given_by_near_field) + work of moving surfaces + added to resting
    /// contacts − dissipated − left − removed − inside.
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
    /// Where a moving surface brought in the larger part, over what went out instead; where forces act, over the largest energy that grains
    /// had at a sample or got from a force, if that is more.
    #[must_use]
    pub fn relative_energy_residual(&self) -> f64 {
        relative(self.energy_balance())
    }

    /// The magnitude of the residual of momentum over Σ m |v| brought in.
    ///
    /// Where a moving surface brought in the larger part, over Σ m |v| of what went out instead; where forces act, over the largest Σ m |v| at a
    /// sample or the impulse of gravity, if that is more.
    #[must_use]
    pub fn relative_momentum_residual(&self) -> f64 {
        let gravity = self.of_forces(Forces::impulse_gravity);
        let given = self.surface_impulse() + gravity + self.of_forces(Forces::impulse_near_field);
        let residual = Vector3::from_fn(|axis, _| self.balance(|amounts| amounts.momentum()[axis], given[axis]).0);
        let mut scale = self.balance(Amounts::momentum_magnitude, 0.0).1;
        if self.forces.is_some() {
            scale = scale.max(self.peak.0).max(gravity.norm());
        }
        relative((residual.norm(), scale))
    }

    fn energy_balance(&self) -> (f64, f64) {
        let dissipated: Sum = [self.dissipated_grain(), self.dissipated_surface()].into_iter().collect();
        let Some(forces) = &self.forces else {
            return self.balance(Amounts::energy, self.work_surface() - dissipated.value());
        };
        let given = [self.work_surface(), forces.work_gravity(), self.given_by_near_field(), forces.rest_added()];
        let given: Sum = given.into_iter().chain([-dissipated.value()]).collect();
        let (residual, scale) = self.balance(Amounts::energy, given.value());
        (residual, scale.max(self.peak.1).max(forces.exchanged()))
    }

    /// A quantity of the forces; zero where there are none.
    fn of_forces<T: Default>(&self, of: impl Fn(&Forces) -> T) -> T {
        self.forces.as_ref().map_or_else(T::default, of)
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

    fn kick(&mut self, kick: &Kick) {
        let begun = self.initial.is_some();
        self.forces.get_or_insert_default().kick(kick, begun);
    }

    fn rest(&mut self, rest: &Rest) {
        if self.initial.is_some() {
            self.forces.get_or_insert_default().rest(rest);
        }
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
        let (momentum, energy) = self.peak;
        self.peak = (momentum.max(self.inside.momentum_magnitude()), energy.max(self.inside.energy()));
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
        let grains = [Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 }];
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
        let grains = [Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 }];
        let mut ledger = Ledger::default();
        ledger.sample(&Snapshot { time: 0.0, flights: &flight(2.0), grains: &grains });
        ledger.sample(&Snapshot { time: 1.0, flights: &flight(1.0), grains: &grains });
        assert_eq!((ledger.energy_residual(), ledger.relative_energy_residual()), (3.0, 0.75));
        assert_eq!(ledger.relative_momentum_residual(), 0.5);
    }

    /// One grain of 2 kg, moving along z, as a sample shows it.
    fn sample(ledger: &mut Ledger, time: f64, speed: f64) {
        let flights = [Flight { position: Vector3::zeros(), time: 0.0, velocity: Vector3::z() * speed, radius: 0.1 }];
        let grains = [Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 }];
        ledger.sample(&Snapshot { time, flights: &flights, grains: &grains });
    }

    /// A fall of 1 s at 8 m/s², in four kicks of which each does the work m v̄ Δv, a hit that halves the speed, and then rest.
    #[test]
    fn closes_on_a_fall_a_bounce_and_rest() {
        let mut ledger = Ledger::default();
        sample(&mut ledger, 0.0, 0.0);
        let fall = |ledger: &mut Ledger, from: f64, to: f64, potential: Option<f64>| {
            ledger.kick(&Kick {
                work_gravity: to * to - from * from,
                impulse_gravity: Vector3::z() * 2.0 * (to - from),
                potential_energy: potential,
                ..Kick::default()
            });
        };
        for quarter in 0..4 {
            fall(&mut ledger, -2.0 * f64::from(quarter), -2.0 * f64::from(quarter + 1), None);
        }
        sample(&mut ledger, 1.0, -8.0);
        assert_eq!((ledger.energy_residual(), ledger.relative_momentum_residual()), (0.0, 0.0));
        ledger.surface_hit(&SurfaceHit { impulse_normal: 24.0, dissipated: 48.0, ..FakeJet::hit(1) });
        fall(&mut ledger, 4.0, 1.0, None);
        // The surface catches it at 1 m/s, and then holds it for a sub-step; 0.25 J come from nowhere and say so.
        let catch = Rest { impulse_surface: Vector3::z() * -2.0, dissipated_surface: 1.25, ..Rest::default() };
        ledger.rest(&Rest { added: 0.25, contacts: 1, ..catch });
        fall(&mut ledger, 0.0, 0.0, None);
        sample(&mut ledger, 2.0, 0.0);
        assert_eq!((ledger.energy_residual(), ledger.relative_energy_residual()), (0.0, 0.0));
        assert_eq!(ledger.relative_momentum_residual(), 0.0);
        assert_eq!(ledger.surface_impulse(), Vector3::z() * 22.0);
        assert_eq!((ledger.dissipated_surface(), ledger.dissipated_grain()), (49.25, 0.0));
        let forces = ledger.forces().expect("gravity acted");
        assert_eq!((forces.work_gravity(), forces.rest_added(), forces.most_resting()), (49.0, 0.25, 1));
        assert_eq!((forces.potential_initial(), forces.potential_final()), (None, None));
    }

    #[test]
    fn the_potential_shows_what_the_sub_steps_gain() {
        let mut ledger = Ledger::default();
        // The kick that sets the scene up counts by its potential energy only.
        ledger.kick(&Kick { potential_energy: Some(-1.0), work_near_field: 7.0, ..Kick::default() });
        sample(&mut ledger, 0.0, 1.0);
        let kick = Kick { work_near_field: 3.0, impulse_near_field: Vector3::z() * 2.0, ..Kick::default() };
        ledger.kick(&kick);
        ledger.kick(&Kick { potential_energy: Some(-3.875), ..Kick::default() });
        sample(&mut ledger, 1.0, 2.0);
        let forces = *ledger.forces().expect("the near field acted");
        assert_eq!((forces.potential_initial(), forces.potential_final()), (Some(-1.0), Some(-3.875)));
        assert_eq!(forces.work_near_field(), 3.0);
        // The grain gained 3 J while the potential energy fell by 2.875 J; over the 4 J at the end.
        assert_eq!((ledger.energy_residual(), ledger.relative_energy_residual()), (-0.125, -0.125 / 4.0));
        assert_eq!(ledger.relative_momentum_residual(), 0.0);
    }

    #[test]
    fn a_grain_that_leaves_takes_potential_energy_along_so_that_work_counts() {
        let mut ledger = Ledger::default();
        sample(&mut ledger, 0.0, 1.0);
        ledger.kick(&Kick { potential_energy: Some(0.0), ..Kick::default() });
        ledger.kick(&Kick { potential_energy: Some(9.0), work_near_field: 3.0, ..Kick::default() });
        let flight = Flight { position: Vector3::zeros(), time: 0.0, velocity: Vector3::z() * 2.0, radius: 0.1 };
        let grain = Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 };
        ledger.passage(Passage::Left, 1.0, &flight, &grain);
        ledger.sample(&Snapshot { time: 1.0, flights: &[], grains: &[] });
        assert_eq!((ledger.given_by_near_field(), ledger.energy_residual()), (3.0, 0.0));
    }

    #[test]
    fn residuals_of_a_scene_at_rest_are_over_what_forces_gave() {
        let mut ledger = Ledger::default();
        sample(&mut ledger, 0.0, 0.0);
        let gravity = Kick { work_gravity: 10.0, impulse_gravity: Vector3::z() * -4.0, ..Kick::default() };
        ledger.kick(&gravity);
        ledger.surface_hit(&SurfaceHit { impulse_normal: 4.0, dissipated: 9.5, ..FakeJet::hit(1) });
        sample(&mut ledger, 1.0, 0.0);
        assert_eq!((ledger.energy_residual(), ledger.relative_energy_residual()), (0.5, 0.05));
        assert_eq!(ledger.relative_momentum_residual(), 0.0);
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
