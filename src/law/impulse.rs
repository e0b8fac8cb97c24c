//! Restitution and friction of spheres: Arbelaez, Zohdi & Dornfeld (2009), sections 3.1 and 3.2; Mukherjee & Zohdi (2015), sections 2.2
//! and 2.3.
//!
//! Contact is instantaneous, so the external impulses of the papers (E and M) are zero.

use nalgebra::Vector3;

use super::{ContactLaw, Friction};

/// What the law needs to know of a grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass, kg.
    pub mass: f64,
    /// Radius, m.
    pub radius: f64,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Spin, rad/s.
    pub spin: Vector3<f64>,
}

impl Body {
    /// What the spin adds to the velocity of the point of the grain at `arm` (unit vector) times its radius, m/s; orthogonal to `arm`.
    fn turning(&self, arm: Vector3<f64>) -> Vector3<f64> {
        self.spin.cross(&arm) * self.radius
    }

    /// Takes up `impulse` (N s) at the point at `arm` (unit vector) times its radius: I = 2/5 m r².
    fn take(&mut self, impulse: Vector3<f64>, tangential: Vector3<f64>, arm: Vector3<f64>) {
        self.velocity += impulse / self.mass;
        self.spin += arm.cross(&tangential) / (0.4 * self.mass * self.radius);
    }
}

/// The impulse of one contact and what it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// J_n ≥ 0, N s; it pushes the two apart.
    pub normal: f64,
    /// J_t, N s, along the slip.
    pub tangential: Vector3<f64>,
    /// Kinetic energy dissipated, J, from the closed form
    /// ½ m (1 - e²) v_n² + J_t |s| - 7/4 J_t² / m, with m the effective mass and s the slip.
    pub dissipated: f64,
}

/// A contact between two grains, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairImpulse {
    /// The impulse on the second grain along the normal, and on the first along the slip of the second.
    pub impulse: Impulse,
    /// Normal speed of approach, m/s.
    pub approach_speed: f64,
    /// Both grains afterwards.
    pub after: [Body; 2],
}

/// A contact between a grain and the surface, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceImpulse {
    /// The impulse; the tangential part acts on the grain against its slip.
    pub impulse: Impulse,
    /// Normal speed of approach relative to the surface, m/s.
    pub approach_speed: f64,
    /// Work of the moving surface on the grain, J.
    pub work: f64,
    /// The grain afterwards.
    pub after: Body,
}

/// Resolves the contact of two grains whose contact normal `normal` (unit vector) points from the first to the second.
///
/// Normal impulse: 000 eq. (10). Friction: eq. (19) and (20), whose first branch lacks its direction in print. Two grains that do not
/// approach get no impulse.
///
/// ```
/// use impinge::law::{Body, ContactLaw, Friction, resolve_pair};
/// use nalgebra::Vector3;
///
/// let a = Body { mass: 1.0, radius: 0.5, velocity: Vector3::x(), spin: Vector3::zeros() };
/// let b = Body { velocity: Vector3::zeros(), ..a };
/// let law = ContactLaw { restitution: 0.5, friction: Friction::Smooth };
/// let contact = resolve_pair(&law, &a, &b, Vector3::x());
/// assert_eq!(contact.after[0].velocity.x, 0.25);
/// assert_eq!(contact.after[1].velocity.x, 0.75);
/// assert_eq!(contact.impulse.dissipated, 0.1875);
/// ```
#[must_use]
pub fn resolve_pair(law: &ContactLaw, a: &Body, b: &Body, normal: Vector3<f64>) -> PairImpulse {
    let effective_mass = a.mass * b.mass / (a.mass + b.mass);
    let turning = || b.turning(-normal) - a.turning(normal);
    let (impulse, approach_speed) = contact(law, effective_mass, b.velocity - a.velocity, turning, normal);
    let on_b = normal * impulse.normal - impulse.tangential;
    let mut after = [*a, *b];
    after[0].take(-on_b, impulse.tangential, normal);
    after[1].take(on_b, -impulse.tangential, -normal);
    PairImpulse { impulse, approach_speed, after }
}

