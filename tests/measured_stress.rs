//! The stress that `[[measure]] kind = "flow"` tells, against the pressure of an elastic gas and against what a plate takes of a jet.

mod common;

use common::{gas, run, smooth, states};
use impinge::estimate::Estimate;
use impinge::observe::measure::{Ejecta, Flow, Grid, Window};
use impinge::scene::Scene;
use impinge::scheme::{EventDriven, GrainCollision, Observer};
use impinge::simulation::Simulation;
use impinge_events::NoSurface;
use nalgebra::Vector3;

/// Σ s J_n over collisions, N s m: what the test of the gas itself takes for the virial; the grains have a diameter of 1 m.
#[derive(Default)]
struct Virial(f64);

impl Observer for Virial {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.0 += collision.impulse_normal;
    }
}

/// Carnahan & Starling's compressibility within 0.5 %, as the gas tests have it, and not a digit else than their own sum of virials.
#[test]
fn an_elastic_gas_has_the_pressure_of_carnahan_and_starling() {
    let phi = 0.3;
    let (grains, domain) = gas(11, phi, 1);
    let n = grains.len() as f64;
    let energy: f64 = grains.iter().map(|grain| 0.5 * grain.mass() * grain.velocity.norm_squared()).sum();
    let temperature = 2.0 * energy / (3.0 * (n - 1.0));
    let side = domain.max.x;
    let mut scheme: EventDriven<_> = EventDriven::new(&grains, NoSurface, domain, smooth(1.0, 1.0), 0.0);
    // The lattice is forgotten after some 60 collisions a grain; a grain has ten in a second.
    let (melted, until) = (6.0, 96.0);
    run(&mut scheme, melted, &mut ()).expect("no broken invariant");
    let window = Window { from: melted, until, batches: 18 };
    let grid = Grid { min: [0.0; 3], max: [side; 3], cells: [2, 2, 2] };
    let flow = Flow::over(grid, window, false).periodic(domain.min, domain.max);
    let mut watched = (flow, Virial::default());
    for sample in 0..=900 {
        let time = melted + 0.1 * f64::from(sample);
        run(&mut scheme, time, &mut watched).expect("no broken invariant");
        scheme.snapshot(time, |snapshot| watched.sample(snapshot));
    }
    let (flow, Virial(virial)) = watched;
    let all = flow.region(&(0..grid.len()).collect::<Vec<_>>());

    let contact: f64 = all.contact_stress[..3].iter().map(|part| part.value).sum();
    approx::assert_relative_eq!(contact, virial / (side.powi(3) * (until - melted)), max_relative = 1e-12);

    let z = all.pressure * (side.powi(3) / (n * temperature));
    let carnahan_starling = 1.0 + 4.0 * phi * (1.0 - 0.5 * phi) / (1.0 - phi).powi(3);
    assert!((z.value / carnahan_starling - 1.0).abs() < 0.005, "Z = {z}, not {carnahan_starling}");
    assert!(3.0 * z.error < 0.005 * z.value, "known to {z} only");

    // Kinetic and contact stress are isotropic within their errors, cell by cell too.
    let isotropic = |stress: &[Estimate; 6], pressure: f64| {
        for (part, of) in stress.iter().enumerate() {
            let expected = if part < 3 { pressure } else { 0.0 };
            // 8 cells and all of them, 2 stresses, 6 parts: one in 108 beyond 4.5 of 18 batches in 3000 tries.
            assert!((of.value - expected).abs() < 4.5 * of.error, "part {part}: {of}, not {expected}");
        }
    };
    let kinetic_pressure = (n - 1.0) * temperature / side.powi(3);
    for cell in (0..grid.len()).map(|cell| flow.cell(cell)).chain([all]) {
        isotropic(&cell.kinetic_stress, kinetic_pressure);
        isotropic(&cell.contact_stress, contact / 3.0);
    }
    assert_eq!(states(&scheme, until).len(), grains.len());
}

/// A planar jet on a plate, steady after a while: in each layer over the plate the flow carries down what the plate takes, and of the momentum
/// that comes in the ejecta have what the plate has not.
#[test]
fn a_layer_of_the_flow_carries_what_the_plate_takes() {
    let scene: Scene = toml::from_str(
        r#"
        run = { until = 30.0 }
        domain = { min = [-60, -1, -1], max = [60, 1, 40], planar = true }
        grain = { radius = 0.5, density = 1.0 }
        contact.grain = { restitution = 0.8, friction = 0.2 }
        contact.surface = { restitution = 0.8, friction = 0.2 }
        output = { samples = 1500 }
        surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }]
        [[source]]
        kind = "nozzle"
        shape = { slot = { width = 10.0, breadth = 1.0, along = [0, 1, 0] } }
        centre = [0, 0, 38]
        axis = [0, 0, -1]
        speed = 20.0
        flow = { volume_fraction = 0.3 }
        "#,
    )
    .expect("the scene is right");
    let window = Window { from: 10.0, until: 30.0, batches: 10 };
    let grid = Grid { min: [-60.0, -0.5, 0.0], max: [60.0, 0.5, 12.0], cells: [60, 1, 6] };
    let mut watched = (Flow::over(grid, window, true), (Ejecta::about(-Vector3::z(), window, 90), Late::default()));
    let mut simulation = Simulation::new(&scene, "".as_ref()).expect("it can run");
    simulation.run(&mut watched, &mut |_| std::ops::ControlFlow::Continue(())).expect("it runs");
    let (flow, (ejecta, Late(force))) = watched;
    let force = force / (window.until - window.from);

    // Between the plate and the middle of a layer, and between the middles of the outermost columns: what comes in from above is what the plate and the
    // sides take. Layers above the lowest, part of which contacts with the plate carry.
    let [dx, dy, dz] = grid.spacing();
    let flux = |column: usize, layer: usize, part: usize| flow.cell(layer * 60 + column).momentum_flux(part);
    for layer in 1..6 {
        let ends = 0.5 * (flux(0, layer, 2) + flux(59, layer, 2));
        let above = ((1..59).map(|column| flux(column, layer, 2)).sum::<f64>() + ends) * dx * dy;
        let side = |below: usize| (flux(59, below, 5) - flux(0, below, 5)) * dz * dy;
        let sides = (0..layer).map(side).sum::<f64>() + 0.5 * side(layer);
        assert!((0.0..0.2).contains(&(sides / force)), "the sides take {sides} N of {force} N");
        // What a steady jet fluctuates by in 20 s.
        let carried = above + sides;
        assert!((carried / force - 1.0).abs() < 0.02, "layer {layer}: {carried} N, and {force} N on the plate");
    }

    // F = Q (U0 - U_h).
    let ejected = ejecta.ejected();
    let inflow = simulation.nozzles()[0].flux() * std::f64::consts::PI / 6.0;
    let expected = inflow * (20.0 - ejected.along.value);
    assert!((force / expected - 1.0).abs() < 0.02, "{force} N on the plate, and {expected} N less in the ejecta");
    assert!(ejected.mass_rate.deviation(Estimate::exact(inflow)) < 4.0, "{} of {inflow} kg/s", ejected.mass_rate);
    assert!(ejected.opening_angle.value > 80.0, "{}", ejected.opening_angle);
}

/// Normal impulse on the surface after 10 s, N s.
#[derive(Default)]
struct Late(f64);

impl Observer for Late {
    fn surface_hit(&mut self, hit: &impinge::scheme::SurfaceHit) {
        if hit.time > 10.0 {
            self.0 += hit.impulse_normal;
        }
    }
}
