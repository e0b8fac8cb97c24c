//! What a source will give, told from the scene alone: the numbers of `impinge check`.

use std::f64::consts::{PI, SQRT_2};

use impinge::grains::sphere_volume;
use impinge::scene::{
    Arrangement, Boundary, Distribution, Flow, Interference, NozzleShape, NozzleSource, Radius, Scene, Source, Vec3,
};

/// Means over the radii of a source: radius (m), its square and its cube.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Moments {
    mean: f64,
    square: f64,
    cube: f64,
}

impl Moments {
    fn of(radius: &Radius) -> Self {
        let (mean, cv, lognormal) = match radius {
            Radius::Constant(radius) => (*radius, 0.0, false),
            Radius::Drawn(drawn) => (drawn.mean, drawn.cv, drawn.distribution == Distribution::Lognormal),
        };
        let spread = 1.0 + cv * cv;
        let cube = if lognormal { spread.powi(3) } else { 1.0 + 3.0 * cv * cv };
        Self { mean, square: mean * mean * spread, cube: mean.powi(3) * cube }
    }

    /// What one grain fills: volume (m³), or area (m²) in a planar scene.
    fn content(self, planar: bool) -> f64 {
        if planar { PI * self.square } else { sphere_volume(1.0) * self.cube }
    }

    /// Collision cross-section of two grains: π d² (m²), or 2 d (m) in a planar scene.
    fn cross_section(self, planar: bool) -> f64 {
        if planar { 4.0 * self.mean } else { 4.0 * PI * self.mean.powi(2) }
    }
}

/// Grains of one source, and how densely they come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crowd {
    /// Grains until the end of the run.
    pub(super) count: f64,
    radius: Moments,
    /// Density of the material, kg/m³.
    material: f64,
    /// Grains per m³ (per m² in a planar scene).
    density: f64,
    /// Width of the stream across its velocity, m; the narrower of the two.
    width: f64,
    /// Speed of the whole, m/s.
    speed: f64,
    /// Standard deviation of a velocity component, m/s.
    thermal_speed: f64,
    planar: bool,
}

/// Grains in a box: what blocks and lattices have in common.
struct Filled<'a> {
    count: f64,
    min: Vec3,
    max: Vec3,
    velocity: Vec3,
    thermal_speed: f64,
    radius: &'a Option<Radius>,
    density: Option<f64>,
}

impl Crowd {
    /// What a source gives; nothing for a file, which says itself what it has.
    pub(super) fn of(source: &Source, scene: &Scene) -> Option<Self> {
        match source {
            Source::File(_) => None,
            Source::Nozzle(nozzle) => Some(Self::of_nozzle(nozzle, scene)),
            Source::Block(block) => Some(Self::of_box(
                &Filled {
                    count: block.count as f64,
                    min: block.min,
                    max: block.max,
                    velocity: block.velocity,
                    thermal_speed: block.thermal_speed,
                    radius: &block.radius,
                    density: block.density,
                },
                scene,
            )),
            Source::Lattice(lattice) => Some(Self::of_box(
                &Filled {
                    count: places(lattice.arrangement, lattice.cells, scene.domain.planar),
                    min: lattice.min,
                    max: lattice.max,
                    velocity: lattice.velocity,
                    thermal_speed: lattice.thermal_speed,
                    radius: &lattice.radius,
                    density: lattice.density,
                },
                scene,
            )),
        }
    }

