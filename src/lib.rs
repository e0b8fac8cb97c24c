//! Impinge
pub mod grains;
pub mod scene;
pub mod scheme;
pub mod source;
