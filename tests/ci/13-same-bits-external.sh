#!/usr/bin/env bash
# A controller in another process, configured only with its bus, robot and rate, moves the arm by the same bits as the
# one in the simulator's process; either trace replays.
source "$(dirname "$0")/lib.bash"
build_host
cd "$work"
# The part of the port range that Linux does not assign by itself.
port=$((20000 + RANDOM % 10000))

for rate in 1000 3000; do
    port=$((port + 1))
    "$plant_sim" run --cycles 1 --rate "$rate" --set requirements=[] --out here >/dev/null 2>here.err
    "$controller" --bus "slcan:listen:127.0.0.1:$port" --rate "$rate" 2>controller.err & process=$!
    await controller.err "waiting for the drives"
    timeout 90 "$plant_sim" run --cycles 1 --rate "$rate" --set requirements=[] --bus "slcan:tcp:127.0.0.1:$port" --controller external --out there \
        >/dev/null 2>there.err || fail "run with an external controller at $rate Hz"
    kill -INT $process && wait $process || fail "Ctrl-C did not end the controller cleanly"
    cmp here/truth.csv there/truth.csv || fail "truths differ at $rate Hz"
    cmp here/trace.log there/trace.log || fail "frames differ at $rate Hz"
    "$plant_sim" trace replay --rate "$rate" there/trace.log >replay.txt 2>replay.err || fail "replay at $rate Hz"
    echo "ok: $rate Hz, $(wc -l <there/trace.log) frames, the same bits in one process and in two; $(cat replay.txt)"
done
