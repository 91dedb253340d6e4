//! Our numbers beside numbers that other software computed.

mod bayes;
mod bellman;
mod decision;
mod disagreement;
mod gaps;
mod harness;
mod losses;
mod networks;
mod optim;
mod statistics;
mod tabular;
mod targets;
mod worlds;
