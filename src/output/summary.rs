//! What a run came to: `summary.json`, and the same for reading on a terminal.

use std::fmt;
use std::io::{self, Write};

use serde::Serialize;

use super::Outcome;
use crate::observe::{Ledger, SurfaceEnergy};
use crate::scene::{Interference, Scene, Scheme};
use crate::scheme::SubSteps;
use crate::scheme::stepped::Steps;

/// Hit orders listed in the summary; `surface_hits.csv` has them all.
const LISTED_ORDERS: usize = 20;

/// Energies below this part of their scale are rounding, and not shown on the terminal.
const ROUNDING: f64 = 1e-14;

/// From so many collisions on the time for each of them is worth a word.
const MANY_COLLISIONS: u64 = 10_000;

/// The numbers of a run, in SI units.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Title of the scene.
    pub title: String,
    /// Version of Impinge.
    pub version: &'static str,
    /// Seed of every random draw.
    pub seed: u64,
    /// How time was advanced.
    pub scheme: Scheme,
    /// Which collisions took part.
    pub interference: Interference,
    /// Whether the run was stopped before its end.
    pub interrupted: bool,
    /// Simulated time.
    pub time: Time,
    /// How many grains.
    pub grains: Grains,
    /// How many collisions.
    pub collisions: Collisions,
    /// Where the energy went.
    pub energy: Energy,
    /// What reached the surface.
    pub surface: Surface,
    /// Where the momentum went.
    pub momentum: Momentum,
    /// Residual of momentum over Σ m |v| brought in.
    pub momentum_residual: f64,
    /// Where the mass went.
    pub mass: Mass,
    /// How the sub-steps went; absent where no force acts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sub_steps: Option<SubStepping>,
    /// How the steps of a time-stepped scheme went; absent where time goes from event to event.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<Stepping>,
    /// Deepest overlap at any event, over the smaller radius.
    pub max_overlap_over_radius: f64,
    /// Time of the processor, s.
    pub cpu_seconds: f64,
    /// Time on the clock, s.
    pub wall_seconds: f64,
}

/// Simulated time, s.
#[derive(Clone, Debug, Serialize)]
pub struct Time {
    /// Where the run started.
    pub start: f64,
    /// Where it was to end.
    pub until: f64,
    /// Where it ended.
    pub reached: f64,
}

/// How many grains; `entered` = `left` + `removed` + `inside`.
#[derive(Clone, Debug, Serialize)]
pub struct Grains {
    /// There at the start.
    pub initial: u64,
    /// Brought in by sources, those at the start included.
    pub entered: u64,
    /// Left the domain.
    pub left: u64,
    /// Removed on their first collision.
    pub removed: u64,
    /// Inside at the end.
    pub inside: u64,
    /// Entries that had to wait because the place was taken.
    pub entries_deferred: u64,
}

/// How many collisions.
#[derive(Clone, Debug, Serialize)]
pub struct Collisions {
    /// Between two grains.
    pub grain_grain: u64,
    /// With the surface.
    pub grain_surface: u64,
    /// With the surface, by grains that had not hit it before.
    pub first_hits: u64,
}

/// Where the kinetic energy went, J:
/// initial + entered + work_surface = left + removed + final + dissipated_grain + dissipated_surface + residual.
///
/// Where forces act, work_gravity, rest_added and what the near field gave stand on the left too: potential_initial - potential_final, or
/// work_near_field where grains entered or left during the run or no potential energy was summed.
#[derive(Clone, Debug, Serialize)]
pub struct Energy {
    /// Of the grains at the start.
    pub initial: f64,
    /// Of the grains that entered after that.
    pub entered: f64,
    /// Of the grains that left.
    pub left: f64,
    /// Of the grains that were removed.
    pub removed: f64,
    /// Of the grains inside at the end.
    #[serde(rename = "final")]
    pub final_: f64,
    /// Dissipated between grains.
    pub dissipated_grain: f64,
    /// Dissipated at the surface.
    pub dissipated_surface: f64,
    /// Not dissipated, although the laws would have it, where grains collapse; still in the grains.
    pub withheld: f64,
    /// Work of moving surfaces on grains.
    pub work_surface: f64,
    /// What forces and resting contacts did; absent where no force acts.
    #[serde(flatten)]
    pub forces: Option<ForceEnergy>,
    /// What energies are measured by: brought in, or given by forces where that is more.
    #[serde(skip)]
    pub scale: f64,
    /// What is not accounted for.
    pub residual: f64,
    /// The residual over the energy brought in, or over the largest energy that grains had or got from a force, if that is more.
    pub residual_relative: f64,
}

