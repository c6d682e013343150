#!/usr/bin/env bash
# The loop over a real CAN interface: plant and controller as two processes on vcan0, in lock-step and in real time,
# with the usual CAN tools alongside. If this kernel has no vcan, everything runs in User-Mode Linux.
# Nothing here depends on the speed of the machine: the checks are of counts, bytes, exit statuses and messages.
source "$(dirname "$0")/lib.bash"
need_vcan
build_host
timeout 200 tests/with-vcan bash tests/ci/vcan/checks.sh "$bin"
