#!/usr/bin/env bash
# Our traces in other tools and theirs in ours: can-utils, python-can, tshark. Our dissector in the hands of tshark
# shows what we decode.
source "$(dirname "$0")/lib.bash"
need log2asc can-utils
need tshark tshark
need_python python-can==4.6.1 cantools==45.1.0 canmatrix==1.3.3
build_host

trace=$work/run/trace.log
"$plant_sim" run --scenario gate --cycles 1 --out "$work/run" >/dev/null
"$plant_sim" trace check "$trace"
"$plant_sim" trace replay "$trace"
"$python" tests/ci/21-interop.py "$plant_sim" "$trace" "$work"

# A run has half of the messages; the random frames of cantools have them all.
"$plant_sim" dbc --out "$work/scara.dbc"
"$python" tests/ci/20-dbc.py "$work/scara.dbc" "$plant_sim" "$work"
"$python" tests/ci/21-dissector.py "$plant_sim" "$work" "$trace" "$work/random.log"

# A bus-off, a passive node, and errors of every kind.
errors=()
begin=300
for kind in stuff form crc ack; do
    errors+=(--fault "feedback:$kind-error=0.3@${begin}ms..+10ms")
    begin=$((begin + 10))
done
"$plant_sim" run --cycles 1 "${errors[@]}" --fault command:bit-error@400ms..+10ms --no-report --out "$work/errors" >/dev/null 2>"$work/errors.err" ||
    [ $? = 1 ]
"$python" tests/ci/21-errors.py "$plant_sim" "$work" "$work/errors/trace.log"
