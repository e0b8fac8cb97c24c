//! Triangles that hang together: each face, edge and corner once, and only those that a sphere can touch.

use nalgebra::Vector3;

use crate::contact_time::{Edge, Face, Sweep, sphere_corner};
use crate::prefetch::prefetch;
use crate::table::{Table, table};

/// A two-sided triangle mesh, open or closed.
///
/// Every edge and every corner belongs to the lowest-numbered of the triangles that share it and is solved with that triangle
/// only. Edges between coplanar triangles, and corners at which only such edges meet, are left out: no sphere can touch them
/// without touching a face. So a flat mesh costs no more than its faces and has no internal edges to bump against.
///
/// ```
/// use impinge_events::{Flight, Mesh, contact_time::Sweep};
/// use nalgebra::Vector3;
///
/// // A unit square of two triangles, and a ball that comes down exactly on their common edge.
/// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
/// let mesh = Mesh::new(square.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
/// let ball = Flight { position: Vector3::new(0.5, 0.5, 2.0), time: 0.0, velocity: -Vector3::z(), radius: 0.5 };
/// let sweep = Sweep::new(&ball, 1.0);
/// assert_eq!(mesh.contact(0, &sweep), Some(1.5));
/// ```
#[derive(Clone, Debug)]
pub struct Mesh {
    vertices: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    faces: Table<Face>,
    /// Which sides of each triangle lie within a flat piece of the mesh: bits 0 to 2.
    flat: Vec<u8>,
    /// Where the edges and corners of each triangle begin, and, one past the last triangle, where they end.
    owned: Vec<Owned>,
    edges: Vec<Bordered<Edge>>,
    corners: Vec<Bordered<Vector3<f64>>>,
    /// What borders the Voronoi regions: outward vectors of edges, spokes of corners.
    directions: Vec<Vector3<f64>>,
    open_edges: usize,
    crowded_edges: usize,
}

#[derive(Clone, Copy, Debug, Default)]
struct Owned {
    first_edge: u32,
    first_corner: u32,
}

/// A feature and the range of its directions.
#[derive(Clone, Copy, Debug)]
struct Bordered<T> {
    feature: T,
    from: u32,
    to: u32,
}

/// Which part of a triangle is touched.
#[derive(Clone, Copy, Debug)]
enum Part {
    Face,
    Edge(usize),
    Corner(usize),
}

/// This triangle has no area, has a corner that is not finite, or names a vertex that is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadTriangle(pub usize);

impl std::fmt::Display for BadTriangle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "triangle {} has no area, a corner that is not finite or a vertex that is not there", self.0)
    }
}

impl std::error::Error for BadTriangle {}

/// One side of one triangle: the vertices that it joins, the lower first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    vertices: [u32; 2],
    triangle: u32,
    number: u32,
}

/// A feature that is further from the sphere than this (in radii) is not touched now but later.
///
/// Far more than rounding leaves of the gap of a sphere that has been advanced to its contact. Two features that are both as
/// near as this have normals that differ by less than 1e-4, so it does no harm to take the one for the other.
const NOW: f64 = 1e-9;

/// Where no contact is predicted any more, the face counts this far (in radii) beyond its border.
///
/// A grazing flight moves on by that much while its normal distance is rounded. Consequence: the normal of a contact with an
/// edge is taken for that of the face where the two are within 1e-5 of each other. A side that lies within a flat piece of the mesh is no border: the
/// face goes on beyond it.
const BESIDE: f64 = 1e-5;

/// Direction and length of a vector that is not zero.
fn unit(arm: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let length = arm.norm();
    (length > 0.0).then(|| (arm / length, length))
}

