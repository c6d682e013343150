#!/usr/bin/env bash
# Hard fault, stack overflow, panic and reset of the controller on the Cortex-M4F end with torque off, and their reason is
# reported after the restart.
source "$(dirname "$0")/lib.bash"
source tests/ci/board.bash

echo "- every fault, planted while the arm moves"
faults=$(built mps2-an386 --bin mps2-an386-faults)
timeout 120 "$plant_sim" crash --image "$faults"

echo "- the image for runs obeys no request to fail, only a reset by network management; that is detected"
image=$(built mps2-an386 --bin mps2-an386)
if timeout 120 "$plant_sim" crash --image "$image" >"$work/production.err" 2>&1; then
    fail "the production image has planted faults"
fi
[ "$(grep -c 'FAILED: the controller in QEMU ended' "$work/production.err")" = 4 ]
grep -q '^software-reset  *0111 > 1000  *software ' "$work/production.err"