/// What forces and resting contacts did, J.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ForceEnergy {
    /// Potential energy of the near field at the start; absent where it was not summed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub potential_initial: Option<f64>,
    /// Potential energy of the near field at the end; absent where it was not summed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub potential_final: Option<f64>,
    /// Kinetic energy that the near field gave to grains.
    pub work_near_field: f64,
    /// Work of gravity on grains.
    pub work_gravity: f64,
    /// Added by the treatment of resting contacts.
    pub rest_added: f64,
}

/// Energy (J) and impulse (N s) to the surface.
#[derive(Clone, Debug, Serialize)]
pub struct Surface {
    /// Energy of the first hit of each grain.
    pub energy_first_hits: f64,
    /// Energy of later hits.
    pub energy_repeated_hits: f64,
    /// Energy of all hits.
    pub energy_all_hits: f64,
    /// Sum of normal impulses.
    pub impulse_normal: f64,
    /// Sum of the magnitudes of tangential impulses.
    pub impulse_tangential: f64,
    /// Sum of tangential impulses on the grains.
    pub impulse_tangential_vector: [f64; 3],
    /// Energy by hit order, up to the twentieth.
    pub by_order: Vec<Order>,
}

/// Hits of one order, energies in J.
#[derive(Clone, Debug, Serialize)]
pub struct Order {
    /// Hit order, from 1.
    pub order: usize,
    /// How many.
    pub hits: u64,
    /// Energy brought.
    pub energy: f64,
    /// Its part along the normal.
    pub normal: f64,
    /// Its part along the surface.
    pub tangential: f64,
    /// Its part in rotation.
    pub spin: f64,
}

/// Where the momentum went, kg m/s; entered − left and so on as for energy.
#[derive(Clone, Debug, Serialize)]
pub struct Momentum {
    /// Of the grains at the start.
    pub initial: [f64; 3],
    /// Of the grains that entered after that.
    pub entered: [f64; 3],
    /// Of the grains that left.
    pub left: [f64; 3],
    /// Of the grains that were removed.
    pub removed: [f64; 3],
    /// Of the grains inside at the end.
    #[serde(rename = "final")]
    pub final_: [f64; 3],
    /// Given to grains by the surface.
    pub surface: [f64; 3],
    /// Given to grains by gravity; absent where no force acts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gravity: Option<[f64; 3]>,
}

/// How the sub-steps of a run with forces went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubStepping {
    /// How many there were.
    pub count: u64,
    /// Length of the last one, s.
    pub length: f64,
    /// Contacts at rest at the end.
    pub resting_contacts: u32,
    /// Largest error of the near field at the grains that were looked at, over the sum of the magnitudes of what contributes to the force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_error_of_contributions: Option<f64>,
    /// The same over the force itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_error_of_force: Option<f64>,
}

impl SubStepping {
    fn new(sub_steps: &SubSteps) -> Self {
        Self {
            count: sub_steps.count,
            length: sub_steps.length,
            resting_contacts: sub_steps.resting_contacts,
            force_error_of_contributions: sub_steps.near_field_error.map(|error| error.of_contributions),
            force_error_of_force: sub_steps.near_field_error.map(|error| error.of_force),
        }
    }

    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(error) = self.force_error_of_force {
            writeln!(f, "  {:<26}{:>12} of the force", "near field", format!("{error:.1e}"))?;
        }
        let (count, length) = (grouped(self.count), quantity(self.length, "s"));
        writeln!(
            f,
            "\n{count} sub-steps, the last of {length}; contacts at rest at the end: {}",
            grouped(self.resting_contacts.into())
        )
    }
}

/// How the steps of a time-stepped scheme went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stepping {
    /// How many there were.
    pub count: u64,
    /// Length of the shortest, s.
    pub shortest: f64,
    /// Length of the longest, s.
    pub longest: f64,
}

