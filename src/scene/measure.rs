//! What else is measured: `[[measure]]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits::{Checked, positive};
use super::outflow::{self, OutflowMeasure};
use super::surface_stress::{self, SurfaceStressMeasure};
use super::{Invalid, Run, Scene, Surface, Vec3};

/// Most cells of a grid times batches: each holds eighteen numbers, so that these fill 2 GB. More is a misplaced digit.
pub(super) const CELLS_MAX: u64 = 14_000_000;

/// Most bins of a distribution over angles: finer ones hold no grains.
const BINS_MAX: u32 = 18_000;

/// So much of its size may rounding put a grid above the plane that it reaches up to.
const ROUNDING: f64 = 1e-12;

/// `[[measure]]`: something to be measured; its results go into `measures/NAME`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Measure {
    /// Density, velocity, granular temperature and stress on a grid, averaged over time.
    Flow(FlowMeasure),
    /// Energy that grains bring to the surface, over time and by hit order.
    SurfaceEnergy(SurfaceEnergyMeasure),
    /// Stress and damage that every hit on a plane makes in the solid below it.
    Subsurface(SubsurfaceMeasure),
    /// Directions in which mass leaves the domain: opening angle, half-mass angle, distribution.
    Ejecta(EjectaMeasure),
    /// Normal and shear stress on patches of the surface.
    SurfaceStress(SurfaceStressMeasure),
    /// What leaves through the sides of the domain, over height.
    Outflow(OutflowMeasure),
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

/// `kind = "subsurface"`: a plane bounds an elastic solid, and each hit on it is a force on a point of it. Hits on triangles that lie in the plane count
/// too.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SubsurfaceMeasure {
    /// Name of its folder; left out, its kind.
    pub name: Option<String>,
    /// A point of the plane, m; left out, that of the first plane of the scene that is at rest.
    pub point: Option<Vec3>,
    /// Normal of the plane, away from the solid, with `point`; any length but 0.
    pub normal: Option<Vec3>,
    /// Lower corner of the grid, m; all of it must be below the plane.
    pub min: Vec3,
    /// Upper corner of the grid, m.
    pub max: Vec3,
    /// Cells along x, y and z; the stress is that in the middle of a cell.
    pub cells: [u32; 3],
    /// Young's modulus of the solid without pores, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio of the solid without pores, above -1 and below 1/2.
    #[serde(default = "default_poisson_ratio")]
    pub poisson_ratio: f64,
    /// Part of the volume that is pores, 0 to below 1.
    #[serde(default)]
    pub porosity: f64,
    /// phi: weight of the upper bound of Hashin & Shtrikman in the moduli of the porous solid, 0 to 1; the rest is that of the lower one.
    #[serde(default = "one")]
    pub bound: f64,
    /// C: moduli of the pores over those of the solid; above 0, below 1.
    #[serde(default = "default_pore_stiffness")]
    pub pore_stiffness: f64,
    /// sigma_0: equivalent stress above which there is damage, Pa.
    pub threshold: f64,
    /// How long a contact lasts, which makes a force of an impulse: seconds, or "hertz" for that of an elastic contact of the grain with the porous
    /// solid.
    #[serde(default)]
    pub contact_time: ContactTime,
    /// With `contact_time = "hertz"`: Young's modulus of the grains, Pa; left out, they are rigid.
    pub grain_young_modulus: Option<f64>,
    /// With `grain_young_modulus`: Poisson's ratio of the grains, above -1 and at most 1/2; 0.3 where left out.
    pub grain_poisson_ratio: Option<f64>,
    /// When it begins, s; left out, at the start of the run.
    pub from: Option<f64>,
    /// When it ends, s; left out, at the end of the run.
    pub until: Option<f64>,
    /// Batches that tell how damage grows, and how sure it is where hits come evenly.
    #[serde(default = "default_batches")]
    pub batches: u32,
}

impl SubsurfaceMeasure {
    /// Poisson's ratio of solids and grains where the scene gives none: that of steel.
    pub const POISSON_RATIO: f64 = 0.3;

