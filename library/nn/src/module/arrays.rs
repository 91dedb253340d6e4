//! The arrays that a network has, and what they start from.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::Module;

/// One array of a network.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayOf {
    /// Such as `0.weight`: the places of its layer in the tree, and what it is.
    pub name: String,
    /// Its shape.
    pub shape: Vec<usize>,
    /// What it starts from.
    pub start: Start,
    /// Whether gradients change it.
    pub learns: bool,
}

/// What the numbers of an array are before training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Uniform within `±1/√n`.
    Uniform(usize),
    /// Of the standard normal distribution.
    Normal,
    /// All the same.
    Constant(f32),
}

impl ArrayOf {
    /// Whether it says what is left out.
    #[must_use]
    pub fn is_mask(&self) -> bool {
        self.name.rsplit('.').next() == Some("mask")
    }
}

impl Start {
    /// So many numbers.
    pub fn draw(self, n: usize, rng: &mut ChaCha8Rng) -> Vec<f32> {
        match self {
            Self::Uniform(of) => {
                #[expect(clippy::cast_precision_loss, reason = "widths are far below 2^24")]
                let bound = 1.0 / (of as f32).sqrt();
                (0..n).map(|_| bound * (2.0 * rng.random::<f32>() - 1.0)).collect()
            }
            Self::Normal => (0..n).map(|_| StandardNormal.sample(rng)).collect(),
            Self::Constant(x) => vec![x; n],
        }
    }
}

impl Module {
    /// The arrays, in the order in which a pass comes across them.
    #[must_use]
    pub fn arrays(&self) -> Vec<ArrayOf> {
        let mut found = Vec::new();
        self.gather("", &mut found);
        found
    }

    /// How many numbers the arrays have.
    #[must_use]
    pub fn n_params(&self) -> u64 {
        self.arrays().iter().map(|array| array.shape.iter().product::<usize>() as u64).sum()
    }

    fn gather(&self, at: &str, found: &mut Vec<ArrayOf>) {
        let mut add = |what: &str, shape: Vec<usize>, start, learns| {
            let name = if at.is_empty() { what.to_owned() } else { format!("{at}.{what}") };
            found.push(ArrayOf { name, shape, start, learns });
        };
        match self {
            Self::Dense { inputs, outputs, .. } => {
                let start = Start::Uniform(*inputs);
                add("weight", vec![*inputs, *outputs], start, true);
                add("bias", vec![*outputs], start, true);
            }
            Self::Conv { inputs, outputs, window, groups, bias, .. } => {
                let (each, kernel) = (inputs / groups, window.kernel);
                let start = Start::Uniform(each * kernel * kernel);
                add("weight", vec![*outputs, each, kernel, kernel], start, true);
                if *bias {
                    add("bias", vec![*outputs], start, true);
                }
            }
            Self::ConvTranspose { inputs, outputs, window, .. } => {
                let start = Start::Uniform(inputs * window.kernel * window.kernel);
                let shape = vec![*inputs, *outputs, window.kernel, window.kernel];
                add("weight", shape, start, true);
                add("bias", vec![*outputs], start, true);
            }
            Self::BatchNorm { channels } => {
                let shape = || vec![*channels];
                add("scale", shape(), Start::Constant(1.0), true);
                add("shift", shape(), Start::Constant(0.0), true);
                add("mean", shape(), Start::Constant(0.0), false);
                add("variance", shape(), Start::Constant(1.0), false);
            }
            Self::LayerNorm { shape } => {
                add("scale", shape.clone(), Start::Constant(1.0), true);
                add("shift", shape.clone(), Start::Constant(0.0), true);
            }
            Self::Gru { inputs, units } => cell(3, *inputs, *units, &mut add),
            Self::Lstm { inputs, units } => cell(4, *inputs, *units, &mut add),
            Self::Embedding { entries, width } => {
                add("table", vec![*entries, *width], Start::Normal, true);
            }
            Self::Mask { shape } => add("mask", shape.clone(), Start::Constant(1.0), false),
            Self::Sequence(layers) | Self::Residual(layers) => {
                for (i, layer) in layers.iter().enumerate() {
                    let at = if at.is_empty() { i.to_string() } else { format!("{at}.{i}") };
                    layer.gather(&at, found);
                }
            }
            Self::MaxPool(_)
            | Self::MeanPool(_)
            | Self::GlobalPool
            | Self::Dropout { .. }
            | Self::Curve(_)
            | Self::Flatten
            | Self::Last => {}
        }
    }
}

fn cell(
    gates: usize,
    inputs: usize,
    units: usize,
    add: &mut impl FnMut(&str, Vec<usize>, Start, bool),
) {
    let start = Start::Uniform(units);
    add("input_weight", vec![inputs, gates * units], start, true);
    add("input_bias", vec![gates * units], start, true);
    add("state_weight", vec![units, gates * units], start, true);
    add("state_bias", vec![gates * units], start, true);
}
