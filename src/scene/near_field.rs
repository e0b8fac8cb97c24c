//! Forces between grains, and the sub-steps in which forces act.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scene;

/// Relative local error of a sub-step where the scene gives none.
const DEFAULT_TOLERANCE: f64 = 1e-6;

/// How deep grains may go into each other where forces act, over the smaller radius, where the scene does not say.
pub const DEFAULT_PENETRATION: f64 = 1e-4;

/// Where the smooth switch begins, over the cut-off, where the scene does not say.
const DEFAULT_SWITCH: f64 = 0.8;

/// `[near_field]`: a central force between any two grains of alpha1 r^-beta1 (attraction) less alpha2 r^-beta2 (repulsion), with r the distance
/// of the centres (Arbelaez et al. 2009, eq. 3). It acts in sub-steps.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct NearField {
    /// Strength of the attraction, N m^beta1.
    pub alpha1: f64,
    /// Exponent of the attraction; any number that is not below 0.
    pub beta1: f64,
    /// Strength of the repulsion, N m^beta2.
    pub alpha2: f64,
    /// Exponent of the repulsion; any number that is not below 0.
    pub beta2: f64,
    /// Time between two evaluations of the forces: seconds, or "auto" for one that keeps the local error within `tolerance`. Left out, that
    /// of `[run]`, and "auto" where there is none.
    pub substep: Option<Substep>,
    /// With `substep = "auto"`: the local error of a sub-step, which is the largest difference in position of any grain between one whole and
    /// two half sub-steps, over its radius. 1e-6 where left out.
    pub tolerance: Option<f64>,
    /// How the forces of all pairs are summed. In a periodic domain only "cut-off" will do.
    #[serde(default)]
    pub sum: Summation,
    /// With `sum = "cut-off"`: distance from which on there is no force, m; at most half the smallest period of a periodic domain.
    pub cutoff: Option<f64>,
    /// With `sum = "cut-off"`: distance at which a smooth switch to no force begins, m: from half of `cutoff` on, and 0.8 `cutoff` where
    /// left out.
    pub switch: Option<f64>,
    /// Bound on the relative error of the force that a tree sums; above 0, at most 0.1.
    #[serde(default = "default_accuracy")]
    pub accuracy: f64,
}

fn default_accuracy() -> f64 {
    1e-4
}

impl NearField {
    /// From so many grains on `sum = "auto"` takes the tree, which then is ahead of the direct sum.
    pub const TREE_FROM: u64 = 4000;

    /// How the forces of so many grains are summed: what `sum` says, with "auto" decided.
    #[must_use]
    pub fn summation(&self, grains: u64) -> Summation {
        match self.sum {
            Summation::Auto if grains < Self::TREE_FROM => Summation::Direct,
            Summation::Auto => Summation::Tree,
            chosen => chosen,
        }
    }

    /// Where the smooth switch begins, m; none without a cut-off.
    #[must_use]
    pub fn switch_from(&self) -> Option<f64> {
        self.cutoff.map(|cutoff| self.switch.unwrap_or(DEFAULT_SWITCH * cutoff))
    }
}

/// Time between two evaluations of the forces.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub enum Substep {
    /// Always the same, s.
    Fixed(f64),
    /// Chosen on the way.
    Chosen(Auto),
}

/// The word for a sub-step that is chosen on the way.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Auto {
    /// As long as the tolerance allows.
    Auto,
}

/// How the forces of all pairs are summed.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Summation {
    /// "direct" below 4000 grains, "tree" from there on.
    #[default]
    Auto,
    /// Every pair by itself: exact, and the cost grows with the square of the number of grains.
    Direct,
    /// Only pairs closer than `cutoff`.
    CutOff,
    /// Far groups of grains as one, as far as `accuracy` allows.
    Tree,
}

impl Scene {
    /// Whether forces act between events: gravity or a near field. Without them there are no sub-steps.
    #[must_use]
    pub fn has_forces(&self) -> bool {
        self.run.gravity != [0.0; 3] || self.near_field.is_some()
    }

    /// The sub-step of a scene with forces, wherever the scene gives it.
    #[must_use]
    pub fn substep(&self) -> Substep {
        let of_near_field = self.near_field.as_ref().and_then(|near_field| near_field.substep);
        let of_run = self.run.substep.map(Substep::Fixed);
        of_near_field.or(of_run).unwrap_or(Substep::Chosen(Auto::Auto))
    }

    /// How deep grains may go into each other where forces act, over the smaller radius: `run.penetration`, or its default.
    #[must_use]
    pub fn penetration(&self) -> f64 {
        self.run.penetration.unwrap_or(DEFAULT_PENETRATION)
    }

    /// The relative local error that a sub-step of `"auto"` may have: [`NearField::tolerance`], or its default.
    #[must_use]
    pub fn tolerance(&self) -> f64 {
        self.near_field.as_ref().and_then(|near_field| near_field.tolerance).unwrap_or(DEFAULT_TOLERANCE)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Overrides, SceneFile};
    use super::*;

    const EVERYTHING: &str = include_str!("../../tests/everything.toml");

    fn scene(set: &[&str]) -> Scene {
        let set = set.iter().map(|text| (*text).to_owned()).collect();
        let overrides = Overrides { set, ..Overrides::default() };
        SceneFile::parse("all.toml".as_ref(), EVERYTHING, &overrides).expect("it is valid").scene
    }

    #[test]
    fn the_sub_step_comes_from_the_near_field_then_the_run_and_else_is_chosen() {
        let auto = Substep::Chosen(Auto::Auto);
        let all = scene(&[]);
        assert_eq!((all.substep(), all.tolerance(), all.has_forces()), (auto, 1e-5, true));
        // A whole number is as good as any.
        let fixed = scene(&["near_field={alpha1=1, beta1=2, alpha2=0, beta2=0, substep=1}"]);
        assert_eq!((fixed.substep(), fixed.tolerance()), (Substep::Fixed(1.0), DEFAULT_TOLERANCE));
        let bare = "near_field={alpha1=1, beta1=2, alpha2=0, beta2=0}";
        assert_eq!(scene(&[bare]).substep(), auto);
        assert_eq!(scene(&[bare, "run.substep=0.5"]).substep(), Substep::Fixed(0.5));
    }

    #[test]
    fn a_sum_that_is_not_chosen_goes_by_the_number_of_grains() {
        let bare: NearField = toml::from_str("alpha1 = 1\nbeta1 = 2\nalpha2 = 0\nbeta2 = 3").expect("it is valid");
        assert_eq!([3999, 4000].map(|grains| bare.summation(grains)), [Summation::Direct, Summation::Tree]);
        let direct = NearField { sum: Summation::Direct, ..bare };
        assert_eq!(direct.summation(1_000_000), Summation::Direct);
        assert_eq!(bare.switch_from(), None);
        let cut = NearField { cutoff: Some(0.5), ..bare };
        assert_eq!(cut.switch_from(), Some(0.4));
        assert_eq!(NearField { switch: Some(0.1), ..cut }.switch_from(), Some(0.1));
    }
}
