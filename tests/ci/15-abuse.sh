#!/usr/bin/env bash
# Bad input and broken processes on a bus with the real controller process: nothing moves by itself, everything is told,
# nothing hangs. Over vcan0 and over a serial line.
#
#   tests/ci/15-abuse.sh              a process that is stopped is stopped for 3 s, in real time 1 s
#   tests/ci/15-abuse.sh SECONDS      for so long, at least 3 s, in real time 2 s less
source "$(dirname "$0")/lib.bash"
need python3 python3
need_vcan
build_host
timeout 600 tests/with-vcan bash tests/ci/vcan/abuse.sh "$bin" "${1:-3}"

# --- the same bad frames over a serial line, with lines among them that are no frames
cd "$work"
port=$((20000 + RANDOM % 10000))
nice -n 19 "$controller" --bus "slcan:listen:127.0.0.1:$port" 2>controller.err & process=$!
await controller.err "waiting for the drives"
python3 "$root/tests/ci/vcan/noise.py" "127.0.0.1:$port" >noise.txt 2>noise.err & noise=$!
await noise.txt listening
timeout 90 nice -n 19 "$plant_sim" run --scenario gate --cycles 1 --bus "slcan:tcp:127.0.0.1:$port" --controller external --out noisy \
    >noisy.txt 2>noisy.err || fail "a run under bad frames"
source "$root/tests/ci/vcan/noise.bash"
judge_noise "$process"
echo "ok: slcan, $noise_says"
