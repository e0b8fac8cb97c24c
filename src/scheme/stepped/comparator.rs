//! Which of the time-stepped schemes runs.

use super::{Crowd, Method};
use crate::scene::{Invalid, Scene, Scheme, Source};
use crate::scheme::soft_sphere::SoftSphere;
use crate::scheme::{Broken, Observer};

/// One of the time-stepped schemes; the choice is made once a step.
#[derive(Clone, Debug)]
pub enum Comparator {
    /// Contacts are forces.
    SoftSphere(SoftSphere),
}

impl Comparator {
    /// The scheme that `scene` asks for, for `crowd` as it starts.
    ///
    /// # Errors
    /// A scheme that is not there yet.
    pub fn new(scene: &Scene, crowd: &Crowd) -> Result<Self, Invalid> {
        match scene.run.scheme {
            Scheme::SoftSphere => {
                let fastest = fastest_nozzle(scene).max(crowd.fastest_impact());
                Ok(Self::SoftSphere(SoftSphere::new(&scene.soft_sphere.unwrap_or_default(), crowd, fastest)))
            }
            other => Err(Invalid::new(
                "run.scheme",
                format!("the scheme \"{}\" is not in this version", other.name()),
                "use `scheme = \"event-driven\"`, or leave it out",
            )),
        }
    }
}

impl Comparator {
    /// The length of its steps (s) where it is known beforehand.
    #[must_use]
    pub fn planned_step(&self) -> Option<f64> {
        match self {
            Self::SoftSphere(scheme) => Some(scheme.longest_step()).filter(|step| step.is_finite()),
        }
    }
}

/// Speed of the fastest grains that nozzles will send, m/s.
fn fastest_nozzle(scene: &Scene) -> f64 {
    let speed = |source: &Source| match source {
        Source::Nozzle(nozzle) => nozzle.speed,
        _ => 0.0,
    };
    scene.source.iter().map(speed).fold(0.0, f64::max)
}

impl Method for Comparator {
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
        match self {
            Self::SoftSphere(scheme) => scheme.step(crowd, room, observer),
        }
    }

    fn renumber(&mut self, crowd: &mut Crowd, slots: &[u32], observer: &mut impl Observer) {
        match self {
            Self::SoftSphere(scheme) => scheme.renumber(crowd, slots, observer),
        }
    }

    fn finish(&mut self, crowd: &mut Crowd, observer: &mut impl Observer) {
        match self {
            Self::SoftSphere(scheme) => scheme.finish(crowd, observer),
        }
    }
}
