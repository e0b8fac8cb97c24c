//! When two cells are far enough apart to be taken together.

use super::cell::Cell;
use super::indices::factorial;
use super::interact::MAX_ORDER;
use crate::law::{NearField, Term};

/// Decides to which order the expansion of two cells about each other is good enough.
///
/// What is bounded is the error of the force on each grain i, relative to the sum A_i of the magnitudes of all that contributes to it:
/// |error of F_i| ≤ tolerance × A_i, with A_i = Σ_j |s_i s_j| (|alpha1| r_ij^-beta1 + |alpha2| r_ij^-beta2).
///
/// **The bound.** The Taylor terms of degree n of a force r^-beta at distance R are at most m_n(beta) |δ|^n R^(−beta − n), with δ the difference
/// of the places of grain and source in their cells: those of the potential are Gegenbauer polynomials, whose largest values are known, and the
/// gradient of a homogeneous polynomial of degree n + 1 is at most n + 1 times as large as the polynomial (Banach 1938). For beta ≥ 1,
/// m_n = (beta)_n / n!; for beta < 1, m_n = 2 ((beta + 1)/2)_n / n!. An expansion of order P takes what is of degree n < P. What it leaves of the force of
/// sources of strengths s_j at distances r_j ≤ b from the centre of their cell, on a grain at most a from that of its own, is at most
/// Σ_(n ≥ P) m_n R^(−beta − n) Σ_j |s_j| (a + r_j)^n: a binomial sum of the mean powers of r_j ([`Cell::spreads`]) for n = P, and for each further
/// n at most q (a + b) / R times that, with q = m_(P+1) / m_P. Both terms of the law count with their shares of the force at R.
///
/// **The budget.** Per unit of strength of the sources, the error may be half the tolerance times the sum of what they contribute
/// themselves, at least, and of what all grains of the set contribute on average to the forces in the cell of the grain
/// ([`Cell::mean_contribution`]). Over all cells this adds up to at most the tolerance times A_i.
///
/// **The filling.** The bound supposes that grains are at the rims of their cells, where the cells are closest, and that no error makes up for another. A
/// filling below 1 takes the cells for so much smaller in it, which makes it an estimate: what that is worth has to be measured.
///
/// The form of the bound, by moments and binomials, follows Dehnen (2014), who estimates with it; with a filling of 1 it is strict.
#[derive(Clone, Debug)]
pub(super) struct Acceptance {
    /// Half of the tolerance that is allowed for.
    half_tolerance: f64,
    /// Share of their radii that cells are taken to fill.
    filling: f64,
    /// How both terms of the law grow near their sources.
    terms: [Growth; 2],
    /// C(n, k).
    binomials: [[f64; MAX_ORDER + 1]; MAX_ORDER + 1],
}

/// How the Taylor terms of a force r^-beta grow towards its source.
#[derive(Clone, Debug)]
struct Growth {
    /// beta, rounded up.
    steepness: i32,
    /// m_n.
    largest: [f64; MAX_ORDER + 1],
    /// m_(n+1) / m_n.
    ratios: [f64; MAX_ORDER + 1],
}

impl Growth {
    fn of(term: Term) -> Self {
        let orders = std::array::from_fn(|n| n);
        Self {
            steepness: term.beta.ceil() as i32,
            largest: orders.map(|n| growth(term.beta, n)),
            ratios: orders.map(|n| growth_ratio(term.beta, n)),
        }
    }
}

/// How far apart two cells are, and what the law is there.
#[derive(Clone, Copy)]
struct Distance {
    /// m
    r: f64,
    /// Sum of the magnitudes of both terms, N.
    magnitude: f64,
    /// The share of each.
    shares: [f64; 2],
}

impl Acceptance {
    pub(super) fn new(law: &NearField, tolerance: f64, filling: f64) -> Self {
        let orders: [usize; MAX_ORDER + 1] = std::array::from_fn(|n| n);
        Self {
            half_tolerance: 0.5 * tolerance,
            filling,
            terms: [law.attraction(), law.repulsion()].map(Growth::of),
            binomials: orders.map(|n| orders.map(|k| binomial(n, k))),
        }
    }

    /// The lowest order up to the `highest` that is good enough both ways; none if the cells are too close.
    pub(super) fn order(&self, law: &NearField, highest: usize, one: &Cell, other: &Cell) -> Option<usize> {
        let r = (one.centre - other.centre).norm();
        let reach = one.radius + other.radius;
        if reach >= r {
            return None;
        }
        let magnitudes = law.magnitudes(r);
        let magnitude = magnitudes[0] + magnitudes[1];
        let distance = Distance { r, magnitude, shares: magnitudes.map(|one| one / magnitude) };
        let limits = [self.limit(distance, one, other), self.limit(distance, other, one)];
        let good = |order: usize| {
            self.error(order, distance, one, other) <= limits[0] && self.error(order, distance, other, one) <= limits[1]
        };
        good(highest).then(|| (1..highest).find(|&order| good(order)).unwrap_or(highest))
    }

    /// Bound of the error per unit of strength of the sources, over the force at the distance `r` of the centres (m).
    fn error(&self, order: usize, Distance { r, shares, .. }: Distance, target: &Cell, source: &Cell) -> f64 {
        let reach = (target.radius + source.radius) / r;
        let mut growth = 0.0;
        for (share, term) in shares.into_iter().zip(&self.terms) {
            let convergence = 1.0 - term.ratios[order] * reach;
            if share > 0.0 && convergence <= 0.0 {
                return f64::INFINITY;
            }
            growth += if share > 0.0 { share * term.largest[order] / convergence } else { 0.0 };
        }
        let (near, inverse) = (target.radius / r, 1.0 / r);
        // Horner's rule in the radius of the target, with the spreads of the sources in units of r.
        let mut sum = 0.0;
        let mut unit = 1.0;
        for k in 0..=order {
            sum = sum * near + self.binomials[order][k] * source.spreads[k] * unit;
            unit *= inverse;
        }
        growth * sum * self.filling.powi(order as i32)
    }

    /// What the error may be, in the same units.
    fn limit(&self, Distance { r, magnitude, shares }: Distance, target: &Cell, source: &Cell) -> f64 {
        // Forces are convex in the distance: their mean is at least that at the mean distance.
        let nearest = 1.0 / (1.0 + (target.radius + source.spreads[1]) / r);
        let own = |(share, term): (f64, &Growth)| share * nearest.powi(term.steepness);
        let own: f64 = shares.into_iter().zip(&self.terms).map(own).sum();
        self.half_tolerance * (own + target.mean_contribution / magnitude)
    }
}

/// m_n of a force r^-beta.
fn growth(beta: f64, n: usize) -> f64 {
    let (factor, base) = if beta < 1.0 { (2.0, 0.5 * (beta + 1.0)) } else { (1.0, beta) };
    factor * (0..n).map(|i| (base + i as f64) / (i as f64 + 1.0)).product::<f64>()
}

/// m_(n+1) / m_n, which is not exceeded later: it falls for beta > 1 and stays below 1 elsewhere.
fn growth_ratio(beta: f64, n: usize) -> f64 {
    ((beta + n as f64) / (n as f64 + 1.0)).max(1.0)
}

fn binomial(n: usize, k: usize) -> f64 {
    if k > n { 0.0 } else { factorial(n) / (factorial(k) * factorial(n - k)) }
}
