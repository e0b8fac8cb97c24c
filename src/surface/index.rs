//! Which triangles can a grain touch soon? A tree of boxes over a mesh.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use impinge_events::contact_time::Sweep;
use impinge_events::{Mesh, Outlook, prefetch};
use nalgebra::{Point3, Vector3};

/// By how much (relative to coordinates and radii) boxes are widened, so that rounding never hides a triangle.
///
/// Where a flight enters a box is known to a few units in the last place (2^-53) of the coordinates. Consequence: now and
/// then a triangle is tried in vain.
const BOX_SLACK: f64 = 1.0 / (1u64 << 46) as f64;

/// A mesh with the tree over it.
#[derive(Clone, Debug)]
pub(super) struct Index {
    mesh: Mesh,
    bounds: Aabb<f64, 3>,
    /// What lies below the root first.
    nodes: Vec<Node>,
    root: Child,
}

/// A branch of the tree. Two boxes of short numbers and their children fill one line of the cache: to wait for memory is most of what a search costs.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Node {
    boxes: [ShortBox; 2],
    children: [Child; 2],
}

const _: () = assert!(size_of::<Node>() == 64);

/// A node, by its number, or, with the bit [`Child::TRIANGLE`], a triangle.
#[derive(Clone, Copy, Debug)]
struct Child(u32);

impl Child {
    const TRIANGLE: u32 = 1 << 31;

    #[inline]
    fn triangle(self) -> Option<usize> {
        (self.0 & Self::TRIANGLE != 0).then_some((self.0 & !Self::TRIANGLE) as usize)
    }
}

/// A box that holds another one, in numbers half as long.
#[derive(Clone, Copy, Debug)]
struct ShortBox {
    min: [f32; 3],
    max: [f32; 3],
}

impl ShortBox {
    fn around(bounds: &Aabb<f64, 3>) -> Self {
        let below = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
        let above = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
        let three = |point: &Point3<f64>, round: &dyn Fn(f64) -> f32| [0, 1, 2].map(|axis| round(point[axis]));
        Self { min: three(&bounds.min, &below), max: three(&bounds.max, &above) }
    }

    #[inline]
    fn bounds(&self) -> Aabb<f64, 3> {
        Aabb { min: self.min.map(f64::from).into(), max: self.max.map(f64::from).into() }
    }
}

/// Adds the nodes of a tree from number `at` on to `nodes`, each before those below it.
fn shorten(tree: &[BvhNode<f64, 3>], at: usize, nodes: &mut Vec<Node>) -> Child {
    match &tree[at] {
        BvhNode::Leaf { shape_index, .. } => Child(Child::TRIANGLE | *shape_index as u32),
        BvhNode::Node { child_l_index, child_l_aabb, child_r_index, child_r_aabb, .. } => {
            let (number, boxes) = (nodes.len(), [child_l_aabb, child_r_aabb].map(ShortBox::around));
            nodes.push(Node { boxes, children: [Child(0); 2] });
            nodes[number].children = [*child_l_index, *child_r_index].map(|child| shorten(tree, child, nodes));
            Child(number as u32)
        }
    }
}

/// The box of one triangle, for building the tree.
struct TriangleBox {
    bounds: Aabb<f64, 3>,
    node: usize,
}

impl Bounded<f64, 3> for TriangleBox {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.bounds
    }
}

impl BHShape<f64, 3> for TriangleBox {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Index {
    /// The tree over a mesh that is not empty.
    pub(super) fn new(mesh: Mesh) -> Self {
        let largest = mesh.vertices().iter().map(|vertex| vertex.amax()).fold(f64::MIN_POSITIVE, f64::max);
        let slack = Vector3::repeat(BOX_SLACK * largest);
        let mut boxes: Vec<_> = (0..mesh.len())
            .map(|triangle| {
                let tight =
                    mesh.triangle(triangle).iter().fold(Aabb::empty(), |bounds, &corner| bounds.grow(&corner.into()));
                TriangleBox { bounds: Aabb::with_bounds(tight.min - slack, tight.max + slack), node: 0 }
            })
            .collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        let root = shorten(&Bvh::build(&mut boxes).nodes, 0, &mut nodes);
        let bounds = boxes.iter().fold(Aabb::empty(), |bounds, one| bounds.join(&one.bounds));
        Self { mesh, bounds, nodes, root }
    }

