//! What `impinge check` says of forces.

use std::fmt::{self, Write};
use std::path::Path;

use impinge::grains::NewGrain;
use impinge::law::{NearField, Term};
use impinge::scene::{Scene, Scheme, Source, Substep, Summation};
use impinge::source;

use super::estimate::Crowd;
use super::{digits, plain_or_scientific};

/// Part of the kinetic energy of a grain from which on a potential at contact deserves a warning.
const STRONG: f64 = 1.0;

/// Grains of one source that are about to touch.
struct Pair {
    /// Mean radius, m.
    radius: f64,
    /// Factor in the force between the two.
    strength: f64,
    /// Mean kinetic energy of a grain, J.
    kinetic_energy: f64,
}

/// Describes the forces of a scene with `count` grains; says nothing where there are none.
pub(super) fn describe(out: &mut String, scene: &Scene, folder: &Path, count: f64) -> fmt::Result {
    if !scene.has_forces() {
        return Ok(());
    }
    let gravity = scene.run.gravity;
    if gravity != [0.0; 3] {
        writeln!(out, "gravity     {gravity:?} m/s²")?;
    }
    near_field(out, scene, folder, count)?;
    if scene.run.scheme == Scheme::EventDriven {
        sub_steps(out, scene)?;
    }
    match scene.contact.time {
        Some(time) => writeln!(out, "            contacts take {} s", plain_or_scientific(time)),
        None => Ok(()),
    }
}

fn sub_steps(out: &mut String, scene: &Scene) -> fmt::Result {
    let duration = scene.run.until - scene.run.start;
    match scene.substep() {
        Substep::Fixed(step) => {
            // To so many digits the rounding of a quotient makes no further sub-step.
            writeln!(out, "sub-step    {} s, {} of them", plain_or_scientific(step), digits(duration / step, 12).ceil())
        }
        Substep::Chosen(_) => {
            writeln!(
                out,
                "sub-step    chosen so that its error stays within {} radii",
                plain_or_scientific(scene.tolerance())
            )?;
            writeln!(out, "            their number is known after the run")
        }
    }
}

fn near_field(out: &mut String, scene: &Scene, folder: &Path, count: f64) -> fmt::Result {
    let Some(field) = &scene.near_field else { return Ok(()) };
    let [attraction, repulsion] = [(field.alpha1, field.beta1), (field.alpha2, field.beta2)];
    writeln!(out, "near field  attraction {}, repulsion {}", term(attraction), term(repulsion))?;
    let [attraction, repulsion] = [attraction, repulsion].map(|(alpha, beta)| Term { alpha, beta });
    let Ok(law) = NearField::new(attraction, repulsion) else { return Ok(()) };
    match law.equilibrium() {
        Some(distance) => writeln!(out, "            in balance at {} m between centres", digits(distance, 4))?,
        None => writeln!(out, "            in balance at no distance")?,
    }
    let summed = match (field.summation(count as u64), field.cutoff, field.switch_from()) {
        (Summation::CutOff, Some(cutoff), Some(switch)) => {
            format!("over pairs closer than {cutoff} m, fading from {} m on", digits(switch, 6))
        }
        (Summation::Tree, ..) => format!("by a tree, to a relative error of {}", plain_or_scientific(field.accuracy)),
        _ => "over all pairs".to_owned(),
    };
    writeln!(out, "            summed {summed}")?;
    for (number, source) in scene.source.iter().enumerate() {
        if let Some(pair) = Pair::of(source, scene, folder) {
            pair.describe(out, number, &law, scene)?;
        }
    }
    Ok(())
}

fn term((alpha, beta): (f64, f64)) -> String {
    match alpha {
        0.0 => "none".to_owned(),
        _ => format!("{} r^-{beta} N", plain_or_scientific(alpha)),
    }
}

impl Pair {
    fn of(source: &Source, scene: &Scene, folder: &Path) -> Option<Self> {
        if let Some(crowd) = Crowd::of(source, scene) {
            let strength = source.strength().unwrap_or(1.0).powi(2);
            return Some(Self { radius: crowd.mean_radius(), strength, kinetic_energy: crowd.kinetic_energy() });
        }
        // A table says itself what it has; the scene has been placed once already, so that this cannot fail.
        let alone = Scene { source: vec![source.clone()], ..scene.clone() };
        let grains = source::place(&alone, folder, &|_, _| None).ok()?.grains;
        let mean = |of: fn(&NewGrain) -> f64| grains.iter().map(of).sum::<f64>() / grains.len() as f64;
        Some(Self {
            radius: mean(|grain| grain.radius),
            strength: mean(|grain| grain.strength.abs()).powi(2),
            kinetic_energy: mean(|grain| 0.5 * grain.mass() * grain.velocity.norm_squared()),
        })
    }

    /// Sets the potential of two grains that touch against the kinetic energy of one of them, as the ratio of the two decides whether the near
    /// field shapes the jet or blows it up.
    ///
    /// The parameters of Arbelaez et al. (2009), section 7, alpha1 / alpha2 = 0.002 with beta = (2, 3), put the barrier
    /// alpha2 / ((beta2 - 1) d^(beta2 - 1)) at 600 times the energy of the jet; with the ratio turned over they spread it as described.
    fn describe(&self, out: &mut String, number: usize, law: &NearField, scene: &Scene) -> fmt::Result {
        let contact = 2.0 * self.radius;
        if let Some(cutoff) = scene.near_field.as_ref().and_then(|field| field.cutoff)
            && cutoff <= contact
        {
            return writeln!(
                out,
                "warning     source[{number}]: grains touch at {contact} m, and no force acts beyond {cutoff} m"
            );
        }
        let potential = self.strength * (law.potential(contact) - potential_apart(law, scene));
        write!(
            out,
            "            source[{number}]: potential at contact {} J",
            plain_or_scientific(digits(potential, 3))
        )?;
        if self.kinetic_energy == 0.0 {
            return writeln!(out, ", grains at rest");
        }
        let ratio = potential / self.kinetic_energy;
        writeln!(out, ", {} times the kinetic energy of a grain", plain_or_scientific(digits(ratio, 3)))?;
        if ratio > STRONG {
            writeln!(
                out,
                "warning     source[{number}]: grains near each other fly apart faster than the source sends them;"
            )?;
            writeln!(out, "            are alpha1 and alpha2 in N m^beta, and not exchanged?")?;
        } else if ratio < -STRONG {
            writeln!(
                out,
                "warning     source[{number}]: grains attract each other more than they move; they will form clusters"
            )?;
        }
        Ok(())
    }
}

/// Potential of two grains far apart, J: 0, or that across the domain where the potential has no end (beta up to 1).
fn potential_apart(law: &NearField, scene: &Scene) -> f64 {
    let ends = [law.attraction(), law.repulsion()].iter().all(|term| term.alpha == 0.0 || term.beta > 1.0);
    match ends {
        true => 0.0,
        false => law.potential(scene.domain.axes().map(|axis| scene.domain.side(axis)).fold(0.0, f64::max)),
    }
}
