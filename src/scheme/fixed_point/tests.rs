use impinge_events::Domain;
use nalgebra::Vector3;

use super::collisions::{Lookout, Speeds};
use super::iteration::change_of_step;
use super::{FixedPoint, scene};
use crate::grains::NewGrain;
use crate::law::{Body, ContactLaw, Friction, NearField, Term, resolve_surface};
use crate::near_field::{ForceSum, Method};
use crate::scene::{Interference, PlaneSurface};
use crate::scheme::stepped::{Crowd, Method as _};
use crate::scheme::{Collapse, Forces, Laws};
use crate::surface::Surface;

const RADIUS: f64 = 0.5;
const SETTINGS: scene::FixedPoint =
    scene::FixedPoint { tolerance: 1e-6, iterations: 5, safety: 0.9, overlap: 1e-3, largest_step: None };

fn grain(place: [f64; 3], velocity: [f64; 3]) -> NewGrain {
    NewGrain {
        position: place.into(),
        velocity: velocity.into(),
        spin: Vector3::zeros(),
        radius: RADIUS,
        density: 1.0,
        strength: 1.0,
    }
}

/// Elastic grains over the plane z = 0 that attract each other by alpha r^-2.
fn crowd(grains: &[NewGrain], alpha: f64) -> Crowd {
    let floor = PlaneSurface { point: [0.0; 3], normal: [0.0, 0.0, 1.0], velocity: [0.0; 3] };
    let surface = Surface::new(&[scene::Surface::Plane(floor)], ".".as_ref()).expect("a plane");
    let law = ContactLaw { restitution: 1.0, friction: Friction::Smooth };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
    let near_field = (alpha != 0.0).then(|| {
        let law = NearField::new(Term { alpha, beta: 2.0 }, Term { alpha: 0.0, beta: 3.0 }).expect("a law");
        ForceSum::new(law, Method::Direct, &Domain::unbounded()).expect("a sum")
    });
    let forces = Forces { gravity: Vector3::zeros(), near_field, contact_time: 0.0 };
    Crowd::new(grains, surface, Domain::unbounded(), laws, forces, 0.0)
}

/// Two grains that circle about a point `from` the origin (m), 2 m from it.
fn orbit(alpha: f64, from: [f64; 3]) -> Crowd {
    let mass = grain([0.0; 3], [0.0; 3]).mass();
    let speed = (alpha / 16.0 * 2.0 / mass).sqrt();
    let at = |side: f64| grain([from[0] + 2.0 * side, from[1], from[2]], [0.0, speed * side, 0.0]);
    crowd(&[at(1.0), at(-1.0)], alpha)
}

const HIGH: [f64; 3] = [0.0, 0.0, 100.0];

/// PHYSICS 0.14: step 3(b) of the paper's list prints k for k_d. What converges sooner would then get steps that are too short, what converges later
/// steps that are too long.
#[test]
fn a_step_is_changed_so_that_the_desired_iterations_meet_the_tolerance() {
    let after = |contraction: f64, step: f64| (contraction * step * step).powi(SETTINGS.iterations as i32);
    for (contraction, step) in [(3.0f64, 0.1), (40.0, 0.1), (900.0, 0.1)] {
        for k in 1..9u32 {
            let error = (contraction * step * step).powi(k as i32);
            let next = change_of_step(&SETTINGS, error, k) * step;
            assert!((after(contraction, next) / SETTINGS.tolerance - 1.0).abs() < 1e-12);
            let root = |value: f64| value.powf(1.0 / (2.0 * f64::from(k)));
            let printed = root(SETTINGS.tolerance) / root(error) * step;
            let missed = after(contraction, printed) / SETTINGS.tolerance;
            match k.cmp(&SETTINGS.iterations) {
                std::cmp::Ordering::Less => assert!(missed < 0.04, "the step would shrink for nothing"),
                std::cmp::Ordering::Equal => assert!((missed - 1.0).abs() < 1e-12),
                std::cmp::Ordering::Greater => assert!(missed > 9.0, "the step would be too long"),
            }
        }
    }
}

