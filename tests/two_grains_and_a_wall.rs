//! Two grains in a line hit a wall: Mukherjee & Zohdi (2015), section 2.7, continued to its end.
//!
//! The paper stops after the second hit of grain 1 and calls that all collisions; the sequence goes on: [`Sequence`] is its closed form. Velocities
//! count towards the wall, both grains start with v0, a cycle is one wall hit of grain 1 and one grain–grain hit.

mod common;

use std::f64::consts::PI;
use std::slice;

use common::{FLOOR, Hit, Log, grain, kinetic_energy, run, smooth, states};
use impinge::scene::{self, Interference};
use impinge::scheme::{Collapse, EventDriven, Laws};
use impinge::study::reproduce::Sequence;
use impinge::surface::Surface;
use impinge_events::Domain;
use impinge_events::contact_time::STANDSTILL;
use nalgebra::Vector3;

/// How far the faster grain flies in a span, m. It grows in time as a collapsing pair slows down, to 1e270 s and beyond.
const SPAN: f64 = 2000.0;
/// Spans after which every sequence here is over.
const SPANS: u32 = 200;
const V0: f64 = 1.0;

/// What the engine makes of a sequence.
struct Played {
    log: Log,
    /// Velocities at the end, towards the wall, over v0.
    last: [f64; 2],
    /// Energy at the end over E0.
    energy: f64,
    /// Energy brought to the surface over E0.
    surface_energy: f64,
}

impl Played {
    fn counts(&self) -> (i32, i32) {
        (self.log.grain_hits() as i32, self.log.surface_hits() as i32)
    }
}

/// Energy brought to the surface, J.
fn surface_energy(log: &Log) -> f64 {
    log.0.iter().map(|hit| if let Hit::Surface(hit) = hit { hit.energy() } else { 0.0 }).sum()
}

fn scheme(sequence: &Sequence, radii: [f64; 2], laws: Laws) -> EventDriven<common::Plane> {
    let [r1, r2] = radii;
    let velocity = Vector3::z() * -V0;
    let (low, high) = (r1 + 0.3, 2.0 * r1 + r2 + 0.5);
    let grains =
        [grain(Vector3::z() * low, velocity, r1, sequence.m1), grain(Vector3::z() * high, velocity, r2, sequence.m2)];
    EventDriven::new(&grains, FLOOR, Domain::unbounded(), laws, 0.0)
}

fn laws(sequence: &Sequence) -> Laws {
    smooth(sequence.q, sequence.s)
}

fn play_with(sequence: &Sequence, radii: [f64; 2], laws: Laws, spans: u32) -> Played {
    let mut scheme = scheme(sequence, radii, laws);
    let mut log = Log::default();
    let mut states = states(&scheme, 0.0);
    for _ in 0..spans {
        let fastest = states.iter().map(|(flight, _)| flight.velocity.amax()).fold(0.0, f64::max);
        if fastest < STANDSTILL {
            break;
        }
        let until = scheme.time() + SPAN / fastest;
        run(&mut scheme, until, &mut log).unwrap_or_else(|broken| panic!("{sequence:?}: {broken}"));
        states = common::states(&scheme, until);
    }
    let e0 = 0.5 * (sequence.m1 + sequence.m2) * V0 * V0;
    let last = [0, 1].map(|i| -states[i].0.velocity.z / V0);
    let surface_energy = surface_energy(&log) / e0;
    Played { log, last, energy: kinetic_energy(&states) / e0, surface_energy }
}

fn play(sequence: &Sequence) -> Played {
    play_with(sequence, [0.5, 0.5], laws(sequence), SPANS)
}

fn equal(e: f64) -> Sequence {
    Sequence { s: e, q: e, m1: 1.0, m2: 1.0 }
}

