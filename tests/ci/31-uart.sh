#!/usr/bin/env bash
# The controller on the Cortex-M4F over its UART: slcan, interrupt by interrupt, every frame equal to that of the host.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash
image=$(built mps2-an386 --bin mps2-an386)

echo "- one cycle over the UART; the run fails at the first frame that differs from the twin's"
timeout 60 "$plant_sim" run --cycles 1 --controller qemu --channel uart --image "$image" --out "$work/uart" \
    >/dev/null 2>"$work/uart.err"
commands=$(grep -c ' 240##' "$work/uart/trace.log")
echo "  $commands commands equal"
"$plant_sim" run --cycles 1 --quiet --no-report --out "$work/here" >/dev/null
expected=$(grep -c ' 240##' "$work/here/trace.log")
[ "$commands" = "$expected" ] || fail "$commands commands in a cycle that has $expected"
if grep 'lost' "$work/uart.err"; then
    fail "nothing may be lost in lock-step"
fi

echo "- the same run twice gives the same bytes"
timeout 60 "$plant_sim" run --cycles 1 --controller qemu --channel uart --image "$image" --out "$work/again" \
    >/dev/null 2>"$work/again.err"
cmp "$work/uart/trace.log" "$work/again/trace.log"

echo "- QEMU ends with the run, even one that is killed: when its UART is silent for 20 s"
ends_with_its_run 30 --channel uart --image "$image"
