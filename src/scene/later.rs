//! Keys that belong to the scene format but to no model of this version yet: refused by name, not as a misspelling.

use toml::{Table, Value};

use super::Invalid;

/// Schemes of the papers that are not there yet.
const SCHEMES: [&str; 3] = ["fixed-point", "trapezoidal", "soft-sphere"];

/// Refuses what this version cannot do, and takes out what asks for nothing (`gravity = [0, 0, 0]`).
pub(super) fn refuse(scene: &mut Table) -> Result<(), Invalid> {
    if scene.contains_key("near_field") {
        return Err(Invalid::new(
            "near_field",
            "forces between grains are not in this version",
            "take `[near_field]` out; grains then fly freely between collisions",
        ));
    }
    let Some(Value::Table(run)) = scene.get_mut("run") else { return Ok(()) };
    if let Some(gravity) = run.get("gravity") {
        if !is_zero(gravity) {
            return Err(Invalid::new(
                "run.gravity",
                format!("gravity = {gravity} is not in this version"),
                "take `gravity` out or set it to [0, 0, 0]; grains then fly freely between collisions",
            ));
        }
        run.remove("gravity");
    }
    match run.get("scheme") {
        Some(Value::String(scheme)) if SCHEMES.contains(&scheme.as_str()) => Err(Invalid::new(
            "run.scheme",
            format!("the scheme \"{scheme}\" is not in this version"),
            "use `scheme = \"event-driven\"`, or leave it out",
        )),
        _ => Ok(()),
    }
}

/// Whether this is the vector [0, 0, 0].
fn is_zero(vector: &Value) -> bool {
    let zero = |value: &Value| matches!(value, Value::Integer(0)) || value.as_float() == Some(0.0);
    vector.as_array().is_some_and(|parts| parts.len() == 3 && parts.iter().all(zero))
}
