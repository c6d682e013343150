#!/usr/bin/env bash
# Our DBC in the hands of others: cantools encodes and decodes 10,000 random frames as we do, canmatrix reads it without
# a warning.
source "$(dirname "$0")/lib.bash"
need_python cantools==45.1.0 canmatrix==1.3.3
build_host

"$plant_sim" dbc --out "$work/scara.dbc"
"$python" tests/ci/20-dbc.py "$work/scara.dbc" "$plant_sim" "$work"