/// Where the mass went, kg.
#[derive(Clone, Debug, Serialize)]
pub struct Mass {
    /// Of the grains at the start.
    pub initial: f64,
    /// Of the grains that entered after that.
    pub entered: f64,
    /// Of the grains that left.
    pub left: f64,
    /// Of the grains that were removed.
    pub removed: f64,
    /// Of the grains inside at the end.
    #[serde(rename = "final")]
    pub final_: f64,
    /// What is not accounted for.
    pub residual: f64,
}

impl Summary {
    /// Gathers what the observers of a run have measured up to `reached` (s).
    #[must_use]
    pub fn new(scene: &Scene, ledger: &Ledger, surface: &SurfaceEnergy, reached: f64, outcome: &Outcome) -> Self {
        let [initial, entered, left, removed, inside] =
            [ledger.initial(), ledger.entered(), ledger.left(), ledger.removed(), ledger.inside()];
        let counts = ledger.counts();
        Self {
            title: scene.title.clone(),
            version: env!("CARGO_PKG_VERSION"),
            seed: scene.seed,
            scheme: scene.run.scheme,
            interference: scene.run.interference,
            interrupted: outcome.interrupted,
            time: Time { start: scene.run.start, until: scene.run.until, reached },
            grains: Grains {
                initial: initial.count(),
                entered: initial.count() + entered.count(),
                left: left.count(),
                removed: removed.count(),
                inside: inside.count(),
                entries_deferred: outcome.entries_deferred,
            },
            collisions: Collisions {
                grain_grain: counts.grain_grain,
                grain_surface: counts.grain_surface,
                first_hits: counts.first_hits,
            },
            energy: Energy {
                initial: initial.energy(),
                entered: entered.energy(),
                left: left.energy(),
                removed: removed.energy(),
                final_: inside.energy(),
                dissipated_grain: ledger.dissipated_grain(),
                dissipated_surface: ledger.dissipated_surface(),
                withheld: ledger.withheld(),
                work_surface: ledger.work_surface(),
                forces: ledger.forces().map(|forces| ForceEnergy {
                    potential_initial: forces.potential_initial(),
                    potential_final: forces.potential_final(),
                    work_near_field: forces.work_near_field(),
                    work_gravity: forces.work_gravity(),
                    rest_added: forces.rest_added(),
                }),
                scale: ledger.energy_scale(),
                residual: ledger.energy_residual(),
                residual_relative: ledger.relative_energy_residual(),
            },
            surface: Surface::new(surface),
            momentum: Momentum {
                initial: initial.momentum().into(),
                entered: entered.momentum().into(),
                left: left.momentum().into(),
                removed: removed.momentum().into(),
                final_: inside.momentum().into(),
                surface: ledger.surface_impulse().into(),
                gravity: ledger.forces().map(|forces| forces.impulse_gravity().into()),
            },
            momentum_residual: ledger.relative_momentum_residual(),
            mass: Mass {
                initial: initial.mass(),
                entered: entered.mass(),
                left: left.mass(),
                removed: removed.mass(),
                final_: inside.mass(),
                residual: ledger.mass_residual(),
            },
            sub_steps: outcome.sub_steps.as_ref().map(SubStepping::new),
            steps: outcome.steps.map(|Steps { count, shortest, longest }| Stepping { count, shortest, longest }),
            max_overlap_over_radius: ledger.max_overlap_over_radius(),
            cpu_seconds: outcome.cpu_seconds,
            wall_seconds: outcome.wall_seconds,
        }
    }

    /// Writes `summary.json`.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_json(&self, out: &mut dyn Write) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut *out, self)?;
        writeln!(out)
    }
}

impl Surface {
    fn new(surface: &SurfaceEnergy) -> Self {
        let by_order = surface.by_order().iter().take(LISTED_ORDERS).enumerate().map(|(index, tally)| Order {
            order: index + 1,
            hits: tally.hits,
            energy: tally.energy(),
            normal: tally.normal.value(),
            tangential: tally.tangential.value(),
            spin: tally.spin.value(),
        });
        Self {
            energy_first_hits: surface.first_hits(),
            energy_repeated_hits: surface.repeated_hits(),
            energy_all_hits: surface.all_hits(),
            impulse_normal: surface.impulse_normal(),
            impulse_tangential: surface.impulse_tangential(),
            impulse_tangential_vector: surface.impulse_tangential_vector().into(),
            by_order: by_order.collect(),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.heading(f)?;
        self.counts(f)?;
        self.energies(f)?;
        self.hits(f)?;
        self.quality(f)
    }
}

/// The parts of the text for the terminal, each ending with its last line.
impl Summary {
    fn heading(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let title = if self.title.is_empty() { "Untitled scene" } else { &self.title };
        writeln!(f, "{title}")?;
        let [start, reached, until] =
            [self.time.start, self.time.reached, self.time.until].map(|time| brief(time, "s"));
        let ended = if self.interrupted { format!("stopped at {reached} of {until}") } else { format!("to {reached}") };
        writeln!(f, "from {start} {ended}, seed {}, Impinge {}\n", self.seed, self.version)
    }

