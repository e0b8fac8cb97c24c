//! What scenes measure on the surface and at their sides, against closed forms, ledgers and each other.

use std::ops::ControlFlow;
use std::path::Path;

use impinge::estimate::Estimate;
use impinge::observe::measure::{FreeJet, Outflow, Quantity, SurfaceStress};
use impinge::observe::{Ledger, SurfaceShape};
use impinge::scene::{Measure, Scene, SurfaceStressMeasure};
use impinge::scheme::Observer;
use impinge::simulation::Simulation;

fn scene(text: &str) -> Scene {
    let scene: Scene = toml::from_str(text).expect("TOML");
    impinge::scene::check(&scene).expect("it makes sense");
    scene
}

/// Runs a scene with its first measurement, of surface stress, and another observer.
fn run<O: Observer + Default>(scene: &Scene) -> (SurfaceStress, O) {
    let mut simulation = Simulation::new(scene, Path::new(".")).expect("it can be run");
    let shape = SurfaceShape::from(simulation.surface());
    let Measure::SurfaceStress(measure) = &scene.measure[0] else { panic!("no measurement of stress") };
    let mut watched = (SurfaceStress::new(measure, scene, &shape), O::default());
    simulation.run(&mut watched, &mut |_| ControlFlow::Continue(())).expect("it runs");
    watched
}

/// A planar or round jet whose grains pass through each other, at an angle from the normal (degrees).
fn free_jet(angle: f64, planar: bool) -> Scene {
    let (sin, cos) = angle.to_radians().sin_cos();
    let shape = if planar {
        "{ slot = { width = 0.2, breadth = 1, along = [0, 1, 0] } }"
    } else {
        "{ circle = { diameter = 0.2 } }"
    };
    let reach = 0.3 / cos;
    // Patches across the middle of the footprint, where all of each is hit.
    let (size, cells) = if planar { ([0.16 / cos, 1.0], [8, 1]) } else { ([0.1 / cos, 0.1], [4, 4]) };
    let density = if planar { 0.1 * 2500.0 * 4.0 / 3.0 * 0.01 } else { 0.1 * 2500.0 };
    scene(&format!(
        r#"
        run = {{ until = 4.0, interference = "none" }}
        domain = {{ min = [-{reach:?}, -0.3, -0.1], max = [{reach:?}, 0.3, 0.5], planar = {planar} }}
        grain = {{ radius = 0.01, density = 2500 }}
        contact.surface = {{ restitution = 0.3, friction = {{ static = 0.3, dynamic = 0.2 }} }}
        output = {{ samples = 2 }}
        [[source]]
        kind = "nozzle"
        shape = {shape}
        centre = [{:?}, 0, {:?}]
        axis = [{:?}, 0, {:?}]
        speed = 20
        flow = {{ volume_fraction = 0.1 }}
        [[surface]]
        kind = "plane"
        point = [0, 0, 0]
        normal = [0, 0, 1]
        [[measure]]
        kind = "surface-stress"
        patches = {{ centre = [0, 0, 0], size = {size:?}, cells = {cells:?} }}
        jet = {{ density = {density:?}, speed = 20, angle = {angle:?} }}
        from = 0.1
        batches = 30
        "#,
        -0.25 * sin,
        0.25 * cos,
        sin,
        -cos,
    ))
}

/// Mean square deviation from what is expected, in standard errors.
fn misfit(estimates: impl Iterator<Item = Estimate>, expected: f64) -> f64 {
    let squares: Vec<f64> = estimates.map(|of| of.deviation(Estimate::exact(expected)).powi(2)).collect();
    squares.iter().sum::<f64>() / squares.len() as f64
}

#[test]
fn grains_that_do_not_meet_press_and_drag_as_the_closed_forms_say() {
    for planar in [true, false] {
        for angle in [0.0, 20.0, 40.0, 45.0, 55.0, 60.0] {
            let scene = free_jet(angle, planar);
            let (stress, ()) = run(&scene);
            let Measure::SurfaceStress(SurfaceStressMeasure { jet: Some(jet), .. }) = &scene.measure[0] else {
                panic!("no jet")
            };
            let free = FreeJet { density: jet.density, speed: jet.speed, angle, restitution: 0.3 };
            let (pressure, shear) = (free.pressure(), free.pressure() * free.shear_over_pressure(0.3, 0.2));
            let count = stress.patches().all().len();
            let patches = || (0..count).map(|patch| stress.stress(patch));
            let name = format!("planar {planar}, {angle} degrees");
            // A mean square of count values of Student's t with 29 degrees of freedom: 1.07 on average, with a standard deviation of √(2.4 / count).
            let most = 1.07 + 4.0 * (2.4 / count as f64).sqrt();
            let misfits = [
                misfit(patches().map(|stress| stress.normal), pressure),
                if angle > 0.0 { misfit(patches().map(|stress| stress.shear), shear) } else { 0.0 },
            ];
            assert!(misfits.iter().all(|&misfit| misfit < most), "{name}: {misfits:?}");
            // And all patches together, where errors are a few per cent at the most.
            let mean = stress.derived(|patches| patches.iter().map(|stress| stress.normal).sum::<f64>() / count as f64);
            assert!(
                mean.error < 0.03 * pressure && mean.deviation(Estimate::exact(pressure)) < 4.0,
                "{name}: {mean} for {pressure}"
            );
            for patch in patches() {
                // What sticks or slips does so alike in every hit.
                approx::assert_relative_eq!(
                    patch.shear.value,
                    patch.normal.value * shear / pressure,
                    max_relative = 1e-9,
                    epsilon = 1e-9
                );
                assert!(patch.across.value.abs() < 1e-9 * pressure, "{name}");
            }
        }
    }
}

