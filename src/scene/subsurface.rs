//! What is measured below a surface: `[[measure]]` with `kind = "subsurface"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits::{Checked, positive};
use super::measure::{check_grid, default_batches};
use super::{Invalid, Scene, Surface, Vec3};

/// So much of its size may rounding put a grid above the plane that it reaches up to.
const ROUNDING: f64 = 1e-12;

/// `kind = "subsurface"`: a plane bounds an elastic solid, and each hit on it is a force on a point of it. Hits on triangles that lie in the plane count
/// too.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SubsurfaceMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// A point of the plane, m; left out, that of the first plane of the scene that is at rest.
    pub point: Option<Vec3>,
    /// Normal of the plane, away from the solid, with `point`; any length but 0.
    pub normal: Option<Vec3>,
    /// Lower corner of the grid, m; all of it must be below the plane.
    pub min: Vec3,
    /// Upper corner of the grid, m.
    pub max: Vec3,
    /// Cells along x, y and z; the stress is that in the middle of a cell.
    pub cells: [u32; 3],
    /// Young's modulus of the solid without pores, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio of the solid without pores, above -1 and below 1/2.
    #[serde(default = "default_poisson_ratio")]
    pub poisson_ratio: f64,
    /// Part of the volume that is pores, 0 to below 1.
    #[serde(default)]
    pub porosity: f64,
    /// phi: weight of the upper bound of Hashin & Shtrikman in the moduli of the porous solid, 0 to 1; the rest is that of the lower one.
    #[serde(default = "one")]
    pub bound: f64,
    /// C: moduli of the pores over those of the solid; above 0, below 1.
    #[serde(default = "default_pore_stiffness")]
    pub pore_stiffness: f64,
    /// sigma_0: equivalent stress above which there is damage, Pa.
    pub threshold: f64,
    /// How long a contact lasts, which makes a force of an impulse: seconds, or "hertz" for that of an elastic contact of the grain with the porous
    /// solid.
    #[serde(default)]
    pub contact_time: ContactTime,
    /// With `contact_time = "hertz"`: Young's modulus of the grains, Pa; left out, they are rigid.
    pub grain_young_modulus: Option<f64>,
    /// With `grain_young_modulus`: Poisson's ratio of the grains, above -1 and at most 1/2; 0.3 where left out.
    pub grain_poisson_ratio: Option<f64>,
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches that tell how damage grows, and how sure it is where hits come evenly.
    #[serde(default = "default_batches")]
    pub batches: u32,
}

impl SubsurfaceMeasure {
    /// Poisson's ratio of solids and grains where the scene gives none: that of steel.
    pub const POISSON_RATIO: f64 = 0.3;

    /// Point (m) and normal of the plane: its own, or those of the first plane of the scene that is at rest.
    #[must_use]
    pub fn plane(&self, scene: &Scene) -> Option<[Vec3; 2]> {
        let at_rest = |surface: &Surface| match surface {
            Surface::Plane(plane) if plane.velocity == [0.0; 3] => Some([plane.point, plane.normal]),
            _ => None,
        };
        self.point.zip(self.normal).map(Into::into).or_else(|| scene.surface.iter().find_map(at_rest))
    }
}

fn default_poisson_ratio() -> f64 {
    SubsurfaceMeasure::POISSON_RATIO
}

fn one() -> f64 {
    1.0
}

fn default_pore_stiffness() -> f64 {
    1e-4
}

/// How long a contact lasts.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub enum ContactTime {
    /// Always the same, s.
    Fixed(f64),
    /// As long as its grain and its speed make it.
    Elastic(Elastic),
}

impl Default for ContactTime {
    fn default() -> Self {
        Self::Elastic(Elastic::Hertz)
    }
}

/// A model of a contact.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Elastic {
    /// Hertz (1882).
    Hertz,
}

