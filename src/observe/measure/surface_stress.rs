//! Normal and shear stress on patches of the surface (Arbelaez et al. 2009, section 6).

use nalgebra::Vector3;

use super::free_jet::Scales;
use super::{FacetFields, Measurement, Patches, Results, Window};
use crate::estimate::Estimate;
use crate::grains::Snapshot;
use crate::observe::{SurfaceShape, VectorSum};
use crate::scene::{Measure, Scene, SurfaceStressMeasure};
use crate::scheme::{Observer, Rest, SurfaceHit};
use crate::shown::{Axis, Chart, Line, Map, Picture, Table};

/// Average stress on patches of the surface: impulse per area and time, Σ J / (T A), over the batches of a window.
///
/// Departures from the print of Arbelaez et al. (2009): eq. (51) mixes the force on the grain with that on the surface; here stress is what grains do to the
/// surface, pressure positive, and shear positive where they drag it along the given direction. Standard errors are √(Σ dev² / (n (n - 1))), where
/// eq. (53) divides by n².
///
/// Where grains rest on the surface under a force, what they press with is known for the surface as a whole only: it is told in the table of
/// totals and is part of no stress.
#[derive(Clone, Debug)]
pub struct SurfaceStress {
    patches: Patches,
    window: Window,
    batches: Vec<Vec<Load>>,
    /// Impulse to the surface on no patch, and by grains at rest, N s.
    elsewhere: VectorSum,
    at_rest: VectorSum,
    /// How far the run has come, s.
    reached: f64,
    scales: Option<Scales>,
    planar: bool,
}

/// What hit a patch during a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Load {
    hits: u64,
    /// Impulse to the surface in the frame of the patch, pressing positive, N s.
    impulse: [f64; 3],
}

/// Stress on a patch, Pa; in a planar scene N/m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    /// Pressure.
    pub normal: f64,
    /// Shear along the direction of the patch.
    pub shear: f64,
    /// Shear across that direction.
    pub across: f64,
}

/// What is known of the stress on a patch, Pa; in a planar scene N/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchStress {
    /// Hits.
    pub hits: u64,
    /// Pressure.
    pub normal: Estimate,
    /// Shear along the direction of the patch.
    pub shear: Estimate,
    /// Shear across that direction.
    pub across: Estimate,
}

impl SurfaceStress {
    /// The stresses that a scene asks for, on a surface of the given shape.
    #[must_use]
    pub fn new(measure: &SurfaceStressMeasure, scene: &Scene, shape: &SurfaceShape) -> Self {
        let planar = scene.domain.planar;
        let patches = match &measure.patches {
            Some(grid) => Patches::grid(grid, measure.direction, planar),
            None => Patches::triangles(shape, measure.direction, planar),
        };
        let window = Window::new(Measure::SurfaceStress(measure.clone()).span(), &scene.run);
        let scales = measure.jet.as_ref().map(|jet| Scales::of(jet, scene));
        Self { scales, planar, ..Self::over(patches, window) }
    }

    /// Stresses on patches, over a window.
    #[must_use]
    pub fn over(patches: Patches, window: Window) -> Self {
        let batches = vec![vec![Load::default(); patches.all().len()]; window.batches];
        let (elsewhere, at_rest) = (VectorSum::default(), VectorSum::default());
        Self { patches, window, batches, elsewhere, at_rest, reached: f64::NEG_INFINITY, scales: None, planar: false }
    }

    /// The patches.
    #[must_use]
    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// Adds the batches of a copy of the same run with another seed.
    ///
    /// # Panics
    /// If it was measured on other patches.
    pub fn absorb(&mut self, copy: &Self) {
        assert_eq!(self.patches.all().len(), copy.patches.all().len(), "copies are measured on the same patches");
        let mut batches: Vec<Vec<Load>> = self.complete().cloned().collect();
        batches.extend(copy.complete().cloned());
        self.batches = batches;
        self.elsewhere += copy.elsewhere.value();
        self.at_rest += copy.at_rest.value();
        // All that is left is complete.
        self.reached = f64::INFINITY;
    }

