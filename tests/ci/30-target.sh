#!/usr/bin/env bash
# The controller on the Cortex-M4F: the images pass the lints, the image for QEMU links without a panic, holds neither
# heap nor double precision, and closes the loop in QEMU with every frame equal to the host's.
. "$(dirname "$0")/30-board.bash"

echo "- lints of the images"
tests/board/cargo clippy --version >/dev/null 2>&1 || need rust-web-clippy
tests/board/cargo clippy --release --quiet --locked -p mps2-an386 -p stm32g474 -- --no-deps

echo "- the image links, so no panic can be reached; one that can panic does not link"
image=$(built mps2-an386 --bin mps2-an386)
if board mps2-an386 --example panics 2>"$scratch/panics"; then
    echo "30-target: an image with a panic was linked" >&2
    exit 1
fi
grep -q 'undefined symbol: a_panic_can_be_reached\|undefined reference to .a_panic_can_be_reached' "$scratch/panics"

echo "- no heap, no double precision; an image with both is refused"
tests/board/symbols "$image"
doubles=$(built mps2-an386 --example doubles)
if tests/board/symbols "$doubles" 2>"$scratch/doubles"; then
    echo "30-target: heap and double precision were not found" >&2
    exit 1
fi
grep -q GlobalAlloc "$scratch/doubles"
grep -q __aeabi_dmul "$scratch/doubles"

echo "- closed loop in QEMU, every frame equal to that of the host"
for scenario in gate square pick-place; do
    timeout 120 "$plant_sim" run --scenario "$scenario" --cycles 3 --out "$scratch/host" >/dev/null
    timeout 120 "$plant_sim" run --scenario "$scenario" --cycles 3 --out "$scratch/board" \
        --controller qemu --image "$image" >/dev/null
    cmp "$scratch/host/trace.log" "$scratch/board/trace.log"
    echo "  $scenario: $(wc -l <"$scratch/board/trace.log") frames equal"
done

echo "- the log tells every change of mode, and nothing in it is damaged"
for message in 'started: PowerOn' 'Enabled (None)' 'Moving (None)' 'Ready (None)'; do
    grep -q "INFO $message" "$scratch/board/controller.log"
done
if grep ERROR "$scratch/board/controller.log"; then
    echo "30-target: the log is damaged" >&2
    exit 1
fi

echo "- an image that does not answer is reported, and nothing is left running"
if timeout 60 "$plant_sim" run --controller qemu --image "$doubles" --out "$scratch/none" 2>"$scratch/hung"; then
    echo "30-target: an image without a controller ran a scenario" >&2
    exit 1
fi
grep -q 'the controller in QEMU did not answer' "$scratch/hung"

echo "- QEMU ends with the run, even one that is killed"
ends_with_its_run 10 --image "$image"
