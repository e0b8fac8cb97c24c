//! The near field summed over many grains.
//!
//! ```
//! use impinge::law::{NearField, Term};
//! use impinge::near_field::{ForceSum, Method};
//! use impinge_events::Domain;
//! use nalgebra::Vector3;
//!
//! let law = NearField::new(Term { alpha: 1.0, beta: 2.0 }, Term { alpha: 0.002, beta: 3.0 })?;
//! let mut sum = ForceSum::new(law, Method::Direct, &Domain::unbounded())?;
//! let positions = [Vector3::zeros(), Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.3)];
//! let mut forces = [Vector3::zeros(); 3];
//! sum.forces(&positions, None, &mut forces)?;
//! assert!(forces[0].x > 0.0 && forces[0].z > 0.0, "the first grain is drawn to both others");
//! assert!(forces.iter().sum::<Vector3<f64>>().norm() < 1e-13 * forces[0].norm(), "to every force there is a reaction");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! There are three ways to sum ([`Method`]): all pairs, in vectors and threads; pairs within a cut-off, from lists of neighbours that last;
//! and a tree, which takes groups of grains that are far apart together. The bits of a sum do not depend on the number of
//! threads, nor on how wide the machine's vectors are. (The system's `powf` and `ln` come in only for exponents that are
//! neither integers nor half-integers, and in the potential of beta = 1.)
//!
//! With strengths s, the force on grain i from grain j is that of the law times s_i s_j.

mod block;
mod cut_off;
mod direct;
mod error;
mod measure;
mod tournament;
mod tree;

use impinge_events::Domain;
use nalgebra::Vector3;

pub use self::cut_off::CutOff;
use self::cut_off::CutOffSum;
use self::direct::Direct;
pub use self::error::{Singular, Unsuitable};
pub use self::measure::MeasuredError;
use self::tree::TreeSum;
use crate::law::NearField;

/// The tightest tolerance of a tree: below it, rounding would no longer be small beside it.
pub const TIGHTEST: f64 = 1e-8;

/// The loosest tolerance of a tree: beyond it, forces would be guesses.
pub const LOOSEST: f64 = 0.1;

/// How the near field is summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// All pairs.
    Direct,
    /// Pairs within a cut-off.
    CutOff(CutOff),
    /// All pairs, those of distant groups of grains together.
    Tree {
        /// Bound of the error of the force on each grain i, over the sum of the magnitudes of all contributions to it,
        /// Σ_j |s_i s_j| (|alpha1| r_ij^-beta1 + |alpha2| r_ij^-beta2). Relative to the force itself the error is larger: contributions cancel.
        tolerance: f64,
        /// What stands behind the tolerance.
        bound: Bound,
    },
}

/// What stands behind the tolerance of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// A proof, for each grain of any set. It supposes the worst of all cells: real errors stay hundreds of times below the
    /// tolerance, and it takes up to a few times as long.
    Proven,
    /// A measurement: each sum is compared with the direct sum at 64 grains, and if an error there is above a quarter of the tolerance it is
    /// worked out anew with cells further apart, in the end as with [`Proven`](Self::Proven). An error above the tolerance that the
    /// sample does not show is unlikely, but not excluded.
    Measured,
}

/// Grains from which on a tree is faster than the direct sum, at tolerances about 1e-4 (`cargo bench --bench near_field`).
const TREE_FROM: usize = 3000;

/// The faster way to sum all pairs of so many grains with at most this error: the direct sum, or a tree with a proven bound.
///
/// ```
/// use impinge::near_field::{Bound, Method, choose};
///
/// assert_eq!(choose(500, 1e-4), Method::Direct);
/// assert_eq!(choose(100_000, 1e-4), Method::Tree { tolerance: 1e-4, bound: Bound::Proven });
/// assert_eq!(choose(100_000, 1e-12), Method::Direct, "no tree is as good as that");
/// ```
#[must_use]
pub fn choose(grains: usize, tolerance: f64) -> Method {
    if grains < TREE_FROM || tolerance < TIGHTEST {
        Method::Direct
    } else {
        Method::Tree { tolerance: tolerance.min(LOOSEST), bound: Bound::Proven }
    }
}

/// The near field of many grains, and whatever its sum keeps from one time to the next.
#[derive(Clone, Debug)]
pub struct ForceSum {
    law: NearField,
    method: Method,
    way: Way,
}

#[derive(Clone, Debug)]
enum Way {
    Direct(Direct),
    CutOff(Box<CutOffSum>),
    Tree(Box<TreeSum>),
}

impl ForceSum {
    /// A way to sum the near field `law` over grains in `domain`.
    ///
    /// # Errors
    ///
    /// When the method does not suit the law or the domain: in a periodic domain only a cut-off does.
    pub fn new(law: NearField, method: Method, domain: &Domain) -> Result<Self, Unsuitable> {
        if domain.periodic && !matches!(method, Method::CutOff(_)) {
            return Err(Unsuitable::Periodic);
        }
        let way = match method {
            Method::Direct => Way::Direct(Direct::default()),
            Method::CutOff(cut_off) => Way::CutOff(Box::new(CutOffSum::new(&law, cut_off, domain)?)),
            Method::Tree { tolerance, .. } if !(TIGHTEST..=LOOSEST).contains(&tolerance) => {
                return Err(Unsuitable::Tolerance(tolerance));
            }
            Method::Tree { tolerance, bound } => Way::Tree(Box::new(TreeSum::new(&law, tolerance, bound))),
        };
        Ok(Self { law, method, way })
    }

