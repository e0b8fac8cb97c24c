//! Restitution and friction of spheres: Arbelaez, Zohdi & Dornfeld (2009), sections 3.1 and 3.2; Mukherjee & Zohdi (2015), sections 2.2
//! and 2.3.
//!
//! Contact is instantaneous, so the external impulses of the papers (E and M) are zero, unless a scene gives contacts a time: see [`External`].

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

    /// Velocity of the point of the grain at `arm` (unit vector) times its radius, m/s.
    pub(crate) fn velocity_at(&self, arm: Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.turning(arm)
    }

    /// Takes up `impulse` (N s), of which `tangential` turns it, at the point at `arm` (unit vector) times its radius: I = 2/5 m r².
    pub(crate) fn take(&mut self, impulse: Vector3<f64>, tangential: Vector3<f64>, arm: Vector3<f64>) {
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
    /// ½ m (1 - e²) v_n² + J_t |s| - 7/4 J_t² / m, with m the effective mass and s the slip. Under an [`External`] impulse the first term is
    /// ½ (1 - e) v_n J_n, and s the slip with that impulse in it.
    pub dissipated: f64,
}

/// What forces from outside give to two grains during a contact of finite duration: force × time of contact, N s (000 eq. 4, 5, 14, 15).
///
/// The time of contact delta t is meant, not the time step: (11) writes the one for the other, and as the force also acts in (1) that
/// would count it twice. So it goes for the scheme: [`PairImpulse::after`] and [`SurfaceImpulse::after`] have this impulse in
/// them, and what the force gives to the grain in the rest of the sub-step is that much less. The contact takes no time on the clock of an
/// event-driven scheme; without a force for delta t after it grains move as if it had.
///
/// Forces act at the centres (gravity, a central near field), so the moments M of (16), (17) and (29) are zero and their terms in (19) and (31)
/// are not there.
///
/// Where the compression of the contact ends, delta t_1 of (10) and, as corrected, (26), the paper leaves open. Here it is delta t / (1 + e):
/// a force of contact that is the same on average in both phases, whose impulses have the ratio e (6). With it the normal speed
/// afterwards is e times that before, as without the external impulse, and J_n = (1 + e) m v_n - E_n: the contact bears what presses
/// on it. Two grains that are pressed together with e = 0 end at rest, and do not approach again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct External {
    /// On the first grain, N s.
    pub on_first: Vector3<f64>,
    /// On the second grain, N s.
    pub on_second: Vector3<f64>,
}

impl External {
    /// What two forces (N) on the centres of the first and the second grain give during a contact of `time` (s).
    #[must_use]
    pub fn new(forces: [Vector3<f64>; 2], time: f64) -> Self {
        let [on_first, on_second] = forces.map(|force| force * time);
        Self { on_first, on_second }
    }
}

/// A contact between two grains, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairImpulse {
    /// The impulse on the second grain along the normal, and on the first along the slip of the second.
    pub impulse: Impulse,
    /// Normal speed of approach, m/s.
    pub approach_speed: f64,
    /// Both grains afterwards, at the end of the contact.
    pub after: [Body; 2],
    /// Work of the external impulse, J: the kinetic energy changes by this less what is dissipated. 0 for an instantaneous contact.
    pub work_external: f64,
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
    /// The grain afterwards, at the end of the contact.
    pub after: Body,
    /// Work of the external impulse, J: the kinetic energy changes by this and `work`, less what is dissipated. 0 for an instantaneous
    /// contact.
    pub work_external: f64,
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
    PairImpulse { impulse, approach_speed, after, work_external: 0.0 }
}

