#!/usr/bin/env bash
# MCAP, read by its official Python reader: every frame of the trace is there, joints are where encoders and truth.csv have
# them, transforms lead to the true flange, and what has a name of Foxglove's is what Foxglove's own code reads.
source "$(dirname "$0")/lib.bash"
need_python mcap==1.6.0 mcap-protobuf-support==0.6.0 foxglove-schemas-protobuf==0.4.0 cantools==45.1.0
build_host
model=plant-sim/models/irb930-12-0.85.json
"$plant_sim" dbc --out "$work/scara.dbc"

echo "- a run, its trace converted, and the same of another robot"
run() { # run NAME ARGUMENT...: a run into $work/NAME and $work/NAME.mcap
    "$plant_sim" run --quiet --cycles 1 --out "$work/$1" --mcap "$work/$1.mcap" "${@:2}"
}
run one
"$plant_sim" trace convert --to mcap "$work/one/trace.log" --out "$work/trace.mcap"
run other --scenario pick-place --set requirements=[] --model "$model"
"$plant_sim" trace convert --to mcap --model "$model" "$work/other/trace.log" --out "$work/other-trace.mcap"
for file in one trace; do
    "$python" tests/ci/21-mcap.py "$work/$file.mcap" "$work/one" plant-sim/models/irb930-22-1.05.json "$work/scara.dbc"
done
for file in other other-trace; do
    "$python" tests/ci/21-mcap.py "$work/$file.mcap" "$work/other" "$model" "$work/scara.dbc"
done

echo "- the same run has the same bytes, at once or bit by bit"
run again
cmp "$work/one.mcap" "$work/again.mcap"
{ head -c 100000 "$work/one/trace.log" && sleep 0.3 && tail -c +100001 "$work/one/trace.log"; } |
    "$plant_sim" trace convert --to mcap - | cmp - "$work/trace.mcap"

echo "- a trace with error frames, remote frames and two interfaces"
cat >"$work/mixed.log" <<'END'
(1436509052.249713) can0 123#DEADBEEF
(1436509052.250000) can1 18FF1234##3DEADBEEF
(1436509052.250100) can0 123#R4
(1436509052.250200) can1 20000080#0000000000000000
END
"$plant_sim" trace convert --to mcap "$work/mixed.log" --out "$work/mixed.mcap"
"$python" tests/ci/21-mcap.py "$work/mixed.mcap"

echo "- what is refused leaves what is there"
refused "for --to mcap" "$plant_sim" trace convert --to asc --model irb930-22-1.05 "$work/mixed.log"
refused "mcap" "$plant_sim" trace convert "$work/mixed.log" --to blf
to() { # to FILE ARGUMENT...: a run
    "$plant_sim" run --quiet --cycles 1 --out "$work/new" --mcap "$1" "${@:2}"
}
refused "cannot write to $work/none/run.mcap" to "$work/none/run.mcap"
refused "cannot write to /dev/full" to /dev/full
refused "a folder" to "$work"
refused "none.toml" to "$work/one.mcap" --scenario "$work/none.toml"
cmp "$work/one.mcap" "$work/again.mcap"
