//! Where in a box is there room for one more grain? The voxel method of random sequential addition.
//!
//! Plain random sequential addition draws a place in the box until one is free; close to saturation that takes millions of
//! draws for one grain, and beyond it never ends. Here the box is cut into voxels, and a voxel that is wholly covered (no
//! grain could have its centre in it) is never drawn from again. What is left holds every free place, and places are
//! drawn from it evenly, so that the accepted ones are spread exactly as in the plain method; and when nothing is left, the
//! box is saturated, which is a proof and not a guess (Wang 1994; Zhang & Torquato 2013).
//!
//! A voxel is halved when a draw from it fails, so that the voxels are small only where it matters. Grains come in the
//! order of falling radius. A voxel that is covered for the present radius may open for a smaller one: it sleeps
//! until the turn of the first grain that could fit.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use super::cells::Cells;
use super::context::Bounds;

/// Side of a voxel, over the smallest radius, below which it is given up although it may not be wholly covered. A hole of
/// that size is hit by less than one in 1e18 of the draws that a grain gets in a plain box; without this the search would
/// never end where grains of a lattice leave a hole of size 0.
const FINEST_VOXEL: f64 = 1e-9;

/// Side of a voxel over the largest coordinate of its box, below which its corners are no longer told apart.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// An axis is halved when the voxel is longer along it than this part of its longest side, so that voxels become cubes.
const ELONGATION: f64 = 0.7;

/// Voxels of one size.
#[derive(Debug)]
struct Level {
    side: Vector3<f64>,
    /// Volume over that of the box; a power of two, so that sums of volumes are exact.
    volume: f64,
    /// Lower corners of those that may hold a free place.
    corners: Vec<Vector3<f64>>,
}

/// The part of a box that may still have room.
#[derive(Debug)]
pub(super) struct Voids {
    bounds: Bounds,
    /// Whether whole grains must lie inside the box; otherwise the centres.
    walls: Option<Bounds>,
    /// Falling radii of the grains that are to be placed, m.
    radii: Vec<f64>,
    levels: Vec<Level>,
    /// Covered voxels (level and corner) by the turn at which they may open.
    asleep: BTreeMap<usize, Vec<(usize, Vector3<f64>)>>,
    /// Voxels whose longest side is at most this are given up, m.
    finest: f64,
    /// Grains near the voxel at hand: where from its centre (m), and radius (m).
    near: Vec<(Vector3<f64>, f64)>,
}

impl Voids {
    /// Room for centres inside `bounds`, and for whole grains inside `walls` if there are any. `radii` must fall.
    pub(super) fn new(bounds: Bounds, walls: Option<Bounds>, radii: Vec<f64>) -> Self {
        let side = bounds.upper - bounds.lower;
        let smallest = radii.last().copied().unwrap_or(0.0);
        let finest = (FINEST_VOXEL * smallest).max(ROUNDING * bounds.lower.amax().max(bounds.upper.amax()));
        let levels = vec![Level { side, volume: 1.0, corners: vec![bounds.lower] }];
        Self { bounds, walls, radii, levels, asleep: BTreeMap::new(), finest, near: Vec::new() }
    }

    /// A free place for grain number `turn` (they must come in order) among those in `cells`, or `None` if there is none.
    pub(super) fn find(&mut self, turn: usize, cells: &Cells, rng: &mut impl Rng) -> Option<Vector3<f64>> {
        self.wake(turn, cells);
        let radius = self.radii[turn];
        loop {
            let (level, index) = self.draw_voxel(rng)?;
            let corner = self.levels[level].corners[index];
            let side = self.levels[level].side;
            // The last bit of the sum may lie beyond the box.
            let position =
                Vector3::from_fn(|i, _| (corner[i] + side[i] * rng.random::<f64>()).min(self.bounds.upper[i]));
            if self.is_inside(position, radius) && cells.is_free(position, radius) {
                return Some(position);
            }
            self.levels[level].corners.swap_remove(index);
            self.halve(level, corner, turn, cells);
        }
    }

    /// A voxel, drawn by volume.
    fn draw_voxel(&self, rng: &mut impl Rng) -> Option<(usize, usize)> {
        let volume = |level: &Level| level.volume * level.corners.len() as f64;
        let mut rest = rng.random::<f64>() * self.levels.iter().map(volume).sum::<f64>();
        let mut chosen = None;
        for (number, level) in self.levels.iter().enumerate().filter(|(_, level)| !level.corners.is_empty()) {
            chosen = Some(number);
            rest -= volume(level);
            if rest < 0.0 {
                break;
            }
        }
        chosen.map(|level| (level, rng.random_range(0..self.levels[level].corners.len())))
    }

