//! The jets of Arbelaez, Zohdi & Dornfeld (2009): a nozzle over a surface at rest, and what is measured of it.

use std::f64::consts::PI;

use super::{Error, Settings, run_observed};
use crate::estimate::Estimate;
use crate::grains::sphere_volume;
use crate::observe::SurfaceShape;
use crate::observe::measure::{Flow, FreeJet, Outflow, Stress, SurfaceStress};
use crate::scene::{Measure, Scene};

/// Diameter of the grains, m; the paper does not give it, nor density or width, so all that is stated here is in diameters, widths L of the jet and the time
/// d / v0 in which a grain flies its diameter.
const DIAMETER: f64 = 0.01;
/// Density of the grains, kg/m³.
const DENSITY: f64 = 2500.0;
/// Restitution between grains, and friction of all contacts (section 7).
const GRAIN_RESTITUTION: f64 = 0.3;
pub(super) const STATIC: f64 = 0.3;
pub(super) const DYNAMIC: f64 = 0.2;
/// Patches and cells per width of the jet.
pub(super) const PER_WIDTH: u32 = 8;
/// A jet is measured after it has flown its width so many times: later, stresses do not drift.
const SETTLE: f64 = 30.0;

/// Breadth of a sine surface, in diameters. It does not change along its breadth.
const BREADTH: f64 = 20.0;

/// What the nozzle is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outline {
    /// A slot in a planar scene (section 7), without divergence.
    Slot,
    /// A circle, with divergence (section 8).
    Circle,
}

/// A force between grains, in groups without dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Force {
    /// Energy of repulsion of two grains as far apart as the jet has them on average, s, over the kinetic energy m v0² / 2 of one:
    /// α2 / (2 s²) / (m v0² / 2), where β2 = 3.
    pub(super) strength: f64,
    /// Distance α2 / α1 at which two grains neither attract nor repel each other, over s, where β1 = 2 and β2 = 3.
    pub(super) equilibrium: f64,
}

/// A jet that flows towards negative x, at an angle from the normal of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Impinging {
    pub(super) outline: Outline,
    /// Width L of the jet, in diameters.
    pub(super) width: f64,
    /// Divergence at the rim, degrees.
    pub(super) divergence: f64,
    /// Angle of attack, degrees.
    pub(super) angle: f64,
    /// Volume fraction at the nozzle; area fraction of a slot.
    pub(super) fraction: f64,
    /// Speed at the nozzle, m/s.
    pub(super) speed: f64,
    /// Restitution of the surface.
    pub(super) restitution: f64,
    /// Asperities per width of the jet, and their amplitude in widths; a plane where either is 0.
    pub(super) asperities: [f64; 2],
    pub(super) force: Option<Force>,
    /// Whether grains meet each other.
    pub(super) interacting: bool,
    /// Distance of the nozzle from the surface along the axis, and half the width of the domain, in widths.
    pub(super) distance: f64,
    pub(super) reach: f64,
    /// How long is measured, d / v0.
    pub(super) duration: f64,
    /// Batches of one run.
    pub(super) batches: u32,
    /// Samples of the flow during the run.
    pub(super) samples: u32,
    pub(super) seed: u64,
}

impl Impinging {
    /// The base values of section 7: 30°, area fraction 0.1, 20 m/s, restitution 0.3. The jet is six diameters wide: so a grain meets 4 α L / (π d) = 0.8
    /// others on its way across the jet, which gives profiles like those that are described. In jets of some twenty diameters and more grains of such a low
    /// restitution pile up on the surface, where each collides thousands of times.
    pub(super) fn slot() -> Self {
        Self {
            outline: Outline::Slot,
            width: 6.0,
            divergence: 0.0,
            angle: 30.0,
            fraction: 0.1,
            speed: 20.0,
            restitution: 0.3,
            asperities: [0.0, 0.0],
            force: None,
            interacting: true,
            distance: 2.0,
            reach: 4.0,
            duration: 1000.0,
            batches: 5,
            samples: 2,
            seed: 1,
        }
    }

