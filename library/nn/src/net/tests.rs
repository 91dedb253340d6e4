use ivx_op::{Lit, Part};

use super::*;
use crate::registry;

fn built(part: &Part, input: &[usize]) -> Result<Module, Misfit> {
    nets().build(&registry().complete(part)).unwrap().module(input)
}

fn head(part: &Part, input: &[usize], outputs: &[usize]) -> Result<Module, Misfit> {
    headed(&*nets().build(&registry().complete(part)).unwrap(), input, outputs)
}

fn names(module: &Module) -> Vec<(String, Vec<usize>)> {
    module.arrays().into_iter().map(|array| (array.name, array.shape)).collect()
}

fn named(name: &str, shape: &[usize]) -> (String, Vec<usize>) {
    (name.to_owned(), shape.to_vec())
}

#[test]
fn arrays_have_the_shapes_of_the_layers() {
    let mlp = |hidden: &[i64]| Part::new("mlp").with("hidden", hidden.to_vec());
    let line = head(&mlp(&[]), &[], &[]).unwrap();
    assert_eq!(names(&line), [named("0.weight", &[1, 1]), named("0.bias", &[1])]);
    assert_eq!(
        names(&head(&mlp(&[3]), &[2], &[4]).unwrap()),
        [
            named("0.weight", &[2, 3]),
            named("0.bias", &[3]),
            named("1.weight", &[3, 4]),
            named("1.bias", &[4])
        ]
    );
    let nested = Lit::List(vec![mlp(&[2]).into(), Part::new("batch_norm").into()]);
    let module = head(&Part::new("sequence").with("layers", nested), &[5], &[]).unwrap();
    assert_eq!(
        names(&module),
        [
            named("0.0.weight", &[5, 2]),
            named("0.0.bias", &[2]),
            named("1.scale", &[2]),
            named("1.shift", &[2]),
            named("1.mean", &[2]),
            named("1.variance", &[2]),
            named("2.weight", &[2, 1]),
            named("2.bias", &[1]),
        ]
    );
    let cells = head(&Part::new("lstm").with("units", 6_i64), &[9, 2], &[9, 3]).unwrap();
    assert_eq!(names(&cells)[0], named("0.input_weight", &[2, 24]));
    assert_eq!(cells.output(&[9, 2]).unwrap(), [9, 3]);
}

/// The published numbers of learned parameters, without classifier.
#[test]
fn published_networks_have_as_many_parameters() {
    let learned = |module: &Module| -> usize {
        let arrays = module.arrays().into_iter().filter(|array| array.learns);
        arrays.map(|array| array.shape.iter().product::<usize>()).sum()
    };
    // 3 504 872 with a classifier of 1000 classes, which has 1 281 000.
    let mobile = built(&Part::new("mobilenet_v2"), &[3, 224, 224]).unwrap();
    assert_eq!(learned(&mobile), 2_223_872);
    assert_eq!(mobile.output(&[3, 224, 224]).unwrap(), [1280]);

    // Mnih et al. (2015) on 4 × 84 × 84: 8224 + 32 832 + 36 928 + 1 606 144.
    let sizes = |name: &str, sizes: &[i64], part: Part| part.with(name, sizes.to_vec());
    let dqn = sizes("kernels", &[8, 4, 3], sizes("strides", &[4, 2, 1], Part::new("cnn")));
    let dqn = sizes("channels", &[32, 64, 64], sizes("hidden", &[512], dqn));
    assert_eq!(learned(&built(&dqn, &[4, 84, 84]).unwrap()), 1_684_128);

    // Sections of 16, 32 and 32 channels on 3 × 64 × 64: 448 + 4 · 2320, 4640 + 4 · 9248,
    // 9248 + 4 · 9248, and 32 · 8 · 8 · 256 + 256 behind.
    let impala = built(&Part::new("impala"), &[3, 64, 64]).unwrap();
    assert_eq!(learned(&impala), 448 + 4 * 2320 + 4640 + 9248 + 8 * 9248 + 524_544);
}

#[test]
fn narrow_networks_round_their_channels() {
    let narrow = Part::new("mobilenet_v2").with("width", 0.35);
    let module = built(&narrow, &[1, 32, 32]).unwrap();
    assert_eq!(module.output(&[1, 32, 32]).unwrap(), [1280]);
    // 32 · 0.35 = 11.2 and 24 · 0.35 = 8.4 become 16 and 8: 8 would be a tenth below 11.2.
    assert_eq!(module.arrays()[0].shape, [16, 1, 3, 3]);
}

#[test]
fn heads_follow_steps_and_refuse_what_has_none() {
    let gru = Part::new("gru").with("units", 4_i64);
    assert_eq!(head(&gru, &[6, 2], &[6, 3]).unwrap().output(&[6, 2]).unwrap(), [6, 3]);
    assert_eq!(head(&gru, &[6, 2], &[6]).unwrap().output(&[6, 2]).unwrap(), [6, 1]);
    let misfit = head(&gru, &[6, 2], &[]).unwrap_err();
    assert!(misfit.help.contains("last()"), "{misfit:?}");
    let last = Lit::List(vec![gru.into(), Part::new("last").into()]);
    let last = Part::new("sequence").with("layers", last);
    assert_eq!(head(&last, &[6, 2], &[]).unwrap().output(&[6, 2]).unwrap(), [1]);
    // As many outputs as a whole sequence of targets has, from one vector.
    let mlp = Part::new("mlp").with("hidden", vec![3_i64]);
    assert_eq!(head(&mlp, &[4], &[6, 3]).unwrap().output(&[4]).unwrap(), [18]);
    let image = Lit::List(vec![Part::new("batch_norm").into()]);
    let misfit = head(&Part::new("sequence").with("layers", image), &[1, 4, 4], &[]).unwrap_err();
    assert!(misfit.help.contains("flatten()"), "{misfit:?}");
}