    fn is_inside(&self, position: Vector3<f64>, radius: f64) -> bool {
        self.walls.is_none_or(|walls| {
            (0..3).all(|i| walls.lower[i] + radius <= position[i] && position[i] <= walls.upper[i] - radius)
        })
    }

    fn halve(&mut self, level: usize, corner: Vector3<f64>, turn: usize, cells: &Cells) {
        let side = self.levels[level].side;
        if side.max() <= self.finest {
            return;
        }
        let is_cut = |axis: usize| side[axis] > ELONGATION * side.max();
        let half = Vector3::from_fn(|axis, _| if is_cut(axis) { 0.5 * side[axis] } else { side[axis] });
        if level + 1 == self.levels.len() {
            let parts = (0..3).filter(|&axis| is_cut(axis)).count() as i32;
            let volume = self.levels[level].volume * 0.5f64.powi(parts);
            self.levels.push(Level { side: half, volume, corners: Vec::new() });
        }
        let middle = corner + 0.5 * side;
        self.gather(middle, 0.5 * half, turn, cells);
        for part in 0..8 {
            let is_upper = |axis: usize| part >> axis & 1 == 1;
            if (0..3).all(|axis| is_cut(axis) || !is_upper(axis)) {
                let shift = Vector3::from_fn(|axis, _| if is_upper(axis) { half[axis] } else { 0.0 });
                self.file(level + 1, corner + shift, middle, turn);
            }
        }
    }

    /// Collects the grains that could cover a voxel whose centre is at most `shift` away from `middle` along each axis.
    fn gather(&mut self, middle: Vector3<f64>, shift: Vector3<f64>, turn: usize, cells: &Cells) {
        let reach = self.radii[turn] + shift.norm();
        self.near.clear();
        cells.any_near(middle, reach, |item, offset| {
            if offset.norm_squared() < (item.radius + reach).powi(2) {
                self.near.push((offset, item.radius));
            }
            false
        });
    }

    /// Puts a voxel where it belongs: among those to draw from, among those asleep, or nowhere.
    ///
    /// The grains near `middle`, no matter whether that is its own centre or a neighbour's, must have been gathered.
    fn file(&mut self, level: usize, corner: Vector3<f64>, middle: Vector3<f64>, turn: usize) {
        match self.covering_radius(level, corner, middle, turn) {
            None => self.levels[level].corners.push(corner),
            Some(covering) => {
                let opens = self.radii.partition_point(|&radius| radius > covering);
                if opens < self.radii.len() {
                    self.asleep.entry(opens).or_default().push((level, corner));
                }
            }
        }
    }

    /// Where the voxel is wholly covered for the present radius: larger grains than this (m) find no place in it.
    fn covering_radius(&self, level: usize, corner: Vector3<f64>, middle: Vector3<f64>, turn: usize) -> Option<f64> {
        let side = self.levels[level].side;
        let (present, smallest) = (self.radii[turn], self.radii[self.radii.len() - 1]);
        let mut covering = present;
        if let Some(walls) = self.walls {
            covering = covering.min((corner + side - walls.lower).inf(&(walls.upper - corner)).min());
        }
        let from_centre = middle - (corner + 0.5 * side);
        for (offset, radius) in &self.near {
            // A grain covers the voxel if it forbids the corner that is farthest from it.
            let farthest = ((offset + from_centre).abs() + 0.5 * side).norm_squared();
            if farthest < (covering + radius).powi(2) {
                covering = farthest.sqrt() - radius;
                if covering < smallest {
                    break; // no grain to come will open it
                }
            }
        }
        (covering < present).then_some(covering)
    }

    /// Takes up the voxels that may have opened by now. They are looked at again: grains have been added since.
    fn wake(&mut self, turn: usize, cells: &Cells) {
        while let Some(entry) = self.asleep.first_entry().filter(|entry| *entry.key() <= turn) {
            for (level, corner) in entry.remove() {
                let middle = corner + 0.5 * self.levels[level].side;
                self.gather(middle, Vector3::zeros(), turn, cells);
                self.file(level, corner, middle, turn);
            }
        }
    }
}
