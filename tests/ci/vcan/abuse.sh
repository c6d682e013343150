#!/usr/bin/env bash
# abuse.sh BIN SECONDS: the checks of 15-abuse.sh, on a machine with vcan0; a process that is stopped is stopped for SECONDS,
# two less in real time, where nobody waits for it that long.
source "$(dirname "$0")/../lib.bash"
bin=$1 stand=$2
source tests/ci/vcan/processes.bash
source tests/ci/vcan/noise.bash
plant_sim=$bin/plant-sim
noise_program=$root/tests/ci/vcan/noise.py
cd "$work"

in_background() { # in_background NAME OPTION...: a plant that runs on, to be stopped and continued
    "$plant_sim" run --scenario gate --cycles 1000 --bus "socketcan:$interface" --controller external --out "$1" "${@:2}" \
        >"$1.txt" 2>"$1.err" & plant=$!
}
ended() { # ended NAME TEXT: the run has failed and has said why
    wait $plant && fail "$1: the run was completed"
    grep -q "$2" "$1.err" || fail "$1: does not say \"$2\""
}
at_rest() { # at_rest NAME: the arm stands with its brake closed
    grep -q '"at_rest": true' "$1/summary.json" || fail "$1: the arm is not at rest"
}
has_socket() { # has_socket PID
    find "/proc/$1/fd" -lname "socket:*" | grep -q .
}
watch() { # watch NAME: what is on the bus from now on, for no_torque
    candump -L -r 67108864 "$interface" >"$1.log" & watcher=$!
    # The number of sockets on the bus does not tell: a plant whose controller stands still may have ended.
    eventually "candump with its socket" has_socket $watcher
    sleep 0.1
}
no_torque() { # no_torque NAME COUNT: of at least COUNT commands since, none switches torque on again, and the last has none
    sleep 0.5
    kill $watcher
    # What was in the queue of a process that stood still is answered as if it were new, so that the first may have it.
    "$plant_sim" trace decode --format jsonl "$1.log" 2>"$1.decode.err" | grep -o '"message":"Command".*"control":{"value":[^]]*]' >"$1.commands" || true
    awk -v least="$2" '{ on = /torque/; again += on && NR > 1 && !was; was = on } END { exit NR < least || again || was }' "$1.commands" ||
        fail "$1: torque after the pause, or fewer than $2 commands"
}
# A slow machine may stop the arm by itself, before anything is done to it: told as well.
real=(--real-time --rate 100)
begun="moving\|controller: fault"

# --- bad frames while nobody moves, with identifiers of a controller among them
controller
await controller.err "waiting for the drives"
python3 "$noise_program" vcan0 1000 >noise.txt 2>noise.err || fail "noise"
sleep 0.5
end_controller
counted=$(sed -n 's/.*frames not used: \(.*\); not sent: .*/\1/p' controller.err)
[ "$counted" = "$(sed -n 1p noise.txt)" ] || fail "counted '$counted', sent were '$(sed -n 1p noise.txt)'"
passed "a waiting controller: $counted"

# --- bad frames in every sample: who sends them comes first
nice -n 19 "$bin/controller" --bus socketcan:vcan0 2>controller.err & controller=$!
await controller.err "waiting for the drives"
python3 "$noise_program" vcan0 >noise.txt 2>noise.err & noise=$!
await noise.txt listening
timeout 60 nice -n 19 "$plant_sim" run --scenario gate --cycles 1 --bus socketcan:vcan0 --controller external --out noisy \
    >noisy.txt 2>noisy.err || fail "a run under bad frames"
judge_noise $controller
passed "vcan0, $noise_says"

