//! Which triangles can a grain touch soon? A tree of boxes over a mesh.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use impinge_events::contact_time::Sweep;
use impinge_events::{Mesh, Outlook, Table, prefetch, table};
use nalgebra::Vector3;
use wide::f64x4;

/// By how much (relative to coordinates and radii) boxes are widened, so that rounding never hides a triangle.
///
/// Where a flight enters a box is known to a few units in the last place (2^-53) of the coordinates. Consequence: now and
/// then a triangle is tried in vain.
const BOX_SLACK: f64 = 1.0 / (1u64 << 46) as f64;

/// A mesh with the tree over it.
#[derive(Clone, Debug)]
pub(super) struct Index {
    mesh: Mesh,
    /// The box around all; the other three are not there.
    bounds: Boxes,
    /// What lies below the root first.
    nodes: Table<Node>,
    root: Child,
}

/// So many boxes are looked at at once.
const LANES: usize = 4;

/// A branch of the tree: its boxes, of short numbers, and its children fill two lines of the cache. To wait for memory is most of what a search costs, so the fewer
/// nodes follow each other, the better.
#[derive(Clone, Copy, Debug)]
#[repr(align(128))]
struct Node {
    boxes: Boxes,
    children: [Child; LANES],
}

const _: () = assert!(size_of::<Node>() == 128);

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

/// Boxes, each of which holds another one in numbers twice as long. Those that are not there lie at infinity.
#[derive(Clone, Copy, Debug)]
struct Boxes {
    min: [[f32; LANES]; 3],
    max: [[f32; LANES]; 3],
}

impl Boxes {
    fn around<'a>(boxes: impl IntoIterator<Item = &'a Aabb<f64, 3>>) -> Self {
        let nowhere = [[f32::INFINITY; LANES]; 3];
        let mut around = Self { min: nowhere, max: nowhere };
        for (lane, bounds) in boxes.into_iter().enumerate() {
            for axis in 0..3 {
                let (low, high) = (bounds.min[axis], bounds.max[axis]);
                let (below, above) = (low as f32, high as f32);
                around.min[axis][lane] = if f64::from(below) > low { below.next_down() } else { below };
                around.max[axis][lane] = if f64::from(above) < high { above.next_up() } else { above };
            }
        }
        around
    }

    #[inline]
    fn sides(&self, axis: usize) -> [f64x4; 2] {
        [&self.min, &self.max].map(|sides| f64x4::from(sides[axis].map(f64::from)))
    }

    /// Vectors from the nearest points of the boxes to `points`; zero inside.
    #[inline]
    fn away(&self, points: [f64x4; 3]) -> [f64x4; 3] {
        std::array::from_fn(|axis| {
            let [min, max] = self.sides(axis);
            points[axis] - points[axis].fast_min(max).fast_max(min)
        })
    }

    /// The squares of the distances from `point`.
    #[inline]
    fn distances_squared(&self, point: &Vector3<f64>) -> f64x4 {
        let away = self.away(four(point));
        dot(away, away)
    }
}

/// The same point for all boxes.
#[inline]
fn four(point: &Vector3<f64>) -> [f64x4; 3] {
    [0, 1, 2].map(|axis| f64x4::splat(point[axis]))
}

#[inline]
fn dot(a: [f64x4; 3], b: [f64x4; 3]) -> f64x4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The two below a node of a binary tree, and the boxes around them.
fn children(node: &BvhNode<f64, 3>) -> Option<[(usize, &Aabb<f64, 3>); 2]> {
    match node {
        BvhNode::Leaf { .. } => None,
        BvhNode::Node { child_l_index, child_l_aabb, child_r_index, child_r_aabb, .. } => {
            Some([(*child_l_index, child_l_aabb), (*child_r_index, child_r_aabb)])
        }
    }
}

