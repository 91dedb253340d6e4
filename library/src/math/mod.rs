//! Pure functions on numbers.

pub mod interval;
pub mod linear_gaussian;
pub mod moments;
pub mod order;
pub mod policy;
pub mod tail;
