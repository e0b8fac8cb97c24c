//! What the tests of forces share: scenes under forces, what came of them, and the order in the sub-step.

use std::ops::ControlFlow;

use impinge::grains::{Grain, NewGrain};
use impinge::law::{ContactLaw, Friction, NearField, Term};
use impinge::near_field::{ForceSum, Method};
use impinge::observe::Ledger;
use impinge::scene::{self, Interference, PlaneSurface, RectangleSurface};
use impinge::scheme::{Collapse, EventDriven, Forces, Laws, Length, Observer, Substepped};
use impinge::surface::Surface;
use impinge_events::{Domain, Flight};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};

use super::{Log, grain, smooth};

/// Grains under forces.
#[derive(Clone, Debug)]
pub struct Scene {
    pub grains: Vec<NewGrain>,
    pub surface: Vec<scene::Surface>,
    pub domain: Domain,
    pub laws: Laws,
    /// m/s²
    pub gravity: Vector3<f64>,
    pub near_field: Option<NearField>,
}

/// What became of a scene.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// All grains at the end.
    pub states: Vec<(Flight, Grain)>,
    pub log: Log,
    pub ledger: Ledger,
    pub steps: u64,
}

impl Scene {
    /// Grains that nothing pulls and that bounce off each other without loss.
    pub fn of(grains: Vec<NewGrain>) -> Self {
        let domain = Domain::unbounded();
        Self {
            grains,
            surface: Vec::new(),
            domain,
            laws: smooth(1.0, 1.0),
            gravity: Vector3::zeros(),
            near_field: None,
        }
    }

    /// The scene, not yet begun.
    pub fn start(&self, length: Length) -> Substepped<Surface> {
        let surface = Surface::new(&self.surface, ".".as_ref()).expect("a surface");
        let engine = EventDriven::new(&self.grains, surface, self.domain, self.laws, 0.0);
        let sum = |law| ForceSum::new(law, Method::Direct, &self.domain).expect("a sum that suits the domain");
        let forces = Forces { gravity: self.gravity, near_field: self.near_field.map(sum), contact_time: 0.0 };
        Substepped::new(engine, forces, self.laws, length)
    }

    /// The scene in sub-steps of `step` (s) until `until` (s).
    pub fn run(&self, step: f64, until: f64) -> Outcome {
        self.run_with(Length::Fixed(step), until)
    }

    pub fn run_with(&self, length: Length, until: f64) -> Outcome {
        let mut run = self.start(length);
        let mut observers = (Log::default(), Ledger::default());
        look(&mut run, 0.0, &mut observers);
        advance(&mut run, until, &mut observers);
        look(&mut run, until, &mut observers);
        Outcome { states: states(&run, until), log: observers.0, ledger: observers.1, steps: run.steps() }
    }
}

/// Runs to `until` (s).
pub fn advance(run: &mut Substepped<Surface>, until: f64, observer: &mut impl Observer) {
    let flow = run.advance(until, observer, &mut |_| ControlFlow::Continue(())).expect("no broken invariant");
    assert!(flow.is_continue());
}

/// Tells the observer what forces did until `time` (s), to which the run has been advanced, and shows it the grains.
pub fn look(run: &mut Substepped<Surface>, time: f64, observer: &mut impl Observer) {
    run.tell(time, observer).expect("finite forces");
    run.engine().snapshot(time, |snapshot| observer.sample(snapshot));
}

/// All grains at `time` (s), to which the run has been advanced.
pub fn states(run: &Substepped<Surface>, time: f64) -> Vec<(Flight, Grain)> {
    run.engine()
        .snapshot(time, |snapshot| snapshot.flights.iter().copied().zip(snapshot.grains.iter().copied()).collect())
}

/// The law of PHYSICS section 5, F = -1/x² + 0.5/x³ (N), times `strength`: at contact, x = 1 m, it attracts.
pub fn attraction(strength: f64) -> NearField {
    let term = |alpha, beta| Term { alpha: alpha * strength, beta };
    NearField::new(term(1.0, 2.0), term(0.5, 3.0)).expect("a law")
}

/// The same restitution and friction everywhere.
pub fn rough(restitution: f64, mu: f64) -> Laws {
    let law = ContactLaw { restitution, friction: Friction::Coulomb { static_: mu, dynamic: mu } };
    Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic }
}

