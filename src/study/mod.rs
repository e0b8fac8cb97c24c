//! Studies: many runs, what they say together, and how sure that is.

pub mod compare;
pub mod reproduce;
