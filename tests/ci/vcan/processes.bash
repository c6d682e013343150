# Plant and controller as processes on a CAN interface, for the checks of this folder. Sourced after lib.bash, with $bin.

interface=vcan0
said=0
passed() { echo "ok: $*"; }
mark() { said=$(wc -l <controller.err); } # later lines of the controller are new
has_said() { tail -n +$((said + 1)) controller.err | grep -q "$1"; }
await_controller() { eventually "controller: \"$1\"" has_said "$1"; }
sockets() { [ "$(grep -c "$interface" /proc/net/can/rcvlist_all)" -ge "$1" ]; } # programs that receive from it
controller() { "$bin/controller" --bus "socketcan:$interface" "$@" 2>controller.err & controller=$!; }
plant() { timeout 60 "$bin/plant-sim" run --scenario gate --bus "socketcan:$interface" --controller external "$@"; }
end_controller() { kill -INT $controller && wait $controller || fail "Ctrl-C did not end the controller cleanly"; }
