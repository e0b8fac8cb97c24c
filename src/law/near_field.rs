//! The near field: a central force between grains that do not touch.

use nalgebra::Vector3;

/// One term of the near field: a force alpha r^-beta along the line of centres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Force at a distance of 1 m, N m^beta.
    pub alpha: f64,
    /// How fast it fades; any real number from 0 on.
    pub beta: f64,
}

/// The near field of Arbelaez, Zohdi & Dornfeld (2009), eq. (3).
///
/// With n the unit vector from grain i to grain j at distance r, the force on i is (alpha1 r^-beta1 − alpha2 r^-beta2) n. The print labels
/// only the first term; with n from i to j alpha1 attracts and alpha2 repels, so that two grains are in equilibrium at
/// r = (alpha2/alpha1)^(1/(beta2 − beta1)).
///
/// ```
/// use impinge::law::{NearField, Term};
/// use nalgebra::Vector3;
///
/// let law = NearField::new(Term { alpha: 1.0, beta: 2.0 }, Term { alpha: 0.002, beta: 3.0 })?;
/// let apart = law.equilibrium().expect("attraction reaches further than repulsion"); // 2 mm
/// assert!(law.force(1.1 * apart) > 0.0, "grains further apart attract each other");
/// assert!(law.force(0.9 * apart) < 0.0, "closer ones repel each other");
/// assert_eq!(law.force_on(Vector3::new(0.0, 0.0, 0.1)).z, law.force(0.1));
/// # Ok::<(), impinge::law::InvalidTerm>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearField {
    attraction: Term,
    repulsion: Term,
    pub(crate) form: Form,
    potential: PotentialFactors,
}

/// A term that is no law.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("alpha must be finite and beta finite and not negative, not alpha = {}, beta = {}", .0.alpha, .0.beta)]
pub struct InvalidTerm(pub Term);

impl NearField {
    /// The law with these two terms.
    ///
    /// # Errors
    ///
    /// When a factor is not finite, or an exponent is negative or not finite.
    pub fn new(attraction: Term, repulsion: Term) -> Result<Self, InvalidTerm> {
        for term in [attraction, repulsion] {
            if !(term.alpha.is_finite() && term.beta.is_finite() && term.beta >= 0.0) {
                return Err(InvalidTerm(term));
            }
        }
        let form = Form::of([attraction, repulsion]);
        Ok(Self { attraction, repulsion, form, potential: PotentialFactors::of([attraction, repulsion]) })
    }

    /// What attracts: alpha1, beta1.
    #[must_use]
    pub fn attraction(&self) -> Term {
        self.attraction
    }

    /// What repels: alpha2, beta2.
    #[must_use]
    pub fn repulsion(&self) -> Term {
        self.repulsion
    }

    /// Force at distance `r` (m) towards the partner, N; negative where it repels.
    #[must_use]
    pub fn force(&self, r: f64) -> f64 {
        self.force_over_distance(r * r) * r
    }

    /// Force over distance, N/m, at the squared distance `r2` (m²): what the separation is multiplied with to give the force.
    #[must_use]
    pub fn force_over_distance(&self, r2: f64) -> f64 {
        with_radial!(self, radial => radial.over_distance(r2))
    }

    /// Force (N) on a grain whose partner is at `apart` (m) from it.
    #[must_use]
    pub fn force_on(&self, apart: Vector3<f64>) -> Vector3<f64> {
        apart * self.force_over_distance(apart.norm_squared())
    }

    /// Force (N) on a grain whose partner is at `apart` (m) from it and moves away at `velocity` (m/s), and the rate (N/s) at which it changes.
    ///
    /// ```
    /// use impinge::law::{NearField, Term};
    /// use nalgebra::Vector3;
    ///
    /// let law = NearField::new(Term { alpha: 1.0, beta: 2.0 }, Term { alpha: 0.5, beta: 3.0 })?;
    /// let (apart, velocity) = (Vector3::new(1.0, 0.5, 0.0), Vector3::new(0.3, 0.0, 1.0));
    /// let [force, rate] = law.force_and_rate_on(apart, velocity);
    /// assert_eq!(force, law.force_on(apart));
    /// let change = law.force_on(apart + velocity * 1e-6) - law.force_on(apart - velocity * 1e-6);
    /// assert!((rate - change / 2e-6).norm() < 1e-9);
    /// # Ok::<(), impinge::law::InvalidTerm>(())
    /// ```
    #[must_use]
    pub fn force_and_rate_on(&self, apart: Vector3<f64>, velocity: Vector3<f64>) -> [Vector3<f64>; 2] {
        let r2 = apart.norm_squared();
        let [attraction, repulsion] = with_radial!(self, radial => radial.terms(r2));
        let over_distance = attraction - repulsion;
        // d/dt alpha r^-(beta + 1) = -(beta + 1) alpha r^-(beta + 1) (r.v) / r²
        let fading = (self.attraction.beta + 1.0) * attraction - (self.repulsion.beta + 1.0) * repulsion;
        [apart * over_distance, velocity * over_distance - apart * (fading * apart.dot(&velocity) / r2)]
    }

