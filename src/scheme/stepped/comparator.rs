//! Which of the time-stepped schemes runs.

use super::{Crowd, Method};
use crate::scene::{Scene, Scheme, Source};
use crate::scheme::fixed_point::FixedPoint;
use crate::scheme::soft_sphere::SoftSphere;
use crate::scheme::trapezoidal::Trapezoidal;
use crate::scheme::{Broken, Observer};

/// One of the time-stepped schemes; the choice is made once a step.
#[derive(Clone, Debug)]
pub enum Comparator {
    /// Contacts are impulses, and steps are shortened so that none is missed.
    FixedPoint(Box<FixedPoint>),
    /// The phi-method, with contacts as impulses.
    Trapezoidal(Trapezoidal),
    /// Contacts are forces.
    SoftSphere(SoftSphere),
}

impl Comparator {
    /// How the comparator called `scheme` is made for a scene and its crowd as it starts; `None` for the event-driven scheme, which has no crowd.
    #[must_use]
    pub fn called(scheme: Scheme) -> Option<fn(&Scene, &Crowd) -> Self> {
        match scheme {
            Scheme::EventDriven => None,
            Scheme::FixedPoint => {
                Some(|scene, _| Self::FixedPoint(Box::new(FixedPoint::new(scene.fixed_point.unwrap_or_default()))))
            }
            Scheme::Trapezoidal => Some(|scene, crowd| {
                Self::Trapezoidal(Trapezoidal::new(&scene.trapezoidal.unwrap_or_default(), fastest(scene, crowd)))
            }),
            Scheme::SoftSphere => Some(|scene, crowd| {
                let fastest = fastest(scene, crowd);
                Self::SoftSphere(SoftSphere::new(&scene.soft_sphere.unwrap_or_default(), crowd, fastest))
            }),
        }
    }

    /// The length of its steps (s) where it is known beforehand.
    #[must_use]
    pub fn planned_step(&self) -> Option<f64> {
        match self {
            Self::SoftSphere(scheme) => Some(scheme.longest_step()).filter(|step| step.is_finite()),
            Self::FixedPoint(_) | Self::Trapezoidal(_) => None,
        }
    }
}

/// Speed of the fastest impact that `crowd` or the nozzles of `scene` can have, m/s.
fn fastest(scene: &Scene, crowd: &Crowd) -> f64 {
    let speed = |source: &Source| match source {
        Source::Nozzle(nozzle) => nozzle.speed,
        _ => 0.0,
    };
    scene.source.iter().map(speed).fold(crowd.fastest_impact(), f64::max)
}

impl Method for Comparator {
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
        match self {
            Self::FixedPoint(scheme) => scheme.step(crowd, room, observer),
            Self::Trapezoidal(scheme) => scheme.step(crowd, room, observer),
            Self::SoftSphere(scheme) => scheme.step(crowd, room, observer),
        }
    }

    fn renumber(&mut self, crowd: &mut Crowd, slots: &[u32], observer: &mut impl Observer) {
        match self {
            Self::FixedPoint(scheme) => scheme.renumber(crowd, slots, observer),
            Self::Trapezoidal(scheme) => scheme.renumber(crowd, slots, observer),
            Self::SoftSphere(scheme) => scheme.renumber(crowd, slots, observer),
        }
    }

    fn finish(&mut self, crowd: &mut Crowd, observer: &mut impl Observer) {
        match self {
            Self::FixedPoint(scheme) => scheme.finish(crowd, observer),
            Self::Trapezoidal(scheme) => scheme.finish(crowd, observer),
            Self::SoftSphere(scheme) => scheme.finish(crowd, observer),
        }
    }
}
