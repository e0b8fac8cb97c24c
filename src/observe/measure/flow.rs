//! Density, velocity and granular temperature on a grid (Arbelaez et al. 2009, eq. 43; Huang et al. 2010, fig. 8).

use nalgebra::Vector3;

use super::{Fields, Grid, Measurement, Results, Window};
use crate::estimate::Estimate;
use crate::grains::{Snapshot, sphere_volume};
use crate::scene::{FlowMeasure, Scene};
use crate::scheme::Observer;
use crate::shown::{Axis, Map, Picture, Table};

/// Fields of the flow, averaged over the samples of a run that fall into the window.
///
/// A grain counts in the cell of its centre. Velocities are averaged by mass, Σ m v / Σ m over grains and samples: the mean of the
/// means of single samples, which Arbelaez et al. print, is not the velocity with which mass moves. Granular temperature is a third (in planar
/// scenes half) of the mean square deviation from that velocity, m²/s².
#[derive(Clone, Debug)]
pub struct Flow {
    grid: Grid,
    window: Window,
    /// Directions in which grains move.
    dimensions: f64,
    batches: Vec<Batch>,
}

#[derive(Clone, Debug, Default)]
struct Batch {
    samples: u64,
    cells: Vec<Cell>,
    /// What lay outside the grid.
    outside: Cell,
}

/// Sums over grains and samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    count: f64,
    mass: f64,
    volume: f64,
    momentum: Vector3<f64>,
    /// Σ m v², twice the energy of translation.
    square: f64,
}

impl Cell {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.mass += other.mass;
        self.volume += other.volume;
        self.momentum += other.momentum;
        self.square += other.square;
    }

    /// Mean square deviation from the mean velocity in each direction, m²/s².
    fn temperature(&self, dimensions: f64) -> f64 {
        let mean = self.momentum / self.mass;
        ((self.square / self.mass - mean.norm_squared()) / dimensions).max(0.0)
    }
}

/// What is known of one cell; averages over grains only where there were any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowCell {
    /// Grains per volume, 1/m³.
    pub number_density: Estimate,
    /// Mass per volume, kg/m³.
    pub density: Estimate,
    /// Volume of grains per volume.
    pub volume_fraction: Estimate,
    /// Velocity of the mass, m/s.
    pub velocity: Option<[Estimate; 3]>,
    /// Granular temperature, m²/s².
    pub temperature: Option<f64>,
}

impl Flow {
    /// The fields that a scene asks for.
    #[must_use]
    pub fn new(measure: &FlowMeasure, scene: &Scene) -> Self {
        let grid = Grid::new(measure.min, measure.max, measure.cells, &scene.domain);
        let window = Window::new(crate::scene::Measure::Flow(measure.clone()).span(), &scene.run);
        Self::over(grid, window, scene.domain.planar)
    }

    /// Fields on a grid, over a window.
    #[must_use]
    pub fn over(grid: Grid, window: Window, planar: bool) -> Self {
        let batch = Batch { cells: vec![Cell::default(); grid.len()], ..Batch::default() };
        let dimensions = if planar { 2.0 } else { 3.0 };
        Self { grid, window, dimensions, batches: vec![batch; window.batches] }
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Mass (kg), momentum (kg m/s) and energy of translation (J) inside and outside the grid, averaged over all samples.
    #[must_use]
    pub fn totals(&self) -> (f64, Vector3<f64>, f64) {
        let mut sum = Cell::default();
        self.batches.iter().flat_map(|batch| batch.cells.iter().chain([&batch.outside])).for_each(|cell| sum.add(cell));
        let samples = self.batches.iter().map(|batch| batch.samples).sum::<u64>() as f64;
        (sum.mass / samples, sum.momentum / samples, 0.5 * sum.square / samples)
    }

    /// What is known of a cell.
    #[must_use]
    pub fn cell(&self, cell: usize) -> FlowCell {
        let of = |batch: &Batch| (batch.cells[cell], batch.samples);
        self.summed_up(&self.sampled().map(of).collect::<Vec<_>>(), self.grid.cell_volume())
    }

    /// What is known of all cells together whose middle (m) is `within`, if any is.
    #[must_use]
    pub fn region(&self, within: impl Fn(Vector3<f64>) -> bool) -> Option<FlowCell> {
        let cells: Vec<usize> = (0..self.grid.len()).filter(|&cell| within(self.grid.centre(cell))).collect();
        let of = |batch: &Batch| {
            let mut sum = Cell::default();
            cells.iter().for_each(|&cell| sum.add(&batch.cells[cell]));
            (sum, batch.samples)
        };
        let volume = self.grid.cell_volume() * cells.len() as f64;
        (!cells.is_empty()).then(|| self.summed_up(&self.sampled().map(of).collect::<Vec<_>>(), volume))
    }

    /// Batches with samples in them: a batch that is shorter than the time between samples may have none.
    fn sampled(&self) -> impl Iterator<Item = &Batch> {
        self.batches.iter().filter(|batch| batch.samples > 0)
    }

    fn summed_up(&self, batches: &[(Cell, u64)], volume: f64) -> FlowCell {
        let density = |of: fn(&Cell) -> f64| {
            let per_batch = batches.iter().map(|(cell, samples)| of(cell) / (*samples as f64 * volume));
            Estimate::mean(&per_batch.collect::<Vec<_>>())
        };
        let mut all = Cell::default();
        batches.iter().for_each(|(cell, _)| all.add(cell));
        let velocity = |axis: usize| {
            let pairs = batches.iter().map(|(cell, samples)| {
                let samples = *samples as f64;
                (cell.momentum[axis] / samples, cell.mass / samples)
            });
            Estimate::ratio(&pairs.collect::<Vec<_>>())
        };
        let any = all.count > 0.0;
        FlowCell {
            number_density: density(|cell| cell.count),
            density: density(|cell| cell.mass),
            volume_fraction: density(|cell| cell.volume),
            velocity: any.then(|| [velocity(0), velocity(1), velocity(2)]),
            temperature: any.then(|| all.temperature(self.dimensions)),
        }
    }

    /// Columns of cells as seen along y: from left to right, each from bottom to top.
    fn seen_along_y(&self) -> Vec<Vec<FlowCell>> {
        let [nx, ny, nz] = self.grid.cells.map(|count| count as usize);
        let column = |batch: &Batch, x: usize, z: usize| {
            let mut sum = Cell::default();
            (0..ny).for_each(|y| sum.add(&batch.cells[(z * ny + y) * nx + x]));
            (sum, batch.samples)
        };
        let volume = self.grid.cell_volume() * ny as f64;
        let cell = |x, z| self.summed_up(&self.sampled().map(|batch| column(batch, x, z)).collect::<Vec<_>>(), volume);
        (0..nx).map(|x| (0..nz).map(|z| cell(x, z)).collect()).collect()
    }
}

impl Observer for Flow {
    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        let Some(batch) = self.window.batch(snapshot.time) else { return };
        let batch = &mut self.batches[batch];
        batch.samples += 1;
        for (flight, grain) in snapshot.flights.iter().zip(snapshot.grains) {
            let here = match self.grid.cell(&flight.position) {
                Some(cell) => &mut batch.cells[cell],
                None => &mut batch.outside,
            };
            here.add(&Cell {
                count: 1.0,
                mass: grain.mass,
                volume: sphere_volume(flight.radius),
                momentum: flight.velocity * grain.mass,
                square: grain.mass * flight.velocity.norm_squared(),
            });
        }
    }
}

