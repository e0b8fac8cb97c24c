//! Density, velocity, granular temperature and stress on a grid (Arbelaez et al. 2009, eq. 43; Huang et al. 2010, section IV and fig. 8).

use std::f64::consts::PI;

use nalgebra::{Vector3, Vector6};

use super::{Fields, Grid, Measurement, Results, Window};
use crate::estimate::Estimate;
use crate::grains::{Snapshot, sphere_volume};
use crate::scene::{Boundary, FlowMeasure, Scene};
use crate::scheme::{GrainCollision, Observer};
use crate::shown::{Axis, Map, Picture, Table};

/// Fields of the flow, averaged over the samples of a run that fall into the window, and over all its collisions.
///
/// A grain counts in the cell of its centre. Velocities are averaged by mass, Σ m v / Σ m over grains and samples: the mean of the
/// means of single samples, which Arbelaez et al. print, is not the velocity with which mass moves. Granular temperature is a third (in planar
/// scenes half) of the mean square deviation from that velocity, m²/s².
///
/// **Stress.** The momentum that the flow carries across a unit area in a unit time, beyond what its mean velocity carries; positive where grains
/// press. Kinetic: Σ m u' u' / V over the grains of a sample, u' being the deviation from the mean velocity of the cell. Contact:
/// Σ l J / (V t) over the collisions of grains, with l from one centre to the other and J the impulse on the other, its symmetric part; each cell gets the
/// part of l that lies in it (Irving & Kirkwood 1950), so that what a layer carries does not depend on how the grains in it are stacked. Huang, Chan & Zamankhan (2010, section IV) print u'^kl u^k and a sum over all ordered pairs, in which each contact counts twice, over an
/// area. What the surface gives to grains is not in it: where contacts with the surface carry, within a radius of it, the stress is that of the
/// surface.
///
/// **Planar scenes.** What is per volume is per volume of a cell, whose thickness is that of the grid along y; a stress of spheres in
/// a plane is had with a thickness of one diameter. The volume fraction is the area fraction, π r² over the area of the cell.
#[derive(Clone, Debug)]
pub struct Flow {
    grid: Grid,
    window: Window,
    planar: bool,
    /// Lower corner and sides of a periodic domain, m.
    period: Option<[Vector3<f64>; 2]>,
    /// When it was last looked at, s: a run may be broken off.
    seen: f64,
    batches: Vec<Batch>,
}

/// Parts of a symmetric tensor: xx, yy, zz, xy, yz, xz.
type Tensor = Vector6<f64>;

/// What [`FlowCell`] calls the parts of a stress.
pub const PARTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// The symmetric part of a b.
fn product(a: &Vector3<f64>, b: &Vector3<f64>) -> Tensor {
    let part = |i: usize, j: usize| 0.5 * (a[i] * b[j] + a[j] * b[i]);
    Tensor::new(part(0, 0), part(1, 1), part(2, 2), part(0, 1), part(1, 2), part(0, 2))
}

fn trace(tensor: &Tensor) -> f64 {
    tensor[0] + tensor[1] + tensor[2]
}

#[derive(Clone, Debug, Default)]
struct Batch {
    samples: u64,
    cells: Vec<Cell>,
    /// What lay outside the grid.
    outside: Cell,
}

/// Sums over grains and samples, and over collisions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    count: f64,
    mass: f64,
    volume: f64,
    momentum: Vector3<f64>,
    /// Σ m v v; its trace is twice the energy of translation.
    square: Tensor,
    /// Σ l J, N s m.
    virial: Tensor,
}

impl Cell {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.mass += other.mass;
        self.volume += other.volume;
        self.momentum += other.momentum;
        self.square += other.square;
        self.virial += other.virial;
    }

    fn velocity(&self) -> Vector3<f64> {
        if self.mass > 0.0 { self.momentum / self.mass } else { Vector3::zeros() }
    }

    /// Σ m (v - u)(v - u).
    fn fluctuation(&self, u: &Vector3<f64>) -> Tensor {
        self.square - product(&self.momentum, u) * 2.0 + product(u, u) * self.mass
    }
}

/// The sums of a batch, from so many samples over a time of `duration` (s).
struct Summed {
    cell: Cell,
    samples: f64,
    duration: f64,
}