/// The engine gives the hits and the final velocities of the closed form.
fn assert_closed_form(sequence: &Sequence, played: &Played) {
    if let (Some(n_pp), Some(n_wall)) = (sequence.grain_hits(), sequence.surface_hits()) {
        let (pairs, walls) = played.counts();
        assert_eq!(pairs, n_pp, "{sequence:?}");
        // Grain 1 may be left at rest exactly (s = 1/2, q = 1/10, m1 = 2.3 m2): then rounding decides whether it drifts to the wall.
        assert!(walls == n_wall || sequence.after(n_pp)[0].abs() < 1e-15, "{sequence:?}: {walls} wall hits");
    }
    for (got, exact) in played.last.iter().zip(sequence.last()) {
        assert!((got - exact).abs() < 1e-12, "{sequence:?}: {got} instead of {exact}");
    }
    assert!((played.surface_energy - sequence.surface_energy(i32::MAX)).abs() < 1e-12, "{sequence:?}");
}

/// Twenty restitutions each way, seven mass ratios, made by density and by radius.
#[test]
fn the_engine_plays_the_closed_form_on_a_grid() {
    let (mut sequences, mut collapses) = (0, 0);
    for (m1, m2) in [(1.0, 1.0), (4.0, 1.0), (1.0, 4.0), (1.0, 1.7), (2.3, 1.0), (1.0, 30.0), (1e3, 1.0)] {
        for i in 1..=20 {
            for j in 1..=20 {
                let sequence = Sequence { s: f64::from(i) / 20.0, q: f64::from(j) / 20.0, m1, m2 };
                let by_radius = [0.5, 0.5 * (m2 / m1).cbrt()];
                for radii in [[0.5, 0.5], by_radius] {
                    let played = play_with(&sequence, radii, laws(&sequence), SPANS);
                    assert_closed_form(&sequence, &played);
                }
                sequences += 1;
                collapses += i32::from(m1 == m2 && sequence.collapses());
            }
        }
    }
    assert_eq!((sequences, collapses), (2800, 23), "PHYSICS: 23 points of the equal-mass grid collapse");
}

/// PHYSICS section 4, the table: equal masses and restitutions.
#[test]
fn the_table_of_equal_grains() {
    // e, alpha_bar, alpha*, alpha_full, (N_pp, N_wall), surface energy: star, full. (PHYSICS rounds 0.645047 to 0.6451 and -0.232749 to -0.2328.)
    let table = [
        (0.05, 0.2238, 0.0985, -0.0025, None, 0.6256, 0.6568),
        (0.15, 0.1656, 0.0378, -0.0225, None, 0.6307, 0.6450),
        (0.20, 0.1344, 0.0046, -0.0400, Some((4, 5)), 0.6352, 0.6434),
        (0.25, 0.1025, -0.0298, -0.0624, Some((3, 3)), 0.6411, 0.6449),
        (0.30, 0.0705, -0.0646, -0.0886, Some((2, 3)), 0.6485, 0.6495),
        (0.40, 0.0084, -0.1329, -0.1462, Some((2, 2)), 0.6682, 0.6682),
        (0.50, -0.0469, -0.1934, -0.2000, Some((2, 2)), 0.6953, 0.6953),
        (0.80, -0.1116, -0.2326, -0.2327, Some((2, 2)), 0.8362, 0.8362),
        (1.00, 0.0, 0.0, 0.0, Some((1, 2)), 1.0, 1.0),
    ];
    // The table has four digits.
    let agrees = |got: f64, printed: f64| (got - printed).abs() <= 0.5001e-4;
    for (e, bar, star, full, counts, surface_star, surface_full) in table {
        let sequence = equal(e);
        let played = play(&sequence);
        assert_closed_form(&sequence, &played);
        if let Some(counts) = counts {
            assert_eq!(played.counts(), counts, "e = {e}");
        }
        let (energy_star, at_surface) = after_second_wall_hit(&sequence);
        let energy_bar = first_order_energy(&sequence);
        let alphas = [energy_bar, energy_star, played.energy].map(|energy| energy - e * e);
        for (alpha, printed) in alphas.into_iter().zip([bar, star, full]) {
            assert!(agrees(alpha, printed), "e = {e}: {alpha} instead of {printed}");
        }
        assert!(
            agrees(at_surface, surface_star) && agrees(played.surface_energy, surface_full),
            "e = {e}: {at_surface} {}",
            played.surface_energy
        );
    }
}

/// Energy over E0 after the second hit of grain 1, where the paper stops, and what came to the surface by then.
fn after_second_wall_hit(sequence: &Sequence) -> (f64, f64) {
    stopped_after(sequence, laws(sequence), 3)
}

