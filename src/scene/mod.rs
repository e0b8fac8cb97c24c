//! What the user wrote: the scene file, and the only place that knows its format.
//!
//! Everything is in SI units. Each struct is one table of the file; each field is one key, and its doc comment is what
//! `impinge schema` says about it.

mod check;
mod contact;
mod error;
mod forces;
mod key;
mod limits;
mod load;
mod measure;
mod near_field;
mod shape;
mod stepped;
mod subsurface;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use check::unresolved;
pub use check::{check, check_radius};
pub use contact::{Collapse, Contact, Contacts, Friction, Regularised, StaticDynamic};
pub use error::{Invalid, SceneError};
pub(crate) use limits::{LARGEST, SMALLEST};
pub use load::{Overrides, SceneFile};
pub use measure::{FlowMeasure, Measure, Span, SurfaceEnergyMeasure};
pub use near_field::{Auto, DEFAULT_PENETRATION, NearField, Substep, Summation};
pub use shape::schema;
pub use stepped::{FixedPoint, SoftSphere, Trapezoidal};
pub use subsurface::{ContactTime, Elastic, SubsurfaceMeasure};

/// A vector as it stands in the file: `[x, y, z]`.
pub type Vec3 = [f64; 3];

/// A whole scene.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// What the scene is; written into the summary and over the pictures.
    #[serde(default)]
    pub title: String,
    /// Seed of every random draw.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// How long to run, and what to take in.
    pub run: Run,
    /// The region that is simulated.
    pub domain: Domain,
    /// What a grain is where its source says nothing else.
    pub grain: GrainKind,
    /// What happens at a contact.
    #[serde(default)]
    pub contact: Contacts,
    /// The force between grains; left out, there is none and no sub-step for it.
    pub near_field: Option<NearField>,
    /// How the fixed-point scheme steps; with `run.scheme = "fixed-point"` only.
    pub fixed_point: Option<FixedPoint>,
    /// How the trapezoidal scheme steps; with `run.scheme = "trapezoidal"` only.
    pub trapezoidal: Option<Trapezoidal>,
    /// How stiff soft spheres are, and how they are stepped; with `run.scheme = "soft-sphere"` only.
    pub soft_sphere: Option<SoftSphere>,
    /// Where grains come from.
    #[serde(default)]
    pub source: Vec<Source>,
    /// What grains hit.
    #[serde(default)]
    pub surface: Vec<Surface>,
    /// What else is measured.
    #[serde(default)]
    pub measure: Vec<Measure>,
    /// What is written.
    #[serde(default)]
    pub output: Output,
}

fn default_seed() -> u64 {
    1
}

/// `[run]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// End of the run, s.
    pub until: f64,
    /// Simulated time at which the run starts, s.
    #[serde(default)]
    pub start: f64,
    /// How time is advanced.
    #[serde(default)]
    pub scheme: Scheme,
    /// Snapshots for ParaView, evenly spaced in time, the first at the start and the last at the end; 0 for none.
    #[serde(default)]
    pub frames: u32,
    /// Which collisions take part.
    #[serde(default)]
    pub interference: Interference,
    /// Acceleration of every grain, m/s²; left out, there is none and no sub-step for it.
    #[serde(default)]
    pub gravity: Vec3,
    /// Sub-step of a scene in which forces act, s; left out, as long as the local error allows. Where there is a `[near_field]`, give
    /// `near_field.substep` instead.
    pub substep: Option<f64>,
    /// How deep grains may go into each other where forces act, in radii of the smaller one: from 1e-5 to 1e-3, and 1e-4 where left out. Sub-steps
    /// in which the forces would press them deeper are split.
    pub penetration: Option<f64>,
}

/// How time is advanced.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// From one predicted collision to the next.
    #[default]
    EventDriven,
    /// In steps, with contacts as impulses found by fixed-point iteration (Arbelaez et al. 2009).
    FixedPoint,
    /// In steps of the trapezoidal rule, with contacts as impulses (Mukherjee & Zohdi 2015).
    Trapezoidal,
    /// In steps much shorter than a contact, with contacts as forces (Huang, Chan & Zamankhan 2010).
    SoftSphere,
}