    /// Those of section 8: a circle, six diameters wide, whose rim diverges by 4°.
    pub(super) fn round() -> Self {
        Self { outline: Outline::Circle, divergence: 4.0, distance: 1.5, reach: 2.5, ..Self::slot() }
    }

    /// Half the length of what the jet would hit without a nozzle's divergence, in widths.
    pub(super) fn half_footprint(&self) -> f64 {
        0.5 / self.angle.to_radians().cos()
    }

    fn is_planar(&self) -> bool {
        self.outline == Outline::Slot
    }

    /// Mean distance s of the grains at the nozzle, m: n^(-1/2), or n^(-1/3) in three dimensions.
    fn spacing(&self) -> f64 {
        match self.outline {
            Outline::Slot => (PI * DIAMETER.powi(2) / 4.0 / self.fraction).sqrt(),
            Outline::Circle => (sphere_volume(0.5 * DIAMETER) / self.fraction).cbrt(),
        }
    }

    /// The jet as it is where no grain meets another. In a planar scene its density is a mass per area.
    pub(super) fn free(&self) -> FreeJet {
        let mass = DENSITY * sphere_volume(0.5 * DIAMETER);
        let density = match self.outline {
            Outline::Slot => self.fraction * mass / (PI * DIAMETER.powi(2) / 4.0),
            Outline::Circle => self.fraction * DENSITY,
        };
        FreeJet { density, speed: self.speed, angle: self.angle, restitution: self.restitution }
    }

    fn near_field(&self) -> String {
        let Some(Force { strength, equilibrium }) = self.force else { return String::new() };
        let spacing = self.spacing();
        let mass = DENSITY * sphere_volume(0.5 * DIAMETER);
        let alpha2 = strength * mass * self.speed.powi(2) * spacing.powi(2);
        let alpha1 = alpha2 / (equilibrium * spacing);
        // A twentieth of a diameter a sub-step: the field changes over the spacing, which is 57 times that.
        let substep = 0.05 * DIAMETER / self.speed;
        format!(
            "near_field = {{ alpha1 = {alpha1:?}, beta1 = 2, alpha2 = {alpha2:?}, beta2 = 3, substep = {substep:?} }}"
        )
    }

    fn surface(&self) -> String {
        let [number, amplitude] = self.asperities;
        let width = self.width * DIAMETER;
        if number == 0.0 || amplitude == 0.0 {
            return "kind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]".into();
        }
        format!(
            "kind = \"sine\"\ncentre = [0, 0, 0]\nsize = [{:?}, {:?}]\namplitude = {:?}\nwavelength = {:?}\npieces = 16",
            2.0 * self.reach * width + 4.0 * DIAMETER,
            BREADTH * DIAMETER,
            amplitude * width,
            width / number
        )
    }

