//! Grains side by side in memory, and the loops over their pairs.

use std::ops::Range;

use multiversion::multiversion;
use nalgebra::Vector3;

use crate::law::NearField;
use crate::law::near_field::{PotentialFactors, Radial, with_radial};

/// Pairs that are worked on together. The sums of all lanes are kept apart and added in the end, in the same order on every
/// machine, and no product is fused with a sum: the bits do not depend on how wide the machine's vectors are.
pub(super) const LANES: usize = 8;

/// Grains in one chunk of [`LANES`], one coordinate.
pub(super) type Lanes = [f64; LANES];

/// Grains that are next to each other in memory; the last lanes may be empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    /// Number of grains.
    pub(super) count: usize,
    /// Centres, m, by axis.
    pub(super) places: [Vec<Lanes>; 3],
    /// Strengths; 0 in empty lanes.
    pub(super) strengths: Vec<Lanes>,
    /// Forces, N, by axis.
    pub(super) forces: [Vec<Lanes>; 3],
}

impl Block {
    /// Takes in the grains that `grain` tells, by place and strength; forces are zero. `aside` is a place where no grain is.
    pub(super) fn fill(&mut self, count: usize, aside: Vector3<f64>, grain: impl Fn(usize) -> (Vector3<f64>, f64)) {
        self.count = count;
        let chunks = count.div_ceil(LANES);
        for axis in 0..3 {
            self.places[axis].clear();
            self.places[axis].resize(chunks, [aside[axis]; LANES]);
            self.forces[axis].clear();
            self.forces[axis].resize(chunks, [0.0; LANES]);
        }
        self.strengths.clear();
        self.strengths.resize(chunks, [0.0; LANES]);
        for index in 0..count {
            let (place, strength) = grain(index);
            let (chunk, lane) = (index / LANES, index % LANES);
            for axis in 0..3 {
                self.places[axis][chunk][lane] = place[axis];
            }
            self.strengths[chunk][lane] = strength;
        }
    }

    /// The force on a grain, N.
    pub(super) fn force(&self, index: usize) -> Vector3<f64> {
        Vector3::from([0, 1, 2].map(|axis| self.forces[axis][index / LANES][index % LANES]))
    }

    /// Adds the forces of all pairs within a range of chunks.
    pub(super) fn meet_itself(&mut self, law: &NearField, chunks: Range<usize>) {
        let side = self.side(chunks);
        with_radial!(law, radial => forces_within(radial, side));
    }

    /// Adds the forces of all pairs of one grain in `one` and one in `other`: ranges of chunks that do not overlap.
    pub(super) fn meet_within(&mut self, law: &NearField, one: Range<usize>, other: Range<usize>) {
        let (lower, upper) = if one.start < other.start { (one, other) } else { (other, one) };
        let (lower, upper) = self.two_sides(lower, upper);
        with_radial!(law, radial => forces_between(radial, lower, upper));
    }

    /// Adds the forces of all pairs of a grain of this block and one of `other`, in these ranges of chunks.
    pub(super) fn meet(&mut self, law: &NearField, own: Range<usize>, other: &mut Self, others: Range<usize>) {
        let (own, others) = (self.side(own), other.side(others));
        with_radial!(law, radial => forces_between(radial, own, others));
    }

    /// Force on grain `index` of `block` from the grains of this one, and the sum of the magnitudes of what contributes to it, both N.
    /// `itself` says that both are the same block.
    pub(super) fn force_on(&self, law: &NearField, block: &Self, index: usize, itself: bool) -> (Vector3<f64>, f64) {
        let grain = block.grains(block.all()).get(index / LANES, index % LANES);
        let skip = itself.then_some(index);
        with_radial!(law, radial => force_and_magnitude(radial, grain, self.grains(self.all()), skip))
    }

    /// Takes all forces back.
    pub(super) fn clear_forces(&mut self) {
        self.forces.iter_mut().for_each(|axis| axis.fill([0.0; LANES]));
    }

    /// All chunks.
    pub(super) fn all(&self) -> Range<usize> {
        0..self.strengths.len()
    }

    /// Potential energy of all pairs within a range of chunks, J.
    pub(super) fn energy_within(&self, law: &NearField, chunks: Range<usize>) -> f64 {
        let grains = self.grains(chunks);
        0.5 * with_radial!(law, radial => energy_between(radial, law.potential_factors(), grains, grains, true))
    }

    /// Potential energy of all pairs of a grain of this block and one of `other`, J.
    pub(super) fn energy_with(&self, law: &NearField, own: Range<usize>, other: &Self, others: Range<usize>) -> f64 {
        let (own, others) = (self.grains(own), other.grains(others));
        with_radial!(law, radial => energy_between(radial, law.potential_factors(), own, others, false))
    }

