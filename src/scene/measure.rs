//! What else is measured: `[[measure]]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits::Checked;
use super::subsurface::{self, SubsurfaceMeasure};
use super::{Invalid, Run, Scene, Vec3};

/// Most cells of a grid times batches: each holds a dozen numbers, so that these fill 2 GB. More is a misplaced digit.
const CELLS_MAX: u64 = 20_000_000;

/// `[[measure]]`: something to be measured; its results go into `measures/NAME`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Measure {
    /// Density, velocity and granular temperature on a grid, averaged over time.
    Flow(FlowMeasure),
    /// Energy that grains bring to the surface, over time and by hit order.
    SurfaceEnergy(SurfaceEnergyMeasure),
    /// Stress and damage that every hit on a plane makes in the solid below it.
    Subsurface(SubsurfaceMeasure),
}

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

pub(super) fn default_batches() -> u32 {
    10
}

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

/// When something is measured, and in how many batches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Number of batches.
    pub batches: u32,
}

impl Span {
    /// Start and end within a run, s.
    #[must_use]
    pub fn within(self, run: &Run) -> [f64; 2] {
        [self.from.unwrap_or(run.start), self.until.unwrap_or(run.until)]
    }
}

impl Measure {
    fn name(&self) -> Option<&str> {
        match self {
            Self::Flow(flow) => flow.name.as_deref(),
            Self::SurfaceEnergy(energy) => energy.name.as_deref(),
            Self::Subsurface(subsurface) => subsurface.name.as_deref(),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Flow(_) => "flow",
            Self::SurfaceEnergy(_) => "surface-energy",
            Self::Subsurface(_) => "subsurface",
        }
    }

    /// When it is measured.
    #[must_use]
    pub fn span(&self) -> Span {
        match *self {
            Self::Flow(FlowMeasure { from, until, batches, .. }) => Span { from, until, batches },
            Self::SurfaceEnergy(SurfaceEnergyMeasure { from, until, batches, .. }) => Span { from, until, batches },
            Self::Subsurface(SubsurfaceMeasure { from, until, batches, .. }) => Span { from, until, batches },
        }
    }
}

impl Scene {
    /// The names of its measurements: the folders of their results.
    #[must_use]
    pub fn measure_names(&self) -> Vec<String> {
        self.measure.iter().map(|measure| measure.name().unwrap_or(measure.kind()).to_owned()).collect()
    }
}

/// Validates all measurements.
pub(super) fn check(scene: &Scene) -> Checked {
    let names = scene.measure_names();
    for (i, (measure, name)) in scene.measure.iter().zip(&names).enumerate() {
        let key = |name: &str| format!("measure[{i}].{name}");
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c)) {
            let what = format!("{name:?} cannot be the name of a folder everywhere");
            return Err(Invalid::new(key("name"), what, "use letters, digits, `-` and `_`"));
        }
        if names[..i].contains(name) {
            let what = format!("two measurements are called {name:?}");
            return Err(Invalid::new(key("name"), what, "give one of them another `name`"));
        }
        check_span(&key, measure.span(), &scene.run)?;
        match measure {
            Measure::Flow(flow) => check_grid(&key, flow.min, flow.max, flow.cells, flow.batches, scene)?,
            Measure::SurfaceEnergy(_) => {}
            Measure::Subsurface(subsurface) => subsurface::check(&key, subsurface, scene)?,
        }
    }
    Ok(())
}

fn check_span(key: &impl Fn(&str) -> String, span: Span, run: &Run) -> Checked {
    let [from, until] = span.within(run);
    let inside = |time: f64| (run.start..=run.until).contains(&time);
    for (name, time) in [("from", from), ("until", until)] {
        if !inside(time) {
            let what = format!("{time} s is outside the run, which goes from {} to {} s", run.start, run.until);
            return Err(Invalid::new(key(name), what, "give a time within it, or leave the key out"));
        }
    }
    if until <= from {
        let what = format!("{until} s is not after its beginning at {from} s");
        return Err(Invalid::new(key("until"), what, "give a later end, or an earlier `from`"));
    }
    if span.batches < 2 {
        let what = format!("{} tell nothing of how sure an average is", span.batches);
        return Err(Invalid::new(key("batches"), what, "use 2 or more; 10 is usual"));
    }
    Ok(())
}

pub(super) fn check_grid(
    key: &impl Fn(&str) -> String,
    min: Option<Vec3>,
    max: Option<Vec3>,
    cells: [u32; 3],
    batches: u32,
    scene: &Scene,
) -> Checked {
    let (min, max) = (min.unwrap_or(scene.domain.min), max.unwrap_or(scene.domain.max));
    for axis in 0..3 {
        let name = ["x", "y", "z"][axis];
        if max[axis] <= min[axis] {
            let what = format!("along {name} the grid reaches from {} to {} m", min[axis], max[axis]);
            return Err(Invalid::new(key("max"), what, "`min` must be below `max` on every axis"));
        }
        if cells[axis] == 0 {
            return Err(Invalid::new(key("cells"), format!("there are no cells along {name}"), "use 1 or more"));
        }
    }
    let count = cells.iter().map(|&count| u64::from(count)).fold(u64::from(batches), u64::saturating_mul);
    if count > CELLS_MAX {
        let what = format!("{count} cells, counted for each batch, are more than fit into memory");
        return Err(Invalid::new(key("cells"), what, format!("use at most {CELLS_MAX}")));
    }
    Ok(())
}
