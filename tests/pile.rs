//! Contacts at rest: grains that forces press together come to rest in finitely many events, stay at rest, and do not sink into each other.

use std::ops::ControlFlow;

use impinge::grains::Snapshot;
use impinge::observe::Ledger;
use impinge::scene::Scene;
use impinge::scheme::{GrainCollision, Kick, Observer, Passage, Rest, SurfaceHit};
use impinge::simulation::Simulation;
use impinge_events::{Flight, YIELDING};
use nalgebra::Vector3;

const GRAVITY: f64 = 9.81;
const RADIUS: f64 = 0.01;
/// Kinetic energy a grain, over m g r, that counts as rest: the energy of a fall by a ten-thousandth of a radius.
const RESTING: f64 = 1e-4;

/// What was seen at one sample.
struct Sample {
    time: f64,
    places: Vec<Vector3<f64>>,
    /// Kinetic energy a grain over m g r.
    energy: f64,
    /// Deepest overlap of two grains over the radius.
    overlap: f64,
    /// Collisions so far.
    events: u64,
}

/// Looks at grains of one radius.
#[derive(Default)]
struct Watch {
    ledger: Ledger,
    samples: Vec<Sample>,
}

impl Observer for Watch {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.ledger.grain_collision(collision);
    }
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.ledger.surface_hit(hit);
    }
    fn kick(&mut self, kick: &Kick) {
        self.ledger.kick(kick);
    }
    fn rest(&mut self, rest: &Rest) {
        self.ledger.rest(rest);
    }
    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &impinge::grains::Grain) {
        self.ledger.passage(passage, time, flight, grain);
    }
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.ledger.sample(snapshot);
        let places: Vec<_> = snapshot.flights.iter().map(|flight| flight.position).collect();
        let weight: f64 = snapshot.grains.iter().map(|grain| grain.mass * GRAVITY * RADIUS).sum();
        let counts = self.ledger.counts();
        self.samples.push(Sample {
            time: snapshot.time,
            overlap: deepest(snapshot.flights),
            places,
            energy: self.ledger.inside().energy() / weight,
            events: counts.grain_grain + counts.grain_surface,
        });
    }
}

/// Deepest overlap of two grains over the smaller radius.
fn deepest(flights: &[Flight]) -> f64 {
    let mut deepest = 0f64;
    for (number, one) in flights.iter().enumerate() {
        for other in &flights[..number] {
            let apart = (one.position - other.position).norm();
            deepest = deepest.max((one.radius + other.radius - apart) / one.radius.min(other.radius));
        }
    }
    deepest
}

fn watch(scene: &str) -> Watch {
    let scene: Scene = toml::from_str(scene).expect("a valid scene");
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut simulation = Simulation::new(&scene, &folder).expect("it can be run");
    let mut watch = Watch::default();
    simulation.run(&mut watch, &mut |_| ControlFlow::Continue(())).expect("no jam, no overlap");
    watch
}

/// Grains fall into a box of planes of the given half width (m).
fn pile(count: u32, half: f64, restitution: f64, friction: f64, step: f64, until: f64) -> String {
    let wall = |x: f64, y: f64| {
        format!("[[surface]]\nkind = \"plane\"\npoint = [{}, {}, 0]\nnormal = [{}, {}, 0]\n", x * half, y * half, -x, -y)
    };
    let walls = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].map(|(x, y)| wall(x, y)).concat();
    let inside = half - RADIUS;
    let height = f64::from(count) * 7e-6 / (4.0 * inside * inside) * 2.5 + 0.02;
    format!(
        "seed = 3
        run = {{ until = {until}, gravity = [0, 0, -{GRAVITY}], substep = {step} }}
        domain = {{ min = [-1, -1, -1], max = [1, 1, 9] }}
        grain = {{ radius = {RADIUS}, density = 2500 }}
        contact.grain = {{ restitution = {restitution}, friction = {friction} }}
        contact.surface = {{ restitution = {restitution}, friction = {friction} }}
        output = {{ samples = {samples} }}
        [[source]]
        kind = \"block\"
        min = [-{inside}, -{inside}, 0.02]
        max = [{inside}, {inside}, {height}]
        count = {count}
        velocity = [0, 0, -0.5]
        [[surface]]
        kind = \"plane\"
        point = [0, 0, 0]
        normal = [0, 0, 1]
        {walls}",
        samples = (until / 0.05).round() as u32 + 1,
    )
}

