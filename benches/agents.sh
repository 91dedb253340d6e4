#!/usr/bin/env bash
# Whole trainings and worlds alone, beside PyTorch, JAX, MinAtar, gymnax and Gymnasium, in turn on one core:
# `PEERS=DIR PYTHON=python benches/agents.sh [TURNS]`.
# PEERS has the peers' scripts; PYTHON names an interpreter that has them. What is not there is left out.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=$(taskset -cp $$ | sed 's/.*[:,-] *//')

ours() {
    taskset -c "$core" cargo bench -q -p "$1" --bench "$2" -- "${@:3}" 2>/dev/null | sed 's/^/ivx    /'
}

peer() {
    if [ -n "${PEERS:-}" ] && [ -e "$PEERS/$1" ]; then
        taskset -c "$core" timeout 900 "$python" "$PEERS/$1" "${@:2}" 2>/dev/null | sed 's/^/peer   /' ||
            echo "without $*" >&2
    fi
}

for _ in $(seq "${1:-1}"); do
    ours ivx-library agents dqn
    peer dqn_torch.py --steps 20000
    peer dqn_jax.py --steps 30000
    ours ivx-library agents 'ppo cart_pole'
    peer ppo_jax.py --env CartPole-v1 --envs 64
    ours ivx-library agents 'ppo breakout'
    peer ppo_jax.py --env Breakout-MinAtar --envs 64 --net conv
    peer ppo_torch.py --env breakout --envs 64 --net conv --minibatches 8 --steps 40000
    ours ivx-world worlds
    peer envs.py minatar
    peer envs.py gymnax
    if "$python" -c 'import gymnasium' 2>/dev/null; then
        IVX_PYTHON=$(command -v "$python") ours ivx-foreign bridge
        taskset -c "$core" "$python" library/foreign/benches/bridge.py | sed 's/^/peer   /'
    fi
done
