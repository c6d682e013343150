"""Holds what tshark says of error frames against our decoder: 21-errors.py PLANT_SIM WORK LOG.

Classes, kinds of a protocol violation, and the state of the controller, of each error frame of the log; every class and kind that the
simulated bus has must be among them.
"""

import json
import subprocess
import sys

# Our word, and the field of tshark.
WORDS = {
    "controller-problem": "can.err.ctrl",
    "protocol-violation": "can.err.prot",
    "no-acknowledgement-on-tx": "can.err.ack",
    "bus-off": "can.err.busoff",
    "bus-error": "can.err.buserror",
    "restarted-after-bus-off": "can.err.restarted",
    "lost-arbitration": "can.err.lostarb",
    "tx-timeout": "can.err.tx_timeout",
    "single-bit-error": "can.err.prot.type.bit",
    "frame-format-error": "can.err.prot.type.form",
    "bit-stuffing-error": "can.err.prot.type.stuff",
    "tx-dominant-bit-error": "can.err.prot.type.bit0",
    "tx-recessive-bit-error": "can.err.prot.type.bit1",
    "error-on-tx": "can.err.prot.type.tx",
    "tx-error-passive": "can.err.ctrl.tx_passive",
    "rx-error-passive": "can.err.ctrl.rx_passive",
    "tx-error-warning": "can.err.ctrl.tx_warning",
    "back-to-error-active": "can.err.ctrl.active",
}
# What the receivers alone come to, and what the simulated bus has none of, are not in every run.
RARE = {"lost-arbitration", "tx-timeout", "rx-error-passive"}
EXPECTED = WORDS.keys() - RARE


def main(plant_sim, work, log):
    errors = f"{work}/errors.log"
    with open(log) as source, open(errors, "w") as sink:
        sink.writelines(line for line in source if line.split()[2][0] == "2" and line.split()[2][8:9] == "#")
    decoded = subprocess.run([plant_sim, "trace", "decode", "--format", "jsonl", errors], stdout=subprocess.PIPE, check=True)
    ours = [json.loads(line)["error"] for line in decoded.stdout.splitlines()]
    pcapng = f"{work}/errors.pcapng"
    subprocess.run([plant_sim, "trace", "convert", errors, "--to", "pcapng", "--out", pcapng], check=True)
    command = ["tshark", "-r", pcapng, "-T", "fields"]
    for field in WORDS.values():
        command += ["-e", field]
    shown = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True).stdout.decode().splitlines()
    assert len(ours) == len(shown) > 0, (len(ours), len(shown))
    seen = set()
    for text, line in zip(ours, shown):
        theirs = {word for word, value in zip(WORDS, line.split("\t")) if value in ("1", "True")}
        said = {word.strip(" ()") for part in text.split("(") for word in part.split(",")}
        assert theirs == said & WORDS.keys(), (text, theirs)
        seen |= theirs
    assert EXPECTED <= seen, EXPECTED - seen
    print(f"ok: {len(ours)} error frames with {len(seen)} classes and kinds: the same by tshark and by plant-sim")


main(*sys.argv[1:])
