#!/usr/bin/env bash
# Parameters over a bus: listed and set in the middle of a run without disturbing it, and refused with the allowed
# range.
source "$(dirname "$0")/lib.bash"
build_host
cd "$work"
# The part of the port range that Linux does not assign by itself.
port=$((20000 + RANDOM % 10000))
parameters() { timeout 30 "$plant_sim" parameters --bus "slcan:tcp:127.0.0.1:$port" "$@" 2>parameters.err; }
holds() { # holds NAME VALUE: whether the node has this value now
    parameters --json >all.json
    grep -A 3 "\"name\": \"$1\"" all.json | grep -q "\"value\": $2,"
}

# --- a controller alone
"$controller" --bus "slcan:listen:127.0.0.1:$port" 2>controller.err & controller_id=$!
await controller.err "waiting for the drives"
parameters >alone.txt
grep -q '^bandwidth  *170 rad/s  *1 to 250  *170  at rest$' alone.txt
grep -q "the drives on .* do not answer" parameters.err || fail "silent drives are not reported"
parameters --set bandwidth=120 >set.txt
holds bandwidth 120.0 || fail "a value set is not kept"
validate parameters all.json
set_one() { timeout 30 "$plant_sim" parameters --bus "slcan:tcp:127.0.0.1:$port" --set "$1"; }
refused "bandwidth cannot be 300; allowed: 1 to 250 rad/s" set_one bandwidth=300
refused "sampling-period cannot be set" set_one sampling-period=0.001
refused "is not a parameter; allowed: bandwidth, " set_one bandwith=100
refused "the drives on .* do not answer" set_one hold-samples=7
echo "ok: a controller alone lists and sets its own parameters, and reports allowed ranges"

# --- during a run, in lock-step
timeout 120 "$plant_sim" run --cycles 200 --bus "slcan:tcp:127.0.0.1:$port" --controller external --out beside --json \
    >beside.json 2>run.err & run=$!
await run.err "cycle [0-9]* of"
holds bandwidth 170.0 || fail "a run does not reset its controller"
parameters --set following-error-elbow=0.04 --set hold-samples=8 >set.txt
holds following-error-elbow 0.04 || fail "a limit of the controller is not kept"
holds hold-samples 8.0 || fail "a value of the drives is not kept"
refused "torque-limit-lift cannot be set now; allowed: while the torque is off" set_one torque-limit-lift=0.5
parameters --server drives >drives.txt
[ "$(wc -l <drives.txt)" = 10 ] || fail "the drives do not list nine parameters"
kill -0 $run || fail "the run ended before the requests"
wait $run || fail "the run did not continue: $(cat run.err) $(cat beside.json)"
grep -q '"completed": true' beside.json && grep -q '"overruns": 0' beside.json && grep -q '"faults": \[\]' beside.json ||
    fail "parameter requests disturbed the run: $(cat beside.json)"
echo "ok: listed and set during a run of 200 cycles, without an overrun"

# --- a limit takes effect
timeout 120 "$plant_sim" run --cycles 200 --bus "slcan:tcp:127.0.0.1:$port" --controller external --out tight \
    >tight.txt 2>tight.err & run=$!
await tight.err "cycle [0-9]* of"
# Between two moves the arm is at rest, and gains may be set.
not_now() { ! set_one bandwidth=100 >not_now.txt 2>not_now.err && grep -q "bandwidth cannot be set now; allowed: while the arm is at rest" not_now.err; }
eventually "a refusal of gains in a move" not_now
parameters --set speed-factor=0.05 >set.txt
if wait $run; then fail "the arm continued at twenty times the speed limit"; fi
await controller.err "fault"
echo "ok: a speed limit set in the middle of a move stops the arm"
kill -INT $controller_id && wait $controller_id || fail "Ctrl-C did not end the controller cleanly"

# --- no answer, and no permission to ask
refused "cannot connect\|[Cc]onnection refused" set_one bandwidth=120
port=$((port + 1))
timeout 90 "$plant_sim" run --cycles 1 --listen "slcan:tcp:127.0.0.1:$port" --out watched >watched.txt 2>watched.err & run=$!
await watched.err "waiting for a client"
refused "can only be watched" set_one bandwidth=120
wait $run || fail "the watched run"
echo "ok: a bus that can only be watched is reported as such"