/// A dilute spray onto a floor, which is a plane or a rectangle of triangles that lies in it.
fn spray(floor: &str, patches: &str) -> Scene {
    scene(&format!(
        r#"
        seed = 3
        {floor}
        run = {{ until = 0.05 }}
        domain = {{ min = [-1, -1, -0.1], max = [1, 1, 1] }}
        grain = {{ radius = 0.01, density = 2500 }}
        contact.grain = {{ restitution = 0.7, friction = 0.3 }}
        contact.surface = {{ restitution = 0.6, friction = 0.2 }}
        output = {{ samples = 2 }}
        [[source]]
        kind = "block"
        min = [-0.4, -0.4, 0.05]
        max = [0.1, 0.4, 0.6]
        count = 300
        velocity = [6, 1, -20]
        thermal_speed = 1
        [[measure]]
        kind = "surface-stress"
        direction = [1, 1, 0]
        batches = 2
        {patches}
        "#
    ))
}

const PLANE: &str = "surface = [{ kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }]";
const PATCHES: &str = "patches = { centre = [0, 0, 0], size = [1.6, 1.6], cells = [4, 4] }";

fn rectangle(divisions: u32) -> String {
    format!(
        "surface = [{{ kind = \"rectangle\", centre = [0, 0, 0], normal = [0, 0, 1], along = [1, 0, 0], size = [1.6, 1.6], divisions = [{divisions}, {divisions}] }}]"
    )
}

#[test]
fn a_mesh_of_a_plane_feels_what_the_plane_feels() {
    let grid = |floor: &str| run::<Ledger>(&spray(floor, PATCHES));
    let ((plane, ledger), (mesh, _)) = (grid(PLANE), grid(&rectangle(4)));
    let hits: u64 = (0..16).map(|patch| plane.stress(patch).hits).sum();
    assert!(hits > 250 && ledger.counts().grain_grain > 30, "{hits} hits, {:?}", ledger.counts());
    let same = |a: Estimate, b: Estimate| {
        approx::assert_relative_eq!(a.value, b.value, max_relative = 1e-6, epsilon = 1e-9);
    };
    for patch in 0..16 {
        let [a, b] = [&plane, &mesh].map(|stress| stress.stress(patch));
        assert_eq!(a.hits, b.hits, "patch {patch}");
        same(a.normal, b.normal);
        same(a.shear, b.shear);
        same(a.across, b.across);
    }
    // Each triangle is a patch of its own: two of them are a cell, and all of them what the ledger gave to the surface.
    let (triangles, ledger) = run::<Ledger>(&spray(&rectangle(4), ""));
    assert_eq!(triangles.patches().all().len(), 32);
    let [on_patches, elsewhere] = triangles.impulses();
    assert_eq!(elsewhere, nalgebra::Vector3::zeros());
    approx::assert_relative_eq!(-on_patches, ledger.surface_impulse(), max_relative = 1e-12);
    for cell in 0..16 {
        // Triangles count along y fastest, patches along x.
        let [a, b] = [0, 1].map(|half| triangles.stress(2 * (4 * (cell % 4) + cell / 4) + half));
        let whole = mesh.stress(cell);
        assert_eq!(a.hits + b.hits, whole.hits, "cell {cell}");
        approx::assert_relative_eq!(
            0.5 * (a.shear.value + b.shear.value),
            whole.shear.value,
            max_relative = 1e-9,
            epsilon = 1e-9
        );
    }
}

#[test]
fn what_leaves_is_what_the_ledger_saw_leave() {
    let text = r#"
        run = { until = 0.5 }
        domain = { min = [-0.5, -1, 0], max = [0.5, 1, 0.6], planar = true }
        grain = { radius = 0.01, density = 2500 }
        contact.grain = { restitution = 0.5, friction = 0.3 }
        contact.surface = { restitution = 0.5, friction = 0.3 }
        output = { samples = 2 }
        [[source]]
        kind = "nozzle"
        shape = { slot = { width = 0.2, breadth = 1, along = [0, 1, 0] } }
        centre = [0, 0, 0.5]
        axis = [0.4, 0, -1]
        speed = 20
        flow = { volume_fraction = 0.1 }
        [[surface]]
        kind = "plane"
        point = [0, 0, 0]
        normal = [0, 0, 1]
        [[measure]]
        kind = "outflow"
        sides = ["x-max"]
        length = 0.2
    "#;
    let scene = scene(text);
    let Measure::Outflow(measure) = &scene.measure[0] else { panic!("no outflow") };
    let mut watched = (Outflow::new(measure, &scene), Ledger::default());
    let mut simulation = Simulation::new(&scene, Path::new(".")).expect("it can be run");
    simulation.run(&mut watched, &mut |_| ControlFlow::Continue(())).expect("it runs");
    let (outflow, ledger) = watched;
    let [through, elsewhere] = outflow.totals();
    assert!(through.0 > elsewhere.0 && elsewhere.0 > 0.0);
    approx::assert_relative_eq!(through.0 + elsewhere.0, ledger.left().mass(), max_relative = 1e-13);
    approx::assert_relative_eq!(through.1 + elsewhere.1, ledger.left().momentum(), max_relative = 1e-12);
    approx::assert_relative_eq!(through.2 + elsewhere.2, ledger.left().energy(), max_relative = 1e-13);
    // Of momentum along x all that left to the right did so outwards.
    let momentum = outflow.moments(Quantity::Momentum).resultant.value * 0.5;
    approx::assert_relative_eq!(momentum, through.1.x, max_relative = 1e-12);
}