/// The same for a contact of finite duration, during which forces from outside give the grains `external`; without any, it is
/// [`resolve_pair`] to the bit.
///
/// Normal impulse: 000 eq. (10); friction: eq. (19) with slip and external impulse as vectors, so that the sign of what (20) prints as |f_f|
/// is kept and the slip that is left lies along the slip that the external impulse would leave alone. Where forces push the grains apart so
/// hard that they turn round without touching, there is no impulse, but `after` has the external impulse in it. Two grains that do not
/// approach are left as they are: no impulse, and no external one.
///
/// ```
/// use impinge::law::{Body, ContactLaw, External, Friction, resolve_pair_under};
/// use nalgebra::Vector3;
///
/// let a = Body { mass: 1.0, radius: 0.5, velocity: Vector3::x(), spin: Vector3::zeros() };
/// let b = Body { velocity: -Vector3::x(), ..a };
/// let law = ContactLaw { restitution: 0.5, friction: Friction::Smooth };
/// let pressed = External::new([Vector3::x() * 100.0, Vector3::x() * -100.0], 1e-3);
/// let contact = resolve_pair_under(&law, &a, &b, Vector3::x(), &pressed);
/// assert_eq!(contact.after[1].velocity.x, 0.5); // e times the speed of approach, shared by two
/// assert!((contact.impulse.normal - 1.6).abs() < 1e-15); // 1.5 N s to turn them round, 0.1 N s to bear the force
/// ```
#[must_use]
pub fn resolve_pair_under(
    law: &ContactLaw,
    a: &Body,
    b: &Body,
    normal: Vector3<f64>,
    external: &External,
) -> PairImpulse {
    if *external == External::default() {
        return resolve_pair(law, a, b, normal);
    }
    let effective_mass = a.mass * b.mass / (a.mass + b.mass);
    let turning = || b.turning(-normal) - a.turning(normal);
    let pull = external.on_second / b.mass - external.on_first / a.mass;
    let (impulse, approach_speed) = contact_under(law, effective_mass, b.velocity - a.velocity, turning, normal, pull);
    let mut after = [*a, *b];
    let mut work_external = 0.0;
    if approach_speed > 0.0 {
        let on_b = normal * impulse.normal - impulse.tangential;
        after[0].take(external.on_first - on_b, impulse.tangential, normal);
        after[1].take(external.on_second + on_b, -impulse.tangential, -normal);
        work_external =
            work_of(external.on_first, a, &after[0], normal) + work_of(external.on_second, b, &after[1], normal);
    }
    PairImpulse { impulse, approach_speed, after, work_external }
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
    SurfaceImpulse { impulse, approach_speed, work: on_grain.dot(&surface_velocity), after, work_external: 0.0 }
}

/// The same for a contact of finite duration, during which forces from outside give the grain `external` (N s, see [`External`]); without any,
/// it is [`resolve_surface`] to the bit.
///
/// Normal impulse: 000 eq. (26) with the integral over the compression only, as in (10); the printed limit t + delta t would add
/// (1 + e) times the external impulse of the recovery. Friction: eq. (31) as [`resolve_pair_under`] has (19). A grain that forces turn round by
/// themselves gets no impulse but the external one; one that does not approach, neither.
#[must_use]
pub fn resolve_surface_under(
    law: &ContactLaw,
    grain: &Body,
    normal: Vector3<f64>,
    surface_velocity: Vector3<f64>,
    external: Vector3<f64>,
) -> SurfaceImpulse {
    if external == Vector3::zeros() {
        return resolve_surface(law, grain, normal, surface_velocity);
    }
    let (turning, pull) = (|| grain.turning(-normal), external / grain.mass);
    let (impulse, approach_speed) =
        contact_under(law, grain.mass, grain.velocity - surface_velocity, turning, normal, pull);
    let on_grain = normal * impulse.normal - impulse.tangential;
    let mut after = *grain;
    let mut work_external = 0.0;
    if approach_speed > 0.0 {
        after.take(external + on_grain, -impulse.tangential, -normal);
        work_external = work_of(external, grain, &after, normal);
    }
    SurfaceImpulse { impulse, approach_speed, work: on_grain.dot(&surface_velocity), after, work_external }
}

