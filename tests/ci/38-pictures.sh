#!/usr/bin/env bash
# The pictures of the README, made again. Their pages draw an arm that moves, complain of nothing, ask nobody for anything, and
# axe finds nothing in them; bytes are not compared, since each machine has fonts of its own.
#
#   tests/ci/38-pictures.sh                  checks
#   tests/ci/38-pictures.sh docs/pictures    and replaces them
source "$(dirname "$0")/lib.bash"
made=$(realpath -m "${1:-$work/pictures}")
mkdir -p "$made"

need_browser
build_host
"$plant_sim" run --quiet --out "$work/run"
need_cross wasm32-unknown-unknown
plant-sim/web/build "$work/what-if.html" >/dev/null
"$plant_sim" view palletise --cycles 1000 --no-open --port 0 >"$work/view.out" 2>"$work/view.err" &
await "$work/view.err" 'the page is at'
node tests/pages/pictures.mjs "$made" report="$work/run/report.html" what-if="$work/what-if.html" \
    view="$(grep -o 'http:[^ ]*' "$work/view.err")"

echo "- the README shows them all, and no others"
names() { basename -a "$1"/*; }
shown=$(grep -o '!\[[^]]*\](docs/pictures/[^)]*)' README.md | sed 's/.*pictures.//; s/)//' | sort)
[ "$shown" = "$(names "$made")" ] || fail "the README shows ${shown//$'\n'/ }, and made were $(names "$made" | xargs)"
[ "$shown" = "$(names docs/pictures)" ] || fail "docs/pictures holds $(names docs/pictures | xargs)"

echo "- they are small"
for picture in docs/pictures/*; do
    size=$(stat -c %s "$picture")
    [ "$size" -lt 61440 ] || fail "$picture has $size bytes"
done
