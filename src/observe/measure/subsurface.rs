//! Stress and damage below a plane, from every hit on it (Mukherjee & Zohdi 2015, sections 2.4 to 2.6).

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{Fields, Grid, Measurement, Results, Window};
use crate::estimate::Estimate;
use crate::observe::surface_map::axes_along;
use crate::scene::{ContactTime, Scene, SubsurfaceMeasure};
use crate::scheme::soft_sphere::Hertz;
use crate::scheme::{Observer, SurfaceHit};
use crate::shown::{Axis, Chart, Line, Map, Mark, Picture, Table};
use crate::solid::{Elastic, PointLoad, damage_indicator, equivalent_stress};

/// So many hits are gathered before cells look at them, so that handing work to threads costs next to nothing.
const GATHERED: usize = 512;
/// A thread takes at least so many cells at a time.
const SHARE: usize = 64;
/// A hit is one on the plane if its normal differs by no more than this: contacts with edges of a mesh do not count.
const ALIGNED: f64 = 1e-6;

/// A solid below a plane, and how hits on it become forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// A point of the plane, m.
    pub point: Vector3<f64>,
    /// Unit normal of the plane, away from the solid.
    pub normal: Vector3<f64>,
    /// The solid, with its pores.
    pub solid: Elastic,
    /// Equivalent stress above which there is damage, Pa.
    pub threshold: f64,
    /// How long contacts last.
    pub contact: Contact,
}

/// How long a contact lasts: what makes a force of an impulse. The papers' forces are these means over the contact; the peak of an elastic one is
/// 1.84 times higher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// Always the same, s.
    Lasting(f64),
    /// An elastic contact of this effective modulus E* (Pa), 1/E* = Σ (1 - nu²)/E over grain and solid (Hertz 1882). That restitution below 1 makes it
    /// last a little longer is left out.
    Hertz(f64),
}

impl Contact {
    /// The elastic contact of a grain with a solid; without a grain, of a rigid one.
    #[must_use]
    pub fn hertz(solid: &Elastic, grain: Option<&Elastic>) -> Self {
        let compliance = |body: &Elastic| body.plane_modulus().recip();
        Self::Hertz((compliance(solid) + grain.map_or(0.0, compliance)).recip())
    }

    /// How long the contact of a hit lasts, s.
    #[must_use]
    pub fn duration(&self, hit: &SurfaceHit) -> f64 {
        match *self {
            Self::Lasting(time) => time,
            Self::Hertz(modulus) => Hertz::new(modulus, hit.mass, hit.radius, 1.0).duration(hit.approach_speed),
        }
    }
}

/// Equivalent stress and damage in the middle of each cell of a grid below a plane.
///
/// Every hit is a point force: its impulse over the time that its contact lasts. Each makes a field of stress of its own, and a cell counts the hits whose
/// equivalent stress there is above the threshold: D = Σ over hits of I(Pi > 0). Mukherjee & Zohdi (2015), eq. (33), sum the stresses of all
/// contacts of a time step, and over the grid; that count depends on the length of the step. Contacts that overlap in time are not
/// superposed: `contacts_at_once` among the totals tells how many are.
///
/// Nearer to the point of a force than the contact is wide, its stress is that of the contact and not of a point: cells should be as large as grains or a
/// little less.
#[derive(Clone, Debug)]
pub struct Subsurface {
    grid: Grid,
    window: Window,
    below: HalfSpace,
    /// Axes along the plane.
    axes: [Vector3<f64>; 2],
    poisson_ratio: f64,
    /// Middles of the cells along the axes and down from the plane.
    places: Vec<Vector3<f64>>,
    cells: Vec<Cell>,
    /// Hits above the threshold in each cell, of each batch: the batches of a cell together.
    damage: Vec<u32>,
    batches: Vec<Batch>,
    waiting: Vec<Impact>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    peak: f64,
    excess: f64,
}

/// All hits of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Batch {
    hits: u64,
    /// Σ of the times that contacts last, s.
    in_contact: f64,
    /// Σ of the normal impulses, N s.
    impulse: f64,
    /// Largest force, N.
    most: f64,
}