/// Work (J) of an external impulse on a grain during a contact: along the normal at the mean velocity, as force of contact and external force act
/// together; across it before friction acts, so that friction never gives energy.
fn work_of(external: Vector3<f64>, before: &Body, after: &Body, normal: Vector3<f64>) -> f64 {
    let along = external.dot(&normal);
    let across = external - normal * along;
    0.5 * along * (before.velocity + after.velocity).dot(&normal)
        + across.dot(&(before.velocity + across * (0.5 / before.mass)))
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
    let (tangential, lost_tangential) = friction(law, mass, across - normal * across.dot(&normal), j_n);
    (Impulse { normal: j_n, tangential, dissipated: lost_normal + lost_tangential }, approach)
}

/// The same where forces from outside change `relative` by `pull` (m/s) during the contact.
///
/// With the impulse J_n = (1 + e) m v_n - m `pull`·n the normal speed goes from -v_n to e v_n, and the contact does the work -J_n (1 - e) v_n / 2.
/// Friction acts on the slip at the end of the contact.
fn contact_under(
    law: &ContactLaw,
    mass: f64,
    relative: Vector3<f64>,
    turning: impl FnOnce() -> Vector3<f64>,
    normal: Vector3<f64>,
    pull: Vector3<f64>,
) -> (Impulse, f64) {
    let approach = -relative.dot(&normal);
    let j_n = mass * ((1.0 + law.restitution) * approach - pull.dot(&normal));
    // Either may be no number; that is no contact, and the scheme finds it in the velocities.
    if !(approach > 0.0 && j_n > 0.0) {
        return (Impulse { normal: 0.0, tangential: Vector3::zeros(), dissipated: 0.0 }, approach);
    }
    let lost_normal = 0.5 * (1.0 - law.restitution) * approach * j_n;
    let (tangential, lost_tangential) = match law.friction {
        Friction::Smooth => (Vector3::zeros(), 0.0),
        _ => {
            let across = relative + turning() + pull;
            friction(law, mass, across - normal * across.dot(&normal), j_n)
        }
    };
    (Impulse { normal: j_n, tangential, dissipated: lost_normal + lost_tangential }, approach)
}

