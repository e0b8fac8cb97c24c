//! What leaves through the sides of the domain: `kind = "outflow"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CELLS_MAX, default_batches};
use crate::scene::limits::{Checked, positive};
use crate::scene::{Boundary, Invalid, Scene};

/// `kind = "outflow"`: mass, momentum and energy that leave through sides of an open domain, over height, with the moments of each profile
/// (Arbelaez et al. 2009, eq. 55 to 61).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct OutflowMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// Sides of the domain through which grains leave; left out, all four (in a planar scene both) that stand upright.
    pub sides: Option<Vec<Side>>,
    /// The z from which heights count, m.
    #[serde(default)]
    pub base: f64,
    /// Heights are told in this length, as the width of the jet, m.
    #[serde(default = "metre")]
    pub length: f64,
    /// The profile ends at this height over `base`, m; left out, at the top of the domain.
    pub top: Option<f64>,
    /// Cells of the profile from `base` to `top`.
    #[serde(default = "default_cells")]
    pub cells: u32,
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches that tell how sure the averages are.
    #[serde(default = "default_batches")]
    pub batches: u32,
}

fn metre() -> f64 {
    1.0
}

fn default_cells() -> u32 {
    40
}

/// A side of the domain that stands upright.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// That of the smallest x.
    XMin,
    /// That of the largest x.
    XMax,
    /// That of the smallest y.
    YMin,
    /// That of the largest y.
    YMax,
}

impl OutflowMeasure {
    /// Height of the upper end of the profile, m.
    pub(crate) fn top(&self, scene: &Scene) -> f64 {
        self.top.unwrap_or(scene.domain.max[2] - self.base)
    }
}

/// Validates a measurement of outflow; `key` makes the path of one of its keys.
pub(super) fn check(key: &impl Fn(&str) -> String, measure: &OutflowMeasure, scene: &Scene) -> Checked {
    let planar = scene.domain.planar;
    if scene.domain.boundary == Boundary::Periodic {
        let what = "nothing leaves a periodic domain";
        return Err(Invalid::new(key("kind"), what, "take it out, or set `domain.boundary = \"open\"`"));
    }
    for (number, side) in measure.sides.iter().flatten().enumerate() {
        if planar && matches!(side, Side::YMin | Side::YMax) {
            let what = "no grain of a planar scene leaves along y";
            return Err(Invalid::new(key(&format!("sides[{number}]")), what, "use \"x-min\" or \"x-max\""));
        }
    }
    if measure.sides.as_ref().is_some_and(Vec::is_empty) {
        return Err(Invalid::new(key("sides"), "there are none", "name one or more, or leave the key out"));
    }
    positive(&key("length"), measure.length, "m")?;
    let top = measure.top(scene);
    if top <= 0.0 {
        let what = format!("the profile ends {top} m over its beginning");
        return Err(Invalid::new(key("top"), what, "give a height above 0; heights count from `base`"));
    }
    if measure.cells == 0 {
        return Err(Invalid::new(key("cells"), "there are no cells", "use 1 or more"));
    }
    let count = u64::from(measure.cells).saturating_mul(u64::from(measure.batches));
    if count > CELLS_MAX {
        let what = format!("{count} cells, counted for each batch, are more than fit into memory");
        return Err(Invalid::new(key("cells"), what, format!("use at most {CELLS_MAX}")));
    }
    Ok(())
}