    /// The children of a node, with their boxes.
    #[inline]
    fn below(&self, node: Child) -> [(Aabb<f64, 3>, Child); 2] {
        let Node { boxes, children } = &self.nodes[node.0 as usize];
        [(boxes[0].bounds(), children[0]), (boxes[1].bounds(), children[1])]
    }

    /// Asks the memory for a node or a triangle, which comes while it is found out whether it is needed.
    #[inline]
    fn fetch(&self, child: Child) {
        match child.triangle() {
            Some(triangle) => self.mesh.fetch(triangle),
            None => prefetch(&self.nodes, child.0 as usize),
        }
    }

    pub(super) fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The first contact of a sweep until `until` (s), elements counted from 0.
    pub(super) fn first_contact(&self, sweep: &Sweep, until: f64) -> Outlook {
        let mut search = Search::new(self, sweep, until);
        let (enter, leave) = search.passage(&self.bounds);
        if !enter.is_finite() {
            return Outlook::ClearUntil(f64::INFINITY);
        }
        let enter = sweep.time(enter);
        if enter > until {
            return Outlook::ClearUntil(enter);
        }
        search.visit(self.root);
        match search.element {
            Some(element) => Outlook::Hit { time: search.time, element },
            None if sweep.time(leave) <= until => Outlook::ClearUntil(f64::INFINITY),
            None => Outlook::ClearUntil(until),
        }
    }

    /// The triangle nearest to `point` and its distance, if that is at most `within` (m). Of equal ones, the lowest.
    pub(super) fn nearest(&self, point: &Vector3<f64>, within: f64) -> Option<(u32, f64)> {
        let mut best = (u32::MAX, within);
        self.nearest_below(self.root, point, &mut best);
        (best.0 != u32::MAX).then_some(best)
    }

    fn nearest_below(&self, node: Child, point: &Vector3<f64>, best: &mut (u32, f64)) {
        if let Some(triangle) = node.triangle() {
            let distance = (self.mesh.nearest(triangle, point) - point).norm();
            let candidate = (triangle as u32, distance);
            if distance < best.1 || distance == best.1 && candidate.0 < best.0 {
                *best = candidate;
            }
            return;
        }
        let mut children =
            self.below(node).map(|(bounds, child)| (bounds.min_distance_squared(Point3::from(*point)).sqrt(), child));
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (distance, child) in children {
            if distance <= best.1 {
                self.nearest_below(child, point, best);
            }
        }
    }

    /// Calls `visit` with every triangle nearer to `point` than `distance` (m), and its nearest point.
    pub(super) fn within(&self, point: &Vector3<f64>, distance: f64, visit: &mut impl FnMut(u32, Vector3<f64>)) {
        self.within_below(self.root, point, distance, visit);
    }

    fn within_below(
        &self,
        node: Child,
        point: &Vector3<f64>,
        distance: f64,
        visit: &mut impl FnMut(u32, Vector3<f64>),
    ) {
        if let Some(triangle) = node.triangle() {
            let nearest = self.mesh.nearest(triangle, point);
            if (nearest - point).norm_squared() < distance * distance {
                visit(triangle as u32, nearest);
            }
            return;
        }
        for (bounds, child) in self.below(node) {
            if bounds.min_distance_squared(Point3::from(*point)) < distance * distance {
                self.within_below(child, point, distance, visit);
            }
        }
    }