    /// Impulse to the surface within the window (N s): on patches, and elsewhere.
    #[must_use]
    pub fn impulses(&self) -> [Vector3<f64>; 2] {
        let mut on_patches = VectorSum::default();
        for batch in &self.batches {
            for (load, patch) in batch.iter().zip(self.patches.all()) {
                let [normal, along, across] = patch.frame;
                on_patches += across * load.impulse[2] + along * load.impulse[1] - normal * load.impulse[0];
            }
        }
        [on_patches.value(), self.elsewhere.value()]
    }

    /// Impulse to the surface within the window by grains that rest on it, N s.
    #[must_use]
    pub fn impulse_at_rest(&self) -> Vector3<f64> {
        self.at_rest.value()
    }

    /// What is known of the stress on a patch.
    #[must_use]
    pub fn stress(&self, patch: usize) -> PatchStress {
        let loads: Vec<Load> = self.complete().map(|batch| batch[patch]).collect();
        let scale = 1.0 / (self.window.batch_length() * self.patches.all()[patch].area);
        let mean =
            |axis: usize| Estimate::mean(&loads.iter().map(|load| load.impulse[axis] * scale).collect::<Vec<_>>());
        let hits = loads.iter().map(|load| load.hits).sum();
        PatchStress { hits, normal: mean(0), shear: mean(1), across: mean(2) }
    }

    /// Anything that follows from the stresses on all patches, with its standard error by the [jackknife](Estimate::jackknife) over batches.
    #[must_use]
    pub fn derived(&self, of: impl Fn(&[Stress]) -> f64) -> Estimate {
        let batches: Vec<&Vec<Load>> = self.complete().collect();
        let mut sums = vec![[0.0; 3]; self.patches.all().len()];
        for batch in &batches {
            for (sum, load) in sums.iter_mut().zip(*batch) {
                (0..3).for_each(|axis| sum[axis] += load.impulse[axis]);
            }
        }
        let count = batches.len();
        Estimate::jackknife(count, |without| {
            let kept = count - usize::from(without.is_some());
            let time = kept as f64 * self.window.batch_length();
            let stress = |(patch, sum): (usize, &[f64; 3])| {
                let out = without.map_or([0.0; 3], |batch| batches[batch][patch].impulse);
                let scale = 1.0 / (time * self.patches.all()[patch].area);
                let [normal, shear, across] = [0, 1, 2].map(|axis| (sum[axis] - out[axis]) * scale);
                Stress { normal, shear, across }
            };
            of(&sums.iter().enumerate().map(stress).collect::<Vec<_>>())
        })
    }

    /// Batches that are over.
    fn complete(&self) -> impl Iterator<Item = &Vec<Load>> {
        let is_over = |batch: usize| self.window.is_over(batch, self.reached);
        self.batches.iter().enumerate().filter(move |&(batch, _)| is_over(batch)).map(|(_, loads)| loads)
    }
}

impl Observer for SurfaceStress {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let Some(batch) = self.window.batch(hit.time) else { return };
        let impulse = -(hit.normal * hit.impulse_normal + hit.impulse_tangential);
        let Some(patch) = self.patches.of(hit) else {
            self.elsewhere += impulse;
            return;
        };
        let [normal, along, across] = self.patches.all()[patch].frame;
        let load = &mut self.batches[batch][patch];
        load.hits += 1;
        load.impulse[0] -= impulse.dot(&normal);
        load.impulse[1] += impulse.dot(&along);
        load.impulse[2] += impulse.dot(&across);
    }

    fn rest(&mut self, rest: &Rest) {
        if self.window.batch(rest.time).is_some() {
            self.at_rest += -rest.impulse_surface;
        }
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.reached = self.reached.max(snapshot.time);
    }
}