/// What is known of one cell; averages over grains only where there were any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowCell {
    /// Grains per volume, 1/m³.
    pub number_density: Estimate,
    /// Mass per volume, kg/m³.
    pub density: Estimate,
    /// Volume of grains per volume; in a planar scene area per area.
    pub volume_fraction: Estimate,
    /// Velocity of the mass, m/s.
    pub velocity: Option<[Estimate; 3]>,
    /// Granular temperature, m²/s².
    pub temperature: Option<Estimate>,
    /// Kinetic stress, Pa: its [`PARTS`].
    pub kinetic_stress: [Estimate; 6],
    /// Contact stress, Pa: its [`PARTS`].
    pub contact_stress: [Estimate; 6],
    /// Mean normal stress, kinetic and contact, Pa.
    pub pressure: Estimate,
}

impl FlowCell {
    /// Density, speed of the mass and both stresses put together: a part of the flux of momentum, Pa. The mean of ρ u u is taken at the mean velocity.
    #[must_use]
    pub fn momentum_flux(&self, part: usize) -> f64 {
        let u = Vector3::from(self.velocity.map_or([0.0; 3], |velocity| velocity.map(|of| of.value)));
        self.density.value * product(&u, &u)[part] + self.kinetic_stress[part].value + self.contact_stress[part].value
    }
}

impl Flow {
    /// The fields that a scene asks for.
    #[must_use]
    pub fn new(measure: &FlowMeasure, scene: &Scene) -> Self {
        let grid = Grid::new(measure.min, measure.max, measure.cells, &scene.domain);
        let window = Window::new(crate::scene::Measure::Flow(measure.clone()).span(), &scene.run);
        let flow = Self::over(grid, window, scene.domain.planar);
        match scene.domain.boundary {
            Boundary::Open => flow,
            Boundary::Periodic => flow.periodic(scene.domain.min.into(), scene.domain.max.into()),
        }
    }

    /// Fields on a grid, over a window.
    #[must_use]
    pub fn over(grid: Grid, window: Window, planar: bool) -> Self {
        let batch = Batch { cells: vec![Cell::default(); grid.len()], ..Batch::default() };
        let batches = vec![batch; window.batches];
        Self { grid, window, planar, period: None, seen: f64::NEG_INFINITY, batches }
    }

