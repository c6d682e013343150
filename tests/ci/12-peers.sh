#!/usr/bin/env bash
# CAN tools and this project's programs on one vcan0: canplayer, cansend, candump, python-can and slcand, each at both
# ends.
source "$(dirname "$0")/lib.bash"
need_vcan
need socat socat
need_python python-can==4.6.1 pyte==0.8.2
build_host

"$plant_sim" run --cycles 1 --out "$work/run" >/dev/null
"$plant_sim" run bus-off --out "$work/bus-off" >/dev/null
timeout 200 tests/with-vcan "$python" tests/ci/vcan/peers.py "$bin" "$work"
