//! Where on the surface the hits fell: by triangle, and by square cells on planes.

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use crate::scheme::{Observer, SurfaceHit};
use crate::surface::Surface;

/// A plane of the surface, as pictures need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneShape {
    /// Its number among the elements of the surface.
    pub element: u32,
    /// A point of the plane, m.
    pub point: Vector3<f64>,
    /// Unit normal, towards the grains.
    pub normal: Vector3<f64>,
}

/// A triangle of the surface, as pictures need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleShape {
    /// Its number among the elements of the surface.
    pub element: u32,
    /// Its corners, m.
    pub corners: [Vector3<f64>; 3],
}

/// The shape of the whole surface where the run starts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceShape {
    /// The planes.
    pub planes: Vec<PlaneShape>,
    /// The triangles.
    pub triangles: Vec<TriangleShape>,
}

impl SurfaceShape {
    /// Whether there is no surface.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty() && self.triangles.is_empty()
    }
}

impl From<&Surface> for SurfaceShape {
    fn from(surface: &Surface) -> Self {
        let planes = surface.planes().map(|(element, point, normal)| PlaneShape { element, point, normal });
        let triangles = surface.triangles().map(|(element, corners)| TriangleShape { element, corners });
        Self { planes: planes.collect(), triangles: triangles.collect() }
    }
}

/// Hits on one piece of the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// How many.
    pub hits: u64,
    /// Energy that they brought, J.
    pub energy: f64,
    /// Normal impulse, N s.
    pub impulse_normal: f64,
}

impl Tally {
    fn add(&mut self, other: Self) {
        self.hits += other.hits;
        self.energy += other.energy;
        self.impulse_normal += other.impulse_normal;
    }
}

/// Hits by element, and on planes by square cells.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMap {
    elements: Vec<Tally>,
    planes: Vec<PlaneMap>,
}

impl SurfaceMap {
    /// A map of no hits; cells on planes are `finest` (m) wide at first.
    ///
    /// Cells smaller than a grain show nothing but noise, so take its radius.
    #[must_use]
    pub fn new(shape: &SurfaceShape, finest: f64) -> Self {
        Self { elements: Vec::new(), planes: shape.planes.iter().map(|plane| PlaneMap::new(plane, finest)).collect() }
    }

    /// Hits on an element.
    #[must_use]
    pub fn element(&self, element: u32) -> Tally {
        self.elements.get(element as usize).copied().unwrap_or_default()
    }

    /// The maps of the planes.
    #[must_use]
    pub fn planes(&self) -> &[PlaneMap] {
        &self.planes
    }
}

impl Observer for SurfaceMap {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let tally = Tally { hits: 1, energy: hit.energy(), impulse_normal: hit.impulse_normal };
        let index = hit.element as usize;
        if index >= self.elements.len() {
            self.elements.resize(index + 1, Tally::default());
        }
        self.elements[index].add(tally);
        if let Some(plane) = self.planes.iter_mut().find(|plane| plane.shape.element == hit.element) {
            plane.add(&hit.position, tally);
        }
    }
}

/// Hits on one plane, by square cells.
///
/// A plane has no end, and where it will be hit is not known before. So cells start small, and whenever the hits come to
/// span more than [`PlaneMap::MAX_CELLS`] of them, each four become one.
#[derive(Clone, Debug)]
pub struct PlaneMap {
    /// The plane.
    pub shape: PlaneShape,
    axes: [Vector3<f64>; 2],
    width: f64,
    cells: FxHashMap<[i64; 2], Tally>,
    low: [i64; 2],
    high: [i64; 2],
}

impl PlaneMap {
    /// At most so many cells along each side: a footprint of a tenth of the spray is told in detail, for some 20 MB at most.
    pub const MAX_CELLS: i64 = 512;

    fn new(shape: &PlaneShape, finest: f64) -> Self {
        let axes = axes_along(&shape.normal);
        Self {
            shape: *shape,
            axes,
            width: finest,
            cells: FxHashMap::default(),
            low: [i64::MAX; 2],
            high: [i64::MIN; 2],
        }
    }

    /// Width of a cell, m.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Two unit vectors along the plane; with the normal they are a right-handed frame.
    #[must_use]
    pub fn axes(&self) -> [Vector3<f64>; 2] {
        self.axes
    }

    /// Lowest and highest cell that was hit, if any was.
    #[must_use]
    pub fn extent(&self) -> Option<([i64; 2], [i64; 2])> {
        (!self.cells.is_empty()).then_some((self.low, self.high))
    }