    fn grains(&self, chunks: Range<usize>) -> Grains<'_> {
        Grains { places: self.places.each_ref().map(|axis| &axis[chunks.clone()]), strengths: &self.strengths[chunks] }
    }

    fn side(&mut self, chunks: Range<usize>) -> Side<'_> {
        Side {
            grains: Grains {
                places: self.places.each_ref().map(|axis| &axis[chunks.clone()]),
                strengths: &self.strengths[chunks.clone()],
            },
            forces: self.forces.each_mut().map(|axis| &mut axis[chunks.clone()]),
        }
    }

    fn two_sides(&mut self, lower: Range<usize>, upper: Range<usize>) -> (Side<'_>, Side<'_>) {
        let grains = |chunks: &Range<usize>| Grains {
            places: self.places.each_ref().map(|axis| &axis[chunks.clone()]),
            strengths: &self.strengths[chunks.clone()],
        };
        let grains = [grains(&lower), grains(&upper)];
        let [x, y, z] = self.forces.each_mut().map(|axis| {
            let (below, above) = axis.split_at_mut(upper.start);
            (&mut below[lower.clone()], &mut above[..upper.len()])
        });
        let [lower, upper] = grains;
        (Side { grains: lower, forces: [x.0, y.0, z.0] }, Side { grains: upper, forces: [x.1, y.1, z.1] })
    }
}

/// Grains that are read.
#[derive(Clone, Copy)]
struct Grains<'a> {
    places: [&'a [Lanes]; 3],
    strengths: &'a [Lanes],
}

/// Grains whose forces are added to.
struct Side<'a> {
    grains: Grains<'a>,
    forces: [&'a mut [Lanes]; 3],
}

impl Grains<'_> {
    /// Place and strength of one grain.
    #[inline(always)]
    fn get(&self, chunk: usize, lane: usize) -> ([f64; 3], f64) {
        (self.places.map(|axis| axis[chunk][lane]), self.strengths[chunk][lane])
    }

    /// The grains from a chunk on.
    #[inline(always)]
    fn from(&self, chunk: usize) -> Self {
        Self { places: self.places.map(|axis| &axis[chunk..]), strengths: &self.strengths[chunk..] }
    }
}

