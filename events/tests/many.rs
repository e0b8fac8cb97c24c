//! So many grains that what comes soon is fetched ahead from memory.

use impinge_events::calendar::{Buckets, Calendar, PlainCalendar};
use impinge_events::{Domain, Encounter, Encounters, Flight, NoSurface};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// Grains along a side of the cube.
const SIDE: usize = 27;
const ENCOUNTERS: usize = 30_000;

/// A simple cubic lattice of spheres that fly in all directions.
fn crowd() -> Vec<Flight> {
    let mut random = Pcg64::seed_from_u64(3);
    let mut velocity = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
    let site = |k: usize| Vector3::new((k % SIDE) as f64, (k / SIDE % SIDE) as f64, (k / SIDE / SIDE) as f64);
    (0..SIDE.pow(3))
        .map(|k| Flight { position: site(k).add_scalar(0.5), time: 0.0, velocity: velocity(), radius: 0.35 })
        .collect()
}

/// What happens first, with the velocities of smooth elastic spheres of equal mass after each meeting.
fn first_encounters<C: Calendar>(domain: Domain) -> Vec<(f64, Encounter)> {
    let mut encounters = Encounters::<NoSurface, C>::new(crowd(), NoSurface, domain, f64::INFINITY);
    let mut seen = Vec::new();
    while seen.len() < ENCOUNTERS {
        let next = encounters.next_before(10.0).expect("an encounter");
        seen.push(next);
        match next.1 {
            Encounter::Grains { a, b } => {
                let [first, second] = [a, b].map(|grain| *encounters.flight(grain));
                let normal = domain.nearest(second.position - first.position).normalize();
                let change = normal * (second.velocity - first.velocity).dot(&normal);
                encounters.deflect(&[(a, first.velocity + change), (b, second.velocity - change)]);
            }
            Encounter::Exit { grain } => encounters.remove(grain),
            Encounter::Surface { .. } => unreachable!("there is no surface"),
        }
    }
    seen
}

/// The grain with the highest number was named as one that comes soon, left, and cells were laid out without a place for it.
#[test]
fn a_grain_that_had_left_was_fetched_from_where_no_cells_were() {
    let side = Vector3::repeat(SIDE as f64);
    let domain = Domain { min: Vector3::zeros(), max: side, periodic: false, planar: false };
    let mut flights = crowd();
    let last = flights.len() - 1;
    for (number, flight) in flights.iter_mut().enumerate() {
        // Those of the highest numbers leave through the top, the very last as the tenth; ten more in the next epoch.
        let speed = match last - number {
            0 => 0.84,
            before @ 1..10 => 0.9 + 0.01 * before as f64,
            before @ 10..20 => 0.5 + 0.01 * before as f64,
            _ => 0.0,
        };
        (flight.radius, flight.velocity) = (0.1, Vector3::z() * speed);
    }
    let mut encounters = Encounters::<NoSurface>::new(flights, NoSurface, domain, f64::INFINITY);
    let mut leave = |until: f64| {
        let mut gone = Vec::new();
        while let Some((_, Encounter::Exit { grain })) = encounters.next_before(until) {
            encounters.remove(grain);
            gone.push(grain as usize);
        }
        encounters.start_epoch(until, 10.0);
        gone
    };
    let first = leave(0.6);
    assert_eq!((first.len(), first[9]), (10, last));
    assert_eq!(leave(1.0).len(), 10);
}

/// The plain calendar does not tell who comes: nothing is fetched ahead with it.
#[test]
fn fetching_ahead_changes_no_bit_in_a_period() {
    let side = Vector3::repeat(SIDE as f64);
    let domain = Domain { min: Vector3::zeros(), max: side, periodic: true, planar: false };
    assert_eq!(first_encounters::<Buckets>(domain), first_encounters::<PlainCalendar>(domain));
}

/// Here grains leave, and the cells are hashed.
#[test]
fn fetching_ahead_changes_no_bit_in_an_open_domain() {
    let side = Vector3::repeat(SIDE as f64);
    let domain = Domain { min: Vector3::zeros(), max: side, periodic: false, planar: false };
    assert_eq!(first_encounters::<Buckets>(domain), first_encounters::<PlainCalendar>(domain));
}
