#!/usr/bin/env bash
# Memory of both images, and instructions of the controller on the emulated Cortex-M4F: within their goals, near the
# recorded figures, and the same to the instruction in every run.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash

image=$(built mps2-an386 --bin mps2-an386)
cost_image=$(built mps2-an386 --bin mps2-an386-cost)
board stm32g474

echo "- two counts are equal"
for count in first second; do
    timeout 100 "$plant_sim" cost --json --image "$image" --cost-image "$cost_image" >"$work/$count"
done
cmp "$work/first" "$work/second"
validate cost "$work/first"

echo "- memory and instructions"
timeout 100 python3 tests/board/budget.py "${image%/*}" "$plant_sim"
