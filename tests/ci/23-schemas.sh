#!/usr/bin/env bash
# The JSON schemas in the hands of others: the schemas are schemas, every shipped file and all JSON that we print keep them,
# with no key that they do not name.
source "$(dirname "$0")/lib.bash"
need_python jsonschema==4.26.0
build_host

for name in scenario model payload summary statistics parameters cost controller-model; do
    "$plant_sim" schema "$name" >"$work/$name.schema"
done
validate() { # validate SCHEMA FILE...
    "$python" tests/ci/23-schemas.py "$work/$1.schema" "${@:2}"
}

echo "- every scenario and every model that we ship, and the model of the reference tables"
validate scenario plant-sim/scenarios/*.toml
validate model plant-sim/models/*.json tests/reference/model.json

echo "- summaries: of a run, of two robots, of a fault, of nothing"
summary() { # summary NAME ARGUMENT...
    "$plant_sim" run --out "$work/$1" "${@:2}" >"$work/$1.out" 2>"$work/$1.err" || [ "$1" = fault ]
}
summary run --cycles 2 --json
cmp "$work/run.out" "$work/run/summary.json"
summary robots --cycles 1 --plant-model plant-sim/models/irb930-12-0.85.json
sed 's/^friction = .*/friction = 9/; s/^payload = .*/payload = 9/' plant-sim/scenarios/gate-mismatch.toml >"$work/fault.toml"
summary fault --scenario "$work/fault.toml"
grep -q '"completed": false' "$work/fault/summary.json"
sed '/^jump/d; /cycle/d' plant-sim/scenarios/gate.toml >"$work/still.toml"
printf 'cycles = 1\n%s\n[[cycle]]\ndwell = 0.1\n' "$(cat "$work/still.toml")" >"$work/nothing.toml"
summary nothing --scenario "$work/nothing.toml"
grep -q '"cycle_time_s": null' "$work/nothing/summary.json"
for run in run robots fault nothing; do
    validate summary "$work/$run/summary.json"
    # The scenario inside is a scenario.
    "$python" -c 'import json, sys; print(json.load(open(sys.argv[1]))["scenario_text"])' "$work/$run/summary.json" \
        >"$work/$run.toml"
    validate scenario "$work/$run.toml"
done

echo "- statistics of a trace with an error frame, and a robot for the controller"
cat "$work/run/trace.log" - >"$work/errors.log" <<'END'
(99.000000) can0 20000004#0001000000000000
END
"$plant_sim" trace stats --json "$work/errors.log" >"$work/statistics.json"
validate statistics "$work/statistics.json"
"$plant_sim" model >"$work/controller-model.json"
validate controller-model "$work/controller-model.json"

echo "- what does not keep them is found"
sed 's/"mass": 11.5/"mass": -11.5/' plant-sim/models/irb930-22-1.05.json >"$work/wrong.json"
refused 'links' validate model "$work/wrong.json"
sed 's/^cycles = .*/cycles = 0/' plant-sim/scenarios/gate.toml >"$work/wrong.toml"
refused 'cycles' validate scenario "$work/wrong.toml"
sed 's/"at_rest"/"at_ease"/' "$work/run/summary.json" >"$work/wrong.json"
refused 'at_rest' validate summary "$work/wrong.json"
