#!/usr/bin/env bash
# An update of ΨΦ-learning at the widths of Table B.1 for Highway beside JAX, in turn on one core, in milliseconds of the
# processor: `PYTHON=python benches/psi_phi.sh [TURNS]`. PYTHON names an interpreter that has jax and optax.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=$(taskset -cp $$ | sed 's/.*[:,-] *//')
bench=$(cargo bench --no-run -p ivx-library --bench agents 2>&1 | sed -n 's/.*Executable.*(\(.*\))$/\1/p')
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT

for _ in $(seq "${1:-3}"); do
    taskset -c "$core" "$bench" psi_phi | sed -n 's/.* \([0-9.]*\) us a step$/ivx \1/p' >> "$lines"
    taskset -c "$core" "$python" benches/psi_phi_jax.py 2>/dev/null |
        sed -n 's/.*: \([0-9.]*\) ms of CPU.*/jax \1e3/p' >> "$lines"
done
# The least of all turns.
sort -k1,1 -k2,2g "$lines" | awk '
    !($1 in least) { least[$1] = $2 / 1e3; printf "%s %.2f ms of CPU an update\n", $1, least[$1] }
    END { if (least["jax"]) printf "ours is %.2f of JAX\n", least["ivx"] / least["jax"] }'
