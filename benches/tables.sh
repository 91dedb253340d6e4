#!/usr/bin/env bash
# Reading 200 MB of numbers as text beside polars, each on one core: `benches/tables.sh`.
# PYTHON names an interpreter that has polars and numpy; without it nothing is compared. What is told is seconds of the
# processor from the file to a matrix in memory.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
core=$(taskset -cp $$ | sed 's/.*[:,-] *//')
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
table=$folder/table.csv

if ! "$python" -c "import polars, numpy" 2>/dev/null; then
    echo "without polars: $python cannot import it" >&2
    exit 1
fi
"$python" - "$table" <<'PYTHON'
import sys
import numpy
import polars

numbers = numpy.random.default_rng(0).standard_normal((1_050_000, 10))
columns = {f"x{i}": numbers[:, i] for i in range(9)} | {"y": numbers[:, 9]}
polars.DataFrame(columns).write_csv(sys.argv[1])
PYTHON
POLARS_MAX_THREADS=1 taskset -c "$core" "$python" - "$table" <<'PYTHON'
import sys
import time
import polars

for _ in range(3):
    begin = time.process_time()
    table = polars.read_csv(sys.argv[1])
    read = time.process_time() - begin
    table.to_numpy()
    print(f"polars   {read:.2f} s, {time.process_time() - begin:.2f} s as a matrix, {len(table)} rows")
PYTHON
taskset -c "$core" cargo bench -q -p ivx-table --bench read -- "$table" y | sed 's/^/ivx   /'
