#!/bin/bash
# Traces of hours stream: what their readers remember does not grow with them. LONG=7000000 tries an hour and a half.
source "$(dirname "$0")/20-peers.bash"
apt_peer time time
cargo build --release --locked --quiet --package plant-sim
plant_sim=$target/release/plant-sim
long=${LONG:-700000}

"$plant_sim" run --scenario gate --out "$work/run" >/dev/null
kib() { # kib FRAMES COMMAND...: peak resident memory of the command that reads a trace of so many frames
    local frames=$1 out=/dev/null
    shift
    [ "$1" = stats ] && out=$work/out
    python3 tests/ci/22-repeat.py "$work/run/trace.log" "$frames" |
        env time --format %M --output "$work/kib" "$plant_sim" trace "$@" - 2>"$work/err" >"$out" ||
        { cat "$work/err"; echo "FAIL: trace $*"; exit 1; }
    [ "$1" != stats ] || grep -q "^$frames frames" "$out" || { echo "FAIL: not $frames frames"; exit 1; }
    cat "$work/kib"
}
for command in stats decode "decode --format csv" "decode --format jsonl" "convert --to pcapng" "convert --to asc" plot; do
    short=$(kib $((long / 10)) $command)
    full=$(kib "$long" $command)
    # Four bytes kept of each frame would be 2.4 MiB more.
    [ $((full - short)) -lt 2048 ] || { echo "FAIL: trace $command grows from $short to $full KiB"; exit 1; }
    echo "ok: trace $command of $long frames in $full KiB, of a tenth in $short KiB"
done
