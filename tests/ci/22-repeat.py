"""22-repeat.py TRACE FRAMES: writes a candump log of this many frames: the trace repeated, each time later."""

import itertools
import sys

records = []
for line in open(sys.argv[1]):
    stamp, rest = line.split(" ", 1)
    seconds, microseconds = stamp.strip("()").split(".")
    records.append((int(seconds) * 1_000_000 + int(microseconds), rest))
span = records[-1][0] - records[0][0] + 1000

repeated = ((time + turn * span, rest) for turn in itertools.count() for time, rest in records)
for time, rest in itertools.islice(repeated, int(sys.argv[2])):
    sys.stdout.write(f"({time // 1_000_000:010}.{time % 1_000_000:06}) {rest}")
