//! How radii are drawn.

use std::f64::consts::PI;

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::value;
use crate::scene::{Distribution, Invalid, Radius};

/// Where a normal distribution is cut, in standard deviations; a draw beyond is drawn again.
const NORMAL_CUT: f64 = 3.0;

/// Variance of a standard normal variable cut at ± 3: 1 − 6 φ(3) / (2 Φ(3) − 1).
const CUT_VARIANCE: f64 = 0.973_336_924_662_541_5;

/// Largest coefficient of variation of a lognormal radius. Beyond it one grain in ten thousand has more than 15 times the
/// mean radius and thousands of times the mean mass: that is no longer one material, and no block could be filled with it.
const LOGNORMAL_CV_LIMIT: f64 = 1.0;

/// A valid way to draw radii: every draw is finite and larger than 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Radii {
    /// All alike, m.
    Constant(f64),
    /// Drawn, m.
    Drawn { mean: f64, cv: f64, distribution: Distribution },
}

impl Radii {
    /// Checks what stands at `key` in the scene.
    ///
    /// # Errors
    /// A mean that is not positive, or a coefficient of variation that would allow radii of 0 or less.
    pub(super) fn new(radius: &Radius, key: &str) -> Result<Self, Invalid> {
        let drawn = match radius {
            Radius::Constant(radius) => return value::positive(key, *radius).map(Self::Constant),
            Radius::Drawn(drawn) => drawn,
        };
        let mean = value::positive(&format!("{key}.mean"), drawn.mean)?;
        let cv_key = format!("{key}.cv");
        let cv = value::not_negative(&cv_key, drawn.cv)?;
        let too_wide = |limit: String| {
            Invalid::new(
                &cv_key,
                format!("{cv} is too wide for a {:?} radius", drawn.distribution).to_lowercase(),
                limit,
            )
        };
        match drawn.distribution {
            Distribution::Uniform if 1.0 - 3f64.sqrt() * cv <= 0.0 => {
                Err(too_wide("give less than 0.577 (1/√3): the smallest radius is mean (1 - √3 cv)".into()))
            }
            Distribution::Normal if 1.0 - NORMAL_CUT * cv <= 0.0 => {
                Err(too_wide("give less than 1/3: the smallest radius is mean (1 - 3 cv)".into()))
            }
            Distribution::Lognormal if cv > LOGNORMAL_CV_LIMIT => {
                Err(too_wide(format!("give at most {LOGNORMAL_CV_LIMIT}")))
            }
            distribution => Ok(Self::Drawn { mean, cv, distribution }),
        }
    }

    /// One radius, m.
    pub(super) fn draw(&self, rng: &mut impl Rng) -> f64 {
        let (mean, cv) = match *self {
            Self::Constant(radius) => return radius,
            Self::Drawn { mean, cv, .. } => (mean, cv),
        };
        match self.distribution() {
            Some(Distribution::Lognormal) => {
                let variance = (1.0 + cv * cv).ln();
                mean * (variance.sqrt() * rng.sample::<f64, _>(StandardNormal) - 0.5 * variance).exp()
            }
            Some(Distribution::Normal) => loop {
                let deviation: f64 = rng.sample(StandardNormal);
                if deviation.abs() <= NORMAL_CUT {
                    break mean * (1.0 + cv * deviation);
                }
            },
            _ => mean * (1.0 + 3f64.sqrt() * cv * (2.0 * rng.random::<f64>() - 1.0)),
        }
    }

    /// Lower and upper bound of what is drawn, m.
    pub(super) fn bounds(&self) -> (f64, f64) {
        match *self {
            Self::Constant(radius) => (radius, radius),
            Self::Drawn { distribution: Distribution::Lognormal, .. } => (0.0, f64::INFINITY),
            Self::Drawn { mean, cv, distribution } => {
                let width = if distribution == Distribution::Normal { NORMAL_CUT } else { 3f64.sqrt() } * cv;
                (mean * (1.0 - width), mean * (1.0 + width))
            }
        }
    }

    /// Mean radius, m.
    pub(super) fn mean(&self) -> f64 {
        match *self {
            Self::Constant(mean) | Self::Drawn { mean, .. } => mean,
        }
    }

    /// Mean of the squared radius, m².
    pub(super) fn mean_square(&self) -> f64 {
        self.mean().powi(2) * (1.0 + self.relative_variance())
    }

    /// Mean of the cubed radius, m³.
    pub(super) fn mean_cube(&self) -> f64 {
        let variance = self.relative_variance();
        let skewed = self.distribution() == Some(Distribution::Lognormal);
        self.mean().powi(3) * if skewed { (1.0 + variance).powi(3) } else { 1.0 + 3.0 * variance }
    }

