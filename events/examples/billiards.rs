//! Billiards in thirty lines: fifteen balls, a cue ball and four cushions, without friction.

use impinge_events::contact_time::sphere_plane;
use impinge_events::{Domain, Encounter, Encounters, Flight, Outlook, Surface, SurfaceContact};
use nalgebra::Vector3;

struct Cushions([(Vector3<f64>, Vector3<f64>); 4]);

impl Surface for Cushions {
    fn first_contact(&self, ball: &Flight, _until: f64) -> Outlook {
        let hits = (0..).zip(self.0).filter_map(|(k, (point, normal))| Some((sphere_plane(ball, point, normal)?, k)));
        let first = hits.min_by(|a, b| a.partial_cmp(b).unwrap());
        first.map_or(Outlook::ClearUntil(f64::INFINITY), |(time, element)| Outlook::Hit { time, element })
    }

    fn contact(&self, element: u32, ball: &Flight) -> SurfaceContact {
        let (point, normal) = self.0[element as usize];
        let gap = (ball.position - point).dot(&normal) - ball.radius;
        SurfaceContact { normal, gap, velocity: Vector3::zeros() }
    }

    fn speed(&self) -> f64 {
        0.0
    }

    fn start_epoch(&mut self, _duration: f64) {}
}

fn main() {
    let [x, y] = [Vector3::x(), Vector3::y()];
    let cushions = Cushions([(-1.2 * x, x), (1.2 * x, -x), (-0.6 * y, y), (0.6 * y, -y)]);
    let ball = |x, y, speed| Flight {
        position: Vector3::new(x, y, 0.0),
        time: 0.0,
        velocity: Vector3::x() * speed,
        radius: 0.028,
    };
    let rack = (0..5).flat_map(|row| (0..=row).map(move |k| (row, f64::from(k) - f64::from(row) / 2.0)));
    let mut balls: Vec<Flight> = rack.map(|(row, k)| ball(0.6 + 0.05 * f64::from(row), 0.058 * k, 0.0)).collect();
    balls.push(ball(-0.6, 0.01, 3.0));

    let mut table: Encounters<Cushions> = Encounters::new(balls, cushions, Domain::unbounded(), f64::INFINITY);
    let (mut clicks, mut thuds) = (0, 0);
    while let Some((_, encounter)) = table.next_before(10.0) {
        match encounter {
            Encounter::Grains { a, b } => {
                let (one, two) = (*table.flight(a), *table.flight(b));
                let normal = (two.position - one.position).normalize();
                let exchanged = normal * (two.velocity - one.velocity).dot(&normal);
                table.deflect(&[(a, one.velocity + exchanged), (b, two.velocity - exchanged)]);
                clicks += 1;
            }
            Encounter::Surface { grain, element } => {
                let (ball, normal) = (*table.flight(grain), table.surface().0[element as usize].1);
                table.deflect(&[(grain, ball.velocity - normal * 2.0 * ball.velocity.dot(&normal))]);
                thuds += 1;
            }
            Encounter::Exit { .. } => unreachable!("the cushions are closed"),
        }
    }
    let energy: f64 = table.inside().map(|ball| table.flight(ball).velocity.norm_squared()).sum();
    assert!((energy - 9.0).abs() < 1e-12, "elastic balls keep their energy");
    eprintln!("{clicks} clicks of two balls and {thuds} thuds against a cushion in ten seconds");
}
