"""The five workloads of library/benches/steps.rs by JAX (jit) or PyTorch: numerics.py jax|torch W1.

Prints milliseconds a step: the median of batches of steps, on one thread.
"""

import os
import sys
import time

FRAMEWORK, WORKLOAD = sys.argv[1:3]
os.environ["XLA_FLAGS"] = (
    "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)


def median(step, wait=lambda: None, seconds=2.0):
    def batch(n):
        began = time.perf_counter()
        for _ in range(n):
            step()
        wait()
        return (time.perf_counter() - began) / n

    batch(5)
    n = max(1, int(0.05 / batch(10)))
    times, began = [], time.perf_counter()
    while len(times) < 5 or time.perf_counter() - began < seconds:
        times.append(batch(n))
    times.sort()
    return 1e3 * times[len(times) // 2], 1e3 * times[0]


def by_jax():
    import jax
    import jax.numpy as jnp
    import numpy as np

    rng = np.random.default_rng(0)
    normal = lambda *shape: jnp.asarray(rng.normal(size=shape), jnp.float32)
    dense = lambda i, o: (normal(i, o) / i**0.5, jnp.zeros(o))
    layers = lambda *w: [dense(i, o) for i, o in zip(w, w[1:])]

    def forward(net, x, curve):
        for w, b in net[:-1]:
            x = curve(x @ w + b)
        return x @ net[-1][0] + net[-1][1]

    def q_loss(q, online, target, now, then):
        action, reward, going = jnp.arange(32) % 2, normal(32), jnp.arange(32) % 10 != 0

        def loss(net):
            goal = reward + 0.99 * going * q(target, then).max(1)
            error = q(net, now)[jnp.arange(32), action] - jax.lax.stop_gradient(goal)
            size = jnp.abs(error)
            return jnp.mean(jnp.where(size < 1, 0.5 * error**2, size - 0.5))

        return online, loss, 0.0

    def conv(net, x):
        kernels, bias, rest = net
        x = jax.lax.conv_general_dilated(x, kernels, (1, 1), "VALID") + bias[:, None, None]
        return forward(rest, jax.nn.relu(x).reshape(32, -1), jax.nn.relu)

    def gru(params, x, y):
        encoder, (wi, bi), (wh, bh), head = params
        before = jnp.concatenate([jnp.zeros((1, 64, 2)), y[:-1]])

        def step(h, pair):
            previous, y = pair
            a, b = previous @ wi + bi, h @ wh + bh
            r = jax.nn.sigmoid(a[:, :64] + b[:, :64])
            z = jax.nn.sigmoid(a[:, 64:128] + b[:, 64:128])
            new = jnp.tanh(a[:, 128:] + r * b[:, 128:])
            h = (1 - z) * new + z * h
            out = h @ head[0] + head[1]
            error = (y - previous - out[:, :2]) * jnp.exp(-out[:, 2:])
            return h, (0.5 * error**2 + out[:, 2:]).sum(1).mean()

        return jax.lax.scan(step, forward(encoder, x, jax.nn.relu), (before, y))[1].sum()

    if WORKLOAD == "W1":
        x = jnp.linspace(-1, 1, 32)[:, None]
        loss = lambda net: jnp.mean((forward(net, x, jnp.tanh) - jnp.sin(3 * x)) ** 2)
        params, loss, decay = layers(1, 1024, 1024, 1), loss, 1e-4
    elif WORKLOAD == "W2":
        x, y = normal(512, 24), jnp.arange(512) % 9

        def loss(net):
            log_probs = jax.nn.log_softmax(forward(net, x, jax.nn.relu))
            return -jnp.mean(log_probs[jnp.arange(512), y])

        params, decay = layers(24, 512, 256, 9), 0.0
    elif WORKLOAD == "W3":
        net = lambda: (normal(16, 4, 3, 3) * 0.1, jnp.zeros(16), layers(1024, 128, 6))
        states = normal(32, 4, 10, 10), normal(32, 4, 10, 10)
        params, loss, decay = q_loss(conv, net(), net(), *states)
    elif WORKLOAD == "W4":
        x, y = normal(64, 200), normal(20, 64, 2)
        params = (layers(200, 128, 64), dense(2, 192), dense(64, 192), dense(64, 4))
        loss, decay = (lambda params: gru(params, x, y)), 0.0
    else:
        q = lambda net, x: forward(net, x, jax.nn.relu)
        net = lambda: layers(4, 64, 64, 2)
        params, loss, decay = q_loss(q, net(), net(), normal(32, 4), normal(32, 4))

    def update(state):
        params, m, v, t = state
        t, tree = t + 1, jax.tree.map
        g = jax.grad(loss)(params)
        m = tree(lambda m, g: 0.9 * m + 0.1 * g, m, g)
        v = tree(lambda v, g: 0.999 * v + 0.001 * g * g, v, g)
        a, b = 1e-3 / (1 - 0.9**t), 1 / (1 - 0.999**t)
        move = lambda p, m, v: p - 1e-3 * decay * p - a * m / (jnp.sqrt(v * b) + 1e-8)
        return tree(move, params, m, v), m, v, t

    zeros = lambda: jax.tree.map(jnp.zeros_like, params)
    state = [(params, zeros(), zeros(), jnp.float32(0))]
    step = jax.jit(update, donate_argnums=0)

    def once():
        state[0] = step(state[0])

    return median(once, lambda: jax.block_until_ready(state[0]))


def by_torch():
    import torch
    from torch import nn
    from torch.nn import functional as f

    torch.set_num_threads(1)
    torch.manual_seed(0)

    def mlp(widths, curve):
        parts = []
        for i, o in zip(widths, widths[1:]):
            parts += [nn.Linear(i, o), curve()]
        return nn.Sequential(*parts[:-1])

    def q_loss(online, target, now, then):
        action, reward = (torch.arange(32) % 2)[:, None], torch.randn(32)
        going = (torch.arange(32) % 10 != 0).float()

        def loss():
            with torch.no_grad():
                goal = reward + 0.99 * going * target(then).max(1).values
            return f.smooth_l1_loss(online(now).gather(1, action).squeeze(1), goal)

        return online, loss

    decay = 0.0
    if WORKLOAD == "W1":
        net, x = mlp([1, 1024, 1024, 1], nn.Tanh), torch.linspace(-1, 1, 32)[:, None]
        y, decay = torch.sin(3 * x), 0.1
        loss = lambda: f.mse_loss(net(x), y)
    elif WORKLOAD == "W2":
        net, x, y = mlp([24, 512, 256, 9], nn.ReLU), torch.randn(512, 24), torch.arange(512) % 9
        loss = lambda: f.cross_entropy(net(x), y)
    elif WORKLOAD == "W3":

        def conv():
            head = mlp([1024, 128, 6], nn.ReLU)
            return nn.Sequential(nn.Conv2d(4, 16, 3), nn.ReLU(), nn.Flatten(), *head)

        net, loss = q_loss(conv(), conv(), torch.randn(32, 4, 10, 10), torch.randn(32, 4, 10, 10))
    elif WORKLOAD == "W4":
        encoder, cell, head = mlp([200, 128, 64], nn.ReLU), nn.GRUCell(2, 64), nn.Linear(64, 4)
        net = nn.ModuleList([encoder, cell, head])
        x, ys = torch.randn(64, 200), torch.randn(20, 64, 2)

        def loss():
            h, previous, total = encoder(x), torch.zeros(64, 2), 0.0
            for y in ys:
                h = cell(previous, h)
                out = head(h)
                error = (y - previous - out[:, :2]) * torch.exp(-out[:, 2:])
                total = total + (0.5 * error**2 + out[:, 2:]).sum(1).mean()
                previous = y
            return total

    else:
        tiny = lambda: mlp([4, 64, 64, 2], nn.ReLU)
        net, loss = q_loss(tiny(), tiny(), torch.randn(32, 4), torch.randn(32, 4))
    optimiser = torch.optim.AdamW(net.parameters(), lr=1e-3, weight_decay=decay, fused=True)

    def step():
        optimiser.zero_grad(set_to_none=True)
        loss().backward()
        optimiser.step()

    return median(step)


middle, fastest = by_jax() if FRAMEWORK == "jax" else by_torch()
print(f"{WORKLOAD} {middle:.4f} ms a step (from {fastest:.4f})")