#[derive(Clone, Copy, Debug)]
struct Impact {
    batch: usize,
    at: Vector3<f64>,
    load: PointLoad,
    bound: f64,
}

/// What is known of one cell.
#[derive(Clone, Debug, PartialEq)]
pub struct DamageCell {
    /// Hits whose equivalent stress here was above the threshold, by batch.
    pub damage: Vec<u32>,
    /// Largest equivalent stress of a hit, Pa.
    pub peak: f64,
    /// Σ of the damage indicators Pi of all hits.
    pub excess: f64,
}

impl DamageCell {
    /// D, with the standard error that the scatter of the batches gives it: right where hits come evenly in time.
    #[must_use]
    pub fn total(&self) -> Estimate {
        let counts: Vec<f64> = self.damage.iter().map(|&count| f64::from(count)).collect();
        Estimate::mean(&counts) * counts.len() as f64
    }

    /// D at the end of a batch.
    #[must_use]
    pub fn until(&self, batch: usize) -> u64 {
        self.damage[..=batch].iter().map(|&count| u64::from(count)).sum()
    }
}

impl Subsurface {
    /// The measurement that a scene asks for.
    ///
    /// # Panics
    /// If there is no plane, which its checks would have refused.
    #[must_use]
    pub fn new(measure: &SubsurfaceMeasure, scene: &Scene) -> Self {
        let plane = measure.plane(scene).expect("a scene that was checked has a plane");
        let dense = Elastic::from_young(measure.young_modulus, measure.poisson_ratio);
        let solid = match measure.porosity {
            0.0 => dense,
            porosity => dense.porous(porosity, measure.bound, measure.pore_stiffness),
        };
        let grain_ratio = measure.grain_poisson_ratio.unwrap_or(SubsurfaceMeasure::POISSON_RATIO);
        let grain = measure.grain_young_modulus.map(|young| Elastic::from_young(young, grain_ratio));
        let contact = match measure.contact_time {
            ContactTime::Fixed(time) => Contact::Lasting(time),
            ContactTime::Elastic(crate::scene::Elastic::Hertz) => Contact::hertz(&solid, grain.as_ref()),
        };
        let [point, normal] = plane.map(Vector3::from);
        let normal = normal.normalize();
        let grid = Grid { min: measure.min, max: measure.max, cells: measure.cells };
        let window = Window::new(crate::scene::Measure::Subsurface(measure.clone()).span(), &scene.run);
        Self::over(grid, window, HalfSpace { point, normal, solid, threshold: measure.threshold, contact })
    }