impl Mesh {
    /// The mesh of `triangles`, given by the numbers of their `vertices` (m).
    ///
    /// Triangles hang together where they name the same vertices; equal points that are to be one vertex must be merged before.
    ///
    /// # Errors
    /// The first triangle without a face.
    pub fn new(vertices: Vec<Vector3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, BadTriangle> {
        let face = |(number, corners): (usize, &[u32; 3])| {
            let [a, b, c] = corners.map(|vertex| vertices.get(vertex as usize).copied());
            a.zip(b).zip(c).and_then(|((a, b), c)| Face::new([a, b, c])).ok_or(BadTriangle(number))
        };
        let faces = table(triangles.iter().enumerate().map(face).collect::<Result<Vec<_>, _>>()?);
        let owned = vec![Owned::default(); triangles.len() + 1];
        let mut mesh = Self {
            flat: vec![0; triangles.len()],
            vertices,
            triangles,
            faces,
            owned,
            edges: Vec::new(),
            corners: Vec::new(),
            directions: Vec::new(),
            open_edges: 0,
            crowded_edges: 0,
        };
        mesh.join();
        Ok(mesh)
    }

    /// Finds the edges and corners that a sphere can touch, and who owns them.
    fn join(&mut self) {
        let sides = self.sides();
        let mut edges = Vec::new();
        let mut spokes = Vec::new();
        let mut touchable = vec![false; self.vertices.len()];
        for shared in sides.chunk_by(|a, b| a.vertices == b.vertices) {
            self.open_edges += usize::from(shared.len() == 1);
            self.crowded_edges += usize::from(shared.len() > 2);
            let [from, to] = shared[0].vertices;
            let edge = Edge::new(self.vertices[from as usize], self.vertices[to as usize]);
            spokes.push((from, edge.direction()));
            spokes.push((to, -edge.direction()));
            let outward: Vec<_> =
                shared.iter().map(|side| self.faces[side.triangle as usize].outward()[side.number as usize]).collect();
            if Edge::is_flat(&outward) {
                shared.iter().for_each(|side| self.flat[side.triangle as usize] |= 1 << side.number);
            } else {
                touchable[from as usize] = true;
                touchable[to as usize] = true;
                edges.push((shared[0].triangle, self.bordered(edge, outward)));
            }
        }
        let mut owner = vec![u32::MAX; self.vertices.len()];
        for (number, corners) in self.triangles.iter().enumerate().rev() {
            corners.iter().for_each(|&vertex| owner[vertex as usize] = number as u32);
        }
        spokes.sort_by_key(|&(vertex, _)| vertex);
        let mut corners = Vec::new();
        for star in spokes.chunk_by(|a, b| a.0 == b.0) {
            let vertex = star[0].0 as usize;
            if touchable[vertex] {
                let point = self.vertices[vertex];
                corners.push((owner[vertex], self.bordered(point, star.iter().map(|&(_, direction)| direction))));
            }
        }
        edges.sort_by_key(|&(owner, _)| owner);
        corners.sort_by_key(|&(owner, _)| owner);
        for (number, owned) in self.owned.iter_mut().enumerate() {
            owned.first_edge = edges.partition_point(|&(owner, _)| (owner as usize) < number) as u32;
            owned.first_corner = corners.partition_point(|&(owner, _)| (owner as usize) < number) as u32;
        }
        self.edges = edges.into_iter().map(|(_, edge)| edge).collect();
        self.corners = corners.into_iter().map(|(_, corner)| corner).collect();
    }

    /// All sides, those that are one edge behind each other, the lowest triangle first.
    fn sides(&self) -> Vec<Side> {
        let mut sides: Vec<_> = (0u32..)
            .zip(&self.triangles)
            .flat_map(|(triangle, corners)| {
                (0..3).map(move |number| {
                    let (a, b) = (corners[number as usize], corners[(number as usize + 1) % 3]);
                    Side { vertices: [a.min(b), a.max(b)], triangle, number }
                })
            })
            .collect();
        sides.sort_unstable();
        sides
    }

    fn bordered<T>(&mut self, feature: T, directions: impl IntoIterator<Item = Vector3<f64>>) -> Bordered<T> {
        let from = self.directions.len() as u32;
        self.directions.extend(directions);
        Bordered { feature, from, to: self.directions.len() as u32 }
    }

    /// How many triangles there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The vertices, m.
    #[must_use]
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// The corners of triangle `number`, m.
    #[must_use]
    pub fn triangle(&self, number: usize) -> [Vector3<f64>; 3] {
        self.triangles[number].map(|vertex| self.vertices[vertex as usize])
    }

    /// Whether every edge has exactly two triangles.
    #[must_use]
    pub fn is_watertight(&self) -> bool {
        self.open_edges == 0 && self.crowded_edges == 0
    }

    /// How many edges have one triangle only.
    #[must_use]
    pub fn open_edges(&self) -> usize {
        self.open_edges
    }

    /// How many edges have more than two triangles.
    #[must_use]
    pub fn crowded_edges(&self) -> usize {
        self.crowded_edges
    }

    /// Asks the memory for triangle `number`: a hint, before [`contact`](Self::contact) needs it.
    #[inline]
    pub fn fetch(&self, number: usize) {
        prefetch(&self.faces, number);
        prefetch(&self.owned, number);
    }

    /// Interval until the sphere touches triangle `number`: its face, or an edge or corner that belongs to it.
    ///
    /// The earliest over all triangles is when the sphere touches the mesh.
    #[inline]
    #[must_use]
    pub fn contact(&self, number: usize, sweep: &Sweep) -> Option<f64> {
        self.first(number, sweep).map(|(interval, _)| interval)
    }

    #[inline]
    fn first(&self, number: usize, sweep: &Sweep) -> Option<(f64, Part)> {
        let mut first = self.faces[number].contact(sweep).map(|interval| (interval, Part::Face));
        let mut offer = |contact: Option<f64>, part: Part| {
            if let Some(interval) = contact
                && first.is_none_or(|(best, _)| interval < best)
            {
                first = Some((interval, part));
            }
        };
        let (own, next) = (self.owned[number], self.owned[number + 1]);
        for i in own.first_edge as usize..next.first_edge as usize {
            let edge = &self.edges[i];
            offer(edge.feature.contact(sweep, self.directions_of(edge)), Part::Edge(i));
        }
        for i in own.first_corner as usize..next.first_corner as usize {
            let corner = &self.corners[i];
            offer(sphere_corner(sweep, &corner.feature, self.directions_of(corner)), Part::Corner(i));
        }
        first
    }

    #[inline]
    fn directions_of<T>(&self, bordered: &Bordered<T>) -> &[Vector3<f64>] {
        &self.directions[bordered.from as usize..bordered.to as usize]
    }

    /// The contact normal (from triangle `number` to the centre) and the gap (m, negative for an overlap) of a sphere that has
    /// been advanced to its contact with this triangle.
    ///
    /// Where a contact is predicted for this very moment, the normal is that of the feature that it is predicted with: for a
    /// face exactly its normal. So whoever resolves a contact sees the approach that the prediction saw, and no contact is
    /// predicted for ever because it cannot be resolved. Otherwise (a grazing contact that rounding has just lost) it comes from
    /// the closest point of the triangle.
    #[must_use]
    pub fn normal_and_gap(&self, number: usize, sweep: &Sweep) -> (Vector3<f64>, f64) {
        let centre = &sweep.position;
        let on_face = || self.faces[number].normal_and_distance(centre);
        let predicted = self.first(number, sweep).map(|(_, part)| match part {
            Part::Face => on_face(),
            Part::Edge(i) => unit(self.edges[i].feature.arm(centre)).unwrap_or_else(on_face),
            Part::Corner(i) => unit(centre - self.corners[i].feature).unwrap_or_else(on_face),
        });
        let (normal, distance) =
            predicted.filter(|&(_, distance)| distance <= (1.0 + NOW) * sweep.radius).unwrap_or_else(|| {
                let is_flat = |side: usize| self.flat[number] >> side & 1 != 0;
                let border = [0, 1, 2].map(|side| if is_flat(side) { f64::INFINITY } else { BESIDE * sweep.radius });
                let over_face = self.faces[number].distance_over(centre, border).is_some();
                let nearest = || unit(centre - self.nearest(number, centre)).unwrap_or_else(on_face);
                if over_face { on_face() } else { nearest() }
            });
        (normal, distance - sweep.radius)
    }

    /// The point of triangle `number` that is nearest to `point`, m.
    #[must_use]
    pub fn nearest(&self, number: usize, point: &Vector3<f64>) -> Vector3<f64> {
        let face = &self.faces[number];
        if let Some(distance) = face.distance_over(point, [0.0; 3]) {
            return point - face.normal() * distance;
        }
        let corners = self.triangle(number);
        let on_edge = |i: usize| Edge::new(corners[i], corners[(i + 1) % 3]).nearest(point);
        let nearer = |a: Vector3<f64>, b: Vector3<f64>| {
            if (point - b).norm_squared() < (point - a).norm_squared() { b } else { a }
        };
        nearer(nearer(on_edge(0), on_edge(1)), on_edge(2))
    }
}