/// Which collisions take part, so that first-order and repeated-collision energetics come from the same scene.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Interference {
    /// All of them.
    #[default]
    All,
    /// A grain hits the surface once; after that it passes through the surface.
    FirstOrder,
    /// Anand et al. (1987): a grain that has not hit the surface yet is removed when it collides with one that has; the other
    /// flies on as it was. A grain hits the surface once.
    RemovedOnFirstCollision,
    /// Grains pass through each other.
    None,
}

/// `[domain]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Lower corner, m.
    pub min: Vec3,
    /// Upper corner, m.
    pub max: Vec3,
    /// What happens at the sides.
    #[serde(default)]
    pub boundary: Boundary,
    /// Two dimensions: every grain stays in the plane y = 0 exactly. The y of `min` and `max` has no meaning then.
    #[serde(default)]
    pub planar: bool,
}

impl Domain {
    /// The axes along which grains move: 0 for x, 1 for y, 2 for z.
    pub fn axes(&self) -> impl Iterator<Item = usize> + use<> {
        let planar = self.planar;
        (0..3).filter(move |&axis| !(planar && axis == 1))
    }

    /// Length of the domain along an axis, m.
    #[must_use]
    pub fn side(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }
}

/// What happens at the sides of the domain.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Boundary {
    /// A grain whose centre leaves is counted and removed.
    #[default]
    Open,
    /// A grain that leaves on one side comes in on the other.
    Periodic,
}

/// `[grain]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GrainKind {
    /// Radius, m.
    pub radius: Radius,
    /// Density, kg/m³.
    pub density: f64,
}

/// A radius, or how radii are drawn.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub enum Radius {
    /// All grains alike, m.
    Constant(f64),
    /// Drawn from a distribution.
    Drawn(DrawnRadius),
}

/// How radii are drawn.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct DrawnRadius {
    /// Mean radius, m.
    pub mean: f64,
    /// Coefficient of variation: standard deviation over mean.
    pub cv: f64,
    /// Shape. Uniform spans mean (1 ± √3 cv); normal is cut at ± 3 standard deviations.
    pub distribution: Distribution,
}

/// Shape of a distribution of radii.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// All radii between two ends are equally likely.
    Uniform,
    /// Gaussian, cut at three standard deviations.
    Normal,
    /// The logarithm is Gaussian; `mean` and `cv` are those of the radius itself.
    Lognormal,
}

/// `[[source]]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Source {
    /// Grains from a CSV table.
    File(FileSource),
    /// Grains at random places in a box.
    Block(BlockSource),
    /// Grains on a lattice.
    Lattice(LatticeSource),
    /// Grains that keep coming out of a nozzle.
    Nozzle(NozzleSource),
}

impl Source {
    /// Radius of its grains, if it has one of its own.
    #[must_use]
    pub fn radius(&self) -> Option<&Radius> {
        match self {
            Self::File(source) => source.radius.as_ref(),
            Self::Block(source) => source.radius.as_ref(),
            Self::Lattice(source) => source.radius.as_ref(),
            Self::Nozzle(source) => source.radius.as_ref(),
        }
    }

    /// Factor of its grains in near-field forces, if it gives one.
    #[must_use]
    pub fn strength(&self) -> Option<f64> {
        match self {
            Self::File(source) => source.strength,
            Self::Block(source) => source.strength,
            Self::Lattice(source) => source.strength,
            Self::Nozzle(source) => source.strength,
        }
    }
}

/// Grains from a CSV table with a header: x,y,z,vx,vy,vz and, optionally, wx,wy,wz,radius,density,strength.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct FileSource {
    /// Path of the table, relative to the scene file.
    pub path: String,
    /// Radius where the table has none; that of `[grain]` where left out.
    pub radius: Option<Radius>,
    /// Density (kg/m³) where the table has none; that of `[grain]` where left out.
    pub density: Option<f64>,
    /// Factor of these grains in near-field forces, where the table has none: that between two grains is scaled by the product of theirs. Any
    /// number; 1 where left out.
    pub strength: Option<f64>,
}

