//! Only pairs that are close, from neighbour lists that last.

mod list;
mod switch;

use impinge_events::Domain;
use multiversion::multiversion;
use nalgebra::Vector3;
use rayon::iter::{IndexedParallelIterator as _, IntoParallelIterator as _, ParallelIterator as _};
use rayon::slice::ParallelSliceMut as _;

use self::list::NeighborList;
use self::switch::{Switch, Switched};
use super::Unsuitable;
use super::direct::strength;
use crate::law::NearField;
use crate::law::near_field::{Radial, with_radial};

/// Where the near field ends.
///
/// All three are distances between centres, whatever the radii of the grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutOff {
    /// Distance from which on there is no force, m; at most half the shortest period of the domain.
    pub radius: f64,
    /// Width of the shell inside it over which the force is taken to zero, m; at most half the radius.
    pub switch_width: f64,
    /// How much further than the radius the neighbour lists reach, m. They are made anew when a grain has moved by half of this: a wide
    /// skin is seldom renewed, and makes every sum longer.
    pub skin: f64,
}

/// Grains whose forces are worked out in one go.
const GRAINS: usize = 64;

/// Neighbours that are worked on together; what lies between the passes stays in the fastest cache.
const PASS: usize = 64;

/// The sum over neighbours.
///
/// Each grain adds up its own neighbours in the order of their numbers. Those beyond the cut-off add nothing, to the bit: neither
/// the age of the lists nor the number of threads changes a force.
#[derive(Clone, Debug)]
pub(super) struct CutOffSum {
    cut_off: CutOff,
    switch: Switch,
    domain: Domain,
    list: NeighborList,
    lists_made: u64,
}

impl CutOffSum {
    pub(super) fn new(law: &NearField, cut_off: CutOff, domain: &Domain) -> Result<Self, Unsuitable> {
        let CutOff { radius, switch_width, skin } = cut_off;
        let sound = radius.is_finite() && switch_width > 0.0 && switch_width <= 0.5 * radius;
        if !(sound && skin >= 0.0 && skin.is_finite()) {
            return Err(Unsuitable::CutOff(cut_off));
        }
        let extent = domain.extent();
        let shortest = if domain.planar { extent.x.min(extent.z) } else { extent.min() };
        if domain.periodic && radius > 0.5 * shortest {
            return Err(Unsuitable::LongCutOff { radius, half: 0.5 * shortest });
        }
        Ok(Self {
            cut_off,
            switch: Switch::new(law, cut_off),
            domain: *domain,
            list: NeighborList::default(),
            lists_made: 0,
        })
    }

    /// How often lists were made.
    pub(super) fn lists_made(&self) -> u64 {
        self.lists_made
    }

    /// Force on a grain whose partner is at `apart` (m), N.
    pub(super) fn pair_force(&self, law: &NearField, apart: Vector3<f64>) -> Vector3<f64> {
        let apart = self.domain.nearest(apart);
        law.force_on(apart) * self.switch.factor(apart.norm())
    }

    /// Potential energy of a pair at distance `r` (m), J.
    pub(super) fn pair_potential(&self, law: &NearField, r: f64) -> f64 {
        self.switch.potential(law, r)
    }

    /// Forces of all pairs within the cut-off, N.
    pub(super) fn forces(
        &mut self,
        law: &NearField,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
        out: &mut [Vector3<f64>],
    ) {
        self.renew(positions);
        let grains = Grains { positions, strengths, period: Period::of(&self.domain) };
        let (list, switch) = (&self.list, self.switch);
        out.par_chunks_mut(GRAINS).enumerate().for_each(|(chunk, out)| {
            with_radial!(law, radial => forces(Switched { radial, switch }, grains, list, chunk * GRAINS, out));
        });
    }

