"""Reads our traces with other tools, and theirs with ours: 21-interop.py PLANT_SIM TRACE WORK.

Frames are compared completely: time, interface, identifier, format, flags and data.
"""

import random
import subprocess
import sys
import xml.etree.ElementTree

import can

SEED = 1
FD_LENGTHS = [*range(9), 12, 16, 20, 24, 32, 48, 64]


def main(plant_sim, trace, work):
    def convert(source, target, name):
        out = f"{work}/{name}"
        subprocess.run([plant_sim, "trace", "convert", source, "--to", target, "--out", out], check=True)
        return out

    assert len(read_log(trace)) > 1000
    mixed = f"{work}/mixed.log"
    write_log(mixed, random_frames(random.Random(SEED), 2000))
    for name, log in (("run", trace), ("mixed", mixed)):
        frames = read_log(log)
        assert open(convert(log, "candump", f"{name}.same.log"), "rb").read() == open(log, "rb").read()
        python_can_log(convert, name, log, frames)
        python_can_asc(convert, name, log, frames)
        can_utils(convert, work, name, log, frames)
        tshark(convert, name, log, frames)
    svg = subprocess.run([plant_sim, "trace", "plot", trace], stdout=subprocess.PIPE, check=True).stdout
    curves = xml.etree.ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}polyline")
    assert sum(1 for _ in curves) >= 12
    print("ok: the plot is well-formed")


def random_frames(rng, count):
    """Frames of every kind on two interfaces: (time in us, interface, identifier, extended, kind, flags, data)."""
    time_us, frames = 1_436_509_052_249_713, []
    for _ in range(count):
        time_us += rng.choice([0, 1, 117, 1_000_000])
        extended = rng.random() < 0.4
        identifier = rng.randrange(1 << 29 if extended else 1 << 11)
        kind = rng.choice(["data", "data", "remote", "fd", "fd"])
        flags = rng.randrange(4) if kind == "fd" else 0
        data = b"" if kind == "remote" else rng.randbytes(rng.choice(FD_LENGTHS if kind == "fd" else FD_LENGTHS[:9]))
        frames.append((time_us, rng.choice(["can0", "vcan1"]), identifier, extended, kind, flags, data))
    return frames


def write_log(path, frames):
    """In the format of `candump -l`."""
    with open(path, "w", newline="\n") as file:
        for time_us, interface, identifier, extended, kind, flags, data in frames:
            name = f"{identifier:08X}" if extended else f"{identifier:03X}"
            content = {"data": "#", "remote": "#R", "fd": f"##{flags:X}"}[kind] + data.hex().upper()
            file.write(f"({time_us // 1_000_000:010}.{time_us % 1_000_000:06}) {interface} {name}{content}\n")


def read_log(path):
    """A few lines of our own, so that a peer's reader is not compared with itself."""
    frames = []
    for line in open(path):
        stamp, interface, text = line.split()[:3]
        seconds, microseconds = stamp.strip("()").split(".")
        identifier, content = text.split("#", 1)
        kind, flags = "data", 0
        if content.startswith("#"):
            kind, flags, content = "fd", int(content[1], 16) & 3, content[2:]
        elif content.startswith("R"):
            kind, content = "remote", ""
        data = bytes.fromhex(content)
        extended = len(identifier) == 8
        frames.append((int(seconds) * 1_000_000 + int(microseconds), interface, int(identifier, 16), extended, kind, flags, data))
    return frames


def of_message(message, channels=None):
    kind = "fd" if message.is_fd else "remote" if message.is_remote_frame else "data"
    flags = message.bitrate_switch | message.error_state_indicator << 1 if message.is_fd else 0
    channel = channels[message.channel] if channels else message.channel
    return (round(message.timestamp * 1e6), channel, message.arbitration_id, message.is_extended_id, kind, flags, bytes(message.data))


def python_can_log(convert, name, log, frames):
    """CanutilsLogReader reads our log, and we read the output of CanutilsLogWriter."""
    messages = list(can.CanutilsLogReader(log))
    compare(f"{name}: python-can reads our log", [of_message(message) for message in messages], frames)
    theirs = log + ".theirs"
    with can.CanutilsLogWriter(theirs) as writer:
        for message in messages:
            writer.on_message_received(message)
    compare(f"{name}: we read the log of python-can", read_log(convert(theirs, "candump", f"{name}.back.log")), frames)


def python_can_asc(convert, name, log, frames):
    channels = channels_of(frames)
    # The date in the header has milliseconds; the rest is the offset of the first frame.
    start = frames[0][0] // 1000 * 1000
    messages = can.ASCReader(convert(log, "asc", f"{name}.asc"), relative_timestamp=True)
    compare(
        f"{name}: python-can reads our ASC",
        [of_message(message, channels) for message in messages],
        [(frame[0] - start, *frame[1:]) for frame in frames],
    )


def can_utils(convert, work, name, log, frames):
    """log2asc reads our log, asc2log our ASC; we read what asc2log makes of the output of log2asc."""
    channels = channels_of(frames)
    theirs = f"{work}/{name}.log2asc"
    with open(log) as source, open(theirs, "w") as sink:
        subprocess.run(["log2asc", *channels], stdin=source, stdout=sink, check=True)
    # asc2log names interfaces by channel and dates files by its own clock: everything except the time is compared.
    expected = [(channels.index(frame[1]), *frame[2:]) for frame in frames]
    for title, asc in (("our ASC", convert(log, "asc", f"{name}.asc")), ("its own ASC", theirs)):
        back = f"{work}/{name}.asc2log"
        with open(asc) as source, open(back, "w") as sink:
            subprocess.run(["asc2log"], stdin=source, stdout=sink, stderr=subprocess.DEVNULL, check=True)
        read = read_log(convert(back, "candump", f"{name}.asc2log.log"))
        found = [(int(frame[1].removeprefix("can")), *frame[2:]) for frame in read]
        compare(f"{name}: can-utils reads {title}, we read its log", found, expected)


def tshark(convert, name, log, frames):
    fields = ["frame.time_epoch", "frame.interface_name", "can.id", "can.flags.xtd", "can.flags.rtr", "canfd.flags.brs",
              "canfd.flags.esi", "data.data"]
    command = ["tshark", "-r", convert(log, "pcapng", f"{name}.pcapng"), "-T", "fields"]
    for field in fields:
        command += ["-e", field]
    output = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True).stdout.decode()
    found = []
    for line in output.splitlines():
        time, interface, identifier, extended, remote, brs, esi, data = line.split("\t")
        # The field exists in FD frames only.
        fd = brs != ""
        kind = "fd" if fd else "remote" if remote in ("1", "True") else "data"
        flags = (brs in ("1", "True")) | (esi in ("1", "True")) << 1
        seconds, nanoseconds = time.split(".")
        found.append((int(seconds) * 1_000_000 + int(nanoseconds) // 1000, interface, int(identifier, 0),
                      extended in ("1", "True"), kind, flags, bytes.fromhex(data)))
    compare(f"{name}: tshark reads our pcapng", found, frames)


def channels_of(frames):
    """Interfaces in order of appearance: channel numbers of an ASC file."""
    return list(dict.fromkeys(frame[1] for frame in frames))


def compare(title, found, expected):
    for index, (one, other) in enumerate(zip(found, expected)):
        assert one == other, f"{title}: frame {index} is {one}, not {other}"
    assert len(found) == len(expected), f"{title}: {len(found)} frames, not {len(expected)}"
    print(f"ok: {title}: {len(found)} frames")


main(*sys.argv[1:])
