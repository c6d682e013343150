"""Holds our Wireshark dissector against our decoder: 21-dissector.py PLANT_SIM WORK LOG...

tshark shows every field with its value and its bytes; both must be what `plant-sim trace decode` says. A frame with a wrong
CRC and one with a wrong length must be marked.
"""

import json
import re
import struct
import subprocess
import sys
import xml.etree.ElementTree

# Six digits are what tshark shows of a float.
SHOWN = 1e-5


def main(plant_sim, work, *logs):
    script = f"{work}/scara.lua"
    subprocess.run([plant_sim, "dissector", "--out", script], check=True)
    for log in logs:
        decoded = subprocess.run([plant_sim, "trace", "decode", "--format", "jsonl", log], stdout=subprocess.PIPE, check=True)
        ours = [json.loads(line) for line in decoded.stdout.splitlines()]
        theirs = dissect(plant_sim, work, script, log)
        assert len(ours) == len(theirs) > 0, (len(ours), len(theirs))
        fields = sum(equal(our, their) for our, their in zip(ours, theirs))
        print(f"ok: {len(ours)} frames, {fields} fields: the same by tshark with our dissector and by plant-sim")
    marked(plant_sim, work, script, logs[0])


def dissect(plant_sim, work, script, log):
    """The fields of each packet: name without `scara.` -> shown text and bytes."""
    pcapng = f"{work}/dissected.pcapng"
    subprocess.run([plant_sim, "trace", "convert", log, "--to", "pcapng", "--out", pcapng], check=True)
    run = subprocess.run(
        ["tshark", "-r", pcapng, "-X", f"lua_script:{script}", "-T", "pdml"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=True)
    assert b"Lua" not in run.stderr, run.stderr.decode()
    packets = []
    for packet in xml.etree.ElementTree.fromstring(run.stdout).iter("packet"):
        fields = {}
        for field in packet.iterfind("proto[@name='scara']//field"):
            name = field.get("name")
            if name.startswith("scara."):
                fields[name.removeprefix("scara.")] = (field.get("show"), field.get("value"), field.get("showname"))
        packets.append(fields)
    return packets


def equal(ours, theirs):
    """The number of fields, which are the same on both sides."""
    assert "error" not in ours, ours
    left = dict(theirs)
    assert ("crc" in left) == ("counter" in ours), (ours, left)
    left.pop("crc", None)
    if "counter" in ours:
        assert int(left.pop("counter")[0]) == ours["counter"], (ours, theirs)
    count = 0
    for name, field in ours["fields"].items():
        full, value = f"{ours['message'].lower()}.{name}", field["value"]
        if isinstance(value, list):
            flags = [flag for flag in left if flag.startswith(full + "_")]
            on = {flag for flag in flags if left.pop(flag)[0] in ("1", "True")}
            assert on == {f"{full}_{flag.replace('-', '_')}" for flag in value}, (ours, theirs)
            count += len(flags)
            continue
        shown, raw, text = left.pop(full)
        raw = bytes.fromhex(raw)
        if isinstance(value, str):
            assert re.search(rf": {re.escape(value)} \({raw[0]}\)", text), (value, text)
        elif "." in shown or "e" in shown or isinstance(value, float):
            assert raw == struct.pack("<f", value), (full, value, raw)
            assert abs(float(shown) - value) <= SHOWN * abs(value), (full, value, shown)
        else:
            assert int(shown) == value, (full, value, shown)
        unit = field.get("unit")
        assert not unit or text.endswith(f" {unit}"), (text, unit)
        count += 1
    assert not left, f"{ours['message']}: tshark alone has {left}"
    return count


def marked(plant_sim, work, script, log):
    """What the protocol refuses is seen as such."""
    with open(log) as source:
        feedback = next(line for line in source if " 1C0##1" in line).rstrip("\n")
    wrong = f"{work}/wrong.log"
    with open(wrong, "w") as sink:
        sink.write(f"{feedback[:-1]}{int(feedback[-1], 16) ^ 1:X}\n{feedback.replace('1C0##1', '240##1')}\n{feedback}\n")
    marks = [[name for name in fields if name.startswith("wrong")] for fields in dissect(plant_sim, work, script, wrong)]
    assert marks == [["wrong_crc"], ["wrong_length"], []], marks
    print("ok: wrong CRC and wrong length are marked")


main(*sys.argv[1:])