    /// The same in a periodic domain from `min` to `max` (m): a contact across a side counts where it is inside.
    #[must_use]
    pub fn periodic(self, min: Vector3<f64>, max: Vector3<f64>) -> Self {
        Self { period: Some([min, max - min]), ..self }
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// When it is measured.
    #[must_use]
    pub fn window(&self) -> Window {
        self.window
    }

    fn dimensions(&self) -> f64 {
        if self.planar { 2.0 } else { 3.0 }
    }

    /// Mass (kg), momentum (kg m/s) and energy of translation (J) inside and outside the grid, averaged over all samples.
    #[must_use]
    pub fn totals(&self) -> (f64, Vector3<f64>, f64) {
        let mut sum = Cell::default();
        self.batches.iter().flat_map(|batch| batch.cells.iter().chain([&batch.outside])).for_each(|cell| sum.add(cell));
        let samples = self.batches.iter().map(|batch| batch.samples).sum::<u64>() as f64;
        (sum.mass / samples, sum.momentum / samples, 0.5 * trace(&sum.square) / samples)
    }

    /// What is known of a cell.
    #[must_use]
    pub fn cell(&self, cell: usize) -> FlowCell {
        self.region(&[cell])
    }

    /// What is known of cells taken together; deviations are from their common velocity.
    #[must_use]
    pub fn region(&self, cells: &[usize]) -> FlowCell {
        let batches: Vec<Summed> = self.sampled().map(|(number, batch)| self.summed(number, batch, cells)).collect();
        let volume = self.grid.cell_volume() * cells.len() as f64;
        let per_batch = |of: &dyn Fn(&Summed) -> f64| Estimate::mean(&batches.iter().map(of).collect::<Vec<_>>());
        let density = |of: fn(&Cell) -> f64| per_batch(&|batch| of(&batch.cell) / (batch.samples * volume));
        let ratio = |of: &dyn Fn(&Cell) -> f64| {
            let pairs = batches.iter().map(|batch| (of(&batch.cell) / batch.samples, batch.cell.mass / batch.samples));
            Estimate::ratio(&pairs.collect::<Vec<_>>())
        };
        let mut all = Cell::default();
        batches.iter().for_each(|batch| all.add(&batch.cell));
        let u = all.velocity();
        let kinetic = |batch: &Summed| batch.cell.fluctuation(&u) / (batch.samples * volume);
        let contact = |batch: &Summed| batch.cell.virial / (batch.duration * volume);
        let parts = |of: &dyn Fn(&Summed) -> Tensor| std::array::from_fn(|part| per_batch(&|batch| of(batch)[part]));
        // Squares, of which rounding must not make less than nothing.
        let not_below_zero = |of: Estimate| Estimate { value: of.value.max(0.0), ..of };
        let mut kinetic_stress: [Estimate; 6] = parts(&kinetic);
        kinetic_stress[..3].iter_mut().for_each(|part| *part = not_below_zero(*part));
        let dimensions = self.dimensions();
        let any = all.count > 0.0;
        FlowCell {
            number_density: density(|cell| cell.count),
            density: density(|cell| cell.mass),
            volume_fraction: density(|cell| cell.volume),
            velocity: any.then(|| [0, 1, 2].map(|axis| ratio(&|cell| cell.momentum[axis]))),
            temperature: any.then(|| not_below_zero(ratio(&|cell| trace(&cell.fluctuation(&u)) / dimensions))),
            kinetic_stress,
            contact_stress: parts(&contact),
            pressure: not_below_zero(per_batch(&|batch| trace(&(kinetic(batch) + contact(batch))) / dimensions)),
        }
    }

    /// Batches with samples in them, and their numbers: a batch that is shorter than the time between samples may have none.
    fn sampled(&self) -> impl Iterator<Item = (usize, &Batch)> {
        let seen = |&(number, batch): &(usize, &Batch)| batch.samples > 0 && self.duration(number) > 0.0;
        self.batches.iter().enumerate().filter(seen)
    }

    /// How much of a batch has been seen, s.
    fn duration(&self, number: usize) -> f64 {
        let length = self.window.batch_length();
        (self.seen - (self.window.from + number as f64 * length)).min(length)
    }

    fn summed(&self, number: usize, batch: &Batch, cells: &[usize]) -> Summed {
        let mut cell = Cell::default();
        cells.iter().for_each(|&number| cell.add(&batch.cells[number]));
        Summed { cell, samples: batch.samples as f64, duration: self.duration(number) }
    }

    /// Columns of cells as seen along y: from left to right, each from bottom to top.
    fn seen_along_y(&self) -> Vec<Vec<FlowCell>> {
        let [nx, ny, nz] = self.grid.cells.map(|count| count as usize);
        let row = |x: usize, z: usize| (0..ny).map(|y| (z * ny + y) * nx + x).collect::<Vec<_>>();
        (0..nx).map(|x| (0..nz).map(|z| self.region(&row(x, z))).collect()).collect()
    }
}

impl Observer for Flow {
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        self.seen = snapshot.time;
        let Some(batch) = self.window.batch(snapshot.time) else { return };
        let batch = &mut self.batches[batch];
        batch.samples += 1;
        let thickness = self.grid.spacing()[1];
        for (flight, grain) in snapshot.flights.iter().zip(snapshot.grains) {
            let here = match self.grid.cell(&flight.position) {
                Some(cell) => &mut batch.cells[cell],
                None => &mut batch.outside,
            };
            let momentum = flight.velocity * grain.mass;
            here.add(&Cell {
                count: 1.0,
                mass: grain.mass,
                volume: if self.planar { PI * flight.radius.powi(2) * thickness } else { sphere_volume(flight.radius) },
                momentum,
                square: product(&momentum, &flight.velocity),
                virial: Tensor::zeros(),
            });
        }
    }

    fn grain_collision(&mut self, collision: &GrainCollision) {
        let Some(batch) = self.window.batch(collision.time) else { return };
        let batch = &mut self.batches[batch];
        let virial = product(&collision.branch(), &collision.impulse());
        let period = self.period;
        let inside = |place: Vector3<f64>| match period {
            Some([min, side]) => place.zip_zip_map(&min, &side, |x, low, side| low + (x - low).rem_euclid(side)),
            None => place,
        };
        let [from, to] = collision.centres();
        self.grid.pieces(from, to, |middle, part| {
            let here = match self.grid.cell(&inside(middle)) {
                Some(cell) => &mut batch.cells[cell],
                None => &mut batch.outside,
            };
            here.virial += virial * part;
        });
    }
}