    fn counts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Grains { initial, entered, left, removed, inside, entries_deferred } = self.grains;
        let mut lines = vec![("grains at the start", initial)];
        lines.extend(
            [("entered later", entered - initial), ("entries deferred", entries_deferred)]
                .iter()
                .filter(|line| line.1 > 0),
        );
        lines.extend([("left the domain", left), ("removed", removed)].iter().filter(|line| line.1 > 0));
        lines.push(("inside at the end", inside));
        lines.push(("grain–grain collisions", self.collisions.grain_grain));
        lines.push(("grain–surface collisions", self.collisions.grain_surface));
        lines.push(("of them first hits", self.collisions.first_hits));
        for (name, count) in lines {
            writeln!(f, "  {name:<26}{:>12}", grouped(count))?;
        }
        writeln!(f)
    }

    fn energies(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let energy = &self.energy;
        let forces = energy.forces.as_ref();
        let lines = [
            ("brought in, E0", self.brought_in()),
            ("work of moving surfaces", energy.work_surface),
            ("work of gravity", forces.map_or(0.0, |forces| forces.work_gravity)),
            ("work of the near field", forces.map_or(0.0, |forces| forces.work_near_field)),
            ("added to resting contacts", forces.map_or(0.0, |forces| forces.rest_added)),
            ("dissipated between grains", energy.dissipated_grain),
            ("dissipated at the surface", energy.dissipated_surface),
            ("carried out of the domain", energy.left),
            ("of removed grains", energy.removed),
            ("inside at the end", energy.final_),
            ("withheld in collapses", energy.withheld),
            ("potential at the start", forces.and_then(|forces| forces.potential_initial).unwrap_or(0.0)),
            ("potential at the end", forces.and_then(|forces| forces.potential_final).unwrap_or(0.0)),
        ];
        writeln!(f, "energy")?;
        // What is rounding beside the rest is none.
        let least = ROUNDING * energy.scale;
        lines
            .into_iter()
            .filter(|line| line.1.abs() > least)
            .try_for_each(|line| self.energy_line(f, line.0, line.1, ""))?;
        writeln!(f)
    }

    fn hits(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let surface = &self.surface;
        if surface.by_order.is_empty() {
            return Ok(());
        }
        writeln!(f, "energy to the surface")?;
        let count = |hits: u64| format!("{:>10} hit{}", grouped(hits), if hits == 1 { "" } else { "s" });
        let [all, first] = [self.collisions.grain_surface, self.collisions.first_hits];
        self.energy_line(f, "first hits", surface.energy_first_hits, &count(first))?;
        self.energy_line(f, "repeated hits", surface.energy_repeated_hits, &count(all - first))?;
        self.energy_line(f, "all hits", surface.energy_all_hits, &count(all))?;
        writeln!(f, "  {:<26}{:>12}", "normal impulse", quantity(surface.impulse_normal, "N s"))?;
        if surface.impulse_tangential > 0.0 {
            writeln!(f, "  {:<26}{:>12}", "tangential impulse", quantity(surface.impulse_tangential, "N s"))?;
        }
        writeln!(f)
    }

