#!/usr/bin/env bash
# checks.sh BIN: the checks of 10-vcan.sh, on a machine with vcan0.
source "$(dirname "$0")/../lib.bash"
bin=$1
source tests/ci/vcan/processes.bash
cd "$work"

# Identifiers and data of a candump log, sorted by identifier: frames of one node with one identifier stay in order,
# those of different nodes may be logged in either order. Flag 4 (FDF) repeats the meaning of ##.
frames() { awk '{print $3}' "$1" | sed -E 's/##[45]/##1/' | grep -v '^000#' | sort -s -t'#' -k1,1; }

# --- lock-step, the controller first, every frame captured
controller
await controller.err "waiting for the drives"
# With room for every frame: a lock-step run is faster than a program writing lines.
candump -L -r 67108864 vcan0 >capture.log & capture=$!
eventually "candump listening" sockets 2
plant --cycles 2 --out first >first.txt 2>first.err || fail "lock-step run"
sleep 1
kill $capture
frames first/trace.log >ours
frames capture.log >theirs
# Identifiers that a controller does not use while it starts, before the trace begins.
for id in 1C0 240 2C0 340 641 5C1; do
    count=$(grep -c "^$id#" ours) || fail "no $id in our trace"
    diff <(grep "^$id#" ours) <(grep -m "$count" "^$id#" theirs) >/dev/null ||
        fail "frames $id of candump differ from the trace"
done
passed "lock-step over vcan0: $(wc -l <ours) frames, the same in candump"

# --- once more: no clock is involved, so the same bytes
plant --cycles 2 --out again >again.txt 2>again.err || fail "second run with the same controller"
cmp first/trace.log again/trace.log || fail "two lock-step runs differ"
passed "a second run on the same controller: trace equal byte for byte"

# --- a second controller, a second plant
mark
timeout 60 "$bin/plant-sim" timing --bus socketcan:vcan0 --rate 100 --seconds 6 --svg t.svg >timing.txt 2>timing.err & timing=$!
await_controller "the drives are present\|reset by network management"
timeout 20 "$bin/controller" --bus socketcan:vcan0 2>second.err && fail "a second controller was accepted"
grep -q "another controller is on socketcan:vcan0" second.err || fail "second controller: message"
plant --out second >second.txt 2>>second.err && fail "a second plant was accepted"
grep -q "another plant" second.err || fail "second plant: message"
wait $timing || fail "timing"
grep -q "timing of 600 samples" timing.txt || fail "timing: report"
grep -q "</svg>" t.svg || fail "timing: picture"
passed "second controller and second plant refused; timing counted 600 samples"

# --- the controller dies in mid-run and comes back
mark
plant --cycles 1000 --out killed >killed.txt 2>killed.err & plant=$!
await_controller "moving"
kill -KILL $controller; wait $controller 2>/dev/null || true
wait $plant && fail "a run without controller was completed"
grep -q "is late" killed.err || fail "killed controller: not reported as late"
[ -s killed/summary.json ] || fail "killed controller: no summary"
# --- the plant first this time
plant --cycles 1 --out back >back.txt 2>back.err & plant=$!
await back.err "waiting for a controller"
controller
wait $plant || fail "run after the controller came back"
passed "controller killed: reported, summary written; plant first, controller later: completed"

# --- the interface reports bus-off, and its recovery, in the middle of a move
mark
plant --cycles 1000 --out off >off.txt 2>off.err & plant=$!
await_controller "moving"
cansend vcan0 20000140#0000000000000000
await_controller "bus off"
wait $plant && fail "a run with a bus-off was completed"
grep -q '"cause": "bus-off"' off/summary.json || fail "bus-off: $(cat off.txt)"
passed "a bus-off that the interface reports stops the arm"

# --- the plant dies in mid-run and comes back
mark
"$bin/plant-sim" run --cycles 1000 --bus socketcan:vcan0 --controller external --out dead >dead.txt 2>dead.err & plant=$!
await_controller "moving"
kill -KILL $plant; wait $plant 2>/dev/null || true
await_controller "the drives are silent"
[ ! -e dead/summary.json ] || fail "the plant was done before it was killed"
plant --cycles 1 --out alive >alive.txt 2>alive.err || fail "run after the plant came back"
passed "plant killed: the controller waited and served the next"
kill -INT $controller; wait $controller || fail "Ctrl-C did not end the controller cleanly"
grep -q "stopped in" controller.err || fail "controller: final report"

# --- the live page of a bus of others
"$bin/plant-sim" view --bus socketcan:vcan0 --no-open --port 0 >view.txt 2>view.err & view=$!
await view.err "the page is at"
port=$(sed -n 's,.*http://127.0.0.1:\([0-9]*\)/.*,\1,p' view.err)
exec 5<>"/dev/tcp/127.0.0.1/$port"
printf 'GET /stream HTTP/1.1\r\nHost: 127.0.0.1:%s\r\n\r\n' "$port" >&5
cat <&5 >stream.txt & stream=$!
controller
plant --cycles 1 --out seen >seen.txt 2>seen.err || fail "run under a live page"
await stream.txt 'mode enabled'
kill -INT $view; wait $view || fail "Ctrl-C did not end the live page cleanly"
wait $stream || true
exec 5>&-
grep -q 'frames of socketcan:vcan0' view.txt || fail "live page: no summary"
kill -INT $controller; wait $controller || fail "Ctrl-C did not end the controller cleanly"
passed "a live page shows vcan0"

# --- real time. A machine too slow for it may stop the arm; the exchange itself must work.
controller --real-time --rate 200
plant --rate 200 --cycles 1 --real-time --out real >real.txt 2>real.err || true
grep -q "commands different from the twin's" real.err || fail "real time: no report"
[ "$(grep -c ' 240##' real/trace.log)" -gt 20 ] || fail "real time: no commands"
kill -INT $controller; wait $controller || fail "real-time controller did not end cleanly"
passed "real time over vcan0: $(grep -c ' 240##' real/trace.log) commands"

# --- a text that is not a bus address is refused
no_bus() { refused "$1" timeout 20 "$bin/controller" --bus "$2"; } # no_bus TEXT BUS
no_bus "there is no interface vcan7; CAN interfaces here: vcan0" socketcan:vcan7
no_bus "lo is not a CAN interface" socketcan:lo
no_bus "is not a bus; allowed" vcan0
if ip link add dev vcan1 type vcan 2>/dev/null; then
    ip link set vcan1 mtu 16 up
    no_bus "vcan1 carries classical CAN only (MTU 16)" socketcan:vcan1
    ip link set vcan1 down && ip link set vcan1 mtu 72
    no_bus "vcan1 is down" socketcan:vcan1
    ip link del vcan1
fi
passed "missing, foreign, classical and down interfaces are reported"
