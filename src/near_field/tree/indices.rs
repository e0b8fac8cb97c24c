//! The monomials x^k = x^a y^b z^c that expansions are made of.

/// How a monomial, or a derivative, follows from those of lower degree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// The axis along which it is one higher.
    pub(super) axis: usize,
    /// Where the one lower by 1 along this axis is.
    pub(super) lower: usize,
    /// Where the one lower by 2 is; 0, and of no use, where there is none.
    pub(super) lowest: usize,
    /// Its exponent along this axis.
    pub(super) exponent: f64,
}

/// All exponents k = (a, b, c) up to some degree a + b + c, by rising degree, so that those up to a lower degree are the first ones.
#[derive(Clone, Debug)]
pub(super) struct Indices {
    /// Highest degree.
    pub(super) degree: usize,
    /// Number of monomials up to each degree.
    pub(super) counts: Vec<usize>,
    /// Degree of each.
    pub(super) degrees: Vec<usize>,
    /// How each follows from lower ones; meaningless for the first.
    pub(super) steps: Vec<Step>,
    /// For each l, where k + l is, for all k for which its degree is not too high.
    pub(super) sums: Vec<Vec<u16>>,
    /// Where k + 1 along each axis is, for all k below the highest degree.
    pub(super) higher: [Vec<usize>; 3],
    /// Where k − 1 along each axis is, if there is one.
    lower: [Vec<Option<usize>>; 3],
}

impl Indices {
    pub(super) fn up_to(degree: usize) -> Self {
        let of_degree = |n: usize| (0..=n).rev().flat_map(move |a| (0..=n - a).rev().map(move |b| [a, b, n - a - b]));
        let all: Vec<[usize; 3]> = (0..=degree).flat_map(of_degree).collect();
        let counts: Vec<usize> = (0..=degree).map(|n| (n + 1) * (n + 2) * (n + 3) / 6).collect();
        let below = |n: usize| if n > degree { 0 } else { counts[degree - n] };
        let plus = |k: [usize; 3], l: [usize; 3]| find([k[0] + l[0], k[1] + l[1], k[2] + l[2]]);
        let sum = |k: &[usize; 3]| k.iter().sum::<usize>();
        let unit = |axis: usize| [0, 1, 2].map(|other| usize::from(other == axis));
        Self {
            degree,
            degrees: all.iter().map(sum).collect(),
            steps: all.iter().copied().map(step).collect(),
            sums: all.iter().map(|&l| all[..below(sum(&l))].iter().map(|&k| plus(k, l) as u16).collect()).collect(),
            higher: [0, 1, 2].map(|axis| all[..below(1)].iter().map(|&k| plus(k, unit(axis))).collect()),
            lower: [0, 1, 2].map(|axis| {
                let less = |k: &[usize; 3]| {
                    let mut lower = *k;
                    lower[axis] = k[axis].checked_sub(1)?;
                    Some(find(lower))
                };
                all.iter().map(less).collect()
            }),
            counts,
        }
    }

    /// Where the exponents that are lower by 1 along an axis are.
    pub(super) fn lower(&self, index: usize, axis: usize) -> Option<usize> {
        self.lower[axis][index]
    }

    /// Number of monomials.
    pub(super) fn len(&self) -> usize {
        self.steps.len()
    }
}

/// Where k stands: behind all of lower degree, and behind those of its degree whose first exponent, or else whose second one, is higher.
fn find([a, b, c]: [usize; 3]) -> usize {
    let (degree, rest) = (a + b + c, b + c);
    degree * (degree + 1) * (degree + 2) / 6 + rest * (rest + 1) / 2 + c
}

/// How k follows from lower exponents, along the first axis along which it can.
fn step(k: [usize; 3]) -> Step {
    let axis = (0..3).find(|&axis| k[axis] > 0).unwrap_or(0);
    let less = |by: usize| {
        let mut lower = k;
        lower[axis] = k[axis].checked_sub(by)?;
        Some(find(lower))
    };
    let exponent = k[axis] as f64;
    Step { axis, lower: less(1).unwrap_or(0), lowest: less(2).unwrap_or(0), exponent }
}

pub(super) fn factorial(n: usize) -> f64 {
    (1..=n).map(|i| i as f64).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_follow_from_lower_ones() {
        let indices = Indices::up_to(5);
        assert_eq!(indices.len(), 56);
        let (x, y, z) = (2.0_f64, 3.0, 5.0);
        let mut monomials = vec![1.0];
        for step in &indices.steps[1..] {
            monomials.push(monomials[step.lower] * [x, y, z][step.axis]);
        }
        let mut expected: Vec<f64> = Vec::new();
        for a in 0..6 {
            for b in 0..6 - a {
                expected.extend((0..6 - a - b).map(|c| x.powi(a) * y.powi(b) * z.powi(c)));
            }
        }
        for l in 0..indices.len() {
            for (k, &sum) in indices.sums[l].iter().enumerate() {
                assert_eq!(monomials[usize::from(sum)], monomials[k] * monomials[l]);
            }
        }
        for (axis, coordinate) in [x, y, z].into_iter().enumerate() {
            assert!(indices.higher[axis].iter().enumerate().all(|(k, &up)| monomials[up] == monomials[k] * coordinate));
        }
        monomials.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        assert_eq!(monomials, expected);
    }
}
