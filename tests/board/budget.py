"""Memory and instructions of the images for the emulated Cortex-M4F, compared with goals and with the recorded figures.

    tests/board/budget.py FOLDER PLANT_SIM            print the table; exit 1 if a goal or a figure is missed
    tests/board/budget.py FOLDER PLANT_SIM --update   print it and record the figures

FOLDER is where cargo has put the images. The figures are in budget.csv next to this file. A figure may change by
TOLERANCE (or SLACK) either way, since other compiler versions generate other code; a change of the sources that moves it
further must update it in its commit. A goal is a limit.
"""

import csv
import json
import pathlib
import subprocess
import sys

TOLERANCE = 0.10
# Small figures may change by this much: a few instructions are a large part of them.
SLACK = 16
# What evaluates a law; the deepest is the one in task space.
LAW_FUNCTION = "Selection::torque"
HERE = pathlib.Path(__file__).parent
FIGURES = HERE / "budget.csv"
FLASH, RAM, STACK, LAW_STACK = 128 * 1024, 16 * 1024, 4096, 260
SAMPLE, CALL, LAW, JOINT_LAW = 3000, 4000, 680, 330
# Every scenario whose run a fault does not end. Samples that follow a curve of the tool or two moves, or change their pace, take more than
# SAMPLE; those in which a torque is cut while the pace changes, more than CALL.
SCENARIOS = {
    "gate-mismatch": SAMPLE, "gate-vertical": SAMPLE, "gate-22kg": SAMPLE, "pick-place": SAMPLE,
    "payload-change": SAMPLE, "far-reach": SAMPLE, "long-run": SAMPLE, "heavier-load": SAMPLE,
    "palletise": CALL, "square": CALL, "arc": CALL, "screw": CALL, "near-singular": CALL, "blend": CALL, "override": CALL,
}
CUT = 4400
GOALS = {
    "flash": FLASH, "ram": RAM, "stack_used": STACK, "stack_bound": STACK, "law_stack": LAW_STACK,
    "sample_max": SAMPLE, "sample_planning_max": CALL, "other_frame_max": CALL, "no_frame_max": CALL,
    "law_max": LAW, "joint_law_max": JOINT_LAW,
    "stm32g474_flash": FLASH, "stm32g474_ram": RAM,
}
for scenario, goal in SCENARIOS.items():
    GOALS[f"{scenario}_sample"] = goal
    GOALS[f"{scenario}_planning"] = CUT if scenario == "heavier-load" else CALL


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


def sizes(image):
    """Bytes in flash and of static data."""
    text, data, bss = (int(word) for word in run("arm-none-eabi-size", image).splitlines()[1].split()[:3])
    return text + data, data + bss


def measure(folder, plant_sim):
    """Name and value of every figure: bytes, and instructions per call or phase."""
    image, cost_image = folder / "mps2-an386", folder / "mps2-an386-cost"
    flash, static = sizes(image)
    bound, law_bound = (int(run(sys.executable, HERE / "stack.py", image, *of)) for of in ((), (LAW_FUNCTION,)))

    def cost(*options):
        return json.loads(run(plant_sim, "cost", "--json", "--image", image, "--cost-image", cost_image, *options))

    dearest, joint = cost(), cost("--law", "computed-torque:observer")
    figures = {"flash": flash, "ram": static + bound, "stack_bound": bound, "stack_used": dearest["stack"], "law_stack": law_bound}
    rows = [(row["name"], row) for row in dearest["calls"] + dearest["phases"]]
    rows += [("joint_law", row) for row in joint["phases"] if row["name"] == "law"]
    for name, row in rows:
        for figure in ("min", "median", "max"):
            figures[f"{name}_{figure}"] = row[figure]
    figures["stm32g474_flash"], figures["stm32g474_ram"] = sizes(folder / "stm32g474")
    for scenario in SCENARIOS:
        most = {row["name"]: row["max"] for row in cost("--scenario", scenario)["calls"]}
        figures[f"{scenario}_sample"], figures[f"{scenario}_planning"] = most["sample"], most["sample_planning"]
    return figures


def main():
    figures = measure(pathlib.Path(sys.argv[1]), sys.argv[2])
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
        moved = abs(value - kept.get(name, value))
        if moved > max(SLACK, TOLERANCE * kept.get(name, value)) or goal and value > goal:
            missed.append(name)
    if missed:
        sys.exit(f"budget.py: too far from the recorded figure, or over the goal: {', '.join(missed)}")


main()
