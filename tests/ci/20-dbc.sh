#!/usr/bin/env bash
# Our DBC in the hands of others: cantools encodes and decodes 10,000 random frames as we do, canmatrix reads it without
# a warning, and the C that cantools makes of it compiles without a warning and decodes the frames of a run as we do.
source "$(dirname "$0")/lib.bash"
need_python cantools==45.1.0 canmatrix==1.3.3
build_host

"$plant_sim" dbc --out "$work/scara.dbc"
"$python" tests/ci/20-dbc.py "$work/scara.dbc" "$plant_sim" "$work"

"$plant_sim" run --scenario gate --cycles 1 --out "$work/run" >/dev/null
"$python" tests/ci/20-dbc-c.py "$work/scara.dbc" "$plant_sim" "$work" "$work/run/trace.log" "$work/random.log"
