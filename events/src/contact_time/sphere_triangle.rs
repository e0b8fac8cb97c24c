//! Sphere and triangle in closed form: face, edge and corner.
//!
//! A sphere touches a triangle mesh when its centre comes within one radius of it, so its centre meets the outline of the mesh
//! grown by the radius: shifted faces, pieces of cylinders about the edges, pieces of spheres about the corners (Ericson 2005,
//! Real-Time Collision Detection, section 5.5.6). Each piece is a function of its own here, and each counts only inside its
//! own Voronoi region: the part of space that is nearer to it than to the rest of the mesh around it. Faces take in their
//! border, edges and corners do not. So a sphere that comes down exactly on an edge between two coplanar triangles hits a face
//! and finds the plane's answer, a sphere that slides over that edge hits nothing (no ghost hits on internal edges), and none
//! slips through between two features.
//!
//! Arbelaez, Zohdi & Dornfeld (2009), eq. (41), have the face only.

use nalgebra::Vector3;

use super::grazing::{self, GRAZING};
use super::wide::{Wide, WideVector};
use super::{APPROACH_ROUNDING, STANDSTILL};
use crate::Flight;

/// How far outside its border (in units of the distances that the foot point was reckoned from) a face or the length of an
/// edge still counts.
///
/// The foot point is a sum of products and is known to some ten units in the last place (2^-53) of those distances, times the
/// ratio of speed to normal speed where a flight comes in at a grazing angle. Two triangles with a common edge must not both
/// miss a sphere that comes down on it. Consequence: a contact may be taken for one with the face when it is with the edge
/// beside it, as far outside as this; its time is wrong by the square of that.
const BORDER: f64 = 1.0 / (1u64 << 47) as f64;

/// How far inside its Voronoi region (sine of an angle) the centre must be for an edge or a corner to count.
///
/// The scalar products that tell are known to a few units in the last place. Much narrower than [`BORDER`], so that nothing
/// slips through between a face and its edge; wide enough that an edge between coplanar triangles has no region at all.
const CREASE: f64 = 1.0 / (1u64 << 50) as f64;

/// The largest ratio of speed to normal speed by which [`BORDER`] is widened at the end of an edge.
///
/// A cylinder is curved: a contact with one that is more grazing than 1e-6 goes no deeper than 5e-13 radii, so losing it
/// does no harm, while an edge without end would.
const STEEPEST_GRAZING: f64 = 1e6;

/// A sphere that would sink into an edge or a corner by less than this (in radii) slides past it.
///
/// Rounding decides whether it does, and the speed of arrival that it would see is the square root of rounding. Consequence: an
/// overlap of 2e-15 radii.
const SLIDING: f64 = 1.0 / (1u64 << 49) as f64;

/// The same as a part of s² v²: below it, the discriminant s² v² - |r × v|² counts for none.
const GRAZED: f64 = 2.0 * SLIDING;

/// Triangles flatter than this (height over longest side) have no normal that could be trusted to six digits.
const FLATTEST: f64 = 1e-10;

/// A sphere that sets off: a flight as seen from one surface, ready to be tried on many features.
///
/// Features answer with intervals in the units of time of the sweep; [`Sweep::time`] turns them into times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Centre at the start, m.
    pub position: Vector3<f64>,
    /// Displacement per unit of time, m.
    pub velocity: Vector3<f64>,
    /// Radius, m.
    pub radius: f64,
    /// Largest component of `velocity`.
    speed: f64,
    /// Normal speeds up to this one are rounding.
    slowest: f64,
    /// When it sets off, s.
    start: f64,
    /// Seconds in a unit of time.
    unit: f64,
}

/// Below this speed (m/s) its square and the products of the root could underflow.
const SLOWEST_SPEED: f64 = 1e-100;

