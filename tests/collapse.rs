//! Grains that collide again and again in no time: runs end, the energy that the treatment keeps is told, and nothing else changes.

mod common;

use common::{FLOOR, grain, kinetic_energy, run, smooth, states};
use impinge::law::{ContactLaw, Friction};
use impinge::observe::{Ledger, SurfaceEnergy};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, Laws, Observer as _};
use impinge::source;
use impinge_events::Domain;
use nalgebra::Vector3;

/// The smooth or rough reference jet of 2000 grains until 0.06 s: ledger and energy to the surface.
fn jet(restitution: f64, mu: f64, collapse: Collapse) -> (Ledger, SurfaceEnergy) {
    let scene: Scene = toml::from_str(
        r#"
        run.until = 0.06
        domain = { min = [-9, -9, -1], max = [9, 9, 9] }
        grain = { radius = 0.01, density = 8500 }
        source = [{ kind = "file", path = "jet_2000.csv" }]"#,
    )
    .unwrap();
    let placed = source::place(&scene, "tests/data".as_ref(), &|_, _| None).unwrap();
    let law = ContactLaw { restitution, friction: Friction::Coulomb { static_: mu, dynamic: mu } };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse };
    let mut engine: EventDriven<common::Plane> =
        EventDriven::new(&placed.grains, FLOOR, Domain::unbounded(), laws, 0.0);
    let mut observers = (Ledger::default(), SurfaceEnergy::default());
    engine.snapshot(0.0, |snapshot| observers.sample(snapshot));
    run(&mut engine, 0.06, &mut observers).expect("no jam");
    engine.snapshot(0.06, |snapshot| observers.sample(snapshot));
    observers
}

/// Jets of low restitution once collided without end (a collapse in the core), or stopped as jammed.
#[test]
fn jets_of_low_restitution_were_jammed() {
    for (restitution, mu) in [(0.0, 0.0), (0.0, 0.4), (0.2, 0.4), (0.5, 0.4)] {
        let (ledger, _) = jet(restitution, mu, Collapse::Elastic);
        let part = ledger.withheld() / ledger.energy_brought_in();
        assert!(ledger.relative_energy_residual().abs() < 1e-12);
        assert!((0.0..0.1).contains(&part), "restitution {restitution}, friction {mu}: {part} of E0 is withheld");
        assert!(ledger.max_overlap_over_radius() < 1e-9);
    }
}

/// Where nothing collapses the treatment is not there.
#[test]
fn a_jet_of_restitution_0_8_is_the_same_bit_for_bit() {
    let [(treated, surface), (plain, plain_surface)] = [Collapse::Elastic, Collapse::None].map(|c| jet(0.8, 0.4, c));
    assert_eq!(treated.withheld(), 0.0);
    assert_eq!(treated.inside(), plain.inside());
    assert_eq!(surface.all_hits(), plain_surface.all_hits());
}

/// Two grains and a wall at restitution 0.15: the collapse of PHYSICS hard case 2 is in a line and dies out by itself; the treatment counted 16
/// quick hits and kept some of its energy.
#[test]
fn the_collapse_of_two_grains_kept_energy() {
    let laws = smooth(0.15, 0.15);
    let fall = -Vector3::z();
    let grains = [grain(Vector3::z() * 0.8, fall, 0.5, 1.0), grain(Vector3::z() * 2.0, fall, 0.5, 1.0)];
    let mut engine: EventDriven<common::Plane> = EventDriven::new(&grains, FLOOR, Domain::unbounded(), laws, 0.0);
    let mut surface = SurfaceEnergy::default();
    run(&mut engine, 10.0, &mut surface).expect("no jam");
    assert!(kinetic_energy(&states(&engine, 10.0)) < 1e-28);
    // PHYSICS section 4 gives 0.6451 E0; the sum of the closed form is 0.645047.
    assert!((surface.all_hits() - 0.645_047).abs() < 1e-6, "{}", surface.all_hits());
}
