//! What grains hit: planes, meshes from files, and generated meshes.

use std::path::Path;

use impinge_events::contact_time::{APPROACH_ROUNDING, Sweep, sphere_plane, sphere_plane_bent};
use impinge_events::{Bend, Flight, Mesh, Outlook, SurfaceContact};
use nalgebra::Vector3;

use crate::scene::{self, Invalid, Vec3};
use index::Index;
pub use mesh::Report;

mod generated;
mod index;
mod mesh;

/// Largest y of a unit normal that still counts as lying in the plane of a planar scene: STL files keep seven digits. What is
/// left is dropped at each hit, so the grain is turned by as much.
pub const LARGEST_SLOPE: f64 = 1e-5;

/// Points nearer to each other than this part of a radius are one: nearest points of two triangles that share an edge differ by the rounding of
/// their coordinates, 3e-10 radii at the most ([`scene`] keeps domains that small).
const SAME_POINT: f64 = 1e-8;

/// Three corners, m.
pub type Triangle = [Vector3<f64>; 3];

/// All surfaces of a scene.
///
/// Elements (a plane, a triangle) are numbered from 0 over all surfaces in the order of the scene. Each surface moves at its own
/// constant velocity or rests; a contact with a moving one is predicted in the frame that moves along.
///
/// ```
/// use impinge::scene;
/// use impinge::surface::Surface;
/// use impinge_events::{Flight, Outlook, Surface as _};
/// use nalgebra::Vector3;
///
/// let floor = scene::PlaneSurface { point: [0.0; 3], normal: [0.0, 0.0, 2.0], velocity: [0.0; 3] };
/// let surface = Surface::new(&[scene::Surface::Plane(floor)], std::path::Path::new(".")).unwrap();
/// let grain = Flight { position: Vector3::new(0.0, 0.0, 1.5), time: 0.0, velocity: -Vector3::z(), radius: 0.5 };
/// assert_eq!(surface.first_contact(&grain, 10.0), Outlook::Hit { time: 1.0, element: 0 });
/// ```
#[derive(Clone, Debug)]
pub struct Surface {
    parts: Vec<Part>,
    elements: u32,
}

/// One surface of the scene.
#[derive(Clone, Debug)]
struct Part {
    first_element: u32,
    /// m/s
    velocity: Vector3<f64>,
    moves: bool,
    /// How far it has moved by the start of the epoch, m.
    offset: Vector3<f64>,
    shape: Shape,
}

#[derive(Clone, Debug)]
enum Shape {
    Plane { point: Vector3<f64>, normal: Vector3<f64> },
    // Boxed, so that a scene of planes stays in a cache line or two.
    Mesh(Box<(Index, Report)>),
}

impl Surface {
    /// Makes the surfaces of a scene; paths are relative to `folder`.
    ///
    /// # Errors
    /// A mesh that cannot be used, a direction without length, a size that is none; `key` says where in the scene.
    pub fn new(surfaces: &[scene::Surface], folder: &Path) -> Result<Self, Invalid> {
        let mut made = Self { parts: Vec::with_capacity(surfaces.len()), elements: 0 };
        for (number, surface) in surfaces.iter().enumerate() {
            let key = format!("surface[{number}]");
            let (shape, velocity) = shape(surface, folder, &key)?;
            let velocity = finite(velocity, &format!("{key}.velocity"))?;
            let moves = velocity != Vector3::zeros();
            let first_element = made.elements;
            made.elements = first_element
                .checked_add(shape.elements())
                .ok_or_else(|| Invalid::new(&key, "more triangles than can be numbered", "use a coarser mesh"))?;
            made.parts.push(Part { first_element, velocity, moves, offset: Vector3::zeros(), shape });
        }
        Ok(made)
    }

    /// How many planes and triangles there are.
    #[must_use]
    pub fn elements(&self) -> u32 {
        self.elements
    }

