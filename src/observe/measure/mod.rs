//! Measurements that a scene asks for under `[[measure]]`: each watches a run and gives tables, pictures and fields, with errors from batches.

mod flow;
mod free_jet;
mod grid;
mod outflow;
mod patches;
mod surface_stress;
mod window;

pub use flow::{Flow, FlowCell};
pub use free_jet::FreeJet;
pub use grid::Grid;
pub use outflow::{Outflow, Profile, ProfileMoments, Quantity};
pub use patches::{Patch, Patches};
pub use surface_stress::{PatchStress, Stress, SurfaceStress};
pub use window::Window;

use nalgebra::Vector3;

use super::SurfaceShape;
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
    /// What has a value on each patch of the surface, for ParaView.
    pub facets: Option<FacetFields>,
}

/// Values in the cells of a grid.
#[derive(Clone, Debug)]
pub struct Fields {
    /// The grid.
    pub grid: Grid,
    /// Name, components and values of each field; cells in the order of the grid, the components of one together.
    pub arrays: Vec<(&'static str, usize, Vec<f64>)>,
}

/// Values on patches of the surface.
#[derive(Clone, Debug)]
pub struct FacetFields {
    /// Corners of each patch, m.
    pub corners: Vec<Vec<Vector3<f64>>>,
    /// Name, components and values of each field; patches in the order of their corners, the components of one together.
    pub arrays: Vec<(&'static str, usize, Vec<f64>)>,
}

/// The measurements of a scene whose surface has the given shape, each with the name of its folder.
#[must_use]
pub fn measurements(scene: &Scene, shape: &SurfaceShape) -> Vec<(String, Box<dyn Measurement>)> {
    let of = |measure: &Measure| -> Box<dyn Measurement> {
        match measure {
            Measure::Flow(flow) => Box::new(Flow::new(flow, scene)),
            Measure::SurfaceStress(stress) => Box::new(SurfaceStress::new(stress, scene, shape)),
            Measure::Outflow(outflow) => Box::new(Outflow::new(outflow, scene)),
        }
    };
    scene.measure_names().into_iter().zip(scene.measure.iter().map(of)).collect()
}