    /// Its scene, which measures the stress on the surface, the outflow on the side to which the jet flows, and the flow.
    ///
    /// # Panics
    /// If a number is none (NaN).
    pub(super) fn scene(&self) -> Scene {
        let width = self.width * DIAMETER;
        let [sin, cos] = [self.angle.to_radians().sin(), self.angle.to_radians().cos()];
        let unit = DIAMETER / self.speed;
        let from = SETTLE * self.width * unit;
        // The axis is aimed at where centres are when grains hit, a radius above the surface.
        let (x, z) = (self.distance * width * sin, self.distance * width * cos + 0.5 * DIAMETER);
        let right = (self.reach * width).max(x + 0.5 * width * cos + 2.0 * DIAMETER);
        let top = (3.0 * width).max(z + 0.5 * width * sin + 2.0 * DIAMETER);
        let low = self.asperities[1] * width + 2.0 * DIAMETER;
        let (shape, size, cells, depth) = match self.outline {
            Outline::Slot => {
                ("{ slot = { width = W, breadth = 1, along = [0, 1, 0] } }", [6.0, 1.0], [6 * PER_WIDTH, 1], 0.5)
            }
            Outline::Circle => {
                ("{ circle = { diameter = W } }", [4.0, 2.0], [4 * PER_WIDTH, 2 * PER_WIDTH], self.reach * width)
            }
        };
        let shape = shape.replace('W', &format!("{width:?}"));
        let interference = if self.interacting { "all" } else { "none" };
        let (left, side) = (self.reach * width, self.reach * width);
        let flow_cells = [2 * PER_WIDTH * self.reach as u32, 1, 3 * PER_WIDTH];
        let text = format!(
            r#"
            seed = {seed}
            run = {{ until = {until:?}, interference = "{interference}" }}
            domain = {{ min = [-{left:?}, -{side:?}, -{low:?}], max = [{right:?}, {side:?}, {top:?}], planar = {planar} }}
            grain = {{ radius = {radius:?}, density = {DENSITY:?} }}
            contact.grain = {{ restitution = {GRAIN_RESTITUTION}, friction = {{ static = {STATIC}, dynamic = {DYNAMIC} }} }}
            contact.surface = {{ restitution = {restitution:?}, friction = {{ static = {STATIC}, dynamic = {DYNAMIC} }} }}
            output = {{ samples = {samples} }}
            {near_field}
            [[source]]
            kind = "nozzle"
            shape = {shape}
            centre = [{x:?}, 0, {z:?}]
            axis = [-{sin:?}, 0, -{cos:?}]
            speed = {speed:?}
            divergence = {divergence:?}
            flow = {{ volume_fraction = {fraction:?} }}
            [[surface]]
            {surface}
            [[measure]]
            kind = "surface-stress"
            patches = {{ centre = [0, 0, 0], size = [{:?}, {:?}], cells = {cells:?} }}
            direction = [-1, 0, 0]
            from = {from:?}
            batches = {batches}
            [[measure]]
            kind = "outflow"
            sides = ["x-min"]
            length = {width:?}
            from = {from:?}
            batches = {batches}
            [[measure]]
            kind = "flow"
            min = [-{left:?}, -{depth:?}, 0]
            max = [{left:?}, {depth:?}, {:?}]
            cells = {flow_cells:?}
            from = {from:?}
            batches = {batches}
            "#,
            size[0] * width,
            size[1] * width,
            3.0 * width,
            seed = self.seed,
            until = from + self.duration * unit,
            planar = self.is_planar(),
            radius = 0.5 * DIAMETER,
            restitution = self.restitution,
            samples = self.samples,
            near_field = self.near_field(),
            speed = self.speed,
            divergence = self.divergence,
            fraction = self.fraction,
            surface = self.surface(),
            batches = self.batches,
        );
        toml::from_str(&text).expect("the scene is right")
    }
}

/// Stresses on a place of the surface (in widths of the jet), over those of the jet whose grains do not meet: the pressure of eq. (50), and
/// dynamic friction times that (eq. 54 prints the static one, but what is said of figure 8 holds for the dynamic one only).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) normal: f64,
    /// Positive towards negative x, whither the jet flows.
    pub(super) shear: f64,
    /// Positive towards negative y.
    pub(super) across: f64,
}

/// What was measured of a jet, in all its copies together.
pub(super) struct Measured {
    pub(super) jet: Impinging,
    pub(super) stress: SurfaceStress,
    pub(super) outflow: Outflow,
    /// Of the first copy.
    pub(super) flow: Flow,
}

impl Measured {
    /// Places of the patches, and the stresses on them; one call of `of` for each batch left out.
    pub(super) fn derived(&self, of: impl Fn(&[Spot]) -> f64) -> Estimate {
        let pressure = self.jet.free().pressure();
        let width = self.length();
        let patches = self.stress.patches().all();
        self.stress.derived(|stresses| {
            let spot = |(stress, patch): (&Stress, &crate::observe::measure::Patch)| Spot {
                x: patch.centre.x / width,
                y: patch.centre.y / width,
                normal: stress.normal / pressure,
                shear: stress.shear / (DYNAMIC * pressure),
                across: stress.across / (DYNAMIC * pressure),
            };
            of(&stresses.iter().zip(patches).map(spot).collect::<Vec<_>>())
        })
    }