    /// On a grid below a plane, over a window.
    #[must_use]
    pub fn over(grid: Grid, window: Window, below: HalfSpace) -> Self {
        let axes = axes_along(&below.normal);
        let place = |cell: usize| {
            let from_point = grid.centre(cell) - below.point;
            Vector3::new(axes[0].dot(&from_point), axes[1].dot(&from_point), -below.normal.dot(&from_point))
        };
        Self {
            grid,
            window,
            below,
            axes,
            poisson_ratio: below.solid.poisson_ratio(),
            places: (0..grid.len()).map(place).collect(),
            cells: vec![Cell::default(); grid.len()],
            damage: vec![0; grid.len() * window.batches],
            batches: vec![Batch::default(); window.batches],
            waiting: Vec::with_capacity(GATHERED),
        }
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// What is known of all cells so far, in the order of the grid.
    #[must_use]
    pub fn cells(&self) -> Vec<DamageCell> {
        let mut all = self.clone();
        all.work_off();
        let damage = all.damage.chunks_exact(self.window.batches);
        let cell = |(cell, damage): (&Cell, &[u32])| DamageCell {
            damage: damage.to_vec(),
            peak: cell.peak,
            excess: cell.excess,
        };
        all.cells.iter().zip(damage).map(cell).collect()
    }

    /// Shows the hits that have been gathered to all cells. Each cell takes them in the order in which they came, so that the number of threads
    /// cannot change a bit.
    fn work_off(&mut self) {
        let impacts = std::mem::take(&mut self.waiting);
        let (nu, threshold) = (self.poisson_ratio, self.below.threshold);
        let cells = self.cells.par_iter_mut().zip(self.damage.par_chunks_exact_mut(self.window.batches));
        cells.zip(self.places.par_iter()).with_min_len(SHARE).for_each(|((cell, damage), middle)| {
            for impact in &impacts {
                let place = middle - impact.at;
                // Too far away to raise the peak or to pass the threshold: looking would change nothing.
                if impact.bound <= place.norm_squared() * cell.peak.min(threshold) {
                    continue;
                }
                let stress = equivalent_stress(&impact.load.stress(place), nu);
                cell.peak = cell.peak.max(stress);
                if stress > threshold {
                    damage[impact.batch] += 1;
                    cell.excess += damage_indicator(stress, threshold);
                }
            }
        });
        self.waiting = impacts;
        self.waiting.clear();
    }
}

impl Observer for Subsurface {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let Some(batch) = self.window.batch(hit.time) else { return };
        let from_point = hit.position - self.below.point;
        let on_plane = from_point.dot(&self.below.normal).abs() <= hit.radius;
        let duration = self.below.contact.duration(hit);
        if !on_plane || (hit.normal - self.below.normal).amax() > ALIGNED || duration.is_nan() || duration <= 0.0 {
            return;
        }
        let along = |vector: &Vector3<f64>| [self.axes[0].dot(vector), self.axes[1].dot(vector)];
        let [x, y] = along(&from_point);
        // What the surface gives the grain, the grain takes from the surface.
        let [push_x, push_y] = along(&-hit.impulse_tangential);
        let force = Vector3::new(push_x, push_y, hit.impulse_normal) / duration;
        let load = PointLoad::new(force, self.poisson_ratio);
        self.waiting.push(Impact { batch, at: Vector3::new(x, y, 0.0), load, bound: load.bound() });
        let tally = &mut self.batches[batch];
        tally.hits += 1;
        tally.in_contact += duration;
        tally.impulse += hit.impulse_normal;
        tally.most = tally.most.max(force.norm());
        if self.waiting.len() == GATHERED {
            self.work_off();
        }
    }
}

impl Measurement for Subsurface {
    fn results(&self) -> Results {
        let cells = self.cells();
        Results {
            tables: vec![self.table(&cells), self.history(&cells), self.totals()],
            pictures: self.pictures(&cells),
            fields: Some(fields(self.grid, &cells)),
            ..Results::default()
        }
    }
}

impl Subsurface {
    fn table(&self, cells: &[DamageCell]) -> Table {
        let columns = &["x", "y", "z", "damage", "damage_error", "peak_equivalent_stress", "excess"];
        let mut table = Table::new("subsurface", columns);
        for (index, cell) in cells.iter().enumerate() {
            let (place, total) = (self.grid.centre(index), cell.total());
            table.row(&[&place.x, &place.y, &place.z, &total.value, &total.error, &cell.peak, &cell.excess]);
        }
        table
    }

    /// How much of the grid has been damaged at the end of each batch, m³.
    fn damaged(&self, cells: &[DamageCell]) -> Vec<f64> {
        let until = |batch| cells.iter().filter(|cell| cell.until(batch) > 0).count();
        (0..self.window.batches).map(|batch| until(batch) as f64 * self.grid.cell_volume()).collect()
    }

    fn end(&self, batch: usize) -> f64 {
        self.window.from + (batch as f64 + 1.0) * self.window.batch_length()
    }

    fn history(&self, cells: &[DamageCell]) -> Table {
        let columns = &["until", "hits", "impulse_normal", "contacts_at_once", "largest_force", "damaged_volume"];
        let mut table = Table::new("history", columns);
        for ((index, batch), damaged) in self.batches.iter().enumerate().zip(self.damaged(cells)) {
            let at_once = batch.in_contact / self.window.batch_length();
            table.row(&[&self.end(index), &batch.hits, &batch.impulse, &at_once, &batch.most, &damaged]);
        }
        table
    }