impl Sweep {
    /// The sweep of `flight`, whose velocity is relative to the surface.
    ///
    /// `speeds` (m/s) is the size of the numbers that this velocity was computed from, because its rounding is theirs: the largest
    /// component of the velocity itself for a surface at rest, that of grain and surface together for a moving one.
    ///
    /// The unit of time is the second, except for speeds near the end of the floating-point range, as at the end of a collapse:
    /// then it is a power of two in which the speed is near 1, so that nothing underflows and nothing is rounded.
    #[inline]
    #[must_use]
    pub fn new(flight: &Flight, speeds: f64) -> Self {
        let speed = flight.velocity.amax();
        let unit = if speed < SLOWEST_SPEED { slow_unit(speed) } else { 1.0 };
        Self {
            position: flight.position,
            velocity: flight.velocity * unit,
            radius: flight.radius,
            speed: speed * unit,
            slowest: if speed < STANDSTILL { f64::INFINITY } else { APPROACH_ROUNDING * speeds * unit },
            start: flight.time,
            unit,
        }
    }

    /// The time (s, epoch time) at which `interval` has passed.
    #[inline]
    #[must_use]
    pub fn time(&self, interval: f64) -> f64 {
        self.start + interval * self.unit
    }
}

#[cold]
fn slow_unit(speed: f64) -> f64 {
    if speed > 0.0 { 2f64.powi((-speed.log2()).floor().clamp(0.0, 960.0) as i32) } else { 1.0 }
}

/// The face of a triangle, hit from both sides. In two cache lines, not three.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(128))]
pub struct Face {
    /// First corner; the distances below are counted from it.
    origin: Vector3<f64>,
    normal: Vector3<f64>,
    /// Unit vectors in the plane, across the sides ab, bc and ca, away from the triangle.
    outward: [Vector3<f64>; 3],
    /// Distance of `origin` from the side bc.
    height: f64,
}

impl Face {
    /// The face with these corners (m), or `None` when they lie on a line or are not finite.
    #[must_use]
    pub fn new(corners: [Vector3<f64>; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let size = (b - a).amax().max((c - a).amax());
        let sides = [(b - a) / size, (c - b) / size, (a - c) / size];
        let squares = sides.map(|side| side.norm_squared());
        // The product of the two shorter sides is rounded the least.
        let longest = (0..3).max_by(|&i, &j| squares[i].total_cmp(&squares[j]))?;
        let product = sides[(longest + 1) % 3].cross(&sides[(longest + 2) % 3]);
        let area = product.norm();
        if area > FLATTEST * squares[longest] {
            let normal = product / area;
            let outward = sides.map(|side| side.cross(&normal).normalize());
            Some(Self { origin: a, normal, outward, height: (b - a).dot(&outward[1]) })
        } else {
            None
        }
    }

    /// Unit normal; the corners run anticlockwise about it.
    #[must_use]
    pub fn normal(&self) -> Vector3<f64> {
        self.normal
    }

    /// Unit vectors in the plane of the face, across its sides ab, bc and ca, away from the triangle.
    #[must_use]
    pub fn outward(&self) -> [Vector3<f64>; 3] {
        self.outward
    }

    /// Interval until the sphere touches the face; `None` when it never does, or does so outside the border.
    ///
    /// Like [`sphere_plane`](super::sphere_plane), from the side on which the sphere is.
    #[inline]
    #[must_use]
    pub fn contact(&self, sweep: &Sweep) -> Option<f64> {
        let start = sweep.position - self.origin;
        let distance = start.dot(&self.normal);
        let approach = -sweep.velocity.dot(&self.normal) * 1f64.copysign(distance);
        if approach > sweep.slowest {
            let gap = distance.abs() - sweep.radius;
            let interval = (gap / approach).max(0.0);
            let foot = start + sweep.velocity * interval;
            let grazing = if gap > 0.0 { sweep.speed / approach } else { 1.0 };
            let border = BORDER * (start.amax() + foot.amax() + sweep.radius) * grazing.max(1.0);
            if self.covers(&foot, border) {
                return Some(interval);
            }
        }
        None
    }

    /// Whether the foot of a point (relative to `origin`) lies inside the sides, or outside by no more than `border`.
    #[inline]
    fn covers(&self, point: &Vector3<f64>, border: f64) -> bool {
        let [ab, bc, ca] = &self.outward;
        point.dot(ab) <= border && point.dot(bc) - self.height <= border && point.dot(ca) <= border
    }

    /// Signed distance of `point` from the plane of the face when its foot lies on the face, or beyond each side by no more than `border`.
    pub(crate) fn distance_over(&self, point: &Vector3<f64>, border: [f64; 3]) -> Option<f64> {
        let start = point - self.origin;
        let [ab, bc, ca] = self.outward.map(|outward| start.dot(&outward));
        let beyond = [ab, bc - self.height, ca];
        (0..3).all(|side| beyond[side] <= border[side]).then(|| start.dot(&self.normal))
    }

    /// Unit vector from the plane of the face to `point`, exactly along the normal, and their distance.
    pub(crate) fn normal_and_distance(&self, point: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let distance = (point - self.origin).dot(&self.normal);
        (self.normal * 1f64.copysign(distance), distance.abs())
    }
}

/// An edge of a mesh, without its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    length: f64,
}

