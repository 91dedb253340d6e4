"""An update of ΨΦ-learning (Alg. 3) by JAX, at the widths of Table B.1 for Highway: `psi_phi_jax.py [N]`.

The update of library/src/agent/method/psi_phi.rs, on steps drawn from random data, all of it jitted. Prints milliseconds
of the processor and of the clock an update: the least of five turns of N updates.
"""

import os
import sys
import time

os.environ["XLA_FLAGS"] = (
    "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import jax
import jax.numpy as jnp
import numpy as np
import optax

SEES, ACTIONS, WIDTH, OTHERS, MEMBERS = 24, 9, 8, 5, 2
BATCH, N_STEP, DISCOUNT, EVERY = 512, 4, 1.0, 100
SPARSITY, RIDGE, KEPT = 0.05, 1e-4, 0.99
# Steps of the agent and of each of the others, and how many of each are drawn.
OWN, THEIRS = 2000, 4000
COUNTS = [BATCH * (k + 1) // OTHERS - BATCH * k // OTHERS for k in range(OTHERS)]

rng = np.random.default_rng(0)
normal = lambda *shape: jnp.asarray(rng.normal(size=shape), jnp.float32)
dense = lambda i, o: (normal(i, o) / i**0.5, jnp.zeros(o))
layers = lambda *w: [dense(i, o) for i, o in zip(w, w[1:])]
adam = optax.adam(1e-3)


def mlp(net, x):
    for w, b in net[:-1]:
        x = jax.nn.relu(x @ w + b)
    return x @ net[-1][0] + net[-1][1]


def torso(net, x):
    for w, b in net:
        x = jax.nn.relu(x @ w + b)
    return x


def vectors(x):
    return x.reshape(-1, ACTIONS, WIDTH)


def done(x, acts):
    return x[jnp.arange(len(acts)), acts]


def squares(errors):
    return jnp.mean(jnp.sum(errors**2, axis=1))


def huber(errors):
    size = jnp.abs(errors)
    return jnp.mean(jnp.where(size <= 1, 0.5 * errors**2, size - 0.5))


def cumulants(nets, z):
    return vectors(jnp.tanh(mlp(nets["phi"], z)))


def others(nets, target, steps):
    """Eqns. 4.17 and 4.18, of whom the steps are in turn."""
    seen, then, acts, next_acts, goes_on = steps
    z, z_next = torso(nets["torso"], seen), torso(target["torso"], then)
    phi = done(cumulants(nets, z), acts)
    sum, first = 0.0, 0
    for k, count in enumerate(COUNTS, 1):
        own = slice(first, first + count)
        first += count
        for m in range(MEMBERS):
            psi = vectors(mlp(nets["psi"][k][m], z[own]))
            next = vectors(mlp(target["psi"][k][m], z_next[own]))
            log_prob = done(jax.nn.log_softmax(psi @ nets["w"][k - 1]), acts[own])
            next = DISCOUNT * goes_on[own, None] * done(next, next_acts[own])
            next = jax.lax.stop_gradient(next)
            sum += squares(done(psi, acts[own]) - phi[own] - next) - jnp.mean(log_prob)
    return sum / MEMBERS


def loss(nets, target, task, own, shown):
    along, next, along_acts, weights, paid, rewards, discounts = own
    acts = along_acts[:, 0]
    z = torso(nets["torso"], along[:, 0])
    phi = done(cumulants(nets, z), acts)
    # What the task pays for, by least squares.
    fixed = jax.lax.stop_gradient(phi)
    products, sums, n = task
    products, sums, n = (
        KEPT * products + fixed.T @ fixed,
        KEPT * sums + fixed.T @ paid,
        KEPT * n + BATCH,
    )
    w = jnp.linalg.solve(products + RIDGE * n * jnp.eye(WIDTH), sums)
    reward = jnp.mean((phi @ w - paid) ** 2)
    later = along[:, 1:].reshape(-1, SEES)
    each = done(cumulants(nets, torso(nets["torso"], later)), along_acts[:, 1:].reshape(-1))
    each = each.reshape(BATCH, N_STEP - 1, WIDTH) * weights[:, 1:, None]
    summed = jax.lax.stop_gradient(phi + each.sum(1))
    z_next = torso(target["torso"], next)
    value, features = 0.0, 0.0
    for m in range(MEMBERS):
        psi = vectors(mlp(nets["psi"][0][m], z))
        after = vectors(mlp(target["psi"][0][m], z_next))
        best = jnp.argmax(after @ w, axis=1)
        goal = rewards + discounts * done(after @ w, best)
        value += huber(done(psi @ w, acts) - jax.lax.stop_gradient(goal)) / MEMBERS
        then = jax.lax.stop_gradient(discounts[:, None] * done(after, best))
        features += squares(done(psi, acts) - summed - then) / MEMBERS
    sparse = SPARSITY * sum(jnp.sum(jnp.abs(w)) for w in nets["w"])
    total = others(nets, target, shown) + reward + value + features / WIDTH + sparse
    return total, (products, sums, n)


def draw(key, replay, shown):
    """Steps of the agent, each with those behind it, and of others."""
    seen, acts, rewards, ends = replay
    mine, theirs = jax.random.split(key)
    at = jax.random.randint(mine, (BATCH,), 0, OWN - N_STEP)[:, None] + jnp.arange(N_STEP)
    goes_on = jnp.cumprod(1 - ends[at], axis=1)
    weights = jnp.concatenate([jnp.ones((BATCH, 1)), goes_on[:, :-1]], 1)
    weights *= DISCOUNT ** jnp.arange(N_STEP)
    own = (
        seen[at],
        seen[at[:, -1] + 1],
        acts[at],
        weights,
        rewards[at[:, 0]],
        (weights * rewards[at]).sum(1),
        DISCOUNT**N_STEP * goes_on[:, -1],
    )
    seen, acts, ends = shown
    first = jnp.repeat(jnp.arange(OTHERS) * THEIRS, jnp.array(COUNTS), total_repeat_length=BATCH)
    at = first + jax.random.randint(theirs, (BATCH,), 0, THEIRS - 1)
    return own, (seen[at], seen[at + 1], acts[at], acts[at + 1], 1 - ends[at])


def update(state, target, replay, shown, key):
    nets, moments, task = state
    steps = draw(key, replay, shown)
    slopes, task = jax.grad(loss, has_aux=True)(nets, target, task, *steps)
    moved, moments = adam.update(slopes, moments)
    return optax.apply_updates(nets, moved), moments, task


def main():
    head = lambda: layers(256, 256, 128, ACTIONS * WIDTH)
    nets = {
        "torso": layers(SEES, 512, 256),
        "phi": layers(256, 128, 128, ACTIONS * WIDTH),
        "psi": [[head() for _ in range(MEMBERS)] for _ in range(OTHERS + 1)],
        "w": [normal(WIDTH) / WIDTH**0.5 for _ in range(OTHERS)],
    }
    task = (jnp.zeros((WIDTH, WIDTH)), jnp.zeros(WIDTH), jnp.float32(0))
    acts = lambda n: jnp.asarray(rng.integers(0, ACTIONS, n), jnp.int32)
    ends = lambda n: jnp.asarray(rng.random(n) < 0.02, jnp.float32)
    replay = (normal(OWN + 1, SEES), acts(OWN), normal(OWN), ends(OWN))
    n = OTHERS * THEIRS
    shown = (normal(n, SEES), acts(n), ends(n))
    copied = jax.jit(lambda nets: jax.tree.map(jnp.copy, nets))
    target = copied(nets)
    step = jax.jit(update, donate_argnums=0)
    state = (nets, adam.init(nets), task)
    keys = jax.random.split(jax.random.key(0), EVERY)

    def turn(n):
        nonlocal state, target
        for t in range(n):
            state = step(state, target, replay, shown, keys[t % EVERY])
            if (t + 1) % EVERY == 0:
                target = copied(state[0])
        jax.block_until_ready(state)

    turn(5)
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    turns = []
    for _ in range(5):
        cpu, wall = time.process_time(), time.perf_counter()
        turn(n)
        turns.append((time.process_time() - cpu, time.perf_counter() - wall))
    cpu, wall = (1e3 * min(turn[i] for turn in turns) / n for i in (0, 1))
    print(f"psi_phi highway by JAX {jax.__version__}: {cpu:.2f} ms of CPU an update, {wall:.2f} ms by the clock")


main()
