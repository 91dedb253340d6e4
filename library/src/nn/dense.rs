//! A layer, as one operation on dfdx's tape: linear map, bias and activation.

use std::cell::RefCell;
use std::mem;
use std::rc::Rc;

use dfdx::prelude::{Cpu, HasShape, NoneTape, PutTape, SplitTape, Tape, Tensor, TensorFromVec};

use super::activation::Activation;
use super::matmul::{Matrix, multiply};

/// Row vectors, one a sample.
pub(super) type Batch<T = NoneTape> = Tensor<(usize, usize), f32, Cpu, T>;

/// The parameters of a layer and the gradients that the last backward pass left.
pub(super) struct Dense {
    /// `[n_in, n_out]`.
    pub(super) weight: Vec<f32>,
    /// `[n_out]`.
    pub(super) bias: Vec<f32>,
    /// What follows the linear map, if anything.
    pub(super) activation: Option<Rc<dyn Activation>>,
    /// Whether anything before this layer learns.
    pub(super) passes_gradient: bool,
    /// The gradients of `weight` and `bias`.
    pub(super) grads: RefCell<(Vec<f32>, Vec<f32>)>,
}

/// `ν(x W + b)` of each row `x`; its gradient joins the tape.
///
/// A layer may lie on a tape once: the backward pass overwrites its gradients.
pub(super) fn dense<T: Tape<f32, Cpu>>(x: Batch<T>, layer: &Rc<Dense>) -> Batch<T> {
    let (x, mut tape) = x.split_tape();
    let (n, n_in) = *x.shape();
    let n_out = layer.bias.len();
    let mut input = vec![0.0; n * n_in];
    x.copy_into(&mut input);
    let mut output = layer.bias.repeat(n);
    multiply(
        Matrix::new(&input, n, n_in),
        Matrix::new(&layer.weight, n_in, n_out),
        true,
        &mut output,
    );
    if let Some(activation) = &layer.activation {
        activation.apply(&mut output);
    }
    let y = x.device().tensor_from_vec(output.clone(), (n, n_out));
    let (handle, layer) = (y.clone(), Rc::clone(layer));
    tape.add_backward_op(move |grads| {
        let mut delta = mem::take(&mut **grads.get_or_alloc_mut(&handle)?);
        if let Some(activation) = &layer.activation {
            activation.backward(&output, &mut delta);
        }
        let (weight_grad, bias_grad) = &mut *layer.grads.borrow_mut();
        bias_grad.fill(0.0);
        for row in delta.chunks_exact(n_out) {
            bias_grad.iter_mut().zip(row).for_each(|(sum, d)| *sum += d);
        }
        let rows = Matrix::new(&delta, n, n_out);
        multiply(Matrix::new(&input, n, n_in).transposed(), rows, false, weight_grad);
        if layer.passes_gradient {
            let weight = Matrix::new(&layer.weight, n_in, n_out);
            multiply(rows, weight.transposed(), true, grads.get_or_alloc_mut(&x)?);
        }
        Ok(())
    });
    y.put_tape(tape)
}
