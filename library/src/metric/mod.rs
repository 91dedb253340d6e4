//! Measures, their arithmetic and reductions, and claims about them.

mod accuracy;
mod among;
mod arithmetic;
mod broadcast;
mod choice;
mod claim;
mod detection;
mod displacement;
mod elementwise;
mod equivalent;
mod field;
mod gap;
mod improvement;
mod jensen_shannon;
mod mixture_std;
mod nll;
mod optimality_gap;
mod profile;
mod published;
mod quantile;
mod reduce;
mod relation;
mod resample;
mod rmse;
mod select;
mod select_range;
mod sort;
mod stratified;

use ivx_op::{Array, Dim, Gathered, Labels, OpError, Registry};

pub use accuracy::Accuracy;
pub use among::{ShareAmong, ShareAmongInterval};
pub use arithmetic::{Add, AtLeast, AtMost, Div, Equal, Greater, Less, Mul, Neg, Sub, Unequal};
pub use choice::{ArgmaxOver, ArgminOver, Highest, Lowest};
pub use claim::Claim;
pub use detection::{Auroc, AurocInterval, RateAbove};
pub use displacement::{MinAde, MinFde, Missed};
pub use elementwise::{
    Abs, Ceil, Clip, Cos, Exp, Floor, Log, Maximum, Minimum, Pow, Round, Sign, Sin, Sqrt, Tanh,
    Where,
};
pub use equivalent::Equivalent;
pub use field::Field;
pub use gap::{Hallucination, Regret};
pub use improvement::Improvement;
pub use jensen_shannon::JensenShannon;
pub use mixture_std::MixtureStd;
pub use nll::Nll;
pub use optimality_gap::OptimalityGap;
pub use profile::PerformanceProfile;
pub use published::PublishedNumbers;
pub use quantile::Quantile;
pub use reduce::{Iqm, Max, Mean, Median, Min, Share, Std, Stderr, Sum};
pub use resample::Resample;
pub use rmse::Rmse;
pub use select::Select;
pub use select_range::SelectRange;
pub use sort::Sort;
pub use stratified::Stratified;

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry
        .op::<Accuracy>()
        .op::<Nll>()
        .op::<Mean>()
        .op::<Sum>()
        .op::<Share>()
        .op::<Median>()
        .op::<Iqm>()
        .op::<Std>()
        .op::<Stderr>()
        .op::<Min>()
        .op::<Max>()
        .op::<Quantile>()
        .op::<OptimalityGap>()
        .op::<Stratified>()
        .op::<PerformanceProfile>()
        .op::<Improvement>()
        .op::<Auroc>()
        .op::<AurocInterval>()
        .op::<RateAbove>()
        .op::<ShareAmong>()
        .op::<ShareAmongInterval>()
        .op::<JensenShannon>()
        .op::<Sort>()
        .op::<ArgminOver>()
        .op::<ArgmaxOver>()
        .op::<Lowest>()
        .op::<Highest>()
        .op::<Add>()
        .op::<Sub>()
        .op::<Mul>()
        .op::<Div>()
        .op::<Neg>()
        .op::<Less>()
        .op::<AtMost>()
        .op::<Greater>()
        .op::<AtLeast>()
        .op::<Equal>()
        .op::<Unequal>()
        .op::<Abs>()
        .op::<Ceil>()
        .op::<Clip>()
        .op::<Cos>()
        .op::<Exp>()
        .op::<Floor>()
        .op::<Log>()
        .op::<Maximum>()
        .op::<Minimum>()
        .op::<Pow>()
        .op::<Round>()
        .op::<Sign>()
        .op::<Sin>()
        .op::<Sqrt>()
        .op::<Tanh>()
        .op::<Where>()
        .op::<Select>()
        .op::<SelectRange>()
        .op::<Field>()
        .op::<PublishedNumbers>()
        .op::<Regret>()
        .op::<Hallucination>()
        .op::<Rmse>()
        .op::<MinAde>()
        .op::<MinFde>()
        .op::<Missed>()
        .op::<Equivalent>()
        .op::<MixtureStd>()
        .op::<Resample>()
        .op::<Claim>()
}

/// Joins the members' numbers at each coordinate into one.
///
/// # Errors
/// If the members differ in their dimensions.
fn over_members(members: &[Array], join: impl Fn(&[f64]) -> f64) -> Result<Array, OpError> {
    let member = Dim::new("#member", Labels::count(members.len()));
    let gathered = Gathered { dims: vec![member], values: members.to_vec(), name: String::new() };
    let stacked = Array::stack(&gathered).map_err(OpError::Failed)?;
    reduce::reduce(&stacked, &["#member".to_owned()], join)
}
