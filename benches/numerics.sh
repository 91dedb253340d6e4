#!/usr/bin/env bash
# Steps of training beside JAX and PyTorch, one core each, in turn: `benches/numerics.sh [ROUNDS]`.
# PYTHON names an interpreter that has them; what it has not is left out.
#
# Every process is bound to one core: told to use one thread, JAX still works on two. As `jax-free` it
# may. W1x2 are two members of an ensemble at once, a core each, in milliseconds a member-step: its
# limits on 2 cores of 232 GFLOP/s are 1.07, and 1.7 at the rate of OpenBLAS for such thin matrices.
set -euo pipefail
cd "$(dirname "$0")/.."

rounds=${1:-3}
python=${PYTHON:-python3}
peers=()
for framework in jax torch; do
    if "$python" -c "import $framework" 2>/dev/null; then
        peers+=("$framework")
    else
        echo "without $framework: $python cannot import it" >&2
    fi
done
mapfile -t cores < <(taskset -cp $$ | sed 's/.*: //' | tr , '\n' \
    | awk -F- '{ for (i = $1; i <= $NF; i++) print i }')

bench=$(cargo bench --no-run -p ivx-library --bench steps 2>&1 | sed -n 's/.*Executable.*(\(.*\))$/\1/p')
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT

# One line of a peer or of ours.
run() {
    case $1 in
        ivx) "$bench" "$2" ;;
        *) "$python" benches/numerics.py "$1" "$2" 2>/dev/null ;;
    esac
}
on() {
    local core=$1
    shift
    (taskset -cp "$core" "$BASHPID" >/dev/null && run "$@")
}
for _ in $(seq "$rounds"); do
    for workload in W1 W2 W3 W4 W5; do
        for name in ivx ${peers[@]+"${peers[@]}"}; do
            on "${cores[-1]}" "$name" "$workload" | sed "s/^/$name /" >> "$lines"
            if [ "$name" = jax ]; then
                run jax "$workload" | sed "s/^/jax-free /" >> "$lines"
            fi
        done
    done
    for name in ivx ${peers[@]+"${peers[@]}"}; do
        { on "${cores[0]}" "$name" W1 & on "${cores[-1]}" "$name" W1; wait; } \
            | awk -v name="$name" '{ sum += $2 } END { print name, "W1x2", sum / 2 / NR }' >> "$lines"
    done
done
# The median of the rounds, in milliseconds, and how many times as long as ours; last, our share of
# the time of the faster peer on one core.
sort -k2,2 -k1,1 -k3,3g "$lines" | awk '
    { key = $2 " " $1; values[key] = values[key] " " $3 }
    END {
        for (key in values) {
            n = split(values[key], found, " ")
            middle[key] = found[int((n + 1) / 2)]
        }
        for (key in middle) {
            split(key, parts, " ")
            ours = middle[parts[1] " ivx"]
            printf "%-4s %-8s %9.4f ms  %5.2f\n", parts[1], parts[2], middle[key], middle[key] / ours
            if (parts[2] ~ /^(jax|torch)$/ && !(best[parts[1]] < middle[key] && best[parts[1]])) {
                best[parts[1]] = middle[key]
            }
        }
        for (workload in best) {
            ours = middle[workload " ivx"] / best[workload]
            printf "%-4s ours is %.2f of the faster peer\n", workload, ours
        }
    }' | sort
