#!/usr/bin/env bash
# Installs a wheel where nothing else is, and uses it as its README says: `python/tests/wheel.sh [WHEEL]`.
#
# Without one it is built of what is compiled already: by the same profile, in the same CARGO_TARGET_DIR.
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
temporary="$(mktemp -d)"
trap 'rm -rf "$temporary"' EXIT
timed() {
    local what="$1" started="$EPOCHREALTIME"
    shift
    "$@" >"$temporary/said" 2>&1 || { cat "$temporary/said"; exit 1; }
    awk -v s="$started" -v e="$EPOCHREALTIME" -v what="$what" 'BEGIN { printf "%6.1f s  %s\n", e - s, what }'
}

if [ $# -gt 0 ]; then
    wheel="$(realpath "$1")"
else
    python3 -m venv "$temporary/tools"
    if ! "$temporary/tools/bin/pip" install --quiet 'maturin>=1.11,<2'; then
        echo "skipped: maturin cannot be had"
        exit 0
    fi
    export PATH="$temporary/tools/bin:$PATH"
    cd "$root/python"
    timed "maturin build" maturin build --release --locked --compatibility linux --out "$temporary"
    wheel="$(echo "$temporary"/*.whl)"
fi
stat --format %s "$wheel" | awk '{ printf "%6.1f MB  the wheel\n", $1 / 1e6 }'

# No PATH but the system's, no other ivx, and no network: the wheel needs nothing.
python3 -m venv "$temporary/env"
export PATH="$temporary/env/bin:/usr/bin:/bin"
unset IVX PYTHONPATH
timed "pip install" pip install --no-index "$wheel"
[ "$(command -v ivx)" = "$temporary/env/bin/ivx" ]

mkdir -p "$temporary/project/.git"
cd "$temporary/project"
export IVX_CACHE="$temporary/cache"
timed "ivx new" ivx new study
timed "ivx exec" ivx exec study.ivx
grep "^  holds " "$temporary/said"
timed "ivx exec, again" ivx exec study.ivx
grep "^0 of [0-9]* nodes executed" "$temporary/said"
python - <<'END'
import ivx, os
assert ivx.find() == os.environ["PATH"].split(":")[0] + "/ivx", ivx.find()
found = ivx.run("study.ivx", set={"seeds": 3})
assert "<svg" in found._repr_html_() and found._told["measures"], found
END
echo "the module runs and reads it"
cp -r "$root/experiments" .
timed "ivx exec experiments/thesis.ivx --profile smoke" ivx exec experiments/thesis.ivx --profile smoke
grep "nodes executed" "$temporary/said"