    /// Potential energy of a pair at distance `r`, J; the force towards the partner is its derivative.
    ///
    /// A term with beta > 1 is zero at infinity. One with beta < 1 grows without bound there and is zero at r = 0; one with
    /// beta = 1 does both and is zero at r = 1 m.
    #[must_use]
    pub fn potential(&self, r: f64) -> f64 {
        with_radial!(self, radial => self.potential_at(radial, r * r))
    }

    /// The potential at the squared distance `r2` by way of `radial`, the form of this law.
    #[inline(always)]
    pub(crate) fn potential_at<R: Radial>(&self, radial: R, r2: f64) -> f64 {
        self.potential.power_law(radial, r2) + self.potential.logarithmic(r2)
    }

    /// What turns forces into potentials.
    pub(crate) fn potential_factors(&self) -> PotentialFactors {
        self.potential
    }

    /// Sum of the magnitudes of both terms over distance, N/m: what the errors of sums are measured against.
    #[inline(always)]
    pub(crate) fn magnitude_at<R: Radial>(radial: R, r2: f64) -> f64 {
        let [attraction, repulsion] = radial.terms(r2);
        attraction.abs() + repulsion.abs()
    }

    /// Magnitudes of attraction and repulsion at distance `r`, N.
    pub(crate) fn magnitudes(&self, r: f64) -> [f64; 2] {
        with_radial!(self, radial => radial.terms(r * r)).map(|term| term.abs() * r)
    }

    /// Sum of the magnitudes of both terms at distance `r`, N.
    #[must_use]
    pub fn magnitude(&self, r: f64) -> f64 {
        with_radial!(self, radial => Self::magnitude_at(radial, r * r)) * r
    }

    /// Distance at which attraction and repulsion balance, m; none where they never do.
    #[must_use]
    pub fn equilibrium(&self) -> Option<f64> {
        let ratio = self.repulsion.alpha / self.attraction.alpha;
        let distance = ratio.powf(1.0 / (self.repulsion.beta - self.attraction.beta));
        (distance.is_finite() && distance > 0.0).then_some(distance)
    }
}

/// The potential of a term is alpha r^(1 − beta) / (1 − beta) = r² (force / r) / (1 − beta), and alpha ln r for beta = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PotentialFactors {
    /// 1 / (1 − beta) of each term; 0 for a logarithm.
    powers: [f64; 2],
    /// Factor of ln r, N m.
    logarithm: f64,
}

impl PotentialFactors {
    fn of(terms: [Term; 2]) -> Self {
        let logarithm = |term: Term| if term.beta == 1.0 { term.alpha } else { 0.0 };
        Self {
            powers: terms.map(|term| if term.beta == 1.0 { 0.0 } else { 1.0 / (1.0 - term.beta) }),
            logarithm: logarithm(terms[0]) - logarithm(terms[1]),
        }
    }

    /// Whether there is a logarithm: they are slow, and seldom there.
    pub(crate) fn has_logarithm(self) -> bool {
        self.logarithm != 0.0
    }

    /// Potential of the terms that are powers, J.
    #[inline(always)]
    pub(crate) fn power_law<R: Radial>(self, radial: R, r2: f64) -> f64 {
        let [attraction, repulsion] = radial.terms(r2);
        r2 * (attraction * self.powers[0] - repulsion * self.powers[1])
    }

    /// Potential of the terms that are logarithms, J.
    #[inline(always)]
    pub(crate) fn logarithmic(self, r2: f64) -> f64 {
        if self.has_logarithm() { 0.5 * self.logarithm * r2.ln() } else { 0.0 }
    }
}

/// A law as a function of the squared distance, in a form that loops over many pairs are compiled for.
pub(crate) trait Radial: Copy + Send + Sync {
    /// Attraction and repulsion over distance, N/m, at the squared distance `r2`, m².
    fn terms(self, r2: f64) -> [f64; 2];

    /// Force over distance, N/m.
    #[inline(always)]
    fn over_distance(self, r2: f64) -> f64 {
        let [attraction, repulsion] = self.terms(r2);
        attraction - repulsion
    }
}

