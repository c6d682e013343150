#!/bin/bash
# CAN tools and our programs on one vcan0: canplayer, cansend, candump, python-can and slcand, each at both ends.
source "$(dirname "$0")/20-peers.bash"
export DEBIAN_FRONTEND=noninteractive PATH=$PATH:/usr/sbin:/sbin
apt_peer ip iproute2
apt_peer candump can-utils
apt_peer socat socat
apt_peer cc gcc
apt_peer insmod kmod
if ! { ip link show vcan0 up 2>/dev/null | grep -q 'mtu 72' || ip link add dev vcan0 type vcan 2>/dev/null; }; then
    apt_peer linux.uml user-mode-linux
fi
python_peers python-can==4.6.1 pyte==0.8.2
cargo build --release --locked --quiet --package plant-sim --package controller-host
bin=$target/release

"$bin/plant-sim" run --cycles 1 --out "$work/run" >/dev/null
timeout 200 tests/with-vcan "$python" tests/ci/vcan/peers.py "$bin" "$work"