/// Side³ grains of radius `radius` (m) and 1 kg on a lattice of `pitch` (m) about the origin, a little off their places, at speeds of up to `speed`
/// (m/s) along each axis.
pub fn block(side: u32, radius: f64, pitch: f64, speed: f64) -> Vec<NewGrain> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(20);
    let mut within = |most: f64| Vector3::from_fn(|_, _| random.random_range(-1.0..1.0) * most);
    (0..side.pow(3))
        .map(|cell| {
            let place = Vector3::new(cell % side, cell / side % side, cell / side.pow(2)).map(f64::from);
            let place = place.add_scalar(0.5 - 0.5 * f64::from(side)) * pitch;
            grain(place + within(0.1 * (pitch - 2.0 * radius)), within(speed), radius, 1.0)
        })
        .collect()
}

/// The plane z = 0, hit from above.
pub fn floor() -> scene::Surface {
    plane([0.0; 3], [0.0, 0.0, 1.0])
}

pub fn plane(point: [f64; 3], normal: [f64; 3]) -> scene::Surface {
    scene::Surface::Plane(PlaneSurface { point, normal, velocity: [0.0; 3] })
}

/// The plane z = 0 in 2 × 8² triangles of a square with sides of `size` (m).
pub fn mesh_floor(size: f64) -> scene::Surface {
    scene::Surface::Rectangle(RectangleSurface {
        centre: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        along: [1.0, 0.0, 0.0],
        size: [size; 2],
        divisions: [8; 2],
        velocity: [0.0; 3],
    })
}

/// Distance of two states of a run: of all positions (m), and of all velocities, those of the surfaces of spinning grains among them (m/s).
fn distance(one: &[(Flight, Grain)], other: &[(Flight, Grain)]) -> [f64; 2] {
    assert_eq!(one.len(), other.len());
    let (mut places, mut velocities) = (0.0, 0.0);
    for ((flight, grain), (their_flight, their_grain)) in one.iter().zip(other) {
        places += (flight.position - their_flight.position).norm_squared();
        velocities += (flight.velocity - their_flight.velocity).norm_squared();
        velocities += (grain.spin - their_grain.spin).norm_squared() * flight.radius.powi(2);
    }
    [places.sqrt(), velocities.sqrt()]
}

/// Halvings of the sub-step over which an order is measured.
const HALVINGS: u32 = 5;
/// How much finer than the finest the reference is.
const FINER: u32 = 16;

/// Observed orders of positions and of velocities at `until` (s) in the sub-step: least-squares slopes over [`HALVINGS`] halvings.
///
/// The error of a collision depends on its phase in the sub-step. So each error is the root mean square over runs of `steps` to 3/2 `steps` sub-steps,
/// which sample the phases. `run` gives the states for a sub-step (s), `reference` those that are taken for exact, where they come from
/// somewhere else.
pub fn orders(
    steps: u32,
    until: f64,
    run: impl Fn(f64) -> Vec<(Flight, Grain)>,
    reference: Option<Vec<(Flight, Grain)>>,
) -> [f64; 2] {
    const PHASES: u32 = 60;
    let finest = f64::from(steps << HALVINGS) * f64::from(FINER);
    let reference = reference.unwrap_or_else(|| run(until / finest));
    let mut points = [Vec::new(), Vec::new()];
    for halving in 0..=HALVINGS {
        let mut squares = [0.0; 2];
        for phase in 0..PHASES {
            // A few steps more each time, and no simple ratios.
            let count = f64::from(steps << halving) * (1.0 + 0.5 * f64::from(phase) / f64::from(PHASES));
            let errors = distance(&run(until / count.floor()), &reference);
            squares = [0, 1].map(|i| squares[i] + errors[i].powi(2) / f64::from(PHASES));
        }
        let step = until / f64::from(steps << halving);
        points.iter_mut().zip(squares).for_each(|(points, square)| points.push((step.ln(), 0.5 * square.ln())));
    }
    eprintln!("errors {:?}", points.each_ref().map(|points| points.iter().map(|p| p.1.exp()).collect::<Vec<_>>()));
    points.each_ref().map(|points| slope(points))
}

/// Least-squares slope.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let covariance: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    covariance / points.iter().map(|point| (point.0 - x).powi(2)).sum::<f64>()
}
