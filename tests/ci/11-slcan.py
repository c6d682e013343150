"""11-slcan.py PORT TRACE PID: watches the bus on PORT with python-can until process PID has ended, then compares what it
saw with the trace: every frame, with identifier, data and FD flags."""

import contextlib
import os
import sys
from collections import Counter

import can

port, trace, pid = sys.argv[1], sys.argv[2], int(sys.argv[3])
seen = []
bus = can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{port}", bitrate=1_000_000, sleep_after_open=0)
while True:
    try:
        message = bus.recv(timeout=0.5)
    except (can.CanError, OSError):
        break  # the run has ended and closed the port
    if message is not None:
        seen.append(message)
    elif not os.path.exists(f"/proc/{pid}"):
        break
with contextlib.suppress(can.CanError, OSError):
    bus.shutdown()  # of a port that may be closed


def key(message):
    return (message.arbitration_id, bytes(message.data), message.is_fd, message.bitrate_switch)


ours = Counter(key(message) for message in can.CanutilsLogReader(trace))
theirs = Counter(key(message) for message in seen)
# Frames that the controller sent in the last sample never reached the end of the run's bus, and so not its trace.
missing = ours - theirs
extra = theirs - ours
assert not missing, f"{sum(missing.values())} frames of the trace were not seen, first {next(iter(missing))}"
assert sum(extra.values()) <= 3, f"{sum(extra.values())} frames were seen that are not in the trace: {extra}"
assert any(message.is_fd for message in seen) and any(not message.is_fd for message in seen)
print(f"ok: python-can saw all {sum(ours.values())} frames of the trace over slcan")
