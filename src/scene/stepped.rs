//! Settings of the time-stepped schemes. Each table belongs to one scheme and is refused where another one runs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits::{Checked, positive};
use super::{Invalid, Scene, Scheme, Substep};

/// Largest part of a step or of a radius that a setting may be: above it a step no longer follows what it steps over.
const PART_MAX: f64 = 1.0;

/// Least step over the Hertz contact time: below it a contact takes a million steps, a misplaced exponent.
const STEP_FRACTION_MIN: f64 = 1e-6;

/// Largest step over the Hertz contact time: above it a contact has fewer than four steps, and energy comes from nowhere.
const STEP_FRACTION_MAX: f64 = 0.25;

/// Smallest tolerance of an iteration: below it, what an iteration changes is rounding.
const TOLERANCE_MIN: f64 = 1e-12;

/// `[fixed_point]`: the staggered scheme of Arbelaez et al. (2009), section 4, with `run.scheme = "fixed-point"`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct FixedPoint {
    /// TOL: what an iteration changes, over what grains move in the step, below which the step is accepted; 1e-12 to 1. It has an effect only
    /// where a near field acts.
    pub tolerance: f64,
    /// k_d: iterations that a step should take and may take; its length is changed so that it does.
    pub iterations: u32,
    /// eta: safety factor on each new length of a step, that of the iteration and the time to a predicted collision; above 0, at most 1.
    pub safety: f64,
    /// gamma: overlap over the radius that a step beyond a predicted collision may leave. Where no force acts, errors are proportional to it.
    pub overlap: f64,
    /// Longest step, s; left out, as long as iteration and predicted collisions allow. Under gravity alone only collisions shorten steps.
    pub largest_step: Option<f64>,
}

impl Default for FixedPoint {
    fn default() -> Self {
        Self { tolerance: 1e-6, iterations: 5, safety: 0.9, overlap: 1e-3, largest_step: None }
    }
}

/// `[trapezoidal]`: the implicit scheme of Mukherjee & Zohdi (2015), section 3, with `run.scheme = "trapezoidal"`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Trapezoidal {
    /// Length of a step, s; left out, that in which grains at the fastest impact of the scene fly 0.05 radii of the smallest. Steps are evened out
    /// to end at samples and frames.
    pub step: Option<f64>,
    /// phi: weight of the end of a step, 0 (explicit) to 1 (implicit); 1/2 is the trapezoidal rule.
    pub phi: f64,
    /// Change between two iterations over the change since the beginning of the step, for velocities and for positions, below which a step is
    /// accepted. Without a near field the iteration is exact, and this has no effect.
    pub tolerance: f64,
}

impl Default for Trapezoidal {
    fn default() -> Self {
        Self { step: None, phi: 0.5, tolerance: 1e-6 }
    }
}

/// `[soft_sphere]`: Hertz contacts with damping (Huang, Chan & Zamankhan 2010, section II), with `run.scheme = "soft-sphere"`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SoftSphere {
    /// Young's modulus of grains and surface, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio of grains and surface, above -1 and at most 1/2.
    pub poisson_ratio: f64,
    /// Length of a step over the Hertz contact time at the fastest impact of the scene.
    pub step_fraction: f64,
}

impl Default for SoftSphere {
    fn default() -> Self {
        Self { young_modulus: 1e9, poisson_ratio: 0.3, step_fraction: 0.02 }
    }
}

impl Scheme {
    /// Its name in the scene file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::EventDriven => "event-driven",
            Self::FixedPoint => "fixed-point",
            Self::Trapezoidal => "trapezoidal",
            Self::SoftSphere => "soft-sphere",
        }
    }
}

/// Validates the settings of the time-stepped schemes, and that each belongs to the scheme that runs.
pub(super) fn check(scene: &Scene) -> Checked {
    belongs(scene, "fixed_point", scene.fixed_point.is_some(), Scheme::FixedPoint)?;
    belongs(scene, "trapezoidal", scene.trapezoidal.is_some(), Scheme::Trapezoidal)?;
    belongs(scene, "soft_sphere", scene.soft_sphere.is_some(), Scheme::SoftSphere)?;
    if let Some(table) = &scene.fixed_point {
        fixed_point(table)?;
    }
    if let Some(table) = &scene.trapezoidal {
        trapezoidal(table)?;
    }
    if let Some(table) = &scene.soft_sphere {
        soft_sphere(table)?;
    }
    if scene.run.scheme == Scheme::EventDriven { Ok(()) } else { sub_steps(scene) }
}

fn belongs(scene: &Scene, table: &str, given: bool, scheme: Scheme) -> Checked {
    let runs = scene.run.scheme;
    if !given || runs == scheme {
        return Ok(());
    }
    let what = format!("`[{table}]` has no effect: the scheme is \"{}\"", runs.name());
    Err(Invalid::new(table, what, format!("take it out, or set `run.scheme = \"{}\"`", scheme.name())))
}

fn fixed_point(table: &FixedPoint) -> Checked {
    part("fixed_point.tolerance", table.tolerance)?;
    if table.tolerance < TOLERANCE_MIN {
        let what = format!("{:e} is below {TOLERANCE_MIN:e}, the rounding of an iteration", table.tolerance);
        return Err(Invalid::new("fixed_point.tolerance", what, "1e-6 is usual"));
    }
    if table.iterations == 0 {
        let what = "a step needs one iteration at least";
        return Err(Invalid::new("fixed_point.iterations", what, "give a whole number above 0; 5 is usual"));
    }
    part("fixed_point.safety", table.safety)?;
    part("fixed_point.overlap", table.overlap)?;
    table.largest_step.map_or(Ok(()), |step| positive("fixed_point.largest_step", step, "s"))
}

