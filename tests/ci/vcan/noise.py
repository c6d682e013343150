"""noise.py BUS [COUNT]: sends bad frames and prints how many, by the cause for which the controller drops and counts them.

BUS is a CAN interface, or HOST:PORT of a serial-line server, which then gets lines that are no frames as well. With COUNT,
so many frames are sent at once, with the identifiers of a controller among them. Otherwise, until SIGTERM, some follow every
feedback on the bus: more than a bus of 1 and 5 Mbit/s could carry in a sample of 1 ms.

At most one of them is a feedback, and the next follows only on a good one that came after it: so never three in a row are bad,
which rightly would stop the arm.
"""

import random
import select
import signal
import socket
import struct
import sys
import time

# In the order and the words of the controller's report.
CAUSES = [
    "with an unknown identifier", "of the wrong format", "of the wrong length", "with a wrong CRC", "malformed", "not canonical",
    "not finite", "out of range",
]
CLASSICAL = {0x000: 2, 0x001: 2, 0x0C0: 8, 0x0C1: 8, 0x0C2: 8, 0x740: 5, 0x741: 5, 0x742: 5}
FD = {0x1C0: 48, 0x240: 24, 0x2C0: 48, 0x300: 48, 0x340: 16, 0x5C0: 20, 0x5C1: 20, 0x640: 16, 0x641: 16}
OF_CONTROLLER = {0x0C1, 0x240, 0x300, 0x340, 0x5C1, 0x640, 0x741}
UNPROTECTED = {0x000, 0x001, 0x0C0, 0x0C1, 0x0C2}
FD_LENGTHS = [*range(9), 12, 16, 20, 24, 32, 48, 64]
FEEDBACK, MOTION = 0x1C0, 0x2C0
# After each feedback, and at most at once: that many find room in a socket.
LOAD, MOST = 12, 160


def crc(width, polynomial, initial, data):
    top, value = 1 << (width - 1), initial
    for byte in data:
        value ^= byte << (width - 8)
        for _ in range(8):
            value = (value << 1) ^ (polynomial if value & top else 0)
        value &= 2 * top - 1
    return value


def protected(identifier, body, counter):
    head = struct.pack(">H", identifier) + body + bytes([counter])
    if identifier in FD:
        return head[2:] + struct.pack(">H", crc(16, 0x1021, 0xFFFF, head))
    return head[2:] + bytes([crc(8, 0x2F, 0xFF, head) ^ 0xFF])


class Frame:
    def __init__(self, cause, identifier, data, kind, extended=False):
        self.cause, self.identifier, self.data, self.kind, self.extended = cause, identifier, data, kind, extended

    def can(self):
        """struct can_frame and struct canfd_frame of linux/can.h."""
        word = self.identifier | (0x80000000 if self.extended else 0) | (0x40000000 if self.kind == "remote" else 0)
        if self.kind == "fd":
            return struct.pack("=IBBBB64s", word, len(self.data), 1, 0, 0, self.data)
        return struct.pack("=IBBBB8s", word, len(self.data), 0, 0, 0, self.data)

    def line(self):
        letter = {"remote": "r", "classical": "t", "fd": "b"}[self.kind]
        letter, width = (letter.upper(), 8) if self.extended else (letter, 3)
        data = "" if self.kind == "remote" else self.data.hex().upper()
        return f"{letter}{self.identifier:0{width}X}{FD_LENGTHS.index(len(self.data)):X}{data}\r".encode()


def unknown(rng, _):
    if rng.random() < 0.5:
        identifier = rng.choice([*CLASSICAL, *FD])
        identifier = rng.choice([identifier, identifier << 18])
        extended = True
    else:
        identifier = next(i for i in iter(lambda: rng.randrange(0x800), None) if i not in CLASSICAL and i not in FD)
        extended = False
    kind = rng.choice(["remote", "classical", "fd"])
    lengths = FD_LENGTHS if kind == "fd" else range(9)
    return Frame(0, identifier, rng.randbytes(rng.choice(lengths)), kind, extended)


def format_of(rng, identifier):
    kind = rng.choice(["remote", "classical" if identifier in FD else "fd"])
    lengths = FD_LENGTHS if kind == "fd" else range(9)
    return Frame(1, identifier, rng.randbytes(rng.choice(lengths)), kind)


def length_of(rng, identifier):
    kind, right = ("fd", FD[identifier]) if identifier in FD else ("classical", CLASSICAL[identifier])
    lengths = [n for n in (FD_LENGTHS if kind == "fd" else range(9)) if n != right and (n or identifier != 0x001)]
    return Frame(2, identifier, rng.randbytes(rng.choice(lengths)), kind)


