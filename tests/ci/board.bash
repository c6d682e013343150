# Shared by the checks of the images for a Cortex-M4F; sourced after lib.bash. Installs their tools, builds the
# programs.

need arm-none-eabi-objdump binutils-arm-none-eabi
need qemu-system-arm qemu-system-arm
need python3 python3
need_cross thumbv7em-none-eabihf
build_host

# board PACKAGE [ARGS]: builds a program for the board.
board() { tests/board/cargo build --release --quiet --locked --package "$@"; }

# built PACKAGE [ARGS]: the same; prints the path of the result.
built() { board "$@" --message-format=json-render-diagnostics | grep -o '"executable":"[^"]*"' | tail -1 | cut -d'"' -f4; }

# still_runs PID: a zombie has ended; its parent has yet to notice.
still_runs() { grep -q '^State:.*[^Z] (' "/proc/$1/status" 2>/dev/null; }

# ends_with_its_run SECONDS ARGS: a killed `plant-sim run --controller qemu ARGS` leaves no emulator behind.
ends_with_its_run() {
    local patience=$1 run emulator=
    shift
    "$plant_sim" run --cycles 10000 --controller qemu --out "$work/killed" "$@" >/dev/null 2>"$work/killed.err" &
    run=$!
    for _ in $(seq 100); do
        read -r emulator _ <"/proc/$run/task/$run/children" || true
        [ -n "$emulator" ] && break
        sleep 0.1
    done
    [ -n "$emulator" ] || fail "the run started no emulator"
    sleep 2
    kill -KILL "$run"
    wait "$run" 2>/dev/null || true
    for _ in $(seq "$patience"); do
        still_runs "$emulator" || return 0
        sleep 1
    done
    fail "QEMU outlived the run"
}
