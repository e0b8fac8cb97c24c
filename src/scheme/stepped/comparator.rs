//! Which of the time-stepped schemes runs.

use super::{Crowd, Method};
use crate::scene::{Invalid, Scene, Scheme, Source};
use crate::scheme::trapezoidal::Trapezoidal;
use crate::scheme::{Broken, Observer};

/// One of the time-stepped schemes; the choice is made once a step.
#[derive(Clone, Debug)]
pub enum Comparator {
    /// The phi-method, with contacts as impulses.
    Trapezoidal(Trapezoidal),
}

impl Comparator {
    /// The scheme that `scene` asks for, for `crowd` as it starts.
    ///
    /// # Errors
    /// A scheme that is not there yet.
    pub fn new(scene: &Scene, crowd: &Crowd) -> Result<Self, Invalid> {
        match scene.run.scheme {
            Scheme::Trapezoidal => {
                let fastest = fastest_nozzle(scene).max(crowd.fastest_impact());
                Ok(Self::Trapezoidal(Trapezoidal::new(&scene.trapezoidal.unwrap_or_default(), fastest)))
            }
            other => Err(Invalid::new(
                "run.scheme",
                format!("the scheme \"{}\" is not in this version", other.name()),
                "use `scheme = \"event-driven\"`, or leave it out",
            )),
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
            Self::Trapezoidal(scheme) => scheme.step(crowd, room, observer),
        }
    }

    fn renumber(&mut self, crowd: &mut Crowd, slots: &[u32], observer: &mut impl Observer) {
        match self {
            Self::Trapezoidal(scheme) => scheme.renumber(crowd, slots, observer),
        }
    }
}
