//! Meshes: a flat one is a plane, internal edges are not felt, and nothing gets through.

use impinge_events::contact_time::{Sweep, sphere_plane};
use impinge_events::{Flight, Mesh};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

/// A square of side 2 about the origin, in `n` by `n` cells of two triangles, its inner vertices shifted at random; with the
/// shape `place` gives it.
fn sheet(n: usize, seed: u64, place: impl Fn(f64, f64) -> Vector3<f64>) -> Mesh {
    let mut state = seed;
    let mut shift = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as f64 / (1u64 << 31) as f64 - 0.5) * 0.4
    };
    let mut vertices = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            let inner = i > 0 && i < n && j > 0 && j < n && seed > 0;
            let [dx, dy] = if inner { [shift(), shift()] } else { [0.0, 0.0] };
            vertices.push(place((i as f64 + dx) * 2.0 / n as f64 - 1.0, (j as f64 + dy) * 2.0 / n as f64 - 1.0));
        }
    }
    let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
    let cell =
        |i: usize, j: usize| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles = (0..n).flat_map(|i| (0..n).flat_map(move |j| cell(i, j))).collect();
    Mesh::new(vertices, triangles).expect("no triangle is degenerate")
}

/// First contact with a mesh at rest: time and triangle.
fn first(mesh: &Mesh, flight: &Flight) -> Option<(f64, usize)> {
    let sweep = Sweep::new(flight, flight.velocity.amax());
    let contacts = (0..mesh.len()).filter_map(|i| mesh.contact(i, &sweep).map(|interval| (sweep.time(interval), i)));
    contacts.reduce(|a, b| if b.0 < a.0 { b } else { a })
}

