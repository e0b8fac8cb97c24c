//! A part of the tree that belongs to one task at a time.

use nalgebra::Vector3;

use super::Setup;
use super::cell::{Cell, Grain, Source, divide};
use super::expansion::{Leaf, add_forces, add_moments, energy, lift_moments, lower_potential};
use crate::near_field::block::{Block, LANES, Lanes};

/// Cells of other branches that a branch looks at to learn what its grains feel at least: all down to this depth below their roots.
const OUTLINE_DEPTH: usize = 3;

/// Cells with their grains and expansions.
#[derive(Clone, Debug)]
pub(super) struct Branch {
    /// The grains, in the order of the cells.
    pub(super) grains: Block,
    /// Their numbers outside.
    pub(super) indices: Vec<u32>,
    /// The cells; the first holds all grains.
    pub(super) cells: Vec<Cell>,
    /// Moments of all cells, one after the other.
    moments: Vec<f64>,
    /// Potentials about the centres of all cells, from all sources that are far from them.
    potentials: Vec<f64>,
    /// Coefficients of one expansion.
    coefficients: usize,
    /// Energy of pairs that were summed directly, J.
    pub(super) energy: f64,
}

impl Branch {
    pub(super) fn new(setup: &Setup<'_>, grains: &mut [Grain], aside: Vector3<f64>) -> Self {
        let cells = divide(grains, setup.highest_order());
        let mut block = Block::default();
        block.fill(grains.len(), aside, |index| (grains[index].place, grains[index].strength));
        let coefficients = setup.indices.len();
        let mut branch = Self {
            grains: block,
            indices: grains.iter().map(|grain| grain.index).collect(),
            moments: vec![0.0; cells.len() * coefficients],
            potentials: vec![0.0; cells.len() * coefficients],
            cells,
            coefficients,
            energy: 0.0,
        };
        branch.gather_moments(setup);
        branch
    }

    /// Moments of leaves from their grains, those of other cells from the cells they are divided into.
    fn gather_moments(&mut self, setup: &Setup<'_>) {
        let mut scratch = vec![[0.0; LANES]; self.coefficients];
        let mut shifted = Vec::new();
        // Cells come before those they are divided into.
        for index in (0..self.cells.len()).rev() {
            let (own, below) = self.moments[index * self.coefficients..].split_at_mut(self.coefficients);
            let cell = &self.cells[index];
            let Some(children) = cell.children else {
                add_moments(setup.indices, leaf(&self.grains, cell), &mut scratch, own);
                continue;
            };
            for child in children {
                let start = (child - index - 1) * self.coefficients;
                let by = (self.cells[child].centre - cell.centre).into();
                lift_moments(setup.indices, &below[start..start + self.coefficients], by, &mut shifted, own);
            }
        }
    }

    /// The cells that others look at.
    pub(super) fn outline(&self) -> Vec<Source> {
        self.below(0, OUTLINE_DEPTH).map(|index| self.cells[index].as_source()).collect()
    }

    /// The cells `depth` below one, and leaves that are less deep.
    fn below(&self, index: usize, depth: usize) -> impl Iterator<Item = usize> {
        let mut cells = vec![index];
        for _ in 0..depth {
            let children = |index: usize| self.cells[index].children.map_or_else(|| vec![index], |it| it.to_vec());
            cells = cells.into_iter().flat_map(children).collect();
        }
        cells.into_iter()
    }

    /// Works out what the grains of each cell feel at least, from the cells of this branch and the outlines of the others.
    pub(super) fn find_mean_contributions(&mut self, setup: &Setup<'_>, own: usize, outlines: &[Vec<Source>]) {
        let total: f64 = outlines.iter().flatten().map(|source| source.weight).sum();
        let leaves = self.cells.iter().enumerate().filter(|(_, cell)| cell.children.is_none());
        let leaves: Vec<(usize, Source)> = leaves.map(|(index, cell)| (index, cell.as_source())).collect();
        for index in (0..self.cells.len()).rev() {
            let cell = &self.cells[index];
            self.cells[index].mean_contribution = match cell.children {
                Some(children) => {
                    children.map(|child| self.cells[child].mean_contribution).into_iter().fold(f64::INFINITY, f64::min)
                }
                None => {
                    let near = leaves.iter().filter(|(leaf, _)| *leaf != index).map(|(_, source)| source);
                    let others = outlines.iter().enumerate().filter(|(branch, _)| *branch != own);
                    let far = others.flat_map(|(_, outline)| outline);
                    near.chain(far).map(|source| cell.least_contribution(setup.law, source)).sum::<f64>() / total
                }
            };
        }
    }

    /// Takes all forces and potentials back.
    pub(super) fn clear(&mut self) {
        self.grains.clear_forces();
        self.potentials.fill(0.0);
    }

    /// Moments of a cell.
    pub(super) fn moments(&self, cell: usize) -> &[f64] {
        &self.moments[cell * self.coefficients..][..self.coefficients]
    }

    /// Potential about the centre of a cell.
    pub(super) fn potential_mut(&mut self, cell: usize) -> &mut [f64] {
        &mut self.potentials[cell * self.coefficients..][..self.coefficients]
    }

    /// Hands potentials on from cells to those they are divided into, and does with each leaf and its potential what `visit` says.
    fn hand_down(&mut self, setup: &Setup<'_>, mut visit: impl FnMut(&mut Block, &Cell, &[f64])) {
        let mut shifted = Vec::new();
        for (index, cell) in self.cells.iter().enumerate() {
            let (own, below) = self.potentials[index * self.coefficients..].split_at_mut(self.coefficients);
            let Some(children) = cell.children else {
                visit(&mut self.grains, cell, own);
                continue;
            };
            for child in children {
                let start = (child - index - 1) * self.coefficients;
                let by = (self.cells[child].centre - cell.centre).into();
                let child = &mut below[start..start + self.coefficients];
                lower_potential(setup.indices, own, by, &mut shifted, child);
            }
        }
    }

    /// Adds the forces of the expansions.
    pub(super) fn add_far_forces(&mut self, setup: &Setup<'_>) {
        let mut scratch = vec![[0.0; LANES]; self.coefficients];
        self.hand_down(setup, |grains, cell, potential| {
            let chunks = cell.chunks.clone();
            let Block { places, strengths, forces, .. } = grains;
            let leaf = Leaf {
                places: places.each_ref().map(|axis| &axis[chunks.clone()]),
                strengths: &strengths[chunks.clone()],
                centre: cell.centre.into(),
            };
            let forces = forces.each_mut().map(|axis| &mut axis[chunks.clone()]);
            add_forces(setup.indices, leaf, &mut scratch, potential, forces);
        });
    }

    /// Adds the energy of the expansions, which count each pair twice.
    pub(super) fn add_far_energy(&mut self, setup: &Setup<'_>) {
        let mut scratch: Vec<Lanes> = vec![[0.0; LANES]; self.coefficients];
        let mut twice = 0.0;
        self.hand_down(setup, |grains, cell, potential| {
            twice += energy(setup.indices, leaf(grains, cell), &mut scratch, potential);
        });
        self.energy += 0.5 * twice;
    }
}

/// The grains of a leaf.
fn leaf<'a>(grains: &'a Block, cell: &Cell) -> Leaf<'a> {
    let chunks = cell.chunks.clone();
    Leaf {
        places: grains.places.each_ref().map(|axis| &axis[chunks.clone()]),
        strengths: &grains.strengths[chunks.clone()],
        centre: cell.centre.into(),
    }
}
