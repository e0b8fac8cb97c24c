//! Surfaces as a scene makes them: import, repair, refusal, motion, overlap.

use std::fs;
use std::path::Path;

use impinge::scene::{self, DiscSurface, Invalid, MeshSurface, PlaneSurface, RectangleSurface, SineSurface};
use impinge::surface::{Report, Surface};
use impinge_events::{Flight, Outlook, Surface as _};
use nalgebra::Vector3;
use tempfile::TempDir;

type Facet = [[f32; 3]; 3];

/// The twelve triangles of the unit cube.
fn cube() -> Vec<Facet> {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32);
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|facet| facet.map(corner))
        .collect()
}

fn ascii(facets: &[Facet]) -> Vec<u8> {
    let mut text = String::from("solid cube\n");
    for facet in facets {
        text += " facet normal 0 0 0\n  outer loop\n";
        for [x, y, z] in facet {
            text += &format!("   vertex {x} {y} {z}\n");
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid cube\n").into_bytes()
}

fn binary(facets: &[Facet]) -> Vec<u8> {
    // Some programs write `solid` into binary files too.
    let mut bytes = b"solid".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0u8; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0u8; 2]);
    }
    bytes
}

const OBJ_CUBE: &str = "o cube\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";

fn mesh_at(path: &str) -> MeshSurface {
    MeshSurface { path: path.into(), scale: 1.0, offset: [0.0; 3], velocity: [0.0; 3] }
}

/// The surface of one mesh file with this content.
fn import(name: &str, content: impl AsRef<[u8]>) -> Result<Surface, Invalid> {
    let folder = TempDir::new().expect("a temporary folder");
    fs::write(folder.path().join(name), content).expect("a file in it");
    Surface::new(&[scene::Surface::Mesh(mesh_at(name))], folder.path())
}

fn report(surface: &Surface) -> Report {
    surface.reports().next().expect("a mesh").1.clone()
}

/// What a broken file is refused for.
fn refusal(name: &str, content: impl AsRef<[u8]>) -> String {
    let refused = import(name, content).expect_err("a broken file");
    assert_eq!(refused.key, "surface[0].path");
    assert!(refused.what.contains(name), "{}", refused.what);
    assert!(!refused.remedy.is_empty());
    refused.what
}

fn generated(surface: scene::Surface) -> Result<Surface, Invalid> {
    Surface::new(&[surface], Path::new("."))
}

fn plane(point: [f64; 3], normal: [f64; 3], velocity: [f64; 3]) -> scene::Surface {
    scene::Surface::Plane(PlaneSurface { point, normal, velocity })
}

