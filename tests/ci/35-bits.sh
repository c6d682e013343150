#!/usr/bin/env bash
# The same bits everywhere: trace and truth of every scenario under every law are those of tests/bits.csv on this machine,
# without its fused multiply-add, in WebAssembly, and with the controller on the emulated Cortex-M4F.
#   tests/ci/35-bits.sh           compares
#   tests/ci/35-bits.sh update    rewrites the table from runs on this machine, after an intended change of behaviour
source "$(dirname "$0")/lib.bash"
table=tests/bits.csv

hash() { # hash FILE
    local sum
    sum=$(sha256sum "$1")
    echo "${sum%% *}"
}

runs() { # runs TABLE ARGS...: the table from `plant-sim run ARGS`
    local scenario law rate cycles status
    while IFS=, read -r scenario law rate cycles _; do
        if [ "$scenario" = scenario ]; then
            echo "$scenario,$law,$rate,$cycles,trace_sha256,truth_sha256"
            continue
        fi
        # Whether a run completes does not matter here.
        status=0
        timeout 120 "$plant_sim" run --scenario "$scenario" --law "$law" --rate "$rate" --cycles "$cycles" \
            --out "$work/run" "${@:2}" >/dev/null 2>"$work/run.err" </dev/null || status=$?
        [ "$status" -le 1 ] || fail "$scenario, $law, $rate Hz: status $status"
        echo "$scenario,$law,$rate,$cycles,$(hash "$work/run/trace.log"),$(hash "$work/run/truth.csv")"
        rm "$work/run"/*
    done <"$1"
}

compare() { # compare WHERE TABLE: its rows are in the recorded table
    awk -F, -v where="$1" '
        { key = $1 FS $2 FS $3 FS $4 }
        NR == FNR { trace[key] = $5; truth[key] = $6; next }
        FNR > 1 { rows++ }
        trace[key] != $5 || truth[key] != $6 {
            unequal = 1
            printf "  %s differs %s: %s under %s at %s Hz\n", trace[key] == $5 ? "truth" : truth[key] == $6 ? "trace" : \
                "trace and truth", where, $1, $2, $3
        }
        END {
            if (unequal || !rows) exit 1
            printf "  %d rows equal\n", rows
        }' "$table" "$2" || fail "differs from $table. If the change is intended: tests/ci/35-bits.sh update"
}

build_host
if [ "${1:-}" = update ]; then
    runs "$table" >"$work/table"
    cp "$work/table" "$table"
    git diff --stat -- "$table"
    exit
fi

echo "- on this machine"
runs "$table" >"$work/here"
compare "on this machine" "$work/here"

echo "- on this machine without fused multiply-add"
without=glibc.cpu.hwcaps=-FMA,-AVX2
# awk takes its sine from the C library, like the standard library: evidence that another implementation is in use.
sines() { awk 'BEGIN { for (i = 0; i < 100000; i++) printf "%.17g\n", sin(i / 1000) }' | sha256sum; }
if [ "$(sines)" = "$(GLIBC_TUNABLES=$without sines)" ]; then
    echo "  not compared: the C library has the same functions without it here"
else
    GLIBC_TUNABLES=$without runs "$table" >"$work/without"
    compare "without fused multiply-add" "$work/without"
fi

echo "- in WebAssembly"
need node nodejs
need_cross wasm32-unknown-unknown
tests/cross wasm32-unknown-unknown build --release --quiet --locked --package web
node tests/web/run.mjs "$target/cross/wasm32-unknown-unknown/release/web.wasm" "$table" >"$work/wasm" 2>"$work/wasm.err"
compare "in WebAssembly" "$work/wasm"
sed 's/^/  /' "$work/wasm.err"

echo "- with the controller on the emulated Cortex-M4F"
source tests/ci/board.bash
image=$(built mps2-an386 --bin mps2-an386)
grep -E '^(scenario|(gate|bus-off),(pid|computed-torque:observer)|square,computed-torque-task:observer|pick-place,computed-torque:observer),' \
    "$table" >"$work/some"
runs "$work/some" --controller qemu --image "$image" >"$work/board"
compare "on the emulated board" "$work/board"