impl Measurement for Flow {
    fn results(&self) -> Results {
        let cells: Vec<FlowCell> = (0..self.grid.len()).map(|cell| self.cell(cell)).collect();
        Results {
            tables: vec![table(&self.grid, &cells)],
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
        ],
    );
    for (index, cell) in cells.iter().enumerate() {
        let place = grid.centre(index);
        let densities = [cell.number_density, cell.density, cell.volume_fraction].map(Some);
        let velocity = cell.velocity.map_or([None; 3], |velocity| velocity.map(Some));
        let mut row: Vec<String> = place.iter().map(f64::to_string).collect();
        for estimate in densities.into_iter().chain(velocity) {
            row.extend(estimate.map_or(["".into(), "".into()], |of| [of.value.to_string(), of.error.to_string()]));
        }
        row.push(cell.temperature.map_or(String::new(), |temperature| temperature.to_string()));
        table.rows.push(row);
    }
    table
}

fn fields(grid: Grid, cells: &[FlowCell]) -> Fields {
    let of = |value: fn(&FlowCell) -> f64| cells.iter().map(value).collect::<Vec<_>>();
    let velocity = |cell: &FlowCell| cell.velocity.map_or([f64::NAN; 3], |velocity| velocity.map(|part| part.value));
    Fields {
        grid,
        arrays: vec![
            ("number_density", 1, of(|cell| cell.number_density.value)),
            ("density", 1, of(|cell| cell.density.value)),
            ("density_error", 1, of(|cell| cell.density.error)),
            ("volume_fraction", 1, of(|cell| cell.volume_fraction.value)),
            ("velocity", 3, cells.iter().flat_map(velocity).collect()),
            ("temperature", 1, of(|cell| cell.temperature.unwrap_or(f64::NAN))),
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
            map("temperature", "Granular temperature", "m²/s²", &|cell| cell.temperature),
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
        let all = flow.region(|_| true).expect("cells");
        let volume = JET.cell_volume() * JET.len() as f64;
        let inside: f64 = (0..JET.len()).map(|cell| flow.cell(cell).density.value * JET.cell_volume()).sum();
        assert!(inside > 0.0 && inside < mass, "some are outside the grid");
        approx::assert_relative_eq!(all.density.value * volume, inside, max_relative = 1e-13);
        let fullest = (0..JET.len()).max_by(|&a, &b| flow.cell(a).density.value.total_cmp(&flow.cell(b).density.value));
        let fullest = fullest.expect("a cell");
        let alone = flow.region(|place| place == JET.centre(fullest)).expect("a cell");
        assert_eq!((alone.density, alone.velocity), (flow.cell(fullest).density, flow.cell(fullest).velocity));
        assert!(flow.region(|_| false).is_none());
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
        approx::assert_relative_eq!(low.temperature.unwrap(), 2.25, max_relative = 1e-15);
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
}
