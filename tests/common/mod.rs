//! What the physics tests share: a plane, a law without friction, a run without scene or files, and a log of what happened.

// Each test file is a crate of its own and uses its share of this one.
#![allow(dead_code, unreachable_pub)]

pub mod forced;

use std::f64::consts::PI;
use std::ops::ControlFlow;

use impinge::grains::NewGrain;
use impinge::law::{ContactLaw, Friction};
use impinge::scene::Interference;
use impinge::scheme::{Broken, Collapse, EventDriven, GrainCollision, Laws, Observer, SurfaceHit};
use impinge_events::calendar::Calendar;
use impinge_events::contact_time::sphere_plane;
use impinge_events::{Domain, Flight, Outlook, Surface, SurfaceContact};
use nalgebra::Vector3;
use rand::SeedableRng as _;
use rand_distr::Distribution as _;

/// One plane, hit from the side its normal points to.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// A point of it at the start of the epoch, m.
    pub point: Vector3<f64>,
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// m/s, along the normal or across it.
    pub velocity: Vector3<f64>,
}

/// The plane z = 0, hit from above.
pub const FLOOR: Plane = Plane {
    point: Vector3::new(0.0, 0.0, 0.0),
    normal: Vector3::new(0.0, 0.0, 1.0),
    velocity: Vector3::new(0.0, 0.0, 0.0),
};

impl Plane {
    /// The flight as somebody on the plane sees it.
    fn seen(&self, flight: &Flight) -> Flight {
        let position = flight.position - self.velocity * flight.time;
        Flight { position, velocity: flight.velocity - self.velocity, ..*flight }
    }
}

impl Surface for Plane {
    fn first_contact(&self, flight: &Flight, _until: f64) -> Outlook {
        sphere_plane(&self.seen(flight), self.point, self.normal)
            .map_or(Outlook::ClearUntil(f64::INFINITY), |time| Outlook::Hit { time, element: 0 })
    }

    fn contact(&self, _element: u32, flight: &Flight) -> SurfaceContact {
        let gap = (self.seen(flight).position - self.point).dot(&self.normal) - flight.radius;
        SurfaceContact { normal: self.normal, gap, velocity: self.velocity }
    }

    fn speed(&self) -> f64 {
        self.velocity.amax()
    }

    fn start_epoch(&mut self, duration: f64) {
        self.point += self.velocity * duration;
    }
}

/// Laws without friction: restitution between grains and with the surface.
pub fn smooth(grain: f64, surface: f64) -> Laws {
    let law = |restitution| ContactLaw { restitution, friction: Friction::Smooth };
    Laws { grain: law(grain), surface: law(surface), interference: Interference::All, collapse: Collapse::Elastic }
}

/// A grain without spin, of mass `mass` (kg).
pub fn grain(position: Vector3<f64>, velocity: Vector3<f64>, radius: f64, mass: f64) -> NewGrain {
    NewGrain {
        position,
        velocity,
        spin: Vector3::zeros(),
        radius,
        density: mass / (4.0 / 3.0 * PI * radius.powi(3)),
        strength: 1.0,
    }
}

/// Runs to `until` (s).
pub fn run<S: Surface, C: Calendar>(
    scheme: &mut EventDriven<S, C>,
    until: f64,
    observer: &mut impl Observer,
) -> Result<(), Broken> {
    let flow = scheme.advance(until, observer, &mut |_| ControlFlow::Continue(()))?;
    assert!(flow.is_continue());
    Ok(())
}

/// Positions, velocities and masses of all grains at time `time` (s), to which the run has been advanced.
pub fn states<S: Surface, C: Calendar>(scheme: &EventDriven<S, C>, time: f64) -> Vec<(Flight, f64)> {
    scheme.snapshot(time, |snapshot| {
        snapshot.flights.iter().zip(snapshot.grains).map(|(flight, grain)| (*flight, grain.mass)).collect()
    })
}

/// Kinetic energy of grains that do not spin, J.
pub fn kinetic_energy(states: &[(Flight, f64)]) -> f64 {
    states.iter().map(|(flight, mass)| 0.5 * mass * flight.velocity.norm_squared()).sum()
}

/// What happened, in its order.
#[derive(Clone, Debug, PartialEq)]
pub enum Hit {
    Grains(GrainCollision),
    Surface(SurfaceHit),
}

/// Keeps everything that happened.
#[derive(Clone, Debug, Default)]
pub struct Log(pub Vec<Hit>);

impl Log {
    pub fn grain_hits(&self) -> usize {
        self.0.iter().filter(|hit| matches!(hit, Hit::Grains(_))).count()
    }

    pub fn surface_hits(&self) -> usize {
        self.0.len() - self.grain_hits()
    }

    /// Largest overlap or gap at an event, over the radius.
    pub fn largest_miss(&self) -> f64 {
        let overlap = |hit: &Hit| match hit {
            Hit::Grains(hit) => hit.overlap_over_radius,
            Hit::Surface(hit) => hit.overlap_over_radius,
        };
        self.0.iter().map(|hit| overlap(hit).abs()).fold(0.0, f64::max)
    }
}

impl Observer for Log {
    fn grain_collision(&mut self, collision: &GrainCollision) {
        self.0.push(Hit::Grains(*collision));
    }

    fn surface_hit(&mut self, hit: &SurfaceHit) {
        self.0.push(Hit::Surface(*hit));
    }
}

/// Cells³ elastic-gas grains of radius 0.5 m and mass 1 kg in a periodic cube of packing fraction `phi`, with Maxwell velocities of variance
/// 1 (m/s)² per component in the frame where the total momentum is zero.
///
/// They start on a simple cubic lattice, which melts at once; a face-centred one takes thousands of collisions a grain at phi = 0.49.
pub fn gas(cells: u32, phi: f64, seed: u64) -> (Vec<NewGrain>, Domain) {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let side = (PI / 6.0 / phi).cbrt();
    let mut grains: Vec<_> = (0..cells.pow(3))
        .map(|cell| {
            let place = Vector3::new(cell % cells, cell / cells % cells, cell / cells.pow(2)).map(f64::from);
            let velocity = Vector3::from_fn(|_, _| rand_distr::StandardNormal.sample(&mut random));
            grain(place.add_scalar(0.5) * side, velocity, 0.5, 1.0)
        })
        .collect();
    let mean = grains.iter().map(|grain| grain.velocity).sum::<Vector3<f64>>() / grains.len() as f64;
    grains.iter_mut().for_each(|grain| grain.velocity -= mean);
    let max = Vector3::repeat(f64::from(cells) * side);
    (grains, Domain { min: Vector3::zeros(), max, periodic: true, planar: false })
}