/// Points of a flat sheet: any, on an edge, at a vertex.
fn points(mesh: &Mesh, weights: [f64; 2]) -> Vec<Vector3<f64>> {
    let of = |i: usize| {
        let [a, b, c] = mesh.triangle(i);
        [a + (b - a) * weights[0] * 0.5 + (c - a) * weights[1] * 0.5, a + (b - a) * weights[0], b + (c - b) * 0.5, a]
    };
    (0..mesh.len()).flat_map(of).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_flat_mesh_is_a_plane(
        seed in 1..1000u64, weights in [0.0..1.0, 0.0..1.0f64], direction in [-3.0..3.0, -3.0..3.0f64], steep in -6.0..1.0f64,
        size in -2.0..1.0f64, side in prop::bool::ANY,
    ) {
        let mesh = sheet(5, seed, |x, y| Vector3::new(x, y, 0.0));
        let normal = if side { Vector3::z() } else { -Vector3::z() };
        let radius = 10f64.powf(size);
        for point in points(&mesh, weights) {
            let velocity = Vector3::new(direction[0], direction[1], 0.0) - normal * 10f64.powf(steep);
            let flight = Flight { position: point + normal * radius - velocity * 2.0, time: 0.0, velocity, radius };
            let exact = sphere_plane(&flight, Vector3::zeros(), normal).expect("it approaches");
            let (time, triangle) = first(&mesh, &flight).expect("the mesh is hit");
            // At the rim, and only there, rounding may put the foot outside: the rim is round.
            let rim = point.x.abs() == 1.0 || point.y.abs() == 1.0;
            let tolerance = if rim { 1e-14 * (1.0 + radius) / 10f64.powf(steep) } else { 0.0 };
            prop_assert!((time - exact).abs() <= tolerance, "{time} {exact}");
            let landed = flight.advanced_to(time);
            let (found, gap) = mesh.normal_and_gap(triangle, &Sweep::new(&landed, velocity.amax()));
            prop_assert!(rim || found == normal, "{found:?}");
            prop_assert!(gap.abs() <= 1e-14 * (1.0 + radius), "{gap:e}");
        }
    }

    #[test]
    fn a_tilted_flat_mesh_is_a_plane(
        seed in 1..1000u64, weights in [0.0..1.0, 0.0..1.0f64], direction in [-3.0..3.0, -3.0..3.0f64], steep in -3.0..1.0f64,
        turn in [-3.0..3.0, -3.0..3.0, -3.0..3.0f64],
    ) {
        let turn = Rotation3::from_scaled_axis(Vector3::from(turn));
        let normal = turn * Vector3::z();
        let mesh = sheet(5, seed, |x, y| turn * Vector3::new(x, y, 0.0));
        for point in points(&mesh, weights) {
            let velocity = turn * Vector3::new(direction[0], direction[1], 0.0) - normal * 10f64.powf(steep);
            let flight = Flight { position: point + normal * 0.01 - velocity * 2.0, time: 0.0, velocity, radius: 0.01 };
            let exact = sphere_plane(&flight, Vector3::zeros(), normal).expect("it approaches");
            let (time, _) = first(&mesh, &flight).expect("the mesh is hit");
            prop_assert!((time - exact).abs() * 10f64.powf(steep) <= 4e-15 * (1.0 + velocity.norm()), "{time} {exact}");
        }
    }

    #[test]
    fn sliding_on_a_flat_mesh_meets_nothing(
        seed in 1..1000u64, at in [-0.9..0.9, -0.9..0.9f64], direction in [-3.0..3.0, -3.0..3.0f64], gap in -4..4i32,
    ) {
        let mesh = sheet(6, seed, |x, y| Vector3::new(x, y, 0.0));
        prop_assume!(direction[0].abs() > 0.1);
        for radius in [1e-3, 0.1, 3.0] {
            let height = radius * (1.0 + f64::from(gap) * f64::EPSILON);
            for rise in [0.0, 1e-17, -1e-17] {
                let velocity = Vector3::new(direction[0], direction[1], rise);
                let flight = Flight { position: Vector3::new(at[0], at[1], height), time: 0.0, velocity, radius };
                prop_assert_eq!(first(&mesh, &flight), None);
            }
        }
    }

    #[test]
    fn sliding_over_a_gentle_crest_meets_nothing(start in -0.9..0.9f64, bend in -8.0..-0.5f64, gap in -4..4i32, skew in -1.0..1.0f64) {
        // A barrel: every fold is convex seen from outside, so a grain that leaves one face along it is clear of all.
        let bend = 10f64.powf(bend);
        let mesh = sheet(8, 0, |x, y| Vector3::new((bend * x).sin() / bend, y, -2.0 * (0.5 * bend * x).sin().powi(2) / bend));
        let radius = 0.05;
        let cell = ((start + 1.0) * 4.0).floor();
        let ends = [cell, cell + 1.0].map(|i| bend * (i / 4.0 - 1.0)).map(|a| Vector3::new(a.sin() / bend, 0.0, -2.0 * (0.5 * a).sin().powi(2) / bend));
        let along = (ends[1] - ends[0]).normalize();
        let normal = along.cross(&Vector3::y());
        let normal = normal * 1f64.copysign(normal.z);
        let position = (ends[0] + ends[1]) * 0.5 + normal * (radius * (1.0 + f64::from(gap) * f64::EPSILON));
        for velocity in [along, -along] {
            let velocity = velocity + Vector3::y() * skew;
            // Along the face but for rounding, which is taken out upwards: what remains of an approach would be a true hit.
            let velocity = velocity - normal * (velocity.dot(&normal) - 1e-15);
            let flight = Flight { position, time: 0.0, velocity, radius };
            prop_assert_eq!(first(&mesh, &flight), None);
        }
    }
}

/// A cube of side 2 with an octahedron inside it, both closed.
fn cage() -> Mesh {
    let mut vertices: Vec<_> =
        (0..8).map(|i| Vector3::from([i & 1, i >> 1 & 1, i >> 2].map(|bit| f64::from(bit) * 2.0 - 1.0))).collect();
    vertices.extend([0, 1, 2].into_iter().flat_map(|axis| {
        let tip = Vector3::ith(axis, 0.45);
        [tip, -tip]
    }));
    let mut triangles: Vec<[u32; 3]> =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
            .into_iter()
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
    for i in 0..8u32 {
        triangles.push([8 + (i & 1), 10 + (i >> 1 & 1), 12 + (i >> 2)]);
    }
    Mesh::new(vertices, triangles).expect("no triangle is degenerate")
}

