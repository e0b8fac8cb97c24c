//! What belongs to the scene format but to no model of this version yet: refused by name, not as a misspelling.

use toml::{Table, Value};

use super::Invalid;

/// Schemes of the papers that are not there yet.
const SCHEMES: [&str; 3] = ["fixed-point", "trapezoidal", "soft-sphere"];

/// Refuses what this version cannot do.
pub(super) fn refuse(scene: &Table) -> Result<(), Invalid> {
    match scene.get("run").and_then(|run| run.get("scheme")) {
        Some(Value::String(scheme)) if SCHEMES.contains(&scheme.as_str()) => Err(Invalid::new(
            "run.scheme",
            format!("the scheme \"{scheme}\" is not in this version"),
            "use `scheme = \"event-driven\"`, or leave it out",
        )),
        _ => Ok(()),
    }
}