    /// Whether `point` lies inside a watertight mesh: a ray from it comes out through an odd number of triangles.
    pub(super) fn encloses(&self, point: &Vector3<f64>) -> bool {
        if !self.mesh.is_watertight() || !self.bounds.contains(&Point3::from(*point)) {
            return false;
        }
        // A ray that passes an edge too closely cannot be counted; the next one goes another way.
        let directions = (1..100).map(|i| Vector3::new((f64::from(i) * 1.3).sin(), (f64::from(i) * 2.1).cos(), 0.37));
        directions
            .into_iter()
            .find_map(|direction| self.crossings(self.root, point, &direction))
            .is_some_and(|count| count % 2 == 1)
    }

    /// How many triangles below `node` a ray crosses; `None` when it passes too close to an edge to tell.
    fn crossings(&self, node: Child, point: &Vector3<f64>, direction: &Vector3<f64>) -> Option<usize> {
        if let Some(triangle) = node.triangle() {
            return crossing(self.mesh.triangle(triangle), point, direction).map(usize::from);
        }
        let inverse = direction.map(|component| 1.0 / component);
        self.below(node).into_iter().try_fold(0, |sum, (bounds, child)| {
            let (enter, _) = passage(&bounds, 0.0, point, &inverse);
            Some(sum + if enter.is_finite() { self.crossings(child, point, direction)? } else { 0 })
        })
    }
}

/// Whether a ray crosses a triangle (Möller & Trumbore 1997); `None` when it passes within 1e-9 of its sides.
fn crossing([a, b, c]: [Vector3<f64>; 3], point: &Vector3<f64>, direction: &Vector3<f64>) -> Option<bool> {
    const TOO_CLOSE: f64 = 1e-9;
    let (ab, ac, start) = (b - a, c - a, point - a);
    let normal = direction.cross(&ac);
    let determinant = ab.dot(&normal);
    if determinant.abs() <= TOO_CLOSE * ab.norm() * ac.norm() * direction.norm() {
        return None;
    }
    let lateral = start.cross(&ab);
    let u = start.dot(&normal) / determinant;
    let v = direction.dot(&lateral) / determinant;
    let inside = u.min(v).min(1.0 - u - v);
    let ahead = ac.dot(&lateral) / determinant > 0.0;
    if inside.abs() > TOO_CLOSE { Some(inside > 0.0 && ahead) } else { (!ahead).then_some(false) }
}

/// The lesser of two numbers: one instruction, unlike `f64::min`, which looks for NaN. Where the first is none (a flight along a side of a box), the second stands.
#[inline]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers, likewise.
#[inline]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// When a point that sets off from `point` with velocity 1 / `inverse` enters and leaves a box widened by `margin`; entering
/// never, at infinity, when it misses it.
#[inline]
fn passage(bounds: &Aabb<f64, 3>, margin: f64, point: &Vector3<f64>, inverse: &Vector3<f64>) -> (f64, f64) {
    let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let low = (bounds.min[axis] - margin - point[axis]) * inverse[axis];
        let high = (bounds.max[axis] + margin - point[axis]) * inverse[axis];
        enter = greater(lesser(low, high), enter);
        leave = lesser(greater(low, high), leave);
    }
    if enter <= leave { (enter, leave) } else { (f64::INFINITY, leave) }
}

/// The state of one search for a first contact.
struct Search<'a> {
    index: &'a Index,
    sweep: &'a Sweep,
    /// One over the velocity, component by component.
    inverse: Vector3<f64>,
    /// Magnitude of the velocity.
    speed: f64,
    /// The radius and what rounding may hide, m.
    margin: f64,
    /// The first contact so far, or the end of the search, s.
    time: f64,
    element: Option<u32>,
    /// Where the centre is at the first contact so far.
    end: Option<Vector3<f64>>,
}

