//! The flow on a grid: `kind = "flow"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::default_batches;
use crate::scene::Vec3;

/// `kind = "flow"`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct FlowMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// Lower corner of the grid, m; left out, that of the domain.
    pub min: Option<Vec3>,
    /// Upper corner of the grid, m; left out, that of the domain.
    pub max: Option<Vec3>,
    /// Cells along x, y and z.
    pub cells: [u32; 3],
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches that tell how sure the averages are.
    #[serde(default = "default_batches")]
    pub batches: u32,
}
