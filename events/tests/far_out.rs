//! Grains very far from the others.

use impinge_events::{Domain, Encounter, Encounters, Flight, NoSurface};
use nalgebra::Vector3;

fn ball(x: f64, y: f64, velocity: f64) -> Flight {
    Flight { position: Vector3::new(x, y, 0.0), time: 0.0, velocity: Vector3::x() * velocity, radius: 0.5 }
}

/// The numbers of their cells overflowed, and the search for crossings did not return.
#[test]
fn grains_ten_billion_cells_out_met_nobody() {
    for far in [1e8, 1e10, 1e11] {
        let mut balls: Vec<_> = (0..100).map(|k| ball(f64::from(k % 10) * 4.0, f64::from(k / 10) * 4.0, 0.0)).collect();
        balls.extend([ball(far, 0.0, 0.5), ball(far + 6.0, 0.0, -0.5)]);
        let mut encounters = Encounters::<NoSurface>::new(balls, NoSurface, Domain::unbounded(), f64::INFINITY);
        assert_eq!(encounters.next_before(10.0), Some((5.0, Encounter::Grains { a: 100, b: 101 })), "{far:e} m out");
    }
}
