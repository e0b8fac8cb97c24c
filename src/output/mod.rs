//! What a run leaves behind: one format a file, all in one folder.
//!
//! [`Folder`] keeps earlier results safe, [`Recorder`] watches the run and writes, [`Summary`] is what it came to.

mod comparison;
mod error;
mod folder;
mod measures;
pub mod plots;
mod recorder;
mod reproduction;
mod summary;
mod tables;
pub mod vtk;

pub use comparison::{comparison_text, write_comparison};
pub use error::Error;
pub use folder::Folder;
pub use recorder::{Outcome, Recorder};
pub use reproduction::{Overview, Reproduction};
pub use summary::Summary;
pub use tables::EventTable;