/// Resolves the contact of a grain with a surface that moves at `surface_velocity` (m/s); `normal` (unit vector) points from the surface
/// to the grain.
///
/// Normal impulse: 000 eq. (26) and 002 eq. (19), (20). Friction: 000 eq. (31) and (32) with slip relative to the surface (002 eq. 17, 18).
/// The friction force on the grain is -f_t t (000 eq. 28 prints +).
#[must_use]
pub fn resolve_surface(
    law: &ContactLaw,
    grain: &Body,
    normal: Vector3<f64>,
    surface_velocity: Vector3<f64>,
) -> SurfaceImpulse {
    let turning = || grain.turning(-normal);
    let (impulse, approach_speed) = contact(law, grain.mass, grain.velocity - surface_velocity, turning, normal);
    let on_grain = normal * impulse.normal - impulse.tangential;
    let mut after = *grain;
    after.take(on_grain, -impulse.tangential, -normal);
    SurfaceImpulse { impulse, approach_speed, work: on_grain.dot(&surface_velocity), after }
}

/// The impulse between two bodies of effective mass `mass` (kg) whose centres move apart at `relative` (m/s) along `normal`; spins add
/// `turning` (m/s) at their contact points.
///
/// Spins turn contact points across the normal, so the normal speed is that of the centres: taken from contact points it would carry the
/// rounding of the spins. For a sphere (I = 2/5 m r²) the impulse that ends all slip s is 2/7 m |s|.
#[inline]
fn contact(
    law: &ContactLaw,
    mass: f64,
    relative: Vector3<f64>,
    turning: impl FnOnce() -> Vector3<f64>,
    normal: Vector3<f64>,
) -> (Impulse, f64) {
    let approach = -relative.dot(&normal);
    if approach <= 0.0 || approach.is_nan() {
        return (Impulse { normal: 0.0, tangential: Vector3::zeros(), dissipated: 0.0 }, approach);
    }
    let e = law.restitution;
    let j_n = (1.0 + e) * mass * approach;
    let lost_normal = 0.5 * mass * (1.0 - e) * (1.0 + e) * approach * approach;
    if law.friction == Friction::Smooth {
        return (Impulse { normal: j_n, tangential: Vector3::zeros(), dissipated: lost_normal }, approach);
    }
    let across = relative + turning();
    let slip = across - normal * across.dot(&normal);
    let slip_speed = slip.norm();
    if slip_speed == 0.0 {
        return (Impulse { normal: j_n, tangential: Vector3::zeros(), dissipated: lost_normal }, approach);
    }
    let sticking = 2.0 / 7.0 * mass * slip_speed;
    let j_t = match law.friction {
        Friction::Smooth => 0.0,
        Friction::Coulomb { static_, .. } if sticking <= static_ * j_n => sticking,
        Friction::Coulomb { dynamic, .. } => dynamic * j_n,
        // Eq. (12) prints s / (2 epsilon), which jumps at s = epsilon. Without the bound the impulse could reverse the slip and
        // create energy for every epsilon below mu (1 + e) v_n / 2.
        Friction::Regularised { coefficient, slip_speed: epsilon } => {
            (coefficient * (slip_speed / epsilon).min(1.0) * j_n).min(sticking)
        }
    };
    let lost_tangential = j_t * slip_speed - 1.75 * j_t * j_t / mass;
    let tangential = slip * (j_t / slip_speed);
    (Impulse { normal: j_n, tangential, dissipated: lost_normal + lost_tangential }, approach)
}

#[cfg(test)]
mod tests {
    use impinge_events::contact_time::APPROACH_ROUNDING;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;

    use super::*;

    fn energy(body: &Body) -> f64 {
        0.5 * body.mass * (body.velocity.norm_squared() + 0.4 * body.radius.powi(2) * body.spin.norm_squared())
    }

