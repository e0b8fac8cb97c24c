//! What does a jet of hard grains do to the surface it hits?
//!
//! Impinge is an event-driven hard-sphere simulator: a calendar of predicted grain–grain and grain–surface collisions drives time, and
//! impulse laws act at the events. This library is what the command `impinge` is made of.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use impinge::observe::SurfaceEnergy;
//! use impinge::scene::Scene;
//! use impinge::simulation::Simulation;
//!
//! let scene: Scene = toml::from_str(&std::fs::read_to_string("examples/two_grains.toml")?)?;
//! let mut energy = SurfaceEnergy::default();
//! Simulation::new(&scene, "examples".as_ref())?.run(&mut energy, &mut |_| ControlFlow::Continue(()))?;
//! assert!(energy.repeated_hits() > 0.0, "the lower grain hits the surface again");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Data flows one way: [`scene`] (what the user wrote) → [`source`], [`surface`], [`law`] → [`scheme`] (advances time) → [`observe`] (measures) →
//! [`output`] (writes). [`simulation`] puts a scene together and runs it; a [`study`] runs many. Everything is in SI units.

pub mod estimate;
pub mod grains;
pub mod law;
pub mod near_field;
pub mod observe;
pub mod output;
pub mod scene;
pub mod scheme;
pub mod shown;
pub mod simulation;
pub mod solid;
pub mod source;
pub mod study;
mod sum;
pub mod surface;

/// The program in README.md runs too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
