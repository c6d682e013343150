"""Compares our DBC and our decoder with cantools and canmatrix: 20-dbc.py DBC PLANT_SIM WORK.

Random messages are encoded by cantools from the DBC alone, protected by checksums implemented again here, and put into
a candump log. `plant-sim trace decode` must give the original values, and so must cantools.
"""

import contextlib
import io
import json
import logging
import random
import struct
import subprocess
import sys
import warnings

warnings.simplefilter("error")

FRAMES = 10_000
SEED = 1


def main(dbc, plant_sim, work):
    database = load_with_cantools(dbc)
    load_with_canmatrix(dbc, database)
    rng = random.Random(SEED)
    sent = [random_frame(rng, rng.choice(database.messages)) for _ in range(FRAMES)]
    log = f"{work}/random.log"
    with open(log, "w", newline="\n") as file:
        for index, (message, data, _, _) in enumerate(sent):
            kind = "##1" if message.is_fd else "#"
            file.write(f"({index // 1000:010}.{index % 1000:03}000) can0 {message.frame_id:03X}{kind}{data.hex().upper()}\n")
    run = subprocess.run([plant_sim, "trace", "decode", "--format", "jsonl", log], stdout=subprocess.PIPE, check=True)
    lines = run.stdout.decode().splitlines()
    assert len(lines) == FRAMES, f"{len(lines)} lines for {FRAMES} frames"
    fields = sum(compare(json.loads(line), *frame) for line, frame in zip(lines, sent))
    print(f"ok: {FRAMES} random frames of {len(database.messages)} messages, {fields} fields: "
          "encoded by cantools, decoded alike by cantools and plant-sim")


def load_with_cantools(dbc):
    import cantools

    database = cantools.database.load_file(dbc, strict=True)
    formats = {message.name: message.is_fd for message in database.messages}
    assert formats["Feedback"] and formats["Command"] and not formats["Nmt"], formats
    assert database.get_message_by_name("Feedback").cycle_time == 1
    assert database.get_message_by_name("State").cycle_time == 20
    return database


def load_with_canmatrix(dbc, database):
    """canmatrix reports what it does not understand in its log."""
    report = io.StringIO()
    handler = logging.StreamHandler(report)
    handler.setLevel(logging.WARNING)
    logging.getLogger().addHandler(handler)
    with contextlib.redirect_stdout(report), contextlib.redirect_stderr(report):
        import canmatrix.formats

        [matrix] = canmatrix.formats.loadp(dbc).values()
    logging.getLogger().removeHandler(handler)
    assert report.getvalue() == "", f"canmatrix complains: {report.getvalue()}"
    for message in database.messages:
        frame = matrix.frame_by_name(message.name)
        assert (frame.size, frame.is_fd) == (message.length, message.is_fd), message.name
        ours = {signal.name: (signal.start, signal.length, signal.is_float) for signal in message.signals}
        theirs = {signal.name: (signal.get_startbit(bit_numbering=1), signal.size, signal.is_float) for signal in frame.signals}
        assert ours == theirs, f"{message.name}: {ours} {theirs}"
    print(f"ok: cantools and canmatrix read {len(database.messages)} messages without a warning and see one layout")


def random_frame(rng, message):
    """Message, bytes, counter and raw values by name, each within what the DBC allows."""
    values, counter = {}, None
    selector = next((signal for signal in message.signals if signal.is_multiplexer), None)
    if selector:
        values[selector.name] = rng.choice(list(selector.choices))
    for signal in message.signals:
        if signal.multiplexer_ids and values[selector.name] not in signal.multiplexer_ids:
            continue
        if signal.name not in values:
            values[signal.name] = random_value(rng, signal)
    if "crc" in values:
        values["crc"] = 0
        counter = values["counter"]
    data = message.encode(values, scaling=False, padding=False)
    if "crc" in values:
        # Written in place by hand: the DBC has to find it there.
        covered = struct.pack(">H", message.frame_id)
        if message.is_fd:
            values["crc"] = crc(covered + data[:-2], 16, 0x1021, 0xFFFF, 0x0000)
            data = data[:-2] + struct.pack(">H", values["crc"])
        else:
            values["crc"] = crc(covered + data[:-1], 8, 0x2F, 0xFF, 0xFF)
            data = data[:-1] + struct.pack("B", values["crc"])
    return message, data, counter, values


def random_value(rng, signal):
    if signal.choices:
        return rng.choice(list(signal.choices))
    if signal.is_float:
        # Any bit pattern in the range, so that tiny numbers occur as often as large ones.
        while True:
            value = struct.unpack("<f", rng.randbytes(4))[0]
            if signal.minimum <= value <= signal.maximum:
                return value
    low, high = int(signal.minimum), int(signal.maximum)
    return rng.choice([low, high, rng.randint(low, high), rng.randint(low, high)])


def crc(data, width, polynomial, start, final):
    """Bit by bit, most significant bit first (catalogue of parametrised CRC algorithms)."""
    value, top = start, 1 << (width - 1)
    for byte in data:
        value ^= byte << (width - 8)
        for _ in range(8):
            value = (value << 1 ^ polynomial if value & top else value << 1) & ((1 << width) - 1)
    return value ^ final


def compare(ours, message, data, counter, sent):
    """The number of fields compared."""
    assert "error" not in ours, f"{message.name} {data.hex()}: {ours['error']}"
    assert ours["message"] == message.name and int(ours["id"], 16) == message.frame_id, ours
    protected = counter is not None
    assert ours.get("counter") == counter, ours
    named = message.decode(data, decode_choices=True, scaling=False)
    fields = dict(ours["fields"])
    compared = 0
    for signal in message.signals:
        if signal.name not in sent:
            continue
        compared += 1
        theirs = named[signal.name]
        assert same(theirs, sent[signal.name]) or signal.choices, (signal.name, theirs, sent[signal.name])
        if protected and signal.name in ("counter", "crc"):
            continue
        if signal.name in fields:
            field = fields.pop(signal.name)
            assert same(field["value"], str(theirs) if signal.choices else theirs), (signal.name, field, theirs)
            assert field.get("unit", "") == (signal.unit or ""), (signal.name, field, signal.unit)
        else:
            # A bit of a set of flags, which we list by name.
            flags, bit = next((name, signal.name[len(name) + 1 :]) for name in fields if signal.name.startswith(name + "_"))
            assert (bit.replace("_", "-") in fields[flags]["value"]) == bool(theirs), (signal.name, fields[flags])
    left = {name for name, field in fields.items() if not isinstance(field["value"], list)}
    assert not left, f"{message.name}: not in the DBC: {left}"
    return compared


def same(a, b):
    """Equal, numbers to the last bit of a float."""
    if isinstance(a, float) or isinstance(b, float):
        return struct.pack("<f", a) == struct.pack("<f", b)
    return a == b


main(*sys.argv[1:])
