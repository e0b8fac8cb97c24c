//! Files for ParaView: PolyData (`.vtp`) and ImageData (`.vti`) in XML, their arrays compressed by zlib and appended raw, and the
//! collection (`.pvd`) that gives each frame its time.
//!
//! Format: VTK file formats, "XML file formats", version 1.0 with 64-bit headers.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use nalgebra::Vector3;

use crate::grains::{Snapshot, kinetic_energy};
use crate::observe::measure::{FacetFields, Fields, Grid};
use crate::observe::{PlaneMap, SurfaceMap, SurfaceShape, Tally};
use crate::scene::Domain;

/// Bytes that are compressed at a time. VTK reads any size; large blocks compress better.
const BLOCK: usize = 1 << 20;

enum Values {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I64(Vec<i64>),
}

impl Values {
    fn vectors<'a>(vectors: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        Self::F64(vectors.flat_map(|vector| [vector.x, vector.y, vector.z]).collect())
    }

    /// Quantities to colour by: single precision is enough, and half the size.
    fn scalars(values: impl Iterator<Item = f64>) -> Self {
        Self::F32(values.map(|value| value as f32).collect())
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::F64(_) => "Float64",
            Self::F32(_) => "Float32",
            Self::I64(_) => "Int64",
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::F64(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::F32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::I64(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        }
    }
}

struct Array {
    name: &'static str,
    components: usize,
    values: Values,
}

impl Array {
    fn new(name: &'static str, components: usize, values: Values) -> Self {
        Self { name, components, values }
    }
}

/// Cells that each list their points.
#[derive(Default)]
struct Cells {
    points: Vec<i64>,
    ends: Vec<i64>,
}

impl Cells {
    fn add(&mut self, points: impl IntoIterator<Item = usize>) {
        self.points.extend(points.into_iter().map(|point| point as i64));
        self.ends.push(self.points.len() as i64);
    }

    fn arrays(self) -> [Array; 2] {
        [Array::new("connectivity", 1, Values::I64(self.points)), Array::new("offsets", 1, Values::I64(self.ends))]
    }
}

#[derive(Default)]
struct PolyData {
    points: Vec<Vector3<f64>>,
    vertices: Cells,
    polygons: Cells,
    of_points: Vec<Array>,
    of_cells: Vec<Array>,
}

impl PolyData {
    fn write(self, out: &mut dyn Write) -> io::Result<()> {
        let (vertices, polygons) = (self.vertices.ends.len(), self.polygons.ends.len());
        let points = Values::vectors(self.points.iter());
        let piece = format!(
            r#"NumberOfPoints="{}" NumberOfVerts="{vertices}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{polygons}""#,
            self.points.len()
        );
        let sections = [
            ("Points", vec![Array::new("points", 3, points)]),
            ("Verts", self.vertices.arrays().into()),
            ("Polys", self.polygons.arrays().into()),
            ("PointData", self.of_points),
            ("CellData", self.of_cells),
        ];
        write_data(out, "PolyData", "", &piece, sections)
    }
}

/// Writes one piece of a data set, its arrays appended.
fn write_data(
    out: &mut dyn Write,
    kind: &str,
    attributes: &str,
    piece: &str,
    sections: impl IntoIterator<Item = (&'static str, Vec<Array>)>,
) -> io::Result<()> {
    let mut appended = Vec::new();
    writeln!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64" compressor="vtkZLibDataCompressor">
<{kind}{attributes}>
<Piece {piece}>"#
    )?;
    for (section, arrays) in sections {
        writeln!(out, "<{section}>")?;
        for Array { name, components, values } in arrays {
            let (kind, offset) = (values.kind(), appended.len());
            writeln!(
                out,
                r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{offset}"/>"#
            )?;
            append(&mut appended, &values.bytes())?;
        }
        writeln!(out, "</{section}>")?;
    }
    write!(out, "</Piece>\n</{kind}>\n<AppendedData encoding=\"raw\">\n_")?;
    out.write_all(&appended)?;
    write!(out, "\n</AppendedData>\n</VTKFile>\n")
}

