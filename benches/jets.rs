//! The reference jets (tests/jets.rs, case A): whole runs until 0.06 s with the fast and the plain calendar, and on a flat mesh of
//! 100 000 triangles in place of the plane.
//!
//! `cargo bench --bench jets`; CPU times per grain–grain collision and ratios, measured in turns, come at the end.

mod support;

use criterion::{Criterion, criterion_group, criterion_main};
use impinge::grains::NewGrain;
use impinge::scene::{self, RectangleSurface};
use impinge::scheme::{Collapse, EventDriven};
use impinge::surface::Surface;
use impinge_events::calendar::{Buckets, Calendar, PlainCalendar};
use impinge_events::{Domain, Flight, Outlook, SurfaceContact};
use support::scenes::{JET_RESTITUTION, JET_UNTIL, plane, reference_jet, smooth, surface};
use support::{Duel, advance, duel, trial};

const ROUNDS: u32 = 5;

/// 2 × 224² = 100 352 triangles in the plane z = 0, each about as large as a grain. What lies further than 1 m from the middle is hit by
/// few grains.
fn mesh() -> Surface {
    let parts = if trial() { 8 } else { 224 };
    surface(scene::Surface::Rectangle(RectangleSurface {
        centre: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        along: [1.0, 0.0, 0.0],
        size: [2.0, 2.0],
        divisions: [parts; 2],
        velocity: [0.0; 3],
    }))
}

/// A surface at rest that all runs share: to copy a mesh for each of them would take longer than to run on it.
struct Shared<'a>(&'a Surface);

impl impinge_events::Surface for Shared<'_> {
    fn first_contact(&self, flight: &Flight, until: f64) -> Outlook {
        self.0.first_contact(flight, until)
    }

    fn contact(&self, element: u32, flight: &Flight) -> SurfaceContact {
        self.0.contact(element, flight)
    }

    fn speed(&self) -> f64 {
        0.0
    }

    fn start_epoch(&mut self, _duration: f64) {}
}

/// A whole run, from the placed grains to the end; gives the number of grain–grain collisions.
fn run<C: Calendar>(grains: &[NewGrain], surface: &Surface) -> u64 {
    let laws = smooth(JET_RESTITUTION, Collapse::Elastic);
    let mut engine: EventDriven<_, C> = EventDriven::new(grains, Shared(surface), Domain::unbounded(), laws, 0.0);
    advance(&mut engine, JET_UNTIL)
}

fn jets(c: &mut Criterion) {
    let plane = plane();
    let mesh = mesh();
    let rounds = if trial() { 1 } else { ROUNDS };
    let mut table = Vec::new();
    for count in [2000, 8000] {
        let mut grains = reference_jet(count);
        if trial() {
            grains.truncate(200);
        }
        let fast = || run::<Buckets>(&grains, &plane);
        let plain = || run::<PlainCalendar>(&grains, &plane);
        c.bench_function(&format!("jet of {count}/fast"), |b| b.iter(fast));
        c.bench_function(&format!("jet of {count}/plain"), |b| b.iter(plain));
        table.push((format!("jet of {count}, plain calendar"), duel(rounds, fast, plain)));
        if count == 8000 {
            let on_mesh = || run::<Buckets>(&grains, &mesh);
            c.bench_function(&format!("jet of {count}/{} triangles", mesh.elements()), |b| b.iter(on_mesh));
            table.push((format!("jet of {count}, {} triangles", mesh.elements()), duel(rounds, fast, on_mesh)));
        }
    }
    eprintln!(
        "\n{:42} {:>10} {:>12} {:>12} {:>10}",
        "CPU time per grain-grain collision", "collisions", "fast, plane", "this", "this/fast"
    );
    for (name, Duel { microseconds: [fast, this], ratio, collisions }) in table {
        eprintln!("{name:42} {collisions:10} {fast:9.3} µs {this:9.3} µs {ratio:10.2}");
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = jets }
criterion_main!(benches);