impl Measurement for Flow {
    fn results(&self) -> Results {
        let cells: Vec<FlowCell> = (0..self.grid.len()).map(|cell| self.cell(cell)).collect();
        Results {
            tables: vec![table(&self.grid, &cells), stress_table(&self.grid, &cells)],
            pictures: self.pictures(),
            fields: Some(fields(self.grid, &cells)),
            ..Results::default()
        }
    }
}

fn table(grid: &Grid, cells: &[FlowCell]) -> Table {
    let mut table = Table::new(
        "flow",
        &[
            "x",
            "y",
            "z",
            "number_density",
            "number_density_error",
            "density",
            "density_error",
            "volume_fraction",
            "volume_fraction_error",
            "vx",
            "vx_error",
            "vy",
            "vy_error",
            "vz",
            "vz_error",
            "temperature",
            "temperature_error",
        ],
    );
    for (index, cell) in cells.iter().enumerate() {
        let place = grid.centre(index);
        let densities = [cell.number_density, cell.density, cell.volume_fraction].map(Some);
        let velocity = cell.velocity.map_or([None; 3], |velocity| velocity.map(Some));
        let mut row: Vec<String> = place.iter().map(f64::to_string).collect();
        for estimate in densities.into_iter().chain(velocity).chain([cell.temperature]) {
            row.extend(estimate.map_or(["".into(), "".into()], |of| [of.value.to_string(), of.error.to_string()]));
        }
        table.rows.push(row);
    }
    table
}

fn stress_table(grid: &Grid, cells: &[FlowCell]) -> Table {
    let mut table = Table::new(
        "stress",
        &[
            "x",
            "y",
            "z",
            "pressure",
            "pressure_error",
            "kinetic_xx",
            "kinetic_xx_error",
            "kinetic_yy",
            "kinetic_yy_error",
            "kinetic_zz",
            "kinetic_zz_error",
            "kinetic_xy",
            "kinetic_xy_error",
            "kinetic_yz",
            "kinetic_yz_error",
            "kinetic_xz",
            "kinetic_xz_error",
            "contact_xx",
            "contact_xx_error",
            "contact_yy",
            "contact_yy_error",
            "contact_zz",
            "contact_zz_error",
            "contact_xy",
            "contact_xy_error",
            "contact_yz",
            "contact_yz_error",
            "contact_xz",
            "contact_xz_error",
        ],
    );
    for (index, cell) in cells.iter().enumerate() {
        let place = grid.centre(index);
        let stresses = [cell.pressure].into_iter().chain(cell.kinetic_stress).chain(cell.contact_stress);
        let numbers = place.iter().copied().chain(stresses.flat_map(|of| [of.value, of.error]));
        table.rows.push(numbers.map(|number| number.to_string()).collect());
    }
    table
}

fn fields(grid: Grid, cells: &[FlowCell]) -> Fields {
    let of = |value: fn(&FlowCell) -> f64| cells.iter().map(value).collect::<Vec<_>>();
    let velocity = |cell: &FlowCell| cell.velocity.map_or([f64::NAN; 3], |velocity| velocity.map(|part| part.value));
    // In the order of PARTS, which is ParaView's.
    let tensors = |of: fn(&FlowCell) -> [Estimate; 6]| cells.iter().flat_map(of).map(|part| part.value).collect();
    Fields {
        grid,
        arrays: vec![
            ("number_density", 1, of(|cell| cell.number_density.value)),
            ("density", 1, of(|cell| cell.density.value)),
            ("density_error", 1, of(|cell| cell.density.error)),
            ("volume_fraction", 1, of(|cell| cell.volume_fraction.value)),
            ("velocity", 3, cells.iter().flat_map(velocity).collect()),
            ("temperature", 1, of(|cell| cell.temperature.map_or(f64::NAN, |temperature| temperature.value))),
            ("pressure", 1, of(|cell| cell.pressure.value)),
            ("kinetic_stress", 6, tensors(|cell| cell.kinetic_stress)),
            ("contact_stress", 6, tensors(|cell| cell.contact_stress)),
        ],
    }
}