def crc_of(rng, identifier):
    """One to three wrong bits, which both CRCs always find."""
    kind, length = ("fd", FD[identifier]) if identifier in FD else ("classical", CLASSICAL[identifier])
    overhead = 3 if kind == "fd" else 2
    counter = rng.randrange(256 if kind == "fd" else 16)
    data = bytearray(protected(identifier, rng.randbytes(length - overhead), counter))
    for bit in rng.sample(range(8 * length), rng.randint(1, 3)):
        data[bit // 8] ^= 1 << bit % 8
    return Frame(3, identifier, bytes(data), kind)


def motion(cause, *parts):
    return lambda rng, _: Frame(cause, MOTION, protected(MOTION, b"".join(parts).ljust(45, b"\0"), rng.randrange(256)), "fd")


def number(rng):
    return struct.pack("<I", rng.choice([0x7F800000, 0xFF800000]) | rng.randrange(1 << 23))


# A tag that no request has; padding that is not zero; a line and a payload that cannot be.
malformed = motion(4, b"\0\x7f")
not_canonical = motion(5, b"\0\x01\0\0\x01")
out_of_range = motion(7, b"\0\x07", struct.pack("<f", -1.0))


def not_finite(rng, identifier):
    return motion(6, b"\0\x05\0\0\0\0", number(rng))(rng, identifier)


def feedback_not_finite(rng, _):
    """The speed of the shoulder."""
    return Frame(6, FEEDBACK, protected(FEEDBACK, bytes(21) + number(rng) + bytes(20), rng.randrange(256)), "fd")


def pool(rng, count, identifiers):
    """Bad frames, none of them a feedback."""
    makers = [unknown, format_of, length_of, crc_of, malformed, not_canonical, not_finite, out_of_range]
    for _ in range(count):
        maker = rng.choice(makers)
        allowed = [i for i in identifiers if maker is not crc_of or i not in UNPROTECTED]
        yield maker(rng, rng.choice(allowed))


class SocketCan:
    def __init__(self, interface):
        self.socket = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        # Nothing but feedback.
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", FEEDBACK, 0xC00007FF))
        self.socket.bind((interface,))

    def feedbacks(self, _):
        """Those in what was received, and those since the last burst has arrived."""
        return 1, 1

    def send(self, frames):
        for frame in frames:
            self.socket.send(frame.can())


class Slcan:
    def __init__(self, host, port):
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.sendall(b"O\r")
        # Every line is answered, by a carriage return or a BEL.
        self.unanswered, self.rest, self.turn = 1, b"", 0

    def feedbacks(self, text):
        *lines, self.rest = (self.rest + text.replace(b"\a", b"\r")).split(b"\r")
        count = fresh = 0
        for line in lines:
            self.unanswered -= not line
            count += line.startswith(b"b1C0")
            fresh += line.startswith(b"b1C0") and not self.unanswered
        return count, fresh

    def send(self, frames):
        """With a line that is no frame: no letter, no digit, one digit short, an identifier too great, no end for 10 KiB."""
        garbage = [b"?\r", b"t1C0\xff\r", b"t1C011\r", b"T200000000\r", b"b" * 10240 + b"\r"][self.turn % 5]
        self.turn += 1
        self.unanswered += 1 + len(frames)
        text = garbage + b"".join(frame.line() for frame in frames)
        # In two pieces, cut anywhere; digits may be small.
        cut = self.turn * 7 % len(text)
        self.socket.sendall(text[:cut])
        self.socket.sendall(text[cut:])


def heard(port, seconds):
    """Waits for feedback; the number of those that came, and of those after the last burst."""
    count = fresh = 0
    select.select([port.socket], [], [], seconds)
    try:
        while True:
            more = port.feedbacks(port.socket.recv(4096, socket.MSG_DONTWAIT))
            count, fresh = count + more[0], fresh + more[1]
    except BlockingIOError:
        return count, fresh


def main():
    bus, *count = sys.argv[1:]
    port = Slcan(*bus.split(":")) if ":" in bus else SocketCan(bus)
    rng = random.Random(1)
    sent = [0] * len(CAUSES)

    def send(frames):
        port.send(frames)
        for frame in frames:
            sent[frame.cause] += 1

    others = [i for i in [*CLASSICAL, *FD] if i != FEEDBACK]
    if count:
        frames = list(pool(rng, int(count[0]), others))
        for start in range(0, len(frames), 50):
            send(frames[start:start + 50])
            time.sleep(0.01)
    else:
        ended = []
        signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
        frames = list(pool(rng, 2048, [i for i in others if i not in OF_CONTROLLER]))
        bad = [maker(rng, FEEDBACK) for maker in [format_of, length_of, crc_of, feedback_not_finite] * 64]
        place = waiting = since = 0
        print("listening", flush=True)
        while not ended:
            count, fresh = heard(port, 0.1)
            waiting, since = waiting + count, since + fresh
            # The second comes after the answer to the first, and so after the controller has read the last burst.
            if since >= 2:
                burst = [frames[(place + k) % len(frames)] for k in range(min(LOAD * waiting, MOST))]
                burst[0] = bad[place % len(bad)]
                place += len(burst)
                send(burst)
                waiting, since = heard(port, 0)[0], 0
    print(", ".join(f"{count} {cause}" for count, cause in zip(sent, CAUSES) if count))
    print(sum(sent))


main()