#[test]
fn a_bouncing_grain_never_gets_out_or_in() {
    let mesh = cage();
    assert!(mesh.is_watertight());
    for (restitution, kick) in [(1.0, 0.0), (0.0, 1.0), (0.5, 1.0)] {
        for start in 0..40 {
            let angle = f64::from(start);
            let velocity = Vector3::new(angle.sin(), (2.0 * angle).cos(), (3.0 * angle).sin());
            let mut flight = Flight { position: Vector3::new(0.7, 0.6, 0.5), time: 0.0, velocity, radius: 0.1 };
            for hit in 1..500 {
                let (time, triangle) = first(&mesh, &flight).unwrap_or_else(|| panic!("{flight:?} got away"));
                flight = flight.advanced_to(time);
                let (normal, gap) = mesh.normal_and_gap(triangle, &Sweep::new(&flight, flight.velocity.amax()));
                assert!(gap.abs() < 1e-13, "{gap:e} at hit {hit}");
                let nearest = (0..mesh.len()).map(|i| (flight.position - mesh.nearest(i, &flight.position)).norm());
                let clearance = nearest.fold(f64::INFINITY, f64::min) - flight.radius;
                assert!(clearance > -1e-13, "{clearance:e} at hit {hit}");
                let approach = -flight.velocity.dot(&normal);
                assert!(approach > 0.0, "{approach:e} at hit {hit}");
                flight.velocity += normal * ((1.0 + restitution) * approach);
                // Where hits dissipate, something stirs the grain: otherwise it would come to rest in a corner.
                let stir = Vector3::new((hit as f64 * 1.1).sin(), (hit as f64 * 1.7).sin(), (hit as f64 * 2.3).sin());
                flight.velocity += stir * kick;
            }
        }
    }
}

#[test]
fn a_grain_at_rest_on_a_face_an_edge_or_a_corner_is_not_hit_again() {
    let mesh = cage();
    for aim in [Vector3::new(0.15, 0.15, 0.15), Vector3::new(0.2, 0.25, 0.0), Vector3::new(0.0, 0.0, 0.45)] {
        let from = if aim.norm() < 0.4 { aim * 2.2 } else { aim * 2.0 };
        let mut flight = Flight { position: from, time: 0.0, velocity: aim - from, radius: 0.1 };
        let (time, triangle) = first(&mesh, &flight).expect("it is aimed at the octahedron");
        flight = flight.advanced_to(time);
        let (normal, _) = mesh.normal_and_gap(triangle, &Sweep::new(&flight, flight.velocity.amax()));
        flight.velocity -= normal * flight.velocity.dot(&normal);
        let again = first(&mesh, &flight);
        assert!(again.is_none_or(|(later, _)| later > time + 0.1), "{again:?} after {time}");
    }
}

/// The time of a graze is known so badly that its foot may lie far beyond the side of the triangle that it was predicted with. Where that side is the
/// diagonal of a flat piece, the closest point of the triangle lies on the diagonal, and a normal from there slants: a planar run stopped at it.
#[test]
fn a_graze_along_a_flat_piece_was_given_the_normal_of_its_diagonal() {
    let slope = |x: f64, y: f64| Vector3::new(x, y, 0.4 * x);
    let strip = [[0.0, -1.0], [0.1, -1.0], [0.1, 1.0], [0.0, 1.0]].map(|[x, y]| slope(x, y));
    let mesh = Mesh::new(strip.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).expect("no triangle is degenerate");
    let normal = Vector3::new(-0.4, 0.0, 1.0).normalize();
    let along = Vector3::new(1.0, 0.0, 0.4).normalize();
    for (triangle, x) in [(0, 0.048), (0, 0.02), (1, 0.052), (1, 0.08)] {
        let centre = slope(x, 0.0) + normal * 0.5;
        let flight = Flight { position: centre, time: 0.0, velocity: -along, radius: 0.5 };
        let (found, gap) = mesh.normal_and_gap(triangle, &Sweep::new(&flight, 1.0));
        assert!((found - normal).norm() < 1e-14 && gap.abs() < 1e-15, "{triangle} at {x}: {found:?}, {gap}");
    }
    // Beyond the rim the nearest point counts as before.
    let beside = Flight { position: slope(0.05, 1.3) + normal * 0.4, time: 0.0, velocity: -along, radius: 0.5 };
    let (found, gap) = mesh.normal_and_gap(1, &Sweep::new(&beside, 1.0));
    assert!(found.y > 0.5 && gap.abs() < 1e-15, "{found:?}, {gap}");
}

#[test]
fn triangles_without_a_face_are_named() {
    let vertices = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::x() * 2.0];
    assert_eq!(Mesh::new(vertices.clone(), vec![[0, 1, 2], [0, 1, 3]]).unwrap_err().0, 1);
    assert_eq!(Mesh::new(vertices, vec![[0, 1, 9]]).unwrap_err().0, 0);
}
