//! The loops of a gated recurrent unit, one gate each: as functions of slices that do not overlap they run in vector
//! registers.

use crate::real::{Real, sigmoid, wide};

/// Rows of the gates of items, `r`, `z` and `n` one after the other in each.
type Gates<'a, F> = &'a [F];

/// One step of a gated recurrent unit from `x W + b` and `h U + b`, whose rows may be longer than three gates.
///
/// ```text
/// r = σ(a_r + b_r),  z = σ(a_z + b_z),  n = tanh(a_n + r ⊙ b_n),  h' = (1 - z) ⊙ n + z ⊙ h
/// ```
pub(crate) fn forward<F: Real>(
    units: usize,
    (of_x, of_h, gates): (Gates<'_, F>, Gates<'_, F>, &mut [F]),
    h: &[F],
    out: &mut [F],
) {
    let width = gates.len() / (h.len() / units);
    let rows = of_x.chunks_exact(width).zip(of_h.chunks_exact(width));
    let rows = rows.zip(h.chunks_exact(units).zip(out.chunks_exact_mut(units)));
    wide(
        #[inline(always)]
        || {
            for (gates, ((a, b), (h, out))) in gates.chunks_exact_mut(width).zip(rows) {
                let (open, new) = gates[..3 * units].split_at_mut(2 * units);
                sigmoids(&a[..2 * units], &b[..2 * units], open);
                candidates(&a[2 * units..3 * units], &b[2 * units..3 * units], &open[..units], new);
                mix(&open[units..], new, h, out);
            }
        },
    );
}

/// Passes the gradient of `h'`, in rows that may be longer, back to `x W + b` and to `h U + b`.
pub(crate) fn backward<F: Real>(
    units: usize,
    (gates, of_h): (Gates<'_, F>, Gates<'_, F>),
    h: &[F],
    grad: &[F],
    (by_x, by_h): (&mut [F], &mut [F]),
) {
    let items = h.len() / units;
    let (width, of_grad) = (gates.len() / items, grad.len() / items);
    let rows = gates.chunks_exact(width).zip(of_h.chunks_exact(width));
    let rows = rows.zip(h.chunks_exact(units).zip(grad.chunks_exact(of_grad)));
    let outs = by_x.chunks_exact_mut(width).zip(by_h.chunks_exact_mut(width));
    wide(
        #[inline(always)]
        || {
            for ((by_x, by_h), ((gates, of_h), (h, grad))) in outs.zip(rows) {
                let (r, rest) = gates[..3 * units].split_at(units);
                let (z, new) = rest.split_at(units);
                let grad = &grad[..units];
                by_reset((grad, z, new), &of_h[2 * units..3 * units], r, false, &mut by_x[..units]);
                by_update(grad, (z, new), h, false, &mut by_x[units..2 * units]);
                let (open, last) = by_x[..3 * units].split_at_mut(2 * units);
                by_candidate((grad, z, new), r, false, false, last);
                by_h[..2 * units].copy_from_slice(open);
                by_candidate((grad, z, new), r, true, false, &mut by_h[2 * units..3 * units]);
            }
        },
    );
}

/// Replaces the gradient of `h'` by its part that `z ⊙ h` passes to `h`.
pub(crate) fn carry<F: Real>(units: usize, gates: Gates<'_, F>, grad: &mut [F], items: usize) {
    let (width, of_grad) = (gates.len() / items, grad.len() / items);
    let rows = grad.chunks_exact_mut(of_grad).zip(gates.chunks_exact(width));
    wide(
        #[inline(always)]
        || {
            for (grad, gates) in rows {
                grad[..units].iter_mut().zip(&gates[units..]).for_each(|(grad, z)| *grad *= *z);
            }
        },
    );
}

#[inline(always)]
pub(super) fn sigmoids<F: Real>(a: &[F], b: &[F], out: &mut [F]) {
    for (out, (&a, &b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = sigmoid(a + b);
    }
}

#[inline(always)]
pub(super) fn candidates<F: Real>(a: &[F], b: &[F], r: &[F], out: &mut [F]) {
    for (out, ((&a, &b), &r)) in out.iter_mut().zip(a.iter().zip(b).zip(r)) {
        *out = (a + r * b).hyperbolic_tangent();
    }
}

#[inline(always)]
pub(super) fn mix<F: Real>(z: &[F], new: &[F], h: &[F], out: &mut [F]) {
    for (out, ((&z, &new), &h)) in out.iter_mut().zip(z.iter().zip(new).zip(h)) {
        *out = (F::one() - z) * new + z * h;
    }
}

#[inline(always)]
fn put<F: Real>(new: F, add: bool, out: &mut F) {
    *out = if add { *out + new } else { new };
}

/// The gradient before the candidate's tanh.
#[inline(always)]
fn at_candidate<F: Real>(grad: F, z: F, new: F) -> F {
    grad * (F::one() - z) * (F::one() - new * new)
}

#[inline(always)]
pub(super) fn by_reset<F: Real>(
    (grad, z, new): (&[F], &[F], &[F]),
    of_h: &[F],
    r: &[F],
    add: bool,
    out: &mut [F],
) {
    let inputs = grad.iter().zip(z).zip(new).zip(of_h.iter().zip(r));
    for (out, (((&grad, &z), &new), (&of_h, &r))) in out.iter_mut().zip(inputs) {
        put(at_candidate(grad, z, new) * of_h * r * (F::one() - r), add, out);
    }
}

#[inline(always)]
pub(super) fn by_update<F: Real>(
    grad: &[F],
    (z, new): (&[F], &[F]),
    h: &[F],
    add: bool,
    out: &mut [F],
) {
    let inputs = grad.iter().zip(z).zip(new.iter().zip(h));
    for (out, ((&grad, &z), (&new, &h))) in out.iter_mut().zip(inputs) {
        put(grad * (h - new) * z * (F::one() - z), add, out);
    }
}

#[inline(always)]
pub(super) fn by_candidate<F: Real>(
    (grad, z, new): (&[F], &[F], &[F]),
    r: &[F],
    by_state: bool,
    add: bool,
    out: &mut [F],
) {
    let inputs = grad.iter().zip(z).zip(new.iter().zip(r));
    for (out, ((&grad, &z), (&new, &r))) in out.iter_mut().zip(inputs) {
        let slope = at_candidate(grad, z, new);
        put(if by_state { slope * r } else { slope }, add, out);
    }
}

#[inline(always)]
pub(super) fn by_state<F: Real>(grad: &[F], z: &[F], add: bool, out: &mut [F]) {
    for (out, (&grad, &z)) in out.iter_mut().zip(grad.iter().zip(z)) {
        put(grad * z, add, out);
    }
}
