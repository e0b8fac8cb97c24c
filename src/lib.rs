//! Impinge
pub mod grains;
pub mod observe;
pub mod output;
pub mod scene;
pub mod scheme;
