//! Impinge
pub mod grains;
pub mod law;
pub mod observe;
pub mod output;
pub mod scene;
pub mod scheme;
pub mod simulation;
pub mod source;
pub mod surface;
