//! What grains bring to the surface, by hit order: first hits against all hits.

use nalgebra::Vector3;

use super::{Sum, VectorSum};
use crate::scheme::{Observer, SurfaceHit};

/// All hits of one order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrderTally {
    /// How many.
    pub hits: u64,
    /// Energy brought along the normal, Σ ½ m v_n², J.
    pub normal: Sum,
    /// Energy brought along the surface, Σ ½ m v_t², J.
    pub tangential: Sum,
    /// Energy brought in rotation, Σ ½ I ω², J.
    pub spin: Sum,
}

impl OrderTally {
    /// Energy brought to the surface, J.
    #[must_use]
    pub fn energy(&self) -> f64 {
        [self.normal.value(), self.tangential.value(), self.spin.value()].into_iter().collect::<Sum>().value()
    }
}

/// Energy and impulse to the surface, by hit order.
#[derive(Clone, Debug, Default)]
pub struct SurfaceEnergy {
    orders: Vec<OrderTally>,
    impulse_normal: Sum,
    impulse_tangential: Sum,
    impulse_tangential_vector: VectorSum,
}

impl SurfaceEnergy {
    /// The tallies of order 1, 2, 3 and so on.
    #[must_use]
    pub fn by_order(&self) -> &[OrderTally] {
        &self.orders
    }

    /// Energy of the first hit of each grain, J: first-order energetics.
    #[must_use]
    pub fn first_hits(&self) -> f64 {
        self.orders.first().map_or(0.0, OrderTally::energy)
    }

    /// Energy of the second and later hits, J.
    #[must_use]
    pub fn repeated_hits(&self) -> f64 {
        self.orders.iter().skip(1).map(OrderTally::energy).collect::<Sum>().value()
    }

    /// Energy of all hits, J. The same energy counts again each time a grain brings it back.
    #[must_use]
    pub fn all_hits(&self) -> f64 {
        self.orders.iter().map(OrderTally::energy).collect::<Sum>().value()
    }

    /// Total normal impulse Σ J_n, N s.
    #[must_use]
    pub fn impulse_normal(&self) -> f64 {
        self.impulse_normal.value()
    }

    /// Total magnitude of the tangential impulses Σ |J_t|, N s.
    #[must_use]
    pub fn impulse_tangential(&self) -> f64 {
        self.impulse_tangential.value()
    }

    /// Total tangential impulse on the grains Σ J_t, N s.
    #[must_use]
    pub fn impulse_tangential_vector(&self) -> Vector3<f64> {
        self.impulse_tangential_vector.value()
    }
}

impl Observer for SurfaceEnergy {
    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let index = hit.order.saturating_sub(1) as usize;
        if index >= self.orders.len() {
            self.orders.resize(index + 1, OrderTally::default());
        }
        let tally = &mut self.orders[index];
        tally.hits += 1;
        tally.normal += hit.energy_normal;
        tally.tangential += hit.energy_tangential;
        tally.spin += hit.energy_spin;
        self.impulse_normal += hit.impulse_normal;
        self.impulse_tangential += hit.impulse_tangential.norm();
        self.impulse_tangential_vector += hit.impulse_tangential;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::fake_jet::FakeJet;

    /// A second, independent way to the totals.
    #[derive(Default)]
    struct Plain(Vec<SurfaceHit>);

    impl Observer for Plain {
        fn surface_hit(&mut self, hit: &SurfaceHit) {
            self.0.push(*hit);
        }
    }

    #[test]
    fn orders_add_up_to_the_totals() {
        let mut watched = (SurfaceEnergy::default(), Plain::default());
        FakeJet::default().run(&mut watched);
        let (energy, Plain(hits)) = watched;
        let total: f64 = hits.iter().map(SurfaceHit::energy).sum();
        let first: f64 = hits.iter().filter(|hit| hit.order == 1).map(SurfaceHit::energy).sum();
        assert!(energy.by_order().len() > 2);
        assert_eq!(energy.by_order().iter().map(|tally| tally.hits).sum::<u64>(), hits.len() as u64);
        approx::assert_relative_eq!(energy.all_hits(), total, max_relative = 1e-13);
        approx::assert_relative_eq!(energy.first_hits(), first, max_relative = 1e-13);
        approx::assert_relative_eq!(
            energy.first_hits() + energy.repeated_hits(),
            energy.all_hits(),
            max_relative = 1e-15
        );
        approx::assert_relative_eq!(
            energy.impulse_normal(),
            hits.iter().map(|hit| hit.impulse_normal).sum::<f64>(),
            max_relative = 1e-13
        );
    }

    #[test]
    fn opposite_tangential_impulses_cancel_as_vectors_only() {
        let mut energy = SurfaceEnergy::default();
        for x in [3.0, -3.0] {
            energy.surface_hit(&SurfaceHit { impulse_tangential: Vector3::new(x, 0.0, 0.0), ..FakeJet::hit(2) });
        }
        assert_eq!((energy.impulse_tangential(), energy.impulse_tangential_vector()), (6.0, Vector3::zeros()));
        assert_eq!((energy.by_order()[0].hits, energy.by_order()[1].hits), (0, 2));
    }
}