    /// Width L of the jet, m.
    pub(super) fn length(&self) -> f64 {
        self.jet.width * DIAMETER
    }

    /// Momentum along the surface that a slot brings in, kg m/s² (N).
    pub(super) fn brought_in(&self) -> f64 {
        let FreeJet { density, speed, angle, .. } = self.jet.free();
        density * speed.powi(2) * angle.to_radians().sin() * self.length()
    }

    /// A part of the stress over x / L; patches side by side are taken together.
    pub(super) fn profile(&self, of: fn(&Spot) -> f64) -> Vec<(f64, Estimate)> {
        let mut places: Vec<f64> = self.stress.patches().all().iter().map(|patch| patch.centre.x).collect();
        places.sort_by(f64::total_cmp);
        places.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        let width = self.length();
        let at = |x: f64| self.derived(|spots| mean(spots, |spot| (spot.x - x).abs() < 1e-6, of));
        places.into_iter().map(|x| (x / width, at(x / width))).collect()
    }
}

/// Mean of a quantity over the spots of a region.
pub(super) fn mean(spots: &[Spot], region: impl Fn(&Spot) -> bool, of: impl Fn(&Spot) -> f64) -> f64 {
    let inside: Vec<f64> = spots.iter().filter(|spot| region(spot)).map(of).collect();
    inside.iter().sum::<f64>() / inside.len() as f64
}

/// The largest mean of neighbouring spots over half a width of the jet: a peak that noise does not raise.
pub(super) fn peak(spots: &[Spot], of: impl Fn(&Spot) -> f64) -> f64 {
    let values: Vec<f64> = spots.iter().map(of).collect();
    let count = PER_WIDTH as usize / 2;
    values.windows(count).map(|near| near.iter().sum::<f64>() / count as f64).fold(f64::MIN, f64::max)
}

/// Length (in widths of the jet) of the middle of the surface that bears this part of the normal stress, with equal parts of the rest on both sides.
pub(super) fn loaded_width(spots: &[Spot], part: f64) -> f64 {
    let total: f64 = spots.iter().map(|spot| spot.normal).sum();
    let end = |share: f64| {
        let mut sum = 0.0;
        for spot in spots {
            let next = sum + spot.normal / total;
            if next >= share {
                // Within the patch its stress is even.
                return spot.x + ((share - sum) / (next - sum) - 0.5) / f64::from(PER_WIDTH);
            }
            sum = next;
        }
        f64::NAN
    };
    end(0.5 + 0.5 * part) - end(0.5 - 0.5 * part)
}

/// Runs so many copies of each jet, with seeds that count on from that of the settings; put long runs first.
pub(super) fn run_copies(jets: &[Impinging], copies: u64, settings: &Settings<'_>) -> Result<Vec<Measured>, Error> {
    let copy = |(number, jet): (usize, &Impinging)| {
        let first = settings.seed.wrapping_add(number as u64 * copies);
        (0..copies).map(|copy| Impinging { seed: first.wrapping_add(copy), ..*jet }).collect::<Vec<_>>()
    };
    let tasks: Vec<Impinging> = jets.iter().enumerate().flat_map(copy).collect();
    let runs = run_observed(&tasks, settings, Impinging::scene, |jet| watch(&jet.scene()), |_, observer| observer)?;
    let mut runs = runs.into_iter();
    let gather = |jet: &Impinging| {
        let (mut stress, (mut outflow, flow)) = runs.next()?;
        for (other, (more, _)) in runs.by_ref().take(copies as usize - 1) {
            stress.absorb(&other);
            outflow.absorb(&more);
        }
        Some(Measured { jet: *jet, stress, outflow, flow })
    };
    Ok(jets.iter().filter_map(gather).collect())
}

