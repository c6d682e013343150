#!/usr/bin/env bash
# The pages in a browser: they draw, act, are found by keyboard and screen reader, and ask nobody for anything; the page that
# runs the simulation runs it as the program does.
#
#   tests/ci/36-pages.sh             checks
#   tests/ci/36-pages.sh PICTURES    and leaves the pictures of every screen in this folder
source "$(dirname "$0")/lib.bash"
pictures=$(realpath -m "${1:-$work/pictures}")
mkdir -p "$pictures"

need_browser
build_host

echo "- what others have written is what they have published"
vendor=plant-sim/pages/vendor
grep -E '^[0-9a-f]{64}  ' "$vendor/README.md" >"$work/sums"
(cd "$vendor" && sha256sum --quiet --strict -c "$work/sums")
cmp "$vendor/uplot/LICENSE" "$peers/node_modules/uplot/LICENSE"
for file in uPlot.iife.min.js uPlot.min.css; do
    cmp "$vendor/uplot/$file" "$peers/node_modules/uplot/dist/$file"
done

echo "- reports"
run() { # run NAME ARGS...: a run into $work/NAME, whether it gets to its end or not
    "$plant_sim" run --out "$work/$1" "${@:2}" >"$work/run.out" 2>"$work/run.err" || [ $? = 1 ]
}
run gate
run other --law pid --payload 10
# The motor of the lift dies: the lift falls behind, and the controller stops.
run failed --fault motor:lift:dead@0.5s
"$plant_sim" report "$work/gate" "$work/other" --out "$work/compare.html" >/dev/null
size=$(stat -c %s "$work/gate/report.html")
[ "$size" -lt 1500000 ] || fail "report.html of ten cycles has $size bytes"
run without --no-report
[ ! -e "$work/without/report.html" ] || fail "--no-report leaves a report"
refused "report.html: cannot be read" "$plant_sim" report "$work/gate" "$work/without"
node tests/pages/report.mjs "$work/gate" "$work/failed" "$work/other" "$work/compare.html" "$pictures"

echo "- the live page"
node tests/pages/view.mjs "$plant_sim" "$pictures"

echo "- the page that runs the simulation"
need_cross wasm32-unknown-unknown
plant-sim/web/build "$work/what-if.html" >/dev/null
size=$(stat -c %s "$work/what-if.html")
[ "$size" -lt 1500000 ] || fail "what-if.html has $size bytes"
refused "not a WebAssembly module" "$plant_sim" what-if "$work/gate/trace.log" --out "$work/none.html"
node tests/pages/what-if.mjs "$work/what-if.html" "$(realpath "$plant_sim")" "$pictures"
