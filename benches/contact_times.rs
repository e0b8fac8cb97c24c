//! Contact times, one at a time: sphere and sphere, sphere and plane, sphere and triangle.
//!
//! `cargo bench --bench contact_times`

mod support;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use impinge_events::Flight;
use impinge_events::contact_time::{sphere_plane, sphere_sphere, sphere_triangle};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// States to choose from: too many for the branches to be learnt by heart, few enough for the nearest cache.
const STATES: usize = 256;

type Pair = [Flight; 2];

fn flight(random: &mut Pcg64) -> Flight {
    let mut any = |half: f64| Vector3::from_fn(|_, _| random.random_range(-half..half));
    Flight { position: any(3.0), velocity: any(1.0), time: any(0.1).x, radius: 0.5 }
}

/// What becomes of a pair.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Hit,
    Miss,
    Receding,
}

impl Fate {
    fn of([a, b]: &Pair) -> Self {
        let now = a.time.max(b.time);
        let apart = b.position_at(now) - a.position_at(now);
        match sphere_sphere(a, b, Vector3::zeros()) {
            Some(_) => Self::Hit,
            None if apart.dot(&(b.velocity - a.velocity)) < 0.0 => Self::Miss,
            None => Self::Receding,
        }
    }
}

/// Measures `predict` on one state after the other.
fn measure<T>(c: &mut Criterion, name: &str, states: &[T], predict: impl Fn(&T) -> Option<f64>) {
    let mut turn = states.iter().cycle();
    c.bench_function(&format!("contact time/{name}"), |b| {
        b.iter(|| turn.next().map(|state| predict(black_box(state))));
    });
}

fn contact_times(c: &mut Criterion) {
    let mut random = Pcg64::seed_from_u64(1);
    for (name, fate) in [("hit", Fate::Hit), ("miss", Fate::Miss), ("receding", Fate::Receding)] {
        let pairs = std::iter::repeat_with(|| [flight(&mut random), flight(&mut random)]);
        let pairs: Vec<Pair> = pairs.filter(|pair| Fate::of(pair) == fate).take(STATES).collect();
        measure(c, &format!("sphere-sphere {name}"), &pairs, |[a, b]| sphere_sphere(a, b, Vector3::zeros()));
    }

    let flights: Vec<Flight> = std::iter::repeat_with(|| flight(&mut random)).take(STATES).collect();
    measure(c, "sphere-plane", &flights, |flight| sphere_plane(flight, Vector3::zeros(), Vector3::z()));

    let mut corner = || Vector3::from_fn(|_, _| random.random_range(-2.0..2.0));
    let triangles: Vec<_> = flights.iter().map(|flight| (*flight, [corner(), corner(), corner()])).collect();
    measure(c, "sphere-triangle, edges and corners open", &triangles, |(flight, corners)| {
        sphere_triangle(flight, *corners)
    });
}

criterion_group! { name = benches; config = support::criterion(); targets = contact_times }
criterion_main!(benches);
