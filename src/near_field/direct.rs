//! All pairs.

use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator as _, IntoParallelRefMutIterator as _, ParallelIterator as _};

use super::block::{Block, beyond};
use super::tournament::tournament;
use crate::law::NearField;

/// Grains in a block, at most. Two of them, with their forces, stay in the fastest cache (14 kB); a meeting of two (some
/// 10 µs) is long against handing it to a thread.
const BLOCK: usize = 128;

/// The direct sum: each pair once, in vectors, its force added to one grain and subtracted from the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Direct {
    blocks: Vec<Block>,
}

impl Direct {
    /// Forces of all pairs, N.
    pub(super) fn forces(
        &mut self,
        law: &NearField,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
        out: &mut [Vector3<f64>],
    ) {
        self.fill(positions, strengths);
        self.blocks.par_iter_mut().for_each(|block| block.meet_itself(law, block.all()));
        tournament(&mut self.blocks, |one, other| one.meet(law, one.all(), other, other.all()));
        for (block, out) in self.blocks.iter().zip(out.chunks_mut(BLOCK)) {
            out.iter_mut().enumerate().for_each(|(index, out)| *out = block.force(index));
        }
    }

    /// Potential energy of all pairs, J.
    pub(super) fn potential_energy(
        &mut self,
        law: &NearField,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
    ) -> f64 {
        self.fill(positions, strengths);
        let blocks = &self.blocks;
        let of_block = |index: usize| {
            let block = &blocks[index];
            let others = &blocks[index + 1..];
            let with_others = others.iter().map(|other| block.energy_with(law, block.all(), other, other.all()));
            block.energy_within(law, block.all()) + with_others.sum::<f64>()
        };
        // Collected in order, so that the sum is the same with any number of threads.
        let parts: Vec<f64> = (0..blocks.len()).into_par_iter().map(of_block).collect();
        parts.into_iter().sum()
    }

    fn fill(&mut self, positions: &[Vector3<f64>], strengths: Option<&[f64]>) {
        let aside = aside(positions);
        self.blocks.resize_with(positions.len().div_ceil(BLOCK), Block::default);
        for (block, start) in self.blocks.iter_mut().zip((0..).step_by(BLOCK)) {
            let count = BLOCK.min(positions.len() - start);
            block.fill(count, aside, |index| (positions[start + index], strength(strengths, start + index)));
        }
    }
}

/// The strength of a grain: 1 where none are given.
pub(super) fn strength(strengths: Option<&[f64]>, index: usize) -> f64 {
    strengths.map_or(1.0, |strengths| strengths[index])
}

/// A place where no grain is (m).
pub(super) fn aside(positions: &[Vector3<f64>]) -> Vector3<f64> {
    let furthest = positions.iter().map(|position| position.x).fold(0.0, f64::max);
    positions.first().map_or_else(Vector3::zeros, |first| Vector3::new(beyond(furthest), first.y, first.z))
}
