//! The reference jets against programs that share nothing with this one.
//!
//! 2000 or 8000 grains of radius 0.01 m and density 8500 kg/m³ (`tests/data`) fly at 80 m/s straight down onto the plane z = 0, with
//! restitution 0.8 everywhere, until 0.06 s; smooth (case A) or with friction 0.4 (case B). After some thousand collisions rounding has
//! changed who meets whom, so only means over copies can be compared whose grains are displaced by up to 1e-8 m along each axis. The
//! mean m of n copies with standard deviation s agrees with the reference m', n', s' where
//!
//! |m - m'| ≤ 3 √(s² / n + s'² / n').
//!
//! Mean ± standard deviation over 64 copies of 2000 and 32 copies of 8000 grains, from
//! `cargo test --release --test jets -- --ignored --nocapture`:
//!
//! | | A, 2000 | A, 8000 | B, 2000 | B, 8000 |
//! |---|---|---|---|---|
//! | final kinetic energy / E0 | 0.4594 ± 0.0020 | 0.4718 ± 0.0006 | 0.1747 ± 0.0015 | 0.1860 ± 0.0006 |
//! | grain–grain collisions | 16 550 ± 181 | 233 172 ± 933 | 28 765 ± 367 | 514 984 ± 3101 |
//! | grain–surface collisions | 3 809 ± 38 | 25 111 ± 116 | 6 037 ± 67 | 58 410 ± 392 |
//! | energy to the surface / E0, first hits | 0.352 ± 0.007 | 0.218 ± 0.002 | 0.1512 ± 0.0027 | 0.0729 ± 0.0008 |
//! | energy to the surface / E0, all hits | 0.782 ± 0.007 | 0.968 ± 0.004 | 0.4877 ± 0.0031 | 0.6782 ± 0.0040 |
//!
//! The largest deviation from a reference was 1.8 standard deviations of the difference (A, 8000, final kinetic energy).
//!
//! The references: case A is from a plain event-driven program (binary heap, cells, stale events dropped), case B of 2000 grains from
//! `tests/data/rough_jet.py` (all pairs, NumPy), 8 copies each. Case B of 8000 grains has none but the table above: it guards against
//! change.

mod common;

use common::{FLOOR, run};
use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::observe::{Ledger, SurfaceEnergy};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{Collapse, EventDriven, Laws, Observer as _};
use impinge::source;
use impinge_events::Domain;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// End of the run, s.
const UNTIL: f64 = 0.06;
/// How far the grains of a copy are displaced along each axis, m.
const DISPLACEMENT: f64 = 1e-8;
/// Residuals of mass, momentum and energy, over the totals: what rounding may leave.
const LARGEST_RESIDUAL: f64 = 1e-12;
/// Deepest overlap at any event, over the radius.
const LARGEST_OVERLAP: f64 = 1e-9;
/// How far two means may lie apart, in standard deviations of their difference.
const DEVIATIONS: f64 = 3.0;

const SMOOTH: Friction = Friction::Smooth;
const ROUGH: Friction = Friction::Coulomb { static_: 0.4, dynamic: 0.4 };

/// What is compared.
const ROWS: [&str; 5] = [
    "final kinetic energy / E0",
    "grain-grain collisions",
    "grain-surface collisions",
    "energy to the surface / E0, first hits",
    "energy to the surface / E0, all hits",
];
type Rows<T> = [T; ROWS.len()];

/// Mean and standard deviation of each row over a number of copies.
struct Statistics {
    copies: u32,
    rows: Rows<(f64, f64)>,
}

const SMOOTH_2000: Statistics = Statistics {
    copies: 8,
    rows: [(0.4585, 0.0022), (16_614.0, 252.0), (3_824.0, 28.0), (0.352, 0.006), (0.784, 0.007)],
};
const SMOOTH_8000: Statistics = Statistics {
    copies: 8,
    rows: [(0.4714, 0.0006), (233_400.0, 780.0), (25_058.0, 121.0), (0.218, 0.002), (0.965, 0.006)],
};
const ROUGH_2000: Statistics = Statistics {
    copies: 8,
    rows: [(0.1747, 0.0014), (28_718.0, 555.0), (6_061.0, 103.0), (0.1510, 0.0020), (0.4878, 0.0026)],
};
/// No reference but what this program gave.
const ROUGH_8000: Statistics = Statistics {
    copies: 32,
    rows: [(0.1860, 0.0006), (514_984.0, 3_101.0), (58_410.0, 392.0), (0.0729, 0.0008), (0.6782, 0.0040)],
};

