#!/usr/bin/env bash
# Instructions of the host's programs, near the recorded counts, and growing in proportion to the work.
#   tests/ci/39-speed.sh           compares
#   tests/ci/39-speed.sh update    records them, after an intended change
source "$(dirname "$0")/lib.bash"
need valgrind valgrind
need python3 python3
build_host
timeout 300 python3 tests/speed/counts.py "$plant_sim" "$work" ${1:+--update}
