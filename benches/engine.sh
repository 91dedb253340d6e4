#!/usr/bin/env bash
# What the engine costs beside the work itself, next to ninja and snakemake: layered graphs in
# which every node depends on three of the layer before, run
#
#   cold     from nothing
#   no-op    again, with nothing to do
#   param    with a parameter changed that 1 % of the nodes follow from
#   cutoff   with a parameter changed whose node comes out as before
#   revert   with the first parameters again
#
# For each: processor seconds of the whole process tree, peak MB of its largest process, and how
# nodes were executed. `ivx` has nodes inside its process (the largest of three numbers and a
# parameter). `ivx-command`, ninja and snakemake start a program for each (`cksum` of the inputs and
# a tenth of the parameter, rounded down), which says in a file that it ran. For `ivx-command` the
# last layer is also read as numbers, by nodes inside the process that are not counted.
#
#   cargo build --release && benches/engine.sh
#   SIZES="1000" ENGINES="ivx ninja" benches/engine.sh
#
# IVX, NINJA and SNAKEMAKE name the programs; those that are not there are left out.
set -euo pipefail
cd "$(dirname "$0")/.."

IVX="${IVX:-$PWD/target/release/ivx}"
NINJA="${NINJA:-ninja}"
SNAKEMAKE="${SNAKEMAKE:-snakemake}"
SIZES="${SIZES:-1000 10000}"
ENGINES="${ENGINES:-ivx ivx-command ninja snakemake}"
JOBS="${JOBS:-$(nproc)}"
# Planning alone takes snakemake half a minute at 10 000 nodes.
SNAKEMAKE_MOST="${SNAKEMAKE_MOST:-1000}"
# So many no-op runs are timed together.
AGAIN=5
LAYERS=10

time_tool="$(command -v time || true)"
[ -x /usr/bin/time ] && time_tool=/usr/bin/time
[ -x "$time_tool" ] || { echo "GNU time is needed to measure (Debian: apt install time)"; exit 1; }
unset IVX_CACHE
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

# The layer whose first node has closest to 1 % of all nodes after it, itself included.
hot_layer() {
    awk -v L="$LAYERS" -v W="$1" 'BEGIN {
        for (l = L - 1; l >= 0; l--) {
            after += (1 + 2 * (L - 1 - l) < W) ? 1 + 2 * (L - 1 - l) : W
            off = after - L * W / 100; off = off < 0 ? -off : off
            if (l == L - 1 || off < least) { least = off; best = l }
        }
        print best }'
}

# One line a node: layer, place, its three inputs (none in layer 0), its number.
nodes() {
    awk -v L="$LAYERS" -v W="$1" 'BEGIN {
        for (l = 0; l < L; l++) for (j = 0; j < W; j++) {
            print l, j, (l ? (l-1) "_" j " " (l-1) "_" (j+1)%W " " (l-1) "_" (j+2)%W : "- - -"), l * W + j
        } }'
}

# A parameter counts where it is above the inputs: so 1e6 moves all that follow, and -1.5 nothing.
spec_ivx() {
    local width=$1 hot=$2
    echo 'edition "2026"'
    echo 'experiment bench {'
    echo '    param hot: Float = -1.0'
    echo '    axis k = ["a", "b", "c", "p"]'
    echo "    axis last = 0..$width"
    nodes "$width" | awk -v H="$hot" '{
        p = ($1 == H && $2 == 0) ? "hot" : -$6 - 2 ".0"
        if ($1 == 0) { a = $2 ".0"; b = c = "0.0" } else { a = "n" $3; b = "n" $4; c = "n" $5 }
        printf "    let n%d_%d = max(match k { \"a\": %s, \"b\": %s, \"c\": %s, \"p\": %s }, over: k)\n", $1, $2, a, b, c, p }'
    printf '    measure out = match last { '
    awk -v L="$LAYERS" -v W="$width" 'BEGIN { for (j = 0; j < W; j++) printf "%s\"%d\": n%d_%d", (j ? ", " : ""), j, L - 1, j }'
    printf ' }\n}\n'
}

# A program is given what others left behind as it is. Its number is hashed too, since equal nodes
# would be one.
spec_command() {
    local width=$1 hot=$2
    echo 'edition "2026"'
    echo 'experiment bench {'
    echo '    param hot: Int = 100'
    echo "    axis last = 0..$width"
    nodes "$width" | awk -v H="$hot" -v RAN="$PWD/ran" '{
        value = ($1 == H && $2 == 0) ? "hot" : 100
        input = "as_file(n%s, \"%d.safetensors\")"
        inputs = $1 ? sprintf(input ", " input ", " input, $3, 0, $4, 1, $5, 2) : ""
        hashed = "{ echo $(($0 / 10)) $1; cat " ($1 ? "*.safetensors" : "") " /dev/null; }"
        script = hashed " | cksum | { read sum size; echo $sum; } > out; echo . >> " RAN
        printf "    let n%d_%d = command(\"sh\", args: [\"-c\", \"%s\", %s, %d], ", $1, $2, script, value, $6
        printf "inputs: [%s], outputs: [\"out\"])\n", inputs }'
    printf '    measure out = read_scalar(match last { '
    awk -v L="$LAYERS" -v W="$width" 'BEGIN { for (j = 0; j < W; j++) printf "%s\"%d\": n%d_%d", (j ? ", " : ""), j, L - 1, j }'
    printf ' }, "out")\n}\n'
}