impl Edge {
    /// The edge between two points that differ (m).
    #[must_use]
    pub fn new(from: Vector3<f64>, to: Vector3<f64>) -> Self {
        let size = (to - from).amax();
        let scaled = (to - from) / size;
        let length = scaled.norm();
        Self { origin: from, direction: scaled / length, length: length * size }
    }

    /// Unit vector from the first end to the second.
    #[must_use]
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// Interval until the sphere touches the edge inside its Voronoi region, or `None`.
    ///
    /// `outward` holds, for each face beside the edge, the unit vector in the face across the edge and away from it.
    #[inline]
    #[must_use]
    pub fn contact(&self, sweep: &Sweep, outward: &[Vector3<f64>]) -> Option<f64> {
        let (along, across) = self.split(sweep.position - self.origin);
        let (drift, velocity) = self.split(sweep.velocity);
        let interval = round_contact(&across, &velocity, sweep, || self.grazing_contact(sweep))?;
        let arm = across + velocity * interval;
        let place = along + drift * interval;

        let arrival = -arm.dot(&velocity) / sweep.radius;
        let grazing = if interval > 0.0 { (sweep.speed / arrival.max(0.0)).clamp(1.0, STEEPEST_GRAZING) } else { 1.0 };
        let border = BORDER * (along.abs() + across.amax() + place.abs() + sweep.radius) * grazing;
        let within = place >= -border && place <= self.length + border;
        let crease = CREASE * arm.norm();
        (within && outward.iter().all(|outward| arm.dot(outward) > crease)).then_some(interval)
    }

    /// The same for a sphere that all but misses the line of the edge, as origin and direction have it.
    ///
    /// The product with the direction turns what is across the edge by a right angle and makes it longer by |d|, which is 1 to
    /// rounding only, and so does |d| with the radius.
    #[cold]
    #[inline(never)]
    fn grazing_contact(&self, sweep: &Sweep) -> Option<f64> {
        let direction = WideVector::from(self.direction);
        let r = (WideVector::from(sweep.position) - self.origin.into()).cross(&direction);
        let v = WideVector::from(sweep.velocity).cross(&direction);
        let s = Wide::from(sweep.radius);
        grazing::interval(&r, &v, s * s * direction.dot(&direction), GRAZED)
    }

    /// A vector along and across the edge.
    #[inline]
    fn split(&self, vector: Vector3<f64>) -> (f64, Vector3<f64>) {
        let along = vector.dot(&self.direction);
        (along, vector - self.direction * along)
    }

    /// Vector from the line of the edge to `point`.
    pub(crate) fn arm(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.split(point - self.origin).1
    }

    /// The point of the edge that is nearest to `point`, ends included.
    pub(crate) fn nearest(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let along = (point - self.origin).dot(&self.direction);
        self.origin + self.direction * along.clamp(0.0, self.length)
    }

    /// Whether no sphere can touch an edge between faces with these outward vectors: they are coplanar.
    pub(crate) fn is_flat(outward: &[Vector3<f64>]) -> bool {
        // arm·(o1 + o2) is at most |arm| |o1 + o2|, so both parts cannot be above the crease.
        matches!(outward, [one, other] if (one + other).norm() <= 2.0 * CREASE)
    }
}

