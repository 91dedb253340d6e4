"""How often the best test can find a normal difference that Student's t finds in four of five samples, if it may be wrong
so often on normal differences and on skewed ones of no mean: the bound of docs/claims.md, by Neyman and Pearson's lemma.

    python3 benches/bound.py 5        needs NumPy
"""

import math
import sys

import numpy as np

n = int(sys.argv[1]) if len(sys.argv) > 1 else 5
rng = np.random.default_rng(0)
N_SAMPLES = 20_000


def t(x):
    return x.mean(1) / (x.std(1, ddof=1) / np.sqrt(n))


critical = np.quantile(t(rng.standard_normal((400_000, n))), 0.025)
normal = rng.standard_normal((200_000, n))
low, high = 0.0, 5.0
for _ in range(40):
    effect = (low + high) / 2
    low, high = (effect, high) if (t(normal - effect) < critical).mean() < 0.8 else (low, effect)


def log_normal(x, mean):
    return (-0.5 * (x - mean) ** 2 - 0.5 * math.log(2 * math.pi)).sum(-1)


def log_chi(x):
    y = np.maximum(x + 1, 1e-300)
    return np.where(x > -1, -y / 2 - 0.5 * np.log(2 * math.pi * y), -np.inf).sum(-1)


def density(directions, log_density, edge):
    """Of samples whatever their scale: the density of their direction, integrated over the scale."""
    out = np.empty(len(directions))
    for i in range(0, len(directions), 500):
        u = directions[i : i + 500]
        if edge is None:
            s = np.linspace(-8, 4, 400)
            r = np.exp(s)[None] * np.sqrt(n) * np.ones((len(u), 1))
            width = r * (s[1] - s[0])
        else:  # the density ends at -edge, and is not bounded there
            most = (-u).max(1)
            furthest = np.where(most > 0, edge / np.maximum(most, 1e-12), 60.0 * edge * n)
            s = np.linspace(-12, 40, 800)
            share, rest = 1 / (1 + np.exp(-s)), 1 / (1 + np.exp(s))
            r = furthest[:, None] * share
            width = furthest[:, None] * share * rest * (s[1] - s[0])
        logs = log_density(r[:, :, None] * u[:, None]) + (n - 1) * np.log(r)
        out[i : i + 500] = (np.exp(np.minimum(logs, 600)) * width).sum(1)
    return out


samples = {
    "effect": rng.standard_normal((N_SAMPLES, n)) - effect,
    "normal": rng.standard_normal((N_SAMPLES, n)),
    "skewed": rng.standard_normal((N_SAMPLES, n)) ** 2 - 1,
}
laws = {
    "effect": (lambda x: log_normal(x, -effect), None),
    "normal": (lambda x: log_normal(x, 0), None),
    "skewed": (log_chi, 1.0),
}
directions = {k: x / np.linalg.norm(x, axis=1, keepdims=True) for k, x in samples.items()}
densities = {k: {law: density(u, *laws[law]) for law in laws} for k, u in directions.items()}
for limit in [0.04, 0.05, 0.06, 0.07, 0.08, 0.1]:
    limits, weights = {"normal": 0.025, "skewed": limit}, {"normal": 1.0, "skewed": 1.0}
    for step in range(3000):
        decided = {
            k: (own["effect"] > sum(w * own[law] for law, w in weights.items())).mean()
            for k, own in densities.items()
        }
        for law in weights:
            ratio = math.log((decided[law] + 1e-5) / limits[law])
            weights[law] = max(weights[law] * math.exp(0.3 / (1 + step / 100) * ratio), 1e-9)
    print(f"n = {n}: wrong in {100 * decided['skewed']:.1f} % of skewed samples, right in {100 * decided['effect']:.1f} %")
