//! Where mass goes that leaves: `kind = "ejecta"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::default_batches;
use crate::scene::limits::Checked;
use crate::scene::{Invalid, Vec3};

/// Most bins of a distribution over angles: finer ones hold no grains.
const BINS_MAX: u32 = 18_000;

/// `kind = "ejecta"`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct EjectaMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// Direction of the jet, from which angles count; any length but 0. Left out, straight down.
    #[serde(default = "down")]
    pub axis: Vec3,
    /// Bins of the distribution, from 0 to 180 degrees.
    #[serde(default = "default_bins")]
    pub bins: u32,
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches that tell how sure the angles are.
    #[serde(default = "default_batches")]
    pub batches: u32,
}

fn down() -> Vec3 {
    [0.0, 0.0, -1.0]
}

fn default_bins() -> u32 {
    90
}

pub(super) fn check(key: &impl Fn(&str) -> String, ejecta: &EjectaMeasure) -> Checked {
    let length = ejecta.axis.iter().map(|part| part * part).sum::<f64>();
    if !(length.is_finite() && length > 0.0) {
        let what = format!("{:?} has no direction", ejecta.axis);
        return Err(Invalid::new(key("axis"), what, "give the direction of the jet, such as [0, 0, -1]"));
    }
    if !(1..=BINS_MAX).contains(&ejecta.bins) {
        let what = format!("{} bins over 180 degrees are none, or too fine to hold grains", ejecta.bins);
        return Err(Invalid::new(key("bins"), what, "90 is usual: two degrees each"));
    }
    Ok(())
}
