//! The engine against an all-pairs twin, event by event and bit by bit: no cells, no calendar, no index, no clever order.

use std::ops::ControlFlow;

use impinge::grains::NewGrain;
use impinge::law::{Body, ContactLaw, Friction, resolve_pair, resolve_surface};
use impinge::scene::{self, Interference};
use impinge::scheme::{Collapse, EventDriven, GrainCollision, Laws, Observer, SurfaceHit};
use impinge::surface::Surface;
use impinge_events::calendar::{Buckets, Calendar, PlainCalendar};
use impinge_events::contact_time::sphere_sphere;
use impinge_events::{Domain, Flight, Outlook, Surface as _};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// What happened: time, ids (the second one an element of the surface where the flag is set), impulse.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Happening {
    time: f64,
    surface: bool,
    ids: [u64; 2],
    impulse: f64,
}

#[derive(Default)]
struct Log(Vec<Happening>);

impl Observer for Log {
    fn grain_collision(&mut self, c: &GrainCollision) {
        self.0.push(Happening { time: c.time, surface: false, ids: c.ids, impulse: c.impulse_normal });
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        let ids = [hit.id, u64::from(hit.element)];
        self.0.push(Happening { time: hit.time, surface: true, ids, impulse: hit.impulse_normal });
    }
}

/// The twin. Meeting times are kept for all pairs and all images, and made anew for whoever has been deflected.
struct Twin {
    flights: Vec<Flight>,
    bodies: Vec<Body>,
    inside: Vec<bool>,
    pairs: Vec<Vec<f64>>,
    sides: Vec<(f64, Option<u32>)>,
    surface: Surface,
    domain: Domain,
    laws: Laws,
    epoch_start: f64,
    epoch: f64,
    /// Largest speed along an axis at the start of the epoch.
    fastest: f64,
    /// Time that has been reached, and until which `pairs` holds; epoch time.
    now: f64,
    known_until: f64,
}

impl Twin {
    fn new(grains: &[NewGrain], surface: Surface, domain: Domain, laws: Laws) -> Self {
        let n = grains.len();
        let flight = |g: &NewGrain| Flight { position: g.position, time: 0.0, velocity: g.velocity, radius: g.radius };
        let body = |g: &NewGrain| Body { mass: g.mass(), radius: g.radius, velocity: g.velocity, spin: g.spin };
        let mut twin = Self {
            flights: grains.iter().map(flight).collect(),
            bodies: grains.iter().map(body).collect(),
            inside: vec![true; n],
            pairs: vec![vec![f64::INFINITY; n]; n],
            sides: vec![(f64::INFINITY, None); n],
            surface,
            domain,
            laws,
            epoch_start: 0.0,
            epoch: 0.0,
            fastest: 0.0,
            now: 0.0,
            known_until: 0.0,
        };
        twin.start_epoch(0.0);
        twin
    }

    /// Earliest meeting over the images that two grains can reach until `known_until`: the nearest one now and those around it.
    fn meeting(&self, i: usize, j: usize) -> f64 {
        if !self.domain.periodic {
            return sphere_sphere(&self.flights[i], &self.flights[j], Vector3::zeros()).unwrap_or(f64::INFINITY);
        }
        let extent = self.domain.extent();
        let apart = self.flights[j].position_at(self.now) - self.flights[i].position_at(self.now);
        let deep = if self.domain.planar { 0 } else { 1 };
        let mut first = f64::INFINITY;
        for x in -1..=1 {
            for y in -deep..=deep {
                for z in -1..=1 {
                    let step = [x, y, z];
                    let shift = Vector3::from_fn(|axis, _| {
                        let nearest = if extent[axis] > 0.0 { -(apart[axis] / extent[axis]).round() } else { 0.0 };
                        let periods = nearest + f64::from(step[axis]);
                        if periods == 0.0 { 0.0 } else { periods * extent[axis] }
                    });
                    if let Some(time) = sphere_sphere(&self.flights[i], &self.flights[j], shift) {
                        first = first.min(time);
                    }
                }
            }
        }
        first
    }

    /// Predicts everything for as long as no grain flies further than a fifth of a period.
    fn look_ahead(&mut self) {
        let fastest = self.flights.iter().map(|flight| flight.velocity.norm()).fold(1e-300, f64::max);
        let shortest =
            self.domain.extent().iter().copied().filter(|&length| length > 0.0).fold(f64::INFINITY, f64::min);
        self.known_until = if self.domain.periodic { self.now + 0.2 * shortest / fastest } else { f64::INFINITY };
        for i in 0..self.flights.len() {
            self.predict(i);
        }
    }