/// Adds the nodes of a binary tree from number `at` on to `nodes`, each before those below it. In each the largest box gives way to the two in it, as long as there
/// is room.
fn widen(tree: &[BvhNode<f64, 3>], at: usize, nodes: &mut Vec<Node>) -> Child {
    if let BvhNode::Leaf { shape_index, .. } = &tree[at] {
        return Child(Child::TRIANGLE | *shape_index as u32);
    }
    let mut below: Vec<_> = children(&tree[at]).into_iter().flatten().collect();
    while below.len() < LANES {
        let area = |place: &usize| below[*place].1.surface_area();
        let branches = (0..below.len()).filter(|&place| children(&tree[below[place].0]).is_some());
        let Some(largest) = branches.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let (branch, _) = below.swap_remove(largest);
        below.extend(children(&tree[branch]).into_iter().flatten());
    }
    let (number, boxes) = (nodes.len(), Boxes::around(below.iter().map(|&(_, bounds)| bounds)));
    nodes.push(Node { boxes, children: [Child(0); LANES] });
    for (lane, (child, _)) in below.into_iter().enumerate() {
        nodes[number].children[lane] = widen(tree, child, nodes);
    }
    Child(number as u32)
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
        let mut nodes = Vec::new();
        let root = widen(&Bvh::build(&mut boxes).nodes, 0, &mut nodes);
        let bounds = Boxes::around([&boxes.iter().fold(Aabb::empty(), |bounds, one| bounds.join(&one.bounds))]);
        Self { mesh, bounds, nodes: table(nodes), root }
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
        let [enter, leave] = search.path.passage(&self.bounds).map(|lanes| lanes.to_array()[0]);
        if enter > leave {
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
        let Node { boxes, children } = &self.nodes[node.0 as usize];
        let distances = boxes.distances_squared(point).sqrt().to_array();
        let mut order: [usize; LANES] = std::array::from_fn(|lane| lane);
        order.sort_unstable_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        for lane in order {
            // None of those that are not there.
            if distances[lane] <= best.1 && distances[lane] < f64::INFINITY {
                self.nearest_below(children[lane], point, best);
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
        let Node { boxes, children } = &self.nodes[node.0 as usize];
        let near = boxes.distances_squared(point).simd_lt(f64x4::splat(distance * distance)).to_bitmask();
        for lane in lanes(near) {
            self.within_below(children[lane], point, distance, visit);
        }
    }

    /// Whether `point` lies inside a watertight mesh: a ray from it comes out through an odd number of triangles.
    pub(super) fn encloses(&self, point: &Vector3<f64>) -> bool {
        if !self.mesh.is_watertight() || self.bounds.distances_squared(point).to_array()[0] > 0.0 {
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
        let Node { boxes, children } = &self.nodes[node.0 as usize];
        let [enter, leave] = Path::new(point, direction, 0.0).passage(boxes);
        lanes(enter.simd_le(leave).to_bitmask())
            .try_fold(0, |sum, lane| Some(sum + self.crossings(children[lane], point, direction)?))
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

/// The numbers of the bits that are set.
#[inline]
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

/// The path of a point, and how far boxes are widened for it.
struct Path {
    start: Vector3<f64>,
    /// One over the velocity, component by component; large where that is 0.
    inverse: Vector3<f64>,
    margin: f64,
}

impl Path {
    #[inline]
    fn new(start: &Vector3<f64>, velocity: &Vector3<f64>, margin: f64) -> Self {
        // Not infinite, or a path along a side of a box would be neither inside nor outside.
        let inverse = velocity.map(|component| (1.0 / component).clamp(-f64::MAX, f64::MAX));
        Self { start: *start, inverse, margin }
    }

    /// When the point enters and leaves each of the widened boxes; it misses those that it enters after it leaves them.
    #[inline]
    fn passage(&self, boxes: &Boxes) -> [f64x4; 2] {
        let (mut enter, mut leave) = (f64x4::ZERO, f64x4::splat(f64::MAX));
        for axis in 0..3 {
            let [min, max] = boxes.sides(axis);
            let low = (min - (self.start[axis] + self.margin)) * self.inverse[axis];
            let high = (max - (self.start[axis] - self.margin)) * self.inverse[axis];
            enter = enter.fast_max(low.fast_min(high));
            leave = leave.fast_min(low.fast_max(high));
        }
        [enter, leave]
    }
}

/// The state of one search for a first contact.
struct Search<'a> {
    index: &'a Index,
    sweep: &'a Sweep,
    /// The path of the centre. Boxes are widened by the radius and what rounding may hide.
    path: Path,
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
        let path = Path::new(&sweep.position, &sweep.velocity, margin);
        Self { index, sweep, path, time: until, element: None, end: None }
    }

    /// Before these intervals the sphere does not touch the boxes, which its centre enters then, after they have been widened.
    ///
    /// When the centre enters the widened box, the sphere may still be away from a corner or a side of the box itself, and
    /// comes nearer by no more than it moves.
    #[inline]
    fn earliest(&self, boxes: &Boxes, enter: f64x4) -> f64x4 {
        let Sweep { position, velocity, .. } = self.sweep;
        let away = boxes.away(std::array::from_fn(|axis| position[axis] + velocity[axis] * enter));
        let (away, margin) = (dot(away, away), self.path.margin);
        let still = (away.sqrt() - margin) / velocity.norm();
        away.simd_gt(f64x4::splat(margin * margin)).bitselect(enter + still, enter)
    }

    /// The bits of the boxes that the sphere cannot touch up to the first contact so far.
    ///
    /// The plane through the point of the box that is nearest to the end of the path, at right angles to what lies between
    /// them, has the box on one side and the whole path on the other, more than a radius away.
    #[inline]
    fn beyond(&self, boxes: &Boxes) -> u32 {
        let Some(end) = self.end else { return 0 };
        let (away, margin) = (boxes.away(four(&end)), self.path.margin);
        let apart = dot(away, away).simd_gt(f64x4::splat(margin * margin));
        (apart & dot(away, four(&self.sweep.velocity)).simd_le(f64x4::ZERO)).to_bitmask()
    }

    /// Tries everything below `node` that the sphere can touch before the first contact so far.
    fn visit(&mut self, mut node: Child) {
        while node.triangle().is_none() {
            let Node { boxes, children } = &self.index.nodes[node.0 as usize];
            children.iter().for_each(|&child| self.index.fetch(child));
            let [enter, leave] = self.path.passage(boxes);
            let passed = enter.simd_le(leave).to_bitmask() & !self.beyond(boxes);
            if !passed.is_power_of_two() {
                return self.visit_each(children, boxes, enter, leave);
            }
            // Most of the way it is one only, and what its root would tell comes too late.
            let lane = passed.trailing_zeros() as usize;
            if self.sweep.time(enter.to_array()[lane % LANES]) > self.time {
                return;
            }
            node = children[lane % LANES];
        }
        node.triangle().into_iter().for_each(|triangle| self.try_triangle(triangle));
    }

    /// Visits several nodes, of which it is known when the centre enters and leaves their boxes; what may come first first.
    fn visit_each(&mut self, children: &[Child; LANES], boxes: &Boxes, enter: f64x4, leave: f64x4) {
        let earliest = self.earliest(boxes, enter);
        let mut left = earliest.simd_le(leave).to_bitmask();
        let earliest = earliest.to_array();
        let earlier = |first: usize, lane: usize| if earliest[lane] < earliest[first] { lane } else { first };
        while let Some(first) = lanes(left).reduce(earlier) {
            if self.sweep.time(earliest[first]) > self.time {
                return;
            }
            if self.beyond(boxes) >> first & 1 == 0 {
                self.visit(children[first]);
            }
            left &= !(1 << first);
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
