#!/usr/bin/env bash
# The controller on the Cortex-M4F: the images pass the lints, the image for QEMU links without a panic, contains
# neither heap nor double precision, and closes the loop in QEMU with every frame equal to the host's.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash

echo "- lints of the images"
tests/board/cargo clippy --release --quiet --locked -p mps2-an386 -p stm32g474 -- --no-deps

echo "- the image links, so no panic can be reached; one that can panic does not link"
image=$(built mps2-an386 --bin mps2-an386)
refused 'undefined symbol: a_panic_can_be_reached\|undefined reference to .a_panic_can_be_reached' \
    board mps2-an386 --example panics

echo "- no heap, no double precision; an image with both is refused"
tests/board/symbols "$image"
doubles=$(built mps2-an386 --example doubles)
for found in GlobalAlloc __aeabi_dmul; do
    refused "$found" tests/board/symbols "$doubles"
done

echo "- closed loop in QEMU, every frame equal to that of the host"
for scenario in gate square pick-place; do
    timeout 120 "$plant_sim" run --scenario "$scenario" --cycles 3 --out "$work/host" >/dev/null
    timeout 120 "$plant_sim" run --scenario "$scenario" --cycles 3 --out "$work/board" \
        --controller qemu --image "$image" >/dev/null
    cmp "$work/host/trace.log" "$work/board/trace.log"
    echo "  $scenario: $(wc -l <"$work/board/trace.log") frames equal"
done

echo "- the gates of the benchmark are the same on the board"
"$plant_sim" bench motion --quick --json >"$work/bench.json"
"$plant_sim" bench motion --quick --json --controller qemu | cmp - "$work/bench.json"

echo "- the log has every change of mode, and nothing in it is damaged"
for message in 'started: PowerOn' 'Enabled (None)' 'Moving (None)' 'Ready (None)'; do
    grep -q "INFO $message" "$work/board/controller.log"
done
if grep ERROR "$work/board/controller.log"; then
    fail "the log is damaged"
fi

echo "- an image that does not answer is reported, and nothing is left running"
refused 'the controller in QEMU did not answer' \
    timeout 60 "$plant_sim" run --controller qemu --image "$doubles" --out "$work/none"

echo "- QEMU ends with the run, even one that is killed"
ends_with_its_run 10 --image "$image"
