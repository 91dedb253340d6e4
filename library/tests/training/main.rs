//! Trainings on passes of a graph: the same bits however they run, and known answers found.

mod agents;
mod determinism;
mod imitation;
mod known;
mod nets;
mod tasks;