    /// Point (m) and normal of the plane: its own, or those of the first plane of the scene that is at rest.
    #[must_use]
    pub fn plane(&self, scene: &Scene) -> Option<[Vec3; 2]> {
        let at_rest = |surface: &Surface| match surface {
            Surface::Plane(plane) if plane.velocity == [0.0; 3] => Some([plane.point, plane.normal]),
            _ => None,
        };
        self.point.zip(self.normal).map(Into::into).or_else(|| scene.surface.iter().find_map(at_rest))
    }
}

fn default_poisson_ratio() -> f64 {
    SubsurfaceMeasure::POISSON_RATIO
}

fn one() -> f64 {
    1.0
}

fn default_pore_stiffness() -> f64 {
    1e-4
}

/// How long a contact lasts.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub enum ContactTime {
    /// Always the same, s.
    Fixed(f64),
    /// As long as its grain and its speed make it.
    Elastic(Elastic),
}

impl Default for ContactTime {
    fn default() -> Self {
        Self::Elastic(Elastic::Hertz)
    }
}

/// A model of a contact.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Elastic {
    /// Hertz (1882).
    Hertz,
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
            Self::Ejecta(ejecta) => ejecta.name.as_deref(),
            Self::SurfaceStress(stress) => stress.name.as_deref(),
            Self::Outflow(outflow) => outflow.name.as_deref(),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Flow(_) => "flow",
            Self::SurfaceEnergy(_) => "surface-energy",
            Self::Subsurface(_) => "subsurface",
            Self::Ejecta(_) => "ejecta",
            Self::SurfaceStress(_) => "surface-stress",
            Self::Outflow(_) => "outflow",
        }
    }

    /// When it is measured.
    #[must_use]
    pub fn span(&self) -> Span {
        match *self {
            Self::Flow(FlowMeasure { from, until, batches, .. })
            | Self::SurfaceEnergy(SurfaceEnergyMeasure { from, until, batches, .. })
            | Self::Subsurface(SubsurfaceMeasure { from, until, batches, .. })
            | Self::Ejecta(EjectaMeasure { from, until, batches, .. })
            | Self::SurfaceStress(SurfaceStressMeasure { from, until, batches, .. })
            | Self::Outflow(OutflowMeasure { from, until, batches, .. }) => Span { from, until, batches },
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
            Measure::Subsurface(subsurface) => check_subsurface(&key, subsurface, scene)?,
            Measure::Ejecta(ejecta) => check_ejecta(&key, ejecta)?,
            Measure::SurfaceStress(stress) => surface_stress::check(&key, stress, scene)?,
            Measure::Outflow(outflow) => outflow::check(&key, outflow, scene)?,
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

fn check_ejecta(key: &impl Fn(&str) -> String, ejecta: &EjectaMeasure) -> Checked {
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

fn check_grid(
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
    if scene.domain.planar && !(min[1] <= 0.0 && max[1] > 0.0) {
        let what =
            format!("along y the grid reaches from {} to {} m, past the plane y = 0 of the grains", min[1], max[1]);
        return Err(Invalid::new(
            key("min"),
            what,
            "let it hold that plane, with a diameter of a grain as its thickness",
        ));
    }
    let count = cells.iter().map(|&count| u64::from(count)).fold(u64::from(batches), u64::saturating_mul);
    if count > CELLS_MAX {
        let what = format!("{count} cells, counted for each batch, are more than fit into memory");
        return Err(Invalid::new(key("cells"), what, format!("use at most {CELLS_MAX}")));
    }
    Ok(())
}

fn check_subsurface(key: &impl Fn(&str) -> String, measure: &SubsurfaceMeasure, scene: &Scene) -> Checked {
    for (given, missing, name) in [(measure.point, measure.normal, "normal"), (measure.normal, measure.point, "point")]
    {
        if given.is_some() && missing.is_none() {
            let what = format!("there is no `{name}` of the plane");
            return Err(Invalid::new(key(name), what, "give both `point` and `normal`, or neither"));
        }
    }
    let Some([point, normal]) = measure.plane(scene) else {
        let remedy = "give `point` and `normal` of the plane, or add a [[surface]] with `kind = \"plane\"`";
        return Err(Invalid::new(key("kind"), "there is no plane at rest that bounds a solid", remedy));
    };
    let length = normal.iter().map(|part| part * part).sum::<f64>().sqrt();
    if length == 0.0 {
        return Err(Invalid::new(key("normal"), "it has no direction", "give a vector that is not 0"));
    }
    check_grid(key, Some(measure.min), Some(measure.max), measure.cells, measure.batches, scene)?;
    let corners = (0..8).map(|corner| -> Vec3 {
        std::array::from_fn(|axis| if corner >> axis & 1 == 0 { measure.min[axis] } else { measure.max[axis] })
    });
    let height = |corner: Vec3| (0..3).map(|i| (corner[i] - point[i]) * normal[i]).sum::<f64>() / length;
    let highest = corners.map(height).fold(f64::NEG_INFINITY, f64::max);
    let size = (0..3).map(|axis| measure.max[axis] - measure.min[axis]).fold(0.0, f64::max);
    if highest > ROUNDING * size {
        let what = format!("the grid reaches {highest} m above the plane, where there is no solid");
        return Err(Invalid::new(key("max"), what, "move the grid down, or make it smaller"));
    }
    positive(&key("young_modulus"), measure.young_modulus, "Pa")?;
    positive(&key("threshold"), measure.threshold, "Pa")?;
    let nu = measure.poisson_ratio;
    if !(nu > -1.0 && nu < 0.5) {
        let what = format!("{nu} is outside (-1, 0.5), where a solid has a bulk modulus");
        return Err(Invalid::new(key("poisson_ratio"), what, "0.3 is that of steel"));
    }
    if !(0.0..1.0).contains(&measure.porosity) {
        let what = format!("{} is outside [0, 1)", measure.porosity);
        return Err(Invalid::new(key("porosity"), what, "give the part of the volume that is pores; 0 for none"));
    }
    if !(0.0..=1.0).contains(&measure.bound) {
        let what = format!("{} is outside [0, 1]", measure.bound);
        return Err(Invalid::new(key("bound"), what, "1 is the upper bound, 0 the lower one"));
    }
    if !(measure.pore_stiffness > 0.0 && measure.pore_stiffness < 1.0) {
        let what = format!("{} is outside (0, 1)", measure.pore_stiffness);
        return Err(Invalid::new(key("pore_stiffness"), what, "1e-4 is so soft that less changes nothing"));
    }
    if let ContactTime::Fixed(time) = measure.contact_time {
        positive(&key("contact_time"), time, "s")?;
        if measure.grain_young_modulus.is_some() {
            let what = format!("contacts last {time} s, however stiff the grains are");
            return Err(Invalid::new(
                key("grain_young_modulus"),
                what,
                "take it out, or set `contact_time = \"hertz\"`",
            ));
        }
    }
    check_grain_stiffness(key, measure)
}

fn check_grain_stiffness(key: &impl Fn(&str) -> String, measure: &SubsurfaceMeasure) -> Checked {
    if let Some(young) = measure.grain_young_modulus {
        positive(&key("grain_young_modulus"), young, "Pa")?;
    }
    let Some(nu) = measure.grain_poisson_ratio else { return Ok(()) };
    if measure.grain_young_modulus.is_none() {
        let what = format!("{nu} has no effect: the grains are rigid");
        return Err(Invalid::new(key("grain_poisson_ratio"), what, "take it out, or give `grain_young_modulus`"));
    }
    if !(nu > -1.0 && nu <= 0.5) {
        let what = format!("{nu} is outside (-1, 0.5], where an elastic solid is stable");
        return Err(Invalid::new(key("grain_poisson_ratio"), what, "0.3 is that of steel"));
    }
    Ok(())
}
