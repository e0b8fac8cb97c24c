//! A box divided into equal cells.

use nalgebra::Vector3;

use crate::scene::{Domain, Vec3};

/// A box divided into equal cells; x counts fastest.
///
/// ```
/// use impinge::observe::measure::Grid;
/// use nalgebra::Vector3;
///
/// let grid = Grid { min: [0.0; 3], max: [2.0, 1.0, 3.0], cells: [2, 1, 3] };
/// assert_eq!(grid.cell(&Vector3::new(1.5, 0.5, 1.2)), Some(3));
/// assert_eq!(grid.cell(&Vector3::new(2.0, 0.5, 1.2)), None); // upper sides are outside
/// assert_eq!(grid.centre(3), Vector3::new(1.5, 0.5, 1.5));
/// assert_eq!(grid.cell_volume(), 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Lower corner, m.
    pub min: Vec3,
    /// Upper corner, m.
    pub max: Vec3,
    /// Cells along x, y and z.
    pub cells: [u32; 3],
}

impl Grid {
    /// The grid that a scene asks for: what is left out is the domain.
    #[must_use]
    pub fn new(min: Option<Vec3>, max: Option<Vec3>, cells: [u32; 3], domain: &Domain) -> Self {
        Self { min: min.unwrap_or(domain.min), max: max.unwrap_or(domain.max), cells }
    }

    /// How many cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.iter().map(|&count| count as usize).product()
    }

    /// Whether there is no cell.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sides of a cell, m.
    #[must_use]
    pub fn spacing(&self) -> Vec3 {
        std::array::from_fn(|axis| (self.max[axis] - self.min[axis]) / f64::from(self.cells[axis]))
    }

    /// Volume of a cell, m³.
    #[must_use]
    pub fn cell_volume(&self) -> f64 {
        self.spacing().iter().product()
    }

    /// The cell in which a place (m) lies; none outside.
    #[must_use]
    pub fn cell(&self, place: &Vector3<f64>) -> Option<usize> {
        let spacing = self.spacing();
        let along = |axis: usize| {
            let index = ((place[axis] - self.min[axis]) / spacing[axis]).floor();
            (0.0..f64::from(self.cells[axis])).contains(&index).then_some(index as usize)
        };
        let [x, y, z] = [along(0)?, along(1)?, along(2)?];
        let [nx, ny, _] = self.cells.map(|count| count as usize);
        Some((z * ny + y) * nx + x)
    }

    /// The middle of a cell, m.
    #[must_use]
    pub fn centre(&self, cell: usize) -> Vector3<f64> {
        let [nx, ny, _] = self.cells.map(|count| count as usize);
        let index = [cell % nx, cell / nx % ny, cell / (nx * ny)];
        let spacing = self.spacing();
        Vector3::from_fn(|axis, _| self.min[axis] + (index[axis] as f64 + 0.5) * spacing[axis])
    }
}