# --- one of two processes stands still, in lock-step and in real time
for way in lock-step real-time; do
    options=() pause=$stand
    [ $way = lock-step ] || options=("${real[@]}") pause=$((stand - 2))
    controller "${options[@]}"
    await controller.err "waiting for the drives"
    mark
    in_background controller-stands "${options[@]}"
    await_controller "$begun"
    kill -STOP $controller
    sleep "$pause"
    watch continued
    kill -CONT $controller
    ended controller-stands "late\|silent\|controller went to"
    at_rest controller-stands
    await_controller "controller: fault\|controller: estop"
    no_torque continued 1
    passed "$way: the controller stood still for $pause s: the drives have stopped the arm, both say so"

    mark
    in_background plant-stands "${options[@]}"
    await_controller "$begun"
    kill -STOP $plant 2>/dev/null || true
    await_controller "controller: fault"
    sleep "$pause"
    watch continued
    kill -CONT $plant 2>/dev/null || true
    if [ $way = lock-step ]; then
        has_said "fault: peer silent" || fail "the controller did not notice"
        # The twin knows nothing of the pause, and the first frame that differs ends the run, in mid-motion; a plant that was stopped while it
        # waited for an answer has given it up, and hears what became of the controller.
        ended plant-stands "this process has stood still\|went to fault: peer silent"
        # Often before it has sent anything that is answered.
        no_torque continued 0
    else
        ended plant-stands "the controller went to fault"
        at_rest plant-stands
        no_torque continued 1
    fi
    end_controller
    passed "$way: the plant stood still for $pause s: the controller has switched off and says so"
done

# --- real time while other programs want the processor
controller "${real[@]}"
await controller.err "waiting for the drives"
busy=()
for _ in $(seq $((2 * $(nproc)))); do
    while :; do :; done & busy+=($!)
done
plant "${real[@]}" --cycles 1 --out busy >busy.txt 2>busy.err && result=completed || result="ended: $(tail -n 1 busy.err)"
kill "${busy[@]}"
grep -q "commands different from the twin's" busy.err || fail "real time under load: no report"
[ "$result" = completed ] || at_rest busy
end_controller
passed "real time under load: $result"

# --- the clock is set while a run goes on; only where it is nobody else's
if grep -q 'User Mode Linux' /proc/cpuinfo; then
    controller
    await controller.err "waiting for the drives"
    plant --cycles 1 --out clean >clean.txt 2>clean.err || fail "a run"
    mark
    plant --cycles 1 --out jumps >jumps.txt 2>jumps.err & plant=$!
    await_controller moving
    for seconds in 3600 -7200 3600; do
        date -s "@$(($(date +%s) + seconds))" >/dev/null
        sleep 0.1
    done
    wait $plant || fail "a run while the clock was set"
    cmp clean/trace.log jumps/trace.log || fail "the clock has changed the run"
    end_controller
    passed "a clock that jumps an hour ahead and back changes no byte"

    # In real time both wait for deadlines.
    controller "${real[@]}"
    await controller.err "waiting for the drives"
    mark
    plant "${real[@]}" --cycles 2 --out jumps >jumps.txt 2>jumps.err || true & plant=$!
    await_controller "$begun"
    for seconds in 3600 -7200 3600; do
        date -s "@$(($(date +%s) + seconds))" >/dev/null
        sleep 0.1
    done
    wait $plant
    result=completed
    grep -q '"completed": true' jumps/summary.json || result="ended: $(grep -m 1 'not completed' jumps.err)"
    [ "$result" = completed ] || at_rest jumps
    # Frame by frame, no time runs back or jumps.
    tr -d '()' <jumps/trace.log | awk 'NR > 1 && ($1 < last || $1 > last + 5) { exit 1 } { last = $1 }' ||
        fail "real time: the clock is in the trace"
    end_controller
    passed "the same in real time: $result"
else
    echo "- not tested here: the clock of this machine is not set"
fi

# --- the interface goes down in mid-motion, and comes up again
if ip link add dev vcan1 type vcan 2>/dev/null; then
    interface=vcan1
    ip link set vcan1 mtu 72 up
    controller "${real[@]}"
    await controller.err "waiting for the drives"
    mark
    in_background down "${real[@]}"
    await_controller "$begun"
    ip link set vcan1 down
    await_controller "vcan1 is down; bring it up with: ip link set vcan1 up; waiting for it"
    await_controller "controller: fault"
    ended down "going on without it\|the controller went to"
    at_rest down
    ip link set vcan1 up
    await_controller "is back"
    plant "${real[@]}" --cycles 1 --out up >up.txt 2>up.err || true
    [ "$(grep -c ' 240##' up/trace.log)" -gt 20 ] || fail "no commands after the interface came back"
    # A missing interface is waited for, too.
    mark
    ip link del vcan1
    await_controller "waiting for it"
    ip link add dev vcan1 type vcan
    ip link set vcan1 mtu 72 up
    await_controller "is back"
    end_controller
    ip link del vcan1
    passed "an interface down, up, gone and back: told, the torque is off meanwhile, the controller serves the next plant"
else
    echo "- not tested here: only root may add vcan1"
fi
