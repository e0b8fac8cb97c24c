//! Do the forces of a scene make sense? Gravity, near field, sub-step, and the keys that mean nothing without forces.

use super::limits::{Checked, LARGEST, in_plane, not_negative, positive};
use super::{Boundary, Invalid, NearField, Radius, Scene, Source, Substep, Summation};

/// Most sub-steps of a run: at a microsecond each they take eleven days. More is a misplaced exponent.
const SUBSTEPS_MAX: f64 = 1e12;

/// Where the switch to no force may begin at the earliest, over the cut-off: a wider one would no longer leave the force as it is.
const SWITCH_MIN: f64 = 0.5;

/// Largest bound on the error of the tree; above it the sum is no longer an approximation of anything.
const ACCURACY_MAX: f64 = 0.1;

/// How deep grains may be allowed to go into each other, in radii: below, what contacts at rest yield (4e-6) is in the way, and above it, a run stops.
const PENETRATION: [f64; 2] = [1e-5, 1e-3];

/// Validates what has to do with forces.
pub(super) fn check(scene: &Scene) -> Checked {
    if scene.domain.planar {
        in_plane("run.gravity", scene.run.gravity)?;
    }
    if let Some(near_field) = &scene.near_field {
        strengths_and_exponents(scene, near_field)?;
        summation(scene, near_field)?;
    }
    substep(scene)?;
    penetration(scene)?;
    contact_time(scene)?;
    source_strengths(scene)
}

fn substep(scene: &Scene) -> Checked {
    let of_near_field = scene.near_field.as_ref().and_then(|near_field| near_field.substep);
    if let Some(substep) = scene.run.substep {
        if !scene.has_forces() {
            return Err(without_forces("run.substep", &format!("{substep} s")));
        }
        if of_near_field.is_some() {
            let what = format!("{substep} s, but `near_field.substep` gives a sub-step too");
            return Err(Invalid::new("run.substep", what, "take it out: `[near_field]` says how its force is stepped"));
        }
        length(scene, "run.substep", substep)?;
    }
    if let Some(Substep::Fixed(substep)) = of_near_field {
        length(scene, "near_field.substep", substep)?;
    }
    let Some(tolerance) = scene.near_field.as_ref().and_then(|near_field| near_field.tolerance) else { return Ok(()) };
    let key = "near_field.tolerance";
    if let Substep::Fixed(substep) = scene.substep() {
        let what = format!("{tolerance} has no effect: the sub-step is always {substep} s");
        return Err(Invalid::new(key, what, "take it out, or set `near_field.substep = \"auto\"`"));
    }
    positive(key, tolerance, "radii")?;
    match tolerance < 1.0 {
        true => Ok(()),
        false => Err(Invalid::new(
            key,
            format!("{tolerance} radii of error in one sub-step"),
            "give a number above 0 and below 1; 1e-6 is usual",
        )),
    }
}

fn penetration(scene: &Scene) -> Checked {
    let Some(penetration) = scene.run.penetration else { return Ok(()) };
    let key = "run.penetration";
    if !scene.has_forces() {
        return Err(without_forces(key, &format!("{penetration} radii")));
    }
    let [least, most] = PENETRATION;
    if (least..=most).contains(&penetration) {
        return Ok(());
    }
    let what = format!("{penetration} radii is outside [{least:e}, {most:e}]");
    Err(Invalid::new(key, what, "give a number in there; 1e-4 is usual, and a smaller one makes more sub-steps"))
}

/// Refuses a sub-step that is not above 0, or with which the run would never end.
fn length(scene: &Scene, key: &str, substep: f64) -> Checked {
    positive(key, substep, "s")?;
    let count = (scene.run.until - scene.run.start) / substep;
    if count <= SUBSTEPS_MAX {
        return Ok(());
    }
    let what = format!("a sub-step of {substep:e} s makes {count:.1e} of them");
    Err(Invalid::new(key, what, format!("give one that makes at most {SUBSTEPS_MAX:e}, or an earlier `run.until`")))
}

fn strengths_and_exponents(scene: &Scene, near_field: &NearField) -> Checked {
    let NearField { alpha1, beta1, alpha2, beta2, .. } = *near_field;
    for (name, value) in [("alpha1", alpha1), ("beta1", beta1), ("alpha2", alpha2), ("beta2", beta2)] {
        let remedy = "use 0 or more: `alpha1` attracts, `alpha2` repels, and both fall with the distance";
        not_negative(&format!("near_field.{name}"), value, remedy)?;
    }
    let contact = 2.0 * smallest_mean_radius(scene);
    for (name, alpha, beta) in [("alpha1", alpha1, beta1), ("alpha2", alpha2, beta2)] {
        let force = alpha * contact.powf(-beta);
        // An infinite power of no strength is no force.
        if alpha > 0.0 && (force > LARGEST || force.is_nan()) {
            let what = format!(
                "{alpha} makes a force of {force:e} N between two grains that touch, too large to compute with"
            );
            let remedy = format!("`{name}` is in N m^beta; give a smaller one, or a smaller exponent");
            return Err(Invalid::new(format!("near_field.{name}"), what, remedy));
        }
    }
    Ok(())
}

