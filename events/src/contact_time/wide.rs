//! Numbers in double length, for the few contact times that a single length cannot tell.
//!
//! A [`Wide`] is the unevaluated sum of two floats, known to about 2^-104. Products are split after Veltkamp and Dekker (1971)
//! and not taken with `f64::mul_add`, which calls a slow library function where the machine has no such instruction or the program
//! was not built for it (plain x86-64). No operation looks at a sign, so all of them give the same bits, negated, for negated
//! numbers; and `a + b` is `b + a`, `a * b` is `b * a`, bit for bit.

use std::ops::{Add, Mul, Neg, Sub};

use nalgebra::Vector3;

/// The sum of two floats, the second no larger than the rounding of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wide {
    /// The number, rounded.
    pub(super) high: f64,
    low: f64,
}

/// A float times this (2^27 + 1), less what that exceeds the float by, is its upper 26 bits: Veltkamp's constant.
const SPLITTER: f64 = ((1u32 << 27) + 1) as f64;

/// The upper and the lower half of the digits of `x`; their products with each other are exact.
fn halves(x: f64) -> (f64, f64) {
    let product = SPLITTER * x;
    let upper = product - (product - x);
    (upper, x - upper)
}

impl Wide {
    /// a + b, exactly (Knuth, The Art of Computer Programming 2, theorem 4.2.2 B).
    pub(super) fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let of_b = high - a;
        let of_a = high - of_b;
        Self { high, low: (a - of_a) + (b - of_b) }
    }

    /// a b, exactly where nothing overflows or underflows (Dekker 1971).
    pub(super) fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        let ((upper_a, lower_a), (upper_b, lower_b)) = (halves(a), halves(b));
        let crossed = (upper_a * lower_b, lower_a * upper_b);
        let left = (upper_a * upper_b - high) + crossed.0 + crossed.1;
        Self { high, low: left + lower_a * lower_b }
    }

    /// high + low for |high| well above |low|, exactly.
    fn carried(high: f64, low: f64) -> Self {
        let sum = high + low;
        Self { high: sum, low: low - (sum - high) }
    }

    /// This times a power of two.
    fn scaled(self, power: f64) -> Self {
        Self { high: self.high * power, low: self.low * power }
    }
}

impl From<f64> for Wide {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Neg for Wide {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

/// To 3 × 2^-106 of the sum, however much cancels (Joldes, Muller & Popescu 2017, algorithm 6).
impl Add for Wide {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (highs, lows) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let first = Self::carried(highs.high, highs.low + lows.high);
        Self::carried(first.high, first.low + lows.low)
    }
}

impl Sub for Wide {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

/// To 8 × 2^-106 of the product (the same, section 5).
impl Mul for Wide {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        Self::carried(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

/// A vector of [`Wide`] numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WideVector([Wide; 3]);

impl WideVector {
    pub(super) fn dot(&self, other: &Self) -> Wide {
        let [x, y, z] = [0, 1, 2].map(|i| self.0[i] * other.0[i]);
        x + y + z
    }

    pub(super) fn cross(&self, other: &Self) -> Self {
        let part = |i: usize, j: usize| self.0[i] * other.0[j] - self.0[j] * other.0[i];
        Self([part(1, 2), part(2, 0), part(0, 1)])
    }

    pub(super) fn times(&self, factor: Wide) -> Self {
        Self(self.0.map(|x| x * factor))
    }

    /// This times a power of two.
    pub(super) fn scaled(&self, power: f64) -> Self {
        Self(self.0.map(|x| x.scaled(power)))
    }

    /// Magnitude of the largest component.
    pub(super) fn amax(&self) -> f64 {
        self.0.iter().map(|x| x.high.abs()).fold(0.0, f64::max)
    }
}

impl From<Vector3<f64>> for WideVector {
    fn from(vector: Vector3<f64>) -> Self {
        Self([vector.x.into(), vector.y.into(), vector.z.into()])
    }
}

impl Add for WideVector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self([0, 1, 2].map(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for WideVector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self([0, 1, 2].map(|i| self.0[i] - other.0[i]))
    }
}

#[cfg(test)]
mod tests {
    use dashu_float::{FBig, round::mode::HalfEven};
    use proptest::prelude::*;

    use super::*;

    /// Largest relative error of a sum or a product: a few 2^-106.
    const ROUNDING: f64 = 1e-31;

    type Real = FBig<HalfEven, 2>;

    fn float(value: f64) -> Real {
        Real::try_from(value).expect("a finite number").with_precision(400).value()
    }

    fn real(number: Wide) -> Real {
        float(number.high) + float(number.low)
    }

    fn off(found: Wide, exact: &Real) -> f64 {
        (real(found) - exact).to_f64().value().abs() / exact.to_f64().value().abs().max(f64::MIN_POSITIVE)
    }

    /// Numbers with all their digits, of like and of very unlike size, and nearly opposite ones.
    fn number() -> impl Strategy<Value = Wide> {
        (-1.0..1.0f64, -1.0..1.0f64, -40.0..40.0f64).prop_map(|(x, y, size)| {
            let high = x * 10f64.powf(size);
            Wide::carried(high, high * y * (f64::EPSILON / 2.0))
        })
    }

    fn two() -> impl Strategy<Value = (Wide, Wide)> {
        let nearly_opposite = (number(), -1.0..1.0f64, 0.0..30.0f64)
            .prop_map(|(a, x, size)| (a, -a + Wide::product(a.high, x * 10f64.powf(-size))));
        prop_oneof![(number(), number()), nearly_opposite]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn sums_and_products_of_floats_are_exact((a, b) in two()) {
            let (a, b) = (a.high, b.high);
            prop_assert_eq!(real(Wide::sum(a, b)), float(a) + float(b));
            prop_assert_eq!(real(Wide::product(a, b)), float(a) * float(b));
        }

        #[test]
        fn sums_and_products_keep_double_length((a, b) in two()) {
            prop_assert!(off(a + b, &(real(a) + real(b))) < ROUNDING);
            prop_assert!(off(a - b, &(real(a) - real(b))) < ROUNDING);
            prop_assert!(off(a * b, &(real(a) * real(b))) < ROUNDING);
        }

        #[test]
        fn order_and_sign_change_no_bit((a, b) in two()) {
            prop_assert_eq!((a + b, a * b), (b + a, b * a));
            prop_assert_eq!((-a - b, a * -b), (-(a + b), -(a * b)));
        }
    }
}
