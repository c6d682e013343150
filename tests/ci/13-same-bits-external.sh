#!/bin/bash
# A controller in another process is configured with nothing but its bus, its robot and its rate, and moves the arm by the
# same bits as the one in the simulator's process.
source "$(dirname "$0")/20-peers.bash"
cargo build --quiet --package controller-host
controller=$target/debug/controller
cd "$work"
fail() { echo "FAIL: $*"; tail -n 5 ./*.err; exit 1; }
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
# The part of the port range that Linux does not hand out by itself.
port=$((20000 + RANDOM % 10000))

for rate in 1000 3000; do
    port=$((port + 1))
    "$plant_sim" run --cycles 1 --rate $rate --out here >here.txt 2>here.err || fail "run in one process"
    "$controller" --bus "slcan:listen:127.0.0.1:$port" --rate $rate 2>controller.err & process=$!
    for _ in $(seq 600); do grep -qs "waiting for the drives" controller.err && break; sleep 0.1; done
    timeout 90 "$plant_sim" run --cycles 1 --rate $rate --bus "slcan:tcp:127.0.0.1:$port" --controller external --out there \
        >there.txt 2>there.err || fail "run with an external controller"
    kill -INT $process && wait $process || fail "Ctrl-C did not end the controller cleanly"
    cmp here/truth.csv there/truth.csv || fail "another truth at $rate Hz"
    cmp here/trace.log there/trace.log || fail "other frames at $rate Hz"
    for run in here there; do
        "$plant_sim" trace replay --rate $rate $run/trace.log >replay.txt 2>replay.err || fail "replay of $run at $rate Hz"
    done
    echo "ok: $rate Hz, $(wc -l <there/trace.log) frames, the same bits in one process and in two; $(cat replay.txt)"
done
