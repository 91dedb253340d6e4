"""Plans of an ignorant imitator by JAX: python benches/plans_jax.py [BATCH] [SECONDS]

Five autoregressive models (a GRU of 64 units from a given state, a head 64-64-32-4, four places of two numbers); a plan is
ten steps of Adam (0.1) up the least log density over members, of which the best is kept. Compiled, and mapped over members.
"""
import os, sys, time

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
import jax
import jax.numpy as jnp
import numpy as np

MEMBERS, PLACES, UNITS, STEPS, RATE = 5, 4, 64, 10, 0.1
batch = int(sys.argv[1]) if len(sys.argv) > 1 else 1
seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 3.0
rng = np.random.default_rng(0)


def drawn(*shape):
    return (rng.uniform(-1, 1, shape) / 8).astype(np.float32)


gates = 3 * UNITS
weights = [drawn(MEMBERS, *shape) for shape in [(2, gates), (1, gates), (UNITS, gates), (1, gates), (UNITS, 64), (1, 64), (64, 32), (1, 32), (32, 4), (1, 4)]]
states = rng.normal(size=(MEMBERS, batch, UNITS)).astype(np.float32)
start = rng.normal(size=(batch, PLACES, 2)).astype(np.float32)


def log_density(weights, state, plan):
    w_in, b_in, w_state, b_state, w1, b1, w2, b2, w3, b3 = weights
    h, last, total = state, jnp.zeros((batch, 2)), 0.0
    for t in range(PLACES):
        of_input, of_state = last @ w_in + b_in, h @ w_state + b_state
        reset = jax.nn.sigmoid(of_input[:, :UNITS] + of_state[:, :UNITS])
        update = jax.nn.sigmoid(of_input[:, UNITS : 2 * UNITS] + of_state[:, UNITS : 2 * UNITS])
        h = (1 - update) * jnp.tanh(of_input[:, 2 * UNITS :] + reset * of_state[:, 2 * UNITS :]) + update * h
        said = jax.nn.relu(jax.nn.relu(h @ w1 + b1) @ w2 + b2) @ w3 + b3
        std = jax.nn.softplus(said[:, 2:]) + 1e-3
        error = (plan[:, t] - last - said[:, :2]) / std
        total += (-0.5 * error**2 - jnp.log(std) - 0.9189385).sum(1)
        last = plan[:, t]
    return total


@jax.jit
def plan(weights, states, start):
    def worst(plan):
        return jax.vmap(log_density, in_axes=(0, 0, None))(weights, states, plan).min(0)

    def summed(plan):
        worth = worst(plan)
        return worth.sum(), worth

    climb = jax.value_and_grad(summed, has_aux=True)

    def step(i, carry):
        at, first, second, best, most = carry
        (_, worth), slope = climb(at)
        best = jnp.where((worth > most)[:, None, None], at, best)
        first, second, t = 0.9 * first + 0.1 * slope, 0.999 * second + 0.001 * slope**2, i + 1.0
        at += RATE * (first / (1 - 0.9**t)) / (jnp.sqrt(second / (1 - 0.999**t)) + 1e-8)
        return at, first, second, best, jnp.maximum(most, worth)

    zeros = jnp.zeros_like(start)
    at, _, _, best, most = jax.lax.fori_loop(0, STEPS, step, (start, zeros, zeros, start, jnp.full(batch, -jnp.inf)))
    return jnp.where((worst(at) > most)[:, None, None], at, best)


arrays = jax.tree.map(jnp.asarray, (weights, states, start))
for _ in range(3):
    plan(*arrays).block_until_ready()
n, before = 0, time.process_time()
while time.process_time() - before < seconds:
    plan(*arrays).block_until_ready()
    n += batch
print(f"batch {batch}: {n / (time.process_time() - before):.0f} plans/s of CPU; jax {jax.__version__}")