    /// All triangles with their numbers, where they are at the start of the epoch.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, Triangle)> + '_ {
        self.parts.iter().flat_map(|part| {
            let mesh = part.mesh();
            (0..mesh.map_or(0, |index| index.mesh().len())).filter_map(move |number| {
                let corners = mesh?.mesh().triangle(number);
                Some((part.first_element + number as u32, corners.map(|corner| corner + part.offset)))
            })
        })
    }

    /// All planes: number, a point where it is at the start of the epoch (m), unit normal.
    pub fn planes(&self) -> impl Iterator<Item = (u32, Vector3<f64>, Vector3<f64>)> + '_ {
        self.parts.iter().filter_map(|part| match part.shape {
            Shape::Plane { point, normal } => Some((part.first_element, point + part.offset, normal)),
            Shape::Mesh(_) => None,
        })
    }

    /// What the import of each mesh found and mended, with the number of its `[[surface]]`, counted from 0.
    pub fn reports(&self) -> impl Iterator<Item = (usize, &Report)> {
        self.parts.iter().enumerate().filter_map(|(number, part)| match &part.shape {
            Shape::Plane { .. } => None,
            Shape::Mesh(mesh) => Some((number, &mesh.1)),
        })
    }

    /// Whether a grain at rest at `position` (m) is inside a surface at `time` (s, epoch time): it reaches below a plane, cuts a
    /// triangle, or has its centre inside a watertight mesh, which is taken for solid (a vessel needs an opening, or walls with an
    /// inside and an outside). Says into which element it reaches the deepest, and how deep (m).
    #[must_use]
    pub fn overlaps(&self, position: Vector3<f64>, radius: f64, time: f64) -> Option<(u32, f64)> {
        let overlaps = self.parts.iter().filter_map(|part| part.overlap(position - part.displacement(time), radius));
        overlaps.reduce(|deepest, other| if other.1 > deepest.1 { other } else { deepest })
    }

    /// Distance between a sphere and the surface (m), both as they are at the local time of `flight`: exact below `reach` (m), negative where they
    /// overlap; `reach` or more where it is more.
    #[must_use]
    pub fn gap(&self, flight: &Flight, reach: f64) -> f64 {
        self.parts.iter().map(|part| part.gap(flight, reach)).fold(f64::INFINITY, f64::min)
    }

    /// Adds to `found` every contact of `flight`, as it is at its local time, whose gap is less than `reach` (m): one for each point where the
    /// distance to the surface is smallest among its neighbours, so that internal edges and corners of a mesh add none.
    pub fn contacts(&self, flight: &Flight, reach: f64, found: &mut Vec<(u32, SurfaceContact)>) {
        for part in &self.parts {
            part.contacts(flight, reach, found);
        }
    }

    /// Refuses a mesh that would push the grains of a planar scene out of the plane y = 0.
    ///
    /// Where the mesh meets the plane its faces must run along y. What lies beside the plane, as the caps of a prism do, is out
    /// of reach; a cap so near that grains touch it all the same stops the run at the hit.
    ///
    /// # Errors
    /// The first triangle that meets the plane at a slant, or a mesh that does not meet it at all.
    pub fn check_planar(&self) -> Result<(), Invalid> {
        for (number, part) in self.parts.iter().enumerate() {
            let Some(mesh) = part.mesh().map(Index::mesh) else { continue };
            let refuse = |what: String| {
                let remedy =
                    "give a planar scene a surface that does not change along y, or set `domain.planar = false`";
                Err(Invalid::new(format!("surface[{number}]"), what, remedy))
            };
            let meets = |corners: &Triangle| {
                corners.iter().any(|corner| corner.y <= 0.0) && corners.iter().any(|corner| corner.y >= 0.0)
            };
            let mut met = (0..mesh.len()).filter(|&triangle| meets(&mesh.triangle(triangle))).peekable();
            if met.peek().is_none() {
                return refuse("it does not meet the plane y = 0, in which all grains of a planar scene are".into());
            }
            let slope = |triangle: usize| {
                let [a, b, c] = mesh.triangle(triangle);
                (b - a).cross(&(c - a)).normalize().y
            };
            if let Some(triangle) = met.find(|&triangle| slope(triangle).abs() > LARGEST_SLOPE) {
                let normal = slope(triangle);
                return refuse(format!(
                    "triangle {triangle} would push grains out of the plane y = 0: its normal has y = {normal:.3}"
                ));
            }
        }
        Ok(())
    }

    /// Which `[[surface]]` of the scene, counted from 0, `element` belongs to.
    #[must_use]
    pub fn number_of(&self, element: u32) -> usize {
        self.parts.partition_point(|part| part.first_element <= element) - 1
    }

    /// The first of the contacts that `look` finds on each part until a given time (s).
    #[inline]
    fn first(&self, until: f64, look: impl Fn(&Part, f64) -> Outlook) -> Outlook {
        let mut clear = f64::INFINITY;
        let mut hit: Option<(f64, u32)> = None;
        for part in &self.parts {
            let end = hit.map_or(until, |(time, _)| time.min(until));
            match look(part, end) {
                // Parts come in the order of their elements, so of equal times the lowest element wins.
                Outlook::Hit { time, element } if hit.is_none_or(|(first, _)| time < first) => {
                    hit = Some((time, element));
                }
                Outlook::Hit { .. } => {}
                Outlook::ClearUntil(time) => clear = clear.min(time),
            }
        }
        match hit {
            Some((time, element)) if time <= clear => Outlook::Hit { time, element },
            _ => Outlook::ClearUntil(clear),
        }
    }

    fn part(&self, element: u32) -> &Part {
        &self.parts[self.number_of(element)]
    }
}

