//! Two grains and a wall: every hit of the simulation beside the closed form.
//!
//! `cargo run --release --example two_grains`
//!
//! Mukherjee & Zohdi (2015), section 2.7, follow the first hits of two equal grains that fall on a wall one behind the other. The sequence goes
//! on: with v0 the speed at the start, s and q the restitution of wall and grains, the grains approach each other before their hit n + 1 at
//!
//! c(n) = (1 + s) ρ^n sin((n + 1) θ) / sin θ  times v0, with ρ = √(s q) and cos θ = (1 - s) (1 - q) / (4 ρ),
//!
//! and before that the first grain comes to the wall at a(n) = (c(n) + q c(n - 1)) / (1 + s), until one of the two is not positive.
#![expect(clippy::print_stdout, reason = "the table is what this program is for")]

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use impinge::scene::{Overrides, SceneFile};
use impinge::scheme::{GrainCollision, Observer, SurfaceHit};
use impinge::simulation::Simulation;

/// Restitution of the wall and of the grains.
const S: f64 = 0.2;
const Q: f64 = 0.2;

/// What happened, and how fast (m/s).
#[derive(Default)]
struct Hits(Vec<(&'static str, f64)>);

impl Observer for Hits {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.0.push(("grain - grain", collision.approach_speed));
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.0.push(("grain - wall", hit.approach_speed));
    }
}

/// The same in closed form, for v0 = 1 m/s.
fn closed_form() -> Vec<(&'static str, f64)> {
    let rho = (S * Q).sqrt();
    let theta = ((1.0 - S) * (1.0 - Q) / (4.0 * rho)).acos();
    let c = |n: i32| (1.0 + S) * rho.powi(n) * (f64::from(n + 1) * theta).sin() / theta.sin();
    let a = |n: i32| (c(n) + Q * c(n - 1)) / (1.0 + S);
    let hits = (0..).flat_map(|n| [("grain - wall", a(n)), ("grain - grain", c(n))]);
    hits.take_while(|&(_, speed)| speed > 0.0).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    // The scene that the command runs too, with other restitutions and more time.
    let restitution = [format!("contact.surface.restitution={S}"), format!("contact.grain.restitution={Q}")];
    let overrides = Overrides { set: restitution.into(), until: Some(100.0), ..Overrides::default() };
    let file = SceneFile::read(Path::new("examples/two_grains.toml"), &overrides)?;

    let mut hits = Hits::default();
    Simulation::new(&file.scene, file.folder())?.run(&mut hits, &mut |_| ControlFlow::Continue(()))?;

    println!("{:16} {:>20} {:>20}", "approach, m/s", "simulated", "closed form");
    let expected = closed_form();
    for ((what, simulated), (_, expected)) in hits.0.iter().zip(&expected) {
        println!("{what:16} {simulated:20.16} {expected:20.16}");
    }
    let same = |(one, other): (&(&str, f64), &(&str, f64))| one.0 == other.0 && (one.1 - other.1).abs() < 1e-14;
    assert!(hits.0.len() == expected.len() && hits.0.iter().zip(&expected).all(same));
    Ok(())
}
