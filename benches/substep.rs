//! What a sub-step costs beside the evaluation of its forces, when hardly any grain collides in it: direct sum and cut-off, each measured in turns
//! with the bare sum over the same places.
//!
//! `cargo bench --bench substep`; the ratios come at the end.

mod support;

use std::f64::consts::PI;
use std::ops::ControlFlow;

use criterion::{Criterion, criterion_group, criterion_main};
use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction, NearField, Term};
use impinge::near_field::{CutOff, ForceSum, Method};
use impinge::scene::Interference;
use impinge::scheme::{Collapse, EventDriven, Forces, GrainCollision, Laws, Length, Observer, Substepped};
use impinge_events::{Domain, NoSurface};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use support::{Duel, duel, trial};

/// Volume fraction of the cloud.
const FRACTION: f64 = 0.05;
const RADIUS: f64 = 0.01;
/// Sub-step, s, in which a grain of 1 m/s moves by a hundredth of its radius.
const STEP: f64 = 1e-4;
/// Cut-off over the radius: some fifty neighbours.
const CUT_OFF: f64 = 10.0;
const SUB_STEPS: u32 = 20;

/// Grains on a loose lattice, moving at random.
fn cloud(count: u32) -> (Vec<NewGrain>, Domain) {
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let cells = f64::from(count).cbrt().ceil() as u32;
    let side = RADIUS * (4.0 / 3.0 * PI / FRACTION).cbrt();
    let grains = (0..count).map(|number| {
        let place = Vector3::new(number % cells, number / cells % cells, number / cells / cells).map(f64::from);
        let mut shaken = |size: f64| Vector3::from_fn(|_, _| random.random_range(-size..size));
        let position = (place.add_scalar(0.5) + shaken(0.15)) * side;
        NewGrain {
            position,
            velocity: shaken(1.0),
            spin: Vector3::zeros(),
            radius: RADIUS,
            density: 2500.0,
            strength: 1.0,
        }
    });
    let max = Vector3::repeat(f64::from(cells) * side);
    (grains.collect(), Domain { min: Vector3::zeros(), max, periodic: true, planar: false })
}

#[derive(Default)]
struct Count(u64);

impl Observer for Count {
    fn grain_collision(&mut self, _collision: &GrainCollision) {
        self.0 += 1;
    }
}

/// A sub-step against its bare sum, and how many grains collide in one.
fn against_sum(count: u32, method: Method, periodic: bool) -> (Duel, f64) {
    let (grains, mut domain) = cloud(count);
    domain.periodic = periodic;
    // A repulsion that hardly moves anybody.
    let law = NearField::new(Term { alpha: 1e-9, beta: 2.0 }, Term { alpha: 1e-10, beta: 3.0 }).expect("a law");
    let sum = || ForceSum::new(law, method, &domain).expect("a way to sum");
    let contact = ContactLaw { restitution: 0.9, friction: Friction::Smooth };
    let laws = Laws { grain: contact, surface: contact, interference: Interference::All, collapse: Collapse::Elastic };
    let engine = EventDriven::<NoSurface>::new(&grains, NoSurface, domain, laws, 0.0);
    let forces = Forces { gravity: Vector3::zeros(), near_field: Some(sum()), contact_time: 0.0 };
    let mut scheme = Substepped::new(engine, forces, laws, Length::Fixed(STEP));
    let mut places: Vec<_> = grains.iter().map(|grain| grain.position).collect();
    let (mut bare, mut out) = (sum(), vec![Vector3::zeros(); places.len()]);
    let (mut time, mut count) = (0.0, Count::default());
    let rounds = if trial() { 1 } else { 15 };
    let mut whole = || {
        time += STEP * f64::from(SUB_STEPS);
        let flow = scheme.advance(time, &mut count, &mut |_| ControlFlow::Continue(())).expect("a sound run");
        assert!(flow.is_continue());
        u64::from(SUB_STEPS)
    };
    let mut alone = || {
        for _ in 0..SUB_STEPS {
            // The grains move here too: neighbour lists age as they do in a run.
            for (place, grain) in places.iter_mut().zip(&grains) {
                *place += grain.velocity * STEP;
                domain.wrap(place);
            }
            bare.forces(&places, None, &mut out).expect("finite forces");
        }
        u64::from(SUB_STEPS)
    };
    whole();
    let duel = duel(rounds, &mut alone, &mut whole);
    let steps = f64::from((rounds + 1) * SUB_STEPS);
    (duel, 2.0 * count.0 as f64 / steps / f64::from(grains.len() as u32))
}

fn substep(_: &mut Criterion) {
    let cut_off = Method::CutOff(CutOff { radius: CUT_OFF * RADIUS, switch_width: RADIUS, skin: RADIUS });
    let scenes: &[(&str, u32, Method, bool)] = if trial() {
        &[("direct", 64, Method::Direct, false), ("cut-off", 1000, cut_off, true)]
    } else {
        &[
            ("direct", 500, Method::Direct, false),
            ("direct", 2000, Method::Direct, false),
            ("cut-off", 8000, cut_off, true),
            ("cut-off", 64_000, cut_off, true),
        ]
    };
    eprintln!(
        "\n{:28} {:>12} {:>12} {:>11} {:>24}",
        "CPU time of a sub-step", "bare sum", "sub-step", "ratio", "colliding in a sub-step"
    );
    for &(way, count, method, periodic) in scenes {
        let (Duel { microseconds: [bare, whole], ratio, .. }, colliding) = against_sum(count, method, periodic);
        let name = format!("{way}, {count} grains");
        eprintln!("{name:28} {bare:9.0} µs {whole:9.0} µs {ratio:11.2} {:22.2} %", 100.0 * colliding);
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = substep }
criterion_main!(benches);