/// Lengths of the first steps, and iterations in all.
fn steps(crowd: &mut Crowd, settings: scene::FixedPoint, count: usize) -> (Vec<f64>, u64) {
    let mut scheme = FixedPoint::new(settings);
    let lengths = (0..count).map(|_| scheme.step(crowd, 1e9, &mut ()).expect("finite forces")).collect();
    (lengths, scheme.iterations())
}

#[test]
fn steps_grow_and_shrink_to_what_takes_the_desired_iterations() {
    let settled = |alpha: f64, settings: scene::FixedPoint| {
        let (few, more) = (steps(&mut orbit(alpha, HIGH), settings, 2), steps(&mut orbit(alpha, HIGH), settings, 5));
        assert_eq!(more.1 - few.1, 3 * u64::from(settings.iterations), "{:?}", more.0);
        more.0[2]
    };
    // The contraction is that of Δt² / m times the gradient of the force: four times the force, half the step.
    let length = settled(1.0, SETTINGS);
    let ratio = settled(4.0, SETTINGS) / length;
    assert!((ratio - 0.5).abs() < 1e-6, "{ratio}");
    // TOL^(1/(p k_d)), but for what the longer steps have made of the orbit by then.
    let ratio = settled(1.0, scene::FixedPoint { tolerance: 1e-10, ..SETTINGS }) / length;
    assert!((ratio / 10f64.powf(-0.4) - 1.0).abs() < 0.25, "{ratio}");

    // One step that is much too short or too long, and the next one is right.
    for wrong in [1e-3, 3.0] {
        let mut scheme = FixedPoint::new(SETTINGS);
        scheme.horizon = Some(wrong * length);
        let first = scheme.step(&mut orbit(1.0, HIGH), 1e3 * length, &mut ()).expect("finite forces");
        assert!(first <= wrong.min(1.5) * length, "{first} of {length}");
        let ratio = scheme.iteration.expected() / length;
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
    }
}

/// PHYSICS 0.15: printed is a change relative to Σ ‖r‖.
#[test]
fn convergence_does_not_depend_on_the_distance_from_the_origin() {
    let (step, far) = (0.5, [0.0, 0.0, 1e6]);
    let settings = scene::FixedPoint { largest_step: Some(step), tolerance: 1e-4, iterations: 20, ..SETTINGS };
    let iterations = |from| {
        let mut scheme = FixedPoint::new(settings);
        scheme.horizon = Some(step);
        assert_eq!(scheme.step(&mut orbit(1.0, from), step, &mut ()).expect("finite forces"), step);
        scheme.iterations()
    };
    assert_eq!(iterations(HIGH), iterations(far));
    assert!(iterations(far) > 1);
    // The first change in the measure that is printed.
    let printed = |from| {
        let mut crowd = orbit(1.0, from);
        let start = crowd.flights.clone();
        let mut places = [start[0].position; 3];
        for place in &mut places[1..] {
            let mut pull = Vec::new();
            crowd.pull(&mut pull).expect("finite forces");
            for (flight, (start, pull)) in crowd.flights.iter_mut().zip(start.iter().zip(&pull)) {
                flight.position = start.position + (start.velocity + pull * step) * step;
            }
            *place = crowd.flights[0].position;
        }
        (places[2] - places[1]).norm() / places[2].norm()
    };
    assert!(printed([0.0; 3]) > settings.tolerance);
    assert!(printed(far) < settings.tolerance, "it would take one iteration");
}

/// With contacts at r^(L+1,k), as (34) is printed, a grain that reaches a wall within a step has none in every other iterate, for any step.
#[test]
fn contacts_that_are_found_anew_in_each_iterate_have_no_fixed_point() {
    let law = ContactLaw { restitution: 0.5, friction: Friction::Smooth };
    let before = Body { mass: 1.0, radius: RADIUS, velocity: -Vector3::z(), spin: Vector3::zeros() };
    let after = resolve_surface(&law, &before, Vector3::z(), Vector3::zeros()).after.velocity.z;
    let gap = 1e-6;
    for step in [1.001e-6, 2e-6, 1e-3, 1.0] {
        let iterate = |gap_k: f64| gap + step * if gap_k < 0.0 { after } else { before.velocity.z };
        let gaps: Vec<f64> = std::iter::successors(Some(gap), |&gap_k| Some(iterate(gap_k))).take(8).collect();
        assert!(gaps.iter().skip(1).step_by(2).all(|&gap| gap < 0.0));
        assert!(gaps.iter().skip(2).step_by(2).all(|&gap| gap > 0.0));
    }
}

