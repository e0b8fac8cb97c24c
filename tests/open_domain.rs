//! Grains that come from a nozzle and leave an open domain: nothing of them is lost, and none enters where another one is
//! (hard case 19).

use std::ops::ControlFlow;

use impinge::grains::Snapshot;
use impinge::observe::Ledger;
use impinge::scene::Scene;
use impinge::scheme::Observer;
use impinge::simulation::Simulation;
use impinge::source::Nozzle;

/// The deepest overlap of any two grains at any sample, over the smaller radius, by looking at all pairs.
#[derive(Default)]
struct AllPairs {
    samples: u32,
    most: usize,
    deepest: f64,
}

impl Observer for AllPairs {
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.samples += 1;
        self.most = self.most.max(snapshot.flights.len());
        for (number, a) in snapshot.flights.iter().enumerate() {
            for b in &snapshot.flights[..number] {
                let overlap = a.radius + b.radius - (a.position - b.position).norm();
                self.deepest = self.deepest.max(overlap / a.radius.min(b.radius));
            }
        }
    }
}

/// A jet on a disc; `flow` is its volume fraction, `more` goes into the scene.
fn run(flow: f64, until: f64) -> (AllPairs, Ledger, u64) {
    let text = format!(
        r#"
        seed = 3
        run = {{ until = {until} }}
        domain = {{ min = [-0.15, -0.15, -0.05], max = [0.15, 0.15, 0.25] }}
        grain = {{ radius = {{ mean = 0.004, cv = 0.2, distribution = "lognormal" }}, density = 2500 }}
        contact.grain = {{ restitution = 0.85, friction = 0.2 }}
        contact.surface = {{ restitution = 0.8, friction = 0.3 }}
        source = [{{ kind = "nozzle", shape = {{ circle = {{ diameter = 0.06 }} }}, centre = [0, 0, 0.2], axis = [0, 0, -1],
                    speed = 30, divergence = 3, flow = {{ volume_fraction = {flow} }} }}]
        surface = [{{ kind = "disc", centre = [0, 0, 0], normal = [0, 0, 1], radius = 0.08 }}]
        "#
    );
    let scene: Scene = toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = Simulation::new(&scene, ".".as_ref()).unwrap_or_else(|error| panic!("{error}"));
    let mut observed = (AllPairs::default(), Ledger::default());
    simulation.run(&mut observed, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|broken| panic!("{broken}"));
    let entered: u64 = simulation.nozzles().iter().map(Nozzle::entered).sum();
    assert_eq!(entered, observed.1.entered().count());
    (observed.0, observed.1, simulation.nozzles().iter().map(Nozzle::deferred).sum())
}

fn closes(pairs: &AllPairs, ledger: &Ledger) {
    assert_eq!(ledger.entered().count(), ledger.left().count() + ledger.inside().count());
    for (what, residual) in [
        ("mass", ledger.relative_mass_residual()),
        ("momentum", ledger.relative_momentum_residual()),
        ("energy", ledger.relative_energy_residual()),
    ] {
        assert!(residual.abs() < 1e-12, "{what}: {residual:e}");
    }
    assert!(pairs.deepest < 1e-9, "{:e}", pairs.deepest);
    assert!(ledger.max_overlap_over_radius() < 1e-9, "{:e}", ledger.max_overlap_over_radius());
}

#[test]
fn a_dilute_jet_loses_nothing() {
    let (pairs, ledger, deferred) = run(0.02, 0.5);
    closes(&pairs, &ledger);
    assert!(ledger.entered().count() > 2000 && ledger.left().count() > 2000 && ledger.counts().grain_grain > 500);
    assert!(deferred < ledger.entered().count() / 20 && pairs.samples == 200, "{deferred} deferred");
}

#[test]
fn a_dense_jet_defers_grains_and_overlaps_none() {
    let (pairs, ledger, deferred) = run(0.25, 0.06);
    closes(&pairs, &ledger);
    assert!(deferred > 10 && pairs.most > 300, "{deferred} deferred, at most {} inside", pairs.most);
}