/// How the two powers of r are evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Form {
    /// Integers.
    Whole(Rooted<WholeExponents>),
    /// Integers and half-integers.
    Half(Rooted<HalfExponents>),
    /// Anything else, with `powf`.
    Real(RealPowers),
}

/// Runs an expression with the form of a law as a value of its own type.
macro_rules! with_radial {
    ($law:expr, $radial:ident => $body:expr) => {
        match $law.form {
            $crate::law::near_field::Form::Whole($radial) => $body,
            $crate::law::near_field::Form::Half($radial) => $body,
            $crate::law::near_field::Form::Real($radial) => $body,
        }
    };
}
pub(crate) use with_radial;

impl Form {
    fn of(terms: [Term; 2]) -> Self {
        let alpha = terms.map(|term| term.alpha);
        let terms = Self::without_absent(terms);
        match terms.map(halves) {
            [Some(a), Some(b)] if a % 2 == 0 && b % 2 == 0 => {
                Self::Whole(Rooted { alpha, exponents: WholeExponents([a, b]) })
            }
            [Some(a), Some(b)] => Self::Half(Rooted { alpha, exponents: HalfExponents([a, b]) }),
            // The powers of a system's library are slow, and may differ in the last bit from one system to the next.
            _ => Self::Real(RealPowers { alpha, exponents: terms.map(|term| -0.5 * (term.beta + 1.0)) }),
        }
    }

    /// A term that is zero takes the exponent of the other, so that it costs no powers of its own.
    fn without_absent([first, second]: [Term; 2]) -> [Term; 2] {
        if second.alpha == 0.0 {
            [first, first]
        } else if first.alpha == 0.0 {
            [second, second]
        } else {
            [first, second]
        }
    }
}

/// Exponents of r^(-1/2) below this are put together from square roots and products: those reach (r⁻²)^15 and a little more. A
/// term that fades faster than r^-30 takes `powf`.
const ROOTED: f64 = 64.0;

/// r^-(beta + 1) as a power of r^(-1/2), where that is a whole one and products reach it.
fn halves(term: Term) -> Option<u32> {
    let halves = 2.0 * (term.beta + 1.0);
    (halves.fract() == 0.0 && halves < ROOTED).then_some(halves as u32)
}

/// The exponents beta + 1 of r⁻¹, counted in halves.
pub(crate) trait Exponents: Copy + Send + Sync {
    /// Whether a half-integer may be among them, which takes a root more.
    const HALVES: bool;
    fn halves(self) -> [u32; 2];
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WholeExponents([u32; 2]);
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HalfExponents([u32; 2]);

impl Exponents for WholeExponents {
    const HALVES: bool = false;
    #[inline(always)]
    fn halves(self) -> [u32; 2] {
        self.0
    }
}

impl Exponents for HalfExponents {
    const HALVES: bool = true;
    #[inline(always)]
    fn halves(self) -> [u32; 2] {
        self.0
    }
}

/// Powers from one division, one or two square roots and products.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rooted<E> {
    alpha: [f64; 2],
    exponents: E,
}

impl<E: Exponents> Radial for Rooted<E> {
    #[inline(always)]
    fn terms(self, r2: f64) -> [f64; 2] {
        let inverse_square = 1.0 / r2;
        let inverse = inverse_square.sqrt();
        let root = if E::HALVES { inverse.sqrt() } else { 1.0 };
        let power = |halves: u32| {
            let whole = whole_power(inverse_square, halves / 4);
            let odd = if halves & 2 == 0 { 1.0 } else { inverse };
            let half = if E::HALVES && halves & 1 != 0 { root } else { 1.0 };
            whole * odd * half
        };
        let [first, second] = self.exponents.halves();
        [self.alpha[0] * power(first), self.alpha[1] * power(second)]
    }
}

/// `base` to a power below 16, without a branch that depends on the data, so that a loop over pairs stays a loop over vectors.
#[inline(always)]
fn whole_power(base: f64, exponent: u32) -> f64 {
    let mut power = if exponent & 1 == 0 { 1.0 } else { base };
    let mut square = base;
    for bit in 1..4 {
        square *= square;
        power *= if (exponent >> bit) & 1 == 0 { 1.0 } else { square };
    }
    power
}

/// Powers of the squared distance from the library of the system, whose last bits may differ from one to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RealPowers {
    alpha: [f64; 2],
    /// −(beta + 1) / 2.
    exponents: [f64; 2],
}

impl Radial for RealPowers {
    #[inline(always)]
    fn terms(self, r2: f64) -> [f64; 2] {
        [0, 1].map(|i| self.alpha[i] * r2.powf(self.exponents[i]))
    }
}
