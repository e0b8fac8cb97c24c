//! Impinge
pub mod grains;
pub mod law;
pub mod scene;
pub mod scheme;
pub mod simulation;
