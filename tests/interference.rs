//! The four values of `interference`: first-order and repeated-collision energetics from one scene.

use std::ops::ControlFlow;

use impinge::observe::{Ledger, SurfaceEnergy};
use impinge::scene::{Overrides, SceneFile};
use impinge::simulation::Simulation;

const GRAINS: u64 = 1000;

/// The jet of `examples/erosive_jet.toml` with fewer grains, run to its end.
fn jet(interference: &str) -> (Ledger, SurfaceEnergy) {
    let set = [format!("run.interference={interference}"), format!("source[0].count={GRAINS}")];
    let overrides = Overrides { set: set.into(), ..Overrides::default() };
    let file =
        SceneFile::read("examples/erosive_jet.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = Simulation::new(&file.scene, file.folder()).unwrap_or_else(|error| panic!("{error}"));
    let mut observed = (Ledger::default(), SurfaceEnergy::default());
    let outcome =
        simulation.run(&mut observed, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(outcome.time, file.scene.run.until);
    let (ledger, surface) = observed;
    assert_eq!(ledger.initial().count(), GRAINS);
    assert_eq!(ledger.left().count() + ledger.removed().count() + ledger.inside().count(), GRAINS);
    assert!(ledger.relative_energy_residual().abs() < 1e-14, "{:e}", ledger.relative_energy_residual());
    assert!(ledger.relative_momentum_residual().abs() < 1e-14, "{:e}", ledger.relative_momentum_residual());
    assert!(ledger.relative_mass_residual().abs() < 1e-14, "{:e}", ledger.relative_mass_residual());
    (ledger, surface)
}

#[test]
fn without_interference_all_energy_reaches_the_surface_once() {
    let (ledger, surface) = jet("none");
    assert_eq!(
        (ledger.counts().grain_grain, ledger.counts().grain_surface, ledger.counts().first_hits),
        (0, GRAINS, GRAINS)
    );
    assert_eq!(surface.all_hits(), ledger.energy_brought_in());
    assert_eq!(surface.first_hits(), surface.all_hits());
    // Every grain keeps e² of its energy, and the rest is dissipated at the surface.
    approx::assert_relative_eq!(
        ledger.dissipated_surface(),
        (1.0 - 0.64) * ledger.energy_brought_in(),
        max_relative = 1e-13
    );
}

#[test]
fn in_first_order_no_grain_hits_twice() {
    let (ledger, surface) = jet("first-order");
    assert!(ledger.counts().grain_grain > GRAINS && ledger.counts().first_hits > GRAINS / 2, "{:?}", ledger.counts());
    assert_eq!(surface.by_order().len(), 1);
    assert_eq!(ledger.counts().grain_surface, ledger.counts().first_hits);
    // Shielding by rebounding grains costs the surface some of its energy, and all that arrives arrives once.
    assert!((0.05..0.95).contains(&(surface.all_hits() / ledger.energy_brought_in())));
    // 518 of 1000 on average over seeds, with a standard deviation of 17; with one seed rounding alone decides between 489 and 508.
    assert!(ledger.left().count() > 2 * GRAINS / 5, "grains that have hit pass through the surface and leave");
}

#[test]
fn grains_removed_on_their_first_collision_stay_in_the_ledger() {
    let (ledger, surface) = jet("removed-on-first-collision");
    let counts = ledger.counts();
    assert_eq!((counts.grain_grain, ledger.dissipated_grain()), (0, 0.0));
    assert_eq!((surface.by_order().len(), counts.grain_surface), (1, counts.first_hits));
    assert!(ledger.removed().count() > GRAINS / 2 && counts.first_hits > GRAINS / 50, "{counts:?}");
    // Each grain hits the surface, as fast as it came, or is removed, as fast as it came.
    assert_eq!(counts.first_hits + ledger.removed().count(), GRAINS);
    let each = ledger.energy_brought_in() / GRAINS as f64;
    approx::assert_relative_eq!(surface.all_hits(), each * counts.first_hits as f64, max_relative = 1e-13);
    approx::assert_relative_eq!(
        ledger.removed().energy(),
        each * ledger.removed().count() as f64,
        max_relative = 1e-13
    );
}

#[test]
fn with_all_interference_grains_come_back_to_the_surface() {
    let (ledger, surface) = jet("all");
    assert!(surface.by_order().len() > 3 && surface.by_order()[1].hits > 0);
    assert!(ledger.counts().grain_surface > ledger.counts().first_hits);
    assert!(surface.repeated_hits() > 0.0 && surface.all_hits() < ledger.energy_brought_in() / (1.0 - 0.8 * 0.8));
    assert_eq!(ledger.removed().count(), 0);
}
