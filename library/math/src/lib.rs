//! Pure functions on numbers.

pub mod affine;
pub mod bellman;
pub mod boost;
pub mod compare;
pub mod detect;
pub mod disagreement;
pub mod evidence;
pub mod interval;
pub mod linear_gaussian;
pub mod logistic;
pub mod markov_chain;
pub mod moments;
pub mod mpv;
pub mod neighbours;
pub mod off_policy;
pub mod order;
pub mod policy;
pub mod polynomial;
pub mod returns;
pub mod several;
pub mod standard;
pub mod successor;
pub mod tabular;
pub mod tail;
pub mod tree;
pub mod two_hot;
