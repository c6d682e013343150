#!/usr/bin/env bash
# The controller on the Cortex-M4F over its UART: slcan, interrupt by interrupt, every frame equal to that of the host.
# The image and tools are those of 30-target.sh.
set -euo pipefail
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

image=$(tests/board/cargo build --release --quiet --locked --package mps2-an386 --bin mps2-an386 --message-format=json |
    grep -o '"executable":"[^"]*"' | cut -d'"' -f4)
cargo build --release --quiet --locked --package plant-sim
plant_sim=${CARGO_TARGET_DIR:-target}/release/plant-sim

echo "- one cycle over the UART; the run fails at the first frame unlike the twin's"
timeout 60 "$plant_sim" run --cycles 1 --controller qemu --channel uart --image "$image" --out "$scratch/uart" \
    >/dev/null 2>"$scratch/says"
commands=$(grep -c ' 240##' "$scratch/uart/trace.log")
echo "  $commands commands equal"
[ "$commands" -ge 900 ]
if grep 'lost' "$scratch/says"; then
    echo "31-uart: in lock-step nothing may be lost" >&2
    exit 1
fi

echo "- the same run twice is the same bytes"
timeout 60 "$plant_sim" run --cycles 1 --controller qemu --channel uart --image "$image" --out "$scratch/again" \
    >/dev/null 2>&1
cmp "$scratch/uart/trace.log" "$scratch/again/trace.log"

echo "- QEMU ends with the run, even one that is killed: when its UART is silent for 20 s"
"$plant_sim" run --cycles 1000 --controller qemu --channel uart --image "$image" --out "$scratch/killed" >/dev/null 2>&1 &
run=$!
emulator=
for _ in $(seq 100); do
    read -r emulator _ <"/proc/$run/task/$run/children" || true
    [ -n "$emulator" ] && break
    sleep 0.1
done
[ -n "$emulator" ]
sleep 2
kill -KILL "$run"
wait "$run" 2>/dev/null || true
for _ in $(seq 300); do
    # A zombie has ended; whoever adopted it has yet to notice.
    grep -q '^State:.*[^Z] (' "/proc/$emulator/status" 2>/dev/null || break
    sleep 0.1
done
if grep '^State:.*[^Z] (' "/proc/$emulator/status" 2>/dev/null; then
    echo "31-uart: QEMU outlived the run" >&2
    exit 1
fi
