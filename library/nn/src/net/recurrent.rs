//! Recurrent networks.

use ivx_data::Misfit;
use ivx_op::declare;

use super::Net;
use crate::module::Module;

declare! {
    /// Gated recurrent units (Cho et al., 2014) over the steps of a sequence, from a state of zeros.
    ///
    /// The state at every step comes out; `sequence([gru(), last()])` ends in the last. Parameters
    /// start uniform within `±1/√units`.
    pub struct Gru = "gru" @ 1 {
        /// Numbers in the state.
        units: usize = 64, in 1.0..=1e5;
        /// How many, one on top of the other.
        layers: usize = 1, in 1.0..=100.0;
    }
}

declare! {
    /// Long short-term memory (Hochreiter and Schmidhuber, 1997) over the steps of a sequence, from a
    /// state of zeros.
    ///
    /// The output at every step comes out; `sequence([lstm(), last()])` ends in the last. Parameters
    /// start uniform within `±1/√units`.
    pub struct Lstm = "lstm" @ 1 {
        /// Numbers in the output.
        units: usize = 64, in 1.0..=1e5;
        /// How many, one on top of the other.
        layers: usize = 1, in 1.0..=100.0;
    }
}

impl Net for Gru {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        stacked(self.layers, self.units, input, |inputs, units| Module::Gru { inputs, units })
    }
}

impl Net for Lstm {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        stacked(self.layers, self.units, input, |inputs, units| Module::Lstm { inputs, units })
    }
}

fn stacked(
    n: usize,
    units: usize,
    input: &[usize],
    layer: impl Fn(usize, usize) -> Module,
) -> Result<Module, Misfit> {
    let inputs = input.last().copied().unwrap_or(1);
    let first = layer(inputs, units);
    first.output(input)?;
    let rest = (1..n).map(|_| layer(units, units));
    Ok(Module::Sequence([first].into_iter().chain(rest).collect()))
}