/// What may be said of a pile after it has come to rest.
struct AtRest {
    /// Deepest overlap of two grains over the radius, seen at an event or a sample.
    overlap: f64,
    /// Events a second and a grain over the last fifth.
    rate: f64,
    /// How many grains moved farther than 1e-4 radii in the last fifth.
    moved: usize,
    /// Largest kinetic energy over the last fifth.
    energy: f64,
    residual: f64,
}

fn at_rest(watch: &Watch) -> AtRest {
    let samples = &watch.samples;
    let (from, last) = (&samples[samples.len() * 4 / 5], samples.last().expect("samples"));
    let tail = samples.iter().filter(|sample| sample.time >= from.time);
    let moved = |(one, other): (&Vector3<f64>, &Vector3<f64>)| (one - other).norm() > 1e-4 * RADIUS;
    let at_samples = samples.iter().map(|sample| sample.overlap).fold(0.0, f64::max);
    let rest = AtRest {
        overlap: at_samples.max(watch.ledger.max_overlap_over_radius()),
        rate: (last.events - from.events) as f64 / (last.time - from.time) / last.places.len() as f64,
        moved: from.places.iter().zip(&last.places).filter(|pair| moved(*pair)).count(),
        energy: tail.map(|sample| sample.energy).fold(0.0, f64::max),
        residual: watch.ledger.relative_energy_residual().abs(),
    };
    println!(
        "events {}, overlap {:.1e}, rate {:.2} /s, moved {} of {}, energy {:.1e} m g r, residual {:.1e} {:.1e}",
        last.events,
        rest.overlap,
        rest.rate,
        rest.moved,
        last.places.len(),
        rest.energy,
        rest.residual,
        watch.ledger.relative_momentum_residual()
    );
    rest
}

/// What overlap a sub-step of length `step` (s) may leave: what grains yield, and how far paths under the weight of a pile `layers` deep depart
/// from their chords (a h²/8).
fn tolerance(step: f64, layers: f64) -> f64 {
    YIELDING + layers * GRAVITY * step * step / 8.0 / RADIUS
}

fn check(watch: &Watch, step: f64, layers: f64) {
    let rest = at_rest(watch);
    assert!(rest.overlap < tolerance(step, layers), "{:e} over {:e}", rest.overlap, tolerance(step, layers));
    assert!(rest.energy < RESTING, "{:e}", rest.energy);
    assert!(rest.rate < 1.0, "{}", rest.rate);
    assert!(rest.residual < 1e-3, "{:e}", rest.residual);
    assert!(watch.ledger.relative_momentum_residual() < 1e-9);
}

/// Nobody moves but a loose grain that rolls: nothing that is modelled stops it.
fn nobody_moves(watch: &Watch) {
    let rest = at_rest(watch);
    assert!(rest.moved <= 1 + watch.samples[0].places.len() / 50, "{}", rest.moved);
}

#[test]
fn a_pile_comes_to_rest_and_stays_at_rest() {
    let watch = watch(&pile(300, 0.06, 0.3, 0.4, 5e-4, 2.0));
    check(&watch, 5e-4, 12.0);
    nobody_moves(&watch);
}

/// `cargo test --release --test pile -- --ignored --nocapture two_thousand`
#[test]
#[ignore = "minutes"]
fn a_pile_of_two_thousand_grains_comes_to_rest_and_stays_at_rest() {
    let watch = watch(&pile(2000, 0.12, 0.3, 0.4, 5e-4, 2.0));
    check(&watch, 5e-4, 20.0);
    nobody_moves(&watch);
}

