//! Triangle meshes from files: reading, repair, and a report of what was found.

use std::fmt;
use std::path::Path;

use impinge_events::Mesh;
use impinge_events::contact_time::Face;
use nalgebra::Vector3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::Triangle;
use crate::scene::Invalid;

/// Vertices nearer to each other than this part of the diagonal of the mesh are one vertex.
///
/// STL keeps seven digits, and programs that write it round each corner of each triangle for itself. Consequence: details finer
/// than this are lost; a cut along which corners differ by more stays open and is reported.
const WELD: f64 = 1e-7;

/// What an import found and mended.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Triangles that are left.
    pub triangles: usize,
    /// Vertices that are left.
    pub vertices: usize,
    /// Area of all triangles (one side), m².
    pub area: f64,
    /// Lower corner of the box about the mesh, m.
    pub min: Vector3<f64>,
    /// Upper corner of the box about the mesh, m.
    pub max: Vector3<f64>,
    /// Edges with one triangle only.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub crowded_edges: usize,
    /// Triangles without area that were removed.
    pub degenerate: usize,
    /// Triangles with the corners of another one that were removed.
    pub duplicates: usize,
    /// Vertices that differed from a neighbour by rounding and were merged with it.
    pub welded: usize,
}

impl Report {
    /// Whether every edge has exactly two triangles.
    #[must_use]
    pub fn is_watertight(&self) -> bool {
        self.open_edges == 0 && self.crowded_edges == 0
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangles, vertices, area, min, max, .. } = self;
        write!(f, "{triangles} triangles, {vertices} vertices, area {area:.6} m², ")?;
        write!(
            f,
            "x {:.6} to {:.6} m, y {:.6} to {:.6} m, z {:.6} to {:.6} m, ",
            min.x, max.x, min.y, max.y, min.z, max.z
        )?;
        match (self.open_edges, self.crowded_edges) {
            (0, 0) => write!(f, "watertight")?,
            (open, 0) => write!(f, "not watertight ({open} open edges)")?,
            (open, crowded) => {
                write!(f, "not watertight ({open} open edges, {crowded} edges with more than two triangles)")?;
            }
        }
        let mended =
            [(self.degenerate, "degenerate triangles removed"), (self.duplicates, "duplicate triangles removed")];
        for (count, what) in
            mended.into_iter().chain([(self.welded, "vertices welded")]).filter(|&(count, _)| count > 0)
        {
            write!(f, "; {count} {what}")?;
        }
        Ok(())
    }
}

/// Reads the triangles of an STL (ASCII or binary) or OBJ file, in the units of the file.
///
/// # Errors
/// A file that cannot be read, is empty, truncated, or holds anything but triangles with finite corners; under the key `key`.
pub(super) fn read(path: &Path, key: &str) -> Result<Vec<Triangle>, Invalid> {
    let bad = |what: String, remedy: &str| Invalid::new(key, format!("{}: {what}", path.display()), remedy);
    let bytes = std::fs::read(path).map_err(|error| {
        bad(format!("cannot be read: {error}"), "give the path of an STL or OBJ file, relative to the scene file")
    })?;
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(bad("the file is empty".into(), "export the mesh again"));
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let triangles = match extension.to_str() {
        Some("stl") => read_stl(&bytes),
        Some("obj") => read_obj(&bytes),
        _ => return Err(bad("neither .stl nor .obj".into(), "export the mesh as STL or OBJ")),
    };
    let triangles = triangles.map_err(|what| bad(what, "export the mesh again, as triangles"))?;
    if triangles.is_empty() {
        return Err(bad("no triangles".into(), "export a mesh of triangles"));
    }
    match triangles.iter().position(|corners| corners.iter().any(|corner| !corner.iter().all(|x| x.is_finite()))) {
        Some(number) => Err(bad(
            format!("triangle {number} has a corner that is not finite"),
            "repair the mesh, then export it again",
        )),
        None => Ok(triangles),
    }
}

fn read_stl(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    // Binary files may begin with the word `solid` too: their length tells them apart.
    let bytes = match binary_stl_size(bytes) {
        Some(size) if size == bytes.len() as u64 => [&[0; 80], &bytes[80..]].concat(),
        _ if bytes.starts_with(b"solid") => one_solid(bytes)?,
        Some(size) => {
            return Err(format!("truncated or damaged: its header promises {size} bytes, it has {}", bytes.len()));
        }
        None => return Err(format!("truncated: {} bytes are not even a header", bytes.len())),
    };
    let mut file = std::io::Cursor::new(bytes);
    let reader = stl_io::create_stl_reader(&mut file).map_err(|error| error.to_string())?;
    reader
        .map(|triangle| {
            let corners = triangle.map_err(|error| error.to_string())?.vertices;
            Ok(corners.map(|corner| Vector3::from(corner.0).cast()))
        })
        .collect()
}

/// How many bytes a binary STL file should have: a header of 80, a count, and 50 for each triangle.
fn binary_stl_size(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..84)?.try_into().ok()?;
    Some(84 + 50 * u64::from(u32::from_le_bytes(count)))
}