fn smallest_mean_radius(scene: &Scene) -> f64 {
    let mean = |radius: &Radius| match radius {
        Radius::Constant(radius) => *radius,
        Radius::Drawn(drawn) => drawn.mean,
    };
    let radii = scene.source.iter().filter_map(Source::radius).chain([&scene.grain.radius]);
    radii.map(mean).filter(|&radius| radius > 0.0).fold(f64::INFINITY, f64::min)
}

fn summation(scene: &Scene, near_field: &NearField) -> Checked {
    let invalid =
        |name: &str, what: String, remedy: &str| Err(Invalid::new(format!("near_field.{name}"), what, remedy));
    let periodic = scene.domain.boundary == Boundary::Periodic;
    let word = match near_field.sum {
        Summation::Auto => "auto",
        Summation::Direct => "direct",
        Summation::CutOff => "cut-off",
        Summation::Tree => "tree",
    };
    if periodic && near_field.sum != Summation::CutOff {
        let what = format!(
            "\"{word}\" in a periodic domain: every grain has images without end, and the sum of a long-range force over them does not converge"
        );
        return invalid("sum", what, "set `sum = \"cut-off\"` with a `cutoff`, or `domain.boundary = \"open\"`");
    }
    if !(near_field.accuracy > 0.0 && near_field.accuracy <= ACCURACY_MAX) {
        let what = format!("a relative error of {} is outside (0, {ACCURACY_MAX}]", near_field.accuracy);
        return invalid("accuracy", what, "give a number above 0 and at most 0.1; 1e-4 is usual");
    }
    let (cutoff, switch) = (near_field.cutoff, near_field.switch);
    if near_field.sum != Summation::CutOff {
        let stray = [("cutoff", cutoff), ("switch", switch)].into_iter().find_map(|(name, value)| Some((name, value?)));
        let Some((name, value)) = stray else { return Ok(()) };
        let what = format!("{value} m has no effect with `sum = \"{word}\"`, which takes every pair in");
        return invalid(name, what, "set `sum = \"cut-off\"`, or take it out");
    }
    let Some(cutoff) = cutoff else {
        return invalid("cutoff", "missing key `cutoff`".into(), "say from which distance on (m) there is no force");
    };
    positive("near_field.cutoff", cutoff, "m")?;
    let period = scene.domain.axes().map(|axis| scene.domain.side(axis)).fold(f64::INFINITY, f64::min);
    if periodic && cutoff > 0.5 * period {
        let what =
            format!("{cutoff} m is more than half the smallest period, {period} m: a grain would feel two images");
        return invalid("cutoff", what, "give half the smallest period at most, or enlarge the domain");
    }
    match switch {
        Some(switch) if !(SWITCH_MIN * cutoff..cutoff).contains(&switch) => {
            let from = SWITCH_MIN * cutoff;
            let what =
                format!("{switch} m is outside [{from}, {cutoff}), where a switch to no force at {cutoff} m can begin");
            let remedy = "begin it below `cutoff`, at half of it at the earliest; left out, it begins at 0.8 `cutoff`";
            invalid("switch", what, remedy)
        }
        _ => Ok(()),
    }
}

fn contact_time(scene: &Scene) -> Checked {
    let Some(time) = scene.contact.time else { return Ok(()) };
    if !scene.has_forces() {
        return Err(without_forces("contact.time", &format!("{time} s")));
    }
    positive("contact.time", time, "s")
}

fn without_forces(key: &str, value: &str) -> Invalid {
    let what = format!("{value} has no effect: no force acts in this scene");
    Invalid::new(key, what, "take it out, or add `run.gravity` or `[near_field]`")
}

fn source_strengths(scene: &Scene) -> Checked {
    if scene.near_field.is_some() {
        return Ok(());
    }
    let strengths = scene.source.iter().map(Source::strength).enumerate();
    match strengths.filter_map(|(i, strength)| Some((i, strength?))).next() {
        Some((i, strength)) => Err(Invalid::new(
            format!("source[{i}].strength"),
            format!("{strength} has no effect: the scene has no near field"),
            "take it out, or add `[near_field]`",
        )),
        None => Ok(()),
    }
}