impl impinge_events::Surface for Surface {
    #[inline]
    fn first_contact(&self, flight: &Flight, until: f64) -> Outlook {
        self.first(until, |part, end| part.first_contact(flight, end))
    }

    fn first_contact_bent(&self, flight: &Flight, bend: &Bend, until: f64) -> Outlook {
        self.first(until, |part, end| part.first_contact_bent(flight, bend, end))
    }

    fn touches(&self, flight: &Flight, reach: f64, visit: &mut dyn FnMut(u32, SurfaceContact)) {
        for part in &self.parts {
            part.touches(flight, reach, visit);
        }
    }

    fn contact(&self, element: u32, flight: &Flight) -> SurfaceContact {
        let part = self.part(element);
        let (normal, gap) = match &part.shape {
            Shape::Plane { point, normal } => {
                let height = (part.seen(flight).position - point).dot(normal);
                (*normal, height - flight.radius)
            }
            Shape::Mesh(mesh) => {
                mesh.0.mesh().normal_and_gap((element - part.first_element) as usize, &part.sweep(flight))
            }
        };
        SurfaceContact { normal, gap, velocity: part.velocity }
    }

    fn speed(&self) -> f64 {
        self.parts.iter().map(|part| part.velocity.amax()).fold(0.0, f64::max)
    }

    fn start_epoch(&mut self, duration: f64) {
        for part in &mut self.parts {
            part.offset += part.velocity * duration;
        }
    }
}

impl Part {
    #[inline]
    fn first_contact(&self, flight: &Flight, until: f64) -> Outlook {
        match &self.shape {
            Shape::Plane { point, normal } => match self.plane_contact(flight, point, normal) {
                Some(time) => Outlook::Hit { time, element: self.first_element },
                None => Outlook::ClearUntil(f64::INFINITY),
            },
            Shape::Mesh(mesh) => match mesh.0.first_contact(&self.sweep(flight), until) {
                Outlook::Hit { time, element } => Outlook::Hit { time, element: self.first_element + element },
                clear @ Outlook::ClearUntil(_) => clear,
            },
        }
    }

    /// Exact for a plane; of a mesh the chord is taken.
    fn first_contact_bent(&self, flight: &Flight, bend: &Bend, until: f64) -> Outlook {
        match &self.shape {
            Shape::Plane { point, normal } => match sphere_plane_bent(&self.seen(flight), bend, *point, *normal) {
                Some(time) => Outlook::Hit { time, element: self.first_element },
                None => Outlook::ClearUntil(f64::INFINITY),
            },
            Shape::Mesh(_) => self.first_contact(flight, until),
        }
    }

    #[inline]
    fn plane_contact(&self, flight: &Flight, point: &Vector3<f64>, normal: &Vector3<f64>) -> Option<f64> {
        if !self.moves {
            return sphere_plane(flight, *point, *normal);
        }
        let seen = self.seen(flight);
        let approach = -seen.velocity.dot(normal);
        if approach > APPROACH_ROUNDING * self.speeds(flight) { sphere_plane(&seen, *point, *normal) } else { None }
    }

