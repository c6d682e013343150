#!/usr/bin/env bash
# The controller on the Cortex-M4F: the image links without a panic, holds neither heap nor double precision, closes the
# loop in QEMU with every frame equal to the host's, and keeps its budget of memory and instructions.
set -euo pipefail
cd "$(dirname "$0")/../.."

# Installs Debian packages where that can be done; otherwise says which.
need() {
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
    else
        echo "30-target: install: $*" >&2
        exit 1
    fi
}

command -v arm-none-eabi-objdump >/dev/null || need binutils-arm-none-eabi
command -v qemu-system-arm >/dev/null || need qemu-system-arm
command -v python3 >/dev/null || need python3
tests/board/cargo --version >/dev/null 2>&1 || need rustc-web cargo-web rust-web-src lld

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

board() { tests/board/cargo build --release --quiet --locked --package mps2-an386 "$@"; }
built() { # built ARGS: where cargo has put the program
    board "$@" --message-format=json | grep -o '"executable":"[^"]*"' | tail -1 | cut -d'"' -f4
}

echo "- the image links, so no panic can be reached; one that can panic does not link"
image=$(built --bin mps2-an386)
if board --example panics 2>"$scratch/panics"; then
    echo "30-target: an image with a panic was linked" >&2
    exit 1
fi
grep -q 'undefined symbol: a_panic_can_be_reached\|undefined reference to .a_panic_can_be_reached' "$scratch/panics"

echo "- no heap, no double precision; an image with both is refused"
tests/board/symbols "$image"
doubles=$(built --example doubles)
if tests/board/symbols "$doubles" 2>"$scratch/doubles"; then
    echo "30-target: heap and double precision were not found" >&2
    exit 1
fi
grep -q GlobalAlloc "$scratch/doubles"
grep -q __aeabi_dmul "$scratch/doubles"

echo "- closed loop in QEMU, every frame equal to that of the host"
cargo build --release --quiet --locked --package plant-sim
plant_sim=${CARGO_TARGET_DIR:-target}/release/plant-sim
for scenario in gate square pick-place; do
    timeout 120 "$plant_sim" run --scenario "$scenario" --cycles 3 --out "$scratch/host" >/dev/null
    timeout 120 "$plant_sim" run --scenario "$scenario" --cycles 3 --out "$scratch/board" \
        --controller qemu --image "$image" >/dev/null
    cmp "$scratch/host/trace.log" "$scratch/board/trace.log"
    echo "  $scenario: $(wc -l <"$scratch/board/trace.log") frames equal"
done

echo "- an image that does not answer is reported, and nothing is left running"
if timeout 60 "$plant_sim" run --controller qemu --image "$doubles" --out "$scratch/none" 2>"$scratch/hung"; then
    echo "30-target: an image without a controller ran a scenario" >&2
    exit 1
fi
grep -q 'the controller in QEMU did not answer' "$scratch/hung"

echo "- QEMU ends with the run, even one that is killed"
"$plant_sim" run --cycles 10000 --controller qemu --image "$image" --out "$scratch/killed" >/dev/null 2>&1 &
run=$!
emulator=
for _ in $(seq 100); do
    read -r emulator _ <"/proc/$run/task/$run/children" || true
    [ -n "$emulator" ] && break
    sleep 0.1
done
[ -n "$emulator" ]
sleep 1
kill -KILL "$run"
wait "$run" 2>/dev/null || true
for _ in $(seq 100); do
    # A zombie has ended; whoever adopted it has yet to notice.
    grep -q '^State:.*[^Z] (' "/proc/$emulator/status" 2>/dev/null || break
    sleep 0.1
done
if grep '^State:.*[^Z] (' "/proc/$emulator/status" 2>/dev/null; then
    echo "30-target: QEMU outlived the run" >&2
    exit 1
fi

echo "- memory and instructions"
timeout 200 python3 tests/board/budget.py "$image" "$plant_sim"