/// Validates a measurement; `key` gives the path of one of its keys.
pub(super) fn check(key: &impl Fn(&str) -> String, measure: &SubsurfaceMeasure, scene: &Scene) -> Checked {
    for (given, missing, name) in [(measure.point, measure.normal, "normal"), (measure.normal, measure.point, "point")]
    {
        if given.is_some() && missing.is_none() {
            let what = format!("there is no `{name}` of the plane");
            return Err(Invalid::new(key(name), what, "give both `point` and `normal`, or neither"));
        }
    }
    let Some([point, normal]) = measure.plane(scene) else {
        let remedy = "give `point` and `normal` of the plane, or add a [[surface]] with `kind = \"plane\"`";
        return Err(Invalid::new(key("kind"), "there is no plane at rest that bounds a solid", remedy));
    };
    let length = normal.iter().map(|part| part * part).sum::<f64>().sqrt();
    if length == 0.0 {
        return Err(Invalid::new(key("normal"), "it has no direction", "give a vector that is not 0"));
    }
    check_grid(key, Some(measure.min), Some(measure.max), measure.cells, measure.batches, scene)?;
    let corners = (0..8).map(|corner| -> Vec3 {
        std::array::from_fn(|axis| if corner >> axis & 1 == 0 { measure.min[axis] } else { measure.max[axis] })
    });
    let height = |corner: Vec3| (0..3).map(|i| (corner[i] - point[i]) * normal[i]).sum::<f64>() / length;
    let highest = corners.map(height).fold(f64::NEG_INFINITY, f64::max);
    let size = (0..3).map(|axis| measure.max[axis] - measure.min[axis]).fold(0.0, f64::max);
    if highest > ROUNDING * size {
        let what = format!("the grid reaches {highest} m above the plane, where there is no solid");
        return Err(Invalid::new(key("max"), what, "move the grid down, or make it smaller"));
    }
    positive(&key("young_modulus"), measure.young_modulus, "Pa")?;
    positive(&key("threshold"), measure.threshold, "Pa")?;
    let nu = measure.poisson_ratio;
    if !(nu > -1.0 && nu < 0.5) {
        let what = format!("{nu} is outside (-1, 0.5), where a solid has a bulk modulus");
        return Err(Invalid::new(key("poisson_ratio"), what, "0.3 is that of steel"));
    }
    if !(0.0..1.0).contains(&measure.porosity) {
        let what = format!("{} is outside [0, 1)", measure.porosity);
        return Err(Invalid::new(key("porosity"), what, "give the part of the volume that is pores; 0 for none"));
    }
    if !(0.0..=1.0).contains(&measure.bound) {
        let what = format!("{} is outside [0, 1]", measure.bound);
        return Err(Invalid::new(key("bound"), what, "1 is the upper bound, 0 the lower one"));
    }
    if !(measure.pore_stiffness > 0.0 && measure.pore_stiffness < 1.0) {
        let what = format!("{} is outside (0, 1)", measure.pore_stiffness);
        return Err(Invalid::new(key("pore_stiffness"), what, "1e-4 is so soft that less changes nothing"));
    }
    if let ContactTime::Fixed(time) = measure.contact_time {
        positive(&key("contact_time"), time, "s")?;
        if measure.grain_young_modulus.is_some() {
            let what = format!("contacts last {time} s, however stiff the grains are");
            return Err(Invalid::new(
                key("grain_young_modulus"),
                what,
                "take it out, or set `contact_time = \"hertz\"`",
            ));
        }
    }
    check_grain_stiffness(key, measure)
}

fn check_grain_stiffness(key: &impl Fn(&str) -> String, measure: &SubsurfaceMeasure) -> Checked {
    if let Some(young) = measure.grain_young_modulus {
        positive(&key("grain_young_modulus"), young, "Pa")?;
    }
    let Some(nu) = measure.grain_poisson_ratio else { return Ok(()) };
    if measure.grain_young_modulus.is_none() {
        let what = format!("{nu} has no effect: the grains are rigid");
        return Err(Invalid::new(key("grain_poisson_ratio"), what, "take it out, or give `grain_young_modulus`"));
    }
    if !(nu > -1.0 && nu <= 0.5) {
        let what = format!("{nu} is outside (-1, 0.5], where an elastic solid is stable");
        return Err(Invalid::new(key("grain_poisson_ratio"), what, "0.3 is that of steel"));
    }
    Ok(())
}