/// Grains at random places in a box: random sequential addition (Widom 1966).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct BlockSource {
    /// Lower corner, m.
    pub min: Vec3,
    /// Upper corner, m.
    pub max: Vec3,
    /// How many grains.
    pub count: u64,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Standard deviation of each velocity component about `velocity` (Maxwell), m/s.
    #[serde(default)]
    pub thermal_speed: f64,
    /// Spin, rad/s.
    #[serde(default)]
    pub spin: Vec3,
    /// What lies inside the box: the centres, or the whole grains.
    #[serde(default)]
    pub inside: Inside,
    /// Radius; that of `[grain]` where left out.
    pub radius: Option<Radius>,
    /// Density (kg/m³); that of `[grain]` where left out.
    pub density: Option<f64>,
    /// Factor of these grains in near-field forces: that between two grains is scaled by the product of theirs. Any number; 1 where left out.
    pub strength: Option<f64>,
}

/// What lies inside the box of a block.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Inside {
    /// The centres.
    #[default]
    Centres,
    /// The whole grains.
    Grains,
}

/// Grains on a lattice that fills a box.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct LatticeSource {
    /// Lower corner, m.
    pub min: Vec3,
    /// Upper corner, m.
    pub max: Vec3,
    /// Unit cells along x, y and z; each cell is centred in its share of the box.
    pub cells: [u32; 3],
    /// Places in a cell.
    #[serde(default)]
    pub arrangement: Arrangement,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Standard deviation of each velocity component about `velocity` (Maxwell), m/s.
    #[serde(default)]
    pub thermal_speed: f64,
    /// Spin, rad/s.
    #[serde(default)]
    pub spin: Vec3,
    /// Radius; that of `[grain]` where left out.
    pub radius: Option<Radius>,
    /// Density (kg/m³); that of `[grain]` where left out.
    pub density: Option<f64>,
    /// Factor of these grains in near-field forces: that between two grains is scaled by the product of theirs. Any number; 1 where left out.
    pub strength: Option<f64>,
}

/// Places of the grains in a unit cell.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Arrangement {
    /// One in the middle.
    #[default]
    Cubic,
    /// Four, face-centred.
    FaceCentred,
}

/// Grains that keep coming out of a nozzle (Arbelaez et al. 2009, sections 2 and 8).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct NozzleSource {
    /// Outline of the opening.
    pub shape: NozzleShape,
    /// Centre of the opening, m. All of the opening must be a grain's radius away from the surface when it starts; while a moving surface
    /// is nearer than that, grains wait.
    pub centre: Vec3,
    /// Direction of the jet; any length but 0.
    pub axis: Vec3,
    /// Speed of every grain at the opening, m/s.
    pub speed: f64,
    /// Divergence at the rim, degrees: a grain at distance xi from the axis flies phi = (xi / rim) divergence away from it.
    #[serde(default)]
    pub divergence: f64,
    /// How much comes out.
    pub flow: Flow,
    /// When it starts, s.
    #[serde(default)]
    pub start: f64,
    /// When it stops, s; it never does where left out.
    pub stop: Option<f64>,
    /// Spin, rad/s.
    #[serde(default)]
    pub spin: Vec3,
    /// Radius; that of `[grain]` where left out.
    pub radius: Option<Radius>,
    /// Density (kg/m³); that of `[grain]` where left out.
    pub density: Option<f64>,
    /// Factor of these grains in near-field forces: that between two grains is scaled by the product of theirs. Any number; 1 where left out.
    pub strength: Option<f64>,
}

/// Outline of a nozzle; centres of grains come through it.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum NozzleShape {
    /// A circle.
    Circle {
        /// Diameter, m.
        diameter: f64,
    },
    /// A rectangle; the divergence opens across its width only.
    Slot {
        /// Extent across the slot, m.
        width: f64,
        /// Extent along the slot, m; no meaning in a planar scene.
        breadth: f64,
        /// Direction of the breadth; must not be parallel to the axis.
        along: Vec3,
    },
}