impl Statistics {
    fn of(copies: &[Rows<f64>]) -> Self {
        let n = copies.len() as f64;
        let rows = std::array::from_fn(|row| {
            let mean = copies.iter().map(|copy| copy[row]).sum::<f64>() / n;
            let squares = copies.iter().map(|copy| (copy[row] - mean).powi(2)).sum::<f64>();
            (mean, (squares / (n - 1.0)).sqrt())
        });
        Self { copies: copies.len() as u32, rows }
    }

    /// Fails where a mean is further from that of `reference` than [`DEVIATIONS`] standard deviations of their difference.
    fn must_agree_with(&self, reference: &Self) {
        for (name, (&(mean, s), &(expected, its_s))) in ROWS.iter().zip(self.rows.iter().zip(&reference.rows)) {
            let variance = s.powi(2) / f64::from(self.copies) + its_s.powi(2) / f64::from(reference.copies);
            let deviations = (mean - expected) / variance.sqrt();
            eprintln!("{name:40} {mean:12.5} ± {s:9.5}   reference {expected:10} ± {its_s:<7} {deviations:+.2}");
            assert!(
                deviations.abs() <= DEVIATIONS,
                "{name}: {mean} instead of {expected}, {deviations:+.2} deviations"
            );
        }
    }
}

/// The grains of a reference jet.
fn jet(count: u32) -> Vec<NewGrain> {
    let text = format!(
        r#"
        run.until = {UNTIL}
        domain = {{ min = [-10, -10, -1], max = [10, 10, 10] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "file", path = "tests/data/jet_{count}.csv" }}]
        "#
    );
    let scene: Scene = toml::from_str(&text).unwrap();
    source::place(&scene, env!("CARGO_MANIFEST_DIR").as_ref(), &|_, _| None).unwrap().grains
}

/// Runs one copy to its end, checks its ledger and gives its rows.
fn rows(grains: &[NewGrain], friction: Friction) -> Rows<f64> {
    let law = ContactLaw { restitution: 0.8, friction };
    let laws = Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::Elastic };
    let mut engine: EventDriven<_> = EventDriven::new(grains, FLOOR, Domain::unbounded(), laws, 0.0);
    let mut observer = (Ledger::default(), SurfaceEnergy::default());
    engine.snapshot(0.0, |snapshot| observer.sample(snapshot));
    run(&mut engine, UNTIL, &mut observer).expect("no broken invariant");
    engine.snapshot(UNTIL, |snapshot| observer.sample(snapshot));

    let (ledger, surface) = observer;
    assert_eq!(ledger.inside().count(), grains.len() as u64);
    assert!(ledger.relative_mass_residual().abs() <= LARGEST_RESIDUAL);
    assert!(ledger.relative_momentum_residual().abs() <= LARGEST_RESIDUAL);
    assert!(ledger.relative_energy_residual().abs() <= LARGEST_RESIDUAL);
    assert!(ledger.max_overlap_over_radius() <= LARGEST_OVERLAP);
    let (energy, counts) = (ledger.initial().energy(), ledger.counts());
    [
        ledger.inside().energy() / energy,
        counts.grain_grain as f64,
        counts.grain_surface as f64,
        surface.first_hits() / energy,
        surface.all_hits() / energy,
    ]
}

/// Runs `copies` of the jet of `count` grains.
fn sample(count: u32, friction: Friction, copies: u64) -> Statistics {
    let jet = jet(count);
    assert_eq!(jet.len(), count as usize);
    let copy = |seed| {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut any = || random.random_range(-DISPLACEMENT..DISPLACEMENT);
        let mut grains = jet.clone();
        grains.iter_mut().for_each(|grain| grain.position += Vector3::from_fn(|_, _| any()));
        rows(&grains, friction)
    };
    Statistics::of(&(0..copies).map(copy).collect::<Vec<_>>())
}

#[test]
fn smooth_jet_of_2000() {
    sample(2000, SMOOTH, 8).must_agree_with(&SMOOTH_2000);
}

#[test]
fn smooth_jet_of_8000() {
    sample(8000, SMOOTH, 8).must_agree_with(&SMOOTH_8000);
}

#[test]
fn rough_jet_of_2000() {
    sample(2000, ROUGH, 8).must_agree_with(&ROUGH_2000);
}

#[test]
fn rough_jet_of_8000() {
    sample(8000, ROUGH, 4).must_agree_with(&ROUGH_8000);
}

#[test]
#[ignore = "about 2 minutes: cargo test --release --test jets -- --ignored --nocapture"]
fn many_copies() {
    sample(2000, SMOOTH, 64).must_agree_with(&SMOOTH_2000);
    sample(8000, SMOOTH, 32).must_agree_with(&SMOOTH_8000);
    sample(2000, ROUGH, 64).must_agree_with(&ROUGH_2000);
    sample(8000, ROUGH, 32).must_agree_with(&ROUGH_8000);
}
