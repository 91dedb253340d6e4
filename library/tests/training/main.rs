//! Trainings on passes of a graph: the same bits however they run, and known answers found.

mod adapting;
mod agents;
mod determinism;
mod explained;
mod imitation;
mod known;
mod nets;
mod tasks;
