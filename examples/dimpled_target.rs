//! Writes a target with dimples as binary STL: a closed plate, its top at z = 0, 8 x 8 spherical dimples in it.
//!
//! `cargo run --example dimpled_target` makes `examples/dimpled_target.stl`; another path may be given.

use std::f64::consts::PI;
use std::fs::File;
use std::io::BufWriter;

use stl_io::{Normal, Triangle, Vertex};

/// Side of the plate, m.
const SIDE: f64 = 0.6;
/// Thickness of the plate, m.
const THICKNESS: f64 = 0.03;
/// Dimples along each side.
const DIMPLES: usize = 8;
/// Radius of the rim of a dimple and its depth, m: grains have a radius of 0.01 m.
const RIM: f64 = 0.025;
const DEPTH: f64 = 0.01;
/// Rings of triangles in a dimple, and corners of its rim.
const RINGS: usize = 3;
const CORNERS: usize = 16;

type Point = [f64; 3];

fn main() -> std::io::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "examples/dimpled_target.stl".into());
    let mut triangles = Vec::new();
    for i in 0..DIMPLES {
        for j in 0..DIMPLES {
            cell(&mut triangles, i, j);
        }
    }
    sides_and_bottom(&mut triangles);
    let triangles: Vec<_> = triangles.iter().map(facet).collect();
    stl_io::write_stl(&mut BufWriter::new(File::create(path)?), triangles.iter())
}

/// A place on the plate, counted in cells from its corner, so that neighbouring cells agree on it bit for bit.
fn place(x: f64, y: f64, z: f64) -> Point {
    let side = SIDE / DIMPLES as f64;
    [x * side - SIDE / 2.0, y * side - SIDE / 2.0, z]
}

/// Direction of corner `k` of a rim, as the point of the square of half side 1 that lies there.
fn on_square(k: usize) -> [f64; 2] {
    let along = (PI / 8.0).tan();
    // Once round from (1, 0), in steps of 22.5 degrees.
    let around = [0.0, along, 1.0, 1.0, 1.0, 1.0, 1.0, along, 0.0, -along, -1.0, -1.0, -1.0, -1.0, -1.0, -along];
    [around[(k + 4) % CORNERS], around[k % CORNERS]]
}

/// One dimple in its square of the top.
fn cell(triangles: &mut Vec<[Point; 3]>, i: usize, j: usize) {
    let (x, y) = (i as f64 + 0.5, j as f64 + 0.5);
    let sphere = (RIM * RIM + DEPTH * DEPTH) / (2.0 * DEPTH);
    let ring = |number: usize, k: usize| {
        let radius = RIM * number as f64 / RINGS as f64;
        let depth = if number == RINGS { 0.0 } else { (sphere * sphere - radius * radius).sqrt() - (sphere - DEPTH) };
        let [dx, dy] = on_square(k);
        let reach = radius / (SIDE / DIMPLES as f64) / dx.hypot(dy);
        place(x + dx * reach, y + dy * reach, -depth)
    };
    let square = |k: usize| {
        let [dx, dy] = on_square(k);
        place(x + 0.5 * dx, y + 0.5 * dy, 0.0)
    };
    for k in 0..CORNERS {
        triangles.push([place(x, y, -DEPTH), ring(1, k), ring(1, k + 1)]);
        for number in 1..RINGS {
            strip(triangles, [ring(number, k), ring(number + 1, k), ring(number + 1, k + 1), ring(number, k + 1)]);
        }
        strip(triangles, [ring(RINGS, k), square(k), square(k + 1), ring(RINGS, k + 1)]);
    }
}

/// Walls under the rim of the plate, and the bottom as a fan.
fn sides_and_bottom(triangles: &mut Vec<[Point; 3]>) {
    let low = |[x, y, _]: Point| [x, y, -THICKNESS];
    let far = DIMPLES as f64;
    for cell in 0..DIMPLES {
        let middle = cell as f64 + 0.5;
        // The five points of a cell's side, in the order in which they go round.
        let steps: Vec<_> =
            [14, 15, 0, 1, 2].map(|k| on_square(k)[1]).into_iter().map(|step| middle + 0.5 * step).collect();
        for pair in steps.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let around = [
                [place(from, 0.0, 0.0), place(to, 0.0, 0.0)],
                [place(far, from, 0.0), place(far, to, 0.0)],
                [place(to, far, 0.0), place(from, far, 0.0)],
                [place(0.0, to, 0.0), place(0.0, from, 0.0)],
            ];
            for [from, to] in around {
                strip(triangles, [low(from), low(to), to, from]);
                triangles.push([[0.0, 0.0, -THICKNESS], low(to), low(from)]);
            }
        }
    }
}

/// Two triangles for four points that go round anticlockwise seen from outside.
fn strip(triangles: &mut Vec<[Point; 3]>, [a, b, c, d]: [Point; 4]) {
    triangles.push([a, b, c]);
    triangles.push([a, c, d]);
}

fn facet(&[a, b, c]: &[Point; 3]) -> Triangle {
    let [u, v] = [b, c].map(|end| [end[0] - a[0], end[1] - a[1], end[2] - a[2]]);
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let vertices = [a, b, c].map(|corner| Vertex::new(corner.map(|x| x as f32)));
    Triangle { normal: Normal::new(normal.map(|x| (x / length) as f32)), vertices }
}
