//! Elastic moduli, and how pores change them (Hashin & Shtrikman 1963; Mukherjee & Zohdi 2015, section 2.5).

/// An isotropic elastic solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Bulk modulus kappa, Pa.
    pub bulk: f64,
    /// Shear modulus mu, Pa.
    pub shear: f64,
}

impl Elastic {
    /// The solid with Young's modulus `young` (Pa) and Poisson's ratio `poisson_ratio`, below 1/2.
    #[must_use]
    pub fn from_young(young: f64, poisson_ratio: f64) -> Self {
        Self { bulk: young / (3.0 * (1.0 - 2.0 * poisson_ratio)), shear: young / (2.0 * (1.0 + poisson_ratio)) }
    }

    /// The solid with bulk modulus `bulk` (Pa) and Poisson's ratio `poisson_ratio`.
    #[must_use]
    pub fn from_bulk(bulk: f64, poisson_ratio: f64) -> Self {
        Self::from_young(3.0 * (1.0 - 2.0 * poisson_ratio) * bulk, poisson_ratio)
    }

    /// Young's modulus, Pa.
    #[must_use]
    pub fn young(&self) -> f64 {
        9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)
    }

    /// Poisson's ratio.
    #[must_use]
    pub fn poisson_ratio(&self) -> f64 {
        (3.0 * self.bulk - 2.0 * self.shear) / (6.0 * self.bulk + 2.0 * self.shear)
    }

    /// E / (1 - nu²) (Pa): how stiff the solid is against a rigid grain.
    #[must_use]
    pub fn plane_modulus(&self) -> f64 {
        self.young() / (1.0 - self.poisson_ratio().powi(2))
    }

    /// The solid with pores that take up a part `porosity` (0 to 1) of its volume: phi times the upper and 1 - phi times the lower bound of Hashin &
    /// Shtrikman (Mukherjee & Zohdi 2015, eq. 28 and 29), with `weight` = phi, and pores that have `contrast` = C > 0 times the moduli of the solid.
    ///
    /// The upper bound hardly knows C, the lower one is proportional to it.
    #[must_use]
    pub fn porous(&self, porosity: f64, weight: f64, contrast: f64) -> Self {
        let pores = Self { bulk: contrast * self.bulk, shear: contrast * self.shear };
        let mix = |[lower, upper]: [f64; 2]| weight * upper + (1.0 - weight) * lower;
        let solid = 1.0 - porosity;
        Self {
            bulk: mix(hashin_shtrikman_bulk(&pores, self, solid)),
            shear: mix(hashin_shtrikman_shear(&pores, self, solid)),
        }
    }
}

/// Lower and upper bound of the bulk modulus (Pa) of two solids of which the second, which must be the stiffer one in bulk and in shear, takes up
/// a part `stiff_part` of the volume (Mukherjee & Zohdi 2015, eq. 22 and 23).
#[must_use]
pub fn hashin_shtrikman_bulk(weak: &Elastic, stiff: &Elastic, stiff_part: f64) -> [f64; 2] {
    let bound = |of: &Elastic, other: &Elastic, part: f64| {
        of.bulk + part / ((other.bulk - of.bulk).recip() + 3.0 * (1.0 - part) / (3.0 * of.bulk + 4.0 * of.shear))
    };
    [bound(weak, stiff, stiff_part), bound(stiff, weak, 1.0 - stiff_part)]
}

