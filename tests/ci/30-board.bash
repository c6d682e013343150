# Sourced by the checks of the images for a Cortex-M4F: installs their tools, builds our command line.
# Sets $plant_sim and the temporary directory $scratch.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# need PACKAGE...: installs Debian packages where that can be done; otherwise says which.
need() {
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
    else
        echo "$0: install: $*" >&2
        exit 1
    fi
}

command -v arm-none-eabi-objdump >/dev/null || need binutils-arm-none-eabi
command -v qemu-system-arm >/dev/null || need qemu-system-arm
command -v python3 >/dev/null || need python3
tests/board/cargo --version >/dev/null 2>&1 || need rustc-web cargo-web rust-web-src lld

cargo build --release --quiet --locked --package plant-sim
plant_sim=${CARGO_TARGET_DIR:-target}/release/plant-sim

# board PACKAGE [ARGS]: builds a program for the board.
board() { tests/board/cargo build --release --quiet --locked --package "$@"; }

# built PACKAGE [ARGS]: the same; prints where cargo has put it.
built() { board "$@" --message-format=json | grep -o '"executable":"[^"]*"' | tail -1 | cut -d'"' -f4; }

# still_runs PID: a zombie has ended; whoever adopted it has yet to notice.
still_runs() { grep -q '^State:.*[^Z] (' "/proc/$1/status" 2>/dev/null; }

# ends_with_its_run SECONDS ARGS: a killed `plant-sim run --controller qemu ARGS` leaves no emulator behind.
ends_with_its_run() {
    local patience=$1 run emulator=
    shift
    "$plant_sim" run --cycles 10000 --controller qemu --out "$scratch/killed" "$@" >/dev/null 2>&1 &
    run=$!
    for _ in $(seq 100); do
        read -r emulator _ <"/proc/$run/task/$run/children" || true
        [ -n "$emulator" ] && break
        sleep 0.1
    done
    [ -n "$emulator" ]
    sleep 2
    kill -KILL "$run"
    wait "$run" 2>/dev/null || true
    for _ in $(seq "$patience"); do
        still_runs "$emulator" || return 0
        sleep 1
    done
    echo "$0: QEMU outlived the run" >&2
    return 1
}
