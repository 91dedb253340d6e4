"""How many steps a second Gymnasium's own vector environments take, as `bridge.rs` measures the bridge.

    python bridge.py [NAME]
"""
import os
import sys
import time

import gymnasium
import numpy as np

SECONDS, TIMES = 0.5, 12


def processor_time():
    """Seconds of the processor that this process and those that it started took."""

    def of(pid):
        try:
            return int(open(f"/proc/{pid}/schedstat").read().split()[0]) * 1e-9
        except OSError:
            return 0.0

    return of("self") + sum(of(pid) for pid in open("/proc/thread-self/children").read().split())


def measure(name, n, mode):
    worlds = gymnasium.make_vec(name, num_envs=n, vectorization_mode=mode)
    worlds.reset(seed=0)
    draws = np.random.default_rng(0)
    n_actions = worlds.single_action_space.n
    act = lambda: draws.integers(n_actions, size=n)
    for _ in range(100):
        worlds.step(act())
    best = [0.0, 0.0]
    for _ in range(TIMES):
        start, before, steps = time.perf_counter(), processor_time(), 0
        while time.perf_counter() - start < SECONDS:
            for _ in range(20):
                worlds.step(act())
            steps += 20 * n
        clock, cpu = time.perf_counter() - start, processor_time() - before
        best = [max(best[0], steps / clock), max(best[1], steps / cpu)]
    worlds.close()
    print(f"{name} {mode} x{n}: {best[0]:.0f} steps/s, {best[1]:.0f} steps/s of CPU", flush=True)


if __name__ == "__main__":
    name = sys.argv[1] if len(sys.argv) > 1 else "CartPole-v1"
    for n in (1, 8, 64):
        for mode in ("sync", "vector_entry_point", "async"):
            measure(name, n, mode)
