//! Our numbers beside numbers that other software computed.

mod agents;
mod baselines;
mod bayes;
mod bellman;
mod claimed;
mod decision;
mod disagreement;
mod gaps;
mod harness;
mod improvement;
mod kmeans;
mod losses;
mod networks;
mod optim;
mod planning;
mod plans;
mod statistics;
mod successor;
mod tabular;
mod targets;
mod worlds;
