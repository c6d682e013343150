#!/bin/bash
# Serial-line CAN over TCP, which needs no CAN in the kernel: plant and controller as two processes on our hub, and
# python-can as a client that watches the built-in bus.
source "$(dirname "$0")/20-peers.bash"
cargo build --quiet --package controller-host
controller=$target/debug/controller
python_peers python-can==4.6.1 pyserial==3.5
cd "$work"
fail() { echo "FAIL: $*"; tail -n 5 ./*.err; exit 1; }
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
# The part of the port range that Linux does not hand out by itself.
port=$((20000 + RANDOM % 10000))

# --- two processes, in lock-step: the same bytes twice, whoever listens
"$controller" --bus "slcan:listen:127.0.0.1:$port" 2>controller.err & process=$!
for _ in $(seq 600); do grep -qs "waiting for the drives" controller.err && break; sleep 0.1; done
timeout 90 "$plant_sim" run --cycles 1 --bus "slcan:tcp:127.0.0.1:$port" --controller external --out one >one.txt 2>one.err ||
    fail "run with a controller that listens"
kill -INT $process && wait $process || fail "Ctrl-C did not end the controller cleanly"
timeout 90 "$plant_sim" run --cycles 1 --bus "slcan:listen:127.0.0.1:$((port + 1))" --controller external --out two >two.txt 2>two.err & process=$!
for _ in $(seq 600); do grep -qs "waiting for a controller" two.err && break; sleep 0.1; done
timeout 90 "$controller" --bus "slcan:tcp:127.0.0.1:$((port + 1))" 2>second.err || true
wait $process || fail "run of a plant that listens"
cmp one/trace.log two/trace.log || fail "two lock-step runs differ"
echo "ok: two processes over slcan, $(wc -l <one/trace.log) frames, the same bytes in two runs"

# --- another robot, told to both; the run itself compares the controller with its twin, byte for byte
robot=$OLDPWD/plant-sim/models/irb930-12-0.85.json
"$plant_sim" model "$robot" --out robot.json
small() { # small PORT [ARGUMENT...]: a run of the smaller robot with a controller that has the arguments
    local port=$1
    shift
    "$controller" --bus "slcan:listen:127.0.0.1:$port" "$@" 2>small.err & process=$!
    for _ in $(seq 600); do grep -qs "waiting for the drives" small.err && break; sleep 0.1; done
    local status=0
    timeout 90 "$plant_sim" run --cycles 1 --model "$robot" --bus "slcan:tcp:127.0.0.1:$port" --controller external --out small \
        >small.txt 2>run.err || status=$?
    kill -INT $process && wait $process || fail "Ctrl-C did not end the controller cleanly"
    return $status
}
small $((port + 3)) --model robot.json || fail "run of a controller that was told the robot"
small $((port + 4)) && fail "a controller with another robot went unnoticed"
grep -q "differs from its twin" run.err || fail "another robot: message"
"$controller" --bus "slcan:listen:127.0.0.1:$((port + 5))" --model "$robot" 2>small.err && fail "a model file was taken for a robot"
grep -q "write one with: plant-sim model" small.err || fail "model file: message"
echo "ok: a controller told another robot moves it; one that was not is found out"

# --- python-can watches the built-in bus
timeout 90 "$plant_sim" run --cycles 1 --listen "slcan:tcp:127.0.0.1:$((port + 2))" --out watched >watched.txt 2>watched.err & process=$!
for _ in $(seq 600); do grep -qs "waiting for a client" watched.err && break; sleep 0.1; done
timeout 90 "$python" "$OLDPWD/tests/ci/11-slcan.py" $((port + 2)) watched/trace.log $process ||
    fail "python-can saw other frames than the trace holds"
wait $process || fail "run that was watched"
