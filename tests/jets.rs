//! The reference jets against an independent event-driven program.
//!
//! 2000 or 8000 grains of radius 0.01 m and density 8500 kg/m³ (`tests/data`) fly at 80 m/s straight down onto the plane z = 0, with
//! restitution 0.8 everywhere, until 0.06 s; smooth (case A) or with friction 0.4 (case B).

use std::ops::ControlFlow;

use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::observe::{Ledger, SurfaceEnergy};
use impinge::scene::{Interference, Scene};
use impinge::scheme::{EventDriven, Laws, Observer as _};
use impinge::source;
use impinge::surface::Surface;
use impinge_events::Domain;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// End of the run, s.
const UNTIL: f64 = 0.06;
/// Copies differ by this much along each axis, m.
const PERTURBATION: f64 = 1e-8;
/// Residuals of mass, momentum and energy, over the totals: what rounding may leave.
const LARGEST_RESIDUAL: f64 = 1e-12;
/// Deepest overlap at any event, over the radius.
const LARGEST_OVERLAP: f64 = 1e-9;
/// How far two means may lie apart, in standard deviations of their difference.
const DEVIATIONS: f64 = 3.0;

/// What is compared, in the order of the tables.
const ROWS: [&str; 5] = [
    "final kinetic energy / E0",
    "grain-grain collisions",
    "grain-surface collisions",
    "energy to the surface / E0, first hits",
    "energy to the surface / E0, all hits",
];

/// Mean and standard deviation of each row over a number of copies.
struct Statistics {
    rows: [(f64, f64); ROWS.len()],
    copies: u32,
}

impl Statistics {
    fn of(copies: &[[f64; ROWS.len()]]) -> Self {
        let n = copies.len() as f64;
        let rows = std::array::from_fn(|row| {
            let mean = copies.iter().map(|copy| copy[row]).sum::<f64>() / n;
            let squares = copies.iter().map(|copy| (copy[row] - mean).powi(2)).sum::<f64>();
            (mean, (squares / (n - 1.0)).sqrt())
        });
        Self { rows, copies: copies.len() as u32 }
    }

    /// Fails where a mean is further from that of `reference` than [`DEVIATIONS`] standard deviations of their difference,
    /// √(s²/n + s'²/n').
    fn must_agree_with(&self, reference: &Self) {
        for (row, (&(mean, spread), &(expected, its_spread))) in ROWS.iter().zip(self.rows.iter().zip(&reference.rows))
        {
            let variance = spread.powi(2) / f64::from(self.copies) + its_spread.powi(2) / f64::from(reference.copies);
            let deviations = (mean - expected) / variance.sqrt();
            eprintln!(
                "{row:40} {mean:12.5} ± {spread:9.5}   reference {expected:10} ± {its_spread:<7} {deviations:+.2}"
            );
            assert!(
                deviations.abs() <= DEVIATIONS,
                "{row}: {mean} is {deviations:+.2} standard deviations from {expected}"
            );
        }
    }
}

/// Reads a reference jet.
fn jet(count: u32) -> Vec<NewGrain> {
    let scene: Scene = toml::from_str(&format!(
        r#"
        run.until = {UNTIL}
        domain = {{ min = [-10, -10, -1], max = [10, 10, 10] }}
        grain = {{ radius = 0.01, density = 8500.0 }}
        source = [{{ kind = "file", path = "tests/data/jet_{count}.csv" }}]
        "#
    ))
    .unwrap();
    let grains = source::place(&scene, env!("CARGO_MANIFEST_DIR").as_ref(), &|_, _| None).unwrap().grains;
    assert_eq!(grains.len(), count as usize);
    grains
}

fn floor() -> Surface {
    let plane = impinge::scene::PlaneSurface { point: [0.0; 3], normal: [0.0, 0.0, 1.0], velocity: [0.0; 3] };
    Surface::new(&[impinge::scene::Surface::Plane(plane)], ".".as_ref()).unwrap()
}

/// Runs one copy to its end, checks its ledger and gives its rows.
fn run(grains: &[NewGrain], friction: Friction) -> [f64; ROWS.len()] {
    let law = ContactLaw { restitution: 0.8, friction };
    let laws = Laws { grain: law, surface: law, interference: Interference::All };
    let mut engine: EventDriven<Surface> = EventDriven::new(grains, floor(), Domain::unbounded(), laws, 0.0);
    let mut observer = (Ledger::default(), SurfaceEnergy::default());
    engine.snapshot(0.0, |snapshot| observer.sample(snapshot));
    loop {
        let end = engine.epoch_end().min(UNTIL);
        let flow = engine.advance(end, &mut observer, &mut |_| ControlFlow::Continue(())).unwrap();
        assert!(flow.is_continue());
        if end == UNTIL {
            break;
        }
        engine.start_epoch();
    }
    engine.snapshot(UNTIL, |snapshot| observer.sample(snapshot));

    let (ledger, surface) = observer;
    assert_eq!(ledger.left().count(), 0);
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
fn sample(count: u32, friction: Friction, copies: u32) -> Statistics {
    let jet = jet(count);
    let copy = |seed| {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut any = || random.random_range(-PERTURBATION..PERTURBATION);
        let mut grains = jet.clone();
        grains.iter_mut().for_each(|grain| grain.position += Vector3::from_fn(|_, _| any()));
        run(&grains, friction)
    };
    Statistics::of(&(0..u64::from(copies)).map(copy).collect::<Vec<_>>())
}

const SMOOTH: Friction = Friction::Smooth;
const ROUGH: Friction = Friction::Coulomb { static_: 0.4, dynamic: 0.4 };

const INDEPENDENT_2000: Statistics = Statistics {
    rows: [(0.4585, 0.0022), (16_614.0, 252.0), (3_824.0, 28.0), (0.352, 0.006), (0.784, 0.007)],
    copies: 8,
};
const INDEPENDENT_8000: Statistics = Statistics {
    rows: [(0.4714, 0.0006), (233_400.0, 780.0), (25_058.0, 121.0), (0.218, 0.002), (0.965, 0.006)],
    copies: 8,
};

#[test]
fn smooth_jet_of_2000() {
    sample(2000, SMOOTH, 8).must_agree_with(&INDEPENDENT_2000);
}

#[test]
fn smooth_jet_of_8000() {
    sample(8000, SMOOTH, 8).must_agree_with(&INDEPENDENT_8000);
}

#[test]
fn probe_rough() {
    let a = sample(2000, ROUGH, 8);
    a.must_agree_with(&a);
    let a = sample(8000, ROUGH, 8);
    a.must_agree_with(&a);
}
