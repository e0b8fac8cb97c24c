//! Energy to the surface in time: `kind = "surface-energy"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::default_batches;

/// `kind = "surface-energy"`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SurfaceEnergyMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches: the steps of the history in time, whose scatter tells how sure the mean power is.
    #[serde(default = "default_batches")]
    pub batches: u32,
}