impl Measurement for SurfaceStress {
    fn results(&self) -> Results {
        let stresses: Vec<PatchStress> = (0..self.patches.all().len()).map(|patch| self.stress(patch)).collect();
        // A run that was broken off within its first batch has nothing to draw.
        let pictures = if self.complete().next().is_some() { self.pictures(&stresses) } else { Vec::new() };
        Results {
            tables: vec![self.table(&stresses), self.totals()],
            pictures,
            facets: Some(self.facets(&stresses)),
            ..Results::default()
        }
    }
}

impl SurfaceStress {
    fn table(&self, stresses: &[PatchStress]) -> Table {
        let mut table = Table::new(
            "stress",
            &[
                "x",
                "y",
                "z",
                "area",
                "hits",
                "normal",
                "normal_error",
                "shear",
                "shear_error",
                "across",
                "across_error",
                "normal_relative",
                "normal_relative_error",
                "shear_relative",
                "shear_relative_error",
                "across_relative",
                "across_relative_error",
            ],
        );
        for (patch, stress) in self.patches.all().iter().zip(stresses) {
            let mut row: Vec<String> = patch.centre.iter().map(f64::to_string).collect();
            row.extend([patch.area.to_string(), stress.hits.to_string()]);
            let (normal, shear) =
                (self.scales.map(|scales| scales.pressure), self.scales.and_then(|scales| scales.shear));
            let absolute = [stress.normal, stress.shear, stress.across].map(Some);
            let relative = |stress: Estimate, scale: Option<f64>| Some(stress * scale?.recip());
            let relative =
                [relative(stress.normal, normal), relative(stress.shear, shear), relative(stress.across, shear)];
            for estimate in absolute.into_iter().chain(relative) {
                row.extend(estimate.map_or(["".into(), "".into()], |of| [of.value.to_string(), of.error.to_string()]));
            }
            table.rows.push(row);
        }
        table
    }

    fn totals(&self) -> Table {
        let mut table = Table::new("impulse", &["where", "x", "y", "z"]);
        let [on_patches, elsewhere] = self.impulses();
        for (place, impulse) in [("patches", on_patches), ("elsewhere", elsewhere), ("at_rest", self.at_rest.value())] {
            table.row(&[&place, &impulse.x, &impulse.y, &impulse.z]);
        }
        table
    }

    fn facets(&self, stresses: &[PatchStress]) -> FacetFields {
        let of = |value: fn(&PatchStress) -> f64| stresses.iter().map(value).collect::<Vec<_>>();
        FacetFields {
            corners: self.patches.all().iter().map(|patch| patch.corners.clone()).collect(),
            arrays: vec![
                ("normal", 1, of(|stress| stress.normal.value)),
                ("normal_error", 1, of(|stress| stress.normal.error)),
                ("shear", 1, of(|stress| stress.shear.value)),
                ("shear_error", 1, of(|stress| stress.shear.error)),
                ("across", 1, of(|stress| stress.across.value)),
                ("across_error", 1, of(|stress| stress.across.error)),
                ("hits", 1, of(|stress| stress.hits as f64)),
            ],
        }
    }