    /// Potential energy of all pairs within the cut-off, J.
    pub(super) fn potential_energy(
        &mut self,
        law: &NearField,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
    ) -> f64 {
        self.renew(positions);
        let of_grain = |grain: usize| {
            let upper = self.list.of(grain).iter().map(|&other| other as usize).filter(|&other| other > grain);
            let energies = upper.map(|other| {
                let r = self.domain.nearest(positions[other] - positions[grain]).norm();
                strength(strengths, other) * self.switch.potential(law, r)
            });
            strength(strengths, grain) * energies.sum::<f64>()
        };
        // Collected in order, so that the sum is the same with any number of threads.
        let parts: Vec<f64> = (0..positions.len()).into_par_iter().map(of_grain).collect();
        parts.into_iter().sum()
    }

    /// Makes new lists if grains have moved so far that two that were out of reach may be within the cut-off.
    fn renew(&mut self, positions: &[Vector3<f64>]) {
        if !self.list.holds(positions, &self.domain, 0.5 * self.cut_off.skin) {
            self.list = NeighborList::new(positions, &self.domain, self.cut_off.radius + self.cut_off.skin);
            self.lists_made += 1;
        }
    }
}

/// What forces depend on.
#[derive(Clone, Copy)]
struct Grains<'a> {
    positions: &'a [Vector3<f64>],
    strengths: Option<&'a [f64]>,
    period: Period,
}

/// Lengths of the periods by axis, m, and their inverses; both zero where there is none.
#[derive(Clone, Copy)]
struct Period {
    lengths: [f64; 3],
    inverses: [f64; 3],
}

impl Period {
    fn of(domain: &Domain) -> Self {
        let is_periodic = |axis| domain.periodic && !(domain.planar && axis == 1);
        let lengths = [0, 1, 2].map(|axis| if is_periodic(axis) { domain.extent()[axis] } else { 0.0 });
        Self { lengths, inverses: lengths.map(|length| if length > 0.0 { 1.0 / length } else { 0.0 }) }
    }
}

/// One quantity of the neighbours of a pass.
type Pass = [f64; PASS];

/// Forces (N) on the grains from `first` on.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn forces<R: Radial>(radial: R, grains: Grains<'_>, list: &NeighborList, first: usize, out: &mut [Vector3<f64>]) {
    let mut apart = [[0.0; PASS]; 3];
    let mut weights = [0.0; PASS];
    for (grain, out) in (first..).zip(out) {
        *out = Vector3::zeros();
        for neighbors in list.of(grain).chunks(PASS) {
            gather(grains, grain, neighbors, &mut apart, &mut weights);
            pull(radial, grains.period, &mut apart, &weights, neighbors.len());
            let [x, y, z] = &apart;
            for ((x, y), z) in x.iter().zip(y).zip(z).take(neighbors.len()) {
                *out += Vector3::new(*x, *y, *z);
            }
        }
    }
}

/// Differences of the positions of neighbours and grain (m), and the products of their strengths.
#[inline(always)]
fn gather(grains: Grains<'_>, grain: usize, neighbors: &[u32], apart: &mut [Pass; 3], weights: &mut Pass) {
    let place = grains.positions[grain];
    let own = strength(grains.strengths, grain);
    for (index, &other) in neighbors.iter().enumerate() {
        let difference = grains.positions[other as usize] - place;
        for axis in 0..3 {
            apart[axis][index] = difference[axis];
        }
        weights[index] = own * strength(grains.strengths, other as usize);
    }
}

/// Turns differences of positions into forces, N.
#[inline(always)]
fn pull<R: Radial>(radial: R, period: Period, apart: &mut [Pass; 3], weights: &Pass, count: usize) {
    for axis in 0..3 {
        let (length, inverse) = (period.lengths[axis], period.inverses[axis]);
        if length > 0.0 {
            apart[axis][..count].iter_mut().for_each(|apart| *apart -= (*apart * inverse).round_ties_even() * length);
        }
    }
    let [x, y, z] = apart.each_mut().map(|axis| &mut axis[..count]);
    let weights = &weights[..count];
    for index in 0..count {
        let r2 = x[index] * x[index] + y[index] * y[index] + z[index] * z[index];
        let pull = weights[index] * radial.over_distance(r2);
        x[index] *= pull;
        y[index] *= pull;
        z[index] *= pull;
    }
}
