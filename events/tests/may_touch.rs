//! The bound that spares most pairs their root never says no where there is a contact.

use impinge_events::Flight;
use impinge_events::contact_time::{sphere_sphere, spheres_may_touch};
use nalgebra::Vector3;
use proptest::prelude::*;

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    let parts = [-1.0..1.0f64, -1.0..1.0, -1.0..1.0];
    parts.prop_map(Vector3::from).prop_filter("a direction", |v| v.norm() > 0.1).prop_map(|v| v.normalize())
}

/// 10 to a power, so that all sizes are as likely.
fn decades(from: f64, to: f64) -> impl Strategy<Value = f64> {
    (from..to).prop_map(|exponent: f64| 10f64.powf(exponent))
}

/// How a pair meets: where it touches, after how long, how far off-centre, and from which states.
#[derive(Clone, Debug)]
struct Meeting {
    normal: Vector3<f64>,
    side: Vector3<f64>,
    /// Sum of the radii, m, and the part of the first.
    reach: f64,
    part: f64,
    /// Way of the second to the contact as the first sees it, m; its speed, m/s.
    way: f64,
    speed: f64,
    /// Impact parameter less the sum of the radii, over the sum.
    miss: f64,
    /// Local times in parts of the time to contact.
    times: [f64; 2],
    /// Where it happens, in sums of the radii.
    place: Vector3<f64>,
    /// Velocity of the first over the speed.
    drift: Vector3<f64>,
}

impl Meeting {
    /// The two states, and about when they meet (s).
    fn flights(&self) -> ([Flight; 2], f64) {
        let across = (self.side - self.normal * self.side.dot(&self.normal)).normalize();
        let meets = self.way / self.speed;
        // Off-centre by the impact parameter: at closest approach the two are side by side.
        let relative = self.normal * self.way + across * (self.reach * (1.0 + self.miss));
        let velocity = self.drift * self.speed;
        let flight = |position, velocity, radius, time: f64| {
            let at_start = Flight { position, time: 0.0, velocity, radius };
            at_start.advanced_to(time * meets)
        };
        let first = self.place * self.reach;
        let a = flight(first, velocity, self.reach * self.part, self.times[0]);
        let second_velocity = velocity - self.normal * self.speed;
        let b = flight(first + relative, second_velocity, self.reach * (1.0 - self.part), self.times[1]);
        ([a, b], meets)
    }
}

/// Head-on, grazing and near misses, near and 1e8 radii away, touching already, at the origin and up to 1e4 radii from it, at equal and at different local
/// times, at speeds of every day and at those whose squares underflow.
fn meetings() -> impl Strategy<Value = Meeting> {
    let miss = prop_oneof![-1.0..0.1f64, decades(-16.0, -1.0), decades(-16.0, -1.0).prop_map(|miss| -miss), Just(0.0)];
    let times = prop_oneof![Just([0.0; 2]), [0.0..0.9f64, 0.0..0.9]];
    let place = prop_oneof![Just(Vector3::zeros()), (direction(), decades(0.0, 4.0)).prop_map(|(at, far)| at * far)];
    let drift = prop_oneof![Just(Vector3::zeros()), (direction(), 0.0..3.0f64).prop_map(|(at, speed)| at * speed)];
    let speed = prop_oneof![3 => decades(-6.0, 3.0), 1 => decades(-270.0, -130.0)];
    let pair = (decades(-5.0, 2.0), 0.01..0.99f64, decades(-2.0, 8.0), speed);
    (direction(), direction(), pair, miss, times, place, drift)
        .prop_filter("not along each other", |(normal, side, ..)| normal.cross(side).norm() > 0.1)
        .prop_map(|(normal, side, (reach, part, way, speed), miss, times, place, drift)| Meeting {
            normal,
            side,
            reach,
            part,
            way: way * reach,
            speed,
            miss,
            times,
            place,
            drift,
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn a_pair_that_meets_may_touch(meeting in meetings(), later in 0.0..2.0f64) {
        let ([a, b], _) = meeting.flights();
        let shift = meeting.side * (10.0 * meeting.reach);
        let image = |shift| Flight { position: b.position - shift, ..b };
        for (a, b, shift) in [(a, b, Vector3::zeros()), (b, a, Vector3::zeros()), (a, image(shift), shift)] {
            let far = Flight { position: b.position * 1e9, ..b };
            if let Some(time) = sphere_sphere(&a, &b, shift) {
                // Until the very time of contact, and until some time after it; whoever stands beside it, be it far away.
                for (until, number) in [time, time + later * time.abs()].into_iter().flat_map(|until| (0..4).map(move |number| (until, number))) {
                    let mut four = [&far; 4];
                    let shifted = Flight { position: b.position + shift, ..b };
                    four[number] = &shifted;
                    let bits = spheres_may_touch(&a, four, until);
                    prop_assert!(bits >> number & 1 != 0, "{a:?}, {b:?}, {shift:?}: {time} s");
                }
            }
        }
    }

    /// Whoever flies side by side, as all grains of a jet do before they hit anything, was looked at as if nothing were known of the two.
    #[test]
    fn a_pair_that_flies_side_by_side_was_looked_at_in_vain(place in direction(), velocity in direction(), until in prop_oneof![0.0..1e9f64, Just(f64::INFINITY)]) {
        let a = Flight { position: Vector3::zeros(), time: 0.0, velocity, radius: 0.4 };
        let b = Flight { position: place, ..a };
        prop_assert_eq!(spheres_may_touch(&a, [&b; 4], until), 0);
    }

    /// The same for pairs that touch or overlap by rounding, approach and recede.
    #[test]
    fn a_pair_that_touches_may_touch(normal in direction(), overlap in -1e-12..1e-12f64, velocity in direction(), reach in decades(-5.0, 2.0), time in 0.0..1e3f64) {
        let a = Flight { position: Vector3::zeros(), time, velocity: Vector3::zeros(), radius: 0.3 * reach };
        let b = Flight { position: normal * (reach * (1.0 - overlap)), time, velocity, radius: 0.7 * reach };
        if let Some(time) = sphere_sphere(&a, &b, Vector3::zeros()) {
            prop_assert_eq!(spheres_may_touch(&a, [&b; 4], time), 0b1111, "{:?}, {:?}", a, b);
        }
    }
}
