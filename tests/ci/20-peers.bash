# Sourced by the checks against other CAN tools: builds our command line and installs its peers.
# Sets $plant_sim and $python, and the temporary directory $work.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
plant_sim=$target/debug/plant-sim
python=$target/peers/bin/python
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cargo build --quiet --package plant-sim

# apt_peer COMMAND PACKAGE: installs PACKAGE if COMMAND is missing.
apt_peer() {
    command -v "$1" >/dev/null && return
    { apt-get update && apt-get install -y --no-install-recommends "$2"; } >"$work/apt.log" 2>&1 ||
        { cat "$work/apt.log"; echo "FAIL: cannot install $2"; exit 1; }
}

# python_peers MODULE=VERSION...: versions are fixed so that a check fails because of us alone.
python_peers() {
    [ -x "$python" ] || python3 -m venv "$target/peers"
    "$python" -m pip install --quiet --disable-pip-version-check "$@"
}
