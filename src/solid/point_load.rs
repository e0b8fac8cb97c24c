//! Stress in an elastic half-space under a force at a point of its surface (Boussinesq 1885 and Cerruti 1882, after Johnson 1985, section 3.2 and 3.6).

use std::f64::consts::PI;

use nalgebra::Vector3;

/// A state of stress in Cartesian axes, Pa; tension is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    /// σ_xx.
    pub xx: f64,
    /// σ_yy.
    pub yy: f64,
    /// σ_zz.
    pub zz: f64,
    /// σ_xy.
    pub xy: f64,
    /// σ_yz.
    pub yz: f64,
    /// σ_zx.
    pub zx: f64,
}

impl Stress {
    /// A third of the trace, Pa: the mean of the normal stresses.
    #[must_use]
    pub fn hydrostatic(&self) -> f64 {
        (self.xx + self.yy + self.zz) / 3.0
    }

    /// Von Mises stress √(3/2 s:s), with s the deviator, Pa.
    #[must_use]
    pub fn von_mises(&self) -> f64 {
        let normal = (self.xx - self.yy).powi(2) + (self.yy - self.zz).powi(2) + (self.zz - self.xx).powi(2);
        (0.5 * normal + 3.0 * (self.xy.powi(2) + self.yz.powi(2) + self.zx.powi(2))).sqrt()
    }
}

/// A force on the surface z = 0 of a half-space z > 0, at the origin.
///
/// The stresses of Mukherjee & Zohdi (2015), eq. (49) to (58), for a force of any direction at once, in a form that holds on the axis too: with
/// R the place, ρ = |R|, x its part along the surface, F = (f, F_N), P the projection onto the surface,
///
/// 2π σ = -3 (F·R) R⊗R / ρ⁵ + (1 - 2ν) { F_N [(z/ρ³ - A) P + B x⊗x] + (f·x) [(1/ρ³ - S) P + C x⊗x] - S (f⊗x + x⊗f) },
///
/// A = 1/(ρ (ρ + z)), B = (2ρ + z)/(ρ³ (ρ + z)²), S = 1/(ρ (ρ + z)²), C = 1/(ρ³ (ρ + z)²) + 2/(ρ² (ρ + z)³).
///
/// Departures from the print: eq. (56) gives σ_zz of a tangential force as -3 x² z F/(2π ρ⁵), a copy of (58); it is -3 x z² F/(2π ρ⁵), without
/// which there is no equilibrium and a tangential force would press the solid down. And 1/r² - z/(ρ r²) of (49) and (50), which is 0/0 on the axis, is
/// written as the A that it equals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLoad {
    force: Vector3<f64>,
    /// 1 - 2ν.
    compressibility: f64,
}

impl PointLoad {
    /// A force (N) with its z into the solid, on a solid with Poisson's ratio `poisson_ratio`.
    #[must_use]
    pub fn new(force: Vector3<f64>, poisson_ratio: f64) -> Self {
        Self { force, compressibility: 1.0 - 2.0 * poisson_ratio }
    }

    /// The stress at a place (m) in the solid or on its surface, z ≥ 0, but at the origin, where it is infinite.
    #[inline]
    #[must_use]
    pub fn stress(&self, place: Vector3<f64>) -> Stress {
        let [x, y, z]: [f64; 3] = place.into();
        let [fx, fy, normal]: [f64; 3] = self.force.into();
        let rho = place.norm();
        let (near, far) = (rho.recip(), (rho + z).recip());
        let cube = near.powi(3);
        let part = self.compressibility / (2.0 * PI);
        let along = fx * x + fy * y;
        let radial = -3.0 / (2.0 * PI) * (along + normal * z) * cube * near * near;
        let slip = near * far * far;
        let outer = normal * ((2.0 * rho + z) * cube * far * far)
            + along * (cube * far * far + 2.0 * near * near * far * far * far);
        let round = normal * (z * cube - near * far) + along * (cube - slip);
        let plane = radial + part * outer;
        Stress {
            xx: plane * x * x + part * (round - 2.0 * slip * fx * x),
            yy: plane * y * y + part * (round - 2.0 * slip * fy * y),
            zz: radial * z * z,
            xy: plane * x * y - part * slip * (fx * y + fy * x),
            yz: radial * y * z,
            zx: radial * z * x,
        }
    }

