"""An update of the tables of C.2.1 by NumPy or JAX: `tabular.py numpy|jax`, microseconds an update."""

import sys
import time

import numpy as np

S, A, B, N, GAMMA, LR = 25, 4, 128, 500, 0.9, 5e-3
rng = np.random.default_rng(0)
s, a, n = rng.integers(S, size=N), rng.integers(A, size=N), rng.integers(S, size=N)
r, policy = np.zeros(N, np.float32), np.full((S, A), 0.25, np.float32)


def median(run, updates):
    times = []
    for _ in range(7):
        began = time.perf_counter()
        run(updates)
        times.append((time.perf_counter() - began) / updates * 1e6)
    return sorted(times)[3]


def by_numpy():
    def adam(table, grad, state, t):
        m, v = state
        m *= 0.9
        m += np.float32(0.1) * grad
        v *= 0.999
        v += np.float32(0.001) * grad * grad
        rate = np.float32(LR * np.sqrt(1 - 0.999**t) / (1 - 0.9**t))
        table -= rate * m / (np.sqrt(v) + np.float32(1e-8))

    def zeros(table):
        return np.zeros_like(table), np.zeros_like(table)

    def values(updates):
        q = rng.standard_normal((S, A)).astype(np.float32)
        state = zeros(q)
        for t in range(1, updates + 1):
            i = rng.permutation(N)[:B] if t % 3 == 1 else np.roll(i, 1)
            target = r[i] + GAMMA * (policy[n[i]] * q[n[i]]).sum(1)
            grad = np.zeros_like(q)
            np.add.at(grad, (s[i], a[i]), 2 / B * (q[s[i], a[i]] - target))
            adam(q, grad, state, t)

    def model(updates):
        logits = rng.standard_normal((S * A, S)).astype(np.float32)
        state = zeros(logits)
        for t in range(1, updates + 1):
            i = rng.permutation(N)[:B] if t % 3 == 1 else np.roll(i, 1)
            row = logits[s[i] * A + a[i]]
            p = np.exp(row - row.max(1, keepdims=True))
            p /= p.sum(1, keepdims=True)
            p[np.arange(B), n[i]] -= 1
            grad = np.zeros_like(logits)
            np.add.at(grad, s[i] * A + a[i], p / B)
            adam(logits, grad, state, t)

    return median(values, 2000), median(model, 2000)


def by_jax():
    import jax
    import jax.numpy as jnp

    def trained(loss, shape):
        @jax.jit
        def run(table, m, v, order):
            def update(carry, x):
                table, m, v = carry
                t, i = x
                grad = jax.grad(loss)(table, i)
                m, v = 0.9 * m + 0.1 * grad, 0.999 * v + 0.001 * grad * grad
                rate = LR * jnp.sqrt(1 - 0.999**t) / (1 - 0.9**t)
                return (table - rate * m / (jnp.sqrt(v) + 1e-8), m, v), None

            steps = jnp.arange(1, order.shape[0] + 1)
            return jax.lax.scan(update, (table, m, v), (steps, order))[0][0]

        table = jnp.asarray(rng.standard_normal(shape), jnp.float32)
        order = np.stack([rng.permutation(N)[:B] for _ in range(2000)])
        zeros = jnp.zeros_like(table)
        run(table, zeros, zeros, order).block_until_ready()
        return median(lambda _: run(table, zeros, zeros, order).block_until_ready(), 2000)

    def values(q, i):
        target = jax.lax.stop_gradient(r[i] + GAMMA * (policy[n[i]] * q[n[i]]).sum(1))
        return jnp.mean((q[s[i], a[i]] - target) ** 2)

    def model(logits, i):
        return -jnp.mean(jax.nn.log_softmax(logits[s[i] * A + a[i]])[jnp.arange(B), n[i]])

    globals().update({k: jnp.asarray(globals()[k]) for k in ("s", "a", "n", "r", "policy")})
    return trained(values, (S, A)), trained(model, (S * A, S))


values, model = by_jax() if sys.argv[1] == "jax" else by_numpy()
print(f"values {values:.2f} us an update")
print(f"model  {model:.2f} us an update")