/// Sum of all lanes, by halves.
#[inline(always)]
pub(super) fn total(lanes: &Lanes) -> f64 {
    let [a, b, c, d, e, f, g, h] = *lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// Chunks of one pass over a row: what lies between the passes stays in the fastest cache.
const PASS: usize = 16;

/// One quantity of the grains of a pass.
type Pass = [Lanes; PASS];

/// Forces (N) on a grain at `place` of grains at `others`, by axis.
///
/// Plain loops over slices, one purpose each, are what compilers turn into vectors most reliably.
#[inline(always)]
fn pull<R: Radial>(radial: R, (place, strength): ([f64; 3], f64), others: Grains<'_>, pulls: &mut [Pass; 3]) {
    let count = others.strengths.len().min(PASS) * LANES;
    let [x, y, z] = others.places.map(|axis| &axis.as_flattened()[..count]);
    let strengths = &others.strengths.as_flattened()[..count];
    let [to_x, to_y, to_z] = pulls.each_mut().map(|axis| &mut axis.as_flattened_mut()[..count]);
    for index in 0..count {
        let apart = [x[index] - place[0], y[index] - place[1], z[index] - place[2]];
        let r2 = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
        let pull = strength * strengths[index] * radial.over_distance(r2);
        to_x[index] = pull * apart[0];
        to_y[index] = pull * apart[1];
        to_z[index] = pull * apart[2];
    }
}

/// Adds what was pulled to the sums of a row, lane by lane.
#[inline(always)]
fn add_up(pulls: &[Lanes], sums: &mut Lanes) {
    for pull in pulls {
        for lane in 0..LANES {
            sums[lane] += pull[lane];
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn forces_between<R: Radial>(radial: R, one: Side<'_>, other: Side<'_>) {
    let mut pulls = [[[0.0; LANES]; PASS]; 3];
    for start in (0..other.grains.strengths.len()).step_by(PASS) {
        let columns = other.grains.from(start);
        let count = columns.strengths.len().min(PASS);
        for row in 0..one.grains.strengths.len() * LANES {
            let (chunk, lane) = (row / LANES, row % LANES);
            pull(radial, one.grains.get(chunk, lane), columns, &mut pulls);
            for axis in 0..3 {
                let pulls = &pulls[axis][..count];
                let reactions = other.forces[axis][start..start + count].as_flattened_mut();
                reactions.iter_mut().zip(pulls.as_flattened()).for_each(|(force, pull)| *force -= pull);
                let mut sums = [0.0; LANES];
                add_up(pulls, &mut sums);
                one.forces[axis][chunk][lane] += total(&sums);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn forces_within<R: Radial>(radial: R, side: Side<'_>) {
    let Side { grains, forces } = side;
    let mut pulls = [[[0.0; LANES]; PASS]; 3];
    for row in 0..grains.strengths.len() * LANES {
        let (chunk, lane) = (row / LANES, row % LANES);
        for start in (0..grains.strengths.len()).step_by(PASS) {
            let columns = grains.from(start);
            let count = columns.strengths.len().min(PASS);
            pull(radial, grains.get(chunk, lane), columns, &mut pulls);
            for axis in 0..3 {
                if let Some(own) = pulls[axis][..count].get_mut(chunk.wrapping_sub(start)) {
                    // No grain pulls itself; at no distance the force is no number.
                    own[lane] = 0.0;
                }
                let mut sums = [0.0; LANES];
                add_up(&pulls[axis][..count], &mut sums);
                forces[axis][chunk][lane] += total(&sums);
            }
        }
    }
}

/// Force on a grain, and the sum of the magnitudes of what contributes to it, both N; the column `skip` is left out.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn force_and_magnitude<R: Radial>(
    radial: R,
    grain: ([f64; 3], f64),
    others: Grains<'_>,
    skip: Option<usize>,
) -> (Vector3<f64>, f64) {
    let mut pulls = [[[0.0; LANES]; PASS]; 3];
    let mut magnitudes = [[0.0; LANES]; PASS];
    let mut sums = [[0.0; LANES]; 4];
    for start in (0..others.strengths.len()).step_by(PASS) {
        let columns = others.from(start);
        let count = columns.strengths.len().min(PASS);
        pull(radial, grain, columns, &mut pulls);
        weigh(radial, grain, columns, &mut magnitudes);
        for (pass, sum) in pulls.iter_mut().chain([&mut magnitudes]).zip(&mut sums) {
            let pass = &mut pass[..count];
            let own = skip.and_then(|skip| pass.as_flattened_mut().get_mut(skip.wrapping_sub(start * LANES)));
            own.into_iter().for_each(|own| *own = 0.0);
            add_up(pass, sum);
        }
    }
    let [x, y, z, magnitude] = sums.map(|sum| total(&sum));
    (Vector3::new(x, y, z), magnitude)
}

/// Sums of the magnitudes of both terms of the law between a grain and grains at `others`, N.
#[inline(always)]
fn weigh<R: Radial>(radial: R, (place, strength): ([f64; 3], f64), others: Grains<'_>, magnitudes: &mut Pass) {
    let count = others.strengths.len().min(PASS) * LANES;
    let [x, y, z] = others.places.map(|axis| &axis.as_flattened()[..count]);
    let strengths = &others.strengths.as_flattened()[..count];
    let magnitudes = &mut magnitudes.as_flattened_mut()[..count];
    for index in 0..count {
        let apart = [x[index] - place[0], y[index] - place[1], z[index] - place[2]];
        let r2 = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
        let weight = (strength * strengths[index]).abs();
        magnitudes[index] = weight * NearField::magnitude_at(radial, r2) * r2.sqrt();
    }
}

/// A coordinate that is greater, by a distance whose powers are finite.
#[inline(always)]
pub(super) fn beyond(coordinate: f64) -> f64 {
    coordinate + (1.0 + coordinate.abs())
}

/// Potential energies (J) of a grain at `place` with grains at `others`.
#[inline(always)]
fn energies<R: Radial>(
    radial: R,
    potential: PotentialFactors,
    (place, strength): ([f64; 3], f64),
    others: Grains<'_>,
    energies: &mut Pass,
) {
    let count = others.strengths.len().min(PASS) * LANES;
    let [x, y, z] = others.places.map(|axis| &axis.as_flattened()[..count]);
    let strengths = &others.strengths.as_flattened()[..count];
    let energies = &mut energies.as_flattened_mut()[..count];
    let r2 = |index: usize| {
        let apart = [x[index] - place[0], y[index] - place[1], z[index] - place[2]];
        apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
    };
    for index in 0..count {
        energies[index] = strength * strengths[index] * potential.power_law(radial, r2(index));
    }
    if potential.has_logarithm() {
        for index in 0..count {
            energies[index] += strength * strengths[index] * potential.logarithmic(r2(index));
        }
    }
}

/// Twice the energy where `itself` says that both are the same grains.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn energy_between<R: Radial>(
    radial: R,
    potential: PotentialFactors,
    one: Grains<'_>,
    other: Grains<'_>,
    itself: bool,
) -> f64 {
    let mut pass = [[0.0; LANES]; PASS];
    let mut sums = [0.0; LANES];
    for row in 0..one.strengths.len() * LANES {
        let (chunk, lane) = (row / LANES, row % LANES);
        let grain = one.get(chunk, lane);
        if grain.1 == 0.0 {
            // Empty lanes lie at the same place, where the energy of two is no number.
            continue;
        }
        for start in (0..other.strengths.len()).step_by(PASS) {
            let columns = other.from(start);
            let count = columns.strengths.len().min(PASS);
            energies(radial, potential, grain, columns, &mut pass);
            if let Some(own) = pass[..count].get_mut(chunk.wrapping_sub(start)).filter(|_| itself) {
                own[lane] = 0.0;
            }
            add_up(&pass[..count], &mut sums);
        }
    }
    total(&sums)
}
