//! Vectors in 60 digits: the geometry that contact times are tested against.

// Each test file is a crate of its own and uses its share of this one.
#![allow(dead_code, unreachable_pub)]

use std::ops::{Add, Mul, Sub};

use dashu_float::{FBig, round::mode::HalfEven};
use nalgebra::Vector3;

/// 220 bits.
pub type Real = FBig<HalfEven, 2>;

/// About 66 digits.
const BITS: usize = 220;

pub fn real(value: f64) -> Real {
    Real::try_from(value).expect("a finite number").with_precision(BITS).value()
}

pub fn double(value: &Real) -> f64 {
    value.to_f64().value()
}

/// A vector.
#[derive(Clone)]
pub struct Exact(pub [Real; 3]);

impl Exact {
    pub fn of(vector: Vector3<f64>) -> Self {
        Self([real(vector.x), real(vector.y), real(vector.z)])
    }

    pub fn dot(&self, other: &Self) -> Real {
        (0..3).map(|i| &self.0[i] * &other.0[i]).fold(real(0.0), |sum, term| sum + term)
    }

    pub fn cross(&self, other: &Self) -> Self {
        let part = |i: usize, j: usize| &self.0[i] * &other.0[j] - &self.0[j] * &other.0[i];
        Self([part(1, 2), part(2, 0), part(0, 1)])
    }
}

impl Add for &Exact {
    type Output = Exact;
    fn add(self, other: Self) -> Exact {
        Exact([0, 1, 2].map(|i| &self.0[i] + &other.0[i]))
    }
}

impl Sub for &Exact {
    type Output = Exact;
    fn sub(self, other: Self) -> Exact {
        Exact([0, 1, 2].map(|i| &self.0[i] - &other.0[i]))
    }
}

impl Mul<&Real> for &Exact {
    type Output = Exact;
    fn mul(self, factor: &Real) -> Exact {
        Exact([0, 1, 2].map(|i| &self.0[i] * factor))
    }
}

/// The earlier root of a t² + 2 b t + c with b < 0 < c.
pub fn earlier_root(a: &Real, b: &Real, c: &Real) -> Option<Real> {
    let reach = b * b - a * c;
    (*b < real(0.0) && reach >= real(0.0)).then(|| c / (reach.sqrt() - b))
}

/// When two spheres touch that are `r` apart, move with `v` against each other and whose radii add up to `reach`; a negative one
/// never touches.
pub fn exact_meeting(r: &Exact, v: &Exact, reach: &Real) -> Option<Real> {
    if *reach < real(0.0) { None } else { earlier_root(&v.dot(v), &r.dot(v), &(r.dot(r) - reach * reach)) }
}