    /// Maps of a rectangle, or curves where it is one row of patches; none of triangles, which ParaView shows.
    fn pictures(&self, stresses: &[PatchStress]) -> Vec<Picture> {
        let (Some(columns), Some([length, breadth])) = (self.patches.columns(), self.patches.sides()) else {
            return Vec::new();
        };
        let (relative, pressure, shear) = match self.scales {
            Some(Scales { pressure, shear }) => (true, pressure, shear.unwrap_or(pressure)),
            None => (false, 1.0, 1.0),
        };
        let unit = match (relative, self.planar) {
            (true, _) => "over that of grains that do not meet each other",
            (false, true) => "N/m",
            (false, false) => "Pa",
        };
        let parts: [Part; 2] = [
            ("normal", "Normal stress", |stress| stress.normal, pressure),
            ("shear", "Shear stress", |stress| stress.shear, shear),
        ];
        let shows = format!("Averaged from {} to {} s; {unit}", self.window.from, self.window.until);
        let x = Axis::length("along / m", -0.5 * length, 0.5 * length);
        if columns.iter().all(|column| column.len() == 1) {
            let line = |(colour, (_, name, of, scale)): (usize, &Part)| {
                let at = |index: usize| (index as f64 + 0.5) * length / columns.len() as f64 - 0.5 * length;
                let points = columns.iter().enumerate();
                let points = points.map(|(index, column)| (at(index), of(&stresses[column[0]]) * scale.recip()));
                Line::measured(*name, colour, points.collect())
            };
            let lines: Vec<Line> = parts.iter().enumerate().map(line).collect();
            let [low, high] = range(&lines);
            let y = Axis::linear("stress", low, high);
            let title = "Stress on the surface".into();
            return vec![Picture::Chart(Chart { name: "stress", title, shows, x, y, lines })];
        }
        let map = |(name, title, of, scale): Part| {
            let value = |&patch: &usize| of(&stresses[patch]).value / scale;
            let columns: Vec<Vec<Option<f64>>> =
                columns.iter().map(|column| column.iter().map(|patch| Some(value(patch))).collect()).collect();
            let most = columns.iter().flatten().flatten().map(|value| value.abs()).fold(0.0, f64::max);
            (most > 0.0).then(|| {
                Picture::Map(Map {
                    name,
                    title: title.into(),
                    shows: shows.clone(),
                    x: x.clone(),
                    y: Axis::length("across / m", -0.5 * breadth, 0.5 * breadth),
                    columns,
                    legend: if relative { "relative".into() } else { unit.into() },
                    most,
                    grey: String::new(),
                    line: None,
                })
            })
        };
        parts.into_iter().filter_map(map).collect()
    }
}

/// A part of the stress: name, title, what it is, and what it is shown relative to.
type Part = (&'static str, &'static str, fn(&PatchStress) -> Estimate, f64);