/// Interval until the sphere touches the corner at `point` (m) inside its Voronoi region, or `None`.
///
/// `spokes` holds the unit vectors from the corner along all edges that meet there.
#[inline]
#[must_use]
pub fn sphere_corner(sweep: &Sweep, point: &Vector3<f64>, spokes: &[Vector3<f64>]) -> Option<f64> {
    let start = sweep.position - point;
    let interval = round_contact(&start, &sweep.velocity, sweep, || grazing_corner(sweep, point))?;
    let arm = start + sweep.velocity * interval;
    let crease = -CREASE * arm.norm();
    spokes.iter().all(|spoke| arm.dot(spoke) < crease).then_some(interval)
}

/// The contact with a corner that the sphere all but misses.
#[cold]
#[inline(never)]
fn grazing_corner(sweep: &Sweep, point: &Vector3<f64>) -> Option<f64> {
    let r = WideVector::from(sweep.position) - (*point).into();
    let s = Wide::from(sweep.radius);
    grazing::interval(&r, &sweep.velocity.into(), s * s, GRAZED)
}

/// Interval until |r + v t| is one radius: for a corner, and across an edge.
///
/// The root of [`sphere_sphere`](super::sphere_sphere), here with the impact parameter m = |r × v| / |v|:
/// t = (|r| - s) (|r| + s) / (-r·v + |v| √((s - m) (s + m))). Overlapping and approaching touches at once. Where the root is small
/// against s, `in_double_length` tells.
#[inline]
fn round_contact(
    r: &Vector3<f64>,
    v: &Vector3<f64>,
    sweep: &Sweep,
    in_double_length: impl FnOnce() -> Option<f64>,
) -> Option<f64> {
    let approach = -r.dot(v);
    if approach > 0.0 {
        let s = sweep.radius;
        let distance = r.norm();
        if distance <= s {
            return (approach > sweep.slowest * distance).then_some(0.0);
        }
        let speed = v.norm();
        let miss = r.cross(v).norm() / speed;
        if miss <= s * (1.0 + 0.5 * GRAZING) {
            if miss > s * (1.0 - 0.5 * GRAZING) {
                return in_double_length();
            }
            return Some((distance - s) * (distance + s) / (approach + speed * ((s - miss) * (s + miss)).sqrt()));
        }
    }
    None
}

/// Time (s, epoch time) at which `flight` touches a single triangle with these corners (m), from either side, or `None`.
///
/// The triangle stands alone: all its edges are open. Where triangles make up a mesh, [`Mesh`](crate::Mesh) solves each common edge
/// and corner once and leaves out what no sphere can touch. A triangle without area has no face and is never touched.
///
/// A sphere that overlaps the triangle and approaches touches it at once (its local time); one that recedes never does.
///
/// ```
/// use impinge_events::{Flight, contact_time::sphere_triangle};
/// use nalgebra::Vector3;
///
/// let triangle = [Vector3::zeros(), Vector3::x(), Vector3::y()];
/// let over_face = Flight { position: Vector3::new(0.25, 0.25, 1.5), time: 2.0, velocity: -Vector3::z(), radius: 0.5 };
/// assert_eq!(sphere_triangle(&over_face, triangle), Some(3.0));
///
/// // 0.3 beyond the side along x, the sphere comes 0.1 lower before it touches the edge.
/// let over_edge = Flight { position: Vector3::new(0.25, -0.3, 1.5), ..over_face };
/// assert!((sphere_triangle(&over_edge, triangle).unwrap() - 3.1).abs() < 1e-15);
/// ```
#[must_use]
pub fn sphere_triangle(flight: &Flight, corners: [Vector3<f64>; 3]) -> Option<f64> {
    let face = Face::new(corners)?;
    let sweep = Sweep::new(flight, flight.velocity.amax());
    let edges = [0, 1, 2].map(|i| Edge::new(corners[i], corners[(i + 1) % 3]));
    let over_edges = (0..3).filter_map(|i| edges[i].contact(&sweep, &[face.outward[i]]));
    let over_corners =
        (0..3).filter_map(|i| sphere_corner(&sweep, &corners[i], &[edges[i].direction, -edges[(i + 2) % 3].direction]));
    face.contact(&sweep)
        .into_iter()
        .chain(over_edges)
        .chain(over_corners)
        .reduce(f64::min)
        .map(|first| sweep.time(first))
}