impl Flow {
    fn pictures(&self) -> Vec<Picture> {
        let seen = self.seen_along_y();
        let map = |name, title: &str, legend: &str, value: &dyn Fn(&FlowCell) -> Option<f64>| {
            let columns: Vec<Vec<Option<f64>>> = seen.iter().map(|column| column.iter().map(value).collect()).collect();
            let most = columns.iter().flatten().flatten().copied().fold(0.0, f64::max);
            (most > 0.0).then(|| {
                Picture::Map(Map {
                    name,
                    title: title.into(),
                    shows: format!("Averaged from {} to {} s and along y", self.window.from, self.window.until),
                    x: Axis::length("x / m", self.grid.min[0], self.grid.max[0]),
                    y: Axis::length("z / m", self.grid.min[2], self.grid.max[2]),
                    columns,
                    legend: legend.into(),
                    most,
                    grey: "no grain".into(),
                    line: None,
                })
            })
        };
        let where_grains_are = |cell: &FlowCell, value| cell.velocity.is_some().then_some(value);
        let pictures = [
            map("volume_fraction", "Volume fraction", "volume fraction", &|cell| {
                where_grains_are(cell, cell.volume_fraction.value)
            }),
            map("speed", "Speed of the mass", "m/s", &|cell| {
                let [x, _, z] = cell.velocity?;
                Some(x.value.hypot(z.value))
            }),
            map("temperature", "Granular temperature", "m²/s²", &|cell| Some(cell.temperature?.value)),
            map("pressure", "Mean normal stress, kinetic and contact", "Pa", &|cell| {
                where_grains_are(cell, cell.pressure.value)
            }),
            // Friction may pull where few grains touch; a map shows that as nothing.
            map("contact_stress_x", "Contact stress along x", "Pa", &|cell| {
                where_grains_are(cell, cell.contact_stress[0].value.max(0.0))
            }),
            map("contact_stress_z", "Contact stress along z", "Pa", &|cell| {
                where_grains_are(cell, cell.contact_stress[2].value.max(0.0))
            }),
        ];
        pictures.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use impinge_events::Flight;

    use super::*;
    use crate::observe::Ledger;
    use crate::observe::fake_jet::FakeJet;

    const JET: Grid = Grid { min: [-0.2, -0.2, 0.0], max: [0.2, 0.2, 1.5], cells: [4, 2, 6] };

    #[test]
    fn what_is_inside_and_outside_the_grid_is_what_the_ledger_has() {
        let window = Window { from: 0.0, until: FakeJet::UNTIL, batches: 4 };
        let jet = FakeJet { samples: 1, inflow: 300, ..FakeJet::default() };
        // Only the samples at the end: what the ledger calls inside.
        let late = Window { from: 0.9 * FakeJet::UNTIL, ..window };
        let mut watched = (Flow::over(JET, late, false), Ledger::default());
        jet.run(&mut watched);
        let (flow, ledger) = watched;
        let (mass, momentum, energy) = flow.totals();
        approx::assert_relative_eq!(mass, ledger.inside().mass(), max_relative = 1e-13);
        approx::assert_relative_eq!(momentum, ledger.inside().momentum(), max_relative = 1e-12);
        assert!(energy > 0.0 && energy < ledger.inside().energy() * (1.0 + 1e-12));
        let inside: f64 = (0..JET.len()).map(|cell| flow.cell(cell).density.value * JET.cell_volume()).sum();
        assert!(inside > 0.0 && inside < mass, "some are outside the grid");
        let all = flow.region(&(0..JET.len()).collect::<Vec<_>>());
        approx::assert_relative_eq!(
            all.density.value * JET.cell_volume() * JET.len() as f64,
            inside,
            max_relative = 1e-13
        );
    }

    #[test]
    fn two_streams_through_each_other_have_the_velocity_of_their_mass_and_are_hot() {
        let window = Window { from: 0.0, until: 1.0, batches: 2 };
        let grid = Grid { min: [0.0; 3], max: [1.0, 1.0, 2.0], cells: [1, 1, 2] };
        let mut flow = Flow::over(grid, window, false);
        let flight = |z, speed| Flight {
            position: Vector3::new(0.5, 0.5, z),
            time: 0.0,
            velocity: Vector3::new(0.0, 0.0, speed),
            radius: 0.1,
        };
        let grain = |mass| crate::grains::Grain { id: 0, mass, spin: Vector3::zeros(), hits: 0, strength: 1.0 };
        let (flights, grains) = ([flight(0.2, 4.0), flight(0.7, -2.0)], [grain(1.0), grain(3.0)]);
        for time in [0.1, 0.3, 0.6] {
            flow.sample(&Snapshot { time, flights: &flights, grains: &grains });
        }
        let [low, high] = [0, 1].map(|cell| flow.cell(cell));
        assert_eq!((low.density.value, low.density.error, low.number_density.value), (4.0, 0.0, 2.0));
        approx::assert_relative_eq!(low.volume_fraction.value, 2.0 * sphere_volume(0.1), max_relative = 1e-15);
        // (4 - 6) / 4; (16 + 12) / 4 - 0.25 = 6.75, a third of it in each direction.
        assert_eq!(low.velocity.map(|velocity| velocity[2].value), Some(-0.5));
        approx::assert_relative_eq!(low.temperature.unwrap().value, 2.25, max_relative = 1e-15);
        assert_eq!((high.density.value, high.velocity, high.temperature), (0.0, None, None));
    }

    #[test]
    fn an_error_bar_is_as_wide_as_batches_differ() {
        let window = Window { from: 0.0, until: 4.0, batches: 4 };
        let grid = Grid { min: [0.0; 3], max: [1.0; 3], cells: [1; 3] };
        let mut flow = Flow::over(grid, window, false);
        let grain = crate::grains::Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 };
        let flight = Flight { position: Vector3::repeat(0.5), time: 0.0, velocity: Vector3::zeros(), radius: 0.1 };
        for (time, count) in [(0.5, 1), (1.5, 4), (2.5, 2), (3.5, 5)] {
            flow.sample(&Snapshot { time, flights: &vec![flight; count], grains: &vec![grain; count] });
        }
        assert_eq!(flow.cell(0).density, Estimate::mean(&[2.0, 8.0, 4.0, 10.0]));
    }