/// Energy over E0 after the one hit of each grain that eq. (36) knows. Grain 2 still flies on, and towards the surface for
/// e < √2 - 1; its own first hit is no part of the formula.
fn first_order_energy(sequence: &Sequence) -> f64 {
    let laws = Laws { interference: Interference::FirstOrder, ..laws(sequence) };
    let (energy, surface_energy) = stopped_after(sequence, laws, 2);
    assert_eq!(surface_energy, sequence.m1 / (sequence.m1 + sequence.m2), "one hit at v0");
    energy
}

/// Runs until the given number of hits has happened and no more.
fn stopped_after(sequence: &Sequence, laws: Laws, hits: usize) -> (f64, f64) {
    let mut scheme = scheme(sequence, [0.5, 0.5], laws);
    let mut log = Log::default();
    let mut time = 0.0;
    while log.0.len() < hits {
        // The hits of interest are hundredths of a second apart, or more.
        time += 1e-3;
        run(&mut scheme, time, &mut log).expect("no broken invariant");
        assert!(time < 1e3, "{sequence:?}: only {log:?}");
    }
    assert_eq!(log.0.len(), hits);
    let e0 = 0.5 * (sequence.m1 + sequence.m2) * V0 * V0;
    (kinetic_energy(&states(&scheme, time)) / e0, surface_energy(&log) / e0)
}

/// Eq. (34) where it holds (row 2.15: grain 1 must return), for unequal masses; eq. (35) and (36) are its equal masses.
#[test]
fn the_paper_truncates_the_sequence_at_the_second_wall_hit() {
    let mut checked = 0;
    for (m1, m2) in [(1.0, 1.0), (4.0, 1.0), (1.0, 4.0), (1.0, 1.7)] {
        for (s, q) in [(0.2, 0.2), (0.3, 0.9), (0.9, 0.3), (0.5, 0.5), (0.8, 0.8), (0.95, 0.95)] {
            let sequence = Sequence { s, q, m1, m2 };
            if m2 * (1.0 + q * (1.0 + s)) > m1 * s {
                let (energy, _) = after_second_wall_hit(&sequence);
                assert!((energy - s * s - sequence.alpha_star()).abs() < 1e-14, "{sequence:?}: {energy}");
                checked += 1;
            }
            let bar = ((1.0 - s).powi(2) + (q * (1.0 + s)).powi(2)) / 4.0 - s * s;
            let star = (s * (1.0 - s + q + s * q)).powi(2) / 8.0 + (1.0 - s - q - s * q).powi(2) / 8.0 - s * s;
            if m1 == m2 {
                assert!((first_order_energy(&sequence) - s * s - bar).abs() < 1e-14, "eq. (36)");
                assert!((sequence.alpha_star() - star).abs() < 1e-14, "eq. (35)");
            }
        }
    }
    assert_eq!(checked, 20);
}

/// PHYSICS section 4: how far the truncated sequence is from the whole one on the grid of 20 by 20 restitutions, equal masses.
#[test]
fn truncation_errs_by_up_to_a_tenth_of_the_energy() {
    let (mut off_by_1e3, mut off_by_1e2, mut wrong_sign, mut worst) = (0, 0, 0, 0f64);
    for i in 1..=20 {
        for j in 1..=20 {
            let sequence = Sequence { s: f64::from(i) / 20.0, q: f64::from(j) / 20.0, m1: 1.0, m2: 1.0 };
            let star = sequence.alpha_star();
            let error = (star - sequence.alpha_full()).abs();
            assert!(sequence.alpha_full() <= 1e-15, "{sequence:?}: interference leaves more energy");
            off_by_1e3 += i32::from(error > 1e-3);
            off_by_1e2 += i32::from(error > 1e-2);
            wrong_sign += i32::from(star > 1e-15);
            worst = worst.max(error);
        }
    }
    assert_eq!((off_by_1e3, off_by_1e2, wrong_sign), (242, 119, 41));
    assert!((worst - 0.101).abs() < 0.0005, "{worst}");
}