fn trapezoidal(table: &Trapezoidal) -> Checked {
    if !(0.0..=1.0).contains(&table.phi) {
        let what = format!("{} is outside [0, 1]", table.phi);
        return Err(Invalid::new("trapezoidal.phi", what, "use 0.5, the trapezoidal rule"));
    }
    part("trapezoidal.tolerance", table.tolerance)?;
    table.step.map_or(Ok(()), |step| positive("trapezoidal.step", step, "s"))
}

fn soft_sphere(table: &SoftSphere) -> Checked {
    positive("soft_sphere.young_modulus", table.young_modulus, "Pa")?;
    let nu = table.poisson_ratio;
    if !(nu > -1.0 && nu <= 0.5) {
        let what = format!("{nu} is outside (-1, 0.5], where an elastic solid is stable");
        return Err(Invalid::new("soft_sphere.poisson_ratio", what, "0.3 is that of steel"));
    }
    let fraction = table.step_fraction;
    if !(STEP_FRACTION_MIN..=STEP_FRACTION_MAX).contains(&fraction) {
        let what = format!("{fraction} contact times a step are outside [{STEP_FRACTION_MIN:e}, {STEP_FRACTION_MAX}]");
        return Err(Invalid::new("soft_sphere.step_fraction", what, "0.02 is usual: fifty steps a contact"));
    }
    Ok(())
}

/// A part of something: above 0, at most the whole.
fn part(key: &str, value: f64) -> Checked {
    positive(key, value, "(a pure number)")?;
    if value <= PART_MAX {
        return Ok(());
    }
    Err(Invalid::new(key, format!("{value} is above {PART_MAX}"), format!("give a number above 0, at most {PART_MAX}")))
}

/// Refuses what speaks of the sub-steps of the event-driven scheme.
fn sub_steps(scene: &Scene) -> Checked {
    let near_field = scene.near_field.as_ref();
    let of_near_field = near_field.and_then(|near_field| near_field.substep).map(|substep| match substep {
        Substep::Fixed(step) => format!("{step} s"),
        Substep::Chosen(_) => "\"auto\"".to_owned(),
    });
    let keys = [
        ("run.substep", scene.run.substep.map(|step| format!("{step} s"))),
        ("near_field.substep", of_near_field),
        ("near_field.tolerance", near_field.and_then(|field| field.tolerance).map(|tolerance| tolerance.to_string())),
        ("contact.time", scene.contact.time.map(|time| format!("{time} s"))),
    ];
    let stray = keys.into_iter().find_map(|(key, value)| Some((key, value?)));
    let Some((key, value)) = stray else { return Ok(()) };
    let scheme = scene.run.scheme.name();
    let what = format!("{value} has no effect: the scheme \"{scheme}\" makes no sub-steps between events");
    Err(Invalid::new(key, what, "take it out, or set `run.scheme = \"event-driven\"`"))
}

#[cfg(test)]
mod tests {
    use super::super::{Overrides, SceneFile};
    use super::*;

    const EVERYTHING: &str = include_str!("../../tests/everything.toml");

    fn scene(set: &[&str]) -> Scene {
        // What speaks of sub-steps goes: steps have none.
        let near_field = "near_field={alpha1=1, beta1=2, alpha2=0, beta2=3}";
        let contact = "contact={grain={restitution=1}, surface={restitution=1}}";
        let set = [near_field, contact].iter().chain(set).map(|text| (*text).to_owned()).collect();
        let overrides = Overrides { set, ..Overrides::default() };
        SceneFile::parse("all.toml".as_ref(), EVERYTHING, &overrides).unwrap_or_else(|error| panic!("{error}")).scene
    }

    #[test]
    fn every_table_is_read_with_its_scheme_and_filled_with_defaults() {
        let fixed = scene(&["run.scheme=fixed-point", "fixed_point={largest_step=1e-4, safety=0.5}"]).fixed_point;
        assert_eq!(fixed, Some(FixedPoint { largest_step: Some(1e-4), safety: 0.5, ..FixedPoint::default() }));
        let trapezoidal = scene(&["run.scheme=trapezoidal", "trapezoidal={step=1e-5}"]).trapezoidal;
        assert_eq!(trapezoidal, Some(Trapezoidal { step: Some(1e-5), phi: 0.5, tolerance: 1e-6 }));
        let soft = scene(&["run.scheme=soft-sphere", "soft_sphere.young_modulus=1e11"]).soft_sphere;
        assert_eq!(soft, Some(SoftSphere { young_modulus: 1e11, ..SoftSphere::default() }));
        assert_eq!(scene(&["run.scheme=soft-sphere"]).soft_sphere, None);
    }

    #[test]
    fn schemes_are_named_as_in_the_file() {
        for scheme in [Scheme::EventDriven, Scheme::FixedPoint, Scheme::Trapezoidal, Scheme::SoftSphere] {
            assert_eq!(serde_json::to_value(scheme).expect("a name"), scheme.name());
        }
    }
}