    fn quality(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let small = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{:.1e}", value.abs()) };
        writeln!(f, "not accounted for")?;
        let scale = if self.energy.forces.is_some() { "the largest energy" } else { "E0" };
        writeln!(f, "  {:<26}{:>12} of {scale}", "energy", small(self.energy.residual_relative))?;
        writeln!(f, "  {:<26}{:>12} of the sum of m |v|", "momentum", small(self.momentum_residual))?;
        writeln!(f, "  {:<26}{:>12} of the radius", "deepest overlap", small(self.max_overlap_over_radius))?;
        if let Some(sub_steps) = &self.sub_steps {
            sub_steps.fmt(f)?;
        }
        if let Some(Stepping { count, shortest, longest }) = self.steps {
            let [shortest, longest] = [shortest, longest].map(|length| quantity(length, "s"));
            writeln!(f, "\n{} steps of {shortest} to {longest}", grouped(count))?;
        }
        let [cpu, wall] = [self.cpu_seconds, self.wall_seconds].map(|seconds| quantity(seconds, "s"));
        write!(f, "\n{cpu} of processor time in {wall}")?;
        let collisions = self.collisions.grain_grain + self.collisions.grain_surface;
        // With few collisions the time goes into reading and writing.
        if collisions < MANY_COLLISIONS {
            return Ok(());
        }
        write!(f, ", {} a collision", quantity(self.cpu_seconds / collisions as f64, "s"))
    }

    /// Energy that came in with grains, J.
    fn brought_in(&self) -> f64 {
        self.energy.initial + self.energy.entered
    }

    fn energy_line(&self, f: &mut fmt::Formatter<'_>, name: &str, energy: f64, note: &str) -> fmt::Result {
        let total = self.brought_in();
        // Parts of what was brought in say nothing where forces gave more.
        let part = if total > 0.0 && total == self.energy.scale {
            format!("{:>8.2} %", 100.0 * energy / total)
        } else {
            String::new()
        };
        writeln!(f, "  {name:<26}{:>12}{part}{note}", quantity(energy, "J"))
    }
}

/// A number with its unit and prefix, in four digits: `911.4 kJ`.
pub(super) fn quantity(value: f64, unit: &str) -> String {
    let prefix = Prefix::of(value);
    let scaled = value / prefix.factor;
    // Rounding to four digits must not show 1000 where the next prefix would show 1.
    let digits = if scaled == 0.0 { 0 } else { (3 - scaled.abs().log10().floor() as i32).clamp(0, 3) as usize };
    format!("{scaled:.digits$} {}{unit}", prefix.symbol)
}

