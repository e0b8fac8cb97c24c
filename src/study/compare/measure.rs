//! One run: what it comes to, and the time it takes.

use std::ops::ControlFlow;
use std::time::Instant;

use cpu_time::ProcessTime;
use impinge_events::Flight;
use nalgebra::Vector3;

use crate::grains::{Grain, Snapshot};
use crate::observe::{Ledger, SurfaceEnergy};
use crate::scene::Scene;
use crate::scheme::{Broken, Observer, Passage, Progress};
use crate::simulation::Simulation;
use crate::surface::Surface;

/// How often a run is asked whether its time is over, s: seldom enough that asking costs it nothing. A shorter budget is looked at as often as it is long.
const LOOK_AT_BUDGET: f64 = 5e-3;

/// What is compared of runs in which single grains cannot be compared.
pub const QUANTITIES: [&str; 7] = [
    "energy_first_hits",
    "energy_all_hits",
    "impulse_normal",
    "energy_final",
    "grain_grain",
    "grain_surface",
    "first_hits",
];

/// A number for each of [`QUANTITIES`].
pub type Quantities<T = f64> = [T; QUANTITIES.len()];

/// Where a grain is when the run ends, or where it would be had it not left the domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct End {
    /// m
    pub(super) position: Vector3<f64>,
    /// m/s
    pub(super) velocity: Vector3<f64>,
}

/// What a run comes to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Measured {
    /// Energies in J, impulse in N s, counts.
    pub(super) quantities: Quantities,
    /// The end of each grain, by its id; none of a grain that was removed.
    pub(super) ends: Vec<Option<End>>,
    /// Grains whose centre is behind a plane or inside a watertight mesh, at the end or when they left.
    pub(super) behind: u64,
    /// Deepest overlap at any event, over the smaller radius.
    pub(super) overlap: f64,
    /// Energy that is not accounted for, over that of the run; below 0 where the scheme made it.
    pub(super) energy_residual: f64,
    /// Mean radius of the grains, m.
    pub(super) radius: f64,
    /// Largest speed with which a grain started or entered, m/s.
    pub(super) speed: f64,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Ended {
    /// At its end.
    Done(Box<Measured>),
    /// On a broken invariant.
    Broken(Broken),
    /// It used up its time of the processor, and had come to `time` (s).
    OverBudget {
        /// Simulated time, s.
        time: f64,
    },
    /// Somebody stopped it.
    Interrupted,
}

/// Runs a scene that is ready to run, for `budget` seconds of the processor at the most; gives how it ended, and the seconds of the
/// processor that it took, set-up not included.
pub(super) fn run(
    simulation: &mut Simulation,
    scene: &Scene,
    surface: &Surface,
    budget: f64,
    watch: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> (Ended, f64) {
    let mut observer = ((Ledger::default(), SurfaceEnergy::default()), Ends::default());
    let (mut over_budget, mut looked) = (false, Instant::now());
    let processor = ProcessTime::now();
    let outcome = simulation.run(&mut observer, &mut |progress| {
        if watch(&progress).is_break() {
            return ControlFlow::Break(());
        }
        if looked.elapsed().as_secs_f64() < LOOK_AT_BUDGET.min(budget) {
            return ControlFlow::Continue(());
        }
        looked = Instant::now();
        over_budget = processor.elapsed().as_secs_f64() > budget;
        if over_budget { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let cpu_seconds = processor.elapsed().as_secs_f64();
    let ended = match outcome {
        Err(broken) => Ended::Broken(broken),
        Ok(outcome) if outcome.interrupted && over_budget => Ended::OverBudget { time: outcome.time },
        Ok(outcome) if outcome.interrupted => Ended::Interrupted,
        Ok(_) => {
            let ((ledger, energy), ends) = &observer;
            Ended::Done(Box::new(Measured::new(scene, surface, ledger, energy, ends)))
        }
    };
    (ended, cpu_seconds)
}

impl Measured {
    fn new(scene: &Scene, surface: &Surface, ledger: &Ledger, energy: &SurfaceEnergy, ends: &Ends) -> Self {
        let counts = ledger.counts();
        let until = scene.run.until;
        let mut measured = Self {
            quantities: [
                energy.first_hits(),
                energy.all_hits(),
                energy.impulse_normal(),
                ledger.inside().energy(),
                counts.grain_grain as f64,
                counts.grain_surface as f64,
                counts.first_hits as f64,
            ],
            ends: Vec::new(),
            behind: 0,
            overlap: ledger.max_overlap_over_radius(),
            energy_residual: ledger.relative_energy_residual(),
            radius: ends.radii / ends.came_in.max(1) as f64,
            speed: ends.fastest,
        };
        for (id, time, flight) in ends.left.iter().chain(&ends.inside) {
            let place = *id as usize;
            if place >= measured.ends.len() {
                measured.ends.resize(place + 1, None);
            }
            let onwards = flight.velocity * (until - time);
            measured.ends[place] = Some(End { position: flight.position + onwards, velocity: flight.velocity });
            let overlap = surface.overlaps(flight.position, flight.radius, time - scene.run.start);
            measured.behind += u64::from(overlap.is_some_and(|(_, depth)| depth > flight.radius));
        }
        measured
    }

    /// Largest initial speed; where all grains start at rest the largest final one, m/s. Above 0.
    pub(super) fn speed_scale(&self) -> f64 {
        let finally = || self.ends.iter().flatten().map(|end| end.velocity.norm()).fold(0.0, f64::max);
        let speed = if self.speed > 0.0 { self.speed } else { finally() };
        if speed > 0.0 { speed } else { 1.0 }
    }
}

/// Keeps where grains are at the end and where they left: id, time (s) and flight.
#[derive(Default)]
struct Ends {
    left: Vec<(u64, f64, Flight)>,
    inside: Vec<(u64, f64, Flight)>,
    begun: bool,
    came_in: u64,
    /// Sum of the radii of all grains that came in, m.
    radii: f64,
    /// m/s
    fastest: f64,
}

impl Ends {
    fn comes_in(&mut self, flight: &Flight) {
        self.came_in += 1;
        self.radii += flight.radius;
        self.fastest = self.fastest.max(flight.velocity.norm());
    }
}

impl Observer for Ends {
    fn passage(&mut self, passage: Passage, time: f64, flight: &Flight, grain: &Grain) {
        match passage {
            Passage::Entered if self.begun => self.comes_in(flight),
            Passage::Left => self.left.push((grain.id, time, *flight)),
            Passage::Entered | Passage::Removed => {}
        }
    }

    fn sample(&mut self, snapshot: &Snapshot<'_>) {
        if !self.begun {
            snapshot.flights.iter().for_each(|flight| self.comes_in(flight));
            self.begun = true;
        }
        self.inside.clear();
        let grains = snapshot.grains.iter().zip(snapshot.flights);
        self.inside.extend(grains.map(|(grain, flight)| (grain.id, snapshot.time, *flight)));
    }
}
