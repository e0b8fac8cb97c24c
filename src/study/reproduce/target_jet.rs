//! A granular jet that hits the middle of a target of a few jet widths: the set-up of Huang, Chan & Zamankhan (2010), and what its studies share.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::ensemble::run_observed;

use super::{Error, Report, Settings};
use crate::estimate::Estimate;
use crate::observe::measure::{Ejecta, Ejected, Window};
use crate::scene::{Scene, Scheme};

/// Diameter of the grains, m; the paper has 0.25 to 2 mm. Without gravity and at a restitution that does not depend on speed, results depend on
/// ratios only.
pub(super) const DIAMETER: f64 = 1e-3;
/// Speed of the jet U_0, m/s.
pub(super) const SPEED: f64 = 10.0;
/// Density of glass, kg/m³.
pub(super) const DENSITY: f64 = 2500.0;
/// Area fraction of circles in a hexagonal packing: π / √12.
const CLOSEST: f64 = 0.906_899_682;
/// Area fraction of a packed jet: a hexagonal lattice with gaps of 6.5 % of a diameter, as the paper has "a very tiny gap" between the grains.
pub(super) const PACKED: f64 = 0.8;
/// Area fraction of a loose jet: near the most that grains at random places reach.
pub(super) const LOOSE: f64 = 0.4;
/// Volume fraction of a round jet.
pub(super) const ROUND: f64 = 0.3;
/// Speed of the grains of a packed jet about U_0, over U_0: without it the rows of the lattice would arrive one upon the other.
const DISORDER: f64 = 0.01;
/// Distance of the front of a packed jet from the target, and of a nozzle, in widths of the jet: beyond what piles up on the widest target.
const GAP: f64 = 1.0;
const NOZZLE: f64 = 4.0;
/// The stream is steady, as far as the end of the domain, so long after its front has arrived; in the time in which it flies its width.
const SETTLED: f64 = 7.0;
/// The flow over the target is steady so long after the front has arrived; and a packed jet is looked at until so long before its end arrives.
const PILED: f64 = 4.0;
const TAIL: f64 = 4.0;
/// From the rim of the target, or the jet if that is wider, to the side of the domain, and from the target to its bottom, in widths of the jet.
const REACH: f64 = 3.0;
const DEPTH: f64 = 6.0;
/// Estimates that are so many standard errors apart differ. An error from five or six copies is itself uncertain by a third: beyond four of them lies
/// one in a hundred.
pub(super) const DEVIATIONS: f64 = 4.0;

/// How the grains of a jet are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    /// Planar: a hexagonal lattice, [`PACKED`].
    Packed,
    /// Planar: at random places, [`LOOSE`].
    Loose,
    /// In space: a round jet of grains at random places, [`ROUND`], on a disc.
    Round,
}

/// A jet on a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TargetJet {
    pub(super) stream: Stream,
    /// Width of the jet in grains, about: D_jet / d. A packed jet has whole columns.
    pub(super) across: f64,
    /// R* = D_tar / D_jet.
    pub(super) target: f64,
    /// Of grains and target.
    pub(super) restitution: f64,
    /// Of grains and target.
    pub(super) friction: f64,
    /// Length of the jet, in its widths.
    pub(super) length: f64,
    pub(super) scheme: Scheme,
    pub(super) seed: u64,
}

impl TargetJet {
    /// The grains of the paper: e = 0.8, mu = 0.2.
    pub(super) fn of(across: f64, target: f64) -> Self {
        Self {
            stream: Stream::Packed,
            across,
            target,
            restitution: 0.8,
            friction: 0.2,
            length: 14.0,
            scheme: Scheme::EventDriven,
            seed: 1,
        }
    }

    /// Columns and rows of pairs of a packed jet, and the distance of columns, m.
    fn lattice(&self) -> (f64, f64, f64) {
        let side = DIAMETER * (CLOSEST / PACKED).sqrt();
        let columns = (self.across * DIAMETER / side).round();
        (columns, (self.length * columns / 3.0_f64.sqrt()).round(), side)
    }

    /// D_jet, m.
    pub(super) fn width(&self) -> f64 {
        match self.stream {
            Stream::Packed => {
                let (columns, _, side) = self.lattice();
                columns * side
            }
            Stream::Loose | Stream::Round => self.across * DIAMETER,
        }
    }

    /// The time in which the jet flies its width, s.
    pub(super) fn time(&self) -> f64 {
        self.width() / SPEED
    }

    /// When its front arrives, in units of [`time`](Self::time).
    fn arrival(&self) -> f64 {
        if self.stream == Stream::Packed { GAP } else { NOZZLE }
    }