    fn of_box(filled: &Filled<'_>, scene: &Scene) -> Self {
        let planar = scene.domain.planar;
        let axes: &[usize] = if planar { &[0, 2] } else { &[0, 1, 2] };
        let side = |i: usize| filled.max[i] - filled.min[i];
        let speed = |i: usize| filled.velocity[i].abs();
        // The stream flows along the axis of its largest velocity component.
        let along = axes.iter().copied().fold(0, |best, i| if speed(i) > speed(best) { i } else { best });
        Self {
            count: filled.count,
            radius: Moments::of(filled.radius.as_ref().unwrap_or(&scene.grain.radius)),
            material: filled.density.unwrap_or(scene.grain.density),
            density: filled.count / axes.iter().map(|&i| side(i)).product::<f64>(),
            width: axes.iter().filter(|&&i| i != along).map(|&i| side(i)).fold(f64::INFINITY, f64::min),
            speed: axes.iter().map(|&i| speed(i).powi(2)).sum::<f64>().sqrt(),
            thermal_speed: filled.thermal_speed,
            planar,
        }
    }

    fn of_nozzle(nozzle: &NozzleSource, scene: &Scene) -> Self {
        let planar = scene.domain.planar;
        let radius = Moments::of(nozzle.radius.as_ref().unwrap_or(&scene.grain.radius));
        let (width, opening) = match nozzle.shape {
            NozzleShape::Circle { diameter } if planar => (diameter, diameter),
            NozzleShape::Circle { diameter } => (diameter, 0.25 * PI * diameter * diameter),
            NozzleShape::Slot { width, .. } if planar => (width, width),
            NozzleShape::Slot { width, breadth, .. } => (width.min(breadth), width * breadth),
        };
        let density = match nozzle.flow {
            Flow::VolumeFraction(fraction) => fraction / radius.content(planar),
            Flow::NumberFlux(flux) => flux / (opening * nozzle.speed),
        };
        let from = nozzle.start.max(scene.run.start);
        let to = nozzle.stop.unwrap_or(f64::INFINITY).min(scene.run.until);
        Self {
            count: (density * opening * nozzle.speed * (to - from).max(0.0)).round(),
            radius,
            material: nozzle.density.unwrap_or(scene.grain.density),
            density,
            width,
            speed: nozzle.speed,
            thermal_speed: 0.0,
            planar,
        }
    }

    /// Part of the volume (of the area in a planar scene) that grains fill.
    pub(super) fn fraction(&self) -> f64 {
        self.density * self.radius.content(self.planar)
    }

    /// Mean radius, m.
    pub(super) fn mean_radius(&self) -> f64 {
        self.radius.mean
    }

    /// Mass of all grains, kg.
    pub(super) fn mass(&self) -> f64 {
        self.count * self.grain_mass()
    }

    /// Mean mass of a grain, kg.
    pub(super) fn grain_mass(&self) -> f64 {
        self.material * self.radius.content(false)
    }

    /// Mean kinetic energy of a grain at the start, J.
    pub(super) fn kinetic_energy(&self) -> f64 {
        let axes = if self.planar { 2.0 } else { 3.0 };
        0.5 * self.grain_mass() * (self.speed.powi(2) + axes * self.thermal_speed.powi(2))
    }

    /// Mean free path of a dilute gas as dense as this, m: 1 / (√2 n π d²), or 1 / (√2 n 2 d) in a planar scene.
    pub(super) fn mean_free_path(&self) -> f64 {
        1.0 / (SQRT_2 * self.density * self.radius.cross_section(self.planar))
    }

    /// Expected grain–grain collisions and their formula; nothing where there is no simple one.
    pub(super) fn collisions(&self, scene: &Scene) -> Option<(f64, &'static str)> {
        if scene.run.interference == Interference::None {
            return Some((0.0, "grains pass through each other"));
        }
        if self.thermal_speed > 0.0 && !self.planar {
            let duration = scene.run.until - scene.run.start;
            return Some((0.5 * self.count * self.enskog_rate() * duration, ENSKOG));
        }
        let meets = self.speed > 0.0 && !scene.surface.is_empty() && scene.domain.boundary == Boundary::Open;
        meets.then(|| (self.count * self.width / self.mean_free_path(), CROSSING))
    }