impl<'a> Search<'a> {
    #[inline]
    fn new(index: &'a Index, sweep: &'a Sweep, until: f64) -> Self {
        let margin = sweep.radius + BOX_SLACK * (sweep.radius + sweep.position.amax());
        let inverse = sweep.velocity.map(|component| 1.0 / component);
        let speed = sweep.velocity.norm();
        Self { index, sweep, inverse, speed, margin, time: until, element: None, end: None }
    }

    #[inline]
    fn passage(&self, bounds: &Aabb<f64, 3>) -> (f64, f64) {
        passage(bounds, self.margin, &self.sweep.position, &self.inverse)
    }

    /// Before this interval the sphere does not touch the box; infinity when it does not up to the first contact so far.
    ///
    /// When the centre enters the widened box, the sphere may still be away from a corner or a side of the box itself, and
    /// comes nearer by no more than it moves.
    #[inline]
    fn earliest(&self, bounds: &Aabb<f64, 3>) -> f64 {
        let (enter, leave) = self.passage(bounds);
        if enter == f64::INFINITY || self.sweep.time(enter) > self.time {
            return f64::INFINITY;
        }
        let away = from_box(bounds, &(self.sweep.position + self.sweep.velocity * enter)).norm_squared();
        if away <= self.margin * self.margin {
            return enter;
        }
        let earliest = enter + (away.sqrt() - self.margin) / self.speed;
        if earliest <= leave { earliest } else { f64::INFINITY }
    }

    /// Whether the sphere cannot touch the box up to the first contact so far.
    ///
    /// Then the plane through the point of the box that is nearest to the end of the path, at right angles to what lies between
    /// them, has the box on one side and the whole path on the other, more than a radius away.
    #[inline]
    fn is_beyond(&self, bounds: &Aabb<f64, 3>) -> bool {
        self.end.is_some_and(|end| {
            let away = from_box(bounds, &end);
            away.norm_squared() > self.margin * self.margin && away.dot(&self.sweep.velocity) <= 0.0
        })
    }

    /// Tries everything below `node` that the sphere can touch before the first contact so far, what may come first first.
    fn visit(&mut self, node: Child) {
        if let Some(triangle) = node.triangle() {
            return self.try_triangle(triangle);
        }
        let below = self.index.below(node);
        below.iter().for_each(|&(_, child)| self.index.fetch(child));
        let [left, right] = below.map(|(bounds, child)| (self.earliest(&bounds), child, bounds));
        let children = if right.0 < left.0 { [right, left] } else { [left, right] };
        for (earliest, child, bounds) in children {
            let in_time = earliest.is_finite() && self.sweep.time(earliest) <= self.time;
            if in_time && !self.is_beyond(&bounds) {
                self.visit(child);
            }
        }
    }

    #[inline]
    fn try_triangle(&mut self, triangle: usize) {
        if let Some(interval) = self.index.mesh.contact(triangle, self.sweep) {
            let time = self.sweep.time(interval);
            let number = triangle as u32;
            if time < self.time || time == self.time && self.element.is_none_or(|best| number < best) {
                self.time = time;
                self.element = Some(number);
                self.end = Some(self.sweep.position + self.sweep.velocity * interval);
            }
        }
    }
}

