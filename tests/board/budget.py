"""Memory and instructions of the image for the emulated Cortex-M4F, held against goals and against the last figures.

    tests/board/budget.py IMAGE PLANT_SIM            print the table; exit 1 if a goal or a figure is missed
    tests/board/budget.py IMAGE PLANT_SIM --update   print it and keep the figures

The figures are in budget.csv beside this file. A figure may move by TOLERANCE either way, since compilers of other
versions make other code; a change of the sources that moves it further is to be seen in its commit. A goal is a limit.
"""

import csv
import pathlib
import subprocess
import sys

TOLERANCE = 0.10
HERE = pathlib.Path(__file__).parent
FIGURES = HERE / "budget.csv"
GOALS = {"flash": 96 * 1024, "ram": 16 * 1024, "stack_used": 4096, "stack_bound": 4096}


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


def measure(image, plant_sim):
    """Name and value of every figure: bytes, and instructions a call."""
    text, data, bss = (int(word) for word in run("arm-none-eabi-size", image).splitlines()[1].split()[:3])
    bound = int(run(sys.executable, HERE / "stack.py", image).split()[0])
    figures = {"flash": text + data, "ram": data + bss + bound, "stack_bound": bound}
    for line in run(plant_sim, "cost", "--image", image).splitlines():
        words = line.split()
        if words[0] == "stack":
            figures["stack_used"] = int(words[1])
        elif words[0] != "call":
            name, _, least, median, most = words
            figures[f"{name}_min"], figures[f"{name}_median"], figures[f"{name}_max"] = map(int, (least, median, most))
    return figures


def main():
    image, plant_sim = sys.argv[1:3]
    figures = measure(image, plant_sim)
    if "--update" in sys.argv:
        with FIGURES.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([("figure", "value"), *figures.items()])
    with FIGURES.open() as file:
        kept = {row["figure"]: int(row["value"]) for row in csv.DictReader(file)}
    missed = sorted(kept.keys() ^ figures.keys())
    print(f"{'figure':<24}{'value':>8}{'kept':>8}{'goal':>8}")
    for name, value in figures.items():
        goal = GOALS.get(name)
        print(f"{name:<24}{value:>8}{kept.get(name, '-'):>8}{goal or '-':>8}")
        if abs(value - kept.get(name, value)) > TOLERANCE * kept.get(name, value) or goal and value > goal:
            missed.append(name)
    if missed:
        sys.exit(f"budget.py: more than {TOLERANCE:.0%} from the kept figure, or over the goal: {', '.join(missed)}")


main()
