//! How long a step may be so that no collision is passed over: equations (39) to (42).

use impinge_events::contact_time::sphere_sphere;
use impinge_events::{Flight, Outlook, Surface};
use nalgebra::Vector3;

use crate::scene;
use crate::scheme::stepped::Crowd;

/// Least and greatest gap (in radii of the largest grain) up to which pairs are looked at. Nearer, a step that ends a contact would let grains escape
/// the lists; farther, lists of a dense crowd hold more pairs than longer steps could pay for.
const REACH: [f64; 2] = [0.25, 4.0];
/// Least gap (in radii of the largest grain) up to which grains are looked at that come near the surface: a step must not be of no length where all
/// grains rest. Each of them is compared with the surface in each step, which takes long where that is a mesh.
const SURFACE_REACH: f64 = 0.02;
/// How much farther is looked than grains fly in a step: as much faster may impulses and forces make them before the step is cut short.
const MARGIN: f64 = 1.25;
/// Lists are made for longer gaps than needed by this much, and are kept until they are longer than needed by its cube.
const RESERVE: f64 = 2.0;

/// How fast grains fly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Speeds {
    /// Of the fastest, m/s.
    pub(super) fastest: f64,
    /// No two grains have a larger relative speed, m/s.
    apart: f64,
    /// m
    pub(super) largest_radius: f64,
}

impl Speeds {
    pub(super) fn of(flights: &[Flight]) -> Self {
        let mean = flights.iter().map(|flight| flight.velocity).sum::<Vector3<f64>>() / flights.len().max(1) as f64;
        let [mut fastest, mut from_mean, mut largest_radius] = [0.0f64; 3];
        for flight in flights {
            fastest = fastest.max(flight.velocity.norm_squared());
            from_mean = from_mean.max((flight.velocity - mean).norm_squared());
            largest_radius = largest_radius.max(flight.radius);
        }
        Self { fastest: fastest.sqrt(), apart: 2.0 * from_mean.sqrt(), largest_radius }
    }
}

/// Looks out for collisions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lookout {
    /// Gap up to which pairs are looked at, m.
    reach: f64,
    /// Gap up to which grains are looked at that come near the surface, m.
    surface_reach: f64,
    /// Largest speed of the surface, m/s.
    surface_speed: f64,
}

impl Lookout {
    /// Looks as far as collisions may come from within a step of length `offered` (s).
    pub(super) fn look(&mut self, crowd: &mut Crowd, settings: &scene::FixedPoint, speeds: &Speeds, offered: f64) {
        let [least, most] = REACH.map(|radii| radii * speeds.largest_radius);
        let flown = MARGIN * offered / settings.safety;
        let needed = (speeds.apart * flown).clamp(least, most);
        if needed > self.reach || self.reach > RESERVE.powi(3) * needed {
            self.reach = (RESERVE * needed).min(most);
        }
        self.surface_speed = crowd.surface().speed() * 3f64.sqrt();
        self.surface_reach = ((speeds.fastest + self.surface_speed) * flown).max(SURFACE_REACH * speeds.largest_radius);
        crowd.look_ahead(offered, self.reach, self.surface_reach);
    }

    /// Δt^lim: the least that any two things allow with the velocities that grains have now, or `offered` (s) if that is less.
    pub(super) fn longest_step(&self, crowd: &Crowd, settings: &scene::FixedPoint, offered: f64) -> f64 {
        let step = self.beyond_reach(crowd, settings, offered);
        let step = between_grains(crowd, settings, step);
        self.with_surface(crowd, settings, step)
    }

    /// What is out of reach must not come to touch.
    fn beyond_reach(&self, crowd: &Crowd, settings: &scene::FixedPoint, step: f64) -> f64 {
        let speeds = Speeds::of(&crowd.flights);
        let to_surface = speeds.fastest + self.surface_speed;
        let mut step = step;
        for (reach, speed) in [(self.reach, speeds.apart), (self.surface_reach, to_surface)] {
            if step * speed > settings.safety * reach {
                step = settings.safety * reach / speed;
            }
        }
        step
    }

    fn with_surface(&self, crowd: &Crowd, settings: &scene::FixedPoint, step: f64) -> f64 {
        let mut step = step;
        for &slot in crowd.at_surface() {
            let flight = &crowd.flights[slot as usize];
            if let Outlook::Hit { time, .. } = crowd.surface().first_contact(flight, step / settings.safety) {
                step = step.min(allowed(settings, time, flight.radius, flight.velocity.norm() + self.surface_speed));
            }
        }
        step
    }
}

fn between_grains(crowd: &Crowd, settings: &scene::FixedPoint, step: f64) -> f64 {
    let mut step = step;
    for &[a, b] in crowd.pairs() {
        let (a, b) = (&crowd.flights[a as usize], &crowd.flights[b as usize]);
        let velocity = b.velocity - a.velocity;
        let r = crowd.domain().nearest(b.position - a.position);
        let (approach, contact) = (-r.dot(&velocity), a.radius + b.radius);
        // r² - s² falls by less than 2 approach t within t, so this pair would allow more.
        if settings.safety * (r.norm_squared() - contact * contact) >= 2.0 * approach * step {
            continue;
        }
        if let Some(time) = sphere_sphere(a, b, r - (b.position - a.position)) {
            step = step.min(allowed(settings, time, a.radius.min(b.radius), velocity.norm()));
        }
    }
    step
}

/// Equations (40) and (42): the step (s) after which two things that touch after `time` (s), without forces, overlap by a part of `radius` (m) at the
/// most, if they close at no more than `speed` (m/s).
fn allowed(settings: &scene::FixedPoint, time: f64, radius: f64, speed: f64) -> f64 {
    settings.safety * time + settings.overlap * radius / speed
}
