//! The gases and jets that the benches run.

use std::f64::consts::PI;

use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::scene::{self, Interference, PlaneSurface, Scene};
use impinge::scheme::{Collapse, Laws};
use impinge::surface::Surface;
use impinge::{simulation, source};
use impinge_events::Domain;

/// End of the reference jets, s.
pub const JET_UNTIL: f64 = 0.06;
/// Restitution in them.
pub const JET_RESTITUTION: f64 = 0.8;

/// A gas whose grains are on a lattice.
pub struct Gas {
    pub grains: Vec<NewGrain>,
    pub domain: Domain,
    /// In which each grain collides once when the lattice has melted, s: Carnahan & Starling (1969) with Enskog's theory, √π × diameter / thermal speed / (24 phi chi).
    pub time: f64,
}

/// Four grains in each of `cells`³ unit cells of 1 m, of thermal speed 1 m/s.
pub fn gas(cells: u32, fraction: f64) -> Gas {
    let radius = (fraction * 3.0 / (16.0 * PI)).cbrt();
    let (grains, domain) = placed(&format!(
        r#"
        run.until = 1.0
        domain = {{ min = [0, 0, 0], max = [{cells}, {cells}, {cells}], boundary = "periodic" }}
        grain = {{ radius = {radius}, density = 1000.0 }}
        [[source]]
        kind = "lattice"
        arrangement = "face-centred"
        cells = [{cells}, {cells}, {cells}]
        min = [0, 0, 0]
        max = [{cells}, {cells}, {cells}]
        velocity = [0, 0, 0]
        thermal_speed = 1.0
        "#
    ));
    let chi = (1.0 - fraction / 2.0) / (1.0 - fraction).powi(3);
    Gas { grains, domain, time: PI.sqrt() * 2.0 * radius / (24.0 * fraction * chi) }
}

/// The reference jet of so many grains (tests/jets.rs, case A).
pub fn reference_jet(count: u32) -> Vec<NewGrain> {
    let text = format!(
        r#"
        run.until = {JET_UNTIL}
        domain = {{ min = [-10, -10, -1], max = [10, 10, 10] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "file", path = "tests/data/jet_{count}.csv" }}]
        "#
    );
    placed(&text).0
}

/// A jet as dense and as long as the reference jet of 8000 grains, and its domain.
pub fn wide_jet(count: u32) -> (Vec<NewGrain>, Domain) {
    let half = 0.1 * (f64::from(count) / 8000.0).sqrt();
    let text = format!(
        r#"
        run.until = {JET_UNTIL}
        domain = {{ min = [-100, -100, -1], max = [100, 100, 100] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "block", min = [-{half}, -{half}, 0.1], max = [{half}, {half}, 2.6], count = {count},
            velocity = [0, 0, -80] }}]
        "#
    );
    placed(&text)
}

/// The plane z = 0.
pub fn plane() -> Surface {
    surface(scene::Surface::Plane(PlaneSurface { point: [0.0; 3], normal: [0.0, 0.0, 1.0], velocity: [0.0; 3] }))
}

pub fn surface(surface: scene::Surface) -> Surface {
    Surface::new(&[surface], ".".as_ref()).expect("a surface")
}

/// Without friction.
pub fn smooth(restitution: f64, collapse: Collapse) -> Laws {
    let law = ContactLaw { restitution, friction: Friction::Smooth };
    Laws { grain: law, surface: law, interference: Interference::All, collapse }
}

fn placed(text: &str) -> (Vec<NewGrain>, Domain) {
    let scene: Scene = toml::from_str(text).expect("a scene");
    let folder = env!("CARGO_MANIFEST_DIR").as_ref();
    (source::place(&scene, folder, &|_, _| None).expect("grains").grains, simulation::domain(&scene))
}
