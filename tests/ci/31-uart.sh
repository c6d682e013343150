#!/usr/bin/env bash
# The controller on the Cortex-M4F over its UART: slcan, interrupt by interrupt, every frame equal to that of the host.
. "$(dirname "$0")/30-board.bash"
image=$(built mps2-an386 --bin mps2-an386)

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
ends_with_its_run 30 --channel uart --image "$image"
