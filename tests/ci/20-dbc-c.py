"""Decodes candump logs with the C that cantools generates from our DBC: 20-dbc-c.py DBC PLANT_SIM WORK LOG...

The C is compiled with the warnings of a careful firmware project. Of every frame it must give the fields that
`plant-sim trace decode` gives, numbers to the last bit.
"""

import json
import struct
import subprocess
import sys

import cantools
from cantools.database.can.c_source import camel_to_snake_case as snake

WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Werror"]


def main(dbc, plant_sim, work, *logs):
    database = cantools.database.load_file(dbc, strict=True)
    subprocess.run(
        [sys.executable, "-m", "cantools", "generate_c_source", "--database-name", "scara", "--output-directory", work, dbc],
        stdout=subprocess.DEVNULL, check=True)
    with open(f"{work}/main.c", "w") as file:
        file.write(program(database))
    subprocess.run(["gcc", *WARNINGS, "-O1", f"-I{work}", "-o", f"{work}/decode", f"{work}/main.c", f"{work}/scara.c"], check=True)
    for log in logs:
        frames, fields, messages = compare(database, plant_sim, f"{work}/decode", log)
        print(f"ok: {frames} frames of {len(messages)} messages, {fields} fields: the same by generated C and by plant-sim")


def program(database):
    """Reads "IDENTIFIER HEX" lines; prints each signal as "NAME=NUMBER", a float by its bits, and an empty line."""
    cases = []
    for message in database.messages:
        kind = f"scara_{snake(message.name)}"
        prints = []
        for signal in message.signals:
            name = snake(signal.name)
            if signal.is_float:
                show = f'memcpy(&bits, &m.{name}, sizeof bits); printf("{signal.name}=%lu\\n", (unsigned long)bits);'
            else:
                show = f'printf("{signal.name}=%ld\\n", (long)m.{name});'
            if signal.multiplexer_ids:
                [tag] = signal.multiplexer_ids
                show = f"if (m.{snake(signal.multiplexer_signal)} == {tag}) {{ {show} }}"
            prints.append(f"            {show}")
        cases.append("\n".join([
            f"        case {message.frame_id}: {{",
            f"            struct {kind}_t m;",
            f"            if ({kind}_unpack(&m, data, size) != 0) return 1;",
            *prints,
            "            break;",
            "        }",
        ]))
    return "\n".join([
        "#include <stdio.h>", "#include <string.h>", '#include "scara.h"', "",
        "int main(void) {",
        "    unsigned int id, byte;",
        "    char hex[129];",
        '    while (scanf("%x %128s", &id, hex) == 2) {',
        "        uint8_t data[64];",
        "        uint32_t bits;",
        "        size_t size = 0;",
        '        while (size < strlen(hex) / 2 && sscanf(hex + 2 * size, "%2x", &byte) == 1) data[size++] = (uint8_t)byte;',
        "        (void)bits;",
        "        switch (id) {", *cases, "        default: return 1;", "        }",
        '        printf("\\n");',
        "    }",
        "    return 0;",
        "}", ""])


def compare(database, plant_sim, decoder, log):
    """Numbers of frames and fields compared, and the messages among them."""
    decoded = subprocess.run([plant_sim, "trace", "decode", "--format", "jsonl", log], stdout=subprocess.PIPE, check=True)
    ours = [json.loads(line) for line in decoded.stdout.splitlines()]
    with open(log) as file:
        frames = [line.split()[2] for line in file]
    assert len(ours) == len(frames) > 0, (len(ours), len(frames))
    text = "".join(f"{frame.split('#')[0]} {frame.split('##')[1][1:] if '##' in frame else frame.split('#')[1]}\n" for frame in frames)
    run = subprocess.run([decoder], input=text.encode(), stdout=subprocess.PIPE, check=True)
    theirs = [dict(line.split("=") for line in block.split()) for block in run.stdout.decode().split("\n\n")[:-1]]
    assert len(theirs) == len(frames), (len(theirs), len(frames))
    fields = 0
    for our, their in zip(ours, theirs):
        message = database.get_message_by_name(our["message"])
        fields += equal(message, our, {name: int(value) for name, value in their.items()})
    return len(frames), fields, {our["message"] for our in ours}


def equal(message, ours, theirs):
    """The number of fields, which are the same on both sides."""
    assert "error" not in ours, ours
    # We check the CRC and do not print it.
    left = {name: value for name, value in theirs.items() if name != "crc"}
    expected = {}
    if "counter" in ours:
        expected["counter"] = ours["counter"]
    for name, field in ours["fields"].items():
        value = field["value"]
        if isinstance(value, list):
            # A set of flags: one signal for each.
            flags = [flag for flag in left if flag.startswith(name + "_") and flag not in ours["fields"]]
            expected.update({flag: int(flag[len(name) + 1 :].replace("_", "-") in value) for flag in flags})
            assert sum(expected[flag] for flag in flags) == len(value), (ours, flags)
            continue
        signal = message.get_signal_by_name(name)
        if signal.choices:
            value = next(code for code, text in signal.choices.items() if str(text) == value)
        elif signal.is_float:
            [value] = struct.unpack("<I", struct.pack("<f", value))
        expected[name] = value
    assert expected == left, f"{message.name}: ours {expected}, C {left}"
    return len(left)


main(*sys.argv[1:])