/// Hard case 1, and the restitutions at which one more hit comes: e = y - √(y² - 1), y = 1 + 2 cos(pi / (N + 1)).
#[test]
fn one_more_hit_below_each_threshold() {
    for (hits, printed) in [(2, 0.26795), (3, 0.21685), (4, 0.19851), (5, 0.18959), (6, 0.18452)] {
        let y = 1.0 + 2.0 * (PI / f64::from(hits + 1)).cos();
        let e = y - (y * y - 1.0).sqrt();
        assert!((e - printed).abs() < 0.5e-5, "N = {hits}: {e}");
        assert_eq!(play(&equal(e * (1.0 + 1e-6))).counts().0, hits);
        assert_eq!(play(&equal(e * (1.0 - 1e-6))).counts().0, hits + 1);
    }
}

/// Hard case 2: infinitely many hits in finite time. The engine ends them when the grains are at rest, so nothing is left
/// undissipated; the surface gets what the closed form says.
#[test]
fn collapse_ends_at_rest_in_finitely_many_hits() {
    let outer = |m2: f64, e: f64| Sequence { s: e, q: e, m1: 1.0, m2 };
    for sequence in [equal(0.05), equal(0.15), equal(0.17), outer(4.0, 0.3), outer(4.0, 0.35), outer(0.25, 0.05)] {
        assert!(sequence.collapses());
        let played = play(&sequence);
        assert!(played.energy < 1e-300, "{sequence:?}: {} E0 are left", played.energy);
        assert!((played.surface_energy - sequence.surface_energy(i32::MAX)).abs() < 1e-14, "{sequence:?}");
        assert!(played.log.0.len() < 10_000, "{sequence:?}: {} hits", played.log.0.len());
    }
    assert!(!outer(4.0, 0.40).collapses() && !outer(0.25, 0.10).collapses(), "PHYSICS section 4");
}

/// Collapse comes in finite time: distances obey d_n (a_n - b_n) = (s q)^n d_0 (a_0 - b_0), so late hits lie beyond any resolution.
/// By t = 10 all motion but 1e-12 of the energy is gone.
#[test]
fn collapse_takes_finite_time() {
    for sequence in [equal(0.05), equal(0.15), Sequence { m2: 4.0, ..equal(0.3) }] {
        let mut scheme = scheme(&sequence, [0.5, 0.5], laws(&sequence));
        run(&mut scheme, 10.0, &mut ()).expect("no broken invariant");
        let states = states(&scheme, 10.0);
        assert!(kinetic_energy(&states) < 1e-12 * 0.5 * (sequence.m1 + sequence.m2));
        for (flight, touching) in states.iter().map(|(flight, _)| flight).zip([0.5, 1.5]) {
            assert!(
                (flight.position.z - touching).abs() < 1e-15,
                "{sequence:?}: the grains touch each other and the wall"
            );
        }
    }
}

/// Hard case 3: just above the restitution of collapse, 3 - 2√2 = 0.171573, the hits are many but finite, and a step too late or too
/// early would be told as collapse. Speeds fall to 1e-222 of v0.
#[test]
fn near_collapse_the_hits_are_counted_exactly() {
    for (e, hits) in [(0.1716, 148), (0.17158, 289)] {
        let sequence = equal(e);
        assert_eq!(sequence.grain_hits(), Some(hits));
        for radii in [[0.5, 0.5], [0.3, 0.7], [0.01, 0.01]] {
            let played = play_with(&sequence, radii, laws(&sequence), SPANS);
            assert_closed_form(&sequence, &played);
        }
    }
}

/// Hard case 4: with q = 1 equal grains exchange their velocities and then fly side by side, v_rel = 0 exactly or up to rounding;
/// a hit at t = 1e16 s would be a ghost.
#[test]
fn grains_side_by_side_never_meet() {
    for i in 0..=100 {
        let sequence = Sequence { s: f64::from(i) / 100.0, q: 1.0, m1: 1.0, m2: 1.0 };
        let played = play_with(&sequence, [0.5, 0.5], laws(&sequence), 10_000);
        assert_eq!(played.counts(), (1, 2), "{sequence:?}");
        assert!(played.last.iter().all(|v| (v + sequence.s).abs() < 1e-15), "{sequence:?}: {:?}", played.last);
    }
}

