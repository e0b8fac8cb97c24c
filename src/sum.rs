//! Sums whose rounding error does not grow with the number of terms.

use std::ops::AddAssign;

use nalgebra::Vector3;

/// A compensated running sum (Neumaier 1974): what each addition rounds away is kept and added at the end. It is found without a branch (Knuth, The
/// Art of Computer Programming 2, 1969, section 4.2.2).
///
/// A plain sum of n terms is off by up to n ulp of the sum of magnitudes; this one by about one ulp of the sum, and n² ulp².
///
/// ```
/// let mut sum = impinge::observe::Sum::default();
/// for term in [1.0, 1e100, 1.0, -1e100] {
///     sum += term;
/// }
/// assert_eq!(sum.value(), 2.0); // a plain sum gives 0
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    /// The sum so far.
    #[inline]
    #[must_use]
    pub fn value(self) -> f64 {
        self.sum + self.lost
    }
}

impl AddAssign<f64> for Sum {
    #[inline]
    fn add_assign(&mut self, term: f64) {
        let sum = self.sum + term;
        let added = sum - self.sum;
        self.lost += (self.sum - (sum - added)) + (term - added);
        self.sum = sum;
    }
}

impl FromIterator<f64> for Sum {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut sum = Self::default();
        terms.into_iter().for_each(|term| sum += term);
        sum
    }
}

/// A compensated sum of vectors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VectorSum([Sum; 3]);

impl VectorSum {
    /// The sum so far.
    #[must_use]
    pub fn value(self) -> Vector3<f64> {
        Vector3::from(self.0.map(Sum::value))
    }
}

impl AddAssign<Vector3<f64>> for VectorSum {
    #[inline]
    fn add_assign(&mut self, term: Vector3<f64>) {
        self.0.iter_mut().zip(term.iter()).for_each(|(sum, &part)| *sum += part);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_tenths_lose_nothing() {
        let terms = || std::iter::repeat_n(0.1, 1_000_000);
        let plain: f64 = terms().sum();
        let exact = 100_000.0; // 1e6 times the double next to 0.1, rounded
        assert!((plain - exact).abs() > 1e-7, "the plain sum should be off, or this test shows nothing");
        assert_eq!(terms().collect::<Sum>().value(), exact);
    }

    #[test]
    fn small_terms_survive_a_large_one_whichever_comes_first() {
        for terms in [[1.0, 1e17, -1e17], [1e17, 1.0, -1e17], [1e17, -1e17, 1.0]] {
            assert_eq!(terms.into_iter().collect::<Sum>().value(), 1.0);
        }
    }

    #[test]
    fn vectors_are_summed_by_component() {
        let mut sum = VectorSum::default();
        for term in [Vector3::new(1.0, 1e17, 0.0), Vector3::new(1e17, 1.0, -2.0), Vector3::new(-1e17, -1e17, 0.5)] {
            sum += term;
        }
        assert_eq!(sum.value(), Vector3::new(1.0, 1.0, -1.5));
    }
}
