#!/usr/bin/env bash
# Traces of hours stream: the memory of their readers does not grow. LONG=7000000 tests an hour and a half.
source "$(dirname "$0")/lib.bash"
need time time
need python3 python3
build_host
long=${LONG:-700000}

"$plant_sim" run --scenario gate --out "$work/run" >/dev/null
kib() { # kib FRAMES COMMAND...: peak resident memory of the command that reads a trace of this many frames
    local frames=$1 out=/dev/null
    shift
    [ "$1" = stats ] && out=$work/out
    python3 tests/ci/22-repeat.py "$work/run/trace.log" "$frames" |
        env time --format %M --output "$work/kib" "$plant_sim" trace "$@" - 2>"$work/trace.err" >"$out" ||
        fail "trace $*"
    [ "$1" != stats ] || grep -q "^$frames frames" "$out" || fail "not $frames frames"
    cat "$work/kib"
}
for command in stats decode "decode --format csv" "decode --format jsonl" "convert --to pcapng" "convert --to asc" "convert --to mcap" plot; do
    short=$(kib $((long / 10)) $command)
    full=$(kib "$long" $command)
    # Keeping four bytes per frame would take 2.4 MiB more.
    [ $((full - short)) -lt 2048 ] || fail "trace $command grows from $short to $full KiB"
    echo "ok: trace $command of $long frames in $full KiB, of a tenth in $short KiB"
done
