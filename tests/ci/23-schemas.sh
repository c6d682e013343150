#!/usr/bin/env bash
# JSON schemas, checked by an independent validator: they are valid schemas, and shipped files and JSON output conform, without
# any key that the schema does not name.
source "$(dirname "$0")/lib.bash"
build_host

echo "- shipped scenarios and models, the model of the reference tables, and a payload"
validate scenario plant-sim/scenarios/*.toml
validate model plant-sim/models/*.json tests/reference/model.json
echo '{ "mass": 2, "com_flange_frame": [0, 0, 0.05], "inertia_com_diag": [0.008, 0.008, 0.01] }' >"$work/payload.json"
validate payload "$work/payload.json"

echo "- summaries: of a run, of two robots, of a fault, of nothing"
summary() { # summary NAME ARGUMENT...
    "$plant_sim" run --out "$work/$1" "${@:2}" >"$work/$1.out" 2>"$work/$1.err" || [ "$1" = fault ]
}
summary run --cycles 2 --json
cmp "$work/run.out" "$work/run/summary.json"
summary robots --set requirements=[] --cycles 1 --plant-model plant-sim/models/irb930-12-0.85.json
summary fault --scenario gate-mismatch --fault motor:elbow:dead@0.5s
grep -q '"completed": false' "$work/fault/summary.json"
{
    sed -n '1,/^\[\[cycle/p' plant-sim/scenarios/gate.toml
    echo 'dwell = 0.1'
} >"$work/nothing.toml"
summary nothing --scenario "$work/nothing.toml"
grep -q '"cycle_time_s": null' "$work/nothing/summary.json"
for run in run robots fault nothing; do
    validate summary "$work/$run/summary.json"
    # The scenario inside is a scenario.
    "$python" -c 'import json, sys; print(json.load(open(sys.argv[1]))["scenario_text"])' "$work/$run/summary.json" \
        >"$work/$run.toml"
    validate scenario "$work/$run.toml"
done

echo "- statistics of a trace with an error frame, and its records decoded, a robot for the controller, a plan"
cat "$work/run/trace.log" - >"$work/errors.log" <<'END'
(99.000000) can0 20000004#0001000000000000
END
"$plant_sim" trace stats --json "$work/errors.log" >"$work/statistics.json"
validate statistics "$work/statistics.json"
{
    head -n 3000 "$work/run/trace.log"
    echo '(98.000000) can0 123#1122'
    tail -n 1 "$work/errors.log"
} >"$work/some.log"
"$plant_sim" trace decode --format jsonl "$work/some.log" >"$work/decoded.jsonl"
[ "$(wc -l <"$work/decoded.jsonl")" = 3002 ] || fail "not every record is a line"
validate decoded "$work/decoded.jsonl"
"$plant_sim" model >"$work/controller-model.json"
validate controller-model "$work/controller-model.json"
"$plant_sim" check pick-place --json >"$work/plan.json"
"$plant_sim" check --set cycle[0].jump.top=-0.29 --json >"$work/refused.json" 2>"$work/refused.err" && fail "nothing is refused"
validate plan "$work/plan.json" "$work/refused.json"

echo "- gates beside the optimum"
"$plant_sim" bench motion --quick --json >"$work/bench.json"
grep -q '"fault": null' "$work/bench.json"
validate motion-bench "$work/bench.json"

echo "- cases and results of a campaign"
validate campaign-cases plant-sim/campaigns/*.toml
"$plant_sim" campaign plan --count 20 >"$work/campaign.jsonl"
"$plant_sim" campaign run "$work/campaign.jsonl" --out "$work/campaign" 2>"$work/campaign.err" || [ $? = 1 ]
tail -n +2 "$work"/campaign/results-0-of-1.jsonl | split -l 1 --additional-suffix .json - "$work/campaign/case-"
validate campaign-result "$work"/campaign/case-*.json

echo "- files that do not conform are found"
sed 's/"mass": 11.5/"mass": -11.5/' plant-sim/models/irb930-22-1.05.json >"$work/wrong.json"
refused 'links' validate model "$work/wrong.json"
sed 's/^cycles = .*/cycles = 0/' plant-sim/scenarios/gate.toml >"$work/wrong.toml"
refused 'cycles' validate scenario "$work/wrong.toml"
sed '3s/"time_s"/"time"/' "$work/decoded.jsonl" >"$work/wrong.jsonl"
refused 'jsonl:3' validate decoded "$work/wrong.jsonl"
sed 's/"at_rest"/"at_ease"/' "$work/run/summary.json" >"$work/wrong.json"
refused 'at_rest' validate summary "$work/wrong.json"
