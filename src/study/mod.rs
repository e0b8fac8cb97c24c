//! Parameter studies: many runs, what they say together, and how sure that is.

pub mod reproduce;
