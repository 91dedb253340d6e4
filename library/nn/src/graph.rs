//! One pass through networks: values, their gradients, and dfdx's tape of what to undo.
//!
//! Values and gradients lie in buffers that are used again from pass to pass, in the order in
//! which they are asked for. So a training that does the same at every step allocates nothing
//! after the first, but for the tape's closures.

use std::cell::{Cell, RefCell, RefMut};
use std::rc::Rc;

use dfdx::prelude::{Backward as _, Cpu, OwnedTape, PutTape as _, Tape as _, TensorFrom as _};

use super::params::{ParamId, Params};
use super::real::Real;

/// The shape of a batch: so many items of channels, rows and columns. A vector is an item of
/// as many channels as it is long, with one row and one column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// How many items.
    pub n: usize,
    /// Channels, rows and columns of each.
    pub item: [usize; 3],
}

impl Shape {
    /// `n` vectors.
    #[must_use]
    pub fn vectors(n: usize, len: usize) -> Self {
        Self { n, item: [len, 1, 1] }
    }

    /// How many numbers an item has.
    #[must_use]
    pub fn width(&self) -> usize {
        self.item.iter().product()
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n * self.width()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// How many operations a tape of dfdx has, which keeps no room from pass to pass: with the one
/// that starts it there are 32, in less than a kilobyte.
const TAPE: usize = 31;

/// A value of the pass at hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Var(usize);

/// The buffers of one value.
#[derive(Debug)]
struct Slot<F> {
    shape: Shape,
    value: Vec<F>,
    grad: Vec<F>,
    /// Whether anything that it was made of learns.
    learns: bool,
    /// Whether `grad` is of this pass.
    touched: bool,
}

/// The buffers of a pass, and the parameters of the networks.
#[derive(Debug)]
pub(super) struct Arena<F> {
    slots: Vec<Slot<F>>,
    used: usize,
    pub(super) params: Params<F>,
}

impl<F: Real> Arena<F> {
    pub(super) fn value(&self, var: Var) -> &[F] {
        &self.slots[var.0].value
    }

    pub(super) fn shape(&self, var: Var) -> Shape {
        self.slots[var.0].shape
    }

    /// Lets `write` replace the gradient of a value that learns, or add to it where it is told
    /// to. `len` numbers.
    pub(super) fn pass(&mut self, var: Var, write: impl FnOnce(&Self, &mut [F], bool)) {
        let slot = &mut self.slots[var.0];
        if !slot.learns {
            return;
        }
        let (mut grad, add) = (std::mem::take(&mut slot.grad), slot.touched);
        grad.resize(slot.value.len(), F::zero());
        write(self, &mut grad, add);
        let slot = &mut self.slots[var.0];
        (slot.grad, slot.touched) = (grad, true);
    }

    /// The same for a parameter.
    pub(super) fn learn(&mut self, id: ParamId, write: impl FnOnce(&Self, &mut [F], bool)) {
        let Some((mut grad, add)) = self.params.take_grad(id) else { return };
        write(self, &mut grad, add);
        self.params.put_grad(id, grad);
    }

    /// A buffer of the pass, with what it held before.
    fn slot(&mut self, shape: Shape, learns: bool) -> Var {
        let var = Var(self.used);
        self.used += 1;
        if self.slots.len() == var.0 {
            let (value, grad) = (Vec::new(), Vec::new());
            self.slots.push(Slot { shape, value, grad, learns, touched: false });
        }
        let slot = &mut self.slots[var.0];
        (slot.shape, slot.learns, slot.touched) = (shape, learns, false);
        slot.value.resize(shape.len(), F::zero());
        var
    }
}

/// A pass through networks.
///
/// Values are made by its operations; [`Graph::backward`] leaves gradients in the parameters and in the
/// values that learn. [`Graph::begin`] starts the next pass.
#[derive(Debug)]
pub struct Graph<F: Real> {
    arena: Rc<RefCell<Arena<F>>>,
    /// What undoes the pass, from its beginning, on tapes of [`TAPE`] operations.
    tapes: RefCell<Vec<OwnedTape<F, Cpu>>>,
    recorded: Cell<usize>,
    records: Cell<bool>,
    trains: Cell<bool>,
}

impl<F: Real> Graph<F> {
    /// Passes through networks of these parameters.
    #[must_use]
    pub fn new(params: Params<F>) -> Self {
        let arena = Arena { slots: Vec::new(), used: 0, params };
        Self {
            arena: Rc::new(RefCell::new(arena)),
            tapes: RefCell::default(),
            recorded: Cell::new(0),
            records: Cell::new(true),
            trains: Cell::new(true),
        }
    }

    /// Begins a pass: values of the one before are gone, and gradients are none.
    pub fn begin(&self) {
        self.forget();
        let mut arena = self.arena.borrow_mut();
        arena.used = 0;
        arena.params.forget_grads();
    }

    /// The parameters.
    pub fn params(&self) -> RefMut<'_, Params<F>> {
        RefMut::map(self.arena.borrow_mut(), |arena| &mut arena.params)
    }

    /// What `pass` makes, without a gradient: `stop_gradient` around all of it.
    pub fn still<R>(&self, pass: impl FnOnce() -> R) -> R {
        let before = self.records.replace(false);
        let made = pass();
        self.records.set(before);
        made
    }

    /// What `pass` makes, with gradients for values but none for parameters: for planning
    /// through learned networks.
    pub fn frozen<R>(&self, pass: impl FnOnce() -> R) -> R {
        let before = self.trains.replace(false);
        let made = pass();
        self.trains.set(before);
        made
    }

    /// Numbers from outside.
    ///
    /// # Panics
    /// If they are not as many as the shape says.
    pub fn input(&self, shape: Shape, values: &[F]) -> Var {
        self.leaf(shape, values, false)
    }

    /// Numbers from outside whose gradient is wanted.
    ///
    /// # Panics
    /// If they are not as many as the shape says.
    pub fn variable(&self, shape: Shape, values: &[F]) -> Var {
        self.leaf(shape, values, true)
    }

    /// Numbers from outside, written by `write`, which must replace them all.
    pub fn filled(&self, shape: Shape, write: impl FnOnce(&mut [F])) -> Var {
        self.made(shape, false, |_, out| write(out))
    }

    fn leaf(&self, shape: Shape, values: &[F], learns: bool) -> Var {
        assert_eq!(shape.len(), values.len(), "as many numbers as the shape says");
        let mut arena = self.arena.borrow_mut();
        let var = arena.slot(shape, learns);
        arena.slots[var.0].value.copy_from_slice(values);
        var
    }

    /// A copy of a value through which no gradient passes.
    pub fn stop_gradient(&self, x: Var) -> Var {
        let mut arena = self.arena.borrow_mut();
        let shape = arena.shape(x);
        let var = arena.slot(shape, false);
        let (before, after) = arena.slots.split_at_mut(var.0);
        after[0].value.copy_from_slice(&before[x.0].value);
        var
    }

    /// The shape of a value.
    #[must_use]
    pub fn shape(&self, var: Var) -> Shape {
        self.arena.borrow().shape(var)
    }

    /// A copy of the numbers of a value.
    #[must_use]
    pub fn value(&self, var: Var) -> Vec<F> {
        self.arena.borrow().value(var).to_vec()
    }

    /// The numbers of a value, copied over others.
    pub fn read(&self, var: Var, into: &mut Vec<F>) {
        into.clear();
        into.extend_from_slice(self.arena.borrow().value(var));
    }

    /// The only number of a value.
    ///
    /// # Panics
    /// If it has others.
    #[must_use]
    pub fn scalar(&self, var: Var) -> F {
        let arena = self.arena.borrow();
        let [x] = arena.value(var) else { panic!("a scalar has one number") };
        *x
    }

    /// A copy of the gradient that [`Graph::backward`] left in a value; zeros if none reached
    /// it.
    #[must_use]
    pub fn grad(&self, var: Var) -> Vec<F> {
        let arena = self.arena.borrow();
        let slot = &arena.slots[var.0];
        if slot.touched { slot.grad.clone() } else { vec![F::zero(); slot.value.len()] }
    }

    /// The gradients of a scalar, by all that it was made of and learns.
    ///
    /// # Panics
    /// If it is no scalar.
    pub fn backward(&self, loss: Var) {
        {
            let mut arena = self.arena.borrow_mut();
            assert_eq!(arena.shape(loss).len(), 1, "only a scalar has a gradient");
            arena.pass(loss, |_, grad, add| {
                grad[0] = if add { grad[0] + F::one() } else { F::one() };
            });
        }
        // dfdx runs a tape from a scalar of its own; ours is where the gradient starts.
        for tape in self.tapes.borrow_mut().drain(..).rev() {
            Cpu::default().tensor(F::zero()).put_tape(tape).backward();
        }
        self.forget();
    }

    fn forget(&self) {
        self.tapes.borrow_mut().clear();
        self.recorded.set(0);
    }

    /// A buffer for what an operation keeps between forward and backward pass, filled by
    /// `write`.
    pub(super) fn keep(&self, len: usize, write: impl FnOnce(&Arena<F>, &mut [F])) -> Var {
        self.made(Shape::vectors(1, len), false, write)
    }

    /// A value made of others by `forward`. `backward` is given its numbers and its
    /// gradient, which it may change, and passes gradients on.
    pub(super) fn op(
        &self,
        shape: Shape,
        of: &[Var],
        params: &[ParamId],
        forward: impl FnOnce(&Arena<F>, &mut [F]),
        backward: impl FnOnce(&mut Arena<F>, &[F], &mut [F]) + 'static,
    ) -> Var {
        let learns = self.records.get() && {
            let arena = self.arena.borrow();
            of.iter().any(|var| arena.slots[var.0].learns)
                || (self.trains.get() && params.iter().any(|id| arena.params.learns(*id)))
        };
        let var = self.made(shape, learns, forward);
        if learns {
            let arena = Rc::clone(&self.arena);
            let frozen = !self.trains.get();
            let mut tapes = self.tapes.borrow_mut();
            let place = self.recorded.replace(self.recorded.get() + 1);
            if place.is_multiple_of(TAPE) {
                tapes.push(OwnedTape::default());
            }
            let tape = tapes.last_mut().expect("the first operation began one");
            tape.add_backward_op(move |_| {
                let mut arena = arena.borrow_mut();
                let slot = &mut arena.slots[var.0];
                if slot.touched {
                    let (value, mut grad) =
                        (std::mem::take(&mut slot.value), std::mem::take(&mut slot.grad));
                    arena.params.freeze(frozen);
                    backward(&mut arena, &value, &mut grad);
                    arena.params.freeze(false);
                    let slot = &mut arena.slots[var.0];
                    (slot.value, slot.grad) = (value, grad);
                }
                Ok(())
            });
        }
        var
    }

    /// The same with a buffer from [`Graph::keep`] to work in, both times.
    pub(super) fn op_with(
        &self,
        scratch: Var,
        shape: Shape,
        of: &[Var],
        params: &[ParamId],
        forward: impl FnOnce(&Arena<F>, &mut [F], &mut [F]),
        backward: impl FnOnce(&mut Arena<F>, &mut [F], &[F], &mut [F]) + 'static,
    ) -> Var {
        let mut work = std::mem::take(&mut self.arena.borrow_mut().slots[scratch.0].value);
        let var = self.op(
            shape,
            of,
            params,
            |arena, out| forward(arena, &mut work, out),
            move |arena, y, grad| {
                let mut work = std::mem::take(&mut arena.slots[scratch.0].value);
                backward(arena, &mut work, y, grad);
                arena.slots[scratch.0].value = work;
            },
        );
        self.arena.borrow_mut().slots[scratch.0].value = work;
        var
    }

    /// Replaces each number of a parameter by what `f` makes of it and the number of a value.
    pub(super) fn remember(&self, of: Var, id: ParamId, f: impl Fn(F, F) -> F) {
        let mut arena = self.arena.borrow_mut();
        let Arena { slots, params, .. } = &mut *arena;
        let kept = params.value_mut(id).iter_mut();
        kept.zip(&slots[of.0].value).for_each(|(kept, &x)| *kept = f(*kept, x));
    }

    /// Where the buffers of values lie, to see that they stay there.
    #[cfg(test)]
    pub(super) fn places(&self) -> Vec<*const F> {
        let arena = self.arena.borrow();
        arena.slots.iter().flat_map(|slot| [slot.value.as_ptr(), slot.grad.as_ptr()]).collect()
    }

    fn made(&self, shape: Shape, learns: bool, write: impl FnOnce(&Arena<F>, &mut [F])) -> Var {
        let mut arena = self.arena.borrow_mut();
        let var = arena.slot(shape, learns);
        let mut value = std::mem::take(&mut arena.slots[var.0].value);
        write(&arena, &mut value);
        arena.slots[var.0].value = value;
        var
    }
}
