//! A stress that stands for damage (Lemaitre & Desmorat 2005; Mukherjee & Zohdi 2015, section 2.6).

use super::Stress;

/// R_v = 2/3 (1 + nu) + 3 (1 - 2 nu) (sigma_H / sigma_vm)²: how much a stress of three dimensions stores over one of the same von Mises stress along a
/// line (Mukherjee & Zohdi 2015, eq. 30). Infinite where there is no shear.
///
/// The paper calls sigma_dil the "total dilatational stress"; it must be the hydrostatic stress, a third of the trace: only then is R_v = 1
/// under uniaxial stress, and sigma_vm² R_v = 2 E w with w the density of elastic energy.
#[must_use]
pub fn triaxiality(stress: &Stress, poisson_ratio: f64) -> f64 {
    let ratio = stress.hydrostatic() / stress.von_mises();
    2.0 / 3.0 * (1.0 + poisson_ratio) + 3.0 * (1.0 - 2.0 * poisson_ratio) * ratio * ratio
}

/// sigma_eq = sigma_vm √R_v (eq. 31), Pa, as √(2/3 (1 + nu) sigma_vm² + 3 (1 - 2 nu) sigma_H²), which knows no 0/0. Compression counts as tension
/// does.
#[inline]
#[must_use]
pub fn equivalent_stress(stress: &Stress, poisson_ratio: f64) -> f64 {
    let (von_mises, hydrostatic) = (stress.von_mises(), stress.hydrostatic());
    (2.0 / 3.0 * (1.0 + poisson_ratio) * von_mises * von_mises
        + 3.0 * (1.0 - 2.0 * poisson_ratio) * hydrostatic * hydrostatic)
        .sqrt()
}

/// Pi = (sigma_eq - sigma_0 + |sigma_eq - sigma_0|) / (2 sigma_0) (eq. 32): by how much a stress (Pa) is above a threshold (Pa), over the
/// threshold; 0 below.
#[inline]
#[must_use]
pub fn damage_indicator(equivalent: f64, threshold: f64) -> f64 {
    ((equivalent - threshold) / threshold).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::{Elastic, PointLoad};
    use super::*;

    #[test]
    fn along_a_line_the_triaxiality_is_one_and_with_the_whole_trace_it_is_not() {
        for nu in [0.0, 0.2, 0.3, 0.5] {
            let pull = Stress { yy: -7.0, ..Stress::default() };
            approx::assert_relative_eq!(triaxiality(&pull, nu), 1.0, max_relative = 1e-14);
            approx::assert_relative_eq!(equivalent_stress(&pull, nu), 7.0, max_relative = 1e-14);
            let whole = 2.0 / 3.0 * (1.0 + nu) + 3.0 * (1.0 - 2.0 * nu);
            approx::assert_relative_eq!(whole, 11.0 / 3.0 - 16.0 / 3.0 * nu, max_relative = 1e-14);
        }
    }

    /// 2 E w, with w = σ:ε/2 by Hooke's law.
    #[test]
    fn its_square_is_the_density_of_energy() {
        let nu = 0.27;
        let solid = Elastic::from_young(3.0, nu);
        let stress = PointLoad::new(nalgebra::Vector3::new(0.3, -0.2, 1.0), nu).stress([0.4, 0.5, 0.3].into());
        let Stress { xx, yy, zz, xy, yz, zx } = stress;
        let energy = 0.5 / solid.young() * (xx * xx + yy * yy + zz * zz - 2.0 * nu * (xx * yy + yy * zz + zz * xx))
            + 0.5 / solid.shear * (xy * xy + yz * yz + zx * zx);
        let equivalent = equivalent_stress(&stress, nu);
        approx::assert_relative_eq!(equivalent.powi(2), 2.0 * solid.young() * energy, max_relative = 1e-13);
        approx::assert_relative_eq!(
            equivalent,
            stress.von_mises() * triaxiality(&stress, nu).sqrt(),
            max_relative = 1e-14
        );
    }

    #[test]
    fn a_stress_without_shear_has_an_equivalent_too() {
        let all_round = Stress { xx: -2.0, yy: -2.0, zz: -2.0, ..Stress::default() };
        approx::assert_relative_eq!(equivalent_stress(&all_round, 0.2), 2.0 * 1.8_f64.sqrt(), max_relative = 1e-15);
        assert_eq!(equivalent_stress(&Stress::default(), 0.3), 0.0);
    }

    #[test]
    fn damage_begins_at_the_threshold() {
        assert_eq!([1.0, 2.0, 3.0].map(|stress| damage_indicator(stress, 2.0)), [0.0, 0.0, 0.5]);
    }
}