    fn touches(&self, flight: &Flight, reach: f64, visit: &mut dyn FnMut(u32, SurfaceContact)) {
        let centre = self.seen(flight).position;
        let velocity = self.velocity;
        match &self.shape {
            Shape::Plane { point, normal } => {
                let gap = (centre - point).dot(normal) - flight.radius;
                if gap < reach {
                    visit(self.first_element, SurfaceContact { normal: *normal, gap, velocity });
                }
            }
            Shape::Mesh(mesh) => {
                // Triangles that share the nearest point carry the grain once.
                let mut seen: SmallNormals = SmallNormals::default();
                mesh.0.within(&centre, flight.radius + reach, &mut |element, nearest| {
                    let arm = centre - nearest;
                    let distance = arm.norm();
                    if distance > 0.0 && seen.is_new(arm / distance) {
                        let contact =
                            SurfaceContact { normal: arm / distance, gap: distance - flight.radius, velocity };
                        visit(self.first_element + element, contact);
                    }
                });
            }
        }
    }

    fn gap(&self, flight: &Flight, reach: f64) -> f64 {
        let centre = self.seen(flight).position;
        match &self.shape {
            Shape::Plane { point, normal } => (centre - point).dot(normal) - flight.radius,
            Shape::Mesh(mesh) => {
                let nearest = mesh.0.nearest(&centre, flight.radius + reach);
                nearest.map_or(reach, |(_, distance)| distance - flight.radius)
            }
        }
    }

    fn contacts(&self, flight: &Flight, reach: f64, found: &mut Vec<(u32, SurfaceContact)>) {
        let (centre, velocity) = (self.seen(flight).position, self.velocity);
        let offer = |element, normal, gap| (self.first_element + element, SurfaceContact { normal, gap, velocity });
        match &self.shape {
            Shape::Plane { point, normal } => {
                let gap = (centre - point).dot(normal) - flight.radius;
                found.extend((gap < reach).then(|| offer(0, *normal, gap)));
            }
            Shape::Mesh(mesh) => {
                let first = found.len();
                mesh.0.within(&centre, flight.radius + reach, &mut |element, nearest| {
                    let arm = centre - nearest;
                    let distance = arm.norm();
                    if distance > 0.0 {
                        found.push(offer(element, arm / distance, distance - flight.radius));
                    }
                });
                if found.len() > first + 1 {
                    self.keep_nearest(mesh.0.mesh(), centre, flight.radius, found, first);
                }
            }
        }
    }

    /// Of the contacts from `first` on, drops those whose nearest point lies on another triangle too that comes nearer elsewhere, or as near and
    /// has a lower number.
    fn keep_nearest(
        &self,
        mesh: &Mesh,
        centre: Vector3<f64>,
        radius: f64,
        found: &mut Vec<(u32, SurfaceContact)>,
        first: usize,
    ) {
        found[first..].sort_unstable_by(|a, b| a.1.gap.total_cmp(&b.1.gap).then(a.0.cmp(&b.0)));
        // From the back, so that each is compared with all that come nearer, dropped ones too: the surface goes on from triangle to triangle.
        for k in (first + 1..found.len()).rev() {
            let contact = found[k].1;
            let point = centre - contact.normal * (contact.gap + radius);
            let shared = found[first..k].iter().any(|(nearer, _)| {
                let on_nearer = mesh.nearest((nearer - self.first_element) as usize, &point);
                (on_nearer - point).amax() <= SAME_POINT * radius
            });
            if shared {
                found.remove(k);
            }
        }
    }

    /// The flight as seen from this surface, in the coordinates in which it was made.
    #[inline]
    fn seen(&self, flight: &Flight) -> Flight {
        if !self.moves {
            return *flight;
        }
        let position = flight.position - self.displacement(flight.time);
        Flight { position, velocity: flight.velocity - self.velocity, ..*flight }
    }

    /// How far this surface has moved by `time` (s, epoch time), m.
    #[inline]
    fn displacement(&self, time: f64) -> Vector3<f64> {
        self.offset + self.velocity * time
    }

    /// The size of the speeds whose difference a relative velocity is, m/s.
    #[inline]
    fn speeds(&self, flight: &Flight) -> f64 {
        flight.velocity.amax() + self.velocity.amax()
    }

    #[inline]
    fn sweep(&self, flight: &Flight) -> Sweep {
        Sweep::new(&self.seen(flight), self.speeds(flight))
    }