    fn totals(&self) -> Table {
        let mut table = Table::new("totals", &["quantity", "value", "error", "unit"]);
        let of = |of: fn(&Batch) -> f64| self.batches.iter().map(of).collect::<Vec<f64>>();
        let mut row = |name: &str, value: Estimate, unit: &str| {
            let error = if value.error > 0.0 { value.error.to_string() } else { String::new() };
            table.row(&[&name, &value.value, &error, &unit]);
        };
        row("hits", Estimate::mean(&of(|batch| batch.hits as f64)) * self.window.batches as f64, "");
        let at_once = Estimate::mean(&of(|batch| batch.in_contact)) * self.window.batch_length().recip();
        row("contacts_at_once", at_once, "");
        row("largest_force", Estimate::exact(of(|batch| batch.most).into_iter().fold(0.0, f64::max)), "N");
        row("bulk_modulus", Estimate::exact(self.below.solid.bulk), "Pa");
        row("shear_modulus", Estimate::exact(self.below.solid.shear), "Pa");
        row("poisson_ratio", Estimate::exact(self.poisson_ratio), "");
        table
    }

    fn pictures(&self, cells: &[DamageCell]) -> Vec<Picture> {
        let [nx, ny, nz] = self.grid.cells.map(|count| count as usize);
        let (section, top) = (ny / 2, nz - 1);
        let at = |x: usize, y: usize, z: usize| &cells[(z * ny + y) * nx + x];
        let columns = |rows: usize, value: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<Option<f64>>> {
            let shown = |value: f64| (value > 0.0).then_some(value);
            (0..nx).map(|x| (0..rows).map(|row| shown(value(x, row))).collect()).collect()
        };
        let [x, y, z] = ["x", "y", "z"].map(|name| format!("{name} / m"));
        let along = |axis: usize, label: String| Axis::linear(label, self.grid.min[axis], self.grid.max[axis]);
        let span = format!("Hits from {} to {} s", self.window.from, self.window.until);
        let middle = |axis: usize, index: usize| self.grid.min[axis] + (index as f64 + 0.5) * self.grid.spacing()[axis];
        let map = |name, title: String, y: Axis, columns: Vec<Vec<Option<f64>>>, legend: &str| {
            let most = columns.iter().flatten().flatten().copied().fold(0.0, f64::max);
            let shows = span.clone();
            let (legend, grey) = (legend.to_owned(), "none".to_owned());
            let x = along(0, x.clone());
            let map = Map { name, title, shows, x, y, columns, legend, most, grey, line: None };
            (most > 0.0).then_some(Picture::Map(map))
        };
        let damage = |cell: &DamageCell| cell.until(self.window.batches - 1) as f64;
        let place = format!("{:.4} m", middle(1, section));
        let maps = [
            map(
                "damage_section",
                format!("Damage in the section y = {place}"),
                along(2, z.clone()),
                columns(nz, &|x, z| damage(at(x, section, z))),
                "hits above threshold",
            ),
            map(
                "stress_section",
                format!("Largest equivalent stress of a hit in the section y = {place}"),
                along(2, z),
                columns(nz, &|x, z| at(x, section, z).peak / 1e9),
                "GPa",
            ),
            map(
                "damage_plan",
                format!("Damage in the layer z = {:.4} m", middle(2, top)),
                along(1, y),
                columns(ny, &|x, y| damage(at(x, y, top))),
                "hits above threshold",
            ),
        ];
        maps.into_iter().flatten().chain(self.growth(cells)).collect()
    }

