//! Which of the time-stepped schemes runs.

use super::{Crowd, Method};
use crate::scene::{Invalid, Scene};
use crate::scheme::{Broken, Observer};

/// One of the time-stepped schemes; the choice is made once a step.
#[derive(Clone, Debug)]
pub enum Comparator {}

impl Comparator {
    /// The scheme that `scene` asks for.
    ///
    /// # Errors
    /// A scheme that is not there yet.
    pub fn new(scene: &Scene, _crowd: &Crowd) -> Result<Self, Invalid> {
        let scheme = scene.run.scheme.name();
        Err(Invalid::new(
            "run.scheme",
            format!("the scheme \"{scheme}\" is not in this version"),
            "use `scheme = \"event-driven\"`, or leave it out",
        ))
    }
}

impl Method for Comparator {
    fn step(&mut self, _crowd: &mut Crowd, _room: f64, _observer: &mut impl Observer) -> Result<f64, Broken> {
        match *self {}
    }
}