    fn predict(&mut self, i: usize) {
        for j in 0..self.flights.len() {
            let time = if i != j && self.inside[i] && self.inside[j] { self.meeting(i, j) } else { f64::INFINITY };
            self.pairs[i][j] = time;
            self.pairs[j][i] = time;
        }
        self.sides[i] = (f64::INFINITY, None);
        if !self.inside[i] {
            return;
        }
        let flight = self.flights[i];
        if !self.domain.periodic {
            for axis in [0, 1, 2] {
                let (x, v) = (flight.position[axis], flight.velocity[axis]);
                let side = if v > 0.0 { self.domain.max[axis] } else { self.domain.min[axis] };
                let time = flight.time + ((side - x) / v).max(0.0);
                if v != 0.0 && time < self.sides[i].0 && !(self.domain.planar && axis == 1) {
                    self.sides[i] = (time, None);
                }
            }
        }
        if let Outlook::Hit { time, element } = self.surface.first_contact(&flight, f64::INFINITY)
            && time <= self.sides[i].0
        {
            self.sides[i] = (time, Some(element));
        }
    }

    fn start_epoch(&mut self, duration: f64) {
        self.surface.start_epoch(duration);
        self.epoch_start += duration;
        for flight in &mut self.flights {
            *flight = flight.advanced_to(duration);
            flight.time = 0.0;
            self.domain.wrap(&mut flight.position);
        }
        // 4096 times the time in which the fastest moves by the smallest radius, rounded down to a power of two.
        let inside = || self.flights.iter().zip(&self.inside).filter(|(_, inside)| **inside).map(|(flight, _)| flight);
        let smallest = inside().map(|flight| flight.radius).fold(f64::INFINITY, f64::min);
        self.fastest = inside().map(|flight| flight.velocity.amax()).fold(self.surface.speed(), f64::max);
        self.epoch = 2f64.powi((4096.0 * smallest / self.fastest).log2().floor().min(1000.0) as i32);
        self.now = 0.0;
        self.look_ahead();
    }

    /// Everything up to `end` (simulated time), through as many epochs as it takes.
    fn advance(&mut self, end: f64, log: &mut Log) {
        loop {
            let epoch_end = self.epoch_start + self.epoch;
            let until = if end < epoch_end { end - self.epoch_start } else { self.epoch };
            if !self.step(until, log) {
                if end <= epoch_end {
                    return;
                }
                self.start_epoch(self.epoch);
            }
        }
    }

    /// The next event at or before `end` (epoch time): (time, kind, ids) decides.
    fn step(&mut self, end: f64, log: &mut Log) -> bool {
        let n = self.flights.len();
        let mut first = (f64::INFINITY, 9, 0, 0);
        for i in 0..n {
            for j in i + 1..n {
                let event = (self.pairs[i][j], 0, i, j);
                if event < first {
                    first = event;
                }
            }
            let (time, element) = self.sides[i];
            let event = (time, if element.is_some() { 1 } else { 2 }, i, element.unwrap_or(0) as usize);
            if event < first {
                first = event;
            }
        }
        let (time, kind, i, j) = first;
        if time > end.min(self.known_until) {
            if self.known_until >= end {
                return false;
            }
            self.now = self.known_until;
            self.look_ahead();
            return true;
        }
        self.now = time;
        for moved in [Some(i), (kind == 0).then_some(j)].into_iter().flatten() {
            self.flights[moved] = self.flights[moved].advanced_to(time);
            self.domain.wrap(&mut self.flights[moved].position);
        }
        let happened =
            |surface, impulse| Happening { time: self.epoch_start + time, surface, ids: [i as u64, j as u64], impulse };
        match kind {
            0 => {
                let apart = self.domain.nearest(self.flights[j].position - self.flights[i].position);
                let contact = resolve_pair(&self.laws.grain, &self.bodies[i], &self.bodies[j], apart / apart.norm());
                log.0.push(happened(false, contact.impulse.normal));
                [self.bodies[i], self.bodies[j]] = contact.after;
                self.flights[i].velocity = self.bodies[i].velocity;
                self.flights[j].velocity = self.bodies[j].velocity;
                self.predict(i);
                self.predict(j);
            }
            1 => {
                let contact = self.surface.contact(j as u32, &self.flights[i]);
                let hit = resolve_surface(&self.laws.surface, &self.bodies[i], contact.normal, contact.velocity);
                log.0.push(happened(true, hit.impulse.normal));
                self.bodies[i] = hit.after;
                self.flights[i].velocity = hit.after.velocity;
                self.predict(i);
            }
            _ => {
                self.inside[i] = false;
                self.predict(i);
            }
        }
        // A grain that becomes eight times as fast as the fastest was ends the epoch.
        if [i, if kind == 0 { j } else { i }].iter().any(|&k| self.flights[k].velocity.amax() > 8.0 * self.fastest) {
            self.start_epoch(time);
        }
        true
    }
}

