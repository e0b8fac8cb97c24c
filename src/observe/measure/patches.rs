//! Patches of the surface: a rectangle divided into equal ones, or the triangles of meshes.

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use crate::observe::SurfaceShape;
use crate::observe::surface_map::axes_along;
use crate::scene::{PatchGrid, Vec3};
use crate::scheme::SurfaceHit;

/// A patch of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Its corners, m.
    pub corners: Vec<Vector3<f64>>,
    /// Its middle, m.
    pub centre: Vector3<f64>,
    /// Its area, m²; in a planar scene the length of its part of the plane y = 0, m.
    pub area: f64,
    /// Unit normal, the direction in which shear is positive, and the direction across both.
    pub frame: [Vector3<f64>; 3],
}

/// All patches of a measurement, and which of them a hit is on.
#[derive(Clone, Debug)]
pub struct Patches {
    patches: Vec<Patch>,
    finder: Finder,
}

#[derive(Clone, Debug)]
enum Finder {
    Grid(Grid),
    /// The patch of an element of the surface.
    Triangles(FxHashMap<u32, usize>),
}

/// A rectangle divided into equal cells; those along the first side count fastest.
#[derive(Clone, Debug)]
struct Grid {
    /// The corner from which cells are counted, m.
    corner: Vector3<f64>,
    normal: Vector3<f64>,
    sides: [Vector3<f64>; 2],
    /// Sides of a cell, m.
    spacing: [f64; 2],
    cells: [u32; 2],
    /// Furthest that a hit may be from the plane, m.
    within: f64,
}

impl Patches {
    /// The patches of a rectangle; shear is positive along `direction`, or along its first side.
    #[must_use]
    pub fn grid(grid: &PatchGrid, direction: Option<Vec3>, planar: bool) -> Self {
        let normal = Vector3::from(grid.normal).normalize();
        let along = Vector3::from(grid.along);
        let along = (along - normal * normal.dot(&along)).normalize();
        let sides = [along, normal.cross(&along)];
        let spacing = [0, 1].map(|side| grid.size[side] / f64::from(grid.cells[side]));
        let corner = Vector3::from(grid.centre) - (sides[0] * grid.size[0] + sides[1] * grid.size[1]) * 0.5;
        let direction = direction.map_or(along, Vector3::from);
        let frame = frame(normal, &direction);
        let at = |i: f64, j: f64| corner + sides[0] * (i * spacing[0]) + sides[1] * (j * spacing[1]);
        let area = if planar { spacing[0] } else { spacing[0] * spacing[1] };
        let patch = |i: u32, j: u32| {
            let (i, j) = (f64::from(i), f64::from(j));
            let corners = vec![at(i, j), at(i + 1.0, j), at(i + 1.0, j + 1.0), at(i, j + 1.0)];
            Patch { corners, centre: at(i + 0.5, j + 0.5), area, frame }
        };
        let patches = (0..grid.cells[1]).flat_map(|j| (0..grid.cells[0]).map(move |i| (i, j)));
        let patches = patches.map(|(i, j)| patch(i, j)).collect();
        let within = grid.within.unwrap_or(f64::INFINITY);
        Self { patches, finder: Finder::Grid(Grid { corner, normal, sides, spacing, cells: grid.cells, within }) }
    }

    /// The triangles of a surface; shear is positive along `direction`, or x, as far as that lies in a triangle. In a planar scene those that do
    /// not meet the plane y = 0 are left out.
    #[must_use]
    pub fn triangles(shape: &SurfaceShape, direction: Option<Vec3>, planar: bool) -> Self {
        let direction = direction.map_or_else(Vector3::x, Vector3::from);
        let mut found = Self { patches: Vec::new(), finder: Finder::Triangles(FxHashMap::default()) };
        for triangle in &shape.triangles {
            let [a, b, c] = triangle.corners;
            let normal = (b - a).cross(&(c - a));
            let area = if planar { section(&triangle.corners) } else { 0.5 * normal.norm() };
            if area <= 0.0 {
                continue;
            }
            if let Finder::Triangles(elements) = &mut found.finder {
                elements.insert(triangle.element, found.patches.len());
            }
            let frame = frame(normal.normalize(), &direction);
            found.patches.push(Patch { corners: vec![a, b, c], centre: (a + b + c) / 3.0, area, frame });
        }
        found
    }

    /// The patches.
    #[must_use]
    pub fn all(&self) -> &[Patch] {
        &self.patches
    }

    /// The patch that a hit is on, if it is on any.
    #[must_use]
    pub fn of(&self, hit: &SurfaceHit) -> Option<usize> {
        match &self.finder {
            Finder::Triangles(elements) => elements.get(&hit.element).copied(),
            Finder::Grid(grid) => grid.cell(&hit.position),
        }
    }

    /// Columns of patches along the first side of their rectangle, each from one end of the other side to the other; none where patches are
    /// triangles.
    #[must_use]
    pub fn columns(&self) -> Option<Vec<Vec<usize>>> {
        let Finder::Grid(grid) = &self.finder else { return None };
        let [m, n] = grid.cells.map(|count| count as usize);
        Some((0..m).map(|i| (0..n).map(|j| j * m + i).collect()).collect())
    }

