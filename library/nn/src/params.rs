//! The parameters of networks as plain named arrays.

use super::optim::Moments;
use super::real::Real;

/// One array of parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Param<F> {
    /// Such as `0.weight`.
    pub name: String,
    /// Its shape.
    pub shape: Vec<usize>,
    /// Its numbers, last dimension fastest.
    pub value: Vec<F>,
    grad: Vec<F>,
    touched: bool,
    /// Whether training changes it.
    learns: bool,
    /// Whether the update at hand does.
    moves: bool,
}

impl<F> Param<F> {
    fn updates(&self) -> bool {
        self.touched && self.moves
    }
}

/// The place of an array among all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParamId(usize);

impl ParamId {
    /// Its number among all.
    pub(super) fn place(self) -> usize {
        self.0
    }
}

/// All parameters, in the order in which they were added.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Params<F> {
    arrays: Vec<Param<F>>,
    frozen: bool,
}

impl<F: Real> Params<F> {
    /// Adds an array that training changes.
    ///
    /// # Panics
    /// If the numbers are not as many as the shape says.
    pub fn add(&mut self, name: String, shape: Vec<usize>, value: Vec<F>) -> ParamId {
        self.push(name, shape, value, true)
    }

    /// Adds an array that training leaves as it is, such as that of a target network.
    ///
    /// # Panics
    /// If the numbers are not as many as the shape says.
    pub fn add_fixed(&mut self, name: String, shape: Vec<usize>, value: Vec<F>) -> ParamId {
        self.push(name, shape, value, false)
    }

    fn push(&mut self, name: String, shape: Vec<usize>, value: Vec<F>, learns: bool) -> ParamId {
        assert_eq!(shape.iter().product::<usize>(), value.len(), "as many numbers as `{name}` has");
        self.arrays.push(Param {
            name,
            shape,
            value,
            grad: Vec::new(),
            touched: false,
            learns,
            moves: true,
        });
        ParamId(self.arrays.len() - 1)
    }

    /// The places of all arrays.
    pub fn ids(&self) -> impl Iterator<Item = ParamId> + use<F> {
        (0..self.arrays.len()).map(ParamId)
    }

    /// The arrays.
    #[must_use]
    pub fn arrays(&self) -> &[Param<F>] {
        &self.arrays
    }

    /// The numbers of an array.
    #[must_use]
    pub fn value(&self, id: ParamId) -> &[F] {
        &self.arrays[id.0].value
    }

    /// The shape of an array.
    #[must_use]
    pub fn shape(&self, id: ParamId) -> &[usize] {
        &self.arrays[id.0].shape
    }

    /// The numbers of an array, to be changed.
    pub fn value_mut(&mut self, id: ParamId) -> &mut [F] {
        &mut self.arrays[id.0].value
    }

    /// The numbers of every array, to be changed.
    pub fn values_mut(&mut self) -> impl Iterator<Item = &mut [F]> {
        self.arrays.iter_mut().map(|array| &mut array.value[..])
    }

    /// The gradient of an array; `None` if none reached it.
    #[must_use]
    pub fn grad(&self, id: ParamId) -> Option<&[F]> {
        let array = &self.arrays[id.0];
        array.touched.then_some(&array.grad)
    }

    /// Lets only these arrays have gradients and updates, until told otherwise.
    pub(super) fn move_only(&mut self, ids: &[ParamId]) {
        self.arrays.iter_mut().for_each(|array| array.moves = false);
        for id in ids {
            self.arrays[id.0].moves = true;
        }
    }

    /// Every gradient there is.
    pub fn grads(&self) -> impl Iterator<Item = &[F]> {
        self.arrays.iter().filter(|array| array.updates()).map(|array| &array.grad[..])
    }

    /// Every gradient there is, to be changed.
    pub fn grads_mut(&mut self) -> impl Iterator<Item = &mut [F]> {
        self.arrays.iter_mut().filter(|array| array.updates()).map(|array| &mut array.grad[..])
    }

    /// Every array that has a gradient, with it and the moments of the same place.
    pub fn updates<'a>(
        &'a mut self,
        moments: &'a mut [Moments<F>],
    ) -> impl Iterator<Item = (&'a mut [F], &'a mut [F], &'a mut Moments<F>)> {
        let pairs = self.arrays.iter_mut().zip(moments).filter(|(array, _)| array.updates());
        pairs.map(|(array, moments)| (&mut array.value[..], &mut array.grad[..], moments))
    }

    /// Moments of zeros, as many as there are arrays; none for those that do not learn.
    #[must_use]
    pub fn moments(&self) -> Vec<Moments<F>> {
        let n = |array: &Param<F>| if array.learns { array.value.len() } else { 0 };
        self.arrays.iter().map(|array| Moments::zeros(n(array))).collect()
    }

    /// The numbers of one array, and those of another to be changed.
    pub(super) fn pair(&mut self, one: ParamId, other: ParamId) -> (&[F], &mut [F]) {
        let both = self.arrays.get_disjoint_mut([one.0, other.0]);
        let [one, other] = both.expect("they are two arrays");
        (&one.value, &mut other.value)
    }

    pub(super) fn learns(&self, id: ParamId) -> bool {
        self.arrays[id.0].learns
    }

    pub(super) fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    pub(super) fn forget_grads(&mut self) {
        self.arrays.iter_mut().for_each(|array| array.touched = false);
    }

    /// The buffer of a gradient, and whether it already holds one; `None` where none is wanted.
    pub(super) fn take_grad(&mut self, id: ParamId) -> Option<(Vec<F>, bool)> {
        let array = &mut self.arrays[id.0];
        (array.learns && !self.frozen).then(|| {
            let mut grad = std::mem::take(&mut array.grad);
            grad.resize(array.value.len(), F::zero());
            (grad, array.touched)
        })
    }

    pub(super) fn put_grad(&mut self, id: ParamId, grad: Vec<F>) {
        let array = &mut self.arrays[id.0];
        (array.grad, array.touched) = (grad, true);
    }
}
