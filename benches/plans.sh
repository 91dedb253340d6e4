#!/usr/bin/env bash
# Plans a second of an ignorant imitator beside JAX, in turn on one core, by the time of the processor:
# `PYTHON=python benches/plans.sh [TURNS]`. PYTHON names an interpreter that has jax.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=$(taskset -cp $$ | sed 's/.*[:,-] *//')
bench=$(cargo bench --no-run -p ivx-library --bench plans 2>&1 | sed -n 's/.*Executable.*(\(.*\))$/\1/p')
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT

for _ in $(seq "${1:-3}"); do
    taskset -c "$core" "$bench" wcm | sed -n 's/rip wcm, batch \([0-9]*\): \([0-9]*\) plans.*/\1 ivx \2/p' >> "$lines"
    for batch in 1 50; do
        taskset -c "$core" "$python" benches/plans_jax.py "$batch" 2>/dev/null |
            sed -n 's/batch \([0-9]*\): \([0-9]*\) plans.*/\1 jax \2/p' >> "$lines"
    done
done
# The most of all turns.
awk '
    $3 > most[$1 " " $2] { most[$1 " " $2] = $3 }
    END {
        for (batch = 1; batch <= 50; batch += 49)
            printf "batch %d: ivx %d, JAX %d plans/s of CPU; ours is %.2f of JAX\n", batch, most[batch " ivx"],
                most[batch " jax"], most[batch " ivx"] / most[batch " jax"]
    }' "$lines"
