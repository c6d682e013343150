"""peers.py BIN WORK: the checks of 12-peers.sh, on a machine with vcan0.

Frames are compared completely, except for their time: nothing depends on the speed of the machine. A virtual bus takes
frames faster than programs read them, so each receiver gets room for all of them.
"""

import fcntl
import glob
import json
import os
import pty
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import termios
import threading
import time

import can
import pyte

BIN, WORK = sys.argv[1:]
PLANT_SIM, CONTROLLER, TRACE = f"{BIN}/plant-sim", f"{BIN}/controller", f"{WORK}/run/trace.log"
LIMIT = 60  # seconds; reached only when something fails
ROOM = 64 << 20  # bytes
SO_RCVBUFFORCE = 33
SEED = 1
FD_LENGTHS = [*range(9), 12, 16, 20, 24, 32, 48, 64]


def main():
    trace = read_log(TRACE)
    assert len(trace) > 1000
    mixed = f"{WORK}/mixed.log"
    with can.CanutilsLogWriter(mixed) as log:
        for message in random_messages(random.Random(SEED), 500):
            log.on_message_received(message)
    canplayer_to_ours(trace)
    for log in (TRACE, mixed):
        ours_to_candump_and_python_can(log)
    python_can_to_ours(trace)
    signals_to_monitor()
    cansend_to_ours()
    canplayer_to_record(mixed)
    losses_of_record()
    errors_to_candump()
    slcand_to_ours_and_back()


def canplayer_to_ours(trace):
    with Monitor() as monitor, Candump("vcan0", "canplayer.log", len(trace)) as candump:
        subprocess.run(["canplayer", "-I", TRACE, "vcan0=can0"], check=True)
        assert candump.frames() == trace, "candump's frames of canplayer differ from the trace"
        monitor.expect(trace)
    print(f"ok: canplayer plays our trace, monitor and candump receive its {len(trace)} frames")


def ours_to_candump_and_python_can(log):
    frames = read_log(log)
    with python_can() as bus, Candump("vcan0", "replay.log", len(frames)) as candump:
        subprocess.run(
            [PLANT_SIM, "trace", "replay", log, "--bus", "socketcan:vcan0", "--speed", "0"], check=True, stdout=subprocess.DEVNULL
        )
        assert candump.frames() == frames, f"candump's frames differ from {log}"
        heard = [frame_of(bus.recv(LIMIT)) for _ in frames]
        assert heard == frames, f"python-can's frames differ from {log}"
    print(f"ok: trace replay plays {len(frames)} frames, candump and python-can receive the same")


def python_can_to_ours(trace):
    with Monitor() as monitor, python_can() as bus, Candump("vcan0", "python.log", len(trace)) as candump:
        for index, message in enumerate(can.CanutilsLogReader(TRACE)):
            bus.send(message)
            if index % 50 == 49:
                time.sleep(0.01)  # the monitor's socket has room for some 200 frames
        assert candump.frames() == trace, "candump's frames of python-can differ from the trace"
        monitor.expect(trace)
    print(f"ok: python-can sends {len(trace)} frames, the monitor counts them, none bad, none lost")


def signals_to_monitor():
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        with Monitor() as monitor:
            monitor.end = lambda: os.kill(monitor.pid, number)
    print("ok: Ctrl-C, SIGTERM and SIGHUP leave the terminal as it was")


def cansend_to_ours():
    with Controller("socketcan:vcan0") as controller, Candump("vcan0", "controller.log") as candump:
        controller.await_line("waiting for the drives")
        cansend("vcan0", "000#8141")  # network management: reset node 0x41
        controller.await_line("reset by network management")
        cansend("vcan0", "001#")  # emergency stop, empty
        controller.await_line("controller: estop")
        # CiA 301 puts the emergency error code first, low byte first; 9000h is an external error.
        candump.await_frame(lambda frame: frame[0] == 0x0C1 and frame[-1][:2] == b"\x00\x90")
    print("ok: cansend resets and stops the controller, candump sees its emergency")


def canplayer_to_record(log):
    """Every kind of frame, played by canplayer, recorded into files by size; SIGTERM ends the last."""
    frames = read_log(log)
    with Recorder("played.log", "--rotate", "10k") as recorder:
        subprocess.run(["canplayer", "-g", "0", "-I", log, "vcan0=can0"], check=True)
        await_true("the recording", lambda: sum(lines(path) for path in recorder.files()) == len(frames))
        recorder.end(signal.SIGTERM)
    assert recorder.status == 0, recorder.status
    assert recorder.said.startswith(f"{len(frames)} frames and 0 error frames"), recorder.said
    files = recorder.files()
    assert len(files) > 2 and not any(path.endswith(".part") for path in files), files
    recorded = [frame for path in files for frame in read_log(path)]
    assert recorded == frames, "the recording holds other frames than canplayer sent"
    print(f"ok: record has the {len(frames)} frames of canplayer, in {len(files)} files")


