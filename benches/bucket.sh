#!/usr/bin/env bash
# A bucket as the store at 20 ms a request, by the clock: `benches/bucket.sh [RECORDS] [NODES]`.
# What is told of each run: seconds, requests, and what it executed.
set -euo pipefail
cd "$(dirname "$0")/.."
records=${1:-100000} nodes=${2:-30000}
ivx=${IVX:-target/release/ivx}
[ -x "$ivx" ] || cargo build --release --features object-storage
ivx="$(realpath "$ivx")"
folder=$(mktemp -d)
port=5599
export AWS_ENDPOINT=http://127.0.0.1:$port AWS_ALLOW_HTTP=true AWS_ACCESS_KEY_ID=x AWS_SECRET_ACCESS_KEY=x
python3 benches/bucket.py "$port" 20 "$records" & server=$!
trap 'kill $server; rm -r "$folder"' EXIT
until curl --silent http://127.0.0.1:$port/count >/dev/null; do sleep 0.1; done

mkdir -p "$folder/p/.ivx"
cat >"$folder/p/tiny.ivx" <<'IVX'
edition "2026"
experiment tiny {
    param n: Int = 1
    axis seed = 0..n
    let data = sample(sinusoids(), n: 10)
    let b = mean(targets(data), over: row)
    let c = b * 2.0 + 1.0
    measure m = c - 0.5
}
IVX
run() {
    local what="$1" started="$EPOCHREALTIME"
    shift
    (cd "$folder/p" && "$ivx" exec tiny.ivx --set n=$((nodes / 6)) "$@" >"$folder/said" 2>&1) || cat "$folder/said"
    requests=$(curl --silent http://127.0.0.1:$port/count)
    awk -v s="$started" -v e="$EPOCHREALTIME" -v r="$requests" -v what="$what" \
        'BEGIN { printf "%6.2f s %6d requests  %s: ", e - s, r, what }'
    grep "nodes executed" "$folder/said"
    grep -E "^(note|store)" "$folder/said" || true
}
cold() { rm -rf "$folder/p/.ivx/cache"; }

run "without a store"
run "without a store, nothing to do"
run "$records records, nothing to do" --store s3://ivx/made
cold
run "cold, all is put there" --store s3://ivx/own --store-mode write
run "nothing to do, all is there" --store s3://ivx/own --store-mode write
cold
run "cold, all is there" --store s3://ivx/own
cold
run "cold, without a store"
run "all is known here and nothing there" --store s3://ivx/other --store-mode write