    /// How the damaged part of the grid grows; none where there is no damage.
    fn growth(&self, cells: &[DamageCell]) -> Option<Picture> {
        let damaged = self.damaged(cells);
        let volume = self.grid.cell_volume() * self.grid.len() as f64;
        let most = damaged.last().copied().filter(|&most| most > 0.0)? / volume;
        let points = damaged.iter().enumerate().map(|(batch, part)| (self.end(batch), part / volume));
        let line = Line::curve("", 0, Mark::Curve, [(self.window.from, 0.0)].into_iter().chain(points));
        Some(Picture::Chart(Chart {
            name: "damaged_part",
            title: "How much of the grid has seen damage".into(),
            shows: "Cells in which one hit at least was above the threshold".into(),
            x: Axis::linear("time / s", self.window.from, self.window.until),
            y: Axis::linear("part of the grid", 0.0, 1.1 * most),
            lines: vec![line],
        }))
    }
}

fn fields(grid: Grid, cells: &[DamageCell]) -> Fields {
    let of = |value: fn(&DamageCell) -> f64| cells.iter().map(value).collect::<Vec<_>>();
    Fields {
        grid,
        arrays: vec![
            ("damage", 1, of(|cell| cell.total().value)),
            ("damage_error", 1, of(|cell| cell.total().error)),
            ("peak_equivalent_stress", 1, of(|cell| cell.peak)),
            ("excess", 1, of(|cell| cell.excess)),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;

    const SOLID: Elastic = Elastic { bulk: 100e9, shear: 46e9 };
    const GRID: Grid = Grid { min: [-0.2, -0.2, -0.1], max: [0.2, 0.2, 0.0], cells: [9, 7, 5] };
    const WINDOW: Window = Window { from: 0.0, until: FakeJet::UNTIL, batches: 3 };

    fn below(threshold: f64) -> HalfSpace {
        let contact = Contact::hertz(&SOLID, None);
        HalfSpace { point: Vector3::zeros(), normal: Vector3::z(), solid: SOLID, threshold, contact }
    }

    /// A hit of 3 N s straight down at (x, y) on the plane z = 0.
    fn hit(x: f64, y: f64) -> SurfaceHit {
        let position = Vector3::new(x, y, 0.0);
        SurfaceHit { time: 0.01, position, impulse_normal: 3.0, approach_speed: 80.0, mass: 0.0356, ..FakeJet::hit(1) }
    }

    /// PHYSICS 2.12: for Table 1, 2.8e-5 s with a rigid grain and 3.7e-5 s with one like the solid.
    #[test]
    fn contacts_last_as_long_as_hertz_says() {
        let solid = Elastic::from_bulk(100e9, 0.3);
        let hit = hit(0.0, 0.0);
        let [rigid, alike] = [None, Some(&solid)].map(|grain| Contact::hertz(&solid, grain).duration(&hit));
        assert!((rigid / 2.8e-5 - 1.0).abs() < 0.02 && (alike / 3.7e-5 - 1.0).abs() < 0.02, "{rigid} {alike}");
        assert_eq!(Contact::Lasting(1e-5).duration(&hit), 1e-5);
    }

    #[test]
    fn one_hit_makes_the_stress_of_its_force() {
        let contact = Contact::Lasting(2e-5);
        let mut below = HalfSpace { contact, ..below(3e7) };
        let mut seen = Subsurface::over(GRID, WINDOW, below);
        seen.surface_hit(&hit(0.03, -0.01));
        let load = PointLoad::new(Vector3::new(0.0, 0.0, 1.5e5), SOLID.poisson_ratio());
        let damage_by =
            |seen: &Subsurface| seen.cells().iter().map(|cell| cell.damage.iter().sum::<u32>()).collect::<Vec<_>>();
        for (index, cell) in seen.cells().iter().enumerate() {
            let place = GRID.centre(index) - Vector3::new(0.03, -0.01, 0.0);
            let stress =
                equivalent_stress(&load.stress(Vector3::new(place.x, place.y, -place.z)), SOLID.poisson_ratio());
            approx::assert_relative_eq!(cell.peak, stress, max_relative = 1e-12);
            assert_eq!(cell.damage, [u32::from(stress > 3e7), 0, 0]);
        }
        assert!(damage_by(&seen).contains(&1));
        // The same hit again: the same peaks, twice the damage. A hit elsewhere, or a contact of twice the time, is another matter.
        let once = damage_by(&seen);
        seen.surface_hit(&hit(0.03, -0.01));
        assert_eq!(damage_by(&seen), once.iter().map(|count| 2 * count).collect::<Vec<_>>());
        below.contact = Contact::Lasting(4e-5);
        let mut longer = Subsurface::over(GRID, WINDOW, below);
        longer.surface_hit(&hit(0.03, -0.01));
        for (one, half) in seen.cells().iter().zip(longer.cells()) {
            approx::assert_relative_eq!(one.peak, 2.0 * half.peak, max_relative = 1e-13);
        }
    }

    #[test]
    fn what_does_not_hit_the_plane_does_not_count() {
        let mut seen = Subsurface::over(GRID, WINDOW, below(1e8));
        let above = SurfaceHit { position: Vector3::new(0.0, 0.0, 0.05), ..hit(0.0, 0.0) };
        let edge = SurfaceHit { normal: Vector3::new(0.6, 0.0, 0.8), ..hit(0.0, 0.0) };
        let late = SurfaceHit { time: 1.0, ..hit(0.0, 0.0) };
        [above, edge, late].iter().for_each(|hit| seen.surface_hit(hit));
        assert!(seen.cells().iter().all(|cell| cell.peak == 0.0));
    }

    /// A plane that is tilted, and all with it, is no other plane.
    #[test]
    fn a_tilted_plane_is_a_plane() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.0, std::f64::consts::FRAC_PI_2, 0.0);
        let tangential = Vector3::new(0.4, -0.3, 0.0);
        let flat_hit = SurfaceHit { impulse_tangential: tangential, ..hit(0.03, -0.01) };
        let turned_hit = SurfaceHit {
            position: turn * flat_hit.position,
            normal: turn * flat_hit.normal,
            impulse_tangential: turn * tangential,
            ..flat_hit
        };
        let cube = |min, max| Grid { min, max, cells: [4, 4, 4] };
        let (flat, upright) = (cube([-0.2, -0.2, -0.4], [0.2, 0.2, 0.0]), cube([-0.4, -0.2, -0.2], [0.0, 0.2, 0.2]));
        let mut one = Subsurface::over(flat, WINDOW, below(1e8));
        let mut other = Subsurface::over(upright, WINDOW, HalfSpace { normal: turn * Vector3::z(), ..below(1e8) });
        one.surface_hit(&flat_hit);
        other.surface_hit(&turned_hit);
        let (cells, turned) = (one.cells(), other.cells());
        for (index, cell) in cells.iter().enumerate() {
            let there = upright.cell(&(turn * flat.centre(index))).expect("it is in the grid");
            approx::assert_relative_eq!(cell.peak, turned[there].peak, max_relative = 1e-12);
        }
    }

    /// A jet, as each of so many threads sees it.
    fn jet(threads: usize, threshold: f64) -> Vec<DamageCell> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut seen = Subsurface::over(GRID, WINDOW, below(threshold));
        pool.install(|| FakeJet { grains: 2000, ..FakeJet::default() }.run(&mut seen));
        assert!(seen.batches.iter().map(|batch| batch.hits).sum::<u64>() > 2 * GATHERED as u64);
        pool.install(|| seen.cells())
    }

    #[test]
    fn the_number_of_threads_does_not_change_a_bit() {
        let one = jet(1, 1e8);
        assert_eq!(one, jet(3, 1e8));
        let damaged = one.iter().filter(|cell| cell.until(2) > 0).count();
        assert!(damaged > 20 && damaged < one.len(), "{damaged}");
    }

    /// Hits that are too far away to matter are not looked at; that changes nothing.
    #[test]
    fn what_is_passed_over_would_have_changed_nothing() {
        #[derive(Default)]
        struct All(Vec<SurfaceHit>);
        impl Observer for All {
            fn surface_hit(&mut self, hit: &SurfaceHit) {
                self.0.push(*hit);
            }
        }
        let mut watched = (All::default(), Subsurface::over(GRID, WINDOW, below(2e8)));
        FakeJet { grains: 1000, ..FakeJet::default() }.run(&mut watched);
        let (All(hits), seen) = watched;
        for (index, cell) in seen.cells().iter().enumerate() {
            let (mut peak, mut damage) = (0.0_f64, [0; 3]);
            for hit in &hits {
                let force = Vector3::new(-hit.impulse_tangential.x, -hit.impulse_tangential.y, hit.impulse_normal);
                let load = PointLoad::new(force / below(2e8).contact.duration(hit), seen.poisson_ratio);
                let [x, y, z] = (GRID.centre(index) - Vector3::new(hit.position.x, hit.position.y, 0.0)).into();
                let stress = equivalent_stress(&load.stress(Vector3::new(x, y, -z)), seen.poisson_ratio);
                peak = peak.max(stress);
                damage[WINDOW.batch(hit.time).expect("in the run")] += u32::from(stress > 2e8);
            }
            approx::assert_relative_eq!(cell.peak, peak, max_relative = 1e-13);
            assert_eq!(cell.damage, damage);
        }
    }

    /// 50 grains that do not see each other, on a surface.
    fn rain_on(surface: &str) -> Vec<DamageCell> {
        let text = format!(
            r#"
            run = {{ until = 0.05, interference = "none" }}
            domain = {{ min = [-1, -1, -1], max = [1, 1, 5] }}
            grain = {{ radius = 0.01, density = 8500 }}
            contact.surface = {{ restitution = 0.8, friction = 0.4 }}
            source = [{{ kind = "block", min = [-0.1, -0.1, 0.1], max = [0.1, 0.1, 1], count = 50, velocity = [20, 0, -80] }}]
            surface = [{surface}]
            [[measure]]
            kind = "subsurface"
            point = [0, 0, 0]
            normal = [0, 0, 3]
            min = [-0.3, -0.3, -0.1]
            max = [0.3, 0.3, 0]
            cells = [12, 12, 4]
            young_modulus = 1.2e11
            porosity = 0.2
            threshold = 3e7
            "#
        );
        let scene: Scene = toml::from_str(&text).expect("a scene");
        crate::scene::check(&scene).expect("it is valid");
        let crate::scene::Measure::Subsurface(measure) = &scene.measure[0] else { panic!("its kind") };
        let mut seen = Subsurface::new(measure, &scene);
        let mut simulation = crate::simulation::Simulation::new(&scene, "".as_ref()).expect("it is prepared");
        simulation.run(&mut seen, &mut |_| std::ops::ControlFlow::Continue(())).expect("it runs");
        assert_eq!(seen.batches.iter().map(|batch| batch.hits).sum::<u64>(), 50);
        seen.cells()
    }

    #[test]
    fn a_mesh_of_a_plane_is_the_plane() {
        let plane = rain_on(r#"{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }"#);
        let mesh = rain_on(
            r#"{ kind = "rectangle", centre = [0, 0, 0], normal = [0, 0, 1], along = [1, 0, 0], size = [2, 2], divisions = [7, 5] }"#,
        );
        assert!(plane.iter().any(|cell| cell.total().value > 1.0));
        for (one, other) in plane.iter().zip(&mesh) {
            approx::assert_relative_eq!(one.peak, other.peak, max_relative = 1e-9);
            assert_eq!(one.damage, other.damage);
        }
    }

    #[test]
    fn results_have_every_cell_and_every_batch() {
        let mut seen = Subsurface::over(GRID, WINDOW, below(1e8));
        FakeJet::default().run(&mut seen);
        let results = seen.results();
        let rows: Vec<usize> = results.tables.iter().map(|table| table.rows.len()).collect();
        assert_eq!(rows, [GRID.len(), 3, 6]);
        assert_eq!(results.pictures.len(), 4);
        let volumes: Vec<f64> = results.tables[1].rows.iter().map(|row| row[5].parse().expect("a number")).collect();
        assert!(volumes.is_sorted() && volumes[2] > 0.0);
    }
}
