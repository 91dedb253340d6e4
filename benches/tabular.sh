#!/usr/bin/env bash
# An update of a table (§C.2.1) beside NumPy and JAX on one core: `benches/tabular.sh`.
# PYTHON names an interpreter that has them; what it has not is left out. JAX runs all updates in one compiled loop.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=$(taskset -cp $$ | sed 's/.*[:,-] *//')

taskset -c "$core" cargo bench -q -p ivx-library --bench tabular | sed 's/^/ivx   /'
for framework in numpy jax; do
    if "$python" -c "import $framework" 2>/dev/null; then
        taskset -c "$core" "$python" benches/tabular.py "$framework" 2>/dev/null | sed "s/^/$framework   /"
    else
        echo "without $framework: $python cannot import it" >&2
    fi
done
