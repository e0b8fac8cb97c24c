//! Energy that a jet brings to the surface, in time: what figures 13 to 17 of Mukherjee & Zohdi (2015) are made of.

use super::jet::copies_of;
use super::{Energies, Error, Jet, Settings};
use crate::estimate::Estimate;
use crate::observe::{Ledger, SurfaceEnergy};
use crate::scheme::{Observer, SurfaceHit};

/// Width of a bin of time, s.
pub(super) const BIN: f64 = 1e-3;
/// While the jet arrives evenly, s: its first grains arrive at 1 ms (at 75° over all of its width at 11 ms), its last ones at 32 ms.
pub(super) const REGIME: [f64; 2] = [0.012, 0.030];

/// Sums of the energy of hits in bins of time.
#[derive(Debug, Default)]
struct Arrivals(Vec<Bin>);

/// Energy of the hits in one bin of time, J; in [`Arrived`] over E0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bin {
    /// All of it.
    pub(super) energy: f64,
    /// Along the normal.
    pub(super) normal: f64,
    /// Of hits that a collapse made elastic.
    pub(super) collapsed: f64,
}

impl Observer for Arrivals {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let index = (hit.time / BIN) as usize;
        if index >= self.0.len() {
            self.0.resize(index + 1, Bin::default());
        }
        let bin = &mut self.0[index];
        bin.energy += hit.energy();
        bin.normal += hit.energy_normal;
        bin.collapsed += if hit.withheld > 0.0 { hit.energy() } else { 0.0 };
    }
}

/// What one jet brought.
#[derive(Clone, Debug)]
pub(super) struct Arrival {
    pub(super) energies: Energies,
    bins: Vec<Bin>,
}

impl Arrival {
    /// What came between two times (s), over E0.
    pub(super) fn between(&self, [from, until]: [f64; 2], of: impl Fn(&Bin) -> f64) -> f64 {
        let index = |time: f64| ((time / BIN).round() as usize).min(self.bins.len());
        self.bins[index(from)..index(until)].iter().map(of).sum()
    }

    /// All of it, over E0.
    pub(super) fn total(&self, of: impl Fn(&Bin) -> f64) -> f64 {
        self.bins.iter().map(of).sum()
    }

    /// Power between two times over that at which the jet brings its energy: 1 if each grain hit once.
    pub(super) fn power(&self, jet: &Jet, [from, until]: [f64; 2], of: impl Fn(&Bin) -> f64) -> f64 {
        self.between([from, until], of) / (until - from) * jet.duration()
    }
}

/// Copies of a jet that differ in where its grains are, and what each of them brought.
#[derive(Clone, Debug)]
pub(super) struct Arrived {
    pub(super) jet: Jet,
    pub(super) copies: Vec<Arrival>,
}

impl Arrived {
    /// Mean over the copies.
    pub(super) fn mean(&self, of: impl Fn(&Arrival) -> f64) -> Estimate {
        Estimate::mean(&self.copies.iter().map(of).collect::<Vec<_>>())
    }

    /// Mean power while the jet arrives evenly.
    pub(super) fn regime(&self, of: impl Fn(&Bin) -> f64) -> Estimate {
        self.mean(|copy| copy.power(&self.jet, REGIME, &of))
    }

    /// Mean power in steps of so many bins, until a time (s).
    pub(super) fn history(&self, bins: u32, until: f64, of: impl Fn(&Bin) -> f64) -> Vec<(f64, Estimate)> {
        let width = f64::from(bins) * BIN;
        let steps = (until / width).round() as u32;
        let at = |step: u32| {
            let from = f64::from(step) * width;
            (from + 0.5 * width, self.mean(|copy| copy.power(&self.jet, [from, from + width], &of)))
        };
        (0..steps).map(at).collect()
    }
}

/// Runs so many copies of each jet.
pub(super) fn run_arrivals(
    jets: &[Jet],
    copies: impl Fn(&Jet) -> u64,
    settings: &Settings<'_>,
) -> Result<Vec<Arrived>, Error> {
    let of = |((ledger, surface), arrivals): ((Ledger, SurfaceEnergy), Arrivals)| {
        let e0 = ledger.energy_brought_in();
        let over = |bin: &Bin| Bin { energy: bin.energy / e0, normal: bin.normal / e0, collapsed: bin.collapsed / e0 };
        let bins = arrivals.0.iter().map(over).collect();
        Arrival { energies: Energies::of((ledger, surface)), bins }
    };
    let runs = copies_of(jets, copies, settings, Jet::scene, of)?;
    Ok(jets.iter().zip(runs).map(|(&jet, copies)| Arrived { jet, copies }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Interference;
    use crate::study::reproduce::ensemble::unwatched;

    #[test]
    fn bins_hold_what_the_run_brought_and_a_jet_without_interference_brings_its_energy_evenly() {
        let jet = Jet { grains: 2000, until: 0.1, ..Jet::reference() };
        let alone = Jet { interference: Interference::None, ..jet };
        let arrived = run_arrivals(&[jet, alone], |_| 3, &unwatched(true)).expect("they run");
        for copy in arrived.iter().flat_map(|arrived| &arrived.copies) {
            approx::assert_relative_eq!(copy.total(|bin| bin.energy), copy.energies.carried, max_relative = 1e-12);
        }
        let power = arrived[1].regime(|bin| bin.normal);
        assert!((power.value - 1.0).abs() < 0.03 && power.error < 0.03, "{power}");
        let history = arrived[0].history(5, 0.1, |bin| bin.energy);
        let sum: f64 = history.iter().map(|(_, power)| power.value * 5.0 * BIN / jet.duration()).sum();
        approx::assert_relative_eq!(sum, arrived[0].mean(|copy| copy.energies.carried).value, max_relative = 1e-12);
    }
}