/// Restitution 0 is an ordinary value.
#[test]
fn plastic_hits() {
    for (m1, m2) in [(1.0, 1.0), (3.0, 1.0), (1.0, 3.0)] {
        for (s, q) in [(0.0, 0.0), (0.0, 0.4), (0.4, 0.0), (0.0, 1.0), (1.0, 0.0)] {
            let sequence = Sequence { s, q, m1, m2 };
            assert_closed_form(&sequence, &play(&sequence));
        }
    }
}

/// Where the line is oblique to the axes, rounding leaves a velocity across the line that no hit takes away: then an approach below it is
/// rounding, and the collapse ends there. No hang, no energy beyond rounding.
#[test]
fn collapse_on_a_tilted_wall() {
    let normal = Vector3::new(1.0, 2.0, 2.0) / 3.0;
    for e in [0.05, 0.15, 0.17, 0.1716] {
        let grains = [0.8, 2.0].map(|height| grain(normal * height, normal * -V0, 0.5, 1.0));
        let wall = common::Plane { normal, ..FLOOR };
        let mut scheme: EventDriven<_> = EventDriven::new(&grains, wall, Domain::unbounded(), smooth(e, e), 0.0);
        let mut log = Log::default();
        run(&mut scheme, 1e4, &mut log).expect("no broken invariant");
        assert!(kinetic_energy(&states(&scheme, 1e4)) < 1e-28, "e = {e}");
        assert!((surface_energy(&log) - equal(e).surface_energy(i32::MAX)).abs() < 1e-14, "e = {e}");
        assert!(log.0.len() < 10_000, "e = {e}: {} hits", log.0.len());
    }
}

/// At the smallest numbers a float can hold restitution rounds to 1: m2 = 4 m1, e = 0.3 then hit for ever at one moment.
#[test]
fn collapse_did_not_end_at_subnormal_speeds() {
    let sequence = Sequence { m2: 4.0, ..equal(0.3) };
    let played = play(&sequence);
    assert_eq!(played.energy, 0.0);
    assert!(played.last.iter().all(|v| v.abs() < STANDSTILL), "{:?}", played.last);
}

/// A grain a thousand times as heavy as the inner one needs more than a million hits to come to rest, too slowly for the treatment of
/// collapses to wait.
#[test]
fn a_long_collapse_was_told_as_a_jam() {
    let sequence = Sequence { m2: 1000.0, ..equal(0.05) };
    assert!(sequence.collapses());
    let laws = Laws { collapse: Collapse::None, ..laws(&sequence) };
    let mut scheme = scheme(&sequence, [0.5, 0.5], laws);
    run(&mut scheme, 1000.0, &mut ()).expect("no jam");
    assert!(kinetic_energy(&states(&scheme, 1000.0)) < 1e-12 * 0.5 * (sequence.m1 + sequence.m2));
}

/// So too on a wall of triangles.
#[test]
fn collapse_on_a_mesh_ends_at_rest() {
    let wall = scene::Surface::Rectangle(scene::RectangleSurface {
        centre: [0.1, 0.2, 0.0],
        normal: [0.0, 0.0, 1.0],
        along: [1.0, 0.0, 0.0],
        size: [3.0, 3.0],
        divisions: [1, 1],
        velocity: [0.0; 3],
    });
    for sequence in [equal(0.15), Sequence { m2: 4.0, ..equal(0.3) }] {
        let surface = Surface::new(slice::from_ref(&wall), ".".as_ref()).expect("a rectangle");
        let grains = [0.8, 2.0]
            .into_iter()
            .zip([sequence.m1, sequence.m2])
            .map(|(z, mass)| grain(Vector3::z() * z, Vector3::z() * -V0, 0.5, mass))
            .collect::<Vec<_>>();
        let mut scheme: EventDriven<_> = EventDriven::new(&grains, surface, Domain::unbounded(), laws(&sequence), 0.0);
        let mut log = Log::default();
        run(&mut scheme, 1e4, &mut log).expect("no broken invariant");
        let e0 = 0.5 * (sequence.m1 + sequence.m2);
        assert!(kinetic_energy(&states(&scheme, 1e4)) < 1e-28 * e0, "{sequence:?}");
        assert!((surface_energy(&log) / e0 - sequence.surface_energy(i32::MAX)).abs() < 1e-14, "{sequence:?}");
    }
}