    /// The law that is summed.
    #[must_use]
    pub fn law(&self) -> &NearField {
        &self.law
    }

    /// How it is summed.
    #[must_use]
    pub fn method(&self) -> Method {
        self.method
    }

    /// Writes the force on each grain (N) to `out`. `strengths` are 1 where none are given.
    ///
    /// # Errors
    ///
    /// When a force is no finite number: two centres coincide, or a position or strength is no finite number.
    ///
    /// # Panics
    ///
    /// When there are not as many strengths or forces as positions.
    pub fn forces(
        &mut self,
        positions: &[Vector3<f64>],
        strengths: Option<&[f64]>,
        out: &mut [Vector3<f64>],
    ) -> Result<(), Singular> {
        assert_eq!(positions.len(), out.len(), "one force a grain");
        check(positions, strengths)?;
        match &mut self.way {
            Way::Direct(sum) => sum.forces(&self.law, positions, strengths, out),
            Way::CutOff(sum) => sum.forces(&self.law, positions, strengths, out),
            Way::Tree(sum) => sum.forces(&self.law, positions, strengths, out),
        }
        match out.iter().position(|force| !is_finite(force)) {
            Some(grain) => Err(self.singular(positions, grain)),
            None => Ok(()),
        }
    }

    /// Potential energy of all pairs, J.
    ///
    /// # Errors
    ///
    /// As [`forces`](Self::forces).
    ///
    /// # Panics
    ///
    /// When there are not as many strengths as positions.
    pub fn potential_energy(&mut self, positions: &[Vector3<f64>], strengths: Option<&[f64]>) -> Result<f64, Singular> {
        check(positions, strengths)?;
        let energy = match &mut self.way {
            Way::Direct(sum) => sum.potential_energy(&self.law, positions, strengths),
            Way::CutOff(sum) => sum.potential_energy(&self.law, positions, strengths),
            Way::Tree(sum) => sum.potential_energy(&self.law, positions, strengths),
        };
        if energy.is_finite() {
            return Ok(energy);
        }
        // Seldom, and the end of a run: worth a search for the grains.
        let grains = 0..positions.len();
        let found =
            grains.map(|grain| self.singular(positions, grain)).find(|it| matches!(it, Singular::Coincident(..)));
        Err(found.unwrap_or(Singular::NotFinite(0)))
    }

    /// Whether pairs nearer than `distance` (m) feel the law as it is, free of the switch of a cut-off.
    #[must_use]
    pub fn is_plain_within(&self, distance: f64) -> bool {
        match self.method {
            Method::CutOff(CutOff { radius, switch_width, .. }) => distance <= radius - switch_width,
            _ => true,
        }
    }

    /// Force (N) on a grain whose partner is at `apart` (m) from it, both of strength 1: what this sum counts for one pair.
    #[must_use]
    pub fn pair_force(&self, apart: Vector3<f64>) -> Vector3<f64> {
        match &self.way {
            Way::Direct(_) | Way::Tree(_) => self.law.force_on(apart),
            Way::CutOff(sum) => sum.pair_force(&self.law, apart),
        }
    }

    /// Potential energy (J) of one pair at distance `r` (m), both of strength 1.
    #[must_use]
    pub fn pair_potential(&self, r: f64) -> f64 {
        match &self.way {
            Way::Direct(_) | Way::Tree(_) => self.law.potential(r),
            Way::CutOff(sum) => sum.pair_potential(&self.law, r),
        }
    }

    /// How often neighbour lists were made; 0 without a cut-off.
    #[must_use]
    pub fn lists_made(&self) -> u64 {
        match &self.way {
            Way::CutOff(sum) => sum.lists_made(),
            Way::Direct(_) | Way::Tree(_) => 0,
        }
    }

    /// Why the force on `grain` is no finite number.
    fn singular(&self, positions: &[Vector3<f64>], grain: usize) -> Singular {
        let others = (0..positions.len()).filter(|&other| other != grain);
        let mut coincident = others.filter(|&other| !is_finite(&self.pair_force(positions[other] - positions[grain])));
        match coincident.next() {
            Some(other) => Singular::Coincident(grain.min(other), grain.max(other)),
            None => Singular::NotFinite(grain),
        }
    }
}

/// Whether everything that is summed is a finite number.
fn check(positions: &[Vector3<f64>], strengths: Option<&[f64]>) -> Result<(), Singular> {
    assert!(strengths.is_none_or(|strengths| strengths.len() == positions.len()), "one strength a grain");
    let strength = |grain: usize| direct::strength(strengths, grain);
    let fault = |&grain: &usize| !(is_finite(&positions[grain]) && strength(grain).is_finite());
    (0..positions.len()).find(fault).map_or(Ok(()), |grain| Err(Singular::NotFinite(grain)))
}

fn is_finite(vector: &Vector3<f64>) -> bool {
    vector.iter().all(|part| part.is_finite())
}
