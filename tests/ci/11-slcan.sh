#!/usr/bin/env bash
# Serial-line CAN over TCP, which needs no CAN in the kernel: plant and controller as two processes on
# the hub, and python-can as a client that watches the built-in bus.
source "$(dirname "$0")/lib.bash"
need_python python-can==4.6.1 pyserial==3.5
build_host
root=$PWD
cd "$work"
# The part of the port range that Linux does not assign by itself.
port=$((20000 + RANDOM % 10000))

# serve NAME ARGUMENT...: a controller with the arguments, in the background, on the next port
serve() {
    local name=$1
    shift
    port=$((port + 1))
    "$controller" --bus "slcan:listen:127.0.0.1:$port" "$@" 2>"$name.err" & process=$!
    await "$name.err" "waiting for the drives"
}
interrupt() { kill -INT $process && wait $process || fail "Ctrl-C did not end the controller cleanly"; }
plant() { timeout 90 "$plant_sim" run --cycles 1 "$@"; }

# --- two processes, in lock-step: the same bytes twice, whichever end listens
serve controller
plant --bus "slcan:tcp:127.0.0.1:$port" --controller external --out one >one.txt 2>one.err
interrupt
port=$((port + 1))
plant --bus "slcan:listen:127.0.0.1:$port" --controller external --out two >two.txt 2>two.err & process=$!
await two.err "waiting for a controller"
timeout 90 "$controller" --bus "slcan:tcp:127.0.0.1:$port" 2>second.err || true
wait $process || fail "run of a plant that listens"
cmp one/trace.log two/trace.log
echo "ok: two processes over slcan, $(wc -l <one/trace.log) frames, the same bytes in two runs"

# --- another robot, configured on both sides; the run itself compares the controller with its twin, byte for byte
robot=$root/plant-sim/models/irb930-12-0.85.json
"$plant_sim" model "$robot" --out robot.json
small() { plant --model "$robot" --bus "slcan:tcp:127.0.0.1:$port" --controller external --out small; }
serve told --model robot.json
small >small.txt 2>run.err
interrupt
serve untold
refused "differs from its twin" small
interrupt
port=$((port + 1))
refused "write one with: plant-sim model" "$controller" --bus "slcan:listen:127.0.0.1:$port" --model "$robot"
echo "ok: a controller configured for another robot moves it; one that is not is detected"

# --- python-can watches the built-in bus
port=$((port + 1))
plant --listen "slcan:tcp:127.0.0.1:$port" --out watched >watched.txt 2>watched.err & process=$!
await watched.err "waiting for a client"
timeout 90 "$python" "$root/tests/ci/11-slcan.py" "$port" watched/trace.log $process
wait $process || fail "watched run"