/// Makes one solid with a plain name of an ASCII file with one or several; the reader knows no more.
fn one_solid(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let text = String::from_utf8_lossy(bytes);
    for (number, line) in text.lines().map(str::trim).enumerate().filter(|(_, line)| line.starts_with("vertex")) {
        let numbers = line.split_whitespace().skip(1).map(str::parse::<f32>);
        if numbers.filter(|number| number.as_ref().is_ok_and(|x| x.is_finite())).count() != 3 {
            return Err(format!("line {}: `{line}` is not a corner of three finite numbers", number + 1));
        }
    }
    let lines: Vec<_> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    if !lines.last().is_some_and(|line| line.starts_with("endsolid")) {
        return Err("truncated: the last line is not `endsolid`".into());
    }
    let facets = lines.into_iter().filter(|line| !line.starts_with("solid") && !line.starts_with("endsolid"));
    Ok(std::iter::once("solid mesh").chain(facets).chain(["endsolid"]).collect::<Vec<_>>().join("\n").into_bytes())
}

fn read_obj(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let options = tobj::LoadOptions::default();
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) =
        tobj::load_obj_buf(&mut &*bytes, &options, no_materials).map_err(|error| format!("damaged: {error}"))?;
    let mut triangles = Vec::new();
    for tobj::Model { mesh, name } in models {
        if let Some(corners) = mesh.face_arities.iter().find(|&&corners| corners != 3) {
            return Err(format!("object `{name}` has a face with {corners} corners, not a triangle"));
        }
        let corner = |&vertex: &u32| Vector3::from_column_slice(&mesh.positions[3 * vertex as usize..][..3]);
        triangles
            .extend(mesh.indices.chunks_exact(3).map(|face| [corner(&face[0]), corner(&face[1]), corner(&face[2])]));
    }
    Ok(triangles)
}

/// Makes a mesh of loose triangles: welds vertices, removes degenerate and duplicate triangles, and says so.
///
/// # Errors
/// When nothing is left, or there are more triangles than can be numbered; under the key `key`.
pub(super) fn mend(triangles: &[Triangle], key: &str) -> Result<(Mesh, Report), Invalid> {
    let (vertices, corners, welded) = weld(triangles);
    let mut degenerate = 0;
    let mut duplicates = 0;
    let mut seen = FxHashSet::default();
    let mut kept = Vec::with_capacity(corners.len());
    for triangle in corners {
        let mut sorted = triangle;
        sorted.sort_unstable();
        let has_face = Face::new(triangle.map(|vertex| vertices[vertex as usize])).is_some();
        if !has_face {
            degenerate += 1;
        } else if !seen.insert(sorted) {
            duplicates += 1;
        } else {
            kept.push(triangle);
        }
    }
    if kept.is_empty() {
        return Err(Invalid::new(key, "no triangle has an area", "repair the mesh, then export it again"));
    }
    let mesh = Mesh::new(vertices, kept)
        .map_err(|bad| Invalid::new(key, bad.to_string(), "repair the mesh, then export it again"))?;
    let area = |number: usize| {
        let [a, b, c] = mesh.triangle(number);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let (min, max) = bounds(mesh.vertices());
    let report = Report {
        triangles: mesh.len(),
        vertices: mesh.vertices().len(),
        area: (0..mesh.len()).map(area).sum(),
        min,
        max,
        open_edges: mesh.open_edges(),
        crowded_edges: mesh.crowded_edges(),
        degenerate,
        duplicates,
        welded,
    };
    Ok((mesh, report))
}

fn bounds<'a>(points: impl IntoIterator<Item = &'a Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let nothing = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.into_iter().fold(nothing, |(min, max), point| (min.inf(point), max.sup(point)))
}

/// Numbers the vertices of loose triangles; equal and nearly equal ones get one number. Also says how many were merged though
/// they differed.
fn weld(triangles: &[Triangle]) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>, usize) {
    let (min, max) = bounds(triangles.iter().flatten());
    let reach = WELD * (max - min).norm();
    let mut welder = Welder { origin: min, reach, ..Welder::default() };
    let corners = triangles.iter().map(|corners| corners.map(|corner| welder.number(corner))).collect();
    (welder.vertices, corners, welder.welded)
}

#[derive(Default)]
struct Welder {
    vertices: Vec<Vector3<f64>>,
    known: FxHashMap<[u64; 3], u32>,
    /// Vertices by the cell of a coarse grid they lie in.
    cells: FxHashMap<[i64; 3], Vec<u32>>,
    origin: Vector3<f64>,
    reach: f64,
    welded: usize,
}

impl Welder {
    /// Side of a cell in units of `reach`: most vertices then look into one cell only.
    const CELL: f64 = 16.0;

    fn number(&mut self, point: Vector3<f64>) -> u32 {
        // Adding zero makes one zero of two.
        let bits = point.map(|x| (x + 0.0).to_bits()).into();
        if let Some(&number) = self.known.get(&bits) {
            return number;
        }
        let number = self.neighbour(&point).inspect(|_| self.welded += 1).unwrap_or_else(|| {
            let number = self.vertices.len() as u32;
            self.vertices.push(point);
            self.cells.entry(self.cell(&point)).or_default().push(number);
            number
        });
        self.known.insert(bits, number);
        number
    }

    fn cell(&self, point: &Vector3<f64>) -> [i64; 3] {
        ((point - self.origin) / (Self::CELL * self.reach)).map(|x| x.floor() as i64).into()
    }

    fn neighbour(&self, point: &Vector3<f64>) -> Option<u32> {
        let low = self.cell(&point.add_scalar(-self.reach));
        let high = self.cell(&point.add_scalar(self.reach));
        let cells = (low[0]..=high[0])
            .flat_map(|i| (low[1]..=high[1]).flat_map(move |j| (low[2]..=high[2]).map(move |k| [i, j, k])));
        cells
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .copied()
            .find(|&number| (self.vertices[number as usize] - point).norm() <= self.reach)
    }
}
