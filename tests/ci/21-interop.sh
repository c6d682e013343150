#!/bin/bash
# Our traces in the hands of others, and theirs in ours: can-utils, python-can, tshark.
source "$(dirname "$0")/20-peers.bash"
export DEBIAN_FRONTEND=noninteractive
apt_peer log2asc can-utils
apt_peer tshark tshark
python_peers python-can==4.6.1

trace=$work/run/trace.log
"$plant_sim" run --scenario gate --cycles 1 --out "$work/run" >/dev/null
"$plant_sim" trace check "$trace"
"$plant_sim" trace replay "$trace"
"$python" tests/ci/21-interop.py "$plant_sim" "$trace" "$work"