/// The step that predicted collisions allow.
fn allowed(grains: &[NewGrain]) -> f64 {
    let mut crowd = crowd(grains, 0.0);
    let (mut lookout, speeds) = (Lookout::default(), Speeds::of(&crowd.flights));
    lookout.look(&mut crowd, &SETTINGS, &speeds, 5.0);
    lookout.longest_step(&crowd, &SETTINGS, 5.0)
}

/// PHYSICS 0.18: printed is ‖r_ii‖² for ‖v_ij‖², and either root.
#[test]
fn steps_between_grains_end_where_the_first_root_over_the_speed_squared_has_them() {
    let pair = [grain([0.0, 0.0, 9.0], [0.75, 0.0, 0.0]), grain([2.5, 0.0, 9.0], [-0.75, 0.0, 0.0])];
    // They meet after 1 s, a gap of 1.5 m at 1.5 m/s.
    let expected = 0.9 * 1.0 + 1e-3 * RADIUS / 1.5;
    assert!((allowed(&pair) - expected).abs() < 1e-14);
    let (r, v, s) = (2.5, 1.5, 2.0 * RADIUS);
    let gamma: f64 = (r * v) * (r * v) - v * v * (r * r - s * s);
    let printed = (r * v - gamma.sqrt()) / (r * r);
    assert!((r - v * printed - s).abs() > 0.5, "they would be {} m apart", r - v * printed - s);
    let later = (r * v + gamma.sqrt()) / (v * v);
    assert!((r - v * later + s).abs() < 1e-14, "they would have passed through each other");
}

/// PHYSICS 0.20: printed is the time at which the centre reaches the plane.
#[test]
fn steps_to_the_surface_end_where_the_rim_reaches_it() {
    let falling = grain([0.0, 0.0, 1.5], [0.0, 0.0, -1.0]);
    let expected = 0.9 * 1.0 + 1e-3 * RADIUS;
    assert!((allowed(&[falling]) - expected).abs() < 1e-14);
    let printed = falling.position.z / 1.0;
    assert_eq!(falling.position.z - printed - RADIUS, -RADIUS, "the overlap there is a radius");
    let overlap = RADIUS - (falling.position.z - (0.9 * printed + 1e-3 * RADIUS));
    assert!(overlap > 100.0 * SETTINGS.overlap * RADIUS, "so would it be after a step: {overlap} m");
}

/// PHYSICS 0.19: the root is negative where grains overlap already; they meet at once.
#[test]
fn grains_that_overlap_and_approach_allow_a_step_of_the_overlap_only() {
    let at = |place: f64, speed: f64| grain([place, 0.0, 9.0], [speed, 0.0, 0.0]);
    let [deep, shallow] = [0.9, 0.999].map(|place| allowed(&[at(0.0, 1.0), at(place, -1.0)]));
    assert_eq!((deep, shallow), (1e-3 * RADIUS / 2.0, 1e-3 * RADIUS / 2.0));
    assert!(allowed(&[at(0.0, -1.0), at(0.9, 1.0)]) > 0.1, "those that part allow what others do");
}

/// A grain that overlaps nothing flies on, however near the next one is: a contact is not anticipated.
#[test]
fn impulses_wait_for_an_overlap() {
    let mut crowd = crowd(&[grain([0.0, 0.0, RADIUS + 1e-4], [0.0, 0.0, -1.0])], 0.0);
    let mut scheme = FixedPoint::new(SETTINGS);
    let mut lengths = Vec::new();
    while crowd.flights[0].velocity.z < 0.0 {
        lengths.push(scheme.step(&mut crowd, 1.0, &mut ()).expect("finite"));
    }
    assert_eq!(crowd.flights[0].velocity.z, 1.0);
    // 0.9 of the way and the overlap together; the contact is in the second step.
    assert_eq!(lengths.len(), 2);
    assert!((lengths[0] - (0.9e-4 + 0.5e-3)).abs() < 1e-15);
}