    /// An upper bound of ρ² times [`equivalent_stress`](super::equivalent_stress) anywhere, N.
    ///
    /// By the triangle inequality on the terms above, |σ| ≤ (3 + |1 - 2ν| (b_N² + b_T²)^½) F/(2π ρ²) with b_N = √2 + 2 and b_T = √2 + 5; and
    /// σ_eq² = (1 + ν) s:s + (1 - 2ν) tr²/3 ≤ max(1 + ν, 1 - 2ν) |σ|².
    #[must_use]
    pub fn bound(&self) -> f64 {
        let most = std::f64::consts::SQRT_2;
        let spread = self.compressibility.abs() * (most + 2.0).hypot(most + 5.0);
        let poisson_ratio = 0.5 * (1.0 - self.compressibility);
        let weight = (1.0 + poisson_ratio).max(self.compressibility).sqrt();
        weight * (3.0 + spread) * self.force.norm() / (2.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use std::array;

    use super::super::equivalent_stress;
    use super::*;

    const RATIOS: [f64; 3] = [0.0, 0.3, 0.5];

    fn forces() -> [Vector3<f64>; 4] {
        [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, -0.4, 0.7]].map(Vector3::from)
    }

    fn rows(stress: Stress) -> [[f64; 3]; 3] {
        let Stress { xx, yy, zz, xy, yz, zx } = stress;
        [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
    }

    /// Eq. (49) to (58) as printed, with (56) put right.
    fn printed(force: Vector3<f64>, nu: f64, place: Vector3<f64>) -> [[f64; 3]; 3] {
        let normal = |load: f64| {
            let [x, y, z]: [f64; 3] = place.into();
            let (r, rho) = (x.hypot(y), place.norm());
            let rr = load / (2.0 * PI)
                * ((1.0 - 2.0 * nu) * (1.0 / r.powi(2) - z / (rho * r.powi(2))) - 3.0 * z * r * r / rho.powi(5));
            let round =
                -load / (2.0 * PI) * (1.0 - 2.0 * nu) * (1.0 / r.powi(2) - z / (rho * r.powi(2)) - z / rho.powi(3));
            let zz = -3.0 * load / (2.0 * PI) * z.powi(3) / rho.powi(5);
            let rz = -3.0 * load / (2.0 * PI) * r * z * z / rho.powi(5);
            let (c, s) = (x / r, y / r);
            let xy = (rr - round) * c * s;
            [[rr * c * c + round * s * s, xy, rz * c], [xy, rr * s * s + round * c * c, rz * s], [rz * c, rz * s, zz]]
        };
        let along_x = |load: f64, [x, y, z]: [f64; 3]| {
            let rho = place.norm();
            let (f, k) = (load / (2.0 * PI), 1.0 - 2.0 * nu);
            let (q2, q3) = ((rho + z).powi(2), (rho + z).powi(3));
            let (r2, r3, r5) = (rho.powi(2), rho.powi(3), rho.powi(5));
            let xx = f
                * (-3.0 * x.powi(3) / r5
                    + k * (x / r3 - 3.0 * x / (rho * q2) + x.powi(3) / (r3 * q2) + 2.0 * x.powi(3) / (r2 * q3)));
            let yy = f
                * (-3.0 * x * y * y / r5
                    + k * (x / r3 - x / (rho * q2) + x * y * y / (r3 * q2) + 2.0 * x * y * y / (r2 * q3)));
            let xy = f
                * (-3.0 * x * x * y / r5 + k * (-y / (rho * q2) + x * x * y / (r3 * q2) + 2.0 * x * x * y / (r2 * q3)));
            let (zz, yz, zx) = (-3.0 * f * x * z * z / r5, -3.0 * f * x * y * z / r5, -3.0 * f * x * x * z / r5);
            [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
        };
        let swapped = along_x(force.y, [place.y, place.x, place.z]);
        let axis = [1, 0, 2];
        let (n, x) = (normal(force.z), along_x(force.x, place.into()));
        array::from_fn(|i| array::from_fn(|j| n[i][j] + x[i][j] + swapped[axis[i]][axis[j]]))
    }

    #[test]
    fn it_is_what_the_paper_prints_but_for_one_equation() {
        for (force, nu) in forces().into_iter().flat_map(|force| RATIOS.map(|nu| (force, nu))) {
            for place in [[0.3, -0.2, 0.5], [-1.0, 2.0, 0.1], [0.2, 0.1, 3.0]].map(Vector3::from) {
                let (have, want) = (rows(PointLoad::new(force, nu).stress(place)), printed(force, nu, place));
                for (have, want) in have.iter().flatten().zip(want.iter().flatten()) {
                    approx::assert_relative_eq!(have, want, epsilon = 1e-12, max_relative = 1e-9);
                }
            }
        }
    }

    /// Central differences of the stress; their error is h² times third derivatives.
    fn divergence(of: impl Fn(Vector3<f64>) -> Stress, place: Vector3<f64>) -> [f64; 3] {
        const H: f64 = 1e-4;
        let mut sum = [0.0; 3];
        for axis in 0..3 {
            let step = Vector3::from_fn(|i, _| if i == axis { H } else { 0.0 });
            let [ahead, behind] = [rows(of(place + step)), rows(of(place - step))];
            (0..3).for_each(|i| sum[i] += (ahead[i][axis] - behind[i][axis]) / (2.0 * H));
        }
        sum
    }

    #[test]
    fn it_is_in_equilibrium_and_as_printed_it_is_not() {
        let place = Vector3::new(0.5, -0.4, 0.6);
        for (force, nu) in forces().into_iter().flat_map(|force| RATIOS.map(|nu| (force, nu))) {
            let load = PointLoad::new(force, nu);
            let rest = divergence(|place| load.stress(place), place);
            assert!(rest.iter().all(|part| part.abs() < 1e-6), "{rest:?}");
        }
        let load = PointLoad::new(Vector3::x(), 0.3);
        let misprint = |place: Vector3<f64>| {
            let stress = load.stress(place);
            Stress { zz: stress.zx, ..stress }
        };
        assert!(divergence(misprint, place)[2].abs() > 0.1, "eq. (56) as printed");
    }

    #[test]
    fn the_surface_is_free_of_traction() {
        for (force, nu) in forces().into_iter().flat_map(|force| RATIOS.map(|nu| (force, nu))) {
            let Stress { zz, yz, zx, .. } = PointLoad::new(force, nu).stress(Vector3::new(0.3, 0.7, 0.0));
            assert_eq!([zz, yz, zx].map(f64::abs), [0.0; 3]);
        }
    }

    /// Over a plane at depth z, tractions on what lies below add up to the force, and to its moment about the origin: with x = z tan(a) cos(b)
    /// the integrals are exact for Gauss and trapezoidal rules that are fine enough.
    #[test]
    fn every_plane_below_carries_the_force_and_its_moment() {
        let depth = 0.7;
        let (rings, sectors) = (4000, 24);
        for (force, nu) in forces().into_iter().flat_map(|force| RATIOS.map(|nu| (force, nu))) {
            let load = PointLoad::new(force, nu);
            let (mut sum, mut moment) = (Vector3::zeros(), Vector3::zeros());
            for ring in 0..rings {
                // Midpoints in the angle from the axis.
                let angle = (f64::from(ring) + 0.5) / f64::from(rings) * 0.5 * PI;
                let r = depth * angle.tan();
                let width = 0.5 * PI / f64::from(rings) * depth / angle.cos().powi(2);
                for sector in 0..sectors {
                    let turn = f64::from(sector) / f64::from(sectors) * 2.0 * PI;
                    let place = Vector3::new(r * turn.cos(), r * turn.sin(), depth);
                    let stress = load.stress(place);
                    // What lies above pushes what lies below with -sigma·z.
                    let push =
                        -Vector3::new(stress.zx, stress.yz, stress.zz) * (r * width * 2.0 * PI / f64::from(sectors));
                    sum += push;
                    moment += place.cross(&push);
                }
            }
            assert!((sum - force).amax() < 1e-6, "{sum:?} for {force:?}");
            // The moment falls off as slowly as the arm grows; a tangential force at the origin has none, a normal one neither.
            assert!(moment.amax() < 1e-3, "{moment:?} for {force:?}");
        }
    }

    #[test]
    fn on_the_axis_it_is_finite_and_the_limit_of_what_is_beside() {
        for (force, nu) in forces().into_iter().flat_map(|force| RATIOS.map(|nu| (force, nu))) {
            let load = PointLoad::new(force, nu);
            let [on, beside] = [0.0, 1e-9].map(|x| rows(load.stress(Vector3::new(x, 0.0, 2.0))));
            for (on, beside) in on.iter().flatten().zip(beside.iter().flatten()) {
                approx::assert_relative_eq!(on, beside, epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn the_bound_holds_in_every_direction() {
        for nu in [-0.5, 0.0, 0.3, 0.5] {
            let mut most: f64 = 0.0;
            for force in (0..=6).map(|tilt| f64::from(tilt) / 12.0 * PI).map(|a| Vector3::new(a.sin(), 0.0, a.cos())) {
                let load = PointLoad::new(force, nu);
                for (polar, turn) in (0..=60).flat_map(|polar| (0..60).map(move |turn| (polar, turn))) {
                    let (polar, turn) = (f64::from(polar) / 120.0 * PI, f64::from(turn) / 30.0 * PI);
                    let place = Vector3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos().max(0.0));
                    let stress = equivalent_stress(&load.stress(place * 3.0), nu) * 9.0;
                    assert!(stress <= load.bound(), "{stress} at {place:?}");
                    most = most.max(stress / load.bound());
                }
            }
            assert!(most > 0.2 || nu < 0.0, "a bound that is of use: {most} at {nu}");
        }
    }
}
