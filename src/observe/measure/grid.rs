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

    /// Cuts the line from one place to another (m) where it crosses from cell to cell, and hands `take` the middle of each piece and the part of the
    /// line that it is. Outside, cells go on as inside.
    pub fn pieces(&self, from: Vector3<f64>, to: Vector3<f64>, mut take: impl FnMut(Vector3<f64>, f64)) {
        let along = to - from;
        let spacing = self.spacing();
        let cell = |place: &Vector3<f64>, axis: usize| ((place[axis] - self.min[axis]) / spacing[axis]).floor();
        // Of each axis how many sides are left to cross, the number of the next one, and the way on.
        let mut sides = [0, 1, 2].map(|axis| {
            let [start, end] = [&from, &to].map(|place| cell(place, axis));
            let way = (end - start).signum();
            ((end - start).abs(), if way > 0.0 { start + 1.0 } else { start }, way)
        });
        let mut done = 0.0;
        loop {
            let crossing = |axis: usize| match sides[axis] {
                (left, side, _) if left > 0.0 => (self.min[axis] + side * spacing[axis] - from[axis]) / along[axis],
                _ => f64::INFINITY,
            };
            let at = [0, 1, 2].map(crossing);
            let axis = (0..3).fold(0, |first, axis| if at[axis] < at[first] { axis } else { first });
            // Rounding may see a side just before the last one, or just beyond the end.
            let end = at[axis].clamp(done, 1.0);
            take(from + along * (0.5 * (done + end)), end - done);
            if at[axis] == f64::INFINITY {
                return;
            }
            let (left, side, way) = &mut sides[axis];
            (*left, *side) = (*left - 1.0, *side + *way);
            done = end;
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_cut_where_it_leaves_a_cell() {
        let grid = Grid { min: [0.0; 3], max: [2.0, 1.0, 3.0], cells: [2, 1, 3] };
        let pieces = |from: [f64; 3], to: [f64; 3]| {
            let mut pieces = Vec::new();
            grid.pieces(from.into(), to.into(), |middle, part| pieces.push((grid.cell(&middle), part)));
            pieces
        };
        assert_eq!(pieces([0.25, 0.5, 0.5], [0.75, 0.5, 0.5]), [(Some(0), 1.0)]);
        assert_eq!(pieces([1.5, 0.5, 0.5], [0.5, 0.5, 0.5]), [(Some(1), 0.5), (Some(0), 0.5)]);
        // Across x at half of the way, across z at a quarter and three quarters.
        let expected = [(Some(0), 0.25), (Some(2), 0.25), (Some(3), 0.25), (Some(5), 0.25)];
        assert_eq!(pieces([0.5, 0.5, 0.5], [1.5, 0.5, 2.5]), expected);
        // Out through the upper side of the box.
        assert_eq!(pieces([0.5, 0.5, 2.5], [0.5, 0.5, 3.5]), [(Some(4), 0.5), (None, 0.5)]);
    }
}
