//! How a force is taken to zero at its cut-off.

use super::CutOff;
use crate::law::NearField;
use crate::law::near_field::Radial;

/// Multiplies a force with S = 1 − 10 x³ + 15 x⁴ − 6 x⁵, where x runs from 0 to 1 over the switch: twice differentiable.
///
/// The force is switched, not the potential: it stays between the force of the law and zero. The potential is its integral from the
/// cut-off inwards, so that energy is conserved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Switch {
    /// Where the switch begins, m.
    start: f64,
    /// Where the force ends, m.
    end: f64,
    /// 1 / (end − start), 1/m.
    steepness: f64,
    /// Potential of the law where the switch begins, less that of the switched force, J.
    offset: f64,
}

/// Points of Gauss and Legendre on (0, 1) with their weights: ten on each side of the middle integrate the switched force, over at most half
/// the cut-off, to the last digits.
const GAUSS: [(f64, f64); 10] = [
    (0.076_526_521_133_497_34, 0.152_753_387_130_725_85),
    (0.227_785_851_141_645_08, 0.149_172_986_472_603_75),
    (0.373_706_088_715_419_56, 0.142_096_109_318_382_05),
    (0.510_867_001_950_827_1, 0.131_688_638_449_176_63),
    (0.636_053_680_726_515, 0.118_194_531_961_518_42),
    (0.746_331_906_460_150_8, 0.101_930_119_817_240_44),
    (0.839_116_971_822_218_8, 0.083_276_741_576_704_75),
    (0.912_234_428_251_326, 0.062_672_048_334_109_07),
    (0.963_971_927_277_913_8, 0.040_601_429_800_386_94),
    (0.993_128_599_185_094_9, 0.017_614_007_139_152_12),
];

impl Switch {
    pub(super) fn new(law: &NearField, cut_off: CutOff) -> Self {
        let start = cut_off.radius - cut_off.switch_width;
        let steepness = 1.0 / cut_off.switch_width;
        let mut switch = Self { start, end: cut_off.radius, steepness, offset: 0.0 };
        switch.offset = law.potential(start) - switch.potential(law, start);
        switch
    }

    /// S at distance `r` (m).
    #[inline(always)]
    pub(super) fn factor(self, r: f64) -> f64 {
        let x = ((r - self.start) * self.steepness).clamp(0.0, 1.0);
        1.0 - x * x * x * (10.0 - x * (15.0 - 6.0 * x))
    }

    /// Potential of the switched force at distance `r` (m), zero from the cut-off on, J.
    pub(super) fn potential(self, law: &NearField, r: f64) -> f64 {
        if r >= self.end {
            0.0
        } else if r < self.start {
            law.potential(r) - self.offset
        } else {
            -self.work_to_end(law, r)
        }
    }

    /// Integral of the switched force from `r` to the cut-off, J.
    fn work_to_end(self, law: &NearField, r: f64) -> f64 {
        let (middle, half) = (0.5 * (self.end + r), 0.5 * (self.end - r));
        let force = |at: f64| law.force(at) * self.factor(at);
        let pairs = GAUSS.iter().map(|&(x, weight)| weight * (force(middle - half * x) + force(middle + half * x)));
        half * pairs.sum::<f64>()
    }
}

/// A law with its switch.
#[derive(Clone, Copy)]
pub(super) struct Switched<R> {
    pub(super) radial: R,
    pub(super) switch: Switch,
}

impl<R: Radial> Radial for Switched<R> {
    #[inline(always)]
    fn terms(self, r2: f64) -> [f64; 2] {
        let factor = self.switch.factor(r2.sqrt());
        self.radial.terms(r2).map(|term| term * factor)
    }

    #[inline(always)]
    fn over_distance(self, r2: f64) -> f64 {
        self.radial.over_distance(r2) * self.switch.factor(r2.sqrt())
    }
}