/// The same without zeros at the end: `60 ms`.
pub(super) fn brief(value: f64, unit: &str) -> String {
    let text = quantity(value, unit);
    match text.split_once(' ') {
        Some((number, unit)) if number.contains('.') => {
            format!("{} {unit}", number.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    }
}

/// A prefix of SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prefix {
    /// What it stands for.
    pub(super) factor: f64,
    /// How it is written.
    pub(super) symbol: &'static str,
}

impl Prefix {
    /// The one that leaves one to three digits before the point.
    pub(super) fn of(value: f64) -> Self {
        const SYMBOLS: [&str; 11] = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P"];
        // Four digits round up to 1000 from here.
        let power = (value.abs() * 1.00005).log10() / 3.0;
        let index =
            if value == 0.0 || !value.is_finite() { 5 } else { (power.floor() + 5.0).clamp(0.0, 10.0) as usize };
        Self { factor: 1000.0_f64.powi(index as i32 - 5), symbol: SYMBOLS[index] }
    }
}

/// A count with its digits in groups of three.
pub(super) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|group| std::str::from_utf8(group).unwrap_or("")).collect();
    groups.join(" ")
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::grains::Snapshot;
    use crate::observe::fake_jet::FakeJet;
    use crate::scheme::{Kick, Observer as _, Rest};

    fn summary(grains: u64) -> Summary {
        let mut watched = (Ledger::default(), SurfaceEnergy::default());
        FakeJet { grains, inflow: 50, ..FakeJet::default() }.run(&mut watched);
        let outcome = Outcome { cpu_seconds: 1.25, wall_seconds: 1.5, ..Outcome::default() };
        Summary::new(&crate::output::recorder::tests::scene(), &watched.0, &watched.1, 0.06, &outcome)
    }

    #[test]
    fn the_binding_names_are_there_and_add_up() {
        let mut json = Vec::new();
        summary(500).write_json(&mut json).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        let number =
            |path: &str| json.pointer(path).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{path}"));
        for path in
            ["/surface/impulse_tangential", "/momentum_residual", "/max_overlap_over_radius", "/cpu_seconds", "/seed"]
        {
            assert!(number(path).is_finite());
        }
        assert!(json["version"].is_string());
        assert_eq!(json["scheme"], "event-driven");
        assert_eq!(number("/grains/entered"), 550.0);
        assert_eq!(number("/grains/entered"), number("/grains/left") + number("/grains/inside"));
        let [grain_grain, grain_surface, first] =
            ["grain_grain", "grain_surface", "first_hits"].map(|name| number(&format!("/collisions/{name}")));
        assert!(grain_grain > 0.0 && grain_surface > first && first > 0.0);
        let energy = |name: &str| number(&format!("/energy/{name}"));
        let lost = energy("dissipated_grain") + energy("dissipated_surface") + energy("left") + energy("final");
        let total = energy("initial") + energy("entered");
        assert!((total - lost - energy("residual")).abs() < 1e-14 * total);
        let orders: f64 =
            json["surface"]["by_order"].as_array().unwrap().iter().map(|order| order["energy"].as_f64().unwrap()).sum();
        approx::assert_relative_eq!(orders, number("/surface/energy_all_hits"), max_relative = 1e-14);
        assert!(number("/surface/energy_first_hits") < orders && number("/surface/impulse_normal") > 0.0);
    }

    #[test]
    fn forces_have_keys_only_where_they_act() {
        let json = |ledger: &Ledger| {
            let scene = crate::output::recorder::tests::scene();
            let summary = Summary::new(&scene, ledger, &SurfaceEnergy::default(), 0.0, &Outcome::default());
            (serde_json::to_value(&summary).unwrap(), summary.to_string())
        };
        let mut ledger = Ledger::default();
        ledger.sample(&Snapshot { time: 0.0, flights: &[], grains: &[] });
        const KEYS: [&str; 5] =
            ["potential_initial", "potential_final", "work_near_field", "work_gravity", "rest_added"];
        let (free, text) = json(&ledger);
        assert!(KEYS.iter().all(|key| free["energy"].get(key).is_none()) && free["momentum"].get("gravity").is_none());
        assert!(!text.contains("potential") && !text.contains("gravity"), "{text}");

        ledger.kick(&Kick { work_gravity: 2.0, impulse_gravity: Vector3::new(0.0, 0.0, -3.0), ..Kick::default() });
        let (falling, _) = json(&ledger);
        let energy = |key: &str| falling["energy"].get(key).and_then(serde_json::Value::as_f64);
        assert_eq!(KEYS.map(energy), [None, None, Some(0.0), Some(2.0), Some(0.0)]);
        assert_eq!(falling["momentum"]["gravity"], serde_json::json!([0.0, 0.0, -3.0]));

        ledger.kick(&Kick { potential_energy: Some(-1.5), ..Kick::default() });
        ledger.kick(&Kick { potential_energy: Some(-2.5), work_near_field: 1.0, ..Kick::default() });
        ledger.rest(&Rest { added: 0.25, ..Rest::default() });
        let (attracted, text) = json(&ledger);
        let energy = |key: &str| attracted["energy"].get(key).and_then(serde_json::Value::as_f64);
        assert_eq!(KEYS.map(energy), [Some(-1.5), Some(-2.5), Some(1.0), Some(2.0), Some(0.25)]);
        for line in ["work of gravity", "work of the near field", "added to resting", "potential at the start"] {
            assert!(text.contains(line), "{text}");
        }
    }

    #[test]
    fn the_text_fits_a_terminal() {
        let text = summary(2000).to_string();
        assert!(text.lines().count() <= 35 && text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert!(text.contains("E0") && text.contains("100.00 %"), "{text}");
    }

    #[test]
    fn a_run_of_nothing_has_a_summary_too() {
        let scene = crate::output::recorder::tests::scene();
        let summary = Summary::new(&scene, &Ledger::default(), &SurfaceEnergy::default(), 0.0, &Outcome::default());
        assert!(!summary.to_string().contains("NaN"), "{summary}");
    }

    #[test]
    fn quantities_have_four_digits_and_a_prefix() {
        let shown = [911_392.3, 0.06, 999.96, 0.0, -1.5e-5, 1.0, 25.0, 1e20].map(|value| quantity(value, "J"));
        assert_eq!(shown, ["911.4 kJ", "60.00 mJ", "1.000 kJ", "0 J", "-15.00 µJ", "1.000 J", "25.00 J", "100000 PJ"]);
        assert_eq!([0.06, 0.0, 10.0, 1.5].map(|value| brief(value, "s")), ["60 ms", "0 s", "10 s", "1.5 s"]);
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }
}