/// Vector from the nearest point of a box to `point`; zero inside.
#[inline]
fn from_box(bounds: &Aabb<f64, 3>, point: &Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| point[axis] - greater(lesser(point[axis], bounds.max[axis]), bounds.min[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use impinge_events::Flight;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// A rough sheet of side 2 with a step in it, and a few loose triangles above.
    fn landscape(random: &mut Pcg64Mcg) -> Mesh {
        const N: u32 = 24;
        let mut vertices = Vec::new();
        for i in 0..=N {
            for j in 0..=N {
                let height = if i > N / 2 { 0.3 } else { random.random_range(0.0..0.05) };
                vertices.push(
                    Vector3::new(f64::from(i), f64::from(j), 0.0) * (2.0 / f64::from(N))
                        + Vector3::new(-1.0, -1.0, height),
                );
            }
        }
        let at = |i: u32, j: u32| i * (N + 1) + j;
        let cells = (0..N).flat_map(|i| (0..N).map(move |j| (i, j)));
        let mut triangles: Vec<_> = cells
            .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
            .collect();
        for _ in 0..20 {
            let first = vertices.len() as u32;
            let centre = anywhere(random, 1.0);
            vertices.extend([0; 3].map(|_| centre + anywhere(random, 0.2)));
            triangles.push([first, first + 1, first + 2]);
        }
        Mesh::new(vertices, triangles).expect("no triangle is degenerate")
    }

    fn anywhere(random: &mut Pcg64Mcg, range: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| random.random_range(-range..range))
    }

    fn first_of_all(mesh: &Mesh, sweep: &Sweep) -> Option<(f64, u32)> {
        let contacts = (0..mesh.len()).filter_map(|i| Some((sweep.time(mesh.contact(i, sweep)?), i as u32)));
        contacts.reduce(|a, b| if b.0 < a.0 { b } else { a })
    }

    #[test]
    fn the_index_finds_what_trying_all_triangles_finds() {
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let index = Index::new(landscape(&mut random));
        let mut hits = 0;
        for trial in 0..4000 {
            let position = anywhere(&mut random, if trial % 2 == 0 { 1.2 } else { 5.0 });
            let mut velocity = (anywhere(&mut random, 1.0) - position) * random.random_range(0.1..2.0);
            match trial % 5 {
                0 => velocity.z = 0.0,
                1 => velocity = Vector3::new(0.0, 0.0, velocity.z),
                2 => velocity *= 1e-200,
                _ => {}
            }
            let radius = 10f64.powf(random.random_range(-3.0..0.0));
            let flight = Flight { position, time: 1.0, velocity, radius };
            let sweep = Sweep::new(&flight, velocity.amax());
            let expected = first_of_all(index.mesh(), &sweep);
            hits += usize::from(expected.is_some());
            for until in [1.0, 1.1, 2.0, 1e3, f64::INFINITY] {
                match (index.first_contact(&sweep, until), expected) {
                    (Outlook::Hit { time, element }, expected) => assert_eq!(Some((time, element)), expected),
                    (Outlook::ClearUntil(clear), Some((time, _))) => {
                        assert!(until <= clear && clear < time, "{flight:?}");
                    }
                    (Outlook::ClearUntil(clear), None) => assert!(clear >= until),
                }
            }
        }
        assert!(hits > 1000, "{hits} hits");
    }

    #[test]
    fn a_flight_that_misses_the_box_is_clear_for_ever() {
        let index = Index::new(landscape(&mut Pcg64Mcg::seed_from_u64(7)));
        let away = Flight { position: Vector3::new(0.0, 0.0, 9.0), time: 0.0, velocity: Vector3::x(), radius: 0.1 };
        let towards = Flight { velocity: -Vector3::z(), ..away };
        let outlook = |flight: &Flight| index.first_contact(&Sweep::new(flight, 1.0), 0.5);
        assert_eq!(outlook(&away), Outlook::ClearUntil(f64::INFINITY));
        assert!(matches!(outlook(&towards), Outlook::ClearUntil(time) if time > 7.0 && time < 9.0));
    }

    #[test]
    fn the_nearest_triangle_is_the_nearest_of_all() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let index = Index::new(landscape(&mut random));
        for _ in 0..300 {
            let point = anywhere(&mut random, 2.0);
            let distance = |i: usize| (index.mesh().nearest(i, &point) - point).norm();
            let all = (0..index.mesh().len()).map(distance).fold(f64::INFINITY, f64::min);
            assert_eq!(index.nearest(&point, f64::INFINITY).map(|(_, distance)| distance), Some(all));
            assert_eq!(index.nearest(&point, 0.1).is_some(), all < 0.1);
        }
    }
}