    /// The part of the run in which the stream is steady.
    pub(super) fn steady(&self, batches: usize) -> Window {
        let [from, until] = [SETTLED, self.length].map(|time| (self.arrival() + time) * self.time());
        Window { from, until, batches }
    }

    /// The part of the run in which the flow over the target is steady, and the end of a packed jet is still four widths above it.
    pub(super) fn flowing(&self, batches: usize) -> Window {
        let [from, until] = [PILED, self.length - TAIL].map(|time| (self.arrival() + time) * self.time());
        Window { from, until, batches }
    }

    /// Momentum flux of the jet, ρ U², Pa; planar jets as thick as a grain.
    pub(super) fn momentum_flux(&self) -> f64 {
        // Of a layer as thick as a sphere the spheres fill 2/3 of the circles.
        let fraction = match self.stream {
            Stream::Packed => PACKED * 2.0 / 3.0,
            Stream::Loose => LOOSE * 2.0 / 3.0,
            Stream::Round => ROUND,
        };
        DENSITY * fraction * SPEED * SPEED
    }

    /// Its scene.
    ///
    /// # Panics
    /// If a number is none (NaN).
    pub(super) fn scene(&self) -> Scene {
        let Self { across, restitution, friction, seed, .. } = self;
        let width = self.width();
        let (target, planar) = (0.5 * self.target * width, self.stream != Stream::Round);
        let (columns, rows, side) = self.lattice();
        let (low, height) = (GAP * width, rows * side * 3.0_f64.sqrt());
        let (half, thick, nozzle) = (0.5 * width, 0.5 * DIAMETER, NOZZLE * width);
        let source = match self.stream {
            Stream::Packed => format!(
                r#"{{ kind = "lattice", arrangement = "face-centred", cells = [{columns:.0}, 1, {rows:.0}],
                min = [-{half:?}, -{thick:?}, {low:?}], max = [{half:?}, {thick:?}, {:?}],
                velocity = [0.0, 0.0, -{SPEED:?}], thermal_speed = {:?} }}"#,
                low + height,
                DISORDER * SPEED
            ),
            Stream::Loose => format!(
                r#"{{ kind = "nozzle", shape = {{ slot = {{ width = {width:?}, breadth = 1.0, along = [0, 1, 0] }} }},
                centre = [0, 0, {nozzle:?}], axis = [0, 0, -1], speed = {SPEED:?}, flow = {{ volume_fraction = {LOOSE:?} }} }}"#
            ),
            Stream::Round => format!(
                r#"{{ kind = "nozzle", shape = {{ circle = {{ diameter = {width:?} }} }},
                centre = [0, 0, {nozzle:?}], axis = [0, 0, -1], speed = {SPEED:?}, flow = {{ volume_fraction = {ROUND:?} }} }}"#
            ),
        };
        let surface = if planar {
            let size = [2.0 * target, 4.0 * DIAMETER];
            format!(r#"kind = "rectangle", along = [1, 0, 0], size = {size:?}"#)
        } else {
            format!(r#"kind = "disc", radius = {target:?}"#)
        };
        let wide = target.max(half) + REACH * width;
        let [bottom, top] = [-DEPTH * width, (low + height).max(nozzle) + width];
        let until = self.steady(1).until;
        // Young's modulus and Poisson's ratio of the paper.
        let soft = match self.scheme {
            Scheme::SoftSphere => "soft_sphere = { young_modulus = 6.5e10, poisson_ratio = 0.244 }",
            _ => "",
        };
        let text = format!(
            r#"
            seed = {seed}
            run = {{ until = {until:?}, scheme = "{}" }}
            domain = {{ min = [-{wide:?}, -{wide:?}, {bottom:?}], max = [{wide:?}, {wide:?}, {top:?}], planar = {planar} }}
            grain = {{ radius = {:?}, density = {DENSITY:?} }}
            contact.grain = {{ restitution = {restitution:?}, friction = {friction:?} }}
            contact.surface = {{ restitution = {restitution:?}, friction = {friction:?} }}
            output = {{ samples = 600 }}
            {soft}
            source = [{source}]
            surface = [{{ {surface}, centre = [0, 0, 0], normal = [0, 0, 1] }}]
            "#,
            self.scheme.name(),
            0.5 * DIAMETER,
        );
        toml::from_str(&text).unwrap_or_else(|error| panic!("{across} grains across: {error}"))
    }

    /// What watches where its mass goes.
    pub(super) fn ejecta(&self) -> Ejecta {
        Ejecta::about(-Vector3::z(), self.steady(4), 90)
    }
}

/// Copies of a jet that differ in their seeds, and what left of each.
#[derive(Clone, Debug)]
pub(super) struct Spray {
    pub(super) jet: TargetJet,
    pub(super) copies: Vec<Ejected>,
}

