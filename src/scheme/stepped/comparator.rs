//! Which of the time-stepped schemes runs.

use super::{Crowd, Method};
use crate::scene::{Invalid, Scene, Scheme};
use crate::scheme::fixed_point::FixedPoint;
use crate::scheme::{Broken, Observer};

/// One of the time-stepped schemes; the choice is made once a step.
#[derive(Clone, Debug)]
pub enum Comparator {
    /// Contacts are impulses, and steps are shortened so that none is missed.
    FixedPoint(Box<FixedPoint>),
}

impl Comparator {
    /// The scheme that `scene` asks for.
    ///
    /// # Errors
    /// A scheme that is not there yet.
    pub fn new(scene: &Scene, _crowd: &Crowd) -> Result<Self, Invalid> {
        match scene.run.scheme {
            Scheme::FixedPoint => {
                Ok(Self::FixedPoint(Box::new(FixedPoint::new(scene.fixed_point.unwrap_or_default()))))
            }
            other => Err(Invalid::new(
                "run.scheme",
                format!("the scheme \"{}\" is not in this version", other.name()),
                "use `scheme = \"event-driven\"`, or leave it out",
            )),
        }
    }
}

impl Method for Comparator {
    fn step(&mut self, crowd: &mut Crowd, room: f64, observer: &mut impl Observer) -> Result<f64, Broken> {
        match self {
            Self::FixedPoint(scheme) => scheme.step(crowd, room, observer),
        }
    }
}
