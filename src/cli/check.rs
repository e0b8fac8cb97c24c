//! `impinge check`

use std::fmt::{self, Write};

use impinge::scene::{Friction, Scene, SceneFile, Source, Surface};
use impinge::simulation::Simulation;

use super::estimate::Crowd;
use super::{Ending, Failure, SceneArgs, digits, forces, plain_or_scientific, print};

/// Memory that a grain may take with its events and neighbours, bytes: the bound that the engine is held to.
const BYTES_PER_GRAIN: f64 = 600.0;

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
}

/// Validates a scene, sources and surfaces included, and prints what it would do.
pub(super) fn check(args: &Args) -> Result<Ending, Failure> {
    let file = args.scene.read()?;
    let simulation = Simulation::new(&file.scene, file.folder()).map_err(|invalid| file.locate(invalid))?;
    let mut text = String::new();
    describe(&mut text, &file, &simulation).expect("a string takes any text");
    print(&text)?;
    Ok(Ending::Done)
}

fn describe(out: &mut String, file: &SceneFile, simulation: &Simulation) -> fmt::Result {
    let scene = &file.scene;
    let (run, domain) = (&scene.run, &scene.domain);
    writeln!(out, "{}: valid", file.path().display())?;
    if !scene.title.is_empty() {
        writeln!(out, "{}", scene.title)?;
    }
    let (scheme, interference) = (name(run.scheme), name(run.interference));
    writeln!(out, "\nrun         {} to {} s, {scheme}", run.start, run.until)?;
    if let Some(step) = simulation.planned_step() {
        let count = ((run.until - run.start) / step).ceil();
        writeln!(out, "            steps of {} s, about {count} of them", plain_or_scientific(digits(step, 4)))?;
    }
    writeln!(out, "            interference {interference}, seed {}, {} frames", scene.seed, run.frames)?;
    let planar = if domain.planar { ", planar" } else { "" };
    writeln!(out, "domain      {}{planar}, {:?} to {:?} m", name(domain.boundary), domain.min, domain.max)?;
    for (name, contact) in [("grain", &scene.contact.grain), ("surface", &scene.contact.surface)] {
        if let Some(contact) = contact {
            writeln!(out, "contact     {name}: restitution {}, {}", contact.restitution, friction(&contact.friction))?;
        }
    }
    let count = sources(out, scene, simulation.counts())?;
    forces::describe(out, scene, file.folder(), count)?;
    for (i, surface) in scene.surface.iter().enumerate() {
        writeln!(out, "surface[{i}]  {}", surface_in_words(surface))?;
        for (_, report) in simulation.surface().reports().filter(|(number, _)| *number == i) {
            for line in report.to_string().lines() {
                writeln!(out, "            {line}")?;
            }
        }
    }
    Ok(())
}

/// Describes the sources and tells how many grains they give in all.
fn sources(out: &mut String, scene: &Scene, placed: &[usize]) -> Result<f64, fmt::Error> {
    let mut count = 0.0;
    let what = if scene.domain.planar { "area fraction" } else { "volume fraction" };
    for (i, (source, &rows)) in scene.source.iter().zip(placed).enumerate() {
        let kind = match source {
            Source::File(table) => {
                count += rows as f64;
                writeln!(out, "source[{i}]   file {}: {rows} grains", table.path)?;
                continue;
            }
            Source::Block(_) => "block",
            Source::Lattice(_) => "lattice",
            Source::Nozzle(_) => "nozzle",
        };
        let Some(crowd) = Crowd::of(source, scene) else { continue };
        count += crowd.count;
        let (radius, mass) = (crowd.mean_radius(), digits(crowd.mass(), 4));
        writeln!(out, "source[{i}]   {kind}: {} grains, mean radius {radius} m, in all {mass} kg", crowd.count)?;
        writeln!(out, "            {what} {}", digits(crowd.fraction(), 3))?;
        writeln!(
            out,
            "            mean free path {} m in a dilute gas as dense as this",
            digits(crowd.mean_free_path(), 3)
        )?;
        match crowd.collisions(scene) {
            Some((number, formula)) => {
                writeln!(out, "            about {} collisions between grains", digits(number, 2))?;
                writeln!(out, "            ({formula})")?;
            }
            None => writeln!(out, "            collisions between grains not estimated")?,
        }
    }
    let megabytes = digits(count * BYTES_PER_GRAIN / 1e6, 2);
    writeln!(out, "in all      {count} grains, at most {megabytes} MB ({BYTES_PER_GRAIN} bytes a grain)")?;
    Ok(count)
}

fn friction(friction: &Friction) -> String {
    match friction {
        Friction::Coefficient(0.0) => "smooth".to_owned(),
        Friction::Coefficient(mu) => format!("friction {mu}"),
        Friction::StaticDynamic(mu) => format!("friction {} static, {} dynamic", mu.static_, mu.dynamic),
        Friction::Regularised(law) => format!("friction {}, regularised below {} m/s", law.coefficient, law.slip_speed),
    }
}

fn surface_in_words(surface: &Surface) -> String {
    match surface {
        Surface::Plane(plane) => format!("plane through {:?} m, normal {:?}", plane.point, plane.normal),
        Surface::Mesh(mesh) => format!("mesh {}, scale {}", mesh.path, mesh.scale),
        Surface::Disc(disc) => format!("disc of radius {} m, {} segments", disc.radius, disc.segments),
        Surface::Rectangle(rectangle) => format!("rectangle, {:?} m", rectangle.size),
        Surface::Sine(sine) => format!("sine wave, amplitude {} m, wavelength {} m", sine.amplitude, sine.wavelength),
    }
}

/// The name of a choice as it stands in the scene file.
fn name(choice: impl serde::Serialize) -> String {
    serde_json::to_value(choice).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}