impl Spray {
    /// Mean over the copies. Its error is that of their scatter, or that of the batches within them where it is larger: the scatter of a few copies is
    /// small by chance now and then.
    pub(super) fn mean(&self, of: impl Fn(&Ejected) -> Estimate) -> Estimate {
        let copies: Vec<Estimate> = self.copies.iter().map(of).collect();
        let mean = Estimate::mean(&copies.iter().map(|copy| copy.value).collect::<Vec<_>>());
        let within = copies.iter().map(|copy| copy.error.powi(2)).sum::<f64>().sqrt() / copies.len() as f64;
        Estimate { error: mean.error.max(within), ..mean }
    }

    pub(super) fn opening_angle(&self) -> Estimate {
        self.mean(|ejected| ejected.opening_angle)
    }

    pub(super) fn half_mass_angle(&self) -> Estimate {
        self.mean(|ejected| ejected.half_mass_angle)
    }
}

/// So many copies of each jet, the seeds counting on from that of the settings.
pub(super) fn copies<J: Copy>(jets: &[J], copies: u64, settings: &Settings<'_>, with: fn(J, u64) -> J) -> Vec<J> {
    let of = |&jet: &J| (0..copies).map(move |copy| with(jet, settings.seed.wrapping_add(copy)));
    jets.iter().flat_map(of).collect()
}

/// Runs so many copies of each jet.
pub(super) fn run_sprays(jets: &[TargetJet], count: u64, settings: &Settings<'_>) -> Result<Vec<Spray>, Error> {
    let tasks = copies(jets, count, settings, |jet, seed| TargetJet { seed, ..jet });
    let ejected = |_: &TargetJet, ejecta: Ejecta| ejecta.ejected();
    let all = run_observed(&tasks, settings, TargetJet::scene, TargetJet::ejecta, ejected)?;
    let gather = |(jet, copies): (&TargetJet, &[Ejected])| Spray { jet: *jet, copies: copies.to_vec() };
    Ok(jets.iter().zip(all.chunks(count as usize)).map(gather).collect())
}

/// Opening angle (degrees) of an ideal planar jet on the middle of a plate of `target` jet widths, by free streamlines: the root psi of
/// D_tar / D_jet = 1 - cos psi + (2/π) sin psi artanh(sin psi).
pub(super) fn ideal_angle(target: f64) -> f64 {
    let width = |angle: f64| 1.0 - angle.cos() + 2.0 / PI * angle.sin() * angle.sin().atanh();
    let (mut low, mut high) = (0.0, 0.5 * PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if width(middle) < target { low = middle } else { high = middle }
    }
    low.to_degrees()
}

/// Notes what was run, as far as all copies have it in common: the papers give few absolute numbers.
pub(super) fn note_set_up(report: &mut Report, jet: &TargetJet, copies: u64) {
    let grains = match jet.stream {
        Stream::Packed => format!("planar, area fraction {PACKED} in a hexagonal lattice, {DISORDER} U_0 of disorder"),
        Stream::Loose => format!("planar, area fraction {LOOSE} at random"),
        Stream::Round => format!("round, volume fraction {ROUND} at random"),
    };
    report.measured(
        "What was run",
        format!(
            "jets {:.1} grains wide of {} mm at U_0 = {SPEED} m/s ({grains}; variants are named where they come), restitution {} and friction {} of grains \
             and target, no gravity; scheme {}, {copies} copies; nothing but ratios of lengths, restitution and friction matters to hard grains",
            jet.width() / DIAMETER,
            1e3 * DIAMETER,
            jet.restitution,
            jet.friction,
            jet.scheme.name(),
        ),
    );
}

/// Whether an estimate is above a bound: unknown where it is too uncertain.
pub(super) fn is_above(estimate: Estimate, bound: f64) -> Option<bool> {
    let distance = (estimate.value - bound) / estimate.error;
    (distance.abs() > DEVIATIONS).then_some(distance > 0.0)
}

/// By how much the second of two independent estimates is above the first.
pub(super) fn rise(from: Estimate, to: Estimate) -> Estimate {
    Estimate { value: to.value - from.value, error: from.error.hypot(to.error) }
}

/// Whether a series rises: from each to the next, and at no place back.
pub(super) fn rises(series: &[Estimate]) -> Option<bool> {
    let steps: Vec<_> = series.windows(2).map(|pair| is_above(rise(pair[0], pair[1]), 0.0)).collect();
    if steps.contains(&Some(false)) {
        return Some(false);
    }
    // A step that is lost in the errors says nothing against it where the whole rises.
    let whole = is_above(rise(*series.first()?, *series.last()?), 0.0);
    if whole == Some(true) { Some(true) } else { None }
}

