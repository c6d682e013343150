#!/usr/bin/env bash
# Verdicts of a run, read by the programs that they are for: JUnit XML by junitparser, needs.json by sphinx-needs in a
# document that is built with warnings as errors, Markdown by a renderer.
source "$(dirname "$0")/lib.bash"
build_host
need_python junitparser==5.0.3 sphinx-needs==9.1.0 markdown-it-py==4.3.0

verdicts() { # verdicts NAME STATUS ARGUMENT...: a run into $work/NAME with this exit code
    local status=0
    "$plant_sim" run --out "$work/$1" --junit "$work/$1.xml" --needs "$work/$1.json" --markdown "$work/$1.md" "${@:3}" \
        >"$work/$1.out" 2>"$work/$1.err" || status=$?
    [ "$status" = "$2" ] || fail "$1: exit code $status instead of $2"
}

echo "- met, missed, stopped as the scenario says, and not completed"
verdicts good 0 --cycles 2
verdicts missed 1 --cycles 1 --law pid
grep -q 'plant-sim: .* requirements missed: .*tracking' "$work/missed.err"
verdicts stopped 0 --scenario estop-descent
verdicts failed 1 --cycles 1 --fault motor:elbow:dead@0.4s
for name in good missed stopped failed; do
    mkdir "$work/docs-$name"
    cp "$work/$name.json" "$work/docs-$name/needs.json"
    "$python" tests/ci/24-verdicts.py "$work/$name/summary.json" "$work/$name.xml" "$work/$name.md" "$work/docs-$name"
done

echo "- a file that cannot be written is refused before the run"
refused "cannot write to" "$plant_sim" run --out "$work/none" --junit "$work"
[ ! -e "$work/none" ] || fail "a run was begun"
