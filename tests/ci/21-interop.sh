#!/usr/bin/env bash
# Our traces in the hands of others, and theirs in ours: can-utils, python-can, tshark.
source "$(dirname "$0")/lib.bash"
need log2asc can-utils
need tshark tshark
need_python python-can==4.6.1
build_host

trace=$work/run/trace.log
"$plant_sim" run --scenario gate --cycles 1 --out "$work/run" >/dev/null
"$plant_sim" trace check "$trace"
"$plant_sim" trace replay "$trace"
"$python" tests/ci/21-interop.py "$plant_sim" "$trace" "$work"
