//! Trees as arrays.

use ivx_math::moments::real;
use ivx_math::tree::{Split, Tree};
use ivx_op::{Data, Tensors};

/// The nodes of all trees one after the other: what each asks, where it leads and its targets. A leaf leads to itself.
pub(super) fn put(trees: &[Tree], tensors: &mut Tensors) {
    let (mut sizes, mut inputs, mut at) = (Vec::new(), Vec::new(), Vec::new());
    let (mut children, mut values) = (Vec::new(), Vec::new());
    for tree in trees {
        sizes.push(real(tree.splits.len()));
        for (node, split) in tree.splits.iter().enumerate() {
            let leaf = Split { input: 0, at: 0.0, below: node, above: node };
            let split = split.unwrap_or(leaf);
            inputs.push(real(split.input));
            at.push(split.at);
            children.extend([real(split.below), real(split.above)]);
        }
        values.extend_from_slice(&tree.values);
    }
    let n = inputs.len();
    let width = values.len() / n.max(1);
    let arrays = [
        ("sizes", vec![sizes.len()], sizes),
        ("inputs", vec![n], inputs),
        ("at", vec![n], at),
        ("children", vec![n, 2], children),
        ("values", vec![n, width], values),
    ];
    let arrays = arrays.map(|(name, shape, values)| (name.to_owned(), Data::F64(shape, values)));
    tensors.arrays.extend(arrays);
}

/// The trees; none if an array is not there, or a node leads nowhere or back.
///
/// - `width`: how many targets a node has.
pub(super) fn take(tensors: &mut Tensors, n_inputs: usize, width: usize) -> Option<Vec<Tree>> {
    let (_, sizes) = tensors.f64("sizes")?;
    let ((_, inputs), (_, at)) = (tensors.f64("inputs")?, tensors.f64("at")?);
    let ((_, children), (_, values)) = (tensors.f64("children")?, tensors.f64("values")?);
    let sizes: Vec<usize> = sizes.into_iter().map(count).collect::<Option<_>>()?;
    let n = inputs.len();
    let is_whole = sizes.iter().try_fold(0_usize, |sum, size| sum.checked_add(*size)) == Some(n)
        && (at.len(), children.len(), values.len()) == (n, 2 * n, n * width);
    if !is_whole {
        return None;
    }
    let (mut trees, mut first) = (Vec::new(), 0);
    for size in sizes {
        let split = |node: usize| {
            let i = first + node;
            let (below, above) = (count(children[2 * i])?, count(children[2 * i + 1])?);
            if (below, above) == (node, node) {
                return Some(None);
            }
            let split = Split { input: count(inputs[i])?, at: at[i], below, above };
            // Behind its own node, no way leads in circles.
            let leads = |to: usize| (node + 1..size).contains(&to);
            (split.input < n_inputs && leads(below) && leads(above)).then_some(Some(split))
        };
        let splits: Option<Vec<_>> = (0..size).map(split).collect();
        let splits = splits.filter(|splits| !splits.is_empty())?;
        let values = values[first * width..][..size * width].to_vec();
        trees.push(Tree { splits, values });
        first += size;
    }
    Some(trees)
}

/// A count that was stored as a number.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is seen to be one")]
fn count(x: f64) -> Option<usize> {
    (x.fract() == 0.0 && (0.0..=1e15).contains(&x)).then_some(x as usize)
}