#[test]
fn grains_of_restitution_nought_come_to_rest() {
    check(&watch(&pile(100, 0.05, 0.0, 0.4, 5e-4, 1.5)), 5e-4, 8.0);
}

#[test]
fn grains_of_restitution_nine_tenths_come_to_rest() {
    check(&watch(&pile(60, 0.05, 0.9, 0.4, 5e-4, 4.0)), 5e-4, 8.0);
}

#[test]
fn smooth_grains_come_to_rest_in_a_box() {
    check(&watch(&pile(60, 0.05, 0.3, 0.0, 5e-4, 4.0)), 5e-4, 8.0);
}

#[test]
fn the_near_field_presses_grains_to_an_agglomerate_that_stays_together() {
    let scene = "seed = 1
        run = { until = 2 }
        domain = { min = [-2, -2, -2], max = [2, 2, 2] }
        grain = { radius = 0.01, density = 2500 }
        contact.grain = { restitution = 0.3, friction = 0.4 }
        output = { samples = 41 }
        near_field = { alpha1 = 1e-5, beta1 = 2, alpha2 = 0, beta2 = 3, sum = \"direct\", substep = 5e-4 }
        source = [{ kind = \"block\", min = [-0.05, -0.05, -0.05], max = [0.05, 0.05, 0.05], count = 60, velocity = [0, 0, 0] }]";
    let watch = watch(scene);
    let rest = at_rest(&watch);
    // All grains are within a sphere of packing fraction 0.3.
    let last = &watch.samples.last().expect("samples").places;
    let middle = last.iter().sum::<Vector3<f64>>() / last.len() as f64;
    let farthest = last.iter().map(|place| (place - middle).norm()).fold(0.0, f64::max);
    assert!(farthest < RADIUS * (60.0f64 / 0.3).cbrt(), "{farthest}");
    // All others pull at a grain at the edge of an agglomerate that is three radii wide: alpha1 / m = 1e-3 m³/s².
    let pull = 60.0 * 1e-3 / (3.0 * RADIUS).powi(2);
    assert!(rest.energy < RESTING && rest.rate < 1.0 && rest.overlap < tolerance(5e-4, pull / GRAVITY));
    assert!(watch.ledger.relative_momentum_residual() < 1e-9);
}

#[test]
fn light_grains_carry_a_heavy_one() {
    let mut scene = pile(60, 0.05, 0.3, 0.4, 5e-4, 2.0);
    scene += "[[source]]\nkind = \"lattice\"\nmin = [0, 0, 0.3]\nmax = [0.01, 0.01, 0.31]\ncells = [1, 1, 1]\nvelocity = [0, 0, 0]\ndensity = 250000\n";
    let watch = watch(&scene);
    // It weighs a hundred grains.
    check(&watch, 5e-4, 100.0);
    let heavy = watch.samples.last().and_then(|sample| sample.places.last()).expect("it is there");
    assert!(heavy.z > 0.99 * RADIUS, "{heavy}");
}

#[test]
fn asperities_fill_up() {
    let mut scene = pile(80, 0.06, 0.3, 0.4, 5e-4, 2.0);
    // Hills of a sine surface in place of the floor, with the walls of the box around them.
    let floor = "kind = \"plane\"\n        point = [0, 0, 0]\n        normal = [0, 0, 1]";
    assert!(scene.contains(floor));
    let hills = "kind = \"sine\"\ncentre = [0, 0, 0]\nsize = [0.2, 0.2]\namplitude = 0.008\nwavelength = 0.05\npieces = 24";
    scene = scene.replace(floor, hills).replace("0.02]", "0.03]");
    let watch = watch(&scene);
    check(&watch, 5e-4, 8.0);
    let lowest = watch.samples.last().expect("samples").places.iter().map(|place| place.z).fold(f64::MAX, f64::min);
    assert!(lowest > -0.008, "{lowest}");
}
