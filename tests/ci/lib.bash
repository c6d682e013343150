# Shared by every check. A check begins with
#
#     source "$(dirname "$0")/lib.bash"
# and then it
#   - runs in the project's root, with a temporary directory $work, and $target where cargo builds;
#   - ends at the first command that fails, and reports which command, where, and the last lines of standard error. Where a
#     check keeps a command quiet, it sends its standard error to $work/NAME.err, so that the report finds it;
#   - ends the jobs it has started when it ends.
#
# need, need_python, need_browser, need_vcan, need_slurm and need_cross install what a check depends on (root on Debian) or say what is missing.
# build_host builds the project's programs; validate checks JSON and TOML against their schemas.

set -Eeuo pipefail
shopt -s inherit_errexit
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
root=$PWD
export CARGO_TERM_COLOR=never PATH=$PATH:/usr/sbin:/sbin

work=$(mktemp -d)
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")

# explain WHAT: prints it with the chain of callers and the end of the newest $work/*.err. Once: a failing subshell
# makes its parents fail too.
explain() {
    [ ! -e "$work/explained" ] || return 0
    touch "$work/explained"
    local depth file
    {
        echo "FAIL: $1"
        for ((depth = 1; depth < ${#FUNCNAME[@]} - 1; depth++)); do
            echo "    at ${BASH_SOURCE[depth + 1]}:${BASH_LINENO[depth]}"
        done
        for file in $(find "$work" -maxdepth 1 -name '*.err' -size +0 -printf '%T@ %p\n' | sort -r | head -n 3 | cut -d' ' -f2-); do
            echo "--- the end of ${file##*/}"
            tail -n 20 "$file"
        done
    } >&2
}

failed() { # failed STATUS COMMAND, by the trap
    local why
    case $1 in
        124) why="status 124, out of time" ;;
        127) why="status 127, no such command" ;;
        137) why="status 137, killed" ;;
        141) why="status 141, a pipe whose reader has ended" ;;
        *) why="status $1" ;;
    esac
    explain "$2 ($why)"
}
trap 'failed $? "$BASH_COMMAND"' ERR

fail() { # fail MESSAGE
    explain "$1"
    exit 1
}

finish() {
    local jobs
    jobs=$(jobs -p)
    [ -z "$jobs" ] || kill $jobs 2>/dev/null || true
    rm -rf "$work"
}
trap finish EXIT

apt_get() { # apt_get ARGUMENT...: waits for another running apt, for ten minutes at most
    local waited=0
    # apt's own DPkg::Lock::Timeout waits for the lock of dpkg, but not for those of lists and downloads.
    until LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Acquire::Retries=3 "$@" >"$work/apt.err" 2>&1 </dev/null; do
        grep -q 'Could not get lock' "$work/apt.err" && [ "$waited" -lt 600 ] || return 1
        [ "$waited" -gt 0 ] || echo "waiting for another apt: $(grep -m 1 -o 'Could not get lock.*' "$work/apt.err")"
        sleep 2
        waited=$((waited + 2))
    done
    rm "$work/apt.err"
}

debian() { # debian PACKAGE...: installs them
    if [ "$(id -u)" != 0 ] || ! type -P apt-get >/dev/null; then
        fail "missing here. Debian: apt-get install $*"
    fi
    echo "installing $*"
    # Old lists lead to old versions. Once per check is enough.
    [ -n "${lists_are_new:-}" ] || apt_get update || fail "cannot update the lists of packages"
    lists_are_new=yes
    apt_get install --no-install-recommends "$@" || fail "cannot install $*"
}

need() { # need COMMAND PACKAGE
    # -P: a program, not the shell's keyword of the same name.
    type -P "$1" >/dev/null || debian "$2"
    type -P "$1" >/dev/null || fail "$2 is installed but contains no $1"
}

need_python() { # need_python MODULE==VERSION...: sets $python; fixed versions, so that only changes here make a check fail
    need python3 python3
    python=$target/peers/bin/python
    if ! "$python" -m pip --version >/dev/null 2>&1; then
        # A separate package in Debian.
        python3 -c 'import ensurepip' 2>/dev/null || debian python3-venv
        python3 -m venv --clear "$target/peers"
    fi
    "$python" -m pip install --quiet --disable-pip-version-check "$@"
}