/// The range that holds all points of some lines and 0, with a margin.
fn range(lines: &[Line]) -> [f64; 2] {
    let values = || lines.iter().flat_map(|line| line.points.iter().map(|(_, at)| at.value));
    let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
    let margin = if high > low { 0.08 * (high - low) } else { 1.0 };
    [low - margin * f64::from(u8::from(low < 0.0)), high + margin]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;
    use crate::observe::{Ledger, SurfaceEnergy};
    use crate::scene::PatchGrid;

    fn floor(cells: [u32; 2], size: [f64; 2]) -> PatchGrid {
        PatchGrid { centre: [0.0; 3], normal: [0.0, 0.0, 1.0], along: [1.0, 0.0, 0.0], size, cells, within: None }
    }

    fn window(batches: usize) -> Window {
        Window { from: 0.0, until: FakeJet::UNTIL, batches }
    }

    #[test]
    fn the_patches_and_what_is_beside_them_hold_what_the_ledger_gave_to_the_surface() {
        // Narrower than the spray, so that both parts matter; sheared along a diagonal.
        let patches = Patches::grid(&floor([7, 4], [0.3, 0.2]), Some([1.0, -1.0, 0.0]), false);
        let mut watched = (SurfaceStress::over(patches, window(5)), (Ledger::default(), SurfaceEnergy::default()));
        FakeJet { inflow: 300, ..FakeJet::default() }.run(&mut watched);
        let (stress, (ledger, energy)) = watched;
        let [on_patches, elsewhere] = stress.impulses();
        let given = -(on_patches + elsewhere);
        approx::assert_relative_eq!(given, ledger.surface_impulse(), max_relative = 1e-13);
        assert!(elsewhere.norm() > 0.01 * on_patches.norm());
        // The same from the stresses themselves, times area and time.
        let total = |of: fn(&Stress) -> f64| {
            let sum = |stresses: &[Stress]| {
                stresses.iter().zip(stress.patches().all()).map(|(stress, patch)| of(stress) * patch.area).sum()
            };
            stress.derived(sum).value * FakeJet::UNTIL
        };
        let pressing = total(|stress| stress.normal) - elsewhere.z;
        approx::assert_relative_eq!(pressing, energy.impulse_normal(), max_relative = 1e-12);
        let diagonal = Vector3::new(1.0, -1.0, 0.0).normalize();
        approx::assert_relative_eq!(total(|stress| stress.shear), on_patches.dot(&diagonal), max_relative = 1e-10);
    }

    #[test]
    fn shear_is_positive_where_grains_drag_the_surface_along() {
        let mut stress = SurfaceStress::over(Patches::grid(&floor([2, 1], [2.0, 1.0]), None, false), window(2));
        let hit = |time: f64, x: f64| SurfaceHit {
            time,
            position: Vector3::new(x, 0.0, 0.0),
            impulse_normal: 3.0,
            // The surface holds a grain back that slides to the right.
            impulse_tangential: Vector3::new(-0.5, 0.25, 0.0),
            ..FakeJet::hit(1)
        };
        for time in [0.01, 0.02, 0.04] {
            stress.surface_hit(&hit(time, 0.5));
        }
        stress.sample(&Snapshot { time: FakeJet::UNTIL, flights: &[], grains: &[] });
        let per_impulse = 1.0 / (0.5 * FakeJet::UNTIL);
        let [left, right] = [0, 1].map(|patch| stress.stress(patch));
        assert_eq!((left.hits, left.normal), (0, Estimate::exact(0.0)));
        assert_eq!(right.normal, Estimate::mean(&[6.0 * per_impulse, 3.0 * per_impulse]));
        assert_eq!((right.hits, right.shear.value), (3, 0.75 * per_impulse));
        assert_eq!(right.across.value, -0.375 * per_impulse);
        assert_eq!(stress.derived(|patches| patches[1].normal).value, right.normal.value);
        approx::assert_relative_eq!(
            stress.derived(|patches| patches[1].normal).error,
            right.normal.error,
            max_relative = 1e-14
        );
    }

    #[test]
    fn a_batch_that_was_broken_off_is_left_out() {
        let mut stress = SurfaceStress::over(Patches::grid(&floor([1, 1], [1.0, 1.0]), None, false), window(3));
        for time in [0.01, 0.03, 0.05] {
            stress.surface_hit(&SurfaceHit { time, impulse_normal: 1.0 + time, ..FakeJet::hit(1) });
        }
        stress.sample(&Snapshot { time: 0.055, flights: &[], grains: &[] });
        assert_eq!((stress.stress(0).hits, stress.complete().count()), (2, 2));
        assert!(stress.results().pictures.len() == 1);
        stress.reached = 0.01;
        assert!(stress.results().pictures.is_empty(), "nothing is over");
    }

    #[test]
    fn copies_add_their_batches() {
        let run = |hits: &[f64]| {
            let mut stress = SurfaceStress::over(Patches::grid(&floor([1, 1], [1.0, 1.0]), None, false), window(2));
            for (batch, impulse_normal) in hits.iter().enumerate() {
                stress.surface_hit(&SurfaceHit {
                    time: 0.01 + 0.03 * batch as f64,
                    impulse_normal: *impulse_normal,
                    ..FakeJet::hit(1)
                });
            }
            stress.sample(&Snapshot { time: FakeJet::UNTIL, flights: &[], grains: &[] });
            stress
        };
        let mut both = run(&[1.0, 2.0]);
        both.absorb(&run(&[4.0, 5.0]));
        let expected = Estimate::mean(&[1.0, 2.0, 4.0, 5.0]) * (1.0 / 0.03);
        approx::assert_relative_eq!(both.stress(0).normal.value, expected.value, max_relative = 1e-15);
        approx::assert_relative_eq!(both.stress(0).normal.error, expected.error, max_relative = 1e-15);
    }
}