    /// Lengths of the sides of the rectangle, m; none where patches are triangles.
    #[must_use]
    pub fn sides(&self) -> Option<[f64; 2]> {
        let Finder::Grid(grid) = &self.finder else { return None };
        Some([0, 1].map(|side| grid.spacing[side] * f64::from(grid.cells[side])))
    }
}

impl Grid {
    fn cell(&self, place: &Vector3<f64>) -> Option<usize> {
        let from_corner = place - self.corner;
        if from_corner.dot(&self.normal).abs() > self.within {
            return None;
        }
        let along = |side: usize| {
            let index = (from_corner.dot(&self.sides[side]) / self.spacing[side]).floor();
            (0.0..f64::from(self.cells[side])).contains(&index).then_some(index as usize)
        };
        Some(along(1)? * self.cells[0] as usize + along(0)?)
    }
}

/// Normal, the part of `direction` across it, and the direction across both: unit vectors.
fn frame(normal: Vector3<f64>, direction: &Vector3<f64>) -> [Vector3<f64>; 3] {
    /// Sine of the angle to the normal below which rounding would choose the direction.
    const PARALLEL: f64 = 1e-9;
    let across_normal = direction - normal * normal.dot(direction);
    let along = if across_normal.norm() > PARALLEL * direction.norm() {
        across_normal.normalize()
    } else {
        axes_along(&normal)[0]
    };
    [normal, along, normal.cross(&along)]
}

/// Length of a triangle's part of the plane y = 0, m.
fn section(corners: &[Vector3<f64>; 3]) -> f64 {
    let mut points: Vec<Vector3<f64>> = corners.iter().filter(|corner| corner.y == 0.0).copied().collect();
    for side in 0..3 {
        let [a, b] = [corners[side], corners[(side + 1) % 3]];
        if a.y * b.y < 0.0 {
            points.push(a + (b - a) * (a.y / (a.y - b.y)));
        }
    }
    let ends = points.iter().flat_map(|a| points.iter().map(move |b| (a - b).norm()));
    ends.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::TriangleShape;
    use crate::observe::fake_jet::FakeJet;

    fn rectangle() -> PatchGrid {
        PatchGrid {
            centre: [1.0, 0.0, 2.0],
            normal: [0.0, 0.0, 3.0],
            along: [0.0, 2.0, 1.0],
            size: [2.0, 6.0],
            cells: [2, 3],
            within: Some(0.1),
        }
    }

    #[test]
    fn a_rectangle_is_divided_along_its_sides() {
        let patches = Patches::grid(&rectangle(), Some([1.0, 0.0, 5.0]), false);
        // Along y, and across it along -x.
        let at = |x, y, z| patches.of(&SurfaceHit { position: Vector3::new(x, y, z), ..FakeJet::hit(1) });
        assert_eq!([at(3.9, -0.5, 2.0), at(3.9, 0.5, 2.05), at(-1.9, 0.5, 2.0)], [Some(0), Some(1), Some(5)]);
        assert_eq!([at(4.1, 0.5, 2.0), at(3.9, -1.1, 2.0), at(3.9, 0.5, 2.11)], [None; 3]);
        let patch = &patches.all()[5];
        assert_eq!((patch.area, patch.centre), (2.0, Vector3::new(-1.0, 0.5, 2.0)));
        assert_eq!(patch.frame, [Vector3::z(), Vector3::x(), Vector3::y()]);
        assert_eq!(patches.columns(), Some(vec![vec![0, 2, 4], vec![1, 3, 5]]));
        assert_eq!(Patches::grid(&rectangle(), None, true).all()[5].area, 1.0, "a length in a planar scene");
    }

    #[test]
    fn triangles_have_their_area_or_their_part_of_the_plane() {
        let corners =
            |lift: f64| [(0.0, -1.0), (2.0, -1.0), (2.0, 3.0)].map(|(x, y)| Vector3::new(x, y + lift, 0.5 * x));
        let shape = |lift| SurfaceShape {
            planes: Vec::new(),
            triangles: vec![TriangleShape { element: 7, corners: corners(lift) }],
        };
        let patches = Patches::triangles(&shape(0.0), None, false);
        approx::assert_relative_eq!(patches.all()[0].area, 4.0 * 1.25_f64.sqrt(), max_relative = 1e-15);
        let [_, along, _] = patches.all()[0].frame;
        approx::assert_relative_eq!(along, Vector3::new(2.0, 0.0, 1.0).normalize(), max_relative = 1e-15);
        assert_eq!(patches.of(&SurfaceHit { element: 7, ..FakeJet::hit(1) }), Some(0));
        assert_eq!(patches.of(&FakeJet::hit(1)), None);
        // It meets y = 0 from x = 1/2 to 2.
        let area = |lift| Patches::triangles(&shape(lift), None, true).all().first().map(|patch| patch.area);
        approx::assert_relative_eq!(area(0.0).expect("it meets"), 1.5 * 1.25_f64.sqrt(), max_relative = 1e-15);
        approx::assert_relative_eq!(area(1.0).expect("an edge"), 2.0 * 1.25_f64.sqrt(), max_relative = 1e-15);
        assert_eq!(area(1.5), None);
    }
}
