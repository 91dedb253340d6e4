//! Our numbers against those of other implementations.
//!
//! Each topic is a file of cases; every case and every expected value in it must be met, and
//! a kind of case that is not known is a failure.

#[cfg(test)]
mod harness;
#[cfg(test)]
mod optim;