    fn vector(random: &mut Pcg64, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| random.random_range(-size..=size))
    }

    fn body(random: &mut Pcg64) -> Body {
        let radius = random.random_range(0.1..2.0);
        Body {
            mass: random.random_range(0.1..5.0),
            radius,
            velocity: vector(random, 1.0),
            spin: vector(random, 1.0) / radius,
        }
    }

    fn law(random: &mut Pcg64) -> ContactLaw {
        let restitution = [0.0, 1.0, random.random_range(0.0..1.0)][random.random_range(0..3)];
        let mu = random.random_range(0.0..1.5);
        let friction = match random.random_range(0..5) {
            0 => Friction::Smooth,
            1 => Friction::Coulomb { static_: f64::INFINITY, dynamic: f64::INFINITY },
            2 => Friction::Coulomb { static_: mu, dynamic: mu * random.random_range(0.0..1.0) },
            3 => Friction::Coulomb { static_: 0.0, dynamic: 0.0 },
            _ => Friction::Regularised { coefficient: mu, slip_speed: 10f64.powf(random.random_range(-9.0..1.0)) },
        };
        ContactLaw { restitution, friction }
    }

    /// PHYSICS hard case 18: a million random hits; no energy is gained and the closed form of the loss is the loss.
    #[test]
    fn friction_ledger_identity_on_a_million_hits() {
        let mut random = Pcg64::seed_from_u64(18);
        for _ in 0..500_000 {
            let (law, a, b) = (law(&mut random), body(&mut random), body(&mut random));
            let normal = vector(&mut random, 1.0).normalize();
            let pair = resolve_pair(&law, &a, &b, normal);
            let before = energy(&a) + energy(&b);
            let after = energy(&pair.after[0]) + energy(&pair.after[1]);
            assert!(after - before <= 1e-14 * before, "{law:?} {a:?} {b:?} gains {}", after - before);
            assert!((before - after - pair.impulse.dissipated).abs() <= 1e-12 * before, "{law:?} {a:?} {b:?}");
            let angular = |body: &Body, arm: f64| {
                (normal * arm).cross(&body.velocity) * body.mass + body.spin * (0.4 * body.mass * body.radius.powi(2))
            };
            let total = |a: &Body, b: &Body| angular(a, -a.radius) + angular(b, b.radius);
            let momentum = |a: &Body, b: &Body| a.velocity * a.mass + b.velocity * b.mass;
            let [c, d] = &pair.after;
            assert!((momentum(c, d) - momentum(&a, &b)).amax() < 1e-14 * 30.0);
            assert!((total(c, d) - total(&a, &b)).amax() < 1e-14 * 60.0);

            let belt = vector(&mut random, 1.0);
            let hit = resolve_surface(&law, &a, normal, belt);
            let gained = energy(&hit.after) - energy(&a);
            assert!((gained + hit.impulse.dissipated - hit.work).abs() <= 1e-12 * (before + 10.0));
            let still = resolve_surface(&law, &a, normal, Vector3::zeros());
            assert!(energy(&still.after) - energy(&a) <= 1e-14 * energy(&a));
            assert_eq!(still.work, 0.0);
        }
    }

    #[test]
    fn restitution_and_sticking_are_exact() {
        let mut random = Pcg64::seed_from_u64(3);
        for _ in 0..10_000 {
            let (a, b) = (body(&mut random), body(&mut random));
            let normal = vector(&mut random, 1.0).normalize();
            let stick = Friction::Coulomb { static_: f64::INFINITY, dynamic: f64::INFINITY };
            let pair = resolve_pair(&ContactLaw { restitution: 0.3, friction: stick }, &a, &b, normal);
            if pair.approach_speed > 0.0 {
                let [a, b] = pair.after;
                let relative = b.velocity + b.turning(-normal) - (a.velocity + a.turning(normal));
                assert!((relative.dot(&normal) - 0.3 * pair.approach_speed).abs() < 1e-14);
                assert!((relative - normal * relative.dot(&normal)).norm() < 2e-14, "residual slip");
            }
        }
    }

    /// PHYSICS 0.12: with mu_s = 0.3, e = 0.3 slip begins at tan(theta) = 3.5 mu_s (1 + e), 53.77 degrees; there the traction drops
    /// from mu_s to mu_d.
    #[test]
    fn stick_ends_at_the_threshold_angle() {
        let law = ContactLaw { restitution: 0.3, friction: Friction::Coulomb { static_: 0.3, dynamic: 0.2 } };
        let threshold = (3.5f64 * 0.3 * 1.3).atan();
        assert!((threshold.to_degrees() - 53.77).abs() < 0.005);
        for (angle, traction) in [(threshold - 1e-9, 0.3), (threshold + 1e-9, 0.2)] {
            let velocity = Vector3::new(angle.sin(), 0.0, -angle.cos());
            let grain = Body { mass: 1.0, radius: 1.0, velocity, spin: Vector3::zeros() };
            let hit = resolve_surface(&law, &grain, Vector3::z(), Vector3::zeros()).impulse;
            assert!((hit.tangential.x / hit.normal - traction).abs() < 1e-8);
        }
    }

    /// A spin about the normal does not slip; a spin across it does, and comes out as velocity.
    #[test]
    fn impact_with_spin_only() {
        let law = ContactLaw { restitution: 1.0, friction: Friction::Coulomb { static_: 9.0, dynamic: 9.0 } };
        let grain = Body { mass: 2.0, radius: 0.5, velocity: -Vector3::z(), spin: Vector3::z() };
        let hit = resolve_surface(&law, &grain, Vector3::z(), Vector3::zeros());
        assert_eq!(hit.impulse.tangential, Vector3::zeros());
        assert_eq!(hit.after.spin, Vector3::z());
        let rolling = Body { spin: Vector3::new(0.0, 4.0, 0.0), ..grain };
        let hit = resolve_surface(&law, &rolling, Vector3::z(), Vector3::zeros());
        // Slip of the lowest point is -2 m/s; 2/7 of it becomes velocity.
        assert!((hit.after.velocity.x - 4.0 / 7.0).abs() < 1e-15);
        assert!((hit.after.velocity.x - hit.after.spin.y * 0.5).abs() < 1e-15, "it rolls");
    }

    /// PHYSICS 2.4: the unbounded regularised impulse would turn a slip of 1 m/s into -79 m/s.
    #[test]
    fn regularised_friction_never_reverses_slip() {
        let law =
            ContactLaw { restitution: 1.0, friction: Friction::Regularised { coefficient: 0.5, slip_speed: 1e-3 } };
        let velocity = Vector3::new(1.0, 0.0, -80.0);
        let grain = Body { mass: 1.0, radius: 1.0, velocity, spin: Vector3::zeros() };
        let hit = resolve_surface(&law, &grain, Vector3::z(), Vector3::zeros());
        assert!((hit.after.velocity.x - 5.0 / 7.0).abs() < 1e-14);
    }

    /// Spins move contact points across the normal, up to rounding. At restitution 0 that rounding was left as an approach: 5e-8 m/s
    /// where grains flew at 1 m/s and their rims turned at 1e9 m/s.
    #[test]
    fn rounding_of_a_large_spin_is_no_approach() {
        let mut random = Pcg64::seed_from_u64(7);
        for mu in [0.3, f64::INFINITY] {
            let law = ContactLaw { restitution: 0.0, friction: Friction::Coulomb { static_: mu, dynamic: mu } };
            // What they still approach at, and the rounding of the velocities that this is the difference of.
            let is_rounding = |bodies: &[Body; 2], normal: Vector3<f64>| {
                let rest = (bodies[0].velocity - bodies[1].velocity).dot(&normal);
                rest.abs() <= APPROACH_ROUNDING * (bodies[0].velocity.amax() + bodies[1].velocity.amax())
            };
            for _ in 0..10_000 {
                let normal = vector(&mut random, 1.0).normalize();
                let [a, b] = [body(&mut random), body(&mut random)].map(|body| Body { spin: body.spin * 1e9, ..body });
                let pair = resolve_pair(&law, &a, &b, normal);
                assert_eq!(pair.approach_speed, -(b.velocity - a.velocity).dot(&normal));
                if pair.approach_speed > 0.0 {
                    assert!(is_rounding(&pair.after, normal), "{pair:?}");
                } else {
                    assert_eq!(pair.after, [a, b]);
                }

                let belt = Body { velocity: vector(&mut random, 1.0), ..b };
                let hit = resolve_surface(&law, &a, normal, belt.velocity);
                assert_eq!(hit.approach_speed, -(a.velocity - belt.velocity).dot(&normal));
                if hit.approach_speed > 0.0 {
                    assert!(is_rounding(&[belt, hit.after], normal), "{hit:?}");
                } else {
                    assert_eq!(hit.after, a);
                }
            }
        }
    }

    #[test]
    fn grains_that_recede_get_no_impulse() {
        let law = ContactLaw { restitution: 0.5, friction: Friction::Coulomb { static_: 1.0, dynamic: 1.0 } };
        let a = Body { mass: 1.0, radius: 1.0, velocity: -Vector3::x(), spin: Vector3::y() };
        let b = Body { velocity: Vector3::x(), ..a };
        assert_eq!(resolve_pair(&law, &a, &b, Vector3::x()).after, [a, b]);
    }
}
