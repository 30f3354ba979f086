# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash
# For the scripts here: a scratch folder, and the bench with its port in $port. Expects $hyst and $image.

folder=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
scratch=$(mktemp -d)
bench=
clean_up() {
    if [[ -n $bench ]]; then
        kill "$bench" 2> /dev/null || true
        wait "$bench" 2> /dev/null || true
    fi
    rm -rf "$scratch"
}
trap clean_up EXIT
trap 'exit 1' INT TERM

# start_bench MODEL OPTION...
start_bench() {
    local model=$1
    shift
    "$hyst" bench --image "$image" --model "$model" "$@" > "$scratch/bench" 2> "$scratch/bench.err" &
    bench=$!
    port=
    for ((wait = 0; wait < 300 && ${#port} == 0; wait++)); do
        kill -0 "$bench" 2> /dev/null || break
        sleep 0.1
        port=$(sed -n 's/^port: //p' "$scratch/bench")
    done
    if [[ -z $port ]]; then
        cat "$scratch/bench.err"
        echo "the bench did not start"
        exit 1
    fi
}

failures=0
# check WHAT COMMAND...: runs the command, and counts a failure with its output.
check() {
    local what=$1
    shift
    if "$@" > "$scratch/out" 2>&1; then
        echo "ok: $what"
    else
        echo "FAILED: $what"
        sed 's/^/    /' "$scratch/out"
        failures=$((failures + 1))
    fi
}

finish() {
    [[ $failures -eq 0 ]] || exit 1
}
