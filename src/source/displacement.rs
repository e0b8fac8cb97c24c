//! Starts that differ by almost nothing, to see how a small cause grows.

use impinge_events::Domain;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use crate::grains::NewGrain;

/// Moves every grain that a source gives a little aside.
///
/// Grains that touch must not overlap afterwards, so each also becomes smaller by what it may have moved; its mass stays.
#[derive(Clone, Debug)]
pub struct Displacement {
    radii: f64,
    random: Pcg64Mcg,
}

impl Displacement {
    /// By up to `radii` times the radius of each grain; far below 1.
    #[must_use]
    pub fn new(radii: f64, seed: u64) -> Self {
        Self { radii, random: Pcg64Mcg::seed_from_u64(seed) }
    }

    /// Moves the next grain; it stays inside the domain, and in the plane of a planar one.
    pub fn apply(&mut self, grain: &mut NewGrain, domain: &Domain) {
        // The corner of a cube of this side is `radii` away from its centre.
        let reach = self.radii * grain.radius / 3.0_f64.sqrt();
        let aside = Vector3::from_fn(|_, _| reach * self.random.random_range(-1.0..1.0));
        grain.position = (grain.position + aside).sup(&domain.min).inf(&domain.max);
        let shrunk = 1.0 - self.radii;
        grain.radius *= shrunk;
        grain.density /= shrunk.powi(3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grain(x: f64) -> NewGrain {
        let position = Vector3::new(x, 0.0, 0.0);
        NewGrain { position, velocity: Vector3::x(), spin: Vector3::y(), radius: 0.5, density: 3.0, strength: 1.0 }
    }

    #[test]
    fn grains_that_touch_do_not_overlap_afterwards_and_keep_their_mass() {
        let mut displacement = Displacement::new(1e-3, 7);
        for _ in 0..1000 {
            let mut pair = [grain(0.0), grain(1.0)];
            pair.iter_mut().for_each(|grain| displacement.apply(grain, &Domain::unbounded()));
            let distance = (pair[1].position - pair[0].position).norm();
            assert!(distance >= pair[0].radius + pair[1].radius, "{distance}");
            assert!((distance - 1.0).abs() <= 1e-3 && pair[0].position != Vector3::zeros());
            approx::assert_relative_eq!(pair[0].mass(), grain(0.0).mass(), max_relative = 1e-14);
        }
    }

    #[test]
    fn grains_stay_in_the_domain_and_in_its_plane() {
        let (min, max) = (Vector3::new(0.0, 0.0, -1.0), Vector3::new(1.0, 0.0, 1.0));
        let domain = Domain { min, max, periodic: false, planar: true };
        let mut displacement = Displacement::new(1e-3, 7);
        for _ in 0..100 {
            let mut edge = grain(0.0);
            displacement.apply(&mut edge, &domain);
            assert!(edge.position.x >= 0.0 && edge.position.y == 0.0 && edge.position.z != 0.0);
        }
    }

    #[test]
    fn the_same_seed_displaces_alike_and_another_does_not() {
        let moved = |seed| {
            let mut grain = grain(0.0);
            Displacement::new(1e-8, seed).apply(&mut grain, &Domain::unbounded());
            grain.position
        };
        assert_eq!(moved(1), moved(1));
        assert_ne!(moved(1), moved(2));
    }
}