need_browser() { # sets $peers and exports PEERS, CHROMIUM: where tests/pages finds a browser, what drives it, and what judges pages
    need chromium chromium
    need node nodejs
    need npm npm
    peers=$target/pages
    mkdir -p "$peers"
    npm install --prefix "$peers" --no-save --no-package-lock --no-audit --no-fund --silent \
        playwright-core@1.56.1 axe-core@4.14.1 uplot@1.6.32 2>"$work/npm.err"
    CHROMIUM=$(type -P chromium)
    export PEERS=$peers CHROMIUM
}

validate() { # validate SCHEMA FILE...: the files keep the schema that plant-sim prints under this name
    need_python jsonschema==4.26.0
    "$plant_sim" schema "$1" >"$work/$1.schema"
    "$python" "$root/tests/ci/schema.py" "$work/$1.schema" "${@:2}"
}

need_vcan() { # what tests/with-vcan needs, and candump
    need ip iproute2
    need candump can-utils
    need insmod kmod
    ip link show vcan0 up 2>/dev/null | grep -q 'mtu 72' || ip link add dev vcan0 type vcan 2>/dev/null ||
        need linux.uml user-mode-linux
}

need_slurm() { # a Slurm of this check alone, with this machine as its only node
    need slurmctld slurm-wlm
    need munged munge
    local slurm=$work/slurm-daemons
    mkdir "$slurm"
    head -c 1024 /dev/urandom >"$slurm/key"
    chmod 700 "$slurm"
    chmod 600 "$slurm/key"
    export SLURM_CONF=$slurm/slurm.conf
    # No systemd, no control groups, no accounting.
    cat >"$SLURM_CONF" <<END
ClusterName=check
SlurmctldHost=localhost
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$slurm/socket
CredType=cred/munge
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName=localhost CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=localhost Default=YES State=UP
END
    # Nothing here uses control groups; to find out their version it would need them mounted, which a container may lack.
    echo CgroupPlugin=cgroup/v1 >"$slurm/cgroup.conf"
    munged --foreground --force --key-file="$slurm/key" --socket="$slurm/socket" --pid-file="$slurm/munged.pid" \
        --log-file="$slurm/munged.log" --seed-file="$slurm/seed" >"$work/munged.err" 2>&1 &
    eventually "the socket of munged" test -S "$slurm/socket"
    slurmctld -D >"$work/slurmctld.err" 2>&1 &
    slurm_daemons=$!
    slurmd -D -N localhost >"$work/slurmd.err" 2>&1 &
    slurm_daemons+=" $!"
    eventually "an idle node" bash -c 'sinfo --noheader --format=%t 2>/dev/null | grep -q idle'
}

stop_slurm() { # before $work goes, into which it writes until its end
    scontrol shutdown
    wait $slurm_daemons || true
}

need_cross() { # need_cross TARGET: what tests/cross needs for it, clippy included
    tests/cross "$1" clippy --version >/dev/null 2>&1 || debian rustc-web cargo-web rust-web-src rust-web-clippy lld
    tests/cross "$1" clippy --version >/dev/null 2>"$work/cross.err"
}

build_host() { # sets $bin, $plant_sim and $controller
    bin=$target/release
    plant_sim=$bin/plant-sim controller=$bin/controller
    cargo build --release --locked --quiet --package plant-sim --package controller-host
}

eventually() { # eventually WHAT COMMAND...: waits until the command succeeds; a minute is long enough for any machine
    local what=$1
    shift
    for _ in $(seq 600); do
        "$@" && return
        sleep 0.1
    done
    fail "$what did not happen within a minute"
}

await() { # await FILE TEXT
    eventually "\"$2\" in $1" grep -qs "$2" "$1"
}

refused() { # refused TEXT COMMAND...: the command fails, with TEXT in its error message
    local text=$1
    shift
    if "$@" >"$work/refused.out" 2>"$work/refused.err"; then
        fail "succeeded, but should have been refused: $*"
    fi
    grep -q "$text" "$work/refused.err" || fail "no \"$text\" in the output of: $*"
    rm "$work/refused.err"
}

type -P cargo >/dev/null || fail "cargo is missing; install Rust 1.89 or newer from https://rustup.rs"
need cc gcc
