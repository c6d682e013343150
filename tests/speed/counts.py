"""Instructions of the host's programs, counted by valgrind: the short form of tests/bench, which no other load changes.

    tests/speed/counts.py PLANT_SIM WORK            print the table; exit 1 if a count has moved
    tests/speed/counts.py PLANT_SIM WORK --update   print it and record the counts

The counts are in counts.csv next to this file. One may move by TOLERANCE either way, since other compilers generate other code; a
change of the sources that moves it further must update it in its commit. Each is that of a longer call without that of a
shorter one, so that what a start takes is not in it.
"""

import csv
import pathlib
import re
import subprocess
import sys

TOLERANCE = 0.10
# What twice the work may take more than twice, or less.
LINEAR = 0.02
COUNTS = pathlib.Path(__file__).parent / "counts.csv"
PROGRAM, WORK = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
NOTHING = ["--no-trace"]


def count(*arguments, allowed=(0,)):
    """Instructions of `plant-sim` with these arguments."""
    command = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=" + str(WORK / "cachegrind"), PROGRAM]
    done = subprocess.run([*map(str, command + list(arguments))], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode not in allowed:
        sys.exit(f"counts.py: status {done.returncode}: {' '.join(map(str, arguments))}\n{done.stderr}")
    return int(re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)[1].replace(",", ""))


def gate(cycles, *options):
    return count("run", "gate", "--cycles", cycles, "--set", "requirements=[]", "--no-report", "--out", WORK / "run", *options)


def cases(number):
    plan = WORK / "plan.jsonl"
    with plan.open("wb") as file:
        subprocess.run([PROGRAM, "campaign", "plan", "--count", str(number)], stdout=file, check=True)
    # 1: a case misses what is promised, as docs/campaign.md says.
    return count("campaign", "run", plan, "--jobs", 1, "--out", WORK / f"cases-{number}", allowed=(0, 1))


def trace(cycles):
    """A trace of so many cycles of the gate, and the number of its frames."""
    subprocess.run([PROGRAM, "run", "gate", "--cycles", str(cycles), "--no-report", "--out", WORK / f"trace-{cycles}"],
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    file = WORK / f"trace-{cycles}/trace.log"
    return file, file.read_bytes().count(b"\n")


def measure():
    """Name and count of every row; and how much more than twice the work twice the cycles are."""
    written = {cycles: gate(cycles) for cycles in (1, 3)}
    quiet = {cycles: gate(cycles, *NOTHING) for cycles in (4, 8, 16)}
    counts = {
        "gate, a cycle": (quiet[16] - quiet[8]) / 8,
        "gate, a cycle with trace, truth and hash": (written[3] - written[1]) / 2,
        "campaign, a case": (cases(40) - cases(8)) / 32,
    }
    (short, few), (long, many) = trace(1), trace(4)
    for arguments in (["decode"], ["decode", "--format", "csv"], ["decode", "--format", "jsonl"], ["stats"], ["convert", "--to", "asc"]):
        took = count("trace", *arguments, long) - count("trace", *arguments, short)
        counts[f"trace {' '.join(arguments)}, a frame"] = took / (many - few)
    counts["plant-sim --help"] = count("--help")
    growth = (quiet[16] - quiet[8]) / (2 * (quiet[8] - quiet[4])) - 1
    return {name: round(value) for name, value in counts.items()}, growth


def main():
    counts, growth = measure()
    if "--update" in sys.argv:
        with COUNTS.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([("what", "instructions"), *counts.items()])
    with COUNTS.open() as file:
        kept = {row["what"]: int(row["instructions"]) for row in csv.DictReader(file)}
    moved = sorted(kept.keys() ^ counts.keys())
    print(f"{'what':<42}{'instructions':>14}{'kept':>14}")
    for name, value in counts.items():
        before = kept.get(name, value)
        print(f"{name:<42}{value:>14,}{before:>14,}")
        if abs(value - before) > TOLERANCE * before:
            moved.append(name)
    print(f"twice the cycles take {growth:+.2%} more than twice")
    if abs(growth) > LINEAR:
        moved.append("cost against cycles is not linear")
    if moved:
        sys.exit(f"counts.py: further from what is kept than {TOLERANCE:.0%}: {', '.join(moved)}. If the change is intended: "
                 "bash tests/ci/39-speed.sh update")


main()