type Watch = (SurfaceStress, (Outflow, Flow));

/// The measurements of a jet's scene.
fn watch(scene: &Scene) -> Watch {
    let [Measure::SurfaceStress(stress), Measure::Outflow(outflow), Measure::Flow(flow)] = scene.measure.as_slice()
    else {
        unreachable!("the scene of a jet has these")
    };
    // Its patches are those of a rectangle: no shape is needed.
    let stress = SurfaceStress::new(stress, scene, &SurfaceShape::default());
    (stress, (Outflow::new(outflow, scene), Flow::new(flow, scene)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::check;
    use crate::study::reproduce::ensemble::unwatched;

    #[test]
    fn its_scenes_are_valid() {
        let rough = Impinging { asperities: [4.0, 0.02], ..Impinging::slot() };
        let forced = Impinging { force: Some(Force { strength: 0.1, equilibrium: 8.0 }), ..Impinging::slot() };
        for jet in [Impinging::slot(), Impinging::round(), rough, forced] {
            assert!(check(&jet.scene()).is_ok(), "{:?}", check(&jet.scene()));
        }
        // Two grains as far apart as the jet has them: a tenth of the kinetic energy of one.
        let field = forced.scene().near_field.expect("a near field");
        let mass = DENSITY * sphere_volume(0.5 * DIAMETER);
        approx::assert_relative_eq!(
            field.alpha2 / (2.0 * forced.spacing().powi(2)),
            0.1 * 0.5 * mass * 400.0,
            max_relative = 1e-14
        );
        approx::assert_relative_eq!(field.alpha2 / field.alpha1, 8.0 * forced.spacing(), max_relative = 1e-14);
    }

    #[test]
    fn without_interference_a_jet_is_a_square_wave_of_height_one() {
        let jet = Impinging { interacting: false, angle: 60.0, duration: 3000.0, ..Impinging::slot() };
        let measured = run_copies(&[jet], 2, &unwatched(true)).expect("it runs").remove(0);
        // Grains hit with their centres over half a width and 1 / cos 60° more; inside, all of it has the exact stress.
        let inside = measured.derived(|spots| mean(spots, |spot| spot.x.abs() < 0.9, |spot| spot.normal));
        assert!(inside.error < 0.02 && inside.deviation(Estimate::exact(1.0)) < 4.0, "{inside}");
        let shear = measured.derived(|spots| mean(spots, |spot| spot.x.abs() < 0.9, |spot| spot.shear));
        approx::assert_relative_eq!(shear.value, inside.value, max_relative = 1e-9);
        let width = measured.derived(|spots| loaded_width(spots, 0.5));
        assert!((width.value - 1.0).abs() < 0.1, "{width}");
        assert_eq!(measured.derived(|spots| mean(spots, |spot| spot.x.abs() > 1.13, |spot| spot.normal)).value, 0.0);
    }

    #[test]
    fn peaks_and_widths_of_a_known_profile() {
        let spot = |index: i32| {
            let x = (f64::from(index) + 0.5) / f64::from(PER_WIDTH);
            Spot { x, y: 0.0, normal: if x.abs() < 1.0 { 1.0 - x.abs() } else { 0.0 }, shear: 0.0, across: 0.0 }
        };
        let spots: Vec<Spot> = (-16..16).map(spot).collect();
        approx::assert_relative_eq!(peak(&spots, |spot| spot.normal), 0.875, max_relative = 1e-14);
        // A triangle: half of it lies within 1 - 1/√2 of the middle. Its sum bends within a patch of length h, which is taken to be even: by h² / 8 of
        // slope 1 at the most, where the triangle is 1/√2 high, at both ends.
        let bend = 2.0 * f64::from(PER_WIDTH).powi(-2) / 8.0 * 2.0_f64.sqrt();
        approx::assert_abs_diff_eq!(loaded_width(&spots, 0.5), 2.0 - 2.0_f64.sqrt(), epsilon = bend);
    }
}