/// How much comes out of a nozzle.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Flow {
    /// Volume fraction at the opening (in a planar scene the area fraction).
    VolumeFraction(f64),
    /// Grains per second.
    NumberFlux(f64),
}

/// `[[surface]]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Surface {
    /// An infinite plane that is hit from the side its normal points to.
    Plane(PlaneSurface),
    /// Triangles from a file, hit from both sides.
    Mesh(MeshSurface),
    /// A flat disc of triangles.
    Disc(DiscSurface),
    /// A flat rectangle of triangles.
    Rectangle(RectangleSurface),
    /// A sine wave of triangles (Arbelaez et al. 2009, fig. 19).
    Sine(SineSurface),
}

/// An infinite plane, hit from the side its normal points to.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct PlaneSurface {
    /// A point of the plane, m.
    pub point: Vec3,
    /// Towards the grains; any length but 0.
    pub normal: Vec3,
    /// Velocity of the plane, m/s; along the plane it is a conveyor belt.
    #[serde(default)]
    pub velocity: Vec3,
}

/// Triangles from an STL (ASCII or binary) or OBJ file.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct MeshSurface {
    /// Path of the file, relative to the scene file.
    pub path: String,
    /// Metres per unit of the file.
    #[serde(default = "one")]
    pub scale: f64,
    /// Shift after scaling, m.
    #[serde(default)]
    pub offset: Vec3,
    /// Velocity of the mesh, m/s.
    #[serde(default)]
    pub velocity: Vec3,
}

fn one() -> f64 {
    1.0
}

/// A flat disc.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct DiscSurface {
    /// Centre, m.
    pub centre: Vec3,
    /// Axis of the disc; any length but 0.
    pub normal: Vec3,
    /// Radius, m.
    pub radius: f64,
    /// Corners of the polygon that stands for the rim.
    #[serde(default = "default_segments")]
    pub segments: u32,
    /// Velocity, m/s.
    #[serde(default)]
    pub velocity: Vec3,
}

fn default_segments() -> u32 {
    64
}

/// A flat rectangle.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct RectangleSurface {
    /// Centre, m.
    pub centre: Vec3,
    /// Normal; any length but 0.
    pub normal: Vec3,
    /// Direction of the first side; must not be parallel to the normal.
    pub along: Vec3,
    /// Lengths of the sides along and across, m.
    pub size: [f64; 2],
    /// How many parts each side is cut into; each part is two triangles.
    #[serde(default = "default_divisions")]
    pub divisions: [u32; 2],
    /// Velocity, m/s.
    #[serde(default)]
    pub velocity: Vec3,
}

fn default_divisions() -> [u32; 2] {
    [1, 1]
}

/// A sine wave: z = centre_z + amplitude sin(2 pi (x - centre_x) / wavelength), over a rectangle in x and y.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SineSurface {
    /// Centre of the rectangle, at the mean height, m.
    pub centre: Vec3,
    /// Extents in x and y, m.
    pub size: [f64; 2],
    /// Height of the asperities above the mean, m.
    pub amplitude: f64,
    /// Distance between asperities, m.
    pub wavelength: f64,
    /// Straight pieces per wavelength.
    #[serde(default = "default_pieces")]
    pub pieces: u32,
    /// Velocity, m/s.
    #[serde(default)]
    pub velocity: Vec3,
}

fn default_pieces() -> u32 {
    32
}

/// `[output]`
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Write every event into `events.csv`.
    #[serde(default)]
    pub events: bool,
    /// Rows of the time history, evenly spaced in time.
    #[serde(default = "default_samples")]
    pub samples: u32,
    /// Draw pictures.
    #[serde(default = "yes")]
    pub pictures: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self { events: false, samples: default_samples(), pictures: yes() }
    }
}

fn default_samples() -> u32 {
    200
}

fn yes() -> bool {
    true
}