/// The tangential impulse (N s) of two bodies of effective mass `mass` (kg) that slip at `slip` (m/s) under the normal impulse `j_n` (N s), and
/// the energy that it dissipates, J.
#[inline]
pub(crate) fn friction(law: &ContactLaw, mass: f64, slip: Vector3<f64>, j_n: f64) -> (Vector3<f64>, f64) {
    let slip_speed = slip.norm();
    if slip_speed == 0.0 {
        return (Vector3::zeros(), 0.0);
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
    (slip * (j_t / slip_speed), lost_tangential)
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

    fn momentum(bodies: &[Body]) -> Vector3<f64> {
        bodies.iter().map(|body| body.velocity * body.mass).sum()
    }

    /// Bodies to the bit.
    fn bits(bodies: &[Body]) -> Vec<u64> {
        let numbers = |body: &Body| [body.velocity, body.spin].map(|vector| vector.data.0[0]).concat();
        bodies.iter().flat_map(numbers).map(f64::to_bits).collect()
    }

    #[test]
    fn without_an_external_impulse_a_contact_is_what_it_was_to_the_bit() {
        let mut random = Pcg64::seed_from_u64(7);
        for _ in 0..20_000 {
            let (law, a, b) = (law(&mut random), body(&mut random), body(&mut random));
            let normal = vector(&mut random, 1.0).normalize();
            let (plain, none) = (resolve_pair(&law, &a, &b, normal), External::new([Vector3::y(); 2], 0.0));
            let under = resolve_pair_under(&law, &a, &b, normal, &none);
            assert_eq!((bits(&under.after), under), (bits(&plain.after), plain));
            let belt = vector(&mut random, 1.0);
            let plain = resolve_surface(&law, &a, normal, belt);
            let under = resolve_surface_under(&law, &a, normal, belt, Vector3::zeros());
            assert_eq!((bits(&[under.after]), under), (bits(&[plain.after]), plain));

            // The slightest impulse changes as little: the two ways of computing are the same law.
            let slight = vector(&mut random, 1e-13);
            let under = resolve_surface_under(&law, &a, normal, belt, slight);
            let plain = resolve_surface(&law, &a, normal, belt);
            let near_threshold = matches!(law.friction, Friction::Coulomb { static_, dynamic } if static_ != dynamic);
            assert!(near_threshold || (under.after.velocity - plain.after.velocity).amax() < 1e-11);
        }
    }

    /// Energy changes by the work of the external impulse and what is dissipated, which is never negative; momentum by the external impulse;
    /// angular momentum about the point of contact by its moment.
    #[test]
    fn the_ledger_closes_on_100_000_contacts_under_forces() {
        let mut random = Pcg64::seed_from_u64(10);
        let (mut stuck, mut slipped, mut turned) = (0, 0, 0);
        for hit in 0..100_000 {
            let (mut law, a, b) = (law(&mut random), body(&mut random), body(&mut random));
            law.restitution = [0.0, 0.3, 1.0][hit % 3];
            let normal = vector(&mut random, 1.0).normalize();
            let size = [0.01, 0.3, 3.0][hit / 3 % 3];
            let external = External { on_first: vector(&mut random, size), on_second: vector(&mut random, size) };
            let pair = resolve_pair_under(&law, &a, &b, normal, &external);
            let scale = energy(&a) + energy(&b) + pair.work_external.abs() + size * size;
            let gained = energy(&pair.after[0]) + energy(&pair.after[1]) - energy(&a) - energy(&b);
            let residual = gained - pair.work_external + pair.impulse.dissipated;
            assert!(residual.abs() <= 1e-12 * scale, "{law:?} {a:?} {b:?} {external:?}: {residual:e}");
            assert!(pair.impulse.dissipated >= -1e-15 * scale && pair.impulse.normal >= 0.0);

            let met = pair.approach_speed > 0.0;
            let given = if met { external } else { External::default() };
            let change = momentum(&pair.after) - momentum(&[a, b]) - given.on_first - given.on_second;
            assert!(change.amax() < 1e-13);
            let about_contact = |body: &Body, arm: f64| {
                (normal * arm).cross(&body.velocity) * body.mass + body.spin * (0.4 * body.mass * body.radius.powi(2))
            };
            for (before, after, arm, given) in
                [(&a, &pair.after[0], -a.radius, given.on_first), (&b, &pair.after[1], b.radius, given.on_second)]
            {
                let change = about_contact(after, arm) - about_contact(before, arm) - (normal * arm).cross(&given);
                assert!(change.amax() < 1e-12);
            }
            if met {
                let relative = (pair.after[1].velocity - pair.after[0].velocity).dot(&normal);
                let rebound = law.restitution * pair.approach_speed;
                match pair.impulse.normal > 0.0 {
                    true => assert!((relative - rebound).abs() < 1e-12 * (1.0 + size / a.mass.min(b.mass))),
                    false => assert!(relative > rebound - 1e-12),
                }
                turned += u32::from(pair.impulse.normal == 0.0);
                let slip = relative_at_contact(&pair.after, normal);
                let slip = (slip - normal * slip.dot(&normal)).norm();
                match pair.impulse.tangential.norm() > 0.0 {
                    true if slip < 1e-12 * (1.0 + size / a.mass.min(b.mass)) => stuck += 1,
                    true => slipped += 1,
                    false => {}
                }
            }

            let belt = vector(&mut random, 1.0);
            let hit = resolve_surface_under(&law, &a, normal, belt, external.on_first);
            let residual = energy(&hit.after) - energy(&a) - hit.work_external - hit.work + hit.impulse.dissipated;
            assert!(residual.abs() <= 1e-12 * (scale + hit.work.abs() + 10.0));
            assert!(hit.impulse.dissipated >= -1e-15 * (scale + 10.0));
        }
        assert!(stuck > 5000 && slipped > 5000 && turned > 1000, "{stuck} {slipped} {turned}");
    }

    fn relative_at_contact([a, b]: &[Body; 2], normal: Vector3<f64>) -> Vector3<f64> {
        b.velocity - a.velocity + b.turning(-normal) - a.turning(normal)
    }

    /// 000 eq. (10) and (19) as printed, and (26) and (31) as corrected, component by component, for forces in the plane of the slip.
    #[test]
    fn impulses_under_forces_are_those_of_the_paper() {
        let mut random = Pcg64::seed_from_u64(19);
        let (n, t) = (Vector3::z(), Vector3::x());
        let mut compared = 0;
        for _ in 0..10_000 {
            // Spins about y, so that all slip lies along x.
            let flat = |random: &mut Pcg64| {
                let mut body = body(random);
                body.velocity.y = 0.0;
                body.spin = Vector3::y() * body.spin.y;
                body
            };
            let (i, j) = (flat(&mut random), flat(&mut random));
            let [mut e_i, mut e_j] = [(); 2].map(|()| vector(&mut random, 0.5));
            (e_i.y, e_j.y) = (0.0, 0.0);
            let e = random.random_range(0.0..=1.0);
            let law = ContactLaw {
                restitution: e,
                friction: Friction::Coulomb { static_: f64::INFINITY, dynamic: f64::INFINITY },
            };
            // The compression has 1 / (1 + e) of the time.
            let compression = 1.0 / (1.0 + e);
            let reduced = i.mass * j.mass / (i.mass + j.mass);
            let approach = i.velocity.z - j.velocity.z + compression * (e_i.z / i.mass - e_j.z / j.mass);
            let normal_10 = (1.0 + e) * reduced * approach;
            // s = n × t = y: the velocity of the contact point along t is v_t + r w_s for i, v_t - r w_s for j.
            let slip = (j.velocity.x - j.radius * j.spin.y) - (i.velocity.x + i.radius * i.spin.y);
            let tangential_19 = 2.0 / 7.0 * reduced * (slip + e_j.x / j.mass - e_i.x / i.mass);
            let external = External { on_first: e_i, on_second: e_j };
            let pair = resolve_pair_under(&law, &i, &j, n, &external);
            if pair.impulse.normal > 0.0 {
                compared += 1;
                assert!((pair.impulse.normal - normal_10).abs() < 1e-13);
                assert!((pair.impulse.tangential - t * tangential_19).amax() < 1e-13);
            }

            let normal_26 = -(1.0 + e) * (j.mass * j.velocity.z + compression * e_j.z);
            let tangential_31 = 2.0 / 7.0 * (j.mass * (j.velocity.x - j.radius * j.spin.y) + e_j.x);
            let hit = resolve_surface_under(&law, &j, n, Vector3::zeros(), e_j);
            if hit.impulse.normal > 0.0 {
                assert!((hit.impulse.normal - normal_26).abs() < 1e-13);
                assert!((hit.impulse.tangential - t * tangential_31).amax() < 1e-13);
                // Eq. (30): it rolls off.
                assert!((hit.after.velocity.x - j.radius * hit.after.spin.y).abs() < 1e-13);
            }
        }
        assert!(compared > 3000);
    }

    /// A heavy load leaves a grain without restitution at rest on the surface, which bears it.
    #[test]
    fn a_grain_that_is_pressed_on_does_not_approach_again() {
        let law = ContactLaw { restitution: 0.0, friction: Friction::Smooth };
        let grain = Body { mass: 2.0, radius: 0.5, velocity: -Vector3::z(), spin: Vector3::zeros() };
        let hit = resolve_surface_under(&law, &grain, Vector3::z(), Vector3::zeros(), Vector3::z() * -1000.0);
        assert_eq!((hit.after.velocity, hit.impulse.normal), (Vector3::zeros(), 1002.0));
        assert_eq!((hit.impulse.dissipated, hit.work_external), (501.0, 500.0));
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