/// The straight line y = intercept + slope x that fits points best, each weighed by its error, and √ mean (deviation)² of the points from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    pub(super) intercept: f64,
    pub(super) slope: Estimate,
    pub(super) misfit: f64,
}

impl Fit {
    pub(super) fn of(points: &[(f64, Estimate)]) -> Self {
        let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
            points.iter().map(|&(x, y)| of(x, y.value) / y.error.powi(2)).sum()
        };
        let weight = sum(&|_, _| 1.0);
        let [x, y] = [sum(&|x, _| x) / weight, sum(&|_, y| y) / weight];
        let squares = sum(&|at, _| (at - x).powi(2));
        let slope = sum(&|at, value| (at - x) * (value - y)) / squares;
        let intercept = y - slope * x;
        let deviation = |&(x, y): &(f64, Estimate)| (y.value - intercept - slope * x).powi(2);
        let misfit = (points.iter().map(deviation).sum::<f64>() / points.len() as f64).sqrt();
        Self { intercept, slope: Estimate { value: slope, error: squares.sqrt().recip() }, misfit }
    }

    pub(super) fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope.value * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::check;
    use crate::study::reproduce::ensemble::unwatched;

    #[test]
    fn its_scenes_are_valid_and_its_jets_as_wide_and_dense_as_they_are_said_to_be() {
        for stream in [Stream::Packed, Stream::Loose, Stream::Round] {
            let jet = TargetJet { stream, ..TargetJet::of(8.0, 3.0) };
            assert!(check(&jet.scene()).is_ok(), "{stream:?}");
            assert!((jet.width() / (8.0 * DIAMETER) - 1.0).abs() < 0.07);
        }
        let jet = TargetJet::of(8.0, 3.0);
        let (columns, rows, side) = jet.lattice();
        let fraction = 2.0 * columns * rows * 0.25 * PI * DIAMETER.powi(2) / (jet.width() * rows * side * 3f64.sqrt());
        approx::assert_relative_eq!(fraction, PACKED, max_relative = 1e-8);
        assert!((rows * side * 3f64.sqrt() / jet.width() - jet.length).abs() < 0.2);
    }

    #[test]
    fn an_ideal_planar_jet_opens_as_free_streamlines_do() {
        for (target, angle) in
            [(0.5, 38.26), (0.88, 50.88), (1.0, 54.24), (1.62, 68.55), (2.0, 75.19), (3.0, 85.65), (4.0, 89.00)]
        {
            approx::assert_abs_diff_eq!(ideal_angle(target), angle, epsilon = 0.005);
        }
    }

    #[test]
    fn what_errors_hide_is_not_decided() {
        let at = |value| Estimate { value, error: 1.0 };
        assert_eq!([10.0, -10.0, 2.0].map(|value| is_above(at(value), 0.0)), [Some(true), Some(false), None]);
        assert_eq!(rises(&[at(0.0), at(1.0), at(9.0)]), Some(true));
        assert_eq!(rises(&[at(0.0), at(1.0), at(2.0)]), None);
        assert_eq!(rises(&[at(0.0), at(20.0), at(10.0)]), Some(false));
    }

    #[test]
    fn a_straight_line_is_found() {
        let at = |x: f64, y, error| (x, Estimate { value: y, error });
        let fit = Fit::of(&[at(0.0, 1.0, 0.1), at(1.0, -1.0, 0.2), at(3.0, -5.0, 0.1)]);
        approx::assert_relative_eq!(fit.slope.value, -2.0, max_relative = 1e-13);
        approx::assert_relative_eq!(fit.intercept, 1.0, max_relative = 1e-13);
        assert!(fit.misfit < 1e-12);
        // Two points at ± 1 with errors of 1: the slope is known to 1 / √2.
        let fit = Fit::of(&[at(-1.0, 0.0, 1.0), at(1.0, 0.0, 1.0)]);
        approx::assert_relative_eq!(fit.slope.error, 0.5f64.sqrt(), max_relative = 1e-13);
    }

    /// F = Q (U_0 - U_h) for what the target takes, and no mass is lost: a fine packed jet on a wide target leaves as a sheet.
    #[test]
    fn a_packed_jet_on_a_wide_target_leaves_as_a_sheet() {
        let sprays = run_sprays(&[TargetJet::of(6.0, 4.0)], 2, &unwatched(true)).expect("they run");
        let spray = &sprays[0];
        assert!((spray.opening_angle().value - 90.0).abs() < 6.0, "{}", spray.opening_angle());
        assert!(spray.half_mass_angle().value < 15.0, "{}", spray.half_mass_angle());
        assert_ne!(spray.copies[0], spray.copies[1], "seeds differ");
    }
}