    /// Collisions of one grain per second in an elastic gas: 24 phi chi sqrt(T/m) / (sqrt(pi) d), with chi of Carnahan & Starling
    /// (1969).
    fn enskog_rate(&self) -> f64 {
        let phi = self.fraction();
        let chi = (1.0 - 0.5 * phi) / (1.0 - phi).powi(3);
        24.0 * phi * chi / PI.sqrt() * self.thermal_speed / (2.0 * self.radius.mean)
    }
}

/// Places of a lattice. In a planar scene it has one layer.
fn places(arrangement: Arrangement, cells: [u32; 3], planar: bool) -> f64 {
    let [x, y, z] = cells.map(f64::from);
    match (arrangement, planar) {
        (Arrangement::Cubic, false) => x * y * z,
        (Arrangement::Cubic, true) => x * z,
        (Arrangement::FaceCentred, false) => 4.0 * x * y * z,
        (Arrangement::FaceCentred, true) => 2.0 * x * z,
    }
}

/// See [`Crowd::enskog_rate`]; every collision is one of two grains.
const ENSKOG: &str =
    "12 N phi chi s t / (√π d), chi = (1 - phi/2) / (1 - phi)³: Enskog's elastic gas with thermal speed s";

/// A grain that came to the surface leaves the stream sideways, across about its width. The reference jets of 2000 and 8000
/// grains (restitution 0.8, smooth, volume fractions 0.08 and 0.34) have 1.2 and 1.0 times this number; with friction 0.4 the
/// larger has twice as many, and a jet on dimples, which keep the grains together, had five times.
const CROSSING: &str = "N W / mean free path: every grain arrives and crosses the width W of the stream once; several \
times more where friction, low restitution or hollows hold grains together";

#[cfg(test)]
mod tests {
    use super::*;
    use impinge::scene::{Overrides, SceneFile};

    fn jet(set: &str) -> Scene {
        let text = include_str!("../../examples/erosive_jet.toml");
        let overrides = Overrides { set: vec![set.to_owned()], ..Overrides::default() };
        SceneFile::parse("erosive_jet.toml".as_ref(), text, &overrides).expect("the example is valid").scene
    }

    fn crowd(scene: &Scene) -> Crowd {
        Crowd::of(&scene.source[0], scene).expect("this is no file")
    }

    /// Collisions counted by an independent event-driven program: 233 400 and 16 614.
    #[test]
    fn collisions_of_the_reference_jets_are_of_the_right_size() {
        for (count, counted) in [(8000, 233_400.0), (2000, 16_614.0)] {
            let scene = jet(&format!("source[0].count={count}"));
            let (expected, _) = crowd(&scene).collisions(&scene).expect("there is a surface");
            assert!((0.7..1.4).contains(&(expected / counted)), "{expected} against {counted}");
        }
    }

    #[test]
    fn a_nozzle_gives_the_count_of_its_volume_fraction() {
        let nozzle = "source=[{kind='nozzle', shape={circle={diameter=0.2}}, centre=[0,0,1], axis=[0,0,-1], speed=10, \
                      stop=0.02, flow={volume_fraction=0.1}}]";
        let crowd = crowd(&jet(nozzle));
        // phi A v t / V = 0.1 (pi 0.01 m2) (10 m/s) (0.02 s) / (4/3 pi 1e-6 m3)
        assert_eq!(crowd.count, 150.0);
        assert!((crowd.fraction() - 0.1).abs() < 1e-15);
    }

    /// Enskog's rate at phi = 0.2 is 4.7603 for unit diameter and temperature (Carnahan & Starling).
    #[test]
    fn the_rate_of_a_gas_is_enskogs() {
        let gas = Crowd {
            density: 0.2 / sphere_volume(0.5),
            radius: Moments::of(&Radius::Constant(0.5)),
            thermal_speed: 1.0,
            ..crowd(&jet("seed=1"))
        };
        assert!((gas.enskog_rate() - 4.7603).abs() < 1e-4, "{}", gas.enskog_rate());
    }
}