spec_ninja() {
    local width=$1 hot=$2 value=$3
    echo 'rule node'
    echo '  command = { echo $tenth; : $value; cat $in /dev/null; } | cksum > $out; echo $out >> ran'
    nodes "$width" | awk -v H="$hot" -v V="$value" '{
        v = ($1 == H && $2 == 0) ? V : 100
        ins = $1 ? "out/" $3 " out/" $4 " out/" $5 : ""
        printf "build out/%d_%d: node %s\n  tenth = %d\n  value = %d\n", $1, $2, ins, int(v / 10), v }'
}

spec_snakemake() {
    local width=$1 hot=$2
    cat <<END
LAYERS, WIDTH, HOT = $LAYERS, $width, "${hot}_0"
VALUE = int(open("value").read())
def value(at): return VALUE if f"{at.l}_{at.j}" == HOT else 100
def inputs(at):
    l, j = int(at.l), int(at.j)
    return [f"out/{l - 1}_{(j + k) % WIDTH}" for k in range(3)] if l else []
rule all:
    input: [f"out/{LAYERS - 1}_{j}" for j in range(WIDTH)]
rule node:
    input: inputs
    output: "out/{l}_{j}"
    params: value=value, tenth=lambda at: value(at) // 10
    shell: "{{ echo {params.tenth}; : {params.value}; cat {input} /dev/null; }} | cksum > {output}; echo {output} >> ran"
END
}

# Runs a command so many times in the scratch folder, and prints a row of the table.
row() {
    local size=$1 engine=$2 scenario=$3 times=$4
    shift 4
    : > ran
    local code=0
    "$time_tool" -o time -f '%U %S %M' \
        sh -c 'n=$1; shift; while [ $n -gt 0 ]; do "$@" || exit; n=$((n - 1)); done' sh "$times" "$@" \
        > said 2>&1 || code=$?
    [ "$code" = 0 ] || { cat said; echo "$engine failed"; exit 1; }
    local ran
    if [ "$engine" = ivx ]; then
        ran="$(sed -n 's/^\([0-9]*\) of [0-9]* nodes executed.*/\1/p' said | tail -1)"
    else
        ran="$(wc -l < ran)"
    fi
    awk -v n="$size" -v e="$engine" -v s="$scenario" -v t="$times" -v r="$ran" '{
        printf "%7d  %-12s %-8s %9.3f %7.0f %9d\n", n, e, s, ($1 + $2) / t, $3 / 1024, r }' time
}

bench() {
    local size=$1 engine=$2 width=$(($1 / LAYERS)) hot
    hot="$(hot_layer "$width")"
    rm -rf "$scratch/$engine"
    mkdir -p "$scratch/$engine/.ivx" "$scratch/$engine/out"
    cd "$scratch/$engine"
    case $engine in
        ivx)
            spec_ivx "$width" "$hot" > bench.ivx
            local run=("$IVX" exec bench.ivx --jobs "$JOBS")
            row "$size" "$engine" cold 1 "${run[@]}"
            row "$size" "$engine" no-op "$AGAIN" "${run[@]}"
            row "$size" "$engine" param 1 "${run[@]}" --set bench.hot=1e6
            row "$size" "$engine" cutoff 1 "${run[@]}" --set bench.hot=-1.5
            row "$size" "$engine" revert 1 "${run[@]}"
            ;;
        ivx-command)
            spec_command "$width" "$hot" > bench.ivx
            local run=("$IVX" exec bench.ivx --jobs "$JOBS")
            row "$size" "$engine" cold 1 "${run[@]}"
            row "$size" "$engine" no-op "$AGAIN" "${run[@]}"
            row "$size" "$engine" param 1 "${run[@]}" --set bench.hot=110
            row "$size" "$engine" cutoff 1 "${run[@]}" --set bench.hot=115
            row "$size" "$engine" revert 1 "${run[@]}"
            ;;
        ninja)
            local run=("$NINJA" --quiet -j "$JOBS")
            spec_ninja "$width" "$hot" 100 > build.ninja
            row "$size" "$engine" cold 1 "${run[@]}"
            row "$size" "$engine" no-op "$AGAIN" "${run[@]}"
            spec_ninja "$width" "$hot" 110 > build.ninja
            row "$size" "$engine" param 1 "${run[@]}"
            spec_ninja "$width" "$hot" 115 > build.ninja
            row "$size" "$engine" cutoff 1 "${run[@]}"
            spec_ninja "$width" "$hot" 100 > build.ninja
            row "$size" "$engine" revert 1 "${run[@]}"
            ;;
        snakemake)
            local run=("$SNAKEMAKE" --jobs "$JOBS" --quiet all)
            spec_snakemake "$width" "$hot" > Snakefile
            echo 100 > value
            row "$size" "$engine" cold 1 "${run[@]}"
            row "$size" "$engine" no-op 1 "${run[@]}"
            echo 110 > value
            row "$size" "$engine" param 1 "${run[@]}"
            echo 115 > value
            row "$size" "$engine" cutoff 1 "${run[@]}"
            echo 100 > value
            row "$size" "$engine" revert 1 "${run[@]}"
            ;;
    esac
    cd - > /dev/null
}

printf '%7s  %-12s %-8s %9s %7s %9s\n' nodes engine run 'cpu s' 'peak MB' executed
for size in $SIZES; do
    for engine in $ENGINES; do
        case $engine in
            ivx | ivx-command) program=$IVX most=$size ;;
            ninja) program=$NINJA most=$size ;;
            snakemake) program=$SNAKEMAKE most=$SNAKEMAKE_MOST ;;
            *) echo "there is no engine $engine"; exit 2 ;;
        esac
        if ! command -v "$program" > /dev/null; then
            echo "$engine is left out: there is no $program"
        elif [ "$size" -gt "$most" ]; then
            echo "$engine is left out at $size nodes: it would take minutes (SNAKEMAKE_MOST=$size)"
        else
            bench "$size" "$engine"
        fi
    done
done