struct Case {
    grains: Vec<NewGrain>,
    surface: Vec<scene::Surface>,
    domain: Domain,
    laws: Laws,
}

/// Grains at random places of `domain` that do not overlap.
fn scatter(
    random: &mut Pcg64,
    domain: &Domain,
    count: usize,
    radius: impl Fn(&mut Pcg64) -> f64,
    speed: f64,
) -> Vec<NewGrain> {
    let mut grains: Vec<NewGrain> = Vec::new();
    while grains.len() < count {
        let radius = radius(random);
        let flat = |v: Vector3<f64>| if domain.planar { Vector3::new(v.x, 0.0, v.z) } else { v };
        let any = |random: &mut Pcg64| Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        let margin = if domain.periodic { 0.0 } else { 1.1 * radius };
        let position = flat(Vector3::from_fn(|axis, _| {
            let (low, high) = (domain.min[axis] + margin, domain.max[axis] - margin);
            if low < high { random.random_range(low..high) } else { 0.0 }
        }));
        let free = |g: &NewGrain| domain.nearest(g.position - position).norm() > 1.001 * (g.radius + radius);
        if grains.iter().all(free) {
            let spin = if domain.planar { Vector3::new(0.0, any(random).y, 0.0) } else { any(random) } / radius;
            grains.push(NewGrain {
                position,
                velocity: flat(any(random)) * speed,
                spin,
                radius,
                density: 1.0,
                strength: 1.0,
            });
        }
    }
    grains
}

fn laws(e: f64, friction: Friction) -> Laws {
    let law = ContactLaw { restitution: e, friction };
    Laws { grain: law, surface: law, interference: Interference::All, collapse: Collapse::None }
}

const ROUGH: Friction = Friction::Coulomb { static_: 0.4, dynamic: 0.3 };

/// Runs engine and twin side by side until `events` have happened or `until` is reached; gives the number of events.
fn compare<C: Calendar>(case: &Case, until: f64, events: usize) -> usize {
    let surface = || Surface::new(&case.surface, "examples".as_ref()).unwrap();
    let mut engine: EventDriven<Surface, C> = EventDriven::new(&case.grains, surface(), case.domain, case.laws, 0.0);
    let mut twin = Twin::new(&case.grains, surface(), case.domain, case.laws);
    let (mut seen, mut expected) = (Log::default(), Log::default());
    while engine.time() < until && expected.0.len() < events {
        // Looking often must not change anything.
        let time = (engine.time() + 0.7).min(until);
        let flow = engine.advance(time, &mut seen, &mut |_| ControlFlow::Continue(())).unwrap();
        assert!(flow.is_continue());
        twin.advance(time, &mut expected);
        let differ = |k: &usize| seen.0.get(*k) != expected.0.get(*k);
        if let Some(wrong) = (0..seen.0.len().max(expected.0.len())).find(differ) {
            panic!("event {wrong}: engine {:?}, twin {:?}", seen.0.get(wrong), expected.0.get(wrong));
        }
    }
    expected.0.len()
}

fn cube(half: f64, periodic: bool, planar: bool) -> Domain {
    let mut corner = Vector3::repeat(half);
    if planar {
        corner.y = 0.0;
    }
    Domain { min: -corner, max: corner, periodic, planar }
}

fn mesh_floor() -> Vec<scene::Surface> {
    let text = r#"
        surface = [
            { kind = "sine", centre = [0, 0, -1.5], size = [6, 6], amplitude = 0.3, wavelength = 1.0, pieces = 8 },
            { kind = "rectangle", centre = [0, 0, 1.9], normal = [0, 0, -1], along = [1, 0, 0], size = [3, 3], divisions = [4, 4], velocity = [0, 0, -0.01] },
            { kind = "plane", point = [1.99, 0, 0], normal = [-1, 0, 0], velocity = [0, 0, -0.5] },
        ]"#;
    #[derive(serde::Deserialize)]
    struct Only {
        surface: Vec<scene::Surface>,
    }
    toml::from_str::<Only>(text).unwrap().surface
}

