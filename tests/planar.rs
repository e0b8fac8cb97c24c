//! A planar scene is in two dimensions exactly: y and its velocity are 0 to the bit, and grains spin about y only.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use impinge::grains::{Grain, Snapshot};
use impinge::observe::Ledger;
use impinge::scene::{Overrides, SceneFile};
use impinge::scheme::{Broken, GrainCollision, Observer, Passage, SurfaceHit};
use impinge::simulation::{Outcome, Simulation};
use impinge_events::Flight;
use nalgebra::Vector3;

/// Objects to anything that leaves the plane.
#[derive(Default)]
struct InPlane {
    spinning: bool,
    elements: Vec<u32>,
}

impl InPlane {
    fn look(&mut self, flight: &Flight, grain: &Grain) {
        assert_eq!((flight.position.y, flight.velocity.y), (0.0, 0.0), "grain {}", grain.id);
        assert_eq!((grain.spin.x, grain.spin.z), (0.0, 0.0), "grain {}", grain.id);
        self.spinning |= grain.spin.y != 0.0;
    }
}

impl Observer for InPlane {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        assert_eq!((collision.position.y, collision.normal.y), (0.0, 0.0));
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        assert_eq!((hit.position.y, hit.normal.y, hit.impulse_tangential.y), (0.0, 0.0, 0.0));
        self.elements.push(hit.element);
    }

    fn passage(&mut self, _passage: Passage, _time: f64, flight: &Flight, grain: &Grain) {
        self.look(flight, grain);
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        snapshot.flights.iter().zip(snapshot.grains).for_each(|(flight, grain)| self.look(flight, grain));
    }
}

/// A ridge with its crest along y, as a file; closed by caps beside the plane when `closed`.
fn ridge(crest: Vector3<f64>, half_width: f64, breadth: f64, closed: bool) -> String {
    let at = |x: f64, y: f64, z: f64| Vector3::new(crest.x + x, y, crest.z + z);
    let (w, b) = (half_width, breadth / 2.0);
    let ends = [-b, b].map(|y| [at(-w, y, -w), at(0.0, y, 0.0), at(w, y, -w)]);
    let [front, back] = ends;
    let mut triangles: Vec<[Vector3<f64>; 3]> = Vec::new();
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        triangles.extend([[front[i], front[j], back[j]], [front[i], back[j], back[i]]]);
    }
    if closed {
        triangles.extend(ends);
    }
    stl(&triangles)
}

fn stl(triangles: &[[Vector3<f64>; 3]]) -> String {
    let mut text = "solid mesh\n".to_owned();
    for corners in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        corners.iter().for_each(|corner| writeln!(text, "vertex {} {} {}", corner.x, corner.y, corner.z).unwrap());
        text += "endloop\nendfacet\n";
    }
    text + "endsolid mesh\n"
}

const SCENE: &str = r#"
    run = { until = 0.1 }
    domain = { min = [-1, 0, -0.2], max = [1, 0, 1], planar = true }
    grain = { radius = { mean = 0.008, cv = 0.2, distribution = "uniform" }, density = 2500 }
    contact.grain = { restitution = 0.8, friction = 0.4 }
    contact.surface = { restitution = 0.7, friction = { static = 0.5, dynamic = 0.3 } }
"#;

fn run(scene: &str, folder: &Path, observer: &mut impl Observer) -> Result<Outcome, Broken> {
    let file = SceneFile::parse(&folder.join("scene.toml"), scene, &Overrides::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let simulation = Simulation::new(&file.scene, file.folder());
    simulation.unwrap_or_else(|error| panic!("{error}")).run(observer, &mut |_| ControlFlow::Continue(()))
}

#[test]
fn friction_meshes_and_a_nozzle_leave_every_grain_in_the_plane() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ridge.stl"), ridge(Vector3::new(-0.45, 0.0, 0.15), 0.1, 0.3, true)).unwrap();
    let scene = format!(
        r#"{SCENE}
        source = [
            {{ kind = "nozzle", shape = {{ circle = {{ diameter = 0.2 }} }}, centre = [-0.5, 0, 0.6], axis = [0.1, 0, -1],
               speed = 20, divergence = 5, flow = {{ volume_fraction = 0.1 }}, spin = [0, 30, 0] }},
            {{ kind = "block", min = [0.1, 0, 0.3], max = [0.5, 0, 0.9], count = 200, velocity = [-1, 0, -20], thermal_speed = 2 }},
            {{ kind = "lattice", min = [0.6, 0, 0.2], max = [0.9, 0, 0.9], cells = [6, 1, 14], velocity = [0, 0, -15] }},
        ]
        surface = [
            {{ kind = "plane", point = [0, 0, -0.05], normal = [0.1, 0, 1] }},
            {{ kind = "mesh", path = "ridge.stl" }},
            {{ kind = "sine", centre = [0.3, 0, 0.1], size = [0.5, 0.2], amplitude = 0.02, wavelength = 0.07 }},
            {{ kind = "rectangle", centre = [0.75, 0, 0.1], normal = [-0.3, 0, 1], along = [1, 0, 0.3], size = [0.3, 0.4], divisions = [3, 5] }},
            {{ kind = "disc", centre = [0.0, 0, 0.2], normal = [0.2, 0, 1], radius = 0.08, segments = 7, velocity = [0.5, 0, 0] }},
        ]
        "#
    );
    let mut observed = (InPlane::default(), Ledger::default());
    run(&scene, folder.path(), &mut observed).unwrap_or_else(|broken| panic!("{broken}"));
    let (in_plane, ledger) = observed;
    let counts = ledger.counts();
    assert!(in_plane.spinning && counts.grain_grain > 1000 && counts.grain_surface > 1000, "{counts:?}");
    let passed = (ledger.entered().count(), ledger.left().count());
    assert!(passed.0 > 100 && passed.1 > 20, "{passed:?}");
    for (surface, elements) in
        [("plane", 0..1), ("ridge", 1..9), ("sine", 9..467), ("rectangle", 467..497), ("disc", 497..504)]
    {
        assert!(in_plane.elements.iter().any(|element| elements.contains(element)), "no grain hit the {surface}");
    }
    assert!(ledger.relative_energy_residual().abs() < 1e-13, "{:e}", ledger.relative_energy_residual());
    assert!(ledger.relative_momentum_residual() < 1e-13, "{:e}", ledger.relative_momentum_residual());
    assert!(ledger.max_overlap_over_radius() < 1e-9, "{:e}", ledger.max_overlap_over_radius());
}

/// What cannot be seen from the faces alone: an edge that runs at a slant through the plane.
#[test]
fn a_slanting_edge_stops_the_run_and_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)].map(|(x, y)| Vector3::new(x, y, 0.0));
    fs::write(folder.path().join("sail.stl"), stl(&[corners])).unwrap();
    let at = |x: f64| {
        let row = format!("x,y,z,vx,vy,vz,radius\n{x},0,0.5,0,0,-10,0.02\n");
        fs::write(folder.path().join("grain.csv"), row).unwrap();
        let parts = r#"
            source = [{ kind = "file", path = "grain.csv" }]
            surface = [{ kind = "mesh", path = "sail.stl" }]
        "#;
        run(&(SCENE.to_owned() + parts), folder.path(), &mut InPlane::default())
    };
    assert!(at(-0.2).is_ok(), "on the face");
    let Err(Broken::OutOfPlane { grain: 0, time }) = at(0.01) else { panic!("it must be stopped") };
    assert!((0.04..0.05).contains(&time), "{time}");
}