    fn collision(time: f64, place: Vector3<f64>, tangential: Vector3<f64>) -> GrainCollision {
        GrainCollision {
            time,
            ids: [0, 1],
            position: place,
            normal: Vector3::x(),
            radii: [0.1; 2],
            impulse_normal: 3.0,
            impulse_tangential: tangential,
            approach_speed: 1.0,
            dissipated: 0.0,
            withheld: 0.0,
            overlap_over_radius: 0.0,
        }
    }

    #[test]
    fn a_contact_gives_branch_times_impulse_over_volume_and_time_in_its_cell() {
        let window = Window { from: 0.0, until: 2.0, batches: 2 };
        let grid = Grid { min: [0.0; 3], max: [1.0, 1.0, 2.0], cells: [1, 1, 2] };
        let mut flow = Flow::over(grid, window, false).periodic(Vector3::zeros(), Vector3::new(1.0, 1.0, 2.0));
        let empty = |time| Snapshot { time, flights: &[], grains: &[] };
        flow.sample(&empty(0.0));
        flow.grain_collision(&collision(0.5, Vector3::new(0.5, 0.5, 0.2), Vector3::new(0.0, 0.0, -1.0)));
        flow.sample(&empty(1.5));
        // Across the lower side along z, in the upper cell of the period.
        flow.grain_collision(&collision(1.75, Vector3::new(0.5, 0.5, -0.1), Vector3::zeros()));
        flow.sample(&empty(2.0));
        let [low, high] = [0, 1].map(|cell| flow.cell(cell));
        // 0.2 × 3 in one of two batches of 1 s; half of 0.2 × -1 in xz.
        let value = |of: [Estimate; 6]| of.map(|part| part.value);
        approx::assert_relative_eq!(
            value(low.contact_stress)[..],
            [0.3, 0.0, 0.0, 0.0, 0.0, -0.05],
            max_relative = 1e-14
        );
        approx::assert_relative_eq!(low.contact_stress[0].error, 0.3, max_relative = 1e-14);
        approx::assert_relative_eq!(
            value(high.contact_stress)[..],
            [0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
            max_relative = 1e-14
        );
        approx::assert_relative_eq!(low.pressure.value, 0.1, max_relative = 1e-14);
        assert_eq!(low.temperature, None);
    }

    #[test]
    fn a_run_that_is_broken_off_has_the_stress_of_the_time_that_was_seen() {
        let window = Window { from: 0.0, until: 4.0, batches: 4 };
        let grid = Grid { min: [0.0; 3], max: [1.0; 3], cells: [1; 3] };
        let mut flow = Flow::over(grid, window, false);
        for quarter in 0..6 {
            flow.sample(&Snapshot { time: 0.25 * f64::from(quarter), flights: &[], grains: &[] });
            flow.grain_collision(&collision(0.25 * f64::from(quarter) + 0.1, Vector3::repeat(0.5), Vector3::zeros()));
        }
        flow.sample(&Snapshot { time: 1.5, flights: &[], grains: &[] });
        // Four collisions a second, in one whole batch and the half of another.
        let stress = flow.cell(0).contact_stress[0];
        approx::assert_relative_eq!(stress.value, 4.0 * 0.6, max_relative = 1e-14);
        assert!(stress.error < 1e-14);
    }

    #[test]
    fn the_stresses_of_all_cells_are_those_of_all_contacts() {
        /// Σ l J over all collisions.
        #[derive(Default)]
        struct Virial(Tensor);
        impl Observer for Virial {
            fn grain_collision(&mut self, collision: &GrainCollision) {
                self.0 += product(&collision.branch(), &collision.impulse());
            }
        }
        let window = Window { from: 0.0, until: FakeJet::UNTIL, batches: 4 };
        let wide = Grid { min: [-5.0; 3], max: [5.0; 3], cells: [4, 2, 6] };
        let mut watched = (Flow::over(wide, window, false), Virial::default());
        FakeJet { grains: 2000, ..FakeJet::default() }.run(&mut watched);
        let (flow, Virial(virial)) = watched;
        let mut sum = Tensor::zeros();
        for cell in 0..wide.len() {
            let stress = flow.cell(cell).contact_stress.map(|part| part.value);
            sum += Tensor::from(stress) * wide.cell_volume() * FakeJet::UNTIL;
        }
        assert!(virial[0] > 0.0);
        approx::assert_relative_eq!(sum, virial, max_relative = 1e-12, epsilon = 1e-12 * virial[0]);
        // All cells together are one region.
        let together = flow.region(&(0..wide.len()).collect::<Vec<_>>()).contact_stress.map(|part| part.value);
        let volume = wide.cell_volume() * wide.len() as f64 * FakeJet::UNTIL;
        approx::assert_relative_eq!(
            Tensor::from(together) * volume,
            virial,
            max_relative = 1e-12,
            epsilon = 1e-12 * virial[0]
        );
    }

    #[test]
    fn a_planar_flow_has_area_fractions_and_two_degrees_of_freedom() {
        let window = Window { from: 0.0, until: 1.0, batches: 2 };
        let grid = Grid { min: [0.0, -0.1, 0.0], max: [1.0, 0.1, 1.0], cells: [1; 3] };
        let mut flow = Flow::over(grid, window, true);
        let flight = |x, speed| Flight {
            position: Vector3::new(x, 0.0, 0.5),
            time: 0.0,
            velocity: Vector3::new(speed, 0.0, 0.0),
            radius: 0.1,
        };
        let grain = crate::grains::Grain { id: 0, mass: 2.0, spin: Vector3::zeros(), hits: 0, strength: 1.0 };
        for time in [0.2, 0.8, 1.0] {
            let flights = [flight(0.2, 3.0), flight(0.6, -3.0)];
            flow.sample(&Snapshot { time, flights: &flights, grains: &[grain; 2] });
        }
        let cell = flow.cell(0);
        approx::assert_relative_eq!(cell.volume_fraction.value, 2.0 * PI * 0.01, max_relative = 1e-14);
        // 4 kg × 9 m²/s² over 0.2 m³, and half of it as a pressure.
        approx::assert_relative_eq!(cell.kinetic_stress[0].value, 180.0, max_relative = 1e-14);
        approx::assert_relative_eq!(cell.pressure.value, 90.0, max_relative = 1e-14);
        approx::assert_relative_eq!(cell.temperature.expect("grains").value, 4.5, max_relative = 1e-14);
    }
}
