//! An observer of your own: how hard do the grains of a jet hit the surface?
//!
//! `cargo run --release --example own_observer`
#![expect(clippy::print_stdout, reason = "the histogram is what this program is for")]

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;

use impinge::scene::{Overrides, SceneFile};
use impinge::scheme::{Observer, SurfaceHit};
use impinge::simulation::Simulation;

/// Width of a class of the histogram, m/s.
const WIDTH: f64 = 5.0;
/// Hits per character of a bar.
const SCALE: usize = 20;

/// Counts surface hits by their normal speed: first hits and repeated ones.
///
/// An observer overrides what it wants to see of [`Observer`] and ignores the rest, which then costs nothing.
#[derive(Default)]
struct ImpactSpeeds {
    classes: Vec<[usize; 2]>,
}

impl Observer for ImpactSpeeds {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let class = (hit.approach_speed / WIDTH) as usize;
        if class >= self.classes.len() {
            self.classes.resize(class + 1, [0; 2]);
        }
        self.classes[class][usize::from(hit.order > 1)] += 1;
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // The erosive jet with a quarter of its grains, to be done in a moment.
    let overrides = Overrides { set: vec!["source[0].count=2000".into()], ..Overrides::default() };
    let file = SceneFile::read(Path::new("examples/erosive_jet.toml"), &overrides)?;
    let mut simulation = Simulation::new(&file.scene, file.folder()).map_err(|invalid| file.locate(invalid))?;

    let mut speeds = ImpactSpeeds::default();
    simulation.run(&mut speeds, &mut |_| ControlFlow::Continue(()))?;

    println!("normal speed, m/s    first  repeated");
    for (class, [first, repeated]) in speeds.classes.iter().enumerate() {
        let (from, to) = (class as f64 * WIDTH, (class + 1) as f64 * WIDTH);
        let (hashes, dots) = ("#".repeat(first / SCALE), ".".repeat(repeated / SCALE));
        println!("{from:6.0} to {to:3.0} {first:11} {repeated:9}  {hashes}{dots}");
    }
    Ok(())
}