    /// The densest packing of such grains: no larger part of space (in a planar scene, of the plane) can be solid.
    ///
    /// π/√18 for equal spheres (Hales 2005) and π/√12 for equal circles (Thue 1910); of unequal grains it is only known that
    /// they fill less than all. It holds in a box too, since copies of the box fill space.
    pub(super) fn densest_packing(&self, planar: bool) -> f64 {
        match (self, planar) {
            (Self::Drawn { .. }, _) => 1.0,
            (Self::Constant(_), true) => PI / 12f64.sqrt(),
            (Self::Constant(_), false) => PI / 18f64.sqrt(),
        }
    }

    fn distribution(&self) -> Option<Distribution> {
        match *self {
            Self::Constant(_) => None,
            Self::Drawn { distribution, .. } => Some(distribution),
        }
    }

    /// Variance over the square of the mean, the cut of the normal distribution included.
    fn relative_variance(&self) -> f64 {
        match *self {
            Self::Constant(_) => 0.0,
            Self::Drawn { cv, distribution: Distribution::Normal, .. } => CUT_VARIANCE * cv * cv,
            Self::Drawn { cv, .. } => cv * cv,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DrawnRadius;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    fn radii(cv: f64, distribution: Distribution) -> Result<Radii, Invalid> {
        Radii::new(&Radius::Drawn(DrawnRadius { mean: 0.01, cv, distribution }), "grain.radius")
    }

    #[test]
    fn moments_are_those_that_were_asked_for() {
        const DRAWS: usize = 400_000;
        for (cv, distribution) in [
            (0.3, Distribution::Uniform),
            (0.57, Distribution::Uniform),
            (0.2, Distribution::Normal),
            (0.33, Distribution::Normal),
            (0.1, Distribution::Lognormal),
            (0.5, Distribution::Lognormal),
        ] {
            let radii = radii(cv, distribution).unwrap();
            let mut rng = Pcg64Mcg::seed_from_u64(3);
            let (low, high) = radii.bounds();
            let mut sums = [0.0; 3];
            for _ in 0..DRAWS {
                let radius = radii.draw(&mut rng);
                assert!(radius > 0.0 && low <= radius && radius <= high);
                (0..3).for_each(|power| sums[power] += radius.powi(power as i32 + 1));
            }
            let expected = [radii.mean(), radii.mean_square(), radii.mean_cube()];
            for power in 0..3 {
                let ratio = sums[power] / DRAWS as f64 / expected[power];
                // Five standard errors of the mean of a power of a variable with this cv, generously.
                let tolerance = 5.0 * 3.0 * (power as f64 + 1.0) * cv * (1.0 + cv) / (DRAWS as f64).sqrt();
                assert!((ratio - 1.0).abs() < tolerance, "{distribution:?} power {power}: {ratio}");
            }
        }
    }

    #[test]
    fn lognormal_has_a_gaussian_logarithm() {
        let radii = radii(0.5, Distribution::Lognormal).unwrap();
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        let logs: Vec<f64> = (0..100_000).map(|_| radii.draw(&mut rng).ln()).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        let moment = |power| logs.iter().map(|log| (log - mean).powi(power)).sum::<f64>() / logs.len() as f64;
        assert!((moment(2) / 1.25f64.ln() - 1.0).abs() < 0.02);
        assert!((moment(3) / moment(2).powf(1.5)).abs() < 0.04, "skewness");
        assert!((moment(4) / moment(2).powi(2) - 3.0).abs() < 0.1, "kurtosis");
    }

    #[test]
    fn radii_that_could_vanish_are_refused() {
        for (cv, distribution) in [
            (0.578, Distribution::Uniform),
            (0.334, Distribution::Normal),
            (1.1, Distribution::Lognormal),
            (-0.1, Distribution::Normal),
            (f64::NAN, Distribution::Uniform),
        ] {
            let refusal = radii(cv, distribution).unwrap_err();
            assert_eq!(refusal.key, "grain.radius.cv");
            assert!(!refusal.remedy.is_empty());
        }
        for radius in [0.0, -0.01, f64::NAN, f64::INFINITY] {
            assert_eq!(Radii::new(&Radius::Constant(radius), "source[2].radius").unwrap_err().key, "source[2].radius");
        }
    }

    #[test]
    fn no_variation_is_a_constant_in_effect() {
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        for distribution in [Distribution::Uniform, Distribution::Normal, Distribution::Lognormal] {
            assert_eq!(radii(0.0, distribution).unwrap().draw(&mut rng), 0.01);
        }
    }
}
