#!/bin/bash
# The loop over a real CAN interface: plant and controller as two processes on vcan0, in lock-step and in real time, with
# the tools that CAN people use beside them. Where this kernel has no vcan, everything runs in User-Mode Linux.
#
# Nothing here depends on how fast the machine is: what is held are counts, bytes, exit statuses and messages.
set -euo pipefail
cd "$(dirname "$0")/../.."

need() { # need COMMAND PACKAGE
    command -v "$1" >/dev/null && return
    { apt-get update && apt-get install -y --no-install-recommends "$2"; } >/dev/null 2>&1 ||
        { echo "FAIL: $1 is missing and cannot be installed (apt-get install $2)"; exit 1; }
}
PATH=$PATH:/usr/sbin:/sbin
need ip iproute2
need candump can-utils
need cc gcc
need insmod kmod
if ! { ip link show vcan0 up 2>/dev/null | grep -q 'mtu 72' || ip link add dev vcan0 type vcan 2>/dev/null; }; then
    need linux.uml user-mode-linux
fi

cargo build --release --locked --quiet --package plant-sim --package controller-host
bin=$(realpath "${CARGO_TARGET_DIR:-target}")/release
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
timeout 200 tests/with-vcan bash tests/ci/vcan/checks.sh "$bin" "$work"