    /// The cells that were hit, in no order.
    pub fn cells(&self) -> impl Iterator<Item = ([i64; 2], Tally)> {
        self.cells.iter().map(|(&cell, &tally)| (cell, tally))
    }

    /// Hits in a cell.
    #[must_use]
    pub fn cell(&self, cell: [i64; 2]) -> Tally {
        self.cells.get(&cell).copied().unwrap_or_default()
    }

    /// The place (m) of coordinates along [`axes`](Self::axes), counted in cells from the point of the plane.
    #[must_use]
    pub fn place(&self, along: [f64; 2]) -> Vector3<f64> {
        self.shape.point + (self.axes[0] * along[0] + self.axes[1] * along[1]) * self.width
    }

    fn add(&mut self, position: &Vector3<f64>, tally: Tally) {
        let from_point = position - self.shape.point;
        let cell = self.axes.map(|axis| (axis.dot(&from_point) / self.width).floor() as i64);
        self.cells.entry(cell).or_default().add(tally);
        self.low = std::array::from_fn(|axis| self.low[axis].min(cell[axis]));
        self.high = std::array::from_fn(|axis| self.high[axis].max(cell[axis]));
        while (0..2).any(|axis| self.high[axis].saturating_sub(self.low[axis]) >= Self::MAX_CELLS) {
            self.coarsen();
        }
    }

    fn coarsen(&mut self) {
        let halved = |cell: [i64; 2]| cell.map(|index| index.div_euclid(2));
        for (cell, tally) in std::mem::take(&mut self.cells) {
            self.cells.entry(halved(cell)).or_default().add(tally);
        }
        (self.low, self.high) = (halved(self.low), halved(self.high));
        self.width *= 2.0;
    }
}

/// Two unit vectors across `normal`, the first as near as can be to the coordinate axis that is most nearly across it.
pub(super) fn axes_along(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = if normal.x.abs() <= normal.y.abs().max(normal.z.abs()) { Vector3::x() } else { Vector3::y() };
    let first = (axis - normal * normal.dot(&axis)).normalize();
    [first, normal.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;

    fn floor() -> SurfaceShape {
        let plane = PlaneShape { element: 3, point: Vector3::new(0.0, 0.0, 1.0), normal: Vector3::z() };
        SurfaceShape { planes: vec![plane], triangles: Vec::new() }
    }

    #[test]
    fn axes_are_a_right_handed_frame() {
        for normal in [Vector3::z(), Vector3::x(), -Vector3::y(), Vector3::new(1.0, 1.0, 1.0).normalize()] {
            let [u, v] = axes_along(&normal);
            approx::assert_relative_eq!(u.cross(&v), normal, epsilon = 1e-15);
        }
        assert_eq!(axes_along(&Vector3::z()), [Vector3::x(), Vector3::y()]);
    }

    #[test]
    fn coarser_cells_lose_no_hit() {
        let mut map = SurfaceMap::new(&floor(), 0.01);
        let hit = |x: f64, y: f64| SurfaceHit {
            element: 3,
            position: Vector3::new(x, y, 1.0),
            energy_normal: 2.0,
            ..FakeJet::hit(1)
        };
        for step in 0..1000 {
            let x = f64::from(step) * 0.01;
            map.surface_hit(&hit(x, -x));
        }
        let plane = &map.planes()[0];
        let (low, high) = plane.extent().unwrap();
        assert_eq!(plane.width(), 0.02); // 10 m / 512 cells, rounded up to 0.01 m times a power of 2
        assert!(high[0] - low[0] < PlaneMap::MAX_CELLS);
        let all = (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| [x, y]));
        let (hits, energy) =
            all.map(|cell| plane.cell(cell)).fold((0, 0.0), |sum, cell| (sum.0 + cell.hits, sum.1 + cell.energy));
        assert_eq!((hits, energy), (1000, 2000.0));
        assert_eq!(map.element(3).hits, 1000);
        assert_eq!(map.element(7), Tally::default());
    }

    #[test]
    fn a_hit_far_away_ends_in_finitely_many_steps() {
        let mut map = SurfaceMap::new(&floor(), 1e-6);
        for x in [0.0, 1e9] {
            map.surface_hit(&SurfaceHit { element: 3, position: Vector3::new(x, 0.0, 1.0), ..FakeJet::hit(1) });
        }
        assert_eq!(map.planes()[0].cells.len(), 2);
    }
}
