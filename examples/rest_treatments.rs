//! What becomes of grains that forces press together? Three treatments by energy and by cost, as docs/contacts-at-rest.md reports them.
//!
//! `cargo run --release --example rest_treatments` takes some twenty seconds; `-- --full` gives each run more time, and adds a pile of 300 grains.
//!
//! A column and a pile fall and come to rest under gravity, and grains that attract each other gather into a cluster. Energies are compared with those
//! of a run of the treatment in use in sub-steps an eighth as long. The cost is processor time over that of the treatment in use, in the same run of this
//! program.
#![expect(clippy::print_stdout, reason = "the table is what this program is for")]

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Duration;

use cpu_time::ProcessTime;
use impinge::grains::{NewGrain, kinetic_energy};
use impinge::law::{ContactLaw, Friction, NearField, Term};
use impinge::near_field::{ForceSum, Method};
use impinge::observe::Ledger;
use impinge::scene::{self, Interference, PlaneSurface};
use impinge::scheme::{AtRest, Collapse, EventDriven, Forces, Laws, Length, Substepped};
use impinge::surface::Surface;
use impinge_events::Domain;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};

/// m
const RADIUS: f64 = 0.01;
/// kg/m³
const DENSITY: f64 = 2500.0;
/// m/s²
const GRAVITY: f64 = 9.81;
/// Sub-step, s.
const STEP: f64 = 2e-4;

/// Something that comes to rest.
struct Case {
    name: &'static str,
    grains: Vec<NewGrain>,
    /// Half of the width of the box, m; none where there is no surface.
    side: Option<f64>,
    law: ContactLaw,
    /// m/s²
    gravity: f64,
    /// Attraction alpha / r², N m²; 0 for none.
    alpha: f64,
    /// s
    until: f64,
}

/// How a run went.
struct Outcome {
    /// When it ended, or was given up, s.
    time: f64,
    /// Energy of motion, of gravity and of attraction at the start and then, J.
    energy: [f64; 2],
    kinetic: f64,
    events: u64,
    overlap: f64,
    cost: Duration,
}

fn grain(position: Vector3<f64>, velocity: Vector3<f64>) -> NewGrain {
    NewGrain { position, velocity, spin: Vector3::zeros(), radius: RADIUS, density: DENSITY, strength: 1.0 }
}

/// Grains on a loose lattice of so many each way, shaken.
fn lattice(across: u32, up: u32, lowest: f64, shaken: f64) -> Vec<NewGrain> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let middle = 0.5 * f64::from(across - 1);
    (0..across * across * up)
        .map(|number| {
            let cell = Vector3::new(number % across, number / across % across, number / across / across);
            let place = cell.map(f64::from) - Vector3::new(middle, middle, 0.0);
            let velocity =
                Vector3::from_fn(|_, _| if shaken > 0.0 { random.random_range(-shaken..shaken) } else { 0.0 });
            grain(place * (2.2 * RADIUS) + Vector3::z() * lowest, velocity)
        })
        .collect()
}

fn cases(full: bool) -> Vec<Case> {
    let law = |restitution, mu| ContactLaw {
        restitution,
        friction: if mu > 0.0 { Friction::Coulomb { static_: mu, dynamic: mu } } else { Friction::Smooth },
    };
    let pile = |name, across, up, until| Case {
        name,
        grains: lattice(across, up, 1.2 * RADIUS, 0.3),
        side: Some(1.15 * RADIUS * f64::from(across)),
        law: law(0.3, 0.4),
        gravity: GRAVITY,
        alpha: 0.0,
        until,
    };
    let mut cases = vec![
        Case {
            name: "column of 10, e 0.3",
            grains: lattice(1, 10, 1.2 * RADIUS, 0.0),
            side: Some(2.0 * RADIUS),
            law: law(0.3, 0.0),
            gravity: GRAVITY,
            alpha: 0.0,
            until: 0.5,
        },
        pile("pile of 48, e 0.3", 4, 3, 0.6),
        Case {
            name: "cluster of 27, e 0.5",
            grains: lattice(3, 3, 0.0, 0.01),
            side: None,
            law: law(0.5, 0.3),
            gravity: 0.0,
            alpha: 2e-5,
            until: 1.0,
        },
    ];
    if full {
        cases.push(pile("pile of 300, e 0.3", 5, 12, 1.0));
    }
    cases
}

