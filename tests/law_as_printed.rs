//! Laws of Mukherjee & Zohdi (2015) coded as they are printed, against those of the code: what each misprint would have done.

use impinge::law::{Body, ContactLaw, Friction, resolve_surface};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};

/// (12) as printed.
fn regularisation(slip: f64, epsilon: f64) -> f64 {
    if slip.abs() <= epsilon { slip / (2.0 * epsilon) } else { slip.signum() }
}

fn regularised(coefficient: f64, slip_speed: f64) -> ContactLaw {
    ContactLaw { restitution: 1.0, friction: Friction::Regularised { coefficient, slip_speed } }
}

/// Velocity along the surface and the tangential impulse of a grain of 1 kg and 1 m that arrives at `approach` and slips at `slip` (m/s).
fn slide(law: &ContactLaw, slip: f64, approach: f64) -> (f64, f64) {
    let velocity = Vector3::new(slip, 0.0, -approach);
    let grain = Body { mass: 1.0, radius: 1.0, velocity, spin: Vector3::zeros() };
    let hit = resolve_surface(law, &grain, Vector3::z(), Vector3::zeros());
    (hit.after.velocity.x, hit.impulse.tangential.x)
}

/// PHYSICS 2.3: the printed function jumps from 1/2 to 1 where slip reaches epsilon.
#[test]
fn friction_does_not_jump_where_it_is_fully_developed() {
    let epsilon = 0.5;
    let around = [epsilon * (1.0 - 1e-12), epsilon * (1.0 + 1e-12)];
    let [below, above] = around.map(|slip| regularisation(slip, epsilon));
    assert!(above - below > 0.499);
    // Approach so slow that friction does not end the slip.
    let [(_, below), (_, above)] = around.map(|slip| slide(&regularised(0.1, epsilon), slip, 0.1));
    assert!((above - below).abs() < 1e-12 && (above - 0.02).abs() < 1e-12, "{below} {above}");
}

/// PHYSICS 2.4: mu R J_n reverses a slip of 1 m/s into -79 m/s, 6241 times the energy, and -279 m/s at the contact point where the grain turns.
#[test]
fn friction_does_not_reverse_slip() {
    let (mu, e, approach, slip, epsilon) = (0.5, 1.0, 80.0, 1.0, 1e-3);
    let impulse = mu * regularisation(slip, epsilon) * (1.0 + e) * approach;
    let printed = slip - impulse;
    assert_eq!((printed, printed * printed), (-79.0, 6241.0));
    assert_eq!(slip - 3.5 * impulse, -279.0);
    // It rolls on.
    let (after, impulse) = slide(&regularised(mu, epsilon), slip, approach);
    assert!((after - 5.0 / 7.0).abs() < 1e-14 && (slip - 3.5 * impulse).abs() < 1e-14);
}

/// PHYSICS 2.4: in the linear part of (12) slip is amplified for every epsilon below mu (1 + e) v_n / 4, so that a smaller epsilon is not better.
#[test]
fn a_small_epsilon_does_not_amplify_slip() {
    let (mu, approach) = (0.5, 80.0);
    for epsilon in [1e-3, 1.0, 19.0] {
        let slip = 0.5 * epsilon;
        let printed = slip - mu * regularisation(slip, epsilon) * 2.0 * approach;
        assert!(printed.abs() > slip, "{epsilon}: {printed}");
        let (after, _) = slide(&regularised(mu, epsilon), slip, approach);
        assert!(after > 0.0 && after <= slip, "{epsilon}: {after}");
    }
}

/// PHYSICS 2.7: "again (13)" and "(15)" for the wall, where (17) and (18) have turned the direction of the slip, speed the grain up in every hit.
#[test]
fn friction_of_the_wall_takes_energy() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(27);
    let (mu, e) = (0.3, 0.8);
    let law = ContactLaw { restitution: e, friction: Friction::Coulomb { static_: mu, dynamic: mu } };
    let (normal, radius, mass) = (Vector3::z(), 0.5, 2.0);
    let energy =
        |v: Vector3<f64>, w: Vector3<f64>| 0.5 * mass * (v.norm_squared() + 0.4 * radius * radius * w.norm_squared());
    let (mut printed_gains, mut gains) = (0, 0);
    for _ in 0..2000 {
        let mut vector = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        let (mut v, w): (Vector3<f64>, Vector3<f64>) = (vector(), vector());
        v.z = -v.z.abs();
        let hit = resolve_surface(&law, &Body { mass, radius, velocity: v, spin: w }, normal, Vector3::zeros());
        // What the normal impulse leaves, so that only friction is compared.
        let bounced = Vector3::new(v.x, v.y, -e * v.z);
        let before = energy(bounced, w);
        gains += u32::from(energy(hit.after.velocity, hit.after.spin) > before * (1.0 + 1e-14));

        let slip = v + w.cross(&(normal * -radius));
        let t = (slip - normal * slip.dot(&normal)).normalize();
        let j_t = hit.impulse.tangential.norm();
        let s = normal.cross(&t);
        let printed_v = bounced + t * (j_t / mass);
        let printed_w = w - s * (radius * j_t / (0.4 * mass * radius * radius));
        printed_gains += u32::from(energy(printed_v, printed_w) > before);
    }
    assert_eq!((printed_gains, gains), (2000, 0));
}
