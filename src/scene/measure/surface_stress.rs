//! Stress on the surface: `kind = "surface-stress"`.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CELLS_MAX, default_batches};
use crate::scene::limits::{Checked, in_plane, not_negative, positive};
use crate::scene::{Invalid, Scene, Surface, Vec3};

/// Sine of the angle between two directions below which rounding would say what is across the other.
const PARALLEL: f64 = 1e-9;

/// `kind = "surface-stress"`: average normal and shear stress on patches of the surface (Arbelaez et al. 2009, eq. 51).
///
/// In a planar scene stresses are forces per length, N/m.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SurfaceStressMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// A rectangle divided into equal patches; left out, each triangle of the meshes is a patch.
    pub patches: Option<PatchGrid>,
    /// Direction in which shear is positive, along the surface; left out, that of `patches.along`, or x on triangles.
    pub direction: Option<Vec3>,
    /// The jet that stresses are also shown relative to, as it is where no grain meets another; left out, none.
    pub jet: Option<FreeJet>,
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches that tell how sure the averages are.
    #[serde(default = "default_batches")]
    pub batches: u32,
}

/// A rectangle divided into equal patches; a hit counts on the patch that its contact point is over, along the normal.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct PatchGrid {
    /// Middle of the rectangle, m.
    pub centre: Vec3,
    /// Normal of the rectangle, towards the grains; any length but 0.
    #[serde(default = "upwards")]
    pub normal: Vec3,
    /// Direction of its first side; must not be parallel to the normal.
    #[serde(default = "sideways")]
    pub along: Vec3,
    /// Lengths of its sides along and across, m; in a planar scene the second is only drawn.
    pub size: [f64; 2],
    /// Patches along and across; in a planar scene there is one across.
    pub cells: [u32; 2],
    /// Hits further than this from the plane of the rectangle do not count, m; left out, all do.
    pub within: Option<f64>,
}

fn upwards() -> Vec3 {
    [0.0, 0.0, 1.0]
}

fn sideways() -> Vec3 {
    [1.0, 0.0, 0.0]
}

/// A jet whose grains do not meet each other, and so press with density (1 + e) speed² cos²(angle) on the surface that it hits (Arbelaez et al.
/// 2009, eq. 50), with e the restitution of `[contact.surface]`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct FreeJet {
    /// Mass of grains per volume of the jet, kg/m³; in a planar scene per area, kg/m².
    pub density: f64,
    /// Speed of its grains, m/s.
    pub speed: f64,
    /// Angle between its axis and the normal of the surface, degrees.
    #[serde(default)]
    pub angle: f64,
    /// Shear is shown relative to this friction times the pressure; left out, the dynamic friction of `[contact.surface]`. (Arbelaez et al. print
    /// the static one, eq. 54, but what they say of figure 8 holds for the dynamic one.)
    pub friction: Option<f64>,
}

/// Validates a measurement of surface stress; `key` makes the path of one of its keys.
pub(super) fn check(key: &impl Fn(&str) -> String, measure: &SurfaceStressMeasure, scene: &Scene) -> Checked {
    let planar = scene.domain.planar;
    match &measure.patches {
        Some(patches) => check_patches(&|name| key(&format!("patches.{name}")), patches, measure.batches, planar)?,
        None if scene.surface.iter().all(|surface| matches!(surface, Surface::Plane(_))) => {
            let what = "missing, and the scene has no mesh whose triangles could be patches instead";
            return Err(Invalid::new(key("patches"), what, "add a table with `centre`, `size` and `cells`"));
        }
        None => {}
    }
    if let Some(direction) = measure.direction {
        let key = key("direction");
        check_direction(&key, direction, planar)?;
        if let Some(patches) = &measure.patches {
            check_across(&key, direction, patches.normal)?;
        }
    }
    let Some(jet) = &measure.jet else { return Ok(()) };
    let key = |name: &str| key(&format!("jet.{name}"));
    positive(&key("density"), jet.density, if planar { "kg/m²" } else { "kg/m³" })?;
    positive(&key("speed"), jet.speed, "m/s")?;
    if !(0.0..90.0).contains(&jet.angle) {
        let what = format!("a jet at {} degrees from the normal does not press on the surface", jet.angle);
        return Err(Invalid::new(key("angle"), what, "give 0 or more and less than 90 degrees"));
    }
    jet.friction.map_or(Ok(()), |mu| not_negative(&key("friction"), mu, "friction is 0 (smooth) or more"))
}

fn check_patches(key: &impl Fn(&str) -> String, patches: &PatchGrid, batches: u32, planar: bool) -> Checked {
    let PatchGrid { normal, along, size, cells, within, centre } = patches;
    check_direction(&key("normal"), *normal, planar)?;
    check_direction(&key("along"), *along, planar)?;
    check_across(&key("along"), *along, *normal)?;
    for (side, name) in [(0, "along"), (1, "across")] {
        positive(&key(&format!("size[{side}]")), size[side], "m")?;
        if cells[side] == 0 {
            return Err(Invalid::new(key("cells"), format!("there are no patches {name}"), "use 1 or more"));
        }
    }
    if planar {
        in_plane(&key("centre"), *centre)?;
        if cells[1] != 1 {
            let what = format!("{} patches across lie beside the plane y = 0, where all grains are", cells[1]);
            return Err(Invalid::new(key("cells"), what, "in a planar scene use 1 patch across: [n, 1]"));
        }
    }
    if let Some(within) = *within {
        positive(&key("within"), within, "m")?;
    }
    let count = cells.iter().map(|&count| u64::from(count)).fold(u64::from(batches), u64::saturating_mul);
    if count > CELLS_MAX {
        let what = format!("{count} patches, counted for each batch, are more than fit into memory");
        return Err(Invalid::new(key("cells"), what, format!("use at most {CELLS_MAX}")));
    }
    Ok(())
}

fn check_direction(key: &str, direction: Vec3, planar: bool) -> Checked {
    if Vector3::from(direction).norm() == 0.0 {
        return Err(Invalid::new(key, "a direction of length 0", "give any other length"));
    }
    if planar { in_plane(key, direction) } else { Ok(()) }
}

fn check_across(key: &str, direction: Vec3, normal: Vec3) -> Checked {
    let [direction, normal] = [direction, normal].map(|vector| Vector3::from(vector).normalize());
    if direction.cross(&normal).norm() >= PARALLEL {
        return Ok(());
    }
    Err(Invalid::new(key, "is parallel to the normal of the patches", "give a direction along the surface"))
}
