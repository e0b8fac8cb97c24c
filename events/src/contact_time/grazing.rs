//! Contacts that all but miss, in double length.
//!
//! |r + v t| = s has the root t = (r² - s²) / (-r·v + √G) with G = s² v² - |r × v|². A sphere that passes at the distance
//! m = s (1 - δ) has G = 2 δ s² v², the small difference of two large numbers. Rounding of v, of s, of r (which has been advanced to
//! a common time) or of the products changes it by some 2^-52 s² v² each, and its root by that over 2 √(2 δ): at δ = 1e-12 the
//! time is known to 1e-10 only, at δ = 1e-16 not even whether there is a contact. So all of them are carried in double length
//! here, from the stored states on, which are taken for exact.

use super::wide::{Wide, WideVector};

/// A contact is grazing when |G| is below this part of s² v²: when less than 5e-7 s is missing to a miss, or to a contact.
///
/// A single length then knows the root of G to 2e-13 of s v or better everywhere else, and one contact in a million is dear.
/// Consequence: what a single length makes of G must not be wrong by as much, which it is not up to some 1e8 s apart or 1e8 s
/// away from the origin. Beyond that, a contact may be missed that goes as deep as positions are rounded.
pub(super) const GRAZING: f64 = 1.0 / (1u64 << 20) as f64;

/// The interval after which |r + v t| = s; 0 where r² ≤ s²; `None` where G is less than `least` s² v².
///
/// r and v must approach each other. The result has all digits of a float, however small G is.
pub(super) fn interval(r: &WideVector, v: &WideVector, s_squared: Wide, least: f64) -> Option<f64> {
    // In units of length and speed near 1 nothing underflows, and as they are powers of two nothing is rounded.
    let (length, speed) = (near(s_squared.high.sqrt()), near(v.amax()));
    let (r, v) = (r.scaled(1.0 / length), v.scaled(1.0 / speed));
    let s_squared = s_squared * Wide::product(1.0 / length, 1.0 / length);

    let across = r.cross(&v);
    let most = s_squared * v.dot(&v);
    let reach = (most - across.dot(&across)).high;
    let separation = (r.dot(&r) - s_squared).high;
    let approach = -r.dot(&v).high;
    // Where nothing is left of v, all of these are NaN.
    (approach > 0.0 && reach >= least * most.high)
        .then(|| separation.max(0.0) / (approach + reach.sqrt()) * (length / speed))
}

/// A power of two near `x` > 0.
fn near(x: f64) -> f64 {
    2f64.powi(x.log2().floor() as i32)
}