def errors_to_candump():
    """candump says what the error frames of a bus-off are, as our own decoder does."""
    errors = f"{WORK}/errors.log"
    with open(f"{WORK}/bus-off/trace.log") as source, open(errors, "w") as sink:
        sink.writelines(line for line in source if line.split()[2].startswith("2000") and line.split()[2][8:9] == "#")
    decoded = subprocess.run([PLANT_SIM, "trace", "decode", "--format", "jsonl", errors], stdout=subprocess.PIPE, check=True)
    ours = [json.loads(line)["error"] for line in decoded.stdout.splitlines()]
    before = sockets("vcan0")
    candump = subprocess.Popen(
        ["candump", "-e", "-n", str(len(ours)), "vcan0,0:0,#FFFFFFFF"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    await_true("candump", lambda: sockets("vcan0") > before)
    subprocess.run(["canplayer", "-I", errors, "vcan0=can0"], check=True)
    said = candump.communicate(timeout=LIMIT)[0]
    assert "invalid" not in said, said
    theirs = [part.replace("\n\t", ",") for part in re.split(r"^.*ERRORFRAME", said, flags=re.M)[1:]]
    words = [set(re.findall(r"[a-z0-9]+(?:-[a-z0-9]+)*", text)) - {"at", "tx", "rx"} for text in theirs]
    for our, their in zip(ours, words, strict=True):
        wanted = set(re.findall(r"[a-z0-9]+(?:-[a-z0-9]+)*", our)) - {"at", "tx", "rx"}
        assert wanted == their, (our, their)
    print(f"ok: candump -e reads {len(ours)} error frames as plant-sim does")


def losses_of_record():
    """More frames than its socket has room for, while it is stopped: what is recorded and what is lost is what was sent."""
    sent = 200_000
    with Recorder("stopped.log") as recorder:
        recorder.process.send_signal(signal.SIGSTOP)
        subprocess.run(["cangen", "vcan0", "-g", "0", "-n", str(sent), "-I", "123", "-L", "8", "-i"], check=True)
        recorder.process.send_signal(signal.SIGCONT)
        # The kernel says with a frame how many were lost before it; this one is lost, too, as long as there is no room.
        [file] = recorder.files()

        def heard():
            cansend("vcan0", "124#")
            return " 124#" in open(file).read()[-10_000:]

        after = 1
        while not heard():
            after += 1
            time.sleep(0.05)
        recorder.end(signal.SIGINT)
    recorded = int(recorder.said.split()[0])
    lost = int(recorder.complaint.split(": ")[-2].split()[0])
    assert recorder.status == 1 and recorded + lost == sent + after and recorded < sent, (recorder.status, recorded, lost)
    print(f"ok: record names the {lost} frames of {sent} for which a stopped program has no room")


def slcand_to_ours_and_back():
    """The kernel's serial-line driver at one end of a pair of terminals, we at the other; classical frames only."""
    pair = subprocess.Popen(["socat", "pty,raw,echo=0,link=/dev/ttyPeer", f"pty,raw,echo=0,link={WORK}/tty"])
    await_true("two terminals", lambda: os.path.exists("/dev/ttyPeer") and os.path.exists(f"{WORK}/tty"))
    slcand = subprocess.Popen(["slcand", "-F", "-o", "-s8", "ttyPeer", "slcan0"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        await_true("slcan0", lambda: os.path.exists("/sys/class/net/slcan0"))
        subprocess.run(["ip", "link", "set", "slcan0", "up"], check=True)
        log = f"{WORK}/classical.log"
        with can.CanutilsLogWriter(log) as writer:
            for message in random_messages(random.Random(SEED), 500):
                if not message.is_fd:
                    writer.on_message_received(message)
        frames = read_log(log)
        with Candump("slcan0", "slcan.log", len(frames)) as candump:
            subprocess.run(
                [PLANT_SIM, "trace", "replay", log, "--bus", f"slcan:{WORK}/tty", "--speed", "0"], check=True, stdout=subprocess.DEVNULL
            )
            assert candump.frames() == frames, "slcan0's frames differ from those played"
        with Controller(f"slcan:{WORK}/tty") as controller:
            controller.await_line("waiting for the drives")
            cansend("slcan0", "000#8141")
            controller.await_line("reset by network management")
    finally:
        slcand.terminate()
        pair.terminate()
    print(f"ok: slcand receives our {len(frames)} classical frames, and we receive its frames")


class Candump:
    """candump -L into a file; with `count`, the test waits for that many frames."""

    def __init__(self, interface, name, count=0):
        self.interface, self.path, self.count = interface, f"{WORK}/{name}", count

    def __enter__(self):
        before = sockets(self.interface)
        self.file = open(self.path, "w")
        self.process = subprocess.Popen(["candump", "-L", "-r", str(ROOM), self.interface], stdout=self.file)
        await_true("candump", lambda: sockets(self.interface) > before)
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.file.close()

    def frames(self):
        await_true(f"{self.count} frames in {self.path}", lambda: lines(self.path) >= self.count)
        return read_log(self.path)

    def await_frame(self, wanted):
        await_true("the frame", lambda: any(map(wanted, read_log(self.path))))


class Controller:
    def __init__(self, bus):
        self.bus, self.path = bus, f"{WORK}/controller.err"

    def __enter__(self):
        self.file = open(self.path, "w")
        self.process = subprocess.Popen([CONTROLLER, "--bus", self.bus], stderr=self.file)
        return self

    def __exit__(self, failed, *_):
        self.process.send_signal(signal.SIGINT)
        status = self.process.wait()
        self.file.close()
        assert failed or status == 0, f"Ctrl-C did not end the controller cleanly: {status}"

    def await_line(self, text):
        await_true(f"controller: {text!r}", lambda: text in open(self.path).read())


class Monitor:
    """plant-sim monitor on a terminal of its own."""

    def __init__(self):
        # The smallest terminal there is.
        self.screen = pyte.Screen(80, 24)
        self.bytes = b""

    def __enter__(self):
        before = sockets("vcan0")
        pid, self.terminal = pty.fork()
        if pid == 0:
            # The size is read once, at the start.
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
            os.environ["TERM"] = "xterm-256color"
            os.execv(PLANT_SIM, [PLANT_SIM, "monitor", "--bus", "socketcan:vcan0"])
        self.pid = pid
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        await_true("monitor", lambda: sockets("vcan0") > before and "socketcan:vcan0" in self.screen.display[0])
        return self

    def read(self):
        stream = pyte.ByteStream(self.screen)
        while True:
            try:
                data = os.read(self.terminal, 65536)
            except OSError:  # the other end of the terminal has closed
                return
            if not data:
                return
            stream.feed(data)
            self.bytes += data

    def end(self):
        os.write(self.terminal, b"q")

    def __exit__(self, *_):
        self.end()
        _, status = os.waitpid(self.pid, 0)
        assert status == 0, f"monitor ended with {status}"
        # Back from the alternate screen, the cursor shown.
        await_true("the terminal as it was", lambda: b"\x1b[?1049l" in self.bytes and b"\x1b[?25h" in self.bytes)

    def expect(self, frames):
        """All frames counted, none lost and none bad on any identifier: the checksums are right."""
        await_true(f"monitor: {len(frames)} frames", lambda: f" {len(frames)} frames" in self.screen.display[0])
        rows = {}
        for line in self.screen.display:
            words = line.strip("│ ").split()
            if len(words) > 6 and words[0] in ("1C0", "240", "300", "641", "5C1", "741"):
                rows[words[0]] = words[5:7]
        assert len(rows) == 6 and all(row == ["0", "0"] for row in rows.values()), rows


class Recorder:
    """plant-sim record of vcan0."""

    def __init__(self, name, *options):
        self.name, self.options = name, options

    def __enter__(self):
        before = sockets("vcan0")
        self.process = subprocess.Popen(
            [PLANT_SIM, "record", "--bus", "socketcan:vcan0", "--out", f"{WORK}/{self.name}", *self.options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        # Its socket comes first; whoever stops it then may look for its file.
        await_true("record", lambda: sockets("vcan0") > before and self.files())
        return self

    def end(self, number):
        self.process.send_signal(number)
        self.said, self.complaint = self.process.communicate(timeout=LIMIT)
        self.status = self.process.returncode

    def __exit__(self, *_):
        self.process.kill()

    def files(self):
        """Complete or growing, in order."""
        return sorted(glob.glob(f"{WORK}/{self.name.removesuffix('.log')}*"))


def python_can():
    bus = can.Bus(interface="socketcan", channel="vcan0", fd=True)
    bus.socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, ROOM)
    return bus


def cansend(interface, frame):
    subprocess.run(["cansend", interface, frame], check=True)


def sockets(interface):
    """Programs that receive from the interface."""
    return sum(line.split()[0] == interface for line in open("/proc/net/can/rcvlist_all") if line.strip())


def lines(path):
    return open(path, "rb").read().count(b"\n")


def await_true(what, condition):
    end = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < end, f"no {what} in time"
        time.sleep(0.05)


def frame_of(message):
    return (
        message.arbitration_id, message.is_extended_id, message.is_remote_frame, message.is_fd, message.bitrate_switch,
        message.error_state_indicator, bytes(message.data),
    )


def read_log(path):
    return [frame_of(message) for message in can.CanutilsLogReader(path)]


def random_messages(rng, count):
    for index in range(count):
        extended, kind = rng.random() < 0.4, rng.choice(["data", "remote", "fd", "fd"])
        identifier = rng.randrange(1 << 29 if extended else 1 << 11)
        data = b"" if kind == "remote" else rng.randbytes(rng.choice(FD_LENGTHS if kind == "fd" else FD_LENGTHS[:9]))
        yield can.Message(
            timestamp=index / 1000, channel="can0", arbitration_id=identifier, is_extended_id=extended,
            is_remote_frame=kind == "remote", is_fd=kind == "fd", bitrate_switch=kind == "fd" and rng.random() < 0.5,
            error_state_indicator=kind == "fd" and rng.random() < 0.5, data=data,
        )


try:
    main()
except AssertionError as failure:
    print(f"FAIL: {failure}")
    sys.exit(1)