fn rectangle(divisions: [u32; 2], velocity: [f64; 3]) -> scene::Surface {
    let [centre, normal, along] = [[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    scene::Surface::Rectangle(RectangleSurface { centre, normal, along, size: [2.0, 2.0], divisions, velocity })
}

fn falling(position: [f64; 3], velocity: [f64; 3]) -> Flight {
    Flight { position: position.into(), time: 0.0, velocity: velocity.into(), radius: 0.25 }
}

#[test]
fn a_cube_is_the_same_from_every_format() {
    let named =
        |solid: &str| String::from_utf8(ascii(&cube())).expect("text").replacen("solid cube", solid, 1).into_bytes();
    let files = [
        ("cube.stl", ascii(&cube())),
        ("cube.STL", binary(&cube())),
        ("unnamed.stl", named("solid")),
        ("two.stl", [ascii(&cube()[..5]), ascii(&cube()[5..])].concat()),
        ("cube.obj", OBJ_CUBE.into()),
    ];
    for (name, content) in files {
        let surface = import(name, content).expect(name);
        let report = report(&surface);
        assert_eq!((report.triangles, report.vertices, surface.elements()), (12, 8, 12), "{name}");
        assert!((report.area - 6.0).abs() < 1e-14, "{name}");
        assert_eq!((report.min, report.max), (Vector3::zeros(), Vector3::repeat(1.0)), "{name}");
        assert!(report.is_watertight(), "{name}");
        assert_eq!((report.degenerate, report.duplicates, report.welded), (0, 0, 0), "{name}");
        let expected = "12 triangles, 8 vertices, area 6.000000 m², x 0.000000 to 1.000000 m, y 0.000000 to 1.000000 m, \
            z 0.000000 to 1.000000 m, watertight";
        assert_eq!(report.to_string(), expected);
    }
}

#[test]
fn a_mesh_is_mended_and_what_was_done_is_counted() {
    let mut facets = cube();
    facets.push([[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]]);
    facets.push([[0.0; 3], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    facets.push([facets[3][1], facets[3][0], facets[3][2]]);
    facets[4][0] = [1e-8, -1e-8, 0.0];
    facets[5][1][0] += 1e-7;
    let report = report(&import("cube.stl", binary(&facets)).expect("a mesh"));
    assert!(report.is_watertight(), "{report}");
    assert_eq!((report.triangles, report.degenerate, report.duplicates, report.welded), (12, 2, 1, 2));
    assert!(
        report
            .to_string()
            .ends_with("watertight; 2 degenerate triangles removed; 1 duplicate triangles removed; 2 vertices welded")
    );
}

#[test]
fn an_open_mesh_says_where_it_is_open() {
    let open = report(&import("open.stl", binary(&cube()[1..])).expect("a mesh"));
    assert_eq!((open.open_edges, open.is_watertight()), (3, false));
    let mut fin = cube();
    fin.push([[0.0; 3], [1.0, 1.0, 0.0], [0.5, 0.5, 9.0]]);
    let crowded = report(&import("fin.stl", binary(&fin)).expect("a mesh"));
    assert_eq!((crowded.open_edges, crowded.crowded_edges), (2, 1));
    assert!(crowded.to_string().contains("not watertight (2 open edges, 1 edges with more than two triangles)"));
}

#[test]
fn scale_and_offset_are_applied() {
    let folder = TempDir::new().expect("a temporary folder");
    fs::write(folder.path().join("cube.stl"), binary(&cube())).expect("a file in it");
    let file = MeshSurface { scale: 0.001, offset: [1.0, 2.0, 3.0], ..mesh_at("cube.stl") };
    let report = report(&Surface::new(&[scene::Surface::Mesh(file)], folder.path()).expect("a mesh"));
    assert_eq!((report.min, report.max), (Vector3::new(1.0, 2.0, 3.0), Vector3::new(1.001, 2.001, 3.001)));
    assert!((report.area - 6e-6).abs() < 1e-15);
}

#[test]
fn broken_files_are_refused_with_a_reason() {
    let solid = binary(&cube());
    let text = ascii(&cube());
    let mut not_finite = cube();
    not_finite[7][1][2] = f32::NAN;
    assert!(refusal("empty.stl", "").contains("empty"));
    assert!(refusal("blank.obj", " \n\n").contains("empty"));
    assert!(refusal("none.stl", binary(&[])).contains("no triangles"));
    assert!(refusal("none.stl", ascii(&[])).contains("no triangles"));
    assert!(refusal("none.obj", "v 0 0 0\n").contains("no triangles"));
    assert!(refusal("short.stl", [&[b' '; 80], &solid[80..300]].concat()).contains("promises 684 bytes, it has 300"));
    assert!(refusal("header.stl", [b'x'; 40]).contains("truncated"));
    assert!(refusal("short.stl", &text[..text.len() / 2]).contains("truncated"));
    assert!(refusal("nan.stl", binary(&not_finite)).contains("triangle 7 has a corner that is not finite"));
    assert!(refusal("nan.stl", ascii(&not_finite)).contains("finite"));
    assert!(refusal("nan.obj", OBJ_CUBE.replacen("v 1 0 0", "v 1 nan 0", 1)).contains("not finite"));
    assert!(refusal("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").contains("4 corners"));
    assert!(refusal("cut.obj", &OBJ_CUBE[..OBJ_CUBE.len() - 3]).contains("2 corners"));
    assert!(refusal("cut.obj", OBJ_CUBE.replacen("v 1 1 1\n", "", 1)).contains("out of bounds"));
    assert!(
        refusal("letters.stl", String::from_utf8_lossy(&text).replacen("vertex 0", "vertex zero", 1))
            .contains("`vertex zero")
    );
    assert!(refusal("line.stl", binary(&[[[0.0; 3], [1.0; 3], [2.0; 3]]])).contains("no triangle has an area"));
    assert!(refusal("mesh.ply", "ply").contains("neither .stl nor .obj"));
    let missing = Surface::new(&[scene::Surface::Mesh(mesh_at("nowhere.stl"))], Path::new("."));
    assert!(missing.expect_err("no file").what.contains("nowhere.stl: cannot be read"));
}

#[test]
fn bad_values_are_refused_under_their_key() {
    let disc = DiscSurface { centre: [0.0; 3], normal: [0.0, 0.0, 1.0], radius: 1.0, segments: 64, velocity: [0.0; 3] };
    let sine = SineSurface {
        centre: [0.0; 3],
        size: [1.0, 1.0],
        amplitude: 0.1,
        wavelength: 0.2,
        pieces: 8,
        velocity: [0.0; 3],
    };
    let cases = [
        (plane([0.0; 3], [0.0; 3], [0.0; 3]), "surface[0].normal"),
        (plane([0.0, f64::NAN, 0.0], [0.0, 0.0, 1.0], [0.0; 3]), "surface[0].point"),
        (plane([0.0; 3], [0.0, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]), "surface[0].velocity"),
        (rectangle([0, 1], [0.0; 3]), "surface[0].divisions"),
        (rectangle([u32::MAX, u32::MAX], [0.0; 3]), "surface[0].divisions"),
        (scene::Surface::Disc(DiscSurface { radius: -1.0, ..disc.clone() }), "surface[0].radius"),
        (scene::Surface::Disc(DiscSurface { segments: 2, ..disc }), "surface[0].segments"),
        (scene::Surface::Sine(SineSurface { wavelength: 0.0, ..sine.clone() }), "surface[0].wavelength"),
        (scene::Surface::Sine(SineSurface { wavelength: 1e-30, ..sine }), "surface[0].pieces"),
        (scene::Surface::Mesh(MeshSurface { scale: 0.0, ..mesh_at("x.stl") }), "surface[0].scale"),
    ];
    for (surface, key) in cases {
        assert_eq!(generated(surface).expect_err(key).key, key);
    }
}

#[test]
fn generated_surfaces_have_their_area_and_hang_together() {
    let disc =
        DiscSurface { centre: [1.0, 2.0, 3.0], normal: [1.0, 1.0, 0.0], radius: 0.5, segments: 64, velocity: [0.0; 3] };
    let disc = report(&generated(scene::Surface::Disc(disc)).expect("a disc"));
    assert_eq!((disc.triangles, disc.open_edges, disc.welded), (64, 64, 0));
    assert!((disc.area / (32.0 * (std::f64::consts::TAU / 64.0).sin() * 0.25) - 1.0).abs() < 1e-12);

    let sheet = report(&generated(rectangle([7, 3], [0.0; 3])).expect("a rectangle"));
    assert_eq!((sheet.triangles, sheet.open_edges, sheet.welded), (42, 20, 0));
    assert!((sheet.area - 4.0).abs() < 1e-12);

    let sine = SineSurface {
        centre: [0.0; 3],
        size: [1.0, 0.5],
        amplitude: 0.01,
        wavelength: 0.1,
        pieces: 32,
        velocity: [0.0; 3],
    };
    let sine = report(&generated(scene::Surface::Sine(sine)).expect("a sine wave"));
    assert_eq!((sine.triangles, sine.vertices), (640, 642));
    assert!((sine.max.z - 0.01).abs() < 1e-15 && (sine.min.z + 0.01).abs() < 1e-15);
}

#[test]
fn elements_are_numbered_over_all_surfaces() {
    let floors = [
        plane([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0; 3]),
        rectangle([2, 2], [0.0; 3]),
        plane([0.0, 0.0, -2.0], [0.0, 0.0, 1.0], [0.0; 3]),
    ];
    let surface = Surface::new(&floors, Path::new(".")).expect("surfaces");
    assert_eq!(surface.elements(), 10);
    assert_eq!(surface.planes().map(|(number, ..)| number).collect::<Vec<_>>(), [0, 9]);
    assert_eq!(surface.triangles().map(|(number, _)| number).collect::<Vec<_>>(), (1..9).collect::<Vec<_>>());
    assert_eq!(surface.reports().map(|(number, _)| number).collect::<Vec<_>>(), [1]);
    // Over the rectangle the mesh is hit, beside it the plane below.
    let over = falling([0.9, 0.9, 1.25], [0.0, 0.0, -1.0]);
    assert!(matches!(surface.first_contact(&over, 9.0), Outlook::Hit { time: 1.0, element: 1..9 }));
    let beside = falling([5.0, 0.0, 1.25], [0.0, 0.0, -1.0]);
    assert_eq!(surface.first_contact(&beside, 9.0), Outlook::Hit { time: 2.0, element: 0 });
    assert_eq!(surface.contact(0, &beside.advanced_to(2.0)).gap, 0.0);
}

#[test]
fn a_moving_mesh_and_a_moving_plane_meet_a_grain_where_they_are() {
    for shape in [plane([0.0; 3], [0.0, 0.0, 1.0], [3.0, 0.0, 0.5]), rectangle([3, 3], [3.0, 0.0, 0.5])] {
        let mut surface = Surface::new(&[shape], Path::new(".")).expect("a surface");
        let grain = falling([3.0, 0.0, 1.75], [0.0, 0.0, -1.0]);
        let Outlook::Hit { time, element } = surface.first_contact(&grain, 9.0) else { panic!("no hit") };
        assert!((time - 1.0).abs() < 1e-15);
        let contact = surface.contact(element, &grain.advanced_to(time));
        assert_eq!((contact.normal, contact.velocity), (Vector3::z(), Vector3::new(3.0, 0.0, 0.5)));
        assert!(contact.gap.abs() < 1e-15);

        // After an epoch of 0.5 s the same grain is seen half a second later, by a surface that has moved on.
        surface.start_epoch(0.5);
        let later = Flight { time: 0.0, ..grain.advanced_to(0.5) };
        let Outlook::Hit { time, .. } = surface.first_contact(&later, 9.0) else { panic!("no hit") };
        assert!((time - 0.5).abs() < 1e-15);

        // At rest on the moving surface nothing touches, whatever the rounding of the common velocity.
        let riding = Flight { position: later.position - Vector3::z() * 0.75, velocity: contact.velocity, ..later };
        for slip in [0.0, 1e-16, -1e-16] {
            let riding = Flight { velocity: riding.velocity + Vector3::z() * slip, ..riding };
            assert!(matches!(surface.first_contact(&riding, 9.0), Outlook::ClearUntil(_)), "{slip}");
        }
    }
}

#[test]
fn a_sheet_that_moves_past_is_met_while_it_is_there() {
    let surface = generated(rectangle([1, 1], [1.0, 0.0, 0.0])).expect("a sheet");
    let hits =
        |x: f64| matches!(surface.first_contact(&falling([x, 0.0, 2.25], [0.0, 0.0, -1.0]), 9.0), Outlook::Hit { .. });
    assert_eq!([0.5, 1.5, 2.5, 4.0].map(hits), [false, true, true, false]);
}

#[test]
fn grains_inside_a_surface_are_found() {
    let floor = generated(plane([0.0; 3], [0.0, 0.0, 1.0], [0.0; 3])).expect("a plane");
    assert_eq!(floor.overlaps(Vector3::z() * 0.5, 0.5, 0.0), None);
    assert_eq!(floor.overlaps(Vector3::z() * 0.25, 0.5, 0.0), Some((0, 0.25)));
    assert_eq!(floor.overlaps(Vector3::z() * -3.0, 0.5, 0.0), Some((0, 3.5)));

    let cube = import("cube.stl", binary(&cube())).expect("a cube");
    let depth =
        |x: f64, y: f64, z: f64, radius: f64| cube.overlaps(Vector3::new(x, y, z), radius, 0.0).map(|(_, depth)| depth);
    assert_eq!(depth(0.5, 0.5, 2.0, 0.5), None);
    assert_eq!(depth(0.5, 0.5, 1.25, 0.5), Some(0.25));
    assert_eq!(depth(0.5, 0.5, 0.75, 0.5), Some(0.75));
    assert_eq!(depth(0.5, 0.5, 0.5, 0.01), Some(0.51));
    assert_eq!(depth(-0.5, -0.5, -0.5, 0.5), None);

    let sheet = generated(rectangle([4, 4], [0.0; 3])).expect("a sheet");
    assert_eq!(sheet.overlaps(Vector3::z() * -0.25, 0.125, 0.0), None);
    assert_eq!(sheet.overlaps(Vector3::z() * -0.25, 0.5, 0.0).map(|(_, depth)| depth), Some(0.25));
}

#[test]
fn the_shipped_target_is_a_closed_plate_with_dimples() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let surface = Surface::new(&[scene::Surface::Mesh(mesh_at("dimpled_target.stl"))], &folder).expect("a target");
    let report = report(&surface);
    assert!(report.is_watertight(), "{report}");
    assert_eq!((report.triangles, report.degenerate, report.duplicates, report.welded), (7552, 0, 0, 0));
    assert_eq!(report.max.z, 0.0);
    let landing = |x: f64, y: f64| {
        let grain = Flight { radius: 0.01, ..falling([x, y, 1.01], [0.0, 0.0, -1.0]) };
        match surface.first_contact(&grain, f64::INFINITY) {
            Outlook::Hit { time, .. } => 1.0 - time,
            clear @ Outlook::ClearUntil(_) => panic!("{clear:?}"),
        }
    };
    // In the middle of a dimple, between dimples, and beside the plate.
    assert!((landing(0.0375, 0.0375) + 0.01).abs() < 1e-4);
    assert!(landing(0.0, 0.0).abs() < 1e-15);
    assert_eq!(surface.overlaps(Vector3::new(0.1, 0.1, -0.02), 0.001, 0.0).map(|(_, depth)| depth > 0.001), Some(true));
}

/// Contacts (normal, gap) of a sphere of radius 0.1 at `place` that are nearer than nothing.
fn contacts(surface: &Surface, place: Vector3<f64>) -> Vec<(Vector3<f64>, f64)> {
    let flight = Flight { position: place, time: 0.0, velocity: Vector3::zeros(), radius: 0.1 };
    let mut found = Vec::new();
    surface.contacts(&flight, 0.0, &mut found);
    found.into_iter().map(|(_, contact)| (contact.normal, contact.gap)).collect()
}

/// Wherever a sphere sinks into a flat mesh, over a face, an edge or a corner, it has one contact, and that is the plane's.
#[test]
fn a_sphere_in_a_flat_mesh_has_one_contact_and_its_gap() {
    let flat = RectangleSurface {
        centre: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        along: [1.0, 0.0, 0.0],
        size: [1.0, 1.0],
        divisions: [20, 20],
        velocity: [0.0; 3],
    };
    let surface = Surface::new(&[scene::Surface::Rectangle(flat)], Path::new(".")).expect("it is flat");
    for i in 0..=40 {
        for (j, beside) in [0.0, 1e-12, 1e-7, 1e-3].into_iter().enumerate() {
            let place = Vector3::new(0.0025 * f64::from(i) + beside, 0.05 * j as f64, 0.09);
            let found = contacts(&surface, place);
            assert_eq!(found.len(), 1, "{place} {found:?}");
            // 1e-12 m beside an edge the contact may be that of the edge: its normal is off by 1e-12 m / 0.09 m.
            assert!((found[0].0 - Vector3::z()).amax() < 1.2e-11 && (found[0].1 + 0.01).abs() < 1e-12, "{found:?}");
            let flight = Flight { position: place, time: 0.0, velocity: Vector3::zeros(), radius: 0.1 };
            assert!((surface.gap(&flight, 1.0) + 0.01).abs() < 1e-12);
        }
    }
}

/// In a groove a sphere touches both sides; on a ridge, and beside the rim of a plate, the edge alone.
#[test]
fn a_sphere_touches_both_sides_of_a_groove_and_one_ridge() {
    let sine = |pieces| SineSurface {
        centre: [0.0; 3],
        size: [2.0, 1.0],
        amplitude: 0.25,
        wavelength: 1.0,
        pieces,
        velocity: [0.0; 3],
    };
    // Of four pieces a wave is a zigzag: a ridge at x = 0.25, a groove at x = -0.25, slopes of 45 degrees.
    let surface = Surface::new(&[scene::Surface::Sine(sine(4))], Path::new(".")).expect("a zigzag");
    let root = 0.5f64.sqrt();
    let groove = contacts(&surface, Vector3::new(-0.25, 0.03, -0.25 + 0.095 / root));
    assert_eq!(groove.len(), 2, "{groove:?}");
    for (normal, gap) in groove {
        assert!((normal.x.abs() - root).abs() < 1e-9 && (gap + 0.005).abs() < 1e-9, "{normal} {gap}");
    }
    let ridge = contacts(&surface, Vector3::new(0.25, 0.03, 0.25 + 0.09));
    assert_eq!(ridge.len(), 1, "{ridge:?}");
    assert!((ridge[0].0 - Vector3::z()).amax() < 1e-9 && (ridge[0].1 + 0.01).abs() < 1e-9, "{ridge:?}");
}