#[test]
fn periodic_gas_of_unequal_rough_grains() {
    let mut random = Pcg64::seed_from_u64(1);
    let domain = cube(2.0, true, false);
    let grains = scatter(&mut random, &domain, 40, |r| r.random_range(0.1..0.45), 1.0);
    let case = Case { grains, surface: vec![], domain, laws: laws(1.0, ROUGH) };
    assert!(compare::<Buckets>(&case, 1e9, 3000) >= 3000);
    let case = Case { laws: laws(0.9, Friction::Smooth), ..case };
    assert!(compare::<PlainCalendar>(&case, 1e9, 1500) >= 1500);
}

#[test]
fn planar_periodic_gas() {
    let mut random = Pcg64::seed_from_u64(2);
    let domain = cube(3.0, true, true);
    let grains = scatter(&mut random, &domain, 30, |r| r.random_range(0.2..0.5), 1.0);
    let case = Case { grains, surface: vec![], domain, laws: laws(0.99, ROUGH) };
    assert!(compare::<Buckets>(&case, 1e9, 1000) >= 1000);
}

#[test]
fn open_domain_with_meshes_and_moving_planes() {
    let mut events = 0;
    for seed in 0..24 {
        let mut random = Pcg64::seed_from_u64(seed);
        let domain = cube(2.0, false, false);
        let inner = Domain { min: Vector3::new(-1.9, -1.9, -1.0), max: Vector3::new(1.9, 1.9, 1.8), ..domain };
        let grains = scatter(&mut random, &inner, 60, |r| r.random_range(0.05..0.3), 1.0);
        let case = Case { grains, surface: mesh_floor(), domain, laws: laws(0.8, ROUGH) };
        events += if seed % 2 == 0 {
            compare::<Buckets>(&case, 20.0, 10_000)
        } else {
            compare::<PlainCalendar>(&case, 20.0, 10_000)
        };
    }
    assert!(events > 2000, "{events} events are too few to mean something");
}

/// Hard case 15: sizes 1 : 100, masses 1 : 1e6, in a small periodic box.
#[test]
fn sizes_one_to_a_hundred() {
    hundredfold(4_000);
}

#[test]
#[ignore = "about 2 minutes: cargo test --release --test twin -- --ignored"]
fn sizes_one_to_a_hundred_for_1e5_events() {
    hundredfold(100_000);
}

fn hundredfold(events: usize) {
    let mut random = Pcg64::seed_from_u64(15);
    let domain = cube(5.0, true, false);
    let mut grains = scatter(&mut random, &domain, 2, |_| 1.0, 0.3);
    let small = scatter(&mut random, &domain, 38, |_| 0.01, 30.0);
    let clear = |small: &&NewGrain| {
        grains
            .iter()
            .all(|big| domain.nearest(big.position - small.position).norm() > 1.1 * (big.radius + small.radius))
    };
    let clear: Vec<NewGrain> = small.iter().filter(clear).copied().collect();
    grains.extend(clear);
    let case = Case { grains, surface: vec![], domain, laws: laws(1.0, ROUGH) };
    assert!(compare::<Buckets>(&case, 1e9, events) >= events);
}

/// The same scene twice, with the plain and the fast calendar, observed seldom and often: equal bits.
#[test]
fn calendar_and_observation_do_not_change_a_bit() {
    let mut random = Pcg64::seed_from_u64(5);
    let domain = cube(20.0, true, false);
    let grains = scatter(&mut random, &domain, 2000, |r| r.random_range(0.3..1.0), 1.0);
    let laws = laws(0.9, ROUGH);
    fn run<C: Calendar>(grains: &[NewGrain], domain: Domain, laws: Laws, looks: u32) -> (Log, Vec<Flight>) {
        let surface = Surface::new(&[], ".".as_ref()).unwrap();
        let mut engine: EventDriven<Surface, C> = EventDriven::new(grains, surface, domain, laws, 0.0);
        let mut log = Log::default();
        for look in 1..=looks {
            let time = 60.0 * f64::from(look) / f64::from(looks);
            let _ = engine.advance(time, &mut log, &mut |_| ControlFlow::Continue(())).unwrap();
            engine.snapshot(time, |snapshot| assert_eq!(snapshot.grains.len(), 2000));
        }
        let flights = engine.snapshot(60.0, |snapshot| snapshot.flights.to_vec());
        (log, flights)
    }
    let plain = run::<PlainCalendar>(&grains, domain, laws, 1);
    assert!(plain.0.0.len() > 5000);
    for other in [
        run::<PlainCalendar>(&grains, domain, laws, 1),
        run::<Buckets>(&grains, domain, laws, 1),
        run::<Buckets>(&grains, domain, laws, 500),
    ] {
        assert!(other.0.0 == plain.0.0, "the events differ");
        assert!(other.1 == plain.1, "the final states differ");
    }
}
