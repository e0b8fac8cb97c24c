//! Measurements that a scene asks for under `[[measure]]`: each watches a run and gives tables, pictures and fields, with errors from batches.

mod ejecta;
mod flow;
mod grid;
mod subsurface;
mod surface_energy;
mod window;

pub use ejecta::{Ejecta, Ejected};
pub use flow::{Flow, FlowCell, PARTS};
pub use grid::Grid;
pub use subsurface::{Contact, DamageCell, HalfSpace, Subsurface};
pub use surface_energy::{EnergyInTime, interference_parameter};
pub use window::Window;

use crate::scene::{Measure, Scene};
use crate::scheme::Observer;
use crate::shown::{Picture, Table};

/// Something that a scene asks to be measured.
pub trait Measurement: Observer {
    /// What has been measured so far.
    fn results(&self) -> Results;
}

/// What a measurement gives.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// The numbers.
    pub tables: Vec<Table>,
    /// The pictures.
    pub pictures: Vec<Picture>,
    /// What has a value in each cell of a grid, for ParaView.
    pub fields: Option<Fields>,
}

/// Values in the cells of a grid.
#[derive(Clone, Debug)]
pub struct Fields {
    /// The grid.
    pub grid: Grid,
    /// Name, components and values of each field; cells in the order of the grid, the components of one together.
    pub arrays: Vec<(&'static str, usize, Vec<f64>)>,
}

/// The measurements of a scene, each with the name of its folder.
#[must_use]
pub fn measurements(scene: &Scene) -> Vec<(String, Box<dyn Measurement>)> {
    let of = |measure: &Measure| -> Box<dyn Measurement> {
        match measure {
            Measure::Flow(flow) => Box::new(Flow::new(flow, scene)),
            Measure::SurfaceEnergy(energy) => Box::new(EnergyInTime::new(energy, scene)),
            Measure::Subsurface(subsurface) => Box::new(Subsurface::new(subsurface, scene)),
            Measure::Ejecta(ejecta) => Box::new(Ejecta::new(ejecta, scene)),
        }
    };
    scene.measure_names().into_iter().zip(scene.measure.iter().map(of)).collect()
}