/// Writes values in the cells of a grid.
///
/// # Errors
/// Those of `out`.
pub fn write_fields(out: &mut dyn Write, fields: &Fields) -> io::Result<()> {
    let Grid { min, cells: [nx, ny, nz], .. } = fields.grid;
    let extent = format!("0 {nx} 0 {ny} 0 {nz}");
    let vector = |[x, y, z]: [f64; 3]| format!("{x:?} {y:?} {z:?}");
    let attributes =
        format!(r#" WholeExtent="{extent}" Origin="{}" Spacing="{}""#, vector(min), vector(fields.grid.spacing()));
    let arrays = fields
        .arrays
        .iter()
        .map(|(name, components, values)| Array::new(name, *components, Values::scalars(values.iter().copied())));
    write_data(out, "ImageData", &attributes, &format!(r#"Extent="{extent}""#), [("CellData", arrays.collect())])
}

/// Writes values on patches of the surface.
///
/// # Errors
/// Those of `out`.
pub fn write_facets(out: &mut dyn Write, facets: &FacetFields) -> io::Result<()> {
    let mut polygons = Cells::default();
    let mut first = 0;
    for corners in &facets.corners {
        polygons.add(first..first + corners.len());
        first += corners.len();
    }
    let arrays = facets
        .arrays
        .iter()
        .map(|(name, components, values)| Array::new(name, *components, Values::scalars(values.iter().copied())));
    let of_cells = arrays.collect();
    PolyData { points: facets.corners.concat(), polygons, of_cells, ..PolyData::default() }.write(out)
}

/// Appends an array: number of blocks, size of a block, size of the last if it is shorter, compressed sizes, blocks.
fn append(appended: &mut Vec<u8>, bytes: &[u8]) -> io::Result<()> {
    let blocks = bytes.chunks(BLOCK).map(|block| {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(block)?;
        encoder.finish()
    });
    let blocks = blocks.collect::<io::Result<Vec<_>>>()?;
    let header = [blocks.len(), BLOCK, bytes.len() % BLOCK].into_iter().chain(blocks.iter().map(Vec::len));
    appended.extend(header.flat_map(|size| (size as u64).to_le_bytes()));
    blocks.iter().for_each(|block| appended.extend(block));
    Ok(())
}

/// Writes the grains of a frame as points with radius, velocity, speed, spin, energy, hits and id.
///
/// # Errors
/// Those of `out`.
pub fn write_grains(out: &mut dyn Write, snapshot: &Snapshot<'_>) -> io::Result<()> {
    let Snapshot { flights, grains, .. } = snapshot;
    let mut vertices = Cells::default();
    (0..flights.len()).for_each(|point| vertices.add([point]));
    let vectors = |of: Vec<Vector3<f64>>| Values::scalars(of.into_iter().flat_map(<[f64; 3]>::from));
    let energies = flights.iter().zip(*grains).map(|(flight, grain)| kinetic_energy(flight, grain));
    let of_points = vec![
        Array::new("radius", 1, Values::scalars(flights.iter().map(|flight| flight.radius))),
        Array::new("velocity", 3, vectors(flights.iter().map(|flight| flight.velocity).collect())),
        Array::new("speed", 1, Values::scalars(flights.iter().map(|flight| flight.velocity.norm()))),
        Array::new("spin", 3, vectors(grains.iter().map(|grain| grain.spin).collect())),
        Array::new("energy", 1, Values::scalars(energies)),
        Array::new("hits", 1, Values::I64(grains.iter().map(|grain| i64::from(grain.hits)).collect())),
        Array::new("id", 1, Values::I64(grains.iter().map(|grain| grain.id.cast_signed()).collect())),
    ];
    let points = flights.iter().map(|flight| flight.position).collect();
    PolyData { points, vertices, of_points, ..PolyData::default() }.write(out)
}

/// Writes the collection of frames: their times (s) and file names.
///
/// # Errors
/// Those of `out`.
pub fn write_collection(out: &mut dyn Write, frames: &[(f64, String)]) -> io::Result<()> {
    writeln!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>"
    )?;
    for (time, file) in frames {
        writeln!(out, r#"<DataSet timestep="{time:?}" part="0" file="{file}"/>"#)?;
    }
    writeln!(out, "</Collection>\n</VTKFile>")
}

/// Writes the surface with what hit it: hits, energy, energy per area and normal impulse of each cell.
///
/// A triangle is a cell. A plane is shown where it was hit, in square cells; one that was not hit is one cell over the domain.
///
/// # Errors
/// Those of `out`.
pub fn write_surface(out: &mut dyn Write, shape: &SurfaceShape, map: &SurfaceMap, domain: &Domain) -> io::Result<()> {
    let mut facets = Facets::default();
    for plane in map.planes() {
        facets.add_plane(plane, domain);
    }
    for triangle in &shape.triangles {
        facets.add(triangle.element, triangle.corners, map.element(triangle.element));
    }
    facets.write(out)
}

#[derive(Default)]
struct Facets {
    points: Vec<Vector3<f64>>,
    polygons: Cells,
    elements: Vec<u32>,
    tallies: Vec<Tally>,
    areas: Vec<f64>,
}

impl Facets {
    fn add<const N: usize>(&mut self, element: u32, corners: [Vector3<f64>; N], tally: Tally) {
        let first = self.points.len();
        self.points.extend(corners);
        self.polygons.add(first..first + N);
        self.elements.push(element);
        self.tallies.push(tally);
        let fan =
            corners[1..].windows(2).map(|pair| (pair[0] - corners[0]).cross(&(pair[1] - corners[0])).norm() / 2.0);
        self.areas.push(fan.sum());
    }

    fn add_plane(&mut self, plane: &PlaneMap, domain: &Domain) {
        let Some((low, high)) = plane.extent() else {
            return self.add(plane.shape.element, patch_over(plane, domain), Tally::default());
        };
        // One empty row all round shows where the hits end. Empty cells that follow each other are drawn as one.
        for x in low[0] - 1..=high[0] + 1 {
            let row: Vec<i64> = (low[1] - 1..=high[1] + 1).collect();
            for run in row.chunk_by(|&y, &next| plane.cell([x, y]).hits == 0 && plane.cell([x, next]).hits == 0) {
                let (bottom, top) = (run[0] as f64, (run[0] + run.len() as i64) as f64);
                let (left, right) = (x as f64, (x + 1) as f64);
                let corners = [[left, bottom], [right, bottom], [right, top], [left, top]].map(|at| plane.place(at));
                self.add(plane.shape.element, corners, plane.cell([x, run[0]]));
            }
        }
    }

    fn write(self, out: &mut dyn Write) -> io::Result<()> {
        let of = |value: fn(&Tally) -> f64| Values::scalars(self.tallies.iter().map(value));
        let per_area = self.tallies.iter().zip(&self.areas).map(|(tally, area)| tally.energy / area);
        let of_cells = vec![
            Array::new("element", 1, Values::I64(self.elements.iter().map(|&element| i64::from(element)).collect())),
            Array::new("hits", 1, Values::I64(self.tallies.iter().map(|tally| tally.hits.cast_signed()).collect())),
            Array::new("energy", 1, of(|tally| tally.energy)),
            Array::new("energy_per_area", 1, Values::scalars(per_area)),
            Array::new("impulse_normal", 1, of(|tally| tally.impulse_normal)),
        ];
        PolyData { points: self.points, polygons: self.polygons, of_cells, ..PolyData::default() }.write(out)
    }
}

/// A square of a plane that is as large as the domain and in front of its middle.
fn patch_over(plane: &PlaneMap, domain: &Domain) -> [Vector3<f64>; 4] {
    let (min, max) = (Vector3::from(domain.min), Vector3::from(domain.max));
    let (middle, reach) = ((min + max) / 2.0, (max - min).norm() / 2.0);
    let normal = plane.shape.normal;
    let foot = middle - normal * normal.dot(&(middle - plane.shape.point));
    let [u, v] = plane.axes().map(|axis| axis * reach);
    [foot - u - v, foot + u - v, foot + u + v, foot - u + v]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;
    use crate::observe::{PlaneShape, TriangleShape};
    use crate::scene::Boundary;
    use crate::scheme::Observer;
    use flate2::read::ZlibDecoder;
    use std::io::Read;

    const DOMAIN: Domain = Domain { min: [-3.0, -3.0, -0.1], max: [3.0; 3], boundary: Boundary::Open, planar: false };

    /// Reads an array back as bytes: header attributes by text, data by offset.
    fn array(file: &[u8], name: &str) -> Vec<u8> {
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let start = file.windows(marker.len()).position(|window| window == marker).unwrap() + marker.len();
        let header = std::str::from_utf8(&file[..start]).unwrap();
        let line = header.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
        let offset: usize = line.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
        let data = &file[start + offset..];
        let word = |index: usize| u64::from_le_bytes(data[8 * index..8 * index + 8].try_into().unwrap()) as usize;
        let (blocks, size, last) = (word(0), word(1), word(2));
        let mut at = 8 * (3 + blocks);
        let mut bytes = Vec::new();
        for block in 0..blocks {
            let before = bytes.len();
            ZlibDecoder::new(&data[at..at + word(3 + block)]).read_to_end(&mut bytes).unwrap();
            let expected = if block + 1 == blocks && last > 0 { last } else { size };
            assert_eq!(bytes.len() - before, expected, "block {block} of {name}");
            at += word(3 + block);
        }
        bytes
    }

    fn doubles(bytes: &[u8]) -> Vec<f64> {
        bytes.chunks(8).map(|word| f64::from_le_bytes(word.try_into().unwrap())).collect()
    }

    fn integers(bytes: &[u8]) -> Vec<i64> {
        bytes.chunks(8).map(|word| i64::from_le_bytes(word.try_into().unwrap())).collect()
    }

    #[test]
    fn grains_read_back() {
        struct Check(usize);
        impl Observer for Check {
            fn frame(&mut self, number: u32, snapshot: &Snapshot<'_>) {
                let mut file = Vec::new();
                write_grains(&mut file, snapshot).unwrap();
                let places: Vec<f64> =
                    snapshot.flights.iter().flat_map(|flight| <[f64; 3]>::from(flight.position)).collect();
                assert_eq!(doubles(&array(&file, "points")), places, "frame {number}");
                let ids: Vec<i64> = snapshot.grains.iter().map(|grain| grain.id as i64).collect();
                assert_eq!(integers(&array(&file, "id")), ids);
                assert_eq!(array(&file, "velocity").len(), 12 * ids.len());
                self.0 += 1;
            }
        }
        let mut check = Check(0);
        FakeJet { frames: 4, ..FakeJet::default() }.run(&mut check);
        assert_eq!(check.0, 4);
    }

    #[test]
    fn arrays_longer_than_a_block_and_empty_ones_read_back() {
        for length in [0, 1, BLOCK / 8, BLOCK / 8 + 1, 3 * BLOCK / 8] {
            let points: Vec<_> = (0..length).map(|index| Vector3::repeat(index as f64)).collect();
            let mut file = Vec::new();
            PolyData { points, ..PolyData::default() }.write(&mut file).unwrap();
            let back = doubles(&array(&file, "points"));
            assert_eq!(back.len(), 3 * length);
            assert!(back.iter().enumerate().all(|(index, &value)| value == (index / 3) as f64));
        }
    }

    #[test]
    fn the_surface_carries_every_hit_once() {
        let corners = [Vector3::zeros(), Vector3::x() * 2.0, Vector3::y()];
        let shape = SurfaceShape {
            planes: vec![
                PlaneShape { element: 0, point: Vector3::zeros(), normal: Vector3::z() },
                PlaneShape { element: 1, point: Vector3::repeat(-9.0), normal: Vector3::x() },
            ],
            triangles: vec![TriangleShape { element: 2, corners }],
        };
        let mut watched = (SurfaceMap::new(&shape, 0.02), crate::observe::Ledger::default());
        FakeJet::default().run(&mut watched);
        let (mut map, ledger) = watched;
        map.surface_hit(&crate::scheme::SurfaceHit { element: 2, energy_normal: 3.0, ..FakeJet::hit(1) });
        let mut file = Vec::new();
        write_surface(&mut file, &shape, &map, &DOMAIN).unwrap();
        let (elements, hits) = (integers(&array(&file, "element")), integers(&array(&file, "hits")));
        let on = |element: i64| {
            hits.iter().zip(&elements).filter(|pair| *pair.1 == element).map(|pair| *pair.0).sum::<i64>()
        };
        assert_eq!([on(0), on(1), on(2)], [ledger.counts().grain_surface as i64, 0, 1]);
        let per_area = array(&file, "energy_per_area");
        assert_eq!(f32::from_le_bytes(per_area[per_area.len() - 4..].try_into().unwrap()), 3.0);
    }

    #[test]
    fn the_collection_gives_each_frame_its_time() {
        let mut file = Vec::new();
        let frames = [(0.0, "frames/grains_0000.vtp".to_owned()), (0.1 + 0.2, "frames/grains_0001.vtp".to_owned())];
        write_collection(&mut file, &frames).unwrap();
        let text = String::from_utf8(file).unwrap();
        assert!(text.contains(r#"timestep="0.30000000000000004" part="0" file="frames/grains_0001.vtp""#));
        assert_eq!(text.matches("<DataSet").count(), 2);
        assert!(text.trim_end().ends_with("</VTKFile>"));
    }
}