    fn mesh(&self) -> Option<&Index> {
        match &self.shape {
            Shape::Plane { .. } => None,
            Shape::Mesh(mesh) => Some(&mesh.0),
        }
    }

    /// How deep a grain is inside this surface, and in which element; `position` in the coordinates in which it was made.
    fn overlap(&self, position: Vector3<f64>, radius: f64) -> Option<(u32, f64)> {
        match &self.shape {
            Shape::Plane { point, normal } => {
                let depth = radius - (position - point).dot(normal);
                (depth > 0.0).then_some((self.first_element, depth))
            }
            Shape::Mesh(mesh) => {
                let index = &mesh.0;
                if index.encloses(&position) {
                    let (element, distance) = index.nearest(&position, f64::INFINITY)?;
                    return Some((self.first_element + element, distance + radius));
                }
                let (element, distance) = index.nearest(&position, radius)?;
                (distance < radius).then_some((self.first_element + element, radius - distance))
            }
        }
    }
}

/// Contact normals of one grain that differ.
#[derive(Default)]
struct SmallNormals(Vec<Vector3<f64>>);

impl SmallNormals {
    /// Cosine of the angle (4e-4) below which two normals are one.
    const SAME: f64 = 1.0 - 1e-7;

    fn is_new(&mut self, normal: Vector3<f64>) -> bool {
        let new = self.0.iter().all(|known| known.dot(&normal) < Self::SAME);
        if new {
            self.0.push(normal);
        }
        new
    }
}

impl Shape {
    fn elements(&self) -> u32 {
        match self {
            Self::Plane { .. } => 1,
            Self::Mesh(mesh) => mesh.0.mesh().len() as u32,
        }
    }

    fn mesh(triangles: &[Triangle], key: &str) -> Result<Self, Invalid> {
        let (mesh, report) = mesh::mend(triangles, key)?;
        Ok(Self::Mesh(Box::new((Index::new(mesh), report))))
    }
}

/// The shape and the velocity of one `[[surface]]`.
fn shape(surface: &scene::Surface, folder: &Path, key: &str) -> Result<(Shape, Vec3), Invalid> {
    Ok(match surface {
        scene::Surface::Plane(plane) => {
            let point = finite(plane.point, &format!("{key}.point"))?;
            let normal = unit(plane.normal, &format!("{key}.normal"))?;
            (Shape::Plane { point, normal }, plane.velocity)
        }
        scene::Surface::Mesh(file) => {
            let path_key = format!("{key}.path");
            let offset = finite(file.offset, &format!("{key}.offset"))?;
            if !(file.scale.is_finite() && file.scale != 0.0) {
                let what = format!("{} is not a scale", file.scale);
                return Err(Invalid::new(format!("{key}.scale"), what, "give the metres per unit of the file"));
            }
            let mut triangles = mesh::read(&folder.join(&file.path), &path_key)?;
            triangles.iter_mut().flatten().for_each(|corner| *corner = *corner * file.scale + offset);
            let named = |bad: Invalid| Invalid { what: format!("{}: {}", file.path, bad.what), ..bad };
            (Shape::mesh(&triangles, &path_key).map_err(named)?, file.velocity)
        }
        scene::Surface::Disc(disc) => (Shape::mesh(&generated::disc(disc, key)?, key)?, disc.velocity),
        scene::Surface::Rectangle(rectangle) => {
            (Shape::mesh(&generated::rectangle(rectangle, key)?, key)?, rectangle.velocity)
        }
        scene::Surface::Sine(sine) => (Shape::mesh(&generated::sine(sine, key)?, key)?, sine.velocity),
    })
}

fn finite(vector: Vec3, key: &str) -> Result<Vector3<f64>, Invalid> {
    if vector.iter().all(|x| x.is_finite()) {
        return Ok(vector.into());
    }
    Err(Invalid::new(key, format!("{vector:?} is not finite"), "give three finite numbers"))
}

fn unit(vector: Vec3, key: &str) -> Result<Vector3<f64>, Invalid> {
    let direction = finite(vector, key)?;
    if direction == Vector3::zeros() {
        return Err(Invalid::new(key, format!("{vector:?} has no direction"), "give any vector but 0"));
    }
    // In units of its largest component nothing overflows or underflows.
    Ok((direction / direction.amax()).normalize())
}
