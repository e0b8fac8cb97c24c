//! Piles: grains fall into a box under gravity, come to rest, and stay at rest.

mod common;

use std::ops::ControlFlow;

use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::observe::Ledger;
use impinge::scene::{self, Interference, PlaneSurface};
use impinge::scheme::{Collapse, EventDriven, Forces, GrainCollision, Laws, Length, Observer, Substepped, SurfaceHit};
use impinge::surface::Surface;
use impinge_events::Domain;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};

const GRAVITY: f64 = 9.81;
/// m
const RADIUS: f64 = 0.01;
/// Sub-step, s.
const STEP: f64 = 2e-4;
/// Deepest overlap, in radii: what grains may yield, and twice the sag g h² / 8 of their chords with as much again for forces that are not g.
const DEEPEST: f64 = 1e-4;
/// Speed that is rest, over that of a fall from a grain's radius.
const AT_REST: f64 = 1e-3;

/// Counts collisions.
#[derive(Default)]
struct Count(u64);

impl Observer for Count {
    fn grain_collision(&mut self, _collision: &GrainCollision) {
        self.0 += 1;
    }

    fn surface_hit(&mut self, _hit: &SurfaceHit) {
        self.0 += 1;
    }
}

fn plane(point: [f64; 3], normal: [f64; 3]) -> scene::Surface {
    scene::Surface::Plane(PlaneSurface { point, normal, velocity: [0.0; 3] })
}

/// `count` grains on a loose lattice, shaken, over the floor of a box as wide as the pile will be high.
fn box_of(count: u32, restitution: f64, mu: f64, step: f64) -> Substepped<Surface> {
    let friction = if mu > 0.0 { Friction::Coulomb { static_: mu, dynamic: mu } } else { Friction::Smooth };
    let law = ContactLaw { restitution, friction };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
    let side = RADIUS * (f64::from(count) / 2.0).cbrt() * 1.2;
    let walls = [
        plane([0.0; 3], [0.0, 0.0, 1.0]),
        plane([-side, 0.0, 0.0], [1.0, 0.0, 0.0]),
        plane([side, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        plane([0.0, -side, 0.0], [0.0, 1.0, 0.0]),
        plane([0.0, side, 0.0], [0.0, -1.0, 0.0]),
    ];
    let surface = Surface::new(&walls, ".".as_ref()).expect("planes");
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let (spacing, row) = (2.2 * RADIUS, (2.0 * side / (2.2 * RADIUS)).floor() as u32);
    let grains: Vec<_> = (0..count)
        .map(|number| {
            let cell = Vector3::new(number % row, number / row % row, number / row / row).map(f64::from);
            let corner = Vector3::new(-side, -side, 0.0).add_scalar(1.1 * RADIUS);
            let velocity = Vector3::from_fn(|_, _| random.random_range(-0.3..0.3));
            let position = corner + cell * spacing;
            NewGrain { position, velocity, spin: Vector3::zeros(), radius: RADIUS, density: 2500.0, strength: 1.0 }
        })
        .collect();
    let engine = EventDriven::new(&grains, surface, Domain::unbounded(), laws, 0.0);
    let forces = Forces { gravity: Vector3::z() * -GRAVITY, near_field: None, contact_time: 0.0 };
    Substepped::new(engine, forces, laws, Length::Fixed(step))
}

fn advance(run: &mut Substepped<Surface>, time: f64, observer: &mut impl Observer) {
    let flow = run.advance(time, observer, &mut |_| ControlFlow::Continue(())).expect("no broken invariant");
    assert!(flow.is_continue());
    run.tell(time, observer).expect("finite forces");
    run.engine().snapshot(time, |snapshot| observer.sample(snapshot));
}

fn places(run: &Substepped<Surface>, time: f64) -> Vec<Vector3<f64>> {
    run.engine().snapshot(time, |snapshot| snapshot.flights.iter().map(|flight| flight.position).collect())
}

/// Root mean square of the speeds over the speed of a fall from one radius.
fn motion(run: &Substepped<Surface>, time: f64) -> f64 {
    let squares = run.engine().snapshot(time, |snapshot| {
        snapshot.flights.iter().map(|flight| flight.velocity.norm_squared()).sum::<f64>()
            / snapshot.flights.len() as f64
    });
    (squares / (2.0 * GRAVITY * RADIUS)).sqrt()
}

/// A pile comes to rest by `settled` (s) and is at rest until `until` (s): hardly anything collides or moves; nothing sinks in; the books close.
fn comes_to_rest(count: u32, restitution: f64, mu: f64, step: f64, [settled, until]: [f64; 2]) {
    let what = format!("{count} grains, restitution {restitution}, friction {mu}");
    let mut run = box_of(count, restitution, mu, step);
    let mut observers = (Count::default(), Ledger::default());
    run.tell(0.0, &mut observers).expect("finite forces");
    run.engine().snapshot(0.0, |snapshot| observers.sample(snapshot));
    advance(&mut run, settled, &mut observers);
    let (before, falling) = (places(&run, settled), observers.0.0);
    advance(&mut run, until, &mut observers);
    let rate = (observers.0.0 - falling) as f64 / (until - settled) / f64::from(count);
    let mut moved: Vec<f64> = before.iter().zip(places(&run, until)).map(|(a, b)| (a - b).norm() / RADIUS).collect();
    moved.sort_by(f64::total_cmp);
    // Spheres have no rolling friction: a loose one rolls on in its cage.
    let (median, nearly_all) = (moved[moved.len() / 2], moved[moved.len() * 9 / 10]);
    let overlap = observers.1.max_overlap_over_radius();
    let energy = observers.1.relative_energy_residual();
    eprintln!(
        "{what}: {falling} collisions, then {rate:.2} a grain and second; moved by {median:.1e} radii, nine in ten by less than {nearly_all:.1e}; motion {:.1e}; \
         overlap {overlap:.1e}; energy residual {energy:.1e}; {} contacts at rest",
        motion(&run, until),
        run.resting()
    );
    assert!(motion(&run, until) < AT_REST, "{what}");
    assert!(median < 1e-3 && nearly_all < 0.05, "{what}: grains moved by {median} and {nearly_all} radii");
    assert!(rate < 10.0, "{what}: {rate} collisions a grain and second at rest");
    assert!(overlap < DEEPEST, "{what}: {overlap:e}");
    assert!(run.resting() > count, "{what}: {} contacts at rest", run.resting());
    assert!(energy.abs() < 1e-3, "{what}: {energy:e}");
    assert!(observers.1.relative_momentum_residual().abs() < 1e-11, "{what}");
    let lowest = places(&run, until).iter().map(|place| place.z).fold(f64::INFINITY, f64::min);
    assert!(lowest > RADIUS * (1.0 - DEEPEST), "{what}: a grain sank to {lowest} m");
}

#[test]
fn a_pile_of_300_comes_to_rest() {
    comes_to_rest(300, 0.3, 0.4, STEP, [1.5, 2.0]);
}

#[test]
fn plastic_grains_come_to_rest() {
    comes_to_rest(100, 0.0, 0.4, STEP, [1.0, 1.5]);
}

#[test]
#[ignore = "minutes"]
fn a_pile_of_2000_comes_to_rest() {
    // Friction of the deepest grains is several times their weight, and bends their paths by as much more.
    comes_to_rest(2000, 0.3, 0.4, 0.5 * STEP, [2.0, 2.5]);
}