/// The same of the shear modulus (Pa), eq. (25) and (26).
#[must_use]
pub fn hashin_shtrikman_shear(weak: &Elastic, stiff: &Elastic, stiff_part: f64) -> [f64; 2] {
    let bound = |of: &Elastic, other: &Elastic, part: f64| {
        let resistance =
            6.0 * (1.0 - part) * (of.bulk + 2.0 * of.shear) / (5.0 * of.shear * (3.0 * of.bulk + 4.0 * of.shear));
        of.shear + part / ((other.shear - of.shear).recip() + resistance)
    };
    [bound(weak, stiff, stiff_part), bound(stiff, weak, 1.0 - stiff_part)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOLID: Elastic = Elastic { bulk: 100e9, shear: 46e9 };

    #[test]
    fn moduli_go_into_each_other() {
        let steel = Elastic::from_young(210e9, 0.3);
        approx::assert_relative_eq!(steel.young(), 210e9, max_relative = 1e-14);
        approx::assert_relative_eq!(steel.poisson_ratio(), 0.3, max_relative = 1e-14);
        approx::assert_relative_eq!(Elastic::from_bulk(steel.bulk, 0.3).shear, steel.shear, max_relative = 1e-14);
    }

    #[test]
    fn without_pores_and_without_a_solid_the_bounds_are_exact() {
        let pores = Elastic { bulk: 1e-3 * SOLID.bulk, shear: 1e-3 * SOLID.shear };
        for (part, is) in [(0.0, pores), (1.0, SOLID)] {
            for (bounds, want) in [
                (hashin_shtrikman_bulk(&pores, &SOLID, part), is.bulk),
                (hashin_shtrikman_shear(&pores, &SOLID, part), is.shear),
            ] {
                bounds.iter().for_each(|have| approx::assert_relative_eq!(*have, want, max_relative = 1e-12));
            }
        }
    }

    #[test]
    fn the_bounds_are_in_order_and_within_those_of_voigt_and_reuss() {
        let pores = Elastic { bulk: 0.1 * SOLID.bulk, shear: 0.2 * SOLID.shear };
        for part in (1..10).map(|tenth| f64::from(tenth) / 10.0) {
            for ([lower, upper], [weak, stiff]) in [
                (hashin_shtrikman_bulk(&pores, &SOLID, part), [pores.bulk, SOLID.bulk]),
                (hashin_shtrikman_shear(&pores, &SOLID, part), [pores.shear, SOLID.shear]),
            ] {
                let (voigt, reuss) = (part * stiff + (1.0 - part) * weak, 1.0 / (part / stiff + (1.0 - part) / weak));
                assert!(reuss < lower && lower < upper && upper < voigt, "{reuss} {lower} {upper} {voigt}");
            }
        }
    }

    /// With equal shear moduli the bulk modulus is known: both bounds are Hill's (1963).
    #[test]
    fn equal_shear_moduli_leave_no_gap() {
        let weak = Elastic { bulk: 20e9, shear: SOLID.shear };
        let [lower, upper] = hashin_shtrikman_bulk(&weak, &SOLID, 0.3);
        let over = |modulus: f64| 1.0 / (3.0 * modulus + 4.0 * SOLID.shear);
        let hill = (1.0 / (0.3 * over(SOLID.bulk) + 0.7 * over(weak.bulk)) - 4.0 * SOLID.shear) / 3.0;
        approx::assert_relative_eq!(lower, upper, max_relative = 1e-12);
        approx::assert_relative_eq!(lower, hill, max_relative = 1e-12);
    }

    /// PHYSICS 2.9: C matters to the upper bound by 0.02 % at 1e-4, and to the lower one by all.
    #[test]
    fn the_stiffness_of_pores_matters_to_the_lower_bound_only() {
        let at = |weight, contrast| SOLID.porous(0.3, weight, contrast).bulk;
        assert!((at(1.0, 1e-4) / at(1.0, 1e-9) - 1.0).abs() < 2e-4);
        approx::assert_relative_eq!(at(0.0, 1e-4) / at(0.0, 1e-6), 100.0, max_relative = 2e-3);
    }

    /// With nu = 0.2 pores leave Poisson's ratio where it is.
    #[test]
    fn a_poisson_ratio_of_a_fifth_stays() {
        let solid = Elastic::from_bulk(100e9, 0.2);
        for porosity in [0.1, 0.3, 0.5] {
            approx::assert_relative_eq!(solid.porous(porosity, 1.0, 1e-12).poisson_ratio(), 0.2, epsilon = 1e-11);
        }
        let other = Elastic::from_bulk(100e9, 0.3);
        assert!(other.porous(0.5, 1.0, 1e-4).poisson_ratio() < 0.28);
    }
}
