#!/usr/bin/env bash
# Steps of training beside JAX and PyTorch, one thread each, in turn: `benches/numerics.sh [ROUNDS]`.
# PYTHON names an interpreter that has them; what it has not is left out.
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=${1:-3}
python=${PYTHON:-python3}
frameworks=()
for framework in jax torch; do
    if "$python" -c "import $framework" 2>/dev/null; then
        frameworks+=("$framework")
    else
        echo "without $framework: $python cannot import it" >&2
    fi
done

cargo build --release --quiet -p ivx-library --bench steps
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT
for _ in $(seq "$rounds"); do
    for workload in W1 W2 W3 W4 W5; do
        cargo bench --quiet -p ivx-library --bench steps -- "$workload" | sed 's/^/ivx /' >> "$lines"
        for framework in ${frameworks[@]+"${frameworks[@]}"}; do
            "$python" benches/numerics.py "$framework" "$workload" 2>/dev/null \
                | sed "s/^/$framework /" >> "$lines"
        done
    done
done
# The median of the rounds, in milliseconds, and how many times as long as ours.
sort -k2,2 -k1,1 -k3,3g "$lines" | awk '
    { key = $2 " " $1; values[key] = values[key] " " $3; names[$2 " " $1] }
    END {
        for (key in names) {
            n = split(values[key], found, " ")
            middle[key] = found[int((n + 1) / 2)]
        }
        for (key in names) {
            split(key, parts, " ")
            printf "%-4s %-6s %9.4f ms  %5.2f\n", parts[1], parts[2], middle[key], \
                middle[key] / middle[parts[1] " ivx"]
        }
    }' | sort
