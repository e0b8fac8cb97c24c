//! Which cells of a picture are covered: so that what cannot be seen is not drawn.

use nalgebra::Vector2;

/// A grid of square cells over a picture; places are in cells from the lower left corner.
pub(super) struct Raster {
    width: usize,
    covered: Vec<bool>,
}

/// Equal runs of covered cells in adjacent rows: left, bottom, right, top, in cells.
pub(super) type Block = [usize; 4];

impl Raster {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, covered: vec![false; width * height] }
    }

    fn height(&self) -> usize {
        self.covered.len() / self.width
    }

    /// Covers a disc; says whether any of it was uncovered and in the picture.
    pub(super) fn cover_disc(&mut self, centre: Vector2<f64>, radius: f64) -> bool {
        let squared = radius.powi(2);
        // A disc that is smaller than a cell still covers the one that it is in.
        let home = centre.map(f64::floor) + Vector2::repeat(0.5);
        self.cover(centre, centre, radius, |cell| cell == home || (cell - centre).norm_squared() <= squared)
    }

    /// Covers a triangle, and at least a line of cells along its edges, for it may be seen edge on.
    pub(super) fn cover_triangle(&mut self, corners: [Vector2<f64>; 3]) {
        let [a, b, c] = corners;
        let low = a.zip_map(&b, f64::min).zip_map(&c, f64::min);
        let high = a.zip_map(&b, f64::max).zip_map(&c, f64::max);
        let side = |from: Vector2<f64>, to: Vector2<f64>, cell: Vector2<f64>| (to - from).perp(&(cell - from));
        self.cover(low, high, 0.0, |cell| {
            let sides = [side(a, b, cell), side(b, c, cell), side(c, a, cell)];
            sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
        });
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let steps = (to - from).amax().min((self.width + self.height()) as f64 * 4.0).ceil().max(1.0);
            for step in 0..=steps as usize {
                let place = from + (to - from) * (step as f64 / steps);
                self.cover(place, place, 0.0, |cell| cell == place.map(f64::floor) + Vector2::repeat(0.5));
            }
        }
    }

    /// Covers those cells about the box from `low` to `high` whose middles are `within`; says whether any was uncovered.
    fn cover(
        &mut self,
        low: Vector2<f64>,
        high: Vector2<f64>,
        margin: f64,
        within: impl Fn(Vector2<f64>) -> bool,
    ) -> bool {
        let (width, height) = (self.width, self.height());
        // Saturates at 0 and at the far side.
        let range = |low: f64, high: f64, end: usize| {
            (low - margin).floor() as usize..((high + margin).floor() as usize + 1).min(end)
        };
        let mut new = false;
        if high.x + margin < 0.0 || high.y + margin < 0.0 {
            return new;
        }
        for row in range(low.y, high.y, height) {
            for column in range(low.x, high.x, width) {
                let cell = &mut self.covered[row * width + column];
                if !*cell && within(Vector2::new(column as f64 + 0.5, row as f64 + 0.5)) {
                    *cell = true;
                    new = true;
                }
            }
        }
        new
    }

    /// All covered cells, as few blocks.
    pub(super) fn blocks(&self) -> Vec<Block> {
        let mut done: Vec<Block> = Vec::new();
        let mut open: Vec<Block> = Vec::new();
        for (row, cells) in self.covered.chunks(self.width).enumerate() {
            let mut next = Vec::new();
            let mut column = 0;
            for run in cells.chunk_by(|a, b| a == b) {
                let (left, right) = (column, column + run.len());
                column = right;
                if run[0] {
                    let below = open.iter().position(|block| (block[0], block[2]) == (left, right));
                    let bottom = below.map_or(row, |index| open.swap_remove(index)[1]);
                    next.push([left, bottom, right, row + 1]);
                }
            }
            done.append(&mut open);
            open = next;
        }
        done.append(&mut open);
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_behind_another_is_hidden() {
        let mut raster = Raster::new(100, 100);
        assert!(raster.cover_disc(Vector2::new(50.0, 50.0), 10.0));
        assert!(!raster.cover_disc(Vector2::new(52.0, 50.0), 5.0));
        assert!(raster.cover_disc(Vector2::new(58.0, 50.0), 5.0));
    }

    #[test]
    fn a_tiny_disc_counts_once_and_one_outside_never() {
        let mut raster = Raster::new(10, 10);
        assert!(raster.cover_disc(Vector2::new(3.1, 3.9), 1e-3));
        assert!(!raster.cover_disc(Vector2::new(3.8, 3.2), 1e-3));
        for outside in [Vector2::new(-5.0, 5.0), Vector2::new(5.0, -5.0), Vector2::new(50.0, 5.0)] {
            assert!(!raster.cover_disc(outside, 1.0));
        }
    }

    #[test]
    fn a_square_of_triangles_is_one_block_and_an_edge_on_triangle_a_line() {
        let mut raster = Raster::new(40, 40);
        let [a, b, c, d] = [(10.5, 10.5), (30.5, 10.5), (30.5, 20.5), (10.5, 20.5)].map(|(x, y)| Vector2::new(x, y));
        raster.cover_triangle([a, b, c]);
        raster.cover_triangle([a, c, d]);
        assert_eq!(raster.blocks(), [[10, 10, 31, 21]]);
        let mut raster = Raster::new(40, 40);
        raster.cover_triangle([a, b, b]);
        assert_eq!(raster.blocks(), [[10, 10, 31, 11]]);
    }
}