fn surface(side: Option<f64>) -> Result<Surface, Box<dyn Error>> {
    let plane = |point, normal| scene::Surface::Plane(PlaneSurface { point, normal, velocity: [0.0; 3] });
    let walls = side.map_or_else(Vec::new, |side| {
        vec![
            plane([0.0; 3], [0.0, 0.0, 1.0]),
            plane([-side, 0.0, 0.0], [1.0, 0.0, 0.0]),
            plane([side, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            plane([0.0, -side, 0.0], [0.0, 1.0, 0.0]),
            plane([0.0, side, 0.0], [0.0, -1.0, 0.0]),
        ]
    });
    Ok(Surface::new(&walls, ".".as_ref())?)
}

/// Follows a case until its end, or until it has taken `budget` of processor time.
fn run(case: &Case, at_rest: AtRest, step: f64, budget: Duration) -> Result<Outcome, Box<dyn Error>> {
    let laws =
        Laws { grain: case.law, surface: case.law, interference: Interference::All, collapse: Collapse::Elastic };
    let domain = Domain::unbounded();
    let engine = EventDriven::new(&case.grains, surface(case.side)?, domain, laws, 0.0);
    let attraction = NearField::new(Term { alpha: case.alpha, beta: 2.0 }, Term { alpha: 0.0, beta: 3.0 })?;
    let near_field = (case.alpha > 0.0).then(|| ForceSum::new(attraction, Method::Direct, &domain)).transpose()?;
    let forces = Forces { gravity: Vector3::z() * -case.gravity, near_field, contact_time: 0.0 };
    let mut run = Substepped::new(engine, forces, laws, Length::Fixed(step)).treating(at_rest);
    let (mut ledger, begin, mut last) = (Ledger::default(), ProcessTime::now(), (0.0, 0));
    let energy = |run: &Substepped<Surface>, ledger: &Ledger, time: f64| {
        let (kinetic, height) = run.engine().snapshot(time, |snapshot| {
            let all = || snapshot.flights.iter().zip(snapshot.grains);
            let kinetic: f64 = all().map(|(flight, grain)| kinetic_energy(flight, grain)).sum();
            let height: f64 = all().map(|(flight, grain)| grain.mass * case.gravity * flight.position.z).sum();
            (kinetic, height)
        });
        let attraction = ledger.forces().and_then(|forces| forces.potential_final()).unwrap_or_default();
        (kinetic, kinetic + height + attraction)
    };
    run.tell(0.0, &mut ledger)?;
    let initial = energy(&run, &ledger, 0.0).1;
    let flow = run.advance(case.until, &mut ledger, &mut |progress| {
        last = (progress.time, progress.collisions);
        if begin.elapsed() > budget { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    let time = if flow.is_break() { run.engine().time() } else { case.until };
    let cost = begin.elapsed();
    run.tell(time, &mut ledger)?;
    let (kinetic, last_energy) = energy(&run, &ledger, time);
    let overlap = ledger.max_overlap_over_radius();
    Ok(Outcome { time, energy: [initial, last_energy], kinetic, events: last.1, overlap, cost })
}

fn main() -> Result<(), Box<dyn Error>> {
    let full = std::env::args().any(|argument| argument == "--full");
    let budget = Duration::from_millis(if full { 60_000 } else { 2_000 });
    println!("energy: what has been dissipated, its error over that of the finer reference");
    println!("left: energy of motion at the end, over what has been dissipated\n");
    println!("{:<22}{:<12}{:>10}{:>10}{:>10}{:>10}{:>8}", "", "", "energy", "left", "overlap/r", "events", "cost");
    for case in cases(full) {
        let reference = run(&case, AtRest::Carried, STEP / 8.0, Duration::MAX)?;
        let [initial, end] = reference.energy;
        let mut unit = None;
        for at_rest in [AtRest::Carried, AtRest::Elastic, AtRest::Colliding] {
            let name = match at_rest {
                AtRest::Carried => "carried",
                AtRest::Elastic => "elastic",
                AtRest::Colliding => "TC model",
            };
            let outcome = run(&case, at_rest, STEP, budget);
            let Outcome { time, energy, kinetic, events, overlap, cost } = match outcome {
                Ok(outcome) => outcome,
                Err(broken) => {
                    println!("{:<22}{name:<12}  broke off: {broken}", case.name);
                    continue;
                }
            };
            let cost = cost.as_secs_f64() / *unit.get_or_insert(cost.as_secs_f64());
            if time < case.until {
                println!(
                    "{:<22}{name:<12}  did not end: {events} events in {time:.3} of {} s, after {cost:.0} times the cost",
                    case.name, case.until
                );
                continue;
            }
            let error = (energy[1] - end) / (initial - end);
            let left = kinetic / (initial - end);
            println!("{:<22}{name:<12}{error:>10.1e}{left:>10.0e}{overlap:>10.0e}{events:>10}{cost:>8.1}", case.name);
        }
    }
    Ok(())
}
